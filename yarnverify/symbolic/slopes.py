"""Exact partial derivatives of normal forms."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from yarnverify.symbolic.polynomials import Poly, Quotient, Relations
from yarnverify.symbolic.tree import Name

Rule = Callable[[Name, int], Quotient]  # the derivative of a generator by an unknown, or by one coordinate of a point


class Slopes:
    """Derivatives of quotients by unknowns.

    Parameters
    ----------
    relations
        The generators and their relations.
    points
        The first one is the base, to which lengths and directions of the others belong.
    direction
        The components of the directions.
    rules
        Derivatives of the generators that the field made on its way; it grows with the field.
    """

    def __init__(
        self,
        relations: Relations,
        points: Sequence[Name],
        direction: Mapping[Name, Sequence[Quotient]],
        rules: Mapping[str, Rule],
    ) -> None:
        self.relations, self.points, self.direction, self.rules = relations, points, direction, rules
        self._known: dict[tuple[str, Name, int], Quotient] = {}

    def derivative(self, value: Quotient, unknown: Name, axis: int = 0) -> Quotient:
        """Exact partial derivative by an unknown, or by one coordinate of a point."""
        result = self._poly_derivative(value.numerator, unknown, axis)
        if value.factors:
            result = result * Quotient(self.relations, self.relations.number(1), value.factors)
        for factor, power in value.below:
            result = result - value * self._poly_derivative(factor, unknown, axis) * power / Quotient(
                self.relations, factor
            )
        return result

    def _poly_derivative(self, poly: Poly, unknown: Name, axis: int) -> Quotient:
        total = self.relations.constant(0)
        for label in self.relations.labels(poly):
            inner = self._generator_derivative(label, unknown, axis)
            if inner.numerator:
                total = total + self.relations.derivative(poly, label) * inner
        return total

    def _generator_derivative(self, label: str, unknown: Name, axis: int) -> Quotient:
        key = (label, unknown, axis)
        if key not in self._known:
            self._known[key] = self._find_derivative(label, unknown, axis)
        return self._known[key]

    def _find_derivative(self, label: str, unknown: Name, axis: int) -> Quotient:
        if label in self.rules:
            return self.rules[label](unknown, axis)
        if not unknown.bold:
            return self.relations.constant(int(label == str(unknown)))
        base = self.points[0]
        for i, component in enumerate("xyz"):
            if label == f"{base.label}.{component}":
                return self.relations.constant(int(unknown == base and i == axis))
        for name in self.points[1:]:
            if unknown not in (name, base):
                continue
            sign = 1 if unknown == name else -1
            direction = self.direction[name]
            if label == f"length({name.label})":
                return direction[axis] * sign
            for i, component in enumerate("xyz"):
                if label == f"{name.label}.{component}":
                    turned = int(i == axis) - direction[i] * direction[axis]
                    return turned * sign / self.relations.make(f"length({name.label})")
        return self.relations.constant(0)
