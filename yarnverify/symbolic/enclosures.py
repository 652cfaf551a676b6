"""Where normal forms lie at a state: balls around generators and quotients, to tell signs and angles apart."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import flint

from yarnverify.symbolic.numbers import Balls
from yarnverify.symbolic.polynomials import Poly, Quotient
from yarnverify.symbolic.tree import Name

BITS = 128
Recipe = Callable[["Place"], Any]  # the ball of a generator


class Place:
    """A state, with the balls of a field's generators at it.

    Parameters
    ----------
    state
        A value for every unknown and parameter.
    points
        The points in the field's order, its first one the base.
    names
        The generators, in their order.
    recipes
        How the generators are worked out that the field made on its way; it grows with the field.
    """

    def __init__(
        self, state: Mapping[Name, Any], points: Sequence[Name], names: Sequence[str], recipes: Mapping[str, Recipe]
    ) -> None:
        constant, self._names, self._recipes = Balls().constant, names, recipes
        self._known: dict[str, Any] = {str(n): constant(v) for n, v in state.items() if not n.bold}
        for name in points:
            here = [constant(part) for part in state[name]]
            if name == points[0]:
                base = here
                self._known |= {f"{name.label}.{axis}": part for axis, part in zip("xyz", here, strict=True)}
                continue
            edge = [a - b for a, b in zip(here, base, strict=True)]
            length = sum((part * part for part in edge), flint.arb(0)).sqrt()
            self._known[f"length({name.label})"] = length
            self._known |= {f"{name.label}.{axis}": part / length for axis, part in zip("xyz", edge, strict=True)}

    def generator(self, label: str) -> Any:
        if label not in self._known:
            self._known[label] = self._recipes[label](self)
        return self._known[label]

    def poly(self, poly: Poly) -> Any:
        total = flint.arb(0)
        for monomial, coefficient in poly.to_dict().items():
            term = flint.arb(coefficient)
            for i, power in enumerate(monomial):
                if power:
                    term = term * self.generator(self._names[i]) ** power
            total += term
        return total

    def quotient(self, value: Quotient) -> Any:
        total = self.poly(value.numerator)
        for factor, power in value.below:
            total = total / self.poly(factor) ** power
        return total

    def sign(self, poly: Poly) -> int:
        """1 or -1; 0 where the ball does not tell."""
        ball = self.poly(poly)
        return 1 if ball > 0 else -1 if ball < 0 else 0
