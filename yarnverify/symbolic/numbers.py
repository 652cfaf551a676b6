"""What jets compute with: exact rationals with adjoined roots, balls, or doubles.

Each kind of number offers the same few functions: ``constant``, ``positive``, ``sqrt``, ``arccos``, ``circle``, and ``pi``.
"""

from __future__ import annotations

import math
import random
from fractions import Fraction
from itertools import combinations
from typing import Any

import flint
import numpy as np

from yarnverify.symbolic.exponentials import Drawn

_MOST_ROOTS = 4
_NEAR = 2.0**-7  # where the series converges fast, and the closed forms begin to cancel
Number = Any  # flint.fmpq, Algebraic, flint.arb or float
Given = Fraction | int | float  # what a state holds: all of them exact


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
        if isinstance(other, np.ndarray):
            return NotImplemented  # NumPy then works entry by entry
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
        if isinstance(other, np.ndarray):
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


class Rationals:
    """Exact arithmetic; square roots are adjoined, angles and pi are drawn next to their true values.

    Close to the truth, so that absolute values and roots of what holds angles go to the side that they truly go to.
    """

    exact = True

    def __init__(self, seed: int) -> None:
        self._draw = random.Random(seed)
        self._roots: list[Number] = []
        self._angles: dict[Number, Number] = {}
        self._circles: dict[Number, tuple[Number, Number]] = {}
        self.pi = self._beside(flint.arb.pi())
        self._transcendental = Drawn(self._beside)

    def _beside(self, value: Any) -> Number:
        """A rational number beside a ball, over a drawn denominator."""
        below = self._draw.randrange(10**6, 2 * 10**6)
        if not value.is_finite():  # too close to where it has no value
            return flint.fmpq(self._draw.randrange(1, 10**6), below)
        whole = (value * below).mid().fmpq()
        return flint.fmpq(int((whole + flint.fmpq(1, 2)).floor()), below)

    def constant(self, value: Given) -> Number:
        value = Fraction(value)
        return flint.fmpq(value.numerator, value.denominator)

    def positive(self, value: Number) -> bool:
        if isinstance(value, Algebraic):
            return self._approximate(value) > 0
        return bool(value > 0)

    def _approximate(self, value: Number) -> Any:
        if not isinstance(value, Algebraic):
            return flint.arb(value)
        total = flint.arb(0)
        for mask, q in value.parts.items():
            term = flint.arb(q)
            for k, square in enumerate(value.roots):
                if mask & (1 << k):
                    term = term * self._approximate(square).sqrt()
            total += term
        return total

    def sqrt(self, value: Number) -> Number:
        root = _exact_root(value)
        if root is not None:
            return root
        if not self.positive(value):
            raise NoValueError("square root of a negative number")
        if value in self._roots:
            return Algebraic(self._roots, {1 << self._roots.index(value): flint.fmpq(1)})
        if len(self._roots) == _MOST_ROOTS:  # a number has 2^roots parts
            raise UndefinedError(f"more than {_MOST_ROOTS} independent square roots at one state")
        for count in range(1, len(self._roots) + 1):  # keeps the roots independent
            for chosen in combinations(range(len(self._roots)), count):
                product, mask = value, 0
                for k in chosen:
                    product, mask = product * self._roots[k], mask | (1 << k)
                root = _exact_root(product)
                if root is not None:
                    return root / Algebraic(self._roots, {mask: flint.fmpq(1)})
        self._roots.append(value)
        return Algebraic(self._roots, {1 << (len(self._roots) - 1): flint.fmpq(1)})

    def arccos(self, cosine: Number) -> Number:
        if self.positive(cosine * cosine - 1):
            raise NoValueError("arc cosine of a number above 1 or below -1")
        if cosine in (1, 0, -1):
            return self.pi * {1: 0, 0: flint.fmpq(1, 2), -1: 1}[int(cosine)]
        if -cosine in self._angles:
            return self.pi - self._angles[-cosine]
        if cosine not in self._angles:
            self._angles[cosine] = self._beside(self._approximate(cosine).acos())
        return self._angles[cosine]

    def knows_angle(self, cosine: Number) -> bool:
        """Whether an angle was drawn for this cosine, rather than for its negative."""
        return cosine in self._angles or -cosine not in self._angles

    def log(self, value: Number) -> Number:
        if not self.positive(value):
            raise NoValueError("logarithm of what is not positive")
        return self._transcendental.log(value, self._approximate(value))

    def exp(self, value: Number) -> Number:
        return self._transcendental.exp(value, self._approximate(value))

    def circle(self, angle: Number) -> tuple[Number, Number]:
        """A rational point of the unit circle, drawn for an angle that no arc cosine explains."""
        if angle not in self._circles:
            t = self._beside((self._approximate(angle) / 2).tan())
            self._circles[angle] = 2 * t / (1 + t * t), (1 - t * t) / (1 + t * t)
        return self._circles[angle]


