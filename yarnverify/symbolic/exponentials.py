"""Natural logarithms and exponentials, for each kind of number; those of what varies are transcendental.

Over rationals both are drawn next to their true values, as angles are: an identity of functions holds whatever they are.
Kept are ``log(a b) = log a + log b`` over the prime factors of rationals, ``exp(-a) = 1/exp(a)`` and ``exp(0) = 1``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import flint

NAMES = ("log", "exp")


class Drawn:
    """Rational stand-ins for the logarithms and exponentials of one state."""

    def __init__(self, beside: Callable[[Any], Any]) -> None:
        self._beside = beside
        self._logs: dict[Any, Any] = {}
        self._powers: dict[Any, Any] = {}

    def log(self, value: Any, approximate: Any) -> Any:
        """Of a positive number, from the logarithms of its primes where it is rational."""
        if not isinstance(value, flint.fmpq):
            return self._one(self._logs, value, approximate.log)
        total = flint.fmpq(0)
        for whole, sign in ((value.p, 1), (value.q, -1)):
            for prime, power in flint.fmpz(int(whole)).factor():
                total += sign * power * self._one(self._logs, prime, flint.arb(prime).log)
        return total

    def exp(self, value: Any, approximate: Any) -> Any:
        if value == 0:
            return flint.fmpq(1)
        if approximate < 0:
            return 1 / self.exp(-value, -approximate)
        return self._one(self._powers, value, approximate.exp)

    def _one(self, known: dict[Any, Any], key: Any, true: Callable[[], Any]) -> Any:
        if key not in known:
            known[key] = self._beside(true())
        return known[key]
