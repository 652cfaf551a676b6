"""Second-order Taylor arithmetic: a value with its gradient and its Hessian."""

from __future__ import annotations

from typing import Any

import numpy as np

from yarnverify.symbolic.numbers import Number, UndefinedError


def _sum(a: Any, b: Any) -> Any:
    """Sum of two Hessians, either of which may be absent, being zero."""
    return b if a is None else a if b is None else a + b


def _scaled(a: Any, scale: Number) -> Any:
    return None if a is None else a * scale


class Jet:
    """A value with its gradient (n,) and Hessian (n, n); without ``first`` a constant, without ``second`` linear."""

    __slots__ = ("first", "second", "value")

    def __init__(self, value: Number, first: Any = None, second: Any = None) -> None:
        self.value, self.first, self.second = value, first, second

    @staticmethod
    def _lift(other: Any) -> Jet:
        return other if isinstance(other, Jet) else Jet(other)

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, np.ndarray):
            return NotImplemented  # NumPy then works entry by entry
        other = self._lift(other)
        if self.first is None or other.first is None:
            some = self if other.first is None else other
            return Jet(self.value + other.value, some.first, some.second)
        return Jet(self.value + other.value, self.first + other.first, _sum(self.second, other.second))

    __radd__ = __add__

    def __neg__(self) -> Jet:
        if self.first is None:
            return Jet(-self.value)
        return Jet(-self.value, -self.first, None if self.second is None else -self.second)

    def __sub__(self, other: Any) -> Jet:
        return self + (-other)

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __mul__(self, other: Any) -> Jet:
        if isinstance(other, np.ndarray):
            return NotImplemented
        other = self._lift(other)
        a, b = self.value, other.value
        if self.first is None or other.first is None:
            scale, some = (a, other) if self.first is None else (b, self)
            return Jet(a * b) if some.first is None else Jet(a * b, some.first * scale, _scaled(some.second, scale))
        mixed = np.outer(self.first, other.first)
        bent = _sum(_scaled(self.second, b), _scaled(other.second, a))
        return Jet(a * b, self.first * b + other.first * a, _sum(bent, mixed + mixed.T))

    __rmul__ = __mul__

    def chain(self, value: Number, slope: Number, bend: Number) -> Jet:
        """``f(self)`` from f, f', f'' at the value."""
        if self.first is None:
            return Jet(value)
        bent = np.outer(self.first, self.first) * bend
        return Jet(value, self.first * slope, _sum(_scaled(self.second, slope), bent))

    def inverse(self) -> Jet:
        if self.value == 0:
            raise UndefinedError("division by zero")
        one = 1 / self.value
        return self.chain(one, -one * one, 2 * one * one * one)

    def __truediv__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return self * other.inverse()
        if self.first is None:
            return Jet(self.value / other)
        return Jet(self.value / other, self.first / other, None if self.second is None else self.second / other)

    def __rtruediv__(self, other: Any) -> Jet:
        return self.inverse() * other

    def __pow__(self, exponent: int) -> Jet:
        if exponent < 0:
            return self.inverse() ** -exponent
        result = Jet(self.value * 0 + 1)
        for _ in range(exponent):
            result = result * self
        return result
