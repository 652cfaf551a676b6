"""Angles between vectors of any kind, such as the normals of two triangles, as steps whose derivatives follow rules.

For vectors a and b with directions p and q let C = p.q = cos t, m = p x q, S = |m|^2, s = |m| = sin t, n = m/s. Then

    dC     = ((m x p)/|a|).da + ((q x m)/|b|).db
    d(t^2) = -2 f dC,  df = -g dC                      f = t/sin t and g of ``angles``: analytic at t = 0
    ds     = n.dm,     d(n.d_i m) = Q_i.Q_j/s + n.d_ij m      where Q_i = d_i m - n (n.d_i m)
    dt     = C ds - s dC

in none of which two large terms leave a small one as t goes to 0, unlike the derivatives of an arc cosine. What is even in an
angle is made of the first two lines and so has derivatives at t = 0; what is odd has none there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol, TypeAlias

import sympy as sp

from yarnverify.symbolic.plain import plain
from yarnverify.symbolic.steps import Check
from yarnverify.symbolic.tree import Expr

Slope: TypeAlias = Callable[[Any, sp.Symbol], Any]  # of an expression by a row
Rule: TypeAlias = Callable[[Slope, sp.Symbol], Any]  # the derivative of a step by a row


class Stepwise(Protocol):
    """A reading that makes steps of values; ``rules`` are the derivatives that some of them have."""

    rules: dict[sp.Symbol, Rule]

    def value(self, expr: Expr) -> Any:
        """Value of a tree."""

    def hold(self, value: Any) -> Any:
        """The symbol of a value."""


def _cross(a: list[Any], b: list[Any]) -> list[Any]:
    (x, y, z), (u, v, w) = a, b
    return [y * w - z * v, z * u - x * w, x * v - y * u]


def _dot(a: list[Any], b: list[Any]) -> Any:
    return sp.Add(*(x * y for x, y in zip(a, b, strict=True)))


@dataclass(eq=False)
class VectorAngle:
    """The angle t between two vectors, or pi less it where ``sign`` is -1; what is used of it becomes a step.

    Attributes
    ----------
    reading
        Whose steps these are.
    a, b
        Trees of the vectors.
    """

    reading: Stepwise
    a: Expr
    b: Expr
    sign: int = 1
    singular: set[str] = field(default_factory=set)

    def _step(self, value: Any, rule: Rule) -> Any:
        symbol = self.reading.hold(value)
        self.reading.rules.setdefault(symbol, rule)
        return symbol

    def _function(self, name: str, sine: Any, cosine: Any, rule: Rule) -> Any:
        return self._step(sp.Function(name, real=True)(sine, cosine), rule)

    @cached_property
    def _sides(self) -> tuple[tuple[list[Any], Any, list[Any]], ...]:
        """Components, length and direction of either vector."""
        hold, found = self.reading.hold, []
        for tree in (self.a, self.b):
            vector, size = self.reading.value(tree), self.reading.value(Expr("norm", (tree,)))
            found.append((vector, size, [hold(part / size) for part in vector]))
        return tuple(found)

    @cached_property
    def _m(self) -> list[Any]:
        (_, _, p), (_, _, q) = self._sides
        return [self.reading.hold(part) for part in _cross(p, q)]

    @cached_property
    def cosine(self) -> Any:
        """cos t."""
        hold, m = self.reading.hold, self._m
        (a, size_a, p), (b, size_b, q) = self._sides
        along_a = [hold(part / size_a) for part in _cross(m, p)]
        along_b = [hold(part / size_b) for part in _cross(q, m)]

        def rule(slope: Slope, row: sp.Symbol) -> Any:
            parts = zip((*along_a, *along_b), (*a, *b), strict=True)
            return self.sign * sp.Add(*(along * slope(component, row) for along, component in parts))

        return self._step(self.sign * _dot(p, q), rule)

    @cached_property
    def sine_squared(self) -> Any:
        """sin(t)^2."""
        cosine = self.cosine
        return self._step(_dot(self._m, self._m), lambda slope, row: -2 * cosine * slope(cosine, row))

    @cached_property
    def squared(self) -> Any:
        """t^2."""
        self.singular.add("pi")
        sine, cosine = self.sine_squared, self.cosine
        excess = self.reading.hold(sp.Function("sine_excess", real=True)(sine, cosine))
        over = self._function("angle_over_sine", sine, cosine, lambda slope, row: -excess * slope(cosine, row))
        return self._function("angle_squared", sine, cosine, lambda slope, row: -2 * over * slope(cosine, row))

    @cached_property
    def versine(self) -> Any:
        """1 - cos t."""
        cosine = self.cosine
        return self._function("versine", self.sine_squared, cosine, lambda slope, row: -slope(cosine, row))

    @cached_property
    def vercosine(self) -> Any:
        """1 + cos t."""
        cosine = self.cosine
        return self._function("versine", self.sine_squared, -cosine, lambda slope, row: slope(cosine, row))

    @cached_property
    def sine(self) -> Any:
        """sin t."""
        self.singular |= {"0", "pi"}
        hold, m = self.reading.hold, self._m
        s = hold(sp.sqrt(self.sine_squared))
        n = [hold(part / s) for part in m]

        def rule(slope: Slope, row: sp.Symbol) -> Any:
            def across(one: sp.Symbol) -> list[Any]:
                along = rule(slope, one)
                return [hold(slope(part, one) - unit * along) for part, unit in zip(m, n, strict=True)]

            def second(slope: Slope, column: sp.Symbol) -> Any:
                bent = _dot(n, [slope(slope(part, row), column) for part in m])
                return _dot(across(row), across(column)) / s + bent

            found = hold(_dot(n, [slope(part, row) for part in m]))
            if found.is_Symbol:
                self.reading.rules.setdefault(found, second)
            return found

        self.reading.rules.setdefault(s, rule)
        return s

    def _turn(self, slope: Slope, row: sp.Symbol) -> Any:
        return self.cosine * slope(self.sine, row) - self.sine * slope(self.cosine, row)

    @cached_property
    def angle(self) -> Any:
        """t."""
        return self._function("angle", self.sine, self.cosine, self._turn)

    @cached_property
    def deviation(self) -> Any:
        """t - pi/2."""
        return self._function("deviation", self.sine, self.cosine, self._turn)

    @cached_property
    def half(self) -> dict[str, Any]:
        """Sine, cosine and tangent of t/2."""
        hold, vercosine = self.reading.hold, self.vercosine
        cosine = hold(sp.sqrt(vercosine / 2))
        return {
            "cos": cosine,
            "sin": self._step(sp.sqrt(self.versine / 2), lambda slope, row: cosine * self._turn(slope, row) / 2),
            "tan": self._function(
                "half_tangent", self.sine, self.cosine, lambda slope, row: self._turn(slope, row) / vercosine
            ),
        }

    def of(self, function: str) -> Any:
        """Sine, cosine or tangent of t."""
        return {"sin": lambda: self.sine, "cos": lambda: self.cosine, "tan": lambda: self.sine / self.cosine}[
            function
        ]()

    def square_of(self, function: str, half: bool) -> Any:
        """The square of a function of t or of t/2, which is even."""
        if half:
            above = {"sin": self.versine / 2, "cos": self.vercosine / 2}
            return above[function] if function in above else self.versine / self.vercosine
        squares = {"sin": self.sine_squared, "cos": self.cosine**2}
        return squares[function] if function in squares else self.sine_squared / self.cosine**2

    def checks(self) -> Iterator[Check]:
        """What is wrong where the angle is 0 or pi and derivatives are wanted that do not exist there."""
        name = f"the angle between {plain(self.a)} and {plain(self.b)}"
        if "0" in self.singular:
            yield self.sine, "derivatives", f"{name} is 0 or pi, where the energy has no derivative"
        elif self.singular:
            end = "pi" if self.sign > 0 else "0"
            yield self.vercosine, "derivatives", f"{name} is {end}, where the energy has no derivative"
