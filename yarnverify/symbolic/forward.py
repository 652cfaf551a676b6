"""Reading 2: forward second-order differentiation of the definitions, over exact rationals, balls or floats.

Independent of the first reading: no SymPy, no normal forms, no formula for any derivative. A ``Jet`` carries a value with
its gradient and Hessian by all unknowns at one state; the energy's own definition is evaluated in jets. Over rationals the
state is chosen so that lengths and sines come out rational (square roots that do not are adjoined exactly); an angle is
replaced by a rational number drawn for its cosine, and pi by another, since an identity of functions holds whatever their
values (an arc cosine satisfies no algebraic equation). Two sides that differ there differ as functions up to bad luck,
which the balls, with true angles and pi, then exclude.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations
from typing import Any

import flint
import numpy as np

from yarnverify.symbolic.declare import Assumption
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.tree import FORCE, ZERO, Expr, Name

Number = Any  # flint.fmpq, Algebraic, flint.arb or float
State = Mapping[Name, Any]  # a Fraction for a scalar, three for a point


class UndefinedError(Exception):
    """The formula has no value at this state: a zero denominator, or the root of a negative number."""


# -- numbers ----------------------------------------------------------------------------------------------------------


class Algebraic:
    """A number ``sum_k q_k r_k`` over products r_k of adjoined square roots; immutable, exact."""

    __slots__ = ("parts", "roots")

    def __init__(self, roots: list[Number], parts: dict[int, Any]) -> None:
        self.roots = roots  # squares of the adjoined roots, each over earlier ones
        self.parts = {mask: q for mask, q in parts.items() if q != 0}

    def _lift(self, other: Number) -> Algebraic:
        return other if isinstance(other, Algebraic) else Algebraic(self.roots, {0: flint.fmpq(other)})

    def __add__(self, other: Number) -> Number:
        if isinstance(other, np.ndarray):
            return NotImplemented  # NumPy then works entry by entry
        parts = dict(self.parts)
        for mask, q in self._lift(other).parts.items():
            parts[mask] = parts.get(mask, 0) + q
        return Algebraic(self.roots, parts)._settle()

    __radd__ = __add__

    def __neg__(self) -> Algebraic:
        return Algebraic(self.roots, {mask: -q for mask, q in self.parts.items()})

    def __sub__(self, other: Number) -> Number:
        return self + (-other)

    def __rsub__(self, other: Number) -> Number:
        return -self + other

    def __mul__(self, other: Number) -> Number:
        if isinstance(other, np.ndarray):
            return NotImplemented
        total: Number = Algebraic(self.roots, {})
        for m, p in self.parts.items():
            for n, q in self._lift(other).parts.items():
                term: Number = Algebraic(self.roots, {m ^ n: p * q})
                for k, square in enumerate(self.roots):
                    if m & n & (1 << k):
                        term = term * square
                total = total + term
        return total._settle() if isinstance(total, Algebraic) else total

    __rmul__ = __mul__

    def inverse(self) -> Number:
        if not self.parts:
            raise ZeroDivisionError
        top = max(self.parts).bit_length() - 1
        if top < 0:
            return 1 / self.parts[0]
        bit = 1 << top
        low = Algebraic(self.roots, {m: q for m, q in self.parts.items() if not m & bit})._settle()
        high = Algebraic(self.roots, {m ^ bit: q for m, q in self.parts.items() if m & bit})._settle()
        norm = low * low - high * high * self.roots[top]
        if norm == 0:
            raise UndefinedError("dependent square roots")
        root = Algebraic(self.roots, {bit: flint.fmpq(1)})
        return (low - high * root) * (norm.inverse() if isinstance(norm, Algebraic) else 1 / norm)

    def __truediv__(self, other: Number) -> Number:
        return self * (other.inverse() if isinstance(other, Algebraic) else 1 / flint.fmpq(other))

    def __rtruediv__(self, other: Number) -> Number:
        return self.inverse() * other

    def _settle(self) -> Number:
        """Back to a plain rational where no root is left."""
        return self.parts.get(0, flint.fmpq(0)) if set(self.parts) <= {0} else self

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Algebraic) and self.parts == other.parts

    def __hash__(self) -> int:
        return hash(tuple(sorted((m, str(q)) for m, q in self.parts.items())))


class Rationals:
    """Exact arithmetic; square roots are adjoined, angles and pi are drawn."""

    exact = True

    def __init__(self, seed: int) -> None:
        self._draw = random.Random(seed)
        self._roots: list[Number] = []
        self._angles: dict[Number, Number] = {}
        self._circles: dict[Number, tuple[Number, Number]] = {}
        self.pi = self._rational()

    def _rational(self) -> Number:
        return flint.fmpq(self._draw.randrange(1, 10**6), self._draw.randrange(1, 10**6))

    def constant(self, value: Fraction) -> Number:
        return flint.fmpq(value.numerator, value.denominator)

    def positive(self, value: Number) -> bool:
        if isinstance(value, Algebraic):
            return self._approximate(value) > 0
        return bool(value > 0)

    def _approximate(self, value: Number) -> Any:
        if not isinstance(value, Algebraic):
            return flint.arb(value)
        total = flint.arb(0)
        for mask, q in value.parts.items():
            term = flint.arb(q)
            for k, square in enumerate(value.roots):
                if mask & (1 << k):
                    term = term * self._approximate(square).sqrt()
            total += term
        return total

    def sqrt(self, value: Number) -> Number:
        root = _exact_root(value)
        if root is not None:
            return root
        if not self.positive(value):
            raise UndefinedError("square root of a negative number")
        if value in self._roots:
            return Algebraic(self._roots, {1 << self._roots.index(value): flint.fmpq(1)})
        for count in range(1, len(self._roots) + 1):  # keeps the roots independent
            for chosen in combinations(range(len(self._roots)), count):
                product, mask = value, 0
                for k in chosen:
                    product, mask = product * self._roots[k], mask | (1 << k)
                root = _exact_root(product)
                if root is not None:
                    return root / Algebraic(self._roots, {mask: flint.fmpq(1)})
        self._roots.append(value)
        return Algebraic(self._roots, {1 << (len(self._roots) - 1): flint.fmpq(1)})

    def arccos(self, cosine: Number) -> Number:
        if self.positive(cosine * cosine - 1):
            raise UndefinedError("arc cosine of a number above 1 or below -1")
        if cosine in (1, 0, -1):
            return self.pi * {1: 0, 0: flint.fmpq(1, 2), -1: 1}[int(cosine)]
        if -cosine in self._angles:
            return self.pi - self._angles[-cosine]
        if cosine not in self._angles:
            self._angles[cosine] = self._rational()
        return self._angles[cosine]

    def knows_angle(self, cosine: Number) -> bool:
        """Whether an angle was drawn for this cosine, rather than for its negative."""
        return cosine in self._angles or -cosine not in self._angles

    def circle(self, angle: Number) -> tuple[Number, Number]:
        """A rational point of the unit circle, drawn for an angle that no arc cosine explains."""
        if angle not in self._circles:
            t = self._rational()
            self._circles[angle] = 2 * t / (1 + t * t), (1 - t * t) / (1 + t * t)
        return self._circles[angle]


def _exact_root(value: Number) -> Number | None:
    if isinstance(value, Algebraic) or value < 0:
        return None
    top, bottom = math.isqrt(int(value.p)), math.isqrt(int(value.q))
    return flint.fmpq(top, bottom) if top * top == value.p and bottom * bottom == value.q else None


class Balls:
    """Ball arithmetic: every result encloses the true value."""

    exact = False

    def __init__(self) -> None:
        self.pi = flint.arb.pi()

    def constant(self, value: Fraction) -> Number:
        return flint.arb(flint.fmpq(value.numerator, value.denominator))

    def positive(self, value: Number) -> bool:
        return bool(value > 0)

    def sqrt(self, value: Number) -> Number:
        return value.sqrt()

    def arccos(self, cosine: Number) -> Number:
        if abs(cosine) > 1:
            raise UndefinedError("arc cosine of a number above 1 or below -1")
        if abs(cosine) < 1:
            return cosine.acos()
        # the true cosine lies in the ball and in [-1, 1], since an angle is asked for
        low, high = cosine.lower().max(flint.arb(-1)), cosine.upper().min(flint.arb(1))
        return low.acos().union(high.acos())

    def circle(self, angle: Number) -> tuple[Number, Number]:
        return angle.sin(), angle.cos()


class Floats:
    """Double precision; only ever used to sort out hopeless candidates quickly."""

    exact = False
    pi = math.pi

    def constant(self, value: Fraction) -> Number:
        return float(value)

    def positive(self, value: Number) -> bool:
        return bool(value > 0)

    def sqrt(self, value: Number) -> Number:
        return math.sqrt(value)

    def arccos(self, cosine: Number) -> Number:
        return math.acos(cosine)

    def circle(self, angle: Number) -> tuple[Number, Number]:
        return math.sin(angle), math.cos(angle)


# -- jets -------------------------------------------------------------------------------------------------------------


class Jet:
    """A value with its gradient (n,) and Hessian (n, n); ``first is None`` for a constant."""

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
        return Jet(self.value + other.value, self.first + other.first, self.second + other.second)

    __radd__ = __add__

    def __neg__(self) -> Jet:
        return Jet(-self.value) if self.first is None else Jet(-self.value, -self.first, -self.second)

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
            return Jet(a * b) if some.first is None else Jet(a * b, some.first * scale, some.second * scale)
        mixed = np.outer(self.first, other.first)
        return Jet(a * b, self.first * b + other.first * a, self.second * b + other.second * a + mixed + mixed.T)

    __rmul__ = __mul__

    def chain(self, value: Number, slope: Number, bend: Number) -> Jet:
        """``f(self)`` from f, f', f'' at the value."""
        if self.first is None:
            return Jet(value)
        return Jet(value, self.first * slope, self.second * slope + np.outer(self.first, self.first) * bend)

    def inverse(self) -> Jet:
        if self.value == 0:
            raise UndefinedError("division by zero")
        one = 1 / self.value
        return self.chain(one, -one * one, 2 * one * one * one)

    def __truediv__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return self * other.inverse()
        return (
            Jet(self.value / other)
            if self.first is None
            else Jet(self.value / other, self.first / other, self.second / other)
        )

    def __rtruediv__(self, other: Any) -> Jet:
        return self.inverse() * other

    def __pow__(self, exponent: int) -> Jet:
        if exponent < 0:
            return self.inverse() ** -exponent
        result = Jet(self.value * 0 + 1)
        for _ in range(exponent):
            result = result * self
        return result


