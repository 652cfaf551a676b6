"""An expanded energy tree, read as a law of measures."""

from __future__ import annotations

from typing import Any

import sympy as sp

from yarnverify.symbolic.document import Section
from yarnverify.symbolic.functions import unfolded
from yarnverify.symbolic.measures import Measure, NoMeasuresError, Segment, scalar_name, scalar_symbol
from yarnverify.symbolic.tree import Expr, Name


class exponential(sp.Function):  # type: ignore[misc]
    """An exponential that SymPy does not open: ``exp(a + b)`` stays what it is."""

    def fdiff(self, argindex: int = 1) -> Any:
        return self


class Law:
    """Reads an expanded energy tree as a law of measures."""

    def __init__(self, section: Section, named: dict[Expr, Name]) -> None:
        self.section, self.named = section, named
        self.measures: dict[Any, Measure] = {}

    def scalar(self, expr: Expr) -> Any:
        op, args = expr.op, expr.args
        match op:
            case "number":
                return sp.Integer(int(str(expr.value)))
            case "pi":
                return sp.pi
            case "symbol":
                if expr.name.bold:
                    raise NoMeasuresError
                return scalar_symbol(expr.name)
            case "add":
                return sp.Add(*[self.scalar(arg) for arg in args])
            case "neg":
                return -self.scalar(args[0])
            case "mul":
                return sp.Mul(*[self.scalar(arg) for arg in args])
            case "frac":
                return self.scalar(args[0]) / self.scalar(args[1])
            case "pow":
                assert isinstance(expr.value, int)
                return self.scalar(args[0]) ** expr.value
            case "sqrt":
                return sp.sqrt(self.scalar(args[0]))
            case "abs":
                return self._absolute(self.scalar(args[0]))
            case "norm":
                try:
                    return self._absolute(self.scalar(args[0]))
                except NoMeasuresError:
                    scale, segment = self.vector(args[0])
                    return self._absolute(scale) * self._length(segment)
            case "call":
                plain = unfolded(expr)
                if plain is not None:
                    return self.scalar(plain)
                if expr.value == "arccos":
                    return self._angle(args[0])
                function = {"sin": sp.sin, "cos": sp.cos, "tan": sp.tan, "log": sp.log, "exp": exponential}[
                    str(expr.value)
                ]
                return function(self.scalar(args[0]))
        raise NoMeasuresError

    def _absolute(self, value: Any) -> Any:
        """Absolute value; its sign is that of an assumption where one settles it."""
        if value.is_nonnegative:
            return value
        for assumption in self.section.assumptions:
            try:
                known = self.scalar(self.section.expand(assumption.left)) - self.scalar(
                    self.section.expand(assumption.right)
                )
            except NoMeasuresError:
                continue
            if sp.expand(value - known) == 0:
                return value
            if sp.expand(value + known) == 0:
                return -value
        declared = self.section.declared
        positive = [parameter.name for parameter in declared.parameters if parameter.positive] if declared else []
        return value if value.is_Symbol and scalar_name(value) in positive else sp.Abs(value)

    def vector(self, expr: Expr) -> tuple[Any, Segment]:
        """A vector as (scale, segment)."""
        op, args = expr.op, expr.args
        if op in ("neg", "transpose"):
            scale, segment = self.vector(args[0])
            return (-scale if op == "neg" else scale), segment
        if op == "frac":
            scale, segment = self.vector(args[0])
            return scale / self.scalar(args[1]), segment
        if op == "mul":
            vectors, scale = [], sp.S.One
            for arg in args:
                try:
                    scale *= self.scalar(arg)
                except NoMeasuresError:
                    vectors.append(arg)
            if len(vectors) == 1:
                inner, segment = self.vector(vectors[0])
                return scale * inner, segment
        if op == "add" and len(args) == 2:
            plus = [arg.name for arg in args if arg.op == "symbol" and arg.name.bold]
            minus = [
                arg.args[0].name
                for arg in args
                if arg.op == "neg" and arg.args[0].op == "symbol" and arg.args[0].name.bold
            ]
            if len(plus) == len(minus) == 1:
                tail, head = sorted((plus[0], minus[0]), key=lambda n: (n.base, len(n.sub), n.sub))
                return (sp.S.One if plus[0] == head else -sp.S.One), Segment(tail, head)
        raise NoMeasuresError

    def _length(self, segment: Segment) -> sp.Symbol:
        symbol = segment.l.name
        self.measures.setdefault(segment, Measure(symbol, segment))
        return sp.Symbol(str(symbol), real=True)

    def _angle(self, cosine: Expr) -> sp.Symbol:
        sign, scale = 1, sp.S.One
        while cosine.op == "neg":
            sign, cosine = -sign, cosine.args[0]
        factors: list[Expr] = []
        for part in _factors(cosine):
            if part.op == "neg":
                sign, part = -sign, part.args[0]
            factors.append(part)
        found = []
        for factor in factors:
            try:
                scale *= self.scalar(factor)
            except NoMeasuresError:
                found.append(self.vector(factor))
        if len(found) != 2:
            raise NoMeasuresError
        (p, a), (q, b) = found
        ratio = sp.cancel(sign * scale * p * q * self._length(a) * self._length(b))
        if a == b or ratio not in (1, -1):
            raise NoMeasuresError
        key = (frozenset((a, b)), int(ratio))
        if key not in self.measures:
            a, b = sorted((a, b), key=lambda s: s.sub)
            taken = {measure.symbol for measure in self.measures.values()}
            free = (Name("theta", str(i) if i else "") for i in range(99))
            default = next(n for n in free if n not in taken and n not in self.section.parameters)
            self.measures[key] = Measure(default, a, b, int(ratio))
            for tree, name in self.named.items():
                other = Law(self.section, {})
                try:
                    if other.scalar(tree) is not None and key in other.measures and tree.op == "call":
                        self.measures[key] = Measure(name, a, b, int(ratio))
                except NoMeasuresError:
                    continue
        return scalar_symbol(self.measures[key].symbol)


def _factors(expr: Expr) -> list[Expr]:
    if expr.op in ("mul", "dot"):
        return [part for arg in expr.args for part in _factors(arg)]
    return [expr]
