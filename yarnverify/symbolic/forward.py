"""Reading 2: forward second-order differentiation of the definitions, over exact rationals, balls or floats.

Independent of the first reading: no SymPy, no normal forms, no formula for any derivative. A ``Jet`` carries a value with
its gradient and Hessian by all unknowns at one state; the energy's own definition is evaluated in jets. Over rationals the
state is chosen so that lengths and sines come out rational (square roots that do not are adjoined exactly); an angle is
replaced by a rational number drawn for its cosine, and pi by another, since an identity of functions holds whatever their
values (an arc cosine of what varies is no algebraic function; where several hang together, only one is drawn). Two sides that
differ there differ as functions up to bad luck, which the balls, with true angles and pi, then exclude.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any

import flint
import numpy as np

from yarnverify.symbolic.algebraic import Algebraic, Number, UndefinedError
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.exponentials import NAMES
from yarnverify.symbolic.functions import is_turn, unfolded
from yarnverify.symbolic.jets import Jet
from yarnverify.symbolic.linear import linear_form, tree_of
from yarnverify.symbolic.numbers import Balls, Floats
from yarnverify.symbolic.tree import FORCE, PI, ZERO, Expr, Name, Type
from yarnverify.symbolic.turns import DRAWN_PARTS, Pair, multiple, of_pi, scaled, turned

State = Mapping[Name, Any]  # a Fraction for a scalar, three for a point


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
    def energy_jet(self) -> Jet:
        """The energy with its gradient and Hessian by all unknowns, in the order of the state."""
        return Jet._lift(self._value(self.energy, jets=True))

    def columns(self, unknown: Name) -> list[int]:
        return [i for i, (name, _) in enumerate(self._unknowns) if name == unknown]

    def block(self, expr: Expr) -> Any:
        """True value of a force, an energy or a derivative."""
        if expr.op == "energy":
            return self.energy_jet.value
        if expr.op == "force":
            columns = self.columns(expr.name)
            first = self.energy_jet.first
            found = np.array([self._zero if first is None else first[i] * FORCE for i in columns], dtype=object)
            return found.reshape(3, 1) if expr.name.bold else found[0]
        inner, wrt = expr.args[0], self.columns(expr.name)
        if inner.op == "force":
            rows, second = self.columns(inner.name), self.energy_jet.second
            block = [[self._zero if second is None else second[i, j] * FORCE for j in wrt] for i in rows]
        else:
            jets = self.energy_jet if inner.op == "energy" else self._value(inner, jets=True)
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
        parts = [self.numbers.constant(part) for part in (given if name.bold else (given,))]
        columns = self.columns(name)
        if jets and columns:
            count = len(self._unknowns)
            dtype = float if isinstance(self.numbers, Floats) else object
            zero, one = self._zero, self.numbers.constant(Fraction(1))
            firsts = [np.array([one if i == column else zero for i in range(count)], dtype=dtype) for column in columns]
            parts = [Jet(part, first) for part, first in zip(parts, firsts, strict=True)]
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
        if op == "call" and expr.value in NAMES:
            return self._exponential(str(expr.value), self._value(expr.args[0], jets))
        if is_turn(expr) and not self.numbers.exact:
            y, x = (self._value(arg, jets) for arg in expr.args)
            return self._atan2(y, x)
        if op == "call" and (plain := unfolded(expr)) is not None:
            return self._value(plain, jets)
        if op == "call" and expr.value == "cos" and jets and not self.numbers.exact:
            known = self._cosine_of(expr.args[0])  # which has derivatives where the angle has none
            if known is not None:
                return self._value(known, jets)
        if op == "call" and expr.value != "arccos":
            sine, cosine = self._circle(expr.args[0], jets)
            return {"sin": lambda: sine, "cos": lambda: cosine, "tan": lambda: sine / _nonzero(cosine)}[
                str(expr.value)
            ]()
        if op == "pow" and jets and isinstance(self.numbers, Balls) and expr.value in _EVEN:
            square = self._square(expr.args[0])
            return square if expr.value == 2 else self._power(square, int(str(expr.value)) // 2)
        if op == "mul" and jets and isinstance(self.numbers, Balls):
            twice = next((arg for arg in expr.args if expr.args.count(arg) == 2 and arg.op == "call"), None)
            if twice is not None:
                rest = [self._value(arg, jets) for arg in expr.args if arg != twice]
                return math.prod(rest, start=self._square(twice))
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
            return self._absolute(first)
        if op == "norm":
            squares = [part * part for part in first.reshape(-1)]
            return self._sqrt(squares[0] + squares[1] + squares[2])
        if op == "sqrt":
            return self._sqrt(first)
        if op == "call":
            return self._arccos(first)
        raise AssertionError(f"no such operation: {op}")

    def _absolute(self, value: Any) -> Any:
        inner = Jet._lift(value).value
        if self.numbers.positive(inner):
            return value
        if self.numbers.positive(-inner):
            return -value
        if isinstance(value, Jet) and value.first is not None:
            raise UndefinedError("derivative of an absolute value where it is zero")
        return abs(inner) if isinstance(self.numbers, Balls) else inner

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

    def _atan2(self, y: Any, x: Any) -> Any:
        """The angle of a point: the arc tangent of y/x or of -x/y, and a constant."""
        a, b = Jet._lift(y).value, Jet._lift(x).value
        if not any(map(self.numbers.positive, (b, a, -a))):
            raise UndefinedError("angle of a point where it jumps or has none")
        angle = self.numbers.atan2(a, b)
        if not isinstance(y, Jet) and not isinstance(x, Jet):
            return angle
        ratio = Jet._lift(y / x if abs(b) > abs(a) else -x / y)
        slope = 1 / (1 + ratio.value * ratio.value)
        return ratio.chain(angle, slope, -2 * ratio.value * slope * slope)

    def _exponential(self, function: str, value: Any) -> Any:
        """A logarithm or an exponential."""
        inner = Jet._lift(value).value
        result = self.numbers.log(inner) if function == "log" else self.numbers.exp(inner)
        if not isinstance(value, Jet):
            return result
        slope = 1 / inner if function == "log" else result
        return value.chain(result, slope, -slope * slope if function == "log" else result)

    def _square(self, expr: Expr) -> Any:
        """The square of a scalar. Those of an angle, its sine and the tangent of its half are smooth where the angle is 0."""
        if expr.op == "neg" or (expr.op == "symbol" and self.section.meaning(expr.name) is not None):
            inside = expr.args[0] if expr.op == "neg" else self.section.meaning(expr.name)
            assert inside is not None
            return self._square(inside)
        if expr.op == "mul" and all(self.section.type_of(arg) is Type.SCALAR for arg in expr.args):
            squares = [self._square(arg) for arg in expr.args]
            return math.prod(squares[1:], start=squares[0])
        if expr.op == "frac":
            return self._square(expr.args[0]) / _nonzero(self._square(expr.args[1]))
        if expr.op == "call" and not is_turn(expr) and (plain := unfolded(expr)) is not None:
            return self._square(plain)
        if expr.op == "call" and expr.value in ("arccos", "sin", "tan"):
            angle, part = (expr, Fraction(1)) if expr.value == "arccos" else self._angle_of(expr.args[0])
            if angle is not None:
                jet = Jet._lift(self._value(angle.args[0], True))
                if expr.value == "arccos":
                    return jet.chain(*self.numbers.squared_arccos(jet.value))
                if expr.value == "sin" and part == 1:
                    return 1 - jet * jet
                if expr.value == "sin" and part == Fraction(1, 2):
                    return (1 - jet) / 2
                if expr.value == "tan" and part == Fraction(1, 2):
                    return (1 - jet) / _nonzero(1 + jet)
        value = self._value(expr.args[0] if expr.op in ("norm", "sqrt") else expr, True)
        if expr.op == "norm" and isinstance(value, np.ndarray):
            return (value.T @ value)[0, 0]
        return value if expr.op == "sqrt" else value * value

    def _cosine_of(self, angle: Expr) -> Expr | None:
        """The cosine of an angle that is an arc cosine."""
        inner, part = self._angle_of(angle)
        return inner.args[0] if inner is not None and part == 1 else None

    def _angle_of(self, expr: Expr) -> tuple[Expr | None, Fraction]:
        """The arc cosine of which a tree is a multiple, and the multiple."""
        parts = list(linear_form(expr, self.section.meaning).items())
        angle = tree_of(parts[0][0]) if len(parts) == 1 else None
        return (
            (angle, parts[0][1])
            if angle is not None and angle.op == "call" and angle.value == "arccos"
            else (None, Fraction(0))
        )

    @staticmethod
    def _power(value: Any, power: int) -> Any:
        result = value
        for _ in range(power - 1):
            result = result * value
        return result

    def _circle(self, expr: Expr, jets: bool) -> Pair:
        """Sine and cosine; over rationals by the parts of the angle, so that what hangs together is seen to."""
        if not self.numbers.exact:
            value = self._value(expr, jets)
            sine, cosine = self.numbers.circle(Jet._lift(value).value)
            return self._circle_pair(value, sine, cosine)
        one = self.numbers.constant(Fraction(1))
        total: Pair = self._zero, one
        for monomial, factor in linear_form(expr, self.section.meaning).items():
            total = turned(total, self._turn(tree_of(monomial), factor, one, jets))
        return total

    def _turn(self, angle: Expr, factor: Fraction, one: Number, jets: bool) -> Pair:
        """The point of the unit circle of a multiple of an angle that is no sum."""
        pair = None
        if angle == PI:
            pair = of_pi(factor, one, self.numbers.sqrt)
        elif angle.op == "call" and angle.value == "arccos":
            cosine = self._value(angle.args[0], jets)
            self.numbers.arccos(Jet._lift(cosine).value)
            pair = scaled((self._sqrt(1 - cosine * cosine), cosine), factor, one, self._sqrt)
        if pair is not None:
            return pair
        below = factor.denominator // math.gcd(factor.denominator, DRAWN_PARTS)
        drawn = self._value(angle, jets) / (DRAWN_PARTS * below)
        sine, cosine = self.numbers.circle(Jet._lift(drawn).value)
        return multiple(self._circle_pair(drawn, sine, cosine), int(factor * DRAWN_PARTS * below), one)

    @staticmethod
    def _circle_pair(value: Any, sine: Number, cosine: Number) -> Pair:
        if not isinstance(value, Jet):
            return sine, cosine
        return value.chain(sine, cosine, -sine), value.chain(cosine, -sine, -cosine)


_EVEN = range(2, 64, 2)


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
