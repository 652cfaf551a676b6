"""Gradient and Hessian of an energy in vector form, by the chain rule over its measures.

An energy is a law ``F(m_1, m_2, ..., u_1, ...)`` of a few measures of its segments: lengths, and angles between directions.
SymPy differentiates the law; the derivatives of a measure are known once and for all (``measures_of``), with
``d``, ``P = I - d d^T`` and ``l`` of each segment:

    length  l:              dl = d,                    ddl = P / l
    angle   cos t = s da.db: dt/da = -s Pa db / (la sin t)
                            ddt/dada = (cos t Pa + s (da db^T Pa + Pa db da^T) - cot t/sin t Pa db db^T Pa) / (la^2 sin t)
                            ddt/dadb = -(s Pa Pb + cos t/sin^2 t Pa db da^T Pb) / (la lb sin t)

Nothing here is taken on trust: ``Derivation.check`` proves every block against the exact derivatives of the energy.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import sympy as sp

from yarnverify.symbolic.declare import Energy, Quantity, angle, length, unit
from yarnverify.symbolic.document import Definition, Section, block_of
from yarnverify.symbolic.prove import Court, Finding
from yarnverify.symbolic.reader import Relation
from yarnverify.symbolic.tree import FORCE, IDENTITY, ONE, PI, ZERO, Expr, Name, number

_NOWHERE = Relation((), (), "", 0, True)


class NoMeasuresError(Exception):
    """The energy is not a law of known measures."""


@dataclass(frozen=True)
class Segment:
    """The segment from ``tail`` to ``head``, with the symbols of its length, direction and projection."""

    tail: Name
    head: Name

    @property
    def sub(self) -> str:
        return self.head.sub if self.tail.sub == "0" else self.tail.sub + self.head.sub

    @property
    def vector(self) -> Expr:
        return Expr("symbol", value=self.head) - Expr("symbol", value=self.tail)

    @property
    def l(self) -> Expr:  # noqa: E743
        return Expr("symbol", value=Name("l", self.sub))

    @property
    def d(self) -> Expr:
        return Expr("symbol", value=Name("d", self.sub, bold=True))

    @property
    def P(self) -> Expr:
        return Expr("symbol", value=Name("P", self.sub, bold=True))

    def end(self, point: Name) -> int:
        """Derivative of the segment's vector by a point: 1 for its head, -1 for its tail, else 0."""
        return int(point == self.head) - int(point == self.tail)


@dataclass(frozen=True)
class Measure:
    """The length of a segment, or an angle with ``cos = sign * d_a . d_b``."""

    symbol: Name
    a: Segment
    b: Segment | None = None
    sign: int = 1

    @property
    def segments(self) -> tuple[Segment, ...]:
        return (self.a,) if self.b is None else (self.a, self.b)

    @property
    def definition(self) -> Expr:
        if self.b is None:
            return length(self.a.vector)
        cosine = self.a.d.T * self.b.d
        return Expr("call", (cosine if self.sign > 0 else -cosine,), "arccos")

    @property
    def slope(self) -> tuple[tuple[Segment, Any, tuple[Expr, ...]], ...]:
        """Gradient by each segment's vector: (segment, scalar, vector factors)."""
        if self.b is None:
            return ((self.a, sp.S.One, (self.a.d,)),)
        sine = sp.sin(_scalar(self.symbol))
        pairs = ((self.a, self.b), (self.b, self.a))
        return tuple((a, -self.sign / (_scalar(a.l.name) * sine), (a.P, b.d)) for a, b in pairs)

    def bend(self, first: Segment, second: Segment) -> list[tuple[Any, tuple[Expr, ...]]]:
        """Hessian block by two segments' vectors, as a sum of (scalar, matrix factors)."""
        if first not in self.segments or second not in self.segments:
            return []
        if self.b is None:
            return [(1 / _scalar(first.l.name), (first.P,))]
        t, la = _scalar(self.symbol), _scalar(first.l.name)
        sine, cosine = sp.sin(t), sp.cos(t)
        a, s = first, self.sign
        if first != second:
            b, scale = second, 1 / (la * _scalar(second.l.name) * sine)
            return [(-s * scale, (a.P, b.P)), (-scale * cosine / sine**2, (a.P, b.d, a.d.T, b.P))]
        b = self.b if first == self.a else self.a
        scale = 1 / (la**2 * sine)
        return [
            (scale * cosine, (a.P,)),
            (s * scale, (a.d, b.d.T, a.P)),
            (s * scale, (a.P, b.d, a.d.T)),
            (-scale * cosine / sine**2, (a.P, b.d, b.d.T, a.P)),
        ]


def _diff(value: Any, *by: sp.Symbol) -> Any:
    """Derivative where it exists: that of a sign is zero."""
    return sp.diff(value, *by).replace(sp.DiracDelta, lambda *args: sp.S.Zero)


