"""What jets compute with: exact rationals with adjoined roots, balls, or doubles.

Each kind of number offers the same few functions: ``constant``, ``positive``, ``sqrt``, ``arccos``, ``circle``, and ``pi``.
"""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import flint

from yarnverify.symbolic.algebraic import (
    Algebraic,
    NoValueError,
    Number,
    UndefinedError,
    approximate,
    exact_root,
    sign,
)
from yarnverify.symbolic.exponentials import Drawn
from yarnverify.symbolic.turns import PARTS_OF_PI, Pair, candidates, multiple, of_pi, turned

_MOST_ROOTS = 5
_ANGLE_BITS = 128
_NEAR = 2.0**-7  # where the series converges fast, and the closed forms begin to cancel
Given = Fraction | int | float  # what a state holds: all of them exact


class Rationals:
    """Exact arithmetic; square roots are adjoined, angles and pi are drawn next to their true values.

    Close to the truth, so that absolute values and roots of what holds angles go to the side that they truly go to. An angle
    that hangs together with earlier ones, such as ``arccos(2 c^2 - 1)`` with ``arccos(c)``, is made of these.
    """

    exact = True

    def __init__(self, seed: int) -> None:
        self._draw = random.Random(seed)
        self._roots: list[Number] = []
        self._angles: dict[Number, Number] = {}
        self._drawn: list[Number] = []  # the cosines of those angles that were drawn
        self._circles: dict[Number, Pair] = {}
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
        return sign(value) > 0

    def sqrt(self, value: Number) -> Number:
        if sign(value) < 0:
            raise NoValueError("square root of a negative number")
        root = exact_root(value, self._roots)
        if root is not None:
            return root
        if len(self._roots) == _MOST_ROOTS:  # a number has 2^roots parts
            raise UndefinedError(f"more than {_MOST_ROOTS} independent square roots at one state")
        self._roots.append(value)
        return Algebraic(self._roots, {1 << (len(self._roots) - 1): flint.fmpq(1)})

    def arccos(self, cosine: Number) -> Number:
        if self.positive(cosine * cosine - 1):
            raise NoValueError("arc cosine of a number above 1 or below -1")
        if cosine not in self._angles:
            before = flint.ctx.prec
            try:
                flint.ctx.prec = _ANGLE_BITS
                self._angles[cosine] = self._related(cosine)
            finally:
                flint.ctx.prec = before
        return self._angles[cosine]

    def _related(self, cosine: Number) -> Number:
        """An angle in terms of those drawn before and of pi, as is proved by points of the unit circle; else a new one."""
        angle = approximate(cosine).acos()
        known = [approximate(drawn).acos() for drawn in self._drawn]
        one = flint.fmpq(1)
        for count, total, parts in candidates(angle, known):
            kept = len(self._roots)
            try:
                right = of_pi(Fraction(parts, PARTS_OF_PI), one, self.sqrt)
                for j, n in total.items():
                    right = right and turned(right, multiple(self._point(self._drawn[j]), n, one))
                if right == multiple(self._point(cosine), count, one):
                    of_angles = sum((self._angles[self._drawn[j]] * n for j, n in total.items()), flint.fmpq(0))
                    return (of_angles + self.pi * flint.fmpq(parts, PARTS_OF_PI)) / count
            except UndefinedError:
                pass
            del self._roots[kept:]
        self._drawn.append(cosine)
        return self._beside(angle)

    def _point(self, cosine: Number) -> Pair:
        return self.sqrt(1 - cosine * cosine), cosine

    def log(self, value: Number) -> Number:
        if not self.positive(value):
            raise NoValueError("logarithm of what is not positive")
        return self._transcendental.log(value, approximate(value))

    def exp(self, value: Number) -> Number:
        return self._transcendental.exp(value, approximate(value))

    def circle(self, angle: Number) -> Pair:
        """A rational point of the unit circle, drawn for an angle that no arc cosine explains."""
        if angle not in self._circles:
            t = self._beside((approximate(angle) / 2).tan())
            self._circles[angle] = 2 * t / (1 + t * t), (1 - t * t) / (1 + t * t)
        return self._circles[angle]


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

    def atan2(self, y: Number, x: Number) -> Number:
        return flint.arb.atan2(y, x)

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

    def atan2(self, y: Number, x: Number) -> Number:
        return math.atan2(y, x)

    def circle(self, angle: Number) -> tuple[Number, Number]:
        return math.sin(angle), math.cos(angle)

    def log(self, value: Number) -> Number:
        return math.log(value)

    def exp(self, value: Number) -> Number:
        return math.exp(value)
