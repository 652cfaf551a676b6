"""Measures: lengths of segments and angles between them, with their derivatives in vector form.

With ``d``, ``P = I - d d^T`` and ``l`` of each segment, and an angle with ``cos t = s da . db``:

    length  l:              dl = d,                    ddl = P / l
    angle   t:              dt/da = -s Pa db / (la sin t)
                            ddt/dada = (cos t Pa + s (da db^T Pa + Pa db da^T) - cot t/sin t Pa db db^T Pa) / (la^2 sin t)
                            ddt/dadb = -(s Pa Pb + cos t/sin^2 t Pa db da^T Pb) / (la lb sin t)

Nothing here is taken on trust: ``Derivation.check`` proves every block that is made from these.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy as sp

from yarnverify.symbolic.declare import length
from yarnverify.symbolic.tree import Expr, Name


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
        sine = sp.sin(scalar_symbol(self.symbol))
        pairs = ((self.a, self.b), (self.b, self.a))
        return tuple((a, -self.sign / (scalar_symbol(a.l.name) * sine), (a.P, b.d)) for a, b in pairs)

    def bend(self, first: Segment, second: Segment) -> list[tuple[Any, tuple[Expr, ...]]]:
        """Hessian block by two segments' vectors, as a sum of (scalar, matrix factors)."""
        if first not in self.segments or second not in self.segments:
            return []
        if self.b is None:
            return [(1 / scalar_symbol(first.l.name), (first.P,))]
        t, la = scalar_symbol(self.symbol), scalar_symbol(first.l.name)
        sine, cosine = sp.sin(t), sp.cos(t)
        a, s = first, self.sign
        if first != second:
            b, scale = second, 1 / (la * scalar_symbol(second.l.name) * sine)
            return [(-s * scale, (a.P, b.P)), (-scale * cosine / sine**2, (a.P, b.d, a.d.T, b.P))]
        b = self.b if first == self.a else self.a
        scale = 1 / (la**2 * sine)
        return [
            (scale * cosine, (a.P,)),
            (s * scale, (a.d, b.d.T, a.P)),
            (s * scale, (a.P, b.d, a.d.T)),
            (-scale * cosine / sine**2, (a.P, b.d, b.d.T, a.P)),
        ]


def differentiate(value: Any, *by: sp.Symbol) -> Any:
    """Derivative where it exists: that of a sign is zero."""
    return sp.diff(value, *by).replace(sp.DiracDelta, lambda *args: sp.S.Zero)


def scalar_symbol(name: Name) -> sp.Symbol:
    return sp.Symbol(str(name), real=True)


def scalar_name(symbol: sp.Symbol) -> Name:
    base, _, sub = str(symbol).partition("_")
    return Name(base, sub)
