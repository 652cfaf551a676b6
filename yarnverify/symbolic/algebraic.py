"""Numbers with square roots: exact arithmetic over roots that stay independent of each other."""

from __future__ import annotations

import math
from typing import Any

import flint

Number = Any  # flint.fmpq, Algebraic, flint.arb or float
_FIRST_BITS = 64  # of the balls that tell a sign


class UndefinedError(Exception):
    """The formula has no value at this state: a zero denominator, or the root of a negative number."""


class NoValueError(UndefinedError):
    """A root of what is negative or an angle of what is beyond 1: not only here, but wherever nearby, is there no value."""


class Algebraic:
    """A number ``sum_k q_k r_k`` over products r_k of adjoined square roots; immutable, exact."""

    __slots__ = ("parts", "roots")

    def __init__(self, roots: list[Number], parts: dict[int, Any]) -> None:
        self.roots = roots  # squares of the adjoined roots, each over earlier ones
        self.parts = {mask: q for mask, q in parts.items() if q != 0}

    def _lift(self, other: Number) -> Algebraic:
        return other if isinstance(other, Algebraic) else Algebraic(self.roots, {0: flint.fmpq(other)})

    def __add__(self, other: Number) -> Number:
        if not isinstance(other, _EXACT):
            return NotImplemented
        parts = dict(self.parts)
        for mask, q in self._lift(other).parts.items():
            parts[mask] = parts.get(mask, 0) + q
        return Algebraic(self.roots, parts)._settle()

    __radd__ = __add__

    def __neg__(self) -> Algebraic:
        return Algebraic(self.roots, {mask: -q for mask, q in self.parts.items()})

    def __sub__(self, other: Number) -> Number:
        return self + (-other)

    def __rsub__(self, other: Number) -> Number:
        return -self + other

    def __mul__(self, other: Number) -> Number:
        if not isinstance(other, _EXACT):
            return NotImplemented
        total: Number = Algebraic(self.roots, {})
        for m, p in self.parts.items():
            for n, q in self._lift(other).parts.items():
                term: Number = Algebraic(self.roots, {m ^ n: p * q})
                for k, square in enumerate(self.roots):
                    if m & n & (1 << k):
                        term = term * square
                total = total + term
        return total._settle() if isinstance(total, Algebraic) else total

    __rmul__ = __mul__

    def inverse(self) -> Number:
        if not self.parts:
            raise ZeroDivisionError
        top = max(self.parts).bit_length() - 1
        if top < 0:
            return 1 / self.parts[0]
        bit = 1 << top
        low = Algebraic(self.roots, {m: q for m, q in self.parts.items() if not m & bit})._settle()
        high = Algebraic(self.roots, {m ^ bit: q for m, q in self.parts.items() if m & bit})._settle()
        norm = low * low - high * high * self.roots[top]
        if norm == 0:
            raise UndefinedError("dependent square roots")
        root = Algebraic(self.roots, {bit: flint.fmpq(1)})
        return (low - high * root) * (norm.inverse() if isinstance(norm, Algebraic) else 1 / norm)

    def __truediv__(self, other: Number) -> Number:
        if not isinstance(other, _EXACT):
            return NotImplemented
        return self * (other.inverse() if isinstance(other, Algebraic) else 1 / flint.fmpq(other))

    def __rtruediv__(self, other: Number) -> Number:
        return self.inverse() * other

    def _settle(self) -> Number:
        """Back to a plain rational where no root is left."""
        return self.parts.get(0, flint.fmpq(0)) if set(self.parts) <= {0} else self

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Algebraic) and self.parts == other.parts

    def __hash__(self) -> int:
        return hash(tuple(sorted((m, str(q)) for m, q in self.parts.items())))


_EXACT = (Algebraic, flint.fmpq, flint.fmpz, int)  # an array and a jet do the arithmetic themselves


def approximate(value: Number) -> Any:
    """A ball around a number, at the precision in force."""
    if not isinstance(value, Algebraic):
        return flint.arb(value)
    total = flint.arb(0)
    for mask, q in value.parts.items():
        term = flint.arb(q)
        for k, square in enumerate(value.roots):
            if mask & (1 << k):
                term = term * approximate(square).sqrt()
        total += term
    return total


def sign(value: Number) -> int:
    """1, -1 or 0; exact, since a number whose parts are not all zero is not zero."""
    if not isinstance(value, Algebraic):
        return (value > 0) - (value < 0)
    if not value.parts:
        return 0
    before = flint.ctx.prec
    try:
        flint.ctx.prec = max(before, _FIRST_BITS)
        while True:
            ball = approximate(value)
            if not ball.contains(0):
                return 1 if ball > 0 else -1
            flint.ctx.prec *= 2
    finally:
        flint.ctx.prec = before


def exact_root(value: Number, roots: list[Number]) -> Number | None:
    """The square root of a number that is not negative, if the roots at hand have it; None if it is a new one.

    With r the last root, ``a + b r`` is a square root of ``u + v r`` if ``n^2 = u^2 - v^2 r^2`` has a root n among the others,
    and one of ``(u + n)/2`` and ``(u - n)/2`` has a root a; then ``b = v / 2a``. If v is zero, a or b is.
    """
    found = _root(value, roots, len(roots))
    return found if found is None or sign(found) >= 0 else -found


def _root(value: Number, roots: list[Number], count: int) -> Number | None:
    if sign(value) < 0:
        return None
    if count == 0:
        top, bottom = math.isqrt(int(value.p)), math.isqrt(int(value.q))
        return flint.fmpq(top, bottom) if top * top == value.p and bottom * bottom == value.q else None
    bit, square = 1 << (count - 1), roots[count - 1]
    root = Algebraic(roots, {bit: flint.fmpq(1)})
    parts = value.parts if isinstance(value, Algebraic) else {0: value}
    u: Number = Algebraic(roots, {m: q for m, q in parts.items() if not m & bit})._settle()
    v: Number = Algebraic(roots, {m ^ bit: q for m, q in parts.items() if m & bit})._settle()
    if v == 0:
        found = _root(u, roots, count - 1)
        if found is None:
            found = _root(u / square, roots, count - 1)
            found = None if found is None else found * root
        return found
    norm = _root(u * u - v * v * square, roots, count - 1)
    if norm is None:
        return None
    for half in ((u + norm) / 2, (u - norm) / 2):
        a = _root(half, roots, count - 1)
        if a is not None and a != 0:
            return a + v / (2 * a) * root
    return None