def _scalar(name: Name) -> sp.Symbol:
    return sp.Symbol(str(name), real=True)


def _name(symbol: sp.Symbol) -> Name:
    base, _, sub = str(symbol).partition("_")
    return Name(base, sub)


# -- laws -------------------------------------------------------------------------------------------------------------


class _Law:
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
                return _scalar(expr.name)
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
                if expr.value == "arccos":
                    return self._angle(args[0])
                function = {"sin": sp.sin, "cos": sp.cos, "tan": sp.tan}[str(expr.value)]
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
        if value.is_Symbol or value.is_number:
            return value if value.is_Symbol and _name(value) in self.section.parameters else sp.Abs(value)
        return sp.Abs(value)

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
        for part in _flat_product(cosine):
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
                other = _Law(self.section, {})
                try:
                    if other.scalar(tree) is not None and key in other.measures and tree.op == "call":
                        self.measures[key] = Measure(name, a, b, int(ratio))
                except NoMeasuresError:
                    continue
        return _scalar(self.measures[key].symbol)


def _flat_product(expr: Expr) -> list[Expr]:
    if expr.op in ("mul", "dot"):
        return [part for arg in expr.args for part in _flat_product(arg)]
    return [expr]


# -- scalars back to trees --------------------------------------------------------------------------------------------


def scalar_tree(value: Any) -> Expr:
    """A SymPy scalar as a tree, fractions written as fractions."""
    if value.is_Symbol:
        return Expr("symbol", value=_name(value))
    if value.is_Rational:
        return number(sp.Rational(value).p) if value.q == 1 else _fraction(number(int(value.p)), number(int(value.q)))
    if value == sp.pi:
        return PI
    if value.is_Add:
        terms = [scalar_tree(term) for term in sorted(value.args, key=_term_key)]
        return Expr("add", tuple(terms))
    if value.is_Mul or value.is_Pow:
        value = _upright(value)
        above, below = _split(value)
        if below != 1:
            return _fraction(scalar_tree(above), scalar_tree(below))
    if value.is_Mul:
        content, rest = value.as_coeff_Mul()
        if content < 0:
            return -scalar_tree(-value)
        factors = [number(int(content))] if content != 1 else []
        return _product([*factors, *(scalar_tree(f) for f in sorted(sp.Mul.make_args(rest), key=_factor_key))])
    if value.is_Pow:
        if value.exp == sp.Rational(1, 2):
            return Expr("sqrt", (scalar_tree(value.base),))
        if value.exp.is_Rational and value.exp.q == 2:
            whole = scalar_tree(value.base ** (value.exp - sp.Rational(1, 2)))
            return _product([whole, Expr("sqrt", (scalar_tree(value.base),))])
        if value.exp.is_Integer:
            return Expr("pow", (scalar_tree(value.base),), int(value.exp))
    if isinstance(value, sp.sin | sp.cos | sp.tan):
        return Expr("call", (scalar_tree(value.args[0]),), type(value).__name__)
    if isinstance(value, sp.sign):
        return scalar_tree(value.args[0]) / Expr("abs", (scalar_tree(value.args[0]),))
    if isinstance(value, sp.Abs):
        return Expr("abs", (scalar_tree(value.args[0]),))
    raise NoMeasuresError


def _split(value: Any) -> tuple[Any, Any]:
    """Numerator and denominator, factors as they are."""
    above, below = [], []
    for factor in sp.Mul.make_args(value):
        if factor.is_Rational:
            above.append(sp.Integer(factor.p))
            below.append(sp.Integer(factor.q))
        elif factor.is_Pow and factor.exp.is_Rational and factor.exp < 0:
            below.append(sp.Pow(factor.base, -factor.exp))
        else:
            above.append(factor)
    return sp.Mul(*above), sp.Mul(*below, evaluate=len(below) < 2 or not any(b.is_Add for b in below))


def _upright(value: Any) -> Any:
    """A product in which differences such as ``u_0 - u_1`` stand as ``u_1 - u_0``."""
    flipped, factors = False, []
    for factor in sp.Mul.make_args(value):
        base, exponent = factor.as_base_exp()
        signs = {term.as_coeff_Mul() for term in base.args} if base.is_Add and len(base.args) == 2 else set()
        if exponent.is_Integer and {sign for sign, _ in signs} == {1, -1} and all(s.is_Symbol for _, s in signs):
            (first,), (second,) = ([_name(s) for sign, s in signs if sign == want] for want in (1, -1))
            if first.base == second.base and first.sub < second.sub:
                flipped ^= bool(exponent % 2)
                factor = sp.Pow(sp.Add(*[-term for term in base.args]), exponent)
        factors.append(factor)
    return -sp.Mul(*factors) if flipped else value if factors == list(sp.Mul.make_args(value)) else sp.Mul(*factors)


