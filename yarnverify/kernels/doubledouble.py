"""Pairs ``high + low`` over arrays, for the variant ``reference``: twice the digits, rounded once at the end.

The parts are extended doubles where the processor has them (64 bits each, so about 2^-126), since 2^-104 of plain doubles is
not quite enough where 16 digits cancel, and have the range for any product that occurs; elsewhere plain doubles, with no more
than their range. Error-free transformations by Knuth and Dekker, on arrays.
Kernels run on these numbers unchanged, but for the series of ``turning``, which is summed as far as pairs see it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
_REAL = np.longdouble if np.finfo(np.longdouble).nmant == 63 else np.float64
_SPLITTER = _REAL(2.0 ** (32 if _REAL is np.longdouble else 27) + 1)
_TERMS = 60  # of the series in sin(t/4)^2 <= 0.194, so below 2^-130
_PI_DIGITS = Fraction("3.14159265358979323846264338327950288419716939937510582097494459")


def _pair(value: Fraction) -> tuple[Any, Any]:
    high = _REAL(value.numerator) / _REAL(value.denominator)
    return high, _REAL(float(value - Fraction(*high.as_integer_ratio())))


_PI = _pair(_PI_DIGITS)
_NOTHING = _REAL(0)
_RATIOS = tuple(_pair(Fraction(2 * (n + 1) ** 2, n * (2 * n + 3))) for n in range(_TERMS, 0, -1))


def _sum(a: Any, b: Any) -> tuple[Any, Any]:
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def _ordered_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """The same where a is the larger one or 0."""
    s = a + b
    return s, b - (s - a)


def _product(a: Any, b: Any) -> tuple[Any, Any]:
    p = a * b
    t = _SPLITTER * a
    a1 = t - (t - a)
    a2 = a - a1
    t = _SPLITTER * b
    b1 = t - (t - b)
    b2 = b - b1
    return p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2


class Pair:
    """An unevaluated sum of two arrays of doubles: ``high`` is the sum rounded, ``low`` what that lacks."""

    __slots__ = ("high", "low")
    least = np.finfo(_REAL).smallest_subnormal
    __array_ufunc__ = None

    def __init__(self, high: Any, low: Any = _NOTHING) -> None:
        self.high, self.low = high, low

    def _lift(self, other: Any) -> Pair:
        return other if isinstance(other, Pair) else Pair(_REAL(other))

    def __add__(self, other: Any) -> Pair:
        other = self._lift(other)
        s, e = _sum(self.high, other.high)
        t, f = _sum(self.low, other.low)
        s, e = _ordered_sum(s, e + t)
        return Pair(*_ordered_sum(s, e + f))

    __radd__ = __add__

    def __neg__(self) -> Pair:
        return Pair(-self.high, -self.low)

    def __sub__(self, other: Any) -> Pair:
        return self + (-self._lift(other))

    def __rsub__(self, other: Any) -> Pair:
        return -self + other

    def __mul__(self, other: Any) -> Pair:
        other = self._lift(other)
        p, e = _product(self.high, other.high)
        return Pair(*_ordered_sum(p, e + (self.high * other.low + self.low * other.high)))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Pair:
        other = self._lift(other)
        first = self.high / other.high
        rest = self - other * Pair(first)
        second = rest.high / other.high
        rest = rest - other * Pair(second)
        return Pair(*_sum(first, second)) + rest.high / other.high

    def __rtruediv__(self, other: Any) -> Pair:
        return self._lift(other) / self

    def __abs__(self) -> Pair:
        sign = np.where(self.high < 0, -1.0, 1.0)
        return Pair(sign * self.high, sign * self.low)

    def _sqrt(self, *_: Any) -> Pair:
        root = np.sqrt(self.high)
        rest = self - Pair(root) * Pair(root)
        safe = np.where(root > 0, root, 1.0)
        first = Pair(*_sum(root, rest.high / (2 * safe)))
        rest = self - first * first
        return first + rest.high / (2 * safe)

    def _maximum(self, a: Any, b: Any) -> Pair:
        a, b = self._lift(a), self._lift(b)
        return a._select(a - b, a, b)

    def _select(self, condition: Any, yes: Any, no: Any) -> Pair:
        yes, no = self._lift(yes), self._lift(no)
        chosen = self._lift(condition).high > 0
        return Pair(np.where(chosen, yes.high, no.high), np.where(chosen, yes.low, no.low))

    def turning_series(self) -> Pair:
        """(sin t - t cos t)/sin(t)^3 of sin(t/2)^2, by the ratios 2 (n+1)^2 / (n (2n+3)) of its coefficients."""
        total = Pair(np.ones_like(self.high))
        for ratio in _RATIOS:
            total = 1.0 + total * self * Pair(*ratio)
        return total / 3.0

    @staticmethod
    def pi() -> Pair:
        return Pair(*_PI)

    @staticmethod
    def root_of(whole: int) -> Pair:
        return Pair(_REAL(whole))._sqrt()


def evaluator(
    function: Callable[[Sequence[Any]], list[Any]],
) -> Callable[[list[Array], list[Any], list[Array]], Array]:
    """A function that fills targets with the rounded results of ``function``, and gives what is left over as rows."""

    def run(rows: list[Array], values: list[Any], targets: list[Array]) -> Array:
        single = rows[0].dtype
        given = [Pair(np.asarray(value, _REAL)) for value in (*rows, *values)]
        results = [np.asarray(r.high if isinstance(r, Pair) else r) for r in function(given)]
        for target, result in zip(targets, results, strict=False):
            target[:] = result
        above = np.finfo(single).tiny  # what is positive stays so
        rest = [np.where(r > 0, np.maximum(r, above), r) for r in results[len(targets) :]]
        return np.array([np.broadcast_to(r, rows[0].shape) for r in rest], single).reshape(len(rest), rows[0].size)

    return run
