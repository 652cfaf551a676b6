"""Reading 1: exact normal forms and exact derivatives, in SymPy's sparse polynomials.

A value is a quotient ``numerator / product of factors`` over named atoms. Points are written in the coordinates of the
identities at hand: with x_b the first point, ``x_i = x_b + l_i a_i``, where ``a_i`` is a unit vector, so that a length is a
generator instead of a square root. The map (x_b, l_i, a_i) -> (x_b, x_i) covers all states with l_i > 0; an identity in
these coordinates therefore holds wherever the lengths are not zero. Relations:

* ``a_iz^2 = 1 - a_ix^2 - a_iy^2``,
* ``r^2 = R`` for every other square root ``r = sqrt(R)``, the sine of ``arccos(c)`` among them with ``R = 1 - c^2``,
* ``S^2 = 1 - C^2`` for the sine and cosine of an angle that is not an arc cosine.

Their leading monomials are pure powers of distinct generators, so they are a Groebner basis for the lexicographic order in
which later atoms are larger, and the remainder of a numerator is its normal form: it is zero if and only if the polynomial
lies in the ideal of the relations. Zero therefore proves equality (angles and pi stay free generators, for which the
identity holds whatever their values). A remainder that is not zero proves nothing by itself; see ``prove``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import prod
from typing import Any

import flint
from sympy import QQ, Symbol
from sympy.polys.orderings import lex
from sympy.polys.rings import ring

from yarnverify.symbolic.document import Section
from yarnverify.symbolic.reading import Reading, UnsupportedError, Value, fold, plus
from yarnverify.symbolic.tree import Expr, Name

Poly = Any  # a SymPy PolyElement
_LARGEST_PRODUCT = 200_000  # terms times terms; the paper's formulas stay below a thirtieth of it
_ROOTS_COMPARED = 5  # how many known roots a new one is compared with, in all combinations
_SPARE = 12  # generators kept free for square roots and angles that are met on the way


@dataclass(frozen=True, eq=False)
class Quotient:
    """``numerator / product of factor^power``, numerator reduced by the field's relations."""

    field: Field
    numerator: Poly
    factors: tuple[tuple[Poly, int], ...] = ()

    def _lift(self, other: Quotient | int) -> Quotient:
        return other if isinstance(other, Quotient) else self.field.constant(other)

    def __add__(self, other: Quotient | int) -> Quotient:
        other = self._lift(other)
        if not other.numerator:
            return self
        if not self.numerator:
            return other
        if self.factors == other.factors:
            return self.field.quotient(self.numerator + other.numerator, self.factors)
        mine, theirs = dict(self.factors), dict(other.factors)
        common = {f: max(mine.get(f, 0), theirs.get(f, 0)) for f in (*mine, *theirs)}
        left, right = self.numerator, other.numerator
        for factor, power in common.items():
            left = self.field.times_power(left, factor, power - mine.get(factor, 0))
            right = self.field.times_power(right, factor, power - theirs.get(factor, 0))
        return self.field.quotient(left + right, tuple(common.items()))

    __radd__ = __add__

    def __neg__(self) -> Quotient:
        return Quotient(self.field, -self.numerator, self.factors)

    def __sub__(self, other: Quotient | int) -> Quotient:
        return self + (-self._lift(other))

    def __rsub__(self, other: int) -> Quotient:
        return self._lift(other) + (-self)

    def __mul__(self, other: Quotient | int) -> Quotient:
        other = self._lift(other)
        if not self.numerator or not other.numerator:
            return self.field.constant(0)
        self.field.check_size(self.numerator, other.numerator)
        factors = dict(self.factors)
        for factor, power in other.factors:
            factors[factor] = factors.get(factor, 0) + power
        return self.field.quotient(self.field.reduce(self.numerator * other.numerator), tuple(factors.items()))

    __rmul__ = __mul__

    def inverse(self) -> Quotient:
        if not self.numerator:
            raise ZeroDivisionError
        content, parts = self.field.factor(self.numerator)
        top = self.field.ring(1) / content
        for factor, power in self.factors:
            top = self.field.times_power(top, factor, power)
        return self.field.quotient(top, parts)

    def __truediv__(self, other: Quotient | int) -> Quotient:
        return self * self._lift(other).inverse()

    def __rtruediv__(self, other: int) -> Quotient:
        return self._lift(other) * self.inverse()

    def __pow__(self, exponent: int) -> Quotient:
        if exponent < 0:
            return self.inverse() ** -exponent
        result = self.field.constant(1)
        for _ in range(exponent):
            result = result * self
        return result

    @property
    def is_zero(self) -> bool:
        return not self.numerator


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
    """

    def __init__(self, section: Section, symbols: Iterable[Name], positive: Iterable[Name] = ()) -> None:
        super().__init__(section)
        names = sorted(set(symbols), key=lambda n: (not n.bold, n.base, n.sub))
        self._points = [n for n in names if n.bold]
        self._scalars = [n for n in names if not n.bold]
        labels: list[str] = [f"spare{i}" for i in range(_SPARE)]
        for name in self._points[1:]:
            labels += [f"{name.label}.{axis}" for axis in "zyx"]
        labels += [f"length({name.label})" for name in self._points[1:]]
        labels += [f"{name.label}.{axis}" for name in self._points[:1] for axis in "xyz"]
        labels += [str(name) for name in self._scalars]
        self.ring, *generators = ring([Symbol(label) for label in labels], QQ, lex)  # as text, SymPy would split names
        self._generator = dict(zip(labels, generators, strict=True))
        self._position = {label: i for i, label in enumerate(labels)}
        self._spare = iter(labels[:_SPARE][::-1])  # a later atom is larger than those in its square
        # generator -> (position, polynomial of its square), larger generators first
        self._squares: dict[str, Poly] = {}
        self._positive = {f"length({name.label})" for name in self._points} | {str(name) for name in positive}
        self._rules: dict[str, Callable[[str, Name, int], Quotient]] = {}
        self._roots: dict[Poly, str] = {}
        self._not_negative: list[Poly] = []  # sums of squares, and 1 - c^2 of angles between directions
        self._granted: list[Poly] | None = None  # what stands under the printed roots of the claim at hand
        self._signless = False
        self._factored: dict[Poly, tuple[Any, tuple[tuple[Poly, int], ...]]] = {}
        self._angles: list[tuple[Quotient, Quotient]] = []  # (cosine, angle)
        self._circles: list[tuple[Quotient, Quotient, Quotient]] = []  # (angle, sine, cosine)
        self._logs: list[tuple[Quotient, Quotient]] = []
        self._exponentials: list[tuple[Quotient, Quotient]] = []
        self._derivatives: dict[tuple[str, Name, int], Quotient] = {}
        self._direction = {name: [self._make(f"{name.label}.{axis}") for axis in "xyz"] for name in self._points[1:]}
        for name in self._points[1:]:
            x, y, _ = (a.numerator for a in self._direction[name])
            self._squares[f"{name.label}.z"] = 1 - x**2 - y**2

    # -- values ---------------------------------------------------------------------------------------------------

    def _make(self, label: str) -> Quotient:
        return Quotient(self, self._generator[label])

    def constant(self, value: Any) -> Quotient:
        return Quotient(self, self.ring(QQ(value.numerator, value.denominator)))

    def reduce(self, poly: Poly) -> Poly:
        """Remainder by the relations."""
        for label in self._order:
            position, square = self._position[label], self._squares[label]
            if not any(monomial[position] > 1 for monomial in poly):
                continue
            parts: dict[int, Any] = {}
            for monomial, coefficient in poly.items():
                half, odd = divmod(monomial[position], 2)
                rest = (*monomial[:position], odd, *monomial[position + 1 :])
                part = parts.setdefault(half, {})
                part[rest] = part.get(rest, QQ(0)) + coefficient
            total, power, at = self.ring(0), self.ring(1), 0
            for half in sorted(parts):
                for _ in range(half - at):
                    power = power * square
                at = half
                total = total + self.ring.from_dict({m: c for m, c in parts[half].items() if c}) * power
            poly = total
        return poly

    @cached_property
    def _order(self) -> list[str]:
        return sorted(self._squares, key=self._position.__getitem__)

    def quotient(self, numerator: Poly, factors: tuple[tuple[Poly, int], ...]) -> Quotient:
        """A value in which powers of plain generators are cancelled, so that degrees stay low."""
        if not numerator:
            return Quotient(self, numerator)
        kept = []
        for factor, power in factors:
            if power and len(factor) == 1:
                (position,) = (i for i, e in enumerate(factor.LM) if e)
                shared = min(power, min(monomial[position] for monomial in numerator))
                if shared:
                    numerator = self.ring.from_dict(
                        {(*m[:position], m[position] - shared, *m[position + 1 :]): c for m, c in numerator.items()}
                    )
                    power -= shared
            if power:
                kept.append((factor, power))
        return Quotient(self, numerator, tuple(kept))

    @staticmethod
    def check_size(a: Poly, b: Poly) -> None:
        """Refuse products that would take minutes."""
        if len(a) * len(b) > _LARGEST_PRODUCT:
            raise UnsupportedError(f"the normal form grows beyond {_LARGEST_PRODUCT} products of terms")

    def times_power(self, poly: Poly, factor: Poly, power: int) -> Poly:
        for _ in range(power):
            self.check_size(poly, factor)
            poly = self.reduce(poly * factor)
        return poly

    def factor(self, poly: Poly) -> tuple[Any, tuple[tuple[Poly, int], ...]]:
        """Rational content, and factors with their powers."""
        if len(poly) == 1:
            monomial, content = poly.LM, poly.LC
            return content, tuple((self.ring.gens[i], e) for i, e in enumerate(monomial) if e)
        if poly not in self._factored:
            self._factored[poly] = self._find_factors(poly)
        return self._factored[poly]

    def _find_factors(self, poly: Poly) -> tuple[Any, tuple[tuple[Poly, int], ...]]:
        """Factors over the generators that occur, by FLINT, since SymPy's own factoring may run for hours here."""
        used = [i for i in range(self.ring.ngens) if any(monomial[i] for monomial in poly)]
        context = flint.fmpq_mpoly_ctx.get(tuple(f"g{i}" for i in used), "lex")
        dense = {tuple(m[i] for i in used): flint.fmpq(int(c.numerator), int(c.denominator)) for m, c in poly.items()}
        content, parts = context.from_dict(dense).factor()
        back = [
            (self.ring.from_dict({self._spread(m, used): _rational(c) for m, c in p.to_dict().items()}), int(e))
            for p, e in parts
        ]
        return _rational(content), tuple(sorted(back, key=lambda part: str(part[0])))

    def _spread(self, monomial: tuple[int, ...], used: list[int]) -> tuple[int, ...]:
        exponents = [0] * self.ring.ngens
        for i, exponent in zip(used, monomial, strict=True):
            exponents[i] = int(exponent)
        return tuple(exponents)

    # -- roots, absolute values, angles ---------------------------------------------------------------------------

    def _atom(self, square: Poly | None, rule: Callable[[str, Name, int], Quotient], positive: bool) -> str:
        label = next(self._spare, None)
        if label is None:
            raise UnsupportedError("more square roots and angles in one section than can be held apart")
        if square is not None:
            self._squares[label] = square
            self.__dict__.pop("_order", None)
        self._rules[label] = rule
        if positive:
            self._positive.add(label)
        return label

    def sign(self, poly: Poly) -> int:
        """Sign of a polynomial as far as the assumptions settle it: 1, -1, or 0 for not known."""
        if len(poly) == 1:
            odd = [self.ring.symbols[i].name for i, e in enumerate(poly.LM) if e % 2]
            if all(name in self._positive for name in odd):
                return 1 if poly.LC > 0 else -1
        for known in (*self._known_positive, *self._not_negative, *(self._granted or ())):
            ratio = poly.LC / known.LC
            if poly == known * ratio:
                return 1 if ratio > 0 else -1
        return 0

    @cached_property
    def _known_positive(self) -> list[Poly]:
        found = []
        for assumption in self.section.assumptions:
            difference = self.value(assumption.left) - self.value(assumption.right)
            if not difference.factors and difference.numerator:
                found.append(difference.numerator)
        return found

    def absolute(self, value: Quotient) -> Quotient:
        """Absolute value, by sign where it is known, else as a root of the square."""
        result = self.constant(1)
        content, parts = self.factor(value.numerator)
        result = result * abs(content)
        for part, power, invert in [(p, e, False) for p, e in parts] + [(p, e, True) for p, e in value.factors]:
            sign = self.sign(part)
            if sign:
                one = Quotient(self, part) * sign
            elif power % 2 == 0:
                one, power = Quotient(self, self.reduce(part**2)), power // 2
            else:
                one, self._signless = self._root(part**2), True
            result = result * (one**-power if invert else one**power)
        return result

    @property
    def settles(self) -> bool:
        """Whether a normal form that is not zero should mean a difference: no relation between roots can be hidden.

        Several square roots may depend on each other, and an absolute value of unknown sign is a root of a square.
        """
        return len(self._roots) <= 1 and not self._signless

    def value(self, expr: Expr, blocks: Callable[[Expr], Value] | None = None) -> Value:
        """As in ``Reading``; notes what cannot be negative whatever is printed.

        That a root is printed makes its radicand not negative in its own claim alone: see ``claim``.
        """
        if expr.op == "norm":
            self.value(expr.args[0], blocks)  # may hold printed roots of its own
        before = len(self._roots)
        value = super().value(expr, blocks)
        if expr.op == "sqrt" and self._granted is not None:
            self._granted += [p for p in self._roots if (value * value).numerator == p]
        if expr.op == "norm":
            self._not_negative += [*self._roots][before:]
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

    def _root(self, square: Poly) -> Quotient:
        """A generator for the square root of a polynomial; for p^2 it is the absolute value of p."""
        if square not in self._roots:

            def rule(label: str, unknown: Name, axis: int) -> Quotient:
                return self.derivative(Quotient(self, square), unknown, axis) / (self._make(label) * 2)

            self._roots[square] = self._atom(self.reduce(square), rule, positive=True)
        return self._make(self._roots[square])

    def sqrt(self, value: Quotient) -> Quotient:
        """Square root of a value that is not negative: squares come out, the rest becomes one root."""
        if value.is_zero:
            return value
        content, parts = self.factor(value.numerator)
        outside, inside = self.constant(1), self.ring(1)
        for part, power, invert in [(p, e, False) for p, e in parts] + [(p, e, True) for p, e in value.factors]:
            whole, odd = divmod(power + (power % 2 if invert else 0), 2)
            if whole:
                outside = outside * self.absolute(Quotient(self, part)) ** (-whole if invert else whole)
            if odd or (invert and power % 2):
                inside = inside * part
        root_content, content = _rational_root(content)
        outside = outside * self.constant(root_content)
        inside = self.reduce(inside * content)
        if inside == 1:
            return outside
        return outside * self._independent_root(inside)

    def _independent_root(self, inside: Poly) -> Quotient:
        """Square root of a polynomial, written with known roots where a product of theirs with it is a square.

        Keeps the roots independent, so that for instance sin(t) = 2 sin(t/2) cos(t/2) is seen.
        """
        known = [square for square in self._roots if square != inside][:_ROOTS_COMPARED]
        for count in range(1, len(known) + 1) if inside not in self._roots else ():
            for chosen in combinations(known, count):
                product = self.reduce(prod(chosen, start=inside))
                content, parts = self.factor(product)
                outside, rest = _rational_root(content)
                if rest == 1 and all(power % 2 == 0 for _, power in parts):
                    root = self.constant(outside)
                    for part, power in parts:
                        root = root * self.absolute(Quotient(self, part)) ** (power // 2)
                    for square in chosen:
                        root = root / self._make(self._roots[square])
                    return root
        return self._root(inside)

    def arccos(self, cosine: Quotient) -> Quotient:
        for exact, halves in ((0, 1), (1, 0), (-1, 2)):
            if (cosine - exact).is_zero:
                return self.pi * self.constant(QQ(halves, 2))
        for known, angle in self._angles:
            if (known - cosine).is_zero:
                return angle
            if (known + cosine).is_zero:
                return self.pi - angle

        def rule(label: str, unknown: Name, axis: int) -> Quotient:
            return -self.derivative(cosine, unknown, axis) / self.sqrt(1 - cosine * cosine)

        angle = self._make(self._atom(None, rule, positive=True))
        self._angles.append((cosine, angle))
        return angle

    def log(self, value: Quotient) -> Quotient:
        """Logarithm: the sum of those of the factors, where each of them is positive."""
        content, parts = self.factor(value.numerator)
        signed = [(part, power) for part, power in (*parts, *((p, -e) for p, e in value.factors))]
        signs = [self.sign(part) for part, _ in signed]
        if content < 0 and signs.count(-1) % 2 == 1:  # an odd number of turned signs makes up for it
            content = -content
        elif content < 0 or signs.count(-1) % 2 == 1 or 0 in signs:
            return self._log_of(value)
        total = self.constant(0)
        for prime, power in _prime_powers(content):
            total = total + self._log_of(self.constant(QQ(prime))) * power
        for (part, power), sign in zip(signed, signs, strict=True):
            total = total + self._log_of(Quotient(self, part) * sign) * power
        return total

    def _log_of(self, value: Quotient) -> Quotient:
        for known, found in self._logs:
            if (known - value).is_zero:
                return found

        def rule(label: str, unknown: Name, axis: int) -> Quotient:
            return self.derivative(value, unknown, axis) / value

        found = self._make(self._atom(None, rule, positive=False))
        self._logs.append((value, found))
        return found

    def exp(self, value: Quotient) -> Quotient:
        """Exponential: whole multiples of one exponent are powers of one generator."""
        if value.is_zero:
            return self.constant(1)
        for known, found in self._exponentials:
            for times in (1, -1, 2, -2, 3, -3):
                if (known * times - value).is_zero:
                    return found**times

        def rule(label: str, unknown: Name, axis: int) -> Quotient:
            return self._make(label) * self.derivative(value, unknown, axis)

        found = self._make(self._atom(None, rule, positive=True))
        self._exponentials.append((value, found))
        return found

    @cached_property
    def pi(self) -> Quotient:
        return self._make(self._atom(None, lambda label, unknown, axis: self.constant(0), positive=True))

    def circle(self, angle: Quotient) -> tuple[Quotient, Quotient]:
        """Sine and cosine: of ``n arccos(c)/2 + m pi/2`` through c, of anything else as a new pair on the unit circle."""
        split = self._split_angle(angle)
        if split is not None:
            n, m, known_cosine = split
            sine, cosine = self.constant(0), self.constant(1)
            if known_cosine is not None:
                one: tuple[Quotient, Quotient]
                if n % 2:
                    half = self.sqrt(
                        (1 - known_cosine) / 2
                    )  # the other one follows: two roots would not be independent
                    one = half, self.sqrt(1 - known_cosine * known_cosine) / (2 * half)
                else:
                    n, one = n // 2, (self.sqrt(1 - known_cosine * known_cosine), known_cosine)
                step = (one[0] if n > 0 else -one[0]), one[1]
                for _ in range(abs(n)):
                    sine, cosine = sine * step[1] + cosine * step[0], cosine * step[1] - sine * step[0]
            for _ in range(m % 4):
                sine, cosine = cosine, -sine
            return sine, cosine
        for known, sine, cosine in self._circles:
            if (known - angle).is_zero:
                return sine, cosine

        def sine_rule(label: str, unknown: Name, axis: int) -> Quotient:
            return self._make(cosine_label) * self.derivative(angle, unknown, axis)

        def cosine_rule(label: str, unknown: Name, axis: int) -> Quotient:
            return -self._make(sine_label) * self.derivative(angle, unknown, axis)

        cosine_label = self._atom(None, cosine_rule, positive=False)
        sine_label = self._atom(1 - self._generator[cosine_label] ** 2, sine_rule, positive=False)
        pair = self._make(sine_label), self._make(cosine_label)
        self._circles.append((angle, *pair))
        return pair

    def _split_angle(self, angle: Quotient) -> tuple[int, int, Quotient | None] | None:
        """``angle = n t/2 + m pi/2`` as (n, m, cos t), or None where it is not of this form."""
        if angle.factors:
            return None
        n, m, cosine = 0, 0, None
        of_pi = self.pi.numerator
        for monomial, coefficient in angle.numerator.items():
            twice = coefficient * 2
            if twice.denominator != 1:
                return None
            term = self.ring.from_dict({monomial: QQ(1)})
            if term == of_pi:
                m = int(twice)
                continue
            match = [c for c, known in self._angles if known.numerator == term]
            if not match or cosine is not None:
                return None
            n, cosine = int(twice), match[0]
        return n, m, cosine

    def leaf(self, name: Name) -> Value:
        if not name.bold:
            return self._make(str(name))
        base = [self._make(f"{self._points[0].label}.{axis}") for axis in "xyz"]
        if name == self._points[0]:
            return base
        span = self._make(f"length({name.label})")
        return [b + span * a for b, a in zip(base, self._direction[name], strict=True)]

    # -- derivatives ----------------------------------------------------------------------------------------------

    def derivative(self, value: Quotient, unknown: Name, axis: int = 0) -> Quotient:
        """Exact partial derivative by an unknown, or by one coordinate of a point."""
        result = self._poly_derivative(value.numerator, unknown, axis)
        if value.factors:
            result = result * Quotient(self, self.ring(1), value.factors)
        for factor, power in value.factors:
            result = result - value * self._poly_derivative(factor, unknown, axis) * power / Quotient(self, factor)
        return result

    def _poly_derivative(self, poly: Poly, unknown: Name, axis: int) -> Quotient:
        total = self.constant(0)
        used = [i for i in range(self.ring.ngens) if any(monomial[i] for monomial in poly)]
        for i in used:
            inner = self._generator_derivative(self.ring.symbols[i].name, unknown, axis)
            if inner.numerator:
                total = total + Quotient(self, self.reduce(poly.diff(self.ring.gens[i]))) * inner
        return total

    def _generator_derivative(self, label: str, unknown: Name, axis: int) -> Quotient:
        key = (label, unknown, axis)
        if key not in self._derivatives:
            self._derivatives[key] = self._find_derivative(label, unknown, axis)
        return self._derivatives[key]

    def _find_derivative(self, label: str, unknown: Name, axis: int) -> Quotient:
        if label in self._rules:
            return self._rules[label](label, unknown, axis)
        if not unknown.bold:
            return self.constant(int(label == str(unknown)))
        base = self._points[0]
        for i, component in enumerate("xyz"):
            if label == f"{base.label}.{component}":
                return self.constant(int(unknown == base and i == axis))
        for name in self._points[1:]:
            if unknown not in (name, base):
                continue
            sign = 1 if unknown == name else -1
            direction = self._direction[name]
            if label == f"length({name.label})":
                return direction[axis] * sign
            for i, component in enumerate("xyz"):
                if label == f"{name.label}.{component}":
                    turned = int(i == axis) - direction[i] * direction[axis]
                    return turned * sign / self._make(f"length({name.label})")
        return self.constant(0)

    def gradient(self, value: Value, unknown: Name) -> Value:
        """Derivative of a scalar or a vector by an unknown: a scalar, a list of 3, or rows of 3."""
        if isinstance(value, list):
            return [self.gradient(v, unknown) for v in value]
        if not unknown.bold:
            return self.derivative(value, unknown)
        return [self.derivative(value, unknown, axis) for axis in range(3)]


def _rational(value: flint.fmpq) -> Any:
    return QQ(int(value.p), int(value.q))


def _prime_powers(value: Any) -> list[tuple[int, int]]:
    """Prime factors of a positive rational."""
    from sympy import factorint

    below = [(prime, -power) for prime, power in factorint(value.denominator).items()]
    return [*factorint(value.numerator).items(), *below]


def _rational_root(value: Any) -> tuple[Any, Any]:
    """A positive rational as (root of its square part, rest)."""
    outside, inside = QQ(1), QQ(1)
    for prime, power in _prime_powers(value):
        outside *= QQ(prime) ** (power // 2)
        inside *= QQ(prime) ** (power % 2)
    return outside, inside