def _fraction(above: Expr, below: Expr) -> Expr:
    if above.op == "neg":
        return -_fraction(above.args[0], below)
    return above / below


def _factor_key(value: Any) -> tuple[int, str]:
    """Parameters, then lengths and coordinates, then functions, then sums."""
    text = str(value)
    order = 3 if value.is_Add or (value.is_Pow and value.base.is_Add) else 2 if value.args and not value.is_Pow else 1
    return (-1 if text[0] == "k" else 0 if len(text) == 1 else order), text


def _term_key(value: Any) -> tuple[bool, str]:
    content, rest = value.as_coeff_Mul()
    return bool(content < 0) or rest.is_number, str(rest)


def _product(factors: list[Expr]) -> Expr:
    factors = [f for f in factors if f != ONE] or [ONE]
    return factors[0] if len(factors) == 1 else Expr("mul", tuple(factors))


def sum_tree(terms: Iterable[tuple[Any, tuple[Expr, ...]]]) -> Expr:
    """``sum scalar * factors``; terms with the same factors are joined, and a scalar shared by all is taken out."""
    joined: dict[tuple[Expr, ...], Any] = {}
    for value, factors in terms:
        joined[factors] = joined.get(factors, sp.S.Zero) + value
    kept = [(_upright(sp.factor_terms(value)), factors) for factors, value in joined.items() if value != 0]
    if not kept:
        return ZERO
    trees = []
    for value, factors in kept:
        negative = value.as_coeff_Mul()[0] < 0
        body = _product([scalar_tree(-value if negative else value), *factors])
        trees.append(-body if negative else body)
    return trees[0] if len(trees) == 1 else Expr("add", tuple(trees))


# -- derivations ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Derivation:
    """Measures, law, and derivatives of an energy. ``section`` defines the symbols that the blocks are written in."""

    section: Section
    energy: Expr
    law: Any
    measures: tuple[Measure, ...]
    unknowns: tuple[Name, ...]

    @cached_property
    def slopes(self) -> dict[Measure, Any]:
        """First derivatives of the law by its measures."""
        return {m: _diff(self.law, _scalar(m.symbol)) for m in self.measures}

    def law_slope(self, *names: Name) -> Any:
        """Derivative of the law by measures and sliding coordinates, as SymPy has it."""
        return sp.factor_terms(_diff(self.law, *(_scalar(name) for name in names)))

    def _measure_slope(self, measure: Measure, unknown: Name) -> list[tuple[Any, tuple[Expr, ...]]]:
        return [(a.end(unknown) * value, factors) for a, value, factors in measure.slope if a.end(unknown)]

    def gradient(self, unknown: Name, scale: int = 1) -> Expr:
        """Gradient block: a vector for a point, a scalar for a sliding coordinate."""
        if not unknown.bold:
            return sum_tree([(scale * _diff(self.law, _scalar(unknown)), ())])
        if self._is_hub(unknown):
            return _minus_sum([Expr("force", value=other) for other in self._others(unknown)])
        terms = []
        for measure in self.measures:
            for value, factors in self._measure_slope(measure, unknown):
                terms.append((scale * self.slopes[measure] * value, factors))
        return sum_tree(terms)

    def hessian(self, row: Name, column: Name, scale: int = 1) -> Expr:
        """Hessian block; rows belong to ``row``."""
        for unknown in (row, column):
            if self._is_hub(unknown):
                pairs = [(o, column) if unknown == row else (row, o) for o in self._others(unknown)]
                return _minus_sum([Expr("derivative", (Expr("force", value=r),), c) for r, c in pairs])
        if not row.bold and not column.bold:
            return sum_tree([(scale * _diff(self.law, _scalar(row), _scalar(column)), ())])
        if not (row.bold and column.bold):
            point, sliding = (row, column) if row.bold else (column, row)
            terms = []
            for measure in self.measures:
                mixed = _diff(self.slopes[measure], _scalar(sliding))
                for value, factors in self._measure_slope(measure, point):
                    terms.append((scale * mixed * value, factors if row.bold else _transposed(factors)))
            return sum_tree(terms)
        terms = []
        for measure in self.measures:
            for a in measure.segments:
                for b in measure.segments:
                    ends = a.end(row) * b.end(column)
                    if ends:
                        terms += [(scale * ends * self.slopes[measure] * v, f) for v, f in measure.bend(a, b)]
            for other in self.measures:
                second = _diff(self.slopes[measure], _scalar(other.symbol))
                for value, left in self._measure_slope(measure, row):
                    for value2, right in self._measure_slope(other, column):
                        terms.append((scale * second * value * value2, (*left, *_transposed(right))))
        return sum_tree(terms)

    @cached_property
    def _segments(self) -> tuple[Segment, ...]:
        return tuple(dict.fromkeys(s for measure in self.measures for s in measure.segments))

    def _is_hub(self, point: Name) -> bool:
        """Whether every segment starts at the point and every other point ends one: then translation gives its rows."""
        tails = {s.tail for s in self._segments}
        return point.bold and tails == {point} and point in self.unknowns

    def _others(self, hub: Name) -> list[Name]:
        return [name for name in self.unknowns if name.bold and name != hub]

    def check(self) -> dict[str, Finding]:
        """Proof of the law and of every block against the energy and its exact derivatives."""
        court = Court(self.section, self.energy)
        found = {"V": court.judge(self.energy, self.law_tree)}
        for force, jacobian in self.blocks(FORCE):
            for block, tree in (force, *jacobian):
                found[block_of(block)] = court.judge(block, tree)
        return found

    @property
    def law_tree(self) -> Expr:
        """The energy in terms of its measures."""
        return scalar_tree(sp.factor(self.law))

    def blocks(self, scale: int) -> Iterable[tuple[tuple[Expr, Expr], list[tuple[Expr, Expr]]]]:
        """For each unknown its gradient block and its Hessian blocks, each times ``scale``, as (name, tree)."""
        for row in self.unknowns:
            force = Expr("force", value=row)
            rest = [
                (Expr("derivative", (force,), column), self.hessian(row, column, scale)) for column in self.unknowns
            ]
            yield (force, self.gradient(row, scale)), rest


