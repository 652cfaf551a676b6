"""Second-order Taylor arithmetic: a value with its gradient and its Hessian."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from yarnverify.symbolic.algebraic import Number, UndefinedError


@lru_cache(maxsize=64)
def _upper(n: int) -> tuple[Any, Any]:
    """Rows and columns of the upper triangle, row by row."""
    return np.triu_indices(n)


def _sum(a: Any, b: Any) -> Any:
    """Sum of two Hessians, either of which may be absent, being zero."""
    return b if a is None else a if b is None else a + b


def _scaled(a: Any, scale: Number) -> Any:
    return None if a is None else a * scale


class Jet:
    """A value with its gradient (n,) and, of its Hessian, the upper triangle row by row (n (n + 1) / 2,).

    Without ``first`` it is a constant, without ``packed`` it is linear.
    """

    __slots__ = ("first", "packed", "value")

    def __init__(self, value: Number, first: Any = None, packed: Any = None) -> None:
        self.value, self.first, self.packed = value, first, packed

    @property
    def second(self) -> Any:
        """The Hessian (n, n); None for a constant."""
        if self.first is None:
            return None
        n = len(self.first)
        rows, columns = _upper(n)
        full = np.zeros((n, n), dtype=self.first.dtype) if self.packed is None else np.empty((n, n), self.packed.dtype)
        full[rows, columns] = full[columns, rows] = self.first[rows] * 0 if self.packed is None else self.packed
        return full

    @staticmethod
    def _lift(other: Any) -> Jet:
        return other if isinstance(other, Jet) else Jet(other)

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, np.ndarray):
            return NotImplemented  # NumPy then works entry by entry
        other = self._lift(other)
        if self.first is None or other.first is None:
            some = self if other.first is None else other
            return Jet(self.value + other.value, some.first, some.packed)
        return Jet(self.value + other.value, self.first + other.first, _sum(self.packed, other.packed))

    __radd__ = __add__

    def __neg__(self) -> Jet:
        if self.first is None:
            return Jet(-self.value)
        return Jet(-self.value, -self.first, None if self.packed is None else -self.packed)

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
            return Jet(a * b) if some.first is None else Jet(a * b, some.first * scale, _scaled(some.packed, scale))
        rows, columns = _upper(len(self.first))
        mixed = self.first[rows] * other.first[columns]
        mixed = mixed + (mixed if self is other else self.first[columns] * other.first[rows])
        bent = _sum(_scaled(self.packed, b), _scaled(other.packed, a))
        return Jet(a * b, self.first * b + other.first * a, _sum(bent, mixed))

    __rmul__ = __mul__

    def chain(self, value: Number, slope: Number, bend: Number) -> Jet:
        """``f(self)`` from f, f', f'' at the value."""
        if self.first is None:
            return Jet(value)
        rows, columns = _upper(len(self.first))
        bent = (self.first * bend)[rows] * self.first[columns]
        return Jet(value, self.first * slope, _sum(_scaled(self.packed, slope), bent))

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
        return Jet(self.value / other, self.first / other, None if self.packed is None else self.packed / other)

    def __rtruediv__(self, other: Any) -> Jet:
        return self.inverse() * other

    def __pow__(self, exponent: int) -> Jet:
        if exponent < 0:
            return self.inverse() ** -exponent
        result = Jet(self.value * 0 + 1)
        for _ in range(exponent):
            result = result * self
        return result
