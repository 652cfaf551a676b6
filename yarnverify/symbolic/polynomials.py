"""Polynomials modulo the squares of roots, and quotients of them: what normal forms are computed with, by FLINT.

Relations are ``r^2 = R``, with R over generators later in the list. Their leading monomials are pure powers of distinct
generators, so they are a Groebner basis for the lexicographic order, and the remainder of a polynomial is its normal form.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import flint
from sympy import factorint

from yarnverify.symbolic.reading import UnsupportedError

Poly = Any  # flint.fmpq_mpoly
Factors = tuple[tuple[int, int], ...]  # (number of a polynomial in its relations' list, power)
_LARGEST_PRODUCT = 200_000  # terms times terms; the paper's formulas stay below a thirtieth of it


@dataclass(frozen=True, eq=False)
class Quotient:
    """``numerator / product of factor^power``, numerator reduced by the relations."""

    relations: Relations
    numerator: Poly
    factors: Factors = ()

    @property
    def below(self) -> list[tuple[Poly, int]]:
        """The factors of the denominator, with their powers."""
        return [(self.relations.listed[i], power) for i, power in self.factors]

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
            poly = self.relations.listed[factor]
            left = self.relations.times_power(left, poly, power - mine.get(factor, 0))
            right = self.relations.times_power(right, poly, power - theirs.get(factor, 0))
        return self.relations.quotient(left + right, common.items())

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
        factors = dict(self.factors)
        for factor, power in other.factors:
            factors[factor] = factors.get(factor, 0) + power
        return self.relations.quotient(self.relations.times(self.numerator, other.numerator), factors.items())

    __rmul__ = __mul__

    def inverse(self) -> Quotient:
        if not self.numerator:
            raise ZeroDivisionError
        content, parts = self.relations.factor(self.numerator)
        top = self.relations.number(1) / content
        for factor, power in self.below:
            top = self.relations.times_power(top, factor, power)
        return self.relations.quotient(top, [(self.relations.listing(part), power) for part, power in parts])

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

    Attributes
    ----------
    squares
        What the square of a generator is, over smaller ones.
    listed
        Polynomials that have been factors of a denominator; quotients name them by their place.
    """

    def __init__(self, labels: Sequence[str]) -> None:
        self.names = tuple(labels)
        self._context = flint.fmpq_mpoly_ctx.get(tuple(f"g{i}" for i in range(len(labels))), "lex")
        self.generator = dict(zip(labels, self._context.gens(), strict=True))
        self._position = {label: i for i, label in enumerate(labels)}
        self.squares: dict[str, Poly] = {}
        self._divisors: list[tuple[int, Poly]] = []  # (position, r^2 - R), larger generators first
        self.listed: list[Poly] = []
        self._places: dict[Any, int] = {}
        self._factored: dict[int, tuple[Any, tuple[tuple[Poly, int], ...]]] = {}

    def relate(self, label: str, square: Poly) -> None:
        """Give the square of a generator, over smaller ones."""
        self.squares[label] = square
        self._divisors = sorted(
            ((self._position[name], self.generator[name] ** 2 - over) for name, over in self.squares.items()),
            key=lambda item: item[0],
        )

    def listing(self, poly: Poly) -> int:
        """The place of a polynomial in the list, which it is added to if need be."""
        key = tuple(poly.to_dict().items())
        if key not in self._places:
            self._places[key] = len(self.listed)
            self.listed.append(poly)
        return self._places[key]

    def number(self, value: Any) -> Poly:
        return self._context.constant(flint.fmpq(int(value.numerator), int(value.denominator)))

    def constant(self, value: Any) -> Quotient:
        return Quotient(self, self.number(value))

    def make(self, label: str) -> Quotient:
        return Quotient(self, self.generator[label])

    def terms(self, poly: Poly) -> list[tuple[Poly, Any]]:
        """The monomials of a polynomial, each with its coefficient."""
        one = flint.fmpq(1)
        return [(self._context.from_dict({monomial: one}), factor) for monomial, factor in poly.to_dict().items()]

    def labels(self, poly: Poly) -> list[str]:
        """Generators that occur in a polynomial, larger ones first."""
        return [self.names[i] for i, degree in enumerate(poly.degrees()) if degree > 0]

    def derivative(self, poly: Poly, label: str) -> Quotient:
        """Partial derivative by a generator, others kept."""
        return Quotient(self, self.reduce(poly.derivative(self._position[label])))

    def split(self, poly: Poly, label: str) -> tuple[Poly, Poly]:
        """``u, v`` of a reduced polynomial ``u + v r``, where r has a square."""
        position = self._position[label]
        parts: tuple[dict[Any, Any], dict[Any, Any]] = ({}, {})
        for monomial, coefficient in poly.to_dict().items():
            parts[monomial[position]][(*monomial[:position], 0, *monomial[position + 1 :])] = coefficient
        u, v = (self._context.from_dict(part) for part in parts)
        return u, v

    def reduce(self, poly: Poly) -> Poly:
        """Remainder by the relations."""
        degrees = poly.degrees()
        for position, divisor in self._divisors:
            if degrees[position] > 1:
                poly = poly % divisor
                degrees = poly.degrees()
        return poly

    def quotient(self, numerator: Poly, factors: Iterable[tuple[int, int]]) -> Quotient:
        """A value in which powers of plain generators are cancelled, so that degrees stay low."""
        if not numerator:
            return Quotient(self, numerator)
        kept, content = [], None
        for factor, power in factors:
            poly = self.listed[factor]
            if power and len(poly) == 1:
                if content is None:
                    content = list(numerator.term_content().monoms()[0])
                position = next(i for i, degree in enumerate(poly.degrees()) if degree)
                shared = min(power, content[position])
                if shared:
                    numerator, _ = divmod(numerator, poly**shared)
                    content[position] -= shared
                    power -= shared
            if power:
                kept.append((factor, power))
        return Quotient(self, numerator, tuple(kept))

    def times(self, a: Poly, b: Poly) -> Poly:
        """Reduced product; refused where it would take minutes."""
        if len(a) * len(b) > _LARGEST_PRODUCT:
            raise UnsupportedError(f"the normal form grows beyond {_LARGEST_PRODUCT} products of terms")
        return self.reduce(a * b)

    def times_power(self, poly: Poly, factor: Poly, power: int) -> Poly:
        for _ in range(power):
            poly = self.times(poly, factor)
        return poly

    def factor(self, poly: Poly) -> tuple[Any, tuple[tuple[Poly, int], ...]]:
        """Rational content, and factors with their powers."""
        place = self.listing(poly)
        if place not in self._factored:
            content, parts = poly.factor()
            self._factored[place] = content, tuple((part, int(power)) for part, power in sorted(parts, key=str))
        return self._factored[place]


def prime_powers(value: Any) -> list[tuple[int, int]]:
    """Prime factors of a positive rational."""
    below = [(prime, -power) for prime, power in factorint(int(value.denominator)).items()]
    return [*factorint(int(value.numerator)).items(), *below]


def rational_root(value: Any) -> tuple[Any, Any]:
    """A positive rational as (root of its square part, rest)."""
    outside, inside = flint.fmpq(1), flint.fmpq(1)
    for prime, power in prime_powers(value):
        outside *= flint.fmpq(prime) ** (power // 2)
        inside *= flint.fmpq(prime) ** (power % 2)
    return outside, inside