def _minus_sum(parts: list[Expr]) -> Expr:
    return -(parts[0] if len(parts) == 1 else Expr("add", tuple(parts)))


def _transposed(factors: tuple[Expr, ...]) -> tuple[Expr, ...]:
    return tuple(f.args[0] if f.op == "transpose" else f if f.name.base == "P" else f.T for f in reversed(factors))


def derive(
    energy: Expr, section: Section, unknowns: tuple[Name, ...], quantities: Iterable[Quantity] = ()
) -> Derivation | None:
    """Derive an energy's gradient and Hessian over its measures; None where it is not a law of known measures.

    Parameters
    ----------
    energy
        The energy's tree; symbols have their meaning in ``section``.
    section
        Definitions, assumptions and parameters.
    unknowns
        The degrees of freedom, in order.
    quantities
        Declared quantities, for the names of angles.
    """
    named = {q.expression: q.symbol for q in quantities}
    named |= {section.expand(d.expression): s for s, d in section.definitions.items() if not d.index}
    reader = _Law(section, {tree: name for tree, name in named.items() if tree.op == "call"})
    try:
        law = reader.scalar(section.expand(energy))
        derivation = _assemble(section, energy, law, tuple(reader.measures.values()), unknowns)
        for _ in derivation.blocks(1):
            pass
    except NoMeasuresError:
        return None
    return derivation


def _assemble(
    section: Section, energy: Expr, law: Any, measures: tuple[Measure, ...], unknowns: tuple[Name, ...]
) -> Derivation:
    own = Section(
        section.title, section.offset, parameters=section.parameters, unknowns=unknowns, declared=section.declared
    )
    own.families |= section.families
    own.assumptions = [
        replace(a, left=section.expand(a.left), right=section.expand(a.right)) for a in section.assumptions
    ]
    used = tuple(m for m in measures if law.has(_scalar(m.symbol)))
    for segment in dict.fromkeys(s for m in used for s in m.segments):
        meanings = {segment.l: length(segment.vector), segment.d: unit(segment.vector)}
        meanings[segment.d] = segment.vector / segment.l
        meanings[segment.P] = IDENTITY - segment.d * segment.d.T
        for symbol, meaning in meanings.items():
            own.definitions[symbol.name] = Definition(symbol.name, meaning, _NOWHERE)
    for measure in used:
        if measure.b is not None:
            own.definitions[measure.symbol] = Definition(measure.symbol, measure.definition, _NOWHERE)
    return Derivation(own, section.expand(energy), law, used, unknowns)


def derive_declared(energy: Energy, quantities: Iterable[Quantity]) -> Derivation | None:
    """Derive a declared energy."""
    section = declared_section(energy)
    mine = [q for q in quantities if q.document == energy.document and q.section in ("", energy.section)]
    return derive(energy.expression, section, energy.unknowns, [q for q in mine if q.section])


def declared_section(energy: Energy) -> Section:
    """The section that a declared energy lives in when no document is at hand."""
    section = Section(energy.section or energy.name, 0, declared=energy)
    section.parameters = tuple(parameter.name for parameter in energy.parameters)
    section.unknowns = energy.unknowns
    section.families |= {(name.base, name.bold) for name in energy.unknowns}
    section.assumptions = list(energy.domain)
    return section


__all__ = ["Derivation", "Measure", "Segment", "angle", "declared_section", "derive", "derive_declared", "scalar_tree"]