# -- evaluation -------------------------------------------------------------------------------------------------------


class Evaluation:
    """Values of a section's trees at one state.

    A scalar is a number or jet; a vector is an array (3, 1), a covector (1, 3), a matrix (3, 3), so that every product is
    an array product. ``blocks`` gives the true forces and derivatives, from jets of the definitions.

    Parameters
    ----------
    section
        Where symbols get their meaning.
    state
        A value for every unknown and parameter.
    numbers
        ``Rationals``, ``Balls`` or ``Floats``.
    energy
        The tree that forces are taken from.
    """

    def __init__(self, section: Section, state: State, numbers: Any, energy: Expr = ZERO) -> None:
        self.section, self.state, self.numbers, self.energy = section, state, numbers, energy
        self._unknowns: list[tuple[Name, int]] = []
        for name in state:
            if section.is_unknown(name):
                self._unknowns += [(name, axis) for axis in range(3 if name.bold else 1)]
        self._plain: dict[Name, Any] = {}
        self._jets: dict[Name, Any] = {}

    # true blocks

    @cached_property
    def _energy_jet(self) -> Jet:
        return Jet._lift(self._value(self.energy, jets=True))

    def columns(self, unknown: Name) -> list[int]:
        return [i for i, (name, _) in enumerate(self._unknowns) if name == unknown]

    def block(self, expr: Expr) -> Any:
        """True value of a force, an energy or a derivative."""
        if expr.op == "energy":
            return self._energy_jet.value
        if expr.op == "force":
            columns = self.columns(expr.name)
            first = self._energy_jet.first
            found = np.array([self._zero if first is None else first[i] * FORCE for i in columns], dtype=object)
            return found.reshape(3, 1) if expr.name.bold else found[0]
        inner, wrt = expr.args[0], self.columns(expr.name)
        if inner.op == "force":
            rows, second = self.columns(inner.name), self._energy_jet.second
            block = [[self._zero if second is None else second[i, j] * FORCE for j in wrt] for i in rows]
        else:
            jets = self._value(inner, jets=True)
            rows_of = [jets] if not isinstance(jets, np.ndarray) else list(jets.reshape(-1))
            firsts = [Jet._lift(jet).first for jet in rows_of]
            block = [[self._zero if first is None else first[j] for j in wrt] for first in firsts]
        array = np.array(block, dtype=object)
        return array[0, 0] if array.shape == (1, 1) else array

    @property
    def _zero(self) -> Number:
        return self.numbers.constant(Fraction(0))

    # trees

    def value(self, expr: Expr) -> Any:
        """Value of a tree: a number or an array.

        Raises
        ------
        UndefinedError
            Where the formula has no value at this state.
        """
        try:
            return self._value(expr, jets=False)
        except (ZeroDivisionError, ValueError, OverflowError) as error:
            raise UndefinedError(str(error)) from None

    def _symbol(self, name: Name, jets: bool) -> Any:
        cache = self._jets if jets else self._plain
        if name not in cache:
            meaning = self.section.meaning(name)
            cache[name] = self._base(name, jets) if meaning is None else self._value(meaning, jets)
        return cache[name]

    def _base(self, name: Name, jets: bool) -> Any:
        given = self.state[name]
        parts = [self.numbers.constant(Fraction(part)) for part in (given if name.bold else (given,))]
        columns = self.columns(name)
        if jets and columns:
            count = len(self._unknowns)
            dtype = float if isinstance(self.numbers, Floats) else object
            zero, one = self._zero, self.numbers.constant(Fraction(1))
            firsts = [np.array([one if i == column else zero for i in range(count)], dtype=dtype) for column in columns]
            flat = np.full((count, count), zero, dtype=dtype)
            parts = [Jet(part, first, flat) for part, first in zip(parts, firsts, strict=True)]
        return np.array(parts, dtype=object).reshape(3, 1) if name.bold else parts[0]

    def _value(self, expr: Expr, jets: bool) -> Any:
        op = expr.op
        if op in {"force", "energy", "derivative"}:
            return self.block(expr)
        if op == "symbol":
            return self._symbol(expr.name, jets)
        if op == "number":
            assert isinstance(expr.value, int)
            return self.numbers.constant(Fraction(expr.value))
        if op == "pi":
            return self.numbers.pi
        if op == "identity":
            constant = self.numbers.constant
            return np.array([[constant(Fraction(int(i == j))) for j in range(3)] for i in range(3)], dtype=object)
        if op == "call" and expr.value != "arccos":
            sine, cosine = self._circle(expr.args[0], jets)
            return {"sin": lambda: sine, "cos": lambda: cosine, "tan": lambda: sine / _nonzero(cosine)}[
                str(expr.value)
            ]()
        values = [self._value(arg, jets) for arg in expr.args]
        first = values[0]
        if op == "add":
            for value in values[1:]:
                first = first + value
            return first
        if op == "neg":
            return -first
        if op == "mul" or op == "dot":
            if op == "dot" and isinstance(first, np.ndarray) and isinstance(values[1], np.ndarray):
                first = first.T
            for value in values[1:]:
                both = isinstance(first, np.ndarray) and isinstance(value, np.ndarray)
                first = first @ value if both else first * value
                if both and first.shape == (1, 1):
                    first = first[0, 0]
            return first
        if op == "frac":
            return first / _nonzero(values[1])
        if op == "pow":
            assert isinstance(expr.value, int)
            power = expr.value
            result = first / first if power == 0 else first
            for _ in range(abs(power) - 1):
                result = result * first
            return 1 / _nonzero(result) if power < 0 else result
        if op == "transpose":
            return first.T if isinstance(first, np.ndarray) else first
        if op == "cross":
            a, b = first.reshape(-1), values[1].reshape(-1)
            turned = [a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3] for i in range(3)]
            return np.array(turned, dtype=object).reshape(3, 1)
        if op == "abs" or (op == "norm" and not isinstance(first, np.ndarray)):
            inner = Jet._lift(first).value
            return first if self.numbers.positive(inner) else -first
        if op == "norm":
            squares = [part * part for part in first.reshape(-1)]
            return self._sqrt(squares[0] + squares[1] + squares[2])
        if op == "sqrt":
            return self._sqrt(first)
        if op == "call":
            return self._arccos(first)
        raise AssertionError(f"no such operation: {op}")

    def _sqrt(self, value: Any) -> Any:
        root = self.numbers.sqrt(Jet._lift(value).value)
        if not isinstance(value, Jet):
            return root
        half = 1 / _nonzero(2 * root)
        return value.chain(root, half, -half / (2 * value.value))

    def _arccos(self, value: Any) -> Any:
        cosine = Jet._lift(value).value
        angle = self.numbers.arccos(cosine)
        if not isinstance(value, Jet) or value.first is None:
            return Jet(angle) if isinstance(value, Jet) else angle
        sine = self.numbers.sqrt(1 - cosine * cosine)
        slope = -1 / _nonzero(sine)
        return value.chain(angle, slope, cosine * slope * slope * slope)

    def _circle(self, expr: Expr, jets: bool) -> tuple[Any, Any]:
        """Sine and cosine; over rationals an angle is recognised as ``n arccos(c)/2 + m pi/2``."""
        if not self.numbers.exact:
            value = self._value(expr, jets)
            sine, cosine = self.numbers.circle(Jet._lift(value).value)
            return self._circle_pair(value, sine, cosine)
        form = self._angle_form(expr, jets)
        quarters = form.pop("pi", Fraction(0)) * 2 if form is not None else Fraction(1, 3)
        halves = next(iter(form.values()))[0] * 2 if form else Fraction(0)
        if form is None or len(form) > 1 or quarters.denominator != 1 or halves.denominator != 1:
            value = self._value(expr, jets)
            sine, cosine = self.numbers.circle(Jet._lift(value).value)
            return self._circle_pair(value, sine, cosine)
        one, zero = self.numbers.constant(Fraction(1)), self._zero
        sine, cosine = zero, one
        for _, c in form.values():
            if halves % 2:
                s, sine_of_whole = self._sqrt((1 - c) / 2), self._sqrt(1 - c * c)
                c = sine_of_whole / (2 * s)
                times = int(halves)
            else:
                s, times = self._sqrt(1 - c * c), int(halves) // 2
            for _ in range(abs(times)):
                turn = s if times > 0 else -s
                sine, cosine = sine * c + cosine * turn, cosine * c - sine * turn
        for _ in range(int(quarters) % 4):
            sine, cosine = cosine, -sine
        return sine, cosine

    @staticmethod
    def _circle_pair(value: Any, sine: Number, cosine: Number) -> tuple[Any, Any]:
        if not isinstance(value, Jet):
            return sine, cosine
        return value.chain(sine, cosine, -sine), value.chain(cosine, -sine, -cosine)

    def _angle_form(self, expr: Expr, jets: bool) -> dict[Any, Any] | None:
        """``{cosine: (factor, cosine value), "pi": factor}`` of a linear combination of angles, else None."""
        op = expr.op
        if op == "symbol":
            meaning = self.section.meaning(expr.name)
            return None if meaning is None else self._angle_form(meaning, jets)
        if op == "pi":
            return {"pi": Fraction(1)}
        if op == "call" and expr.value == "arccos":
            cosine = self._value(expr.args[0], jets)
            value = Jet._lift(cosine).value
            self.numbers.arccos(value)
            if self.numbers.knows_angle(value):
                return {value: (Fraction(1), cosine)}
            return {"pi": Fraction(1), -value: (Fraction(-1), -cosine)}  # so that arccos(c) and arccos(-c) share a base
        if op == "number" and expr.value == 0:
            return {}
        scale = Fraction(1)
        parts = expr.args
        if op == "neg":
            scale = Fraction(-1)
        elif op in {"frac", "mul"}:
            numbers = [
                p for p in expr.args if p.op == "number" or (p.op == "frac" and all(a.op == "number" for a in p.args))
            ]
            parts = tuple(p for p in expr.args if p not in numbers)
            if len(parts) != 1 or (op == "frac" and parts[0] is not expr.args[0]):
                return None
            for p in numbers:
                value = Fraction(p.value) if p.op == "number" else Fraction(p.args[0].value) / Fraction(p.args[1].value)  # type: ignore[arg-type]
                scale = scale / value if op == "frac" else scale * value
        elif op != "add":
            return None
        total: dict[Any, Any] = {}
        for part in parts:
            form = self._angle_form(part, jets)
            if form is None:
                return None
            for key, item in form.items():
                if key == "pi":
                    total[key] = total.get(key, Fraction(0)) + item * scale
                else:
                    total[key] = (total.get(key, (Fraction(0),))[0] + item[0] * scale, item[1])
        return {key: item for key, item in total.items() if key == "pi" or item[0]}


