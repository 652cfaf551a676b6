"""Polynomials modulo the squares of roots, and quotients of them: what normal forms are computed with.

Relations are ``r^2 = R``, with R over generators later in the list. Their leading monomials are pure powers of distinct
generators, so they are a Groebner basis for the lexicographic order, and the remainder of a polynomial is its normal form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import flint
from sympy import QQ, Symbol, factorint
from sympy.polys.orderings import lex
from sympy.polys.rings import ring

from yarnverify.symbolic.reading import UnsupportedError

Poly = Any  # a SymPy PolyElement
_LARGEST_PRODUCT = 200_000  # terms times terms; the paper's formulas stay below a thirtieth of it


@dataclass(frozen=True, eq=False)
class Quotient:
    """``numerator / product of factor^power``, numerator reduced by the relations."""

    relations: Relations
    numerator: Poly
    factors: tuple[tuple[Poly, int], ...] = ()

    def _lift(self, other: Quotient | int) -> Quotient:
        return other if isinstance(other, Quotient) else self.relations.constant(other)

    def __add__(self, other: Quotient | int) -> Quotient:
        other = self._lift(other)
        if not other.numerator:
            return self
        if not self.numerator:
            return other
        if self.factors == other.factors:
            return self.relations.quotient(self.numerator + other.numerator, self.factors)
        mine, theirs = dict(self.factors), dict(other.factors)
        common = {f: max(mine.get(f, 0), theirs.get(f, 0)) for f in (*mine, *theirs)}
        left, right = self.numerator, other.numerator
        for factor, power in common.items():
            left = self.relations.times_power(left, factor, power - mine.get(factor, 0))
            right = self.relations.times_power(right, factor, power - theirs.get(factor, 0))
        return self.relations.quotient(left + right, tuple(common.items()))

    __radd__ = __add__

    def __neg__(self) -> Quotient:
        return Quotient(self.relations, -self.numerator, self.factors)

    def __sub__(self, other: Quotient | int) -> Quotient:
        return self + (-self._lift(other))

    def __rsub__(self, other: int) -> Quotient:
        return self._lift(other) + (-self)

    def __mul__(self, other: Quotient | int) -> Quotient:
        other = self._lift(other)
        if not self.numerator or not other.numerator:
            return self.relations.constant(0)
        self.relations.check_size(self.numerator, other.numerator)
        factors = dict(self.factors)
        for factor, power in other.factors:
            factors[factor] = factors.get(factor, 0) + power
        return self.relations.quotient(self.relations.reduce(self.numerator * other.numerator), tuple(factors.items()))

    __rmul__ = __mul__

    def inverse(self) -> Quotient:
        if not self.numerator:
            raise ZeroDivisionError
        content, parts = self.relations.factor(self.numerator)
        top = self.relations.ring(1) / content
        for factor, power in self.factors:
            top = self.relations.times_power(top, factor, power)
        return self.relations.quotient(top, parts)

    def __truediv__(self, other: Quotient | int) -> Quotient:
        return self * self._lift(other).inverse()

    def __rtruediv__(self, other: int) -> Quotient:
        return self._lift(other) * self.inverse()

    def __pow__(self, exponent: int) -> Quotient:
        if exponent < 0:
            return self.inverse() ** -exponent
        result = self.relations.constant(1)
        for _ in range(exponent):
            result = result * self
        return result

    @property
    def is_zero(self) -> bool:
        return not self.numerator


class Relations:
    """A polynomial ring over the rationals, with squares of some generators given.

    Parameters
    ----------
    labels
        The generators, larger ones first.
    """

    def __init__(self, labels: Sequence[str]) -> None:
        self.ring, *generators = ring([Symbol(label) for label in labels], QQ, lex)  # as text, SymPy would split names
        self.generator = dict(zip(labels, generators, strict=True))
        self._position = {label: i for i, label in enumerate(labels)}
        self.squares: dict[str, Poly] = {}
        self._factored: dict[Poly, tuple[Any, tuple[tuple[Poly, int], ...]]] = {}

    def relate(self, label: str, square: Poly) -> None:
        """Give the square of a generator, over smaller ones."""
        self.squares[label] = square
        self.__dict__.pop("_order", None)

    def labels(self, poly: Poly) -> list[str]:
        """Generators that occur in a polynomial, larger ones first."""
        return [self.ring.symbols[i].name for i in range(self.ring.ngens) if any(monomial[i] for monomial in poly)]

    def split(self, poly: Poly, label: str) -> tuple[Poly, Poly]:
        """``u, v`` of a reduced polynomial ``u + v r``, where r has a square."""
        position = self._position[label]
        parts: tuple[dict[tuple[int, ...], Any], dict[tuple[int, ...], Any]] = ({}, {})
        for monomial, coefficient in poly.items():
            parts[monomial[position]][(*monomial[:position], 0, *monomial[position + 1 :])] = coefficient
        u, v = (self.ring.from_dict(part) for part in parts)
        return u, v

    def make(self, label: str) -> Quotient:
        return Quotient(self, self.generator[label])

    def constant(self, value: Any) -> Quotient:
        return Quotient(self, self.ring(QQ(value.numerator, value.denominator)))

    def reduce(self, poly: Poly) -> Poly:
        """Remainder by the relations."""
        for label in self._order:
            position, square = self._position[label], self.squares[label]
            if not any(monomial[position] > 1 for monomial in poly):
                continue
            parts: dict[int, Any] = {}
            for monomial, coefficient in poly.items():
                half, odd = divmod(monomial[position], 2)
                rest = (*monomial[:position], odd, *monomial[position + 1 :])
                part = parts.setdefault(half, {})
                part[rest] = part.get(rest, QQ(0)) + coefficient
            total, power, at = self.ring(0), self.ring(1), 0
            for half in sorted(parts):
                for _ in range(half - at):
                    power = power * square
                at = half
                total = total + self.ring.from_dict({m: c for m, c in parts[half].items() if c}) * power
            poly = total
        return poly

    @cached_property
    def _order(self) -> list[str]:
        return sorted(self.squares, key=self._position.__getitem__)

    def quotient(self, numerator: Poly, factors: tuple[tuple[Poly, int], ...]) -> Quotient:
        """A value in which powers of plain generators are cancelled, so that degrees stay low."""
        if not numerator:
            return Quotient(self, numerator)
        kept = []
        for factor, power in factors:
            if power and len(factor) == 1:
                (position,) = (i for i, e in enumerate(factor.LM) if e)
                shared = min(power, min(monomial[position] for monomial in numerator))
                if shared:
                    numerator = self.ring.from_dict(
                        {(*m[:position], m[position] - shared, *m[position + 1 :]): c for m, c in numerator.items()}
                    )
                    power -= shared
            if power:
                kept.append((factor, power))
        return Quotient(self, numerator, tuple(kept))

    @staticmethod
    def check_size(a: Poly, b: Poly) -> None:
        """Refuse products that would take minutes."""
        if len(a) * len(b) > _LARGEST_PRODUCT:
            raise UnsupportedError(f"the normal form grows beyond {_LARGEST_PRODUCT} products of terms")

    def times_power(self, poly: Poly, factor: Poly, power: int) -> Poly:
        for _ in range(power):
            self.check_size(poly, factor)
            poly = self.reduce(poly * factor)
        return poly

    def factor(self, poly: Poly) -> tuple[Any, tuple[tuple[Poly, int], ...]]:
        """Rational content, and factors with their powers."""
        if len(poly) == 1:
            monomial, content = poly.LM, poly.LC
            return content, tuple((self.ring.gens[i], e) for i, e in enumerate(monomial) if e)
        if poly not in self._factored:
            self._factored[poly] = self._find_factors(poly)
        return self._factored[poly]

    def _find_factors(self, poly: Poly) -> tuple[Any, tuple[tuple[Poly, int], ...]]:
        """Factors over the generators that occur, by FLINT, since SymPy's own factoring may run for hours here."""
        used = [i for i in range(self.ring.ngens) if any(monomial[i] for monomial in poly)]
        context = flint.fmpq_mpoly_ctx.get(tuple(f"g{i}" for i in used), "lex")
        dense = {tuple(m[i] for i in used): flint.fmpq(int(c.numerator), int(c.denominator)) for m, c in poly.items()}
        content, parts = context.from_dict(dense).factor()
        back = [
            (self.ring.from_dict({self._spread(m, used): _rational(c) for m, c in p.to_dict().items()}), int(e))
            for p, e in parts
        ]
        return _rational(content), tuple(sorted(back, key=lambda part: str(part[0])))

    def _spread(self, monomial: tuple[int, ...], used: list[int]) -> tuple[int, ...]:
        exponents = [0] * self.ring.ngens
        for i, exponent in zip(used, monomial, strict=True):
            exponents[i] = int(exponent)
        return tuple(exponents)


def _rational(value: flint.fmpq) -> Any:
    return QQ(int(value.p), int(value.q))


def rational_root(value: Any) -> tuple[Any, Any]:
    """A positive rational as (root of its square part, rest)."""
    outside, inside = QQ(1), QQ(1)
    for prime, power in [
        *factorint(value.numerator).items(),
        *((p, -e) for p, e in factorint(value.denominator).items()),
    ]:
        outside *= QQ(prime) ** (power // 2)
        inside *= QQ(prime) ** (power % 2)
    return outside, inside
