"""Square roots and absolute values in normal forms."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from yarnverify.symbolic.polynomials import Poly, Quotient, Relations, rational_root
from yarnverify.symbolic.reading import UnsupportedError
from yarnverify.symbolic.square_roots import known_root
from yarnverify.symbolic.tree import Name

if TYPE_CHECKING:
    from yarnverify.symbolic.normal import Field

Factors = Iterable[tuple[Poly, int]]


class Roots:
    """The square roots of one field.

    Attributes
    ----------
    squares
        The generator of every root, by what stands under it, as the relations list it.
    independent
        Whether no root is known to be, or might be, a quotient with the others.
    """

    def __init__(self, field: Field, labels: Sequence[str]) -> None:
        self.field, self.relations = field, field.relations
        self.squares: dict[int, str] = {}
        self.independent = True
        self._sines: dict[int, Quotient] = {}  # those made of two roots, by what 1 - c^2 is
        self._directions = list(self.relations.squares)  # what makes directions unit vectors
        self._layers: list[str] = []  # independent roots
        self._plain = Relations(labels)  # the squares as products of factors, which directions would hide

    def layer(self, label: str, square: Poly) -> None:
        """Note that a generator is independent of the others, and its square as it was before it was reduced."""
        self._layers.append(label)
        self._plain.relate(label, square)

    def absolute(self, value: Quotient) -> Quotient:
        """Absolute value, by sign where it is known, else as a root of the square."""
        result = self.relations.constant(1)
        content, parts = self.relations.factor(value.numerator)
        result = result * abs(content)
        for part, power, invert in [(p, e, False) for p, e in parts] + [(p, e, True) for p, e in value.below]:
            sign = self.field.sign(part) or self.field.sign_here(part)
            if sign:
                one = Quotient(self.relations, part) * sign
            elif power % 2 == 0:
                one, power = Quotient(self.relations, self.relations.reduce(part**2)), power // 2
            else:
                one, self.independent = self.relations.make(self._root(part**2)), False
            result = result * (one**-power if invert else one**power)
        return result

    def sqrt(self, value: Quotient) -> Quotient:
        """Square root of a value that is not negative: squares come out, the rest becomes one root."""
        if value.is_zero:
            return value
        content, parts = self.relations.factor(value.numerator)
        outside, inside = self.relations.constant(1), self.relations.number(1)
        for part, power, invert in [(p, e, False) for p, e in parts] + [(p, e, True) for p, e in value.below]:
            whole, odd = divmod(power + (power % 2 if invert else 0), 2)
            if whole:
                outside = outside * self.absolute(Quotient(self.relations, part)) ** (-whole if invert else whole)
            if odd or (invert and power % 2):
                inside = inside * part
        root_content, content = rational_root(content)
        outside, inside = outside * self.relations.constant(root_content), inside * content
        reduced = self.relations.reduce(inside)
        if reduced == 1:
            return outside
        place = self.relations.listing(reduced)
        if place in self._sines:
            return outside * self._sines[place]
        if place not in self.squares:
            known = self._known(inside, reduced)
            if known is not None:
                return outside * self.absolute(known)
            self.layer(self._root(reduced), inside)
        return outside * self.relations.make(self._root(reduced))

    def sine(self, cosine: Quotient) -> Quotient:
        """``sqrt(1 - c^2)``; where it is no root yet, by sine and cosine of half the angle.

        Its radicand has the factors ``1 - c`` and ``1 + c``, which the relations of directions would hide.
        """
        square = 1 - cosine * cosine
        if square.factors or square.is_zero:
            return square if square.is_zero else self.sqrt(square)
        place = self.relations.listing(square.numerator)
        if place in self.squares:
            label = self.squares[place]
            if label in self._layers:
                self._plain.relate(label, (1 - cosine.numerator) * (1 + cosine.numerator))
            return self.relations.make(label)
        if place not in self._sines:
            self._sines[place] = 2 * self.sqrt((1 - cosine) / 2) * self.sqrt((1 + cosine) / 2)
        return self._sines[place]

    def _known(self, inside: Poly, reduced: Poly) -> Quotient | None:
        """The root by others; first as if directions were any vectors, which is fast, and then with their relations."""
        for relations, poly, layers in (
            (self._plain, self._plain.reduce(inside), self._layers),
            (self.relations, reduced, [*self._directions, *self._layers]),
        ):
            try:
                found = known_root(relations, poly, layers)
            except UnsupportedError:
                self.independent = False
                return None
            if found is not None:
                top = Quotient(self.relations, self.relations.reduce(found.numerator))
                for factor, power in found.below:
                    top = top / Quotient(self.relations, self.relations.reduce(factor)) ** power
                return top
        return None

    def radicands(self) -> list[Poly]:
        """What stands under the roots, in the order in which they were met."""
        return [self.relations.listed[place] for place in self.squares]

    def _root(self, square: Poly) -> str:
        """The generator that is the square root of a polynomial; of p^2 it is the absolute value of p."""
        place = self.relations.listing(square)
        if place not in self.squares:
            reduced = self.relations.reduce(square)

            def rule(unknown: Name, axis: int) -> Quotient:
                slope = self.field.derivative(Quotient(self.relations, reduced), unknown, axis)
                return slope / (self.relations.make(label) * 2)

            label = self.field.atom(rule, lambda place: place.poly(reduced).sqrt(), reduced, positive=True)
            self.squares[place] = label
        return self.squares[place]
