"""Angles in normal forms: which arc cosines hang together, and the sines and cosines of sums of angles."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import flint

from yarnverify.symbolic.enclosures import BITS, Place
from yarnverify.symbolic.polynomials import Quotient
from yarnverify.symbolic.tree import Name
from yarnverify.symbolic.turns import (
    DRAWN_PARTS,
    PARTS_OF_PI,
    Pair,
    Relation,
    candidates,
    multiple,
    near,
    of_pi,
    scaled,
    turned,
)

if TYPE_CHECKING:
    from yarnverify.symbolic.normal import Field


class Circles:
    """The angles of one field."""

    def __init__(self, field: Field) -> None:
        self.field = field
        self._angles: list[tuple[Quotient, Quotient]] = []  # (cosine, angle)
        self._cosines: dict[str, Quotient] = {}  # of those angles that are generators
        self._turns: list[tuple[Quotient, Quotient, Quotient]] = []  # (y, x, angle)
        self._parts: list[tuple[Quotient, Pair]] = []  # other angles, and the points of their fourth parts

    @property
    def _one(self) -> Quotient:
        return self.field.constant(1)

    @cached_property
    def pi(self) -> Quotient:
        label = self.field.atom(
            lambda unknown, axis: self.field.constant(0), lambda place: flint.arb.pi(), positive=True
        )
        return self.field.relations.make(label)

    # -- arc cosines

    def arccos(self, cosine: Quotient) -> Quotient:
        for exact, halves in ((0, 1), (1, 0), (-1, 2)):
            if (cosine - exact).is_zero:
                return self.pi * self.field.constant(Fraction(halves, 2))
        for known, angle in self._angles:
            if (known - cosine).is_zero:
                return angle
            if (known + cosine).is_zero:
                return self.pi - angle
        found = self._related(cosine)
        if found is None:
            found = self._new(cosine)
        self._angles.append((cosine, found))
        return found

    def _new(self, cosine: Quotient) -> Quotient:
        def rule(unknown: Name, axis: int) -> Quotient:
            return -self.field.derivative(cosine, unknown, axis) / self.field.roots.sine(cosine)

        label = self.field.atom(rule, lambda place: place.quotient(cosine).acos(), positive=True)
        self._cosines[label] = cosine
        return self.field.relations.make(label)

    def _point_of(self, cosine: Quotient) -> Pair:
        return self.field.roots.sine(cosine), cosine

    def _related(self, cosine: Quotient) -> Quotient | None:
        """The angle by others and pi: proved by the points of the unit circle, up to full turns, which the states tell.

        Both sides are continuous, so that their difference is the same full turns everywhere.
        """
        field, labels = self.field, list(self._cosines)
        if not labels and field.relations.labels(cosine.numerator):
            return None  # there is nothing that it might hang together with

        def balls(place: Place) -> tuple[Any, list[Any]]:
            return place.quotient(cosine).acos(), [place.generator(label) for label in labels]

        def holds(relation: Relation, place: Place) -> bool:
            return near(relation, *balls(place))

        with flint.ctx.workprec(BITS):
            places = [place for place in field.places if balls(place)[0].is_finite()]
            for relation in candidates(*balls(places[0])) if places else ():
                count, total, parts = relation
                if not all(holds(relation, place) for place in places):
                    continue
                right = of_pi(Fraction(parts, PARTS_OF_PI), self._one, field.sqrt)
                for j, n in total.items():
                    right = right and turned(right, multiple(self._point_of(self._cosines[labels[j]]), n, self._one))
                left = multiple(self._point_of(cosine), count, self._one)
                if right is not None and all((a - b).is_zero for a, b in zip(left, right, strict=True)):
                    field.note(partial(holds, relation))
                    angle = self.pi * self.field.constant(Fraction(parts, PARTS_OF_PI))
                    for j, n in total.items():
                        angle = angle + field.relations.make(labels[j]) * n
                    return angle / count
        return None

    # -- angles of points

    def turn(self, y: Quotient, x: Quotient) -> Quotient:
        """The angle of the point (x, y), wherever it is not on the negative axis."""
        for known_y, known_x, angle in self._turns:
            if (known_y - y).is_zero and (known_x - x).is_zero:
                return angle

        def rule(unknown: Name, axis: int) -> Quotient:
            slope_y, slope_x = (self.field.derivative(value, unknown, axis) for value in (y, x))
            return (x * slope_y - y * slope_x) / (x * x + y * y)

        label = self.field.atom(rule, lambda place: flint.arb.atan2(place.quotient(y), place.quotient(x)))
        found = self.field.relations.make(label)
        self._turns.append((y, x, found))
        return found

    # -- sines and cosines

    def point(self, angle: Quotient) -> Pair:
        """Sine and cosine, by the parts of the angle: multiples of pi, of arc cosines, and of anything else."""
        relations, total = self.field.relations, (self.field.constant(0), self._one)
        for monomial, coefficient in relations.terms(angle.numerator):
            term = relations.quotient(monomial, angle.factors)
            factor = Fraction(int(coefficient.p), int(coefficient.q))
            total = turned(total, self._turn(term, factor))
        return total

    def _turn(self, term: Quotient, factor: Fraction) -> Pair:
        pair, labels = None, self.field.relations.labels(term.numerator)
        if (term - self.pi).is_zero:
            pair = of_pi(factor, self._one, self.field.sqrt)
        elif len(labels) == 1 and labels[0] in self._cosines and (term - self.field.relations.make(labels[0])).is_zero:
            pair = scaled(self._point_of(self._cosines[labels[0]]), factor, self._one, self.field.sqrt)
        if pair is not None:
            return pair
        below = factor.denominator // math.gcd(factor.denominator, DRAWN_PARTS)
        base = term / below
        return multiple(self._fourth_part(base), int(factor * DRAWN_PARTS * below), self._one)

    def _fourth_part(self, angle: Quotient) -> Pair:
        """A new pair of generators on the unit circle."""
        for known, pair in self._parts:
            if (known - angle).is_zero:
                return pair
        field, part = self.field, angle / DRAWN_PARTS

        def slope(of: str, sign: int) -> Any:
            return lambda unknown, axis: field.relations.make(labels[of]) * field.derivative(part, unknown, axis) * sign

        labels: dict[str, str] = {}
        labels["cos"] = field.atom(slope("sin", -1), lambda place: place.quotient(part).cos())
        square = 1 - field.relations.generator[labels["cos"]] ** 2
        labels["sin"] = field.atom(slope("cos", 1), lambda place: place.quotient(part).sin(), square)
        field.roots.layer(labels["sin"], square)
        pair = field.relations.make(labels["sin"]), field.relations.make(labels["cos"])
        self._parts.append((angle, pair))
        return pair
