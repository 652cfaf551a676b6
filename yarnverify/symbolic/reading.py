"""What the SymPy readings share: shapes, and the walk over a tree. The numbers are the reading's own.

A scalar is whatever the reading computes with; a vector or covector is a list of 3, a matrix a list of 3 rows.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

from yarnverify.symbolic.document import Section
from yarnverify.symbolic.exponentials import NAMES
from yarnverify.symbolic.functions import SAFE, is_turn, unfolded
from yarnverify.symbolic.tree import Expr, Name

Value = Any


class UnsupportedError(Exception):
    """A formula that a reading cannot decide; the reason is for the user."""


class Reading(ABC):
    """Values of the trees of one section, over scalars that a subclass provides."""

    def __init__(self, section: Section) -> None:
        self.section = section
        self._values: dict[Name, Value] = {}

    @abstractmethod
    def constant(self, value: Any) -> Any:
        """A number."""

    @abstractmethod
    def leaf(self, name: Name) -> Value:
        """A symbol that has no definition."""

    @abstractmethod
    def sqrt(self, value: Any) -> Any: ...

    @abstractmethod
    def absolute(self, value: Any) -> Any: ...

    @abstractmethod
    def arccos(self, cosine: Any) -> Any: ...

    @abstractmethod
    def circle(self, angle: Any) -> tuple[Any, Any]:
        """Sine and cosine."""

    def log(self, value: Any) -> Any:
        raise UnsupportedError("a logarithm")

    def exp(self, value: Any) -> Any:
        raise UnsupportedError("an exponential")

    def safe(self, name: str, args: tuple[Expr, ...]) -> Any:
        """A function of safe forms, or an angle by its two arguments, as it is; None where its meaning is to be read."""
        return None

    pi: Any

    def hold(self, value: Any) -> Any:
        """An intermediate scalar that is used more than once; a reading that writes programs gives it a name."""
        return value

    def symbol(self, name: Name) -> Value:
        """Value of a symbol: through its definition, or as a leaf."""
        if name not in self._values:
            meaning = self.section.meaning(name)
            self._values[name] = self.leaf(name) if meaning is None else self.value(meaning)
        return self._values[name]

    def value(self, expr: Expr, blocks: Callable[[Expr], Value] | None = None) -> Value:
        """Value of a tree; ``blocks`` gives the values of forces, energies and derivatives.

        Raises
        ------
        UnsupportedError
            Where the tree holds what this reading does not decide.
        ZeroDivisionError
            Where a denominator is identically zero.
        """
        op, args = expr.op, expr.args
        if op in {"force", "energy", "derivative"}:
            if blocks is None:
                raise UnsupportedError("a force or a derivative inside a definition")
            return blocks(expr)
        if op == "symbol":
            return self.symbol(expr.name)
        if op == "call" and (plain := unfolded(expr)) is not None:
            found = self.safe(str(expr.value), args) if expr.value in SAFE or is_turn(expr) else None
            return self.value(plain, blocks) if found is None else found
        values = [self.value(arg, blocks) for arg in args]
        match op:
            case "number":
                return self.constant(expr.value)
            case "pi":
                return self.pi
            case "identity":
                return [[self.constant(int(i == j)) for j in range(3)] for i in range(3)]
            case "add":
                return fold(values, plus)
            case "neg":
                return map_value(values[0], lambda v: -v)
            case "mul":
                return self._product(values, [self._rank(arg, value) for arg, value in zip(args, values, strict=True)])
            case "frac":
                if not isinstance(values[0], list):
                    return values[0] / values[1]
                inverse = self.hold(self.constant(1) / values[1])
                return map_value(values[0], lambda v: v * inverse)
            case "pow":
                assert isinstance(expr.value, int)
                return self.hold(values[0]) ** expr.value
            case "transpose":
                matrix = isinstance(values[0], list) and isinstance(values[0][0], list)
                return [list(column) for column in zip(*values[0], strict=True)] if matrix else values[0]
            case "norm":
                if not isinstance(values[0], list):
                    return self.absolute(values[0])
                return self.sqrt(fold([v * v for v in values[0]], plus))
            case "abs":
                return self.absolute(values[0])
            case "sqrt":
                return self.sqrt(values[0])
            case "cross":
                (a, b, c), (x, y, z) = values
                return [b * z - c * y, c * x - a * z, a * y - b * x]
            case "dot":
                if isinstance(values[0], list) and isinstance(values[1], list):
                    return fold([v * w for v, w in zip(*values, strict=True)], plus)
                return self._product(values, [self._rank(arg, v) for arg, v in zip(args, values, strict=True)])
            case "call":
                if expr.value == "arccos":
                    return self.arccos(values[0])
                if expr.value in NAMES:
                    return self.log(values[0]) if expr.value == "log" else self.exp(values[0])
                sine, cosine = self.circle(values[0])
                return {"sin": lambda: sine, "cos": lambda: cosine, "tan": lambda: sine / cosine}[str(expr.value)]()
        raise AssertionError(f"no such operation: {op}")

    def _product(self, values: list[Value], kinds: list[str]) -> Value:
        """Ordered product: scalars are gathered, and what an outer product joins is worked out first on either side."""
        scalars = [value for value, kind in zip(values, kinds, strict=True) if kind == "scalar"]
        others = [(value, kind) for value, kind in zip(values, kinds, strict=True) if kind != "scalar"]
        scale = fold(scalars, lambda a, b: a * b) if scalars else None
        if not others:
            return scale
        value = self._chain(others)[0]
        if scale is None:
            return value
        scale = self.hold(scale)
        return scaled(value, scale)

    def _chain(self, factors: list[tuple[Value, str]]) -> tuple[Value, str]:
        for i in range(len(factors) - 1):
            if factors[i][1] == "vector" and factors[i + 1][1] == "covector":
                (left, before), (right, after) = self._chain(factors[: i + 1]), self._chain(factors[i + 1 :])
                if before == "scalar":
                    return scaled(right, self.hold(left)), after
                if after == "scalar":
                    return scaled(left, self.hold(right)), before
                left, right = map_value(left, self.hold), map_value(right, self.hold)
                return [[a * b for b in right] for a in left], "matrix"
        (left, kind), *rest = factors
        for right, other in rest:
            if kind == "scalar":
                scale = self.hold(left)
                left, kind = scaled(right, scale), other
            elif (kind, other) == ("covector", "vector"):
                left, kind = fold([a * b for a, b in zip(left, right, strict=True)], plus), "scalar"
            elif (kind, other) == ("covector", "matrix"):
                left = [fold([left[k] * right[k][j] for k in range(3)], plus) for j in range(3)]
            elif (kind, other) == ("matrix", "vector"):
                left, kind = [fold([row[k] * right[k] for k in range(3)], plus) for row in left], "vector"
            else:
                left = [[fold([row[k] * right[k][j] for k in range(3)], plus) for j in range(3)] for row in left]
            left = map_value(left, self.hold)
        return left, kind

    def _rank(self, expr: Expr, value: Value) -> str:
        if not isinstance(value, list):
            return "scalar"
        return "matrix" if isinstance(value[0], list) else self.section.type_of(expr).value


def map_value(value: Value, change: Callable[[Any], Any]) -> Value:
    return [map_value(v, change) for v in value] if isinstance(value, list) else change(value)


def scaled(value: Value, scale: Any) -> Value:
    return map_value(value, lambda v: scale * v)


def plus(left: Value, right: Value) -> Value:
    if isinstance(left, list):
        return [plus(a, b) for a, b in zip(left, right, strict=True)]
    return left + right


def fold(values: list[Value], combine: Callable[[Value, Value], Value]) -> Value:
    total = values[0]
    for value in values[1:]:
        total = combine(total, value)
    return total
