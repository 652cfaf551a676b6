"""Reading 1: exact normal forms and exact derivatives.

A value is a quotient ``numerator / product of factors`` over named generators. Points are written in the coordinates of the
identities at hand: with x_b the first point, ``x_i = x_b + l_i a_i``, where ``a_i`` is a unit vector, so that a length is a
generator instead of a square root. The map (x_b, l_i, a_i) -> (x_b, x_i) covers all states with l_i > 0; an identity in
these coordinates therefore holds wherever the lengths are not zero. Relations:

* ``a_iz^2 = 1 - a_ix^2 - a_iy^2``,
* ``r^2 = R`` for every other square root ``r = sqrt(R)``, the sine of ``arccos(c)`` among them with ``R = 1 - c^2``,
* ``S^2 = 1 - C^2`` for the sine and cosine of a quarter of an angle that is not an arc cosine.

A root that the others have already is written with these, so that they stay independent; then a numerator is zero if and only
if the value is, with angles and pi as free generators. Zero proves equality. A remainder that is not zero proves nothing by
itself, since an angle may hang together with others in ways that are not looked for; see ``court``.

Absolute values take their sign from what is assumed. Where that does not settle it, a field that is tied to a state takes the
sign that it has there, and notes it: what it proves holds wherever all its notes do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from typing import Any

import flint

from yarnverify.symbolic.circles import Circles
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.enclosures import BITS, Place, Recipe
from yarnverify.symbolic.logarithms import Exponentials
from yarnverify.symbolic.polynomials import Poly, Quotient, Relations
from yarnverify.symbolic.reading import Reading, UnsupportedError, Value, fold, plus
from yarnverify.symbolic.roots import Roots
from yarnverify.symbolic.slopes import Rule, Slopes
from yarnverify.symbolic.tree import Expr, Name

_SPARE = 12  # generators kept free for square roots and angles that are met on the way
State = Mapping[Name, Any]


class Field(Reading):
    """The quotients of one section: generators for its symbols, values of its trees, and their derivatives.

    Parameters
    ----------
    section
        Where symbols get their meaning, and the assumptions that settle signs.
    symbols
        All unknowns and parameters that may appear.
    positive
        Parameters that are never negative.
    samples
        Gives states at which is looked how angles hang together.
    here
        The state that settles signs which nothing else does.
    turns
        Whether the angle of a point (x, y) is a generator of its own. Else it is read as an arc cosine, which hangs together
        with other angles, but takes the root of ``x^2 + y^2``.
    """

    def __init__(
        self,
        section: Section,
        symbols: Iterable[Name],
        positive: Iterable[Name] = (),
        samples: Callable[[], Iterable[State]] = tuple,
        here: State | None = None,
        turns: bool = False,
    ) -> None:
        super().__init__(section)
        own = section.unknowns  # the place that all others are seen from is one of these, not a misprint's k_b in bold
        names = sorted(set(symbols), key=lambda n: (not n.bold, n not in own, n.base, n.sub))
        self._points = [n for n in names if n.bold]
        scalars = [n for n in names if not n.bold]
        labels: list[str] = [f"spare{i}" for i in range(_SPARE)]
        self._spare = iter(labels[::-1])  # a later atom is larger than those in its square
        for name in self._points[1:]:
            labels += [f"{name.label}.{axis}" for axis in "zyx"]
        labels += [f"length({name.label})" for name in self._points[1:]]
        labels += [f"{name.label}.{axis}" for name in self._points[:1] for axis in "xyz"]
        labels += [str(name) for name in scalars]
        self.relations = Relations(labels)
        self._positive = {f"length({name.label})" for name in self._points} | {str(name) for name in positive}
        self._rules: dict[str, Rule] = {}
        self._recipes: dict[str, Recipe] = {}
        self._not_negative: list[Poly] = []  # sums of squares, and 1 - c^2 of angles between directions
        self._granted: list[Poly] | None = None  # what stands under the printed roots of the claim at hand
        self._direction = {
            name: [self.relations.make(f"{name.label}.{axis}") for axis in "xyz"] for name in self._points[1:]
        }
        for name in self._points[1:]:
            x, y, _ = (a.numerator for a in self._direction[name])
            self.relations.relate(f"{name.label}.z", 1 - x**2 - y**2)
        self._slopes = Slopes(self.relations, self._points, self._direction, self._rules)
        self._here = None if here is None else self.place(here)
        self._states, self._turns = samples, turns
        self._places: dict[int, Place] = {}
        self._notes: list[Callable[[Place], bool]] = []
        self.roots, self.circles, self.exponentials = Roots(self, labels), Circles(self), Exponentials(self)

    def constant(self, value: Any) -> Quotient:
        return self.relations.constant(value)

    @property
    def pi(self) -> Quotient:
        return self.circles.pi

    def arccos(self, cosine: Quotient) -> Quotient:
        return self.circles.arccos(cosine)

    def log(self, value: Quotient) -> Quotient:
        return self.exponentials.log(value)

    def exp(self, value: Quotient) -> Quotient:
        return self.exponentials.exp(value)

    def safe(self, name: str, args: tuple[Expr, ...]) -> Quotient | None:
        if name != "atan2" or not self._turns:
            return None
        y, x = (self.value(arg) for arg in args)
        return self.circles.turn(y, x)

    def circle(self, angle: Quotient) -> tuple[Quotient, Quotient]:
        return self.circles.point(angle)

    def value(self, expr: Expr, blocks: Callable[[Expr], Value] | None = None) -> Value:
        """As in ``Reading``; notes what cannot be negative whatever is printed.

        That a root is printed makes its radicand not negative in its own claim alone: see ``claim``.
        """
        if expr.op == "norm":
            self.value(expr.args[0], blocks)  # may hold printed roots of its own
        before = len(self.roots.squares)
        value = super().value(expr, blocks)
        if expr.op == "sqrt" and self._granted is not None:
            self._granted += [p for p in self.roots.radicands() if (value * value).numerator == p]
        if expr.op == "norm":
            self._not_negative += self.roots.radicands()[before:]
        elif expr.op == "call" and expr.value == "arccos" and self._between_directions(expr.args[0]):
            cosine = super().value(expr.args[0], blocks)
            if not cosine.factors:
                both = (1 - cosine * cosine, 1 - cosine, 1 + cosine)
                self._not_negative += [q.numerator for q in both if q.numerator]
        return value

    @contextmanager
    def claim(self, printed: bool = True) -> Iterator[None]:
        """Within it, what stands under a printed root is not negative; what it settles must not be kept beyond it.

        With ``printed`` false that is suspended, for what other claims share.
        """
        before, self._granted = self._granted, [] if printed else None
        try:
            yield
        finally:
            self._granted = before

    def symbol(self, name: Name) -> Value:
        with self.claim(printed=False):
            return super().symbol(name)

    def _between_directions(self, expr: Expr) -> bool:
        """Whether a cosine is a product of two vectors of length 1, up to its sign."""
        while expr.op in {"neg", "abs"} or (expr.op == "symbol" and self.section.meaning(expr.name) is not None):
            expr = expr.args[0] if expr.op != "symbol" else self.section.meaning(expr.name)  # type: ignore[assignment]
        if expr.op not in {"mul", "dot"} or len(expr.args) != 2:
            return False
        vectors = [self.value(arg.args[0] if arg.op == "transpose" else arg) for arg in expr.args]
        flat = all(isinstance(vector, list) and not isinstance(vector[0], list) for vector in vectors)
        return flat and all((fold([v * v for v in vector], plus) - 1).is_zero for vector in vectors)

    def leaf(self, name: Name) -> Value:
        if not name.bold:
            return self.relations.make(str(name))
        base = [self.relations.make(f"{self._points[0].label}.{axis}") for axis in "xyz"]
        if name == self._points[0]:
            return base
        span = self.relations.make(f"length({name.label})")
        return [b + span * a for b, a in zip(base, self._direction[name], strict=True)]

    # -- states ---------------------------------------------------------------------------------------------------

    def place(self, state: State) -> Place:
        with flint.ctx.workprec(BITS):
            return Place(state, self._points, self.relations.names, self._recipes)

    @cached_property
    def places(self) -> list[Place]:
        """Where is looked how angles hang together: at the one state that the field is tied to, or at all samples."""
        return [self._here] if self._here is not None else [self.place(state) for state in self._states()]

    def note(self, holds: Callable[[Place], bool]) -> None:
        """Note what holds at the state here, so that what is proved holds wherever it does."""
        if self._here is not None:
            self._notes.append(holds)

    def holds_at(self, state: State) -> bool:
        """Whether a state is in the region that the field's notes describe."""
        place = self._places.get(id(state)) or self._places.setdefault(id(state), self.place(state))
        with flint.ctx.workprec(BITS):
            return all(holds(place) for holds in self._notes)

    def sign_here(self, poly: Poly) -> int:
        """Sign of a polynomial at the state that the field is tied to, noted; 0 where there is none or it does not tell."""
        if self._here is None:
            return 0
        with flint.ctx.workprec(BITS):
            sign = self._here.sign(poly)
        if sign:
            self.note(lambda place: place.sign(poly) == sign)
        return sign

    # -- generators and their signs ----------------------------------------------------------------------------------

    def atom(self, rule: Rule, recipe: Recipe, square: Poly | None = None, positive: bool = False) -> str:
        """A new generator: its derivatives, its ball at a state, and its square if it has one."""
        label = next(self._spare, None)
        if label is None:
            raise UnsupportedError("more square roots and angles in one section than can be held apart")
        if square is not None:
            self.relations.relate(label, square)
        self._rules[label], self._recipes[label] = rule, recipe
        if positive:
            self._positive.add(label)
        return label

    def sign(self, poly: Poly) -> int:
        """Sign of a polynomial as far as the assumptions settle it: 1, -1, or 0 for not known."""
        signs = {self._sign_of_term(monomial, coefficient) for monomial, coefficient in poly.to_dict().items()}
        if len(signs) == 1 and signs != {0}:
            return signs.pop()
        for known in (*self._known_positive, *self._not_negative, *(self._granted or ())):
            ratio = poly.leading_coefficient() / known.leading_coefficient()
            if poly == known * ratio:
                return 1 if ratio > 0 else -1
        return 0

    def _sign_of_term(self, monomial: tuple[int, ...], coefficient: Any) -> int:
        names = self.relations.names
        known = all(names[i] in self._positive for i, e in enumerate(monomial) if e % 2)
        return 0 if not known else 1 if coefficient > 0 else -1

    @cached_property
    def _known_positive(self) -> list[Poly]:
        found = []
        for assumption in self.section.assumptions:
            difference = self.value(assumption.left) - self.value(assumption.right)
            if not difference.factors and difference.numerator:
                found.append(difference.numerator)
        return found

    def absolute(self, value: Quotient) -> Quotient:
        return self.roots.absolute(value)

    def sqrt(self, value: Quotient) -> Quotient:
        return self.roots.sqrt(value)

    @property
    def settles(self) -> bool:
        """Whether a normal form that is not zero should mean a difference: no relation between roots can be hidden."""
        return self.roots.independent

    # -- derivatives ----------------------------------------------------------------------------------------------

    def derivative(self, value: Quotient, unknown: Name, axis: int = 0) -> Quotient:
        """Exact partial derivative by an unknown, or by one coordinate of a point."""
        return self._slopes.derivative(value, unknown, axis)

    def gradient(self, value: Value, unknown: Name) -> Value:
        """Derivative of a scalar or a vector by an unknown: a scalar, a list of 3, or rows of 3."""
        if isinstance(value, list):
            return [self.gradient(v, unknown) for v in value]
        if not unknown.bold:
            return self.derivative(value, unknown)
        return [self.derivative(value, unknown, axis) for axis in range(3)]
