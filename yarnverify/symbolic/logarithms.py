"""Logarithms and exponentials in normal forms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from yarnverify.symbolic.polynomials import Quotient, prime_powers
from yarnverify.symbolic.tree import Name

if TYPE_CHECKING:
    from yarnverify.symbolic.normal import Field


class Exponentials:
    """The logarithms and exponentials of one field."""

    def __init__(self, field: Field) -> None:
        self.field, self.relations = field, field.relations
        self._logs: list[tuple[Quotient, Quotient]] = []
        self._exponentials: list[tuple[Quotient, Quotient]] = []

    def log(self, value: Quotient) -> Quotient:
        """Logarithm: the sum of those of the factors, where each of them is positive."""
        content, parts = self.relations.factor(value.numerator)
        signed = [*parts, *((part, -power) for part, power in value.below)]
        signs = [self.field.sign(part) or self.field.sign_here(part) for part, _ in signed]
        if content < 0 and signs.count(-1) % 2 == 1:  # an odd number of turned signs makes up for it
            content = -content
        elif content < 0 or signs.count(-1) % 2 == 1 or 0 in signs:
            return self._log_of(value)
        total = self.relations.constant(0)
        for prime, power in prime_powers(content):
            total = total + self._log_of(self.relations.constant(prime)) * power
        for (part, power), sign in zip(signed, signs, strict=True):
            total = total + self._log_of(Quotient(self.relations, part) * sign) * power
        return total

    def _log_of(self, value: Quotient) -> Quotient:
        for known, found in self._logs:
            if (known - value).is_zero:
                return found

        def rule(unknown: Name, axis: int) -> Quotient:
            return self.field.derivative(value, unknown, axis) / value

        found = self.relations.make(self.field.atom(rule, lambda place: place.quotient(value).log()))
        self._logs.append((value, found))
        return found

    def exp(self, value: Quotient) -> Quotient:
        """Exponential: whole multiples of one exponent are powers of one generator."""
        if value.is_zero:
            return self.relations.constant(1)
        for known, found in self._exponentials:
            for times in (1, -1, 2, -2, 3, -3):
                if (known * times - value).is_zero:
                    return found**times

        def rule(unknown: Name, axis: int) -> Quotient:
            return self.relations.make(label) * self.field.derivative(value, unknown, axis)

        label = self.field.atom(rule, lambda place: place.quotient(value).exp(), positive=True)
        found = self.relations.make(label)
        self._exponentials.append((value, found))
        return found