def _nonzero(value: Any) -> Any:
    plain = Jet._lift(value).value
    if isinstance(plain, Algebraic):
        return value
    if plain == 0 or (isinstance(plain, flint.arb) and plain.contains(0)):
        raise UndefinedError("division by zero")
    return value


def entries(value: Any) -> list[Any]:
    """Components of a value, row by row."""
    return list(value.reshape(-1)) if isinstance(value, np.ndarray) else [value]


# -- states -----------------------------------------------------------------------------------------------------------

_QUATERNIONS = [
    (1, 1, 1, 0),
    (1, 1, 0, 1),
    (2, 1, 0, 1),
    (1, 2, 1, 1),
    (2, 1, 1, 1),
    (1, -2, 2, 0),
    (3, 1, 1, 0),
    (2, 3, 1, 1),
]
_TRIPLES = [(4, 3), (-3, 4), (12, 5), (5, -12), (-15, 8), (-7, 24), (21, 20), (-4, 3)]
_QUADRUPLES = [(1, 2, 2), (2, 3, 6), (1, 4, 8), (4, 4, 7), (2, 6, 9), (6, 6, 7), (3, 4, 12)]


@dataclass(frozen=True)
class StateMaker:
    """Draws states at which lengths and sines of the segments at the first point are rational.

    Coordinates are integers and scalars are multiples of 1/4, so that every state is exact in double precision too.
    """

    section: Section
    names: Sequence[Name]
    positive: frozenset[Name] = frozenset()

    def states(self, seed: int = 0, tries: int = 20000) -> Iterator[dict[Name, Any]]:
        """States that satisfy the section's assumptions, without end; ends when none is found any more."""
        draw = random.Random(seed)
        since = 0
        while since < tries:
            state = self._draw(draw, since)
            if self._admissible(state):
                since = 0
                yield state
            since += 1

    def _draw(self, draw: random.Random, attempt: int) -> dict[Name, Any]:
        points = [n for n in self.names if n.bold]
        state: dict[Name, Any] = {}
        a, b, c, d = draw.choice(_QUATERNIONS)
        frame = np.array(
            [
                [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
                [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
                [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
            ],
            dtype=object,
        )
        for index, name in enumerate(points):
            if index == 0:
                base = np.array([draw.randrange(-3, 4) for _ in range(3)], dtype=object)
                state[name] = tuple(Fraction(int(v)) for v in base)
                continue
            if index == 1:
                local = [1, 0, 0]
            elif index == 2:
                local = [*draw.choice(_TRIPLES), 0]
            else:
                local = list(draw.choice(_QUADRUPLES))
                draw.shuffle(local)
                local = [v * draw.choice((-1, 1)) for v in local]
            edge = frame @ np.array(local, dtype=object) * draw.choice((1, 2, 3) if index == 1 else (1, 2))
            state[name] = tuple(Fraction(int(v)) for v in base + edge)
        for name in self.names:
            if name.bold:
                continue
            low = 1 if name in self.positive or not self.section.is_unknown(name) else -20
            width = 20 + attempt // 50  # widened when the assumptions are hard to meet
            state[name] = Fraction(draw.randrange(low, low + width + 20) or 1, 4)
        scalars = [state[n] for n in self.names if not n.bold]
        return state if len(set(scalars)) == len(scalars) else self._draw(draw, attempt)

    def _admissible(self, state: dict[Name, Any]) -> bool:
        try:
            evaluation = Evaluation(self.section, state, Rationals(0))
            return all(_holds(evaluation, assumption) for assumption in self.section.assumptions)
        except UndefinedError:
            return False


def _holds(evaluation: Evaluation, assumption: Assumption) -> bool:
    difference = evaluation.value(assumption.left) - evaluation.value(assumption.right)
    return evaluation.numbers.positive(difference) or (not assumption.strict and difference == 0)