def _exact_root(value: Number) -> Number | None:
    if isinstance(value, Algebraic) or value < 0:
        return None
    top, bottom = math.isqrt(int(value.p)), math.isqrt(int(value.q))
    return flint.fmpq(top, bottom) if top * top == value.p and bottom * bottom == value.q else None


class Balls:
    """Ball arithmetic: every result encloses the true value."""

    exact = False

    def __init__(self) -> None:
        self.pi = flint.arb.pi()

    def constant(self, value: Given | flint.arb) -> Number:
        if isinstance(value, Fraction):
            return flint.arb(flint.fmpq(value.numerator, value.denominator))
        return flint.arb(value)

    def positive(self, value: Number) -> bool:
        return bool(value > 0)

    def sqrt(self, value: Number) -> Number:
        if value < 0:
            raise NoValueError("square root of a negative number")
        return value.sqrt()

    def arccos(self, cosine: Number) -> Number:
        if abs(cosine) > 1:
            raise NoValueError("arc cosine of a number above 1 or below -1")
        if abs(cosine) < 1:
            return cosine.acos()
        # the true cosine lies in the ball and in [-1, 1], since an angle is asked for
        low, high = cosine.lower().max(flint.arb(-1)), cosine.upper().min(flint.arb(1))
        return low.acos().union(high.acos())

    def circle(self, angle: Number) -> tuple[Number, Number]:
        return angle.sin(), angle.cos()

    def log(self, value: Number) -> Number:
        if value <= 0:
            raise NoValueError("logarithm of what is not positive")
        if not value > 0:
            raise UndefinedError("logarithm of what may be zero")
        return value.log()

    def exp(self, value: Number) -> Number:
        return value.exp()

    @staticmethod
    def squared_arccos(cosine: Number) -> tuple[Number, Number, Number]:
        """``arccos(c)^2`` with its first two derivatives by c: an analytic function at c = 1, and beyond.

        With s = (1 - c)/2, f = 2F1(1, 1; 3/2; s) = theta/sin(theta) and g = 2F1(2, 2; 5/2; s)/3 it is 4 s (1 - s) f^2,
        -2 f, 2 g (NIST DLMF 15.4.12 for f). A ball of cosines around 1 is thereby taken for what it is.
        """
        sigma = (1 - cosine) / 2
        if abs(sigma) < _NEAR:
            f = sigma.hypgeom_2f1(1, 1, flint.arb(3) / 2)
            g = sigma.hypgeom_2f1(2, 2, flint.arb(5) / 2) / 3
        else:
            square = (1 - cosine) * (1 + cosine)
            if square.contains(0):
                raise UndefinedError("division by zero")
            f = cosine.acos() / square.sqrt()
            g = (1 - cosine * f) / square
        return 4 * sigma * (1 - sigma) * f * f, -2 * f, 2 * g


class Floats:
    """Double precision; only ever used to sort out hopeless candidates quickly."""

    exact = False
    pi = math.pi

    def constant(self, value: Given) -> Number:
        return float(value)

    def positive(self, value: Number) -> bool:
        return bool(value > 0)

    def sqrt(self, value: Number) -> Number:
        return math.sqrt(value)

    def arccos(self, cosine: Number) -> Number:
        return math.acos(cosine)

    def circle(self, angle: Number) -> tuple[Number, Number]:
        return math.sin(angle), math.cos(angle)

    def log(self, value: Number) -> Number:
        return math.log(value)

    def exp(self, value: Number) -> Number:
        return math.exp(value)
