"""The second reading: exact numbers with adjoined roots, jets, and the states that it is evaluated at."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import islice
from typing import Any

import flint
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from yarnverify.symbolic.algebraic import Algebraic, UndefinedError, approximate
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.forward import Evaluation, entries
from yarnverify.symbolic.jets import Jet
from yarnverify.symbolic.numbers import Balls, Floats, Rationals
from yarnverify.symbolic.reader import read_formula
from yarnverify.symbolic.states import StateMaker
from yarnverify.symbolic.tree import Expr, Name

from .test_normal import PARAMETERS, POINTS, TURN, T, U, section

NAMES = (*POINTS, *U, *PARAMETERS)

# -- numbers ----------------------------------------------------------------------------------------------------------

NUMBERS = Rationals(0)
ROOTS = [NUMBERS.sqrt(flint.fmpq(2)), NUMBERS.sqrt(flint.fmpq(3, 5))]
ROOTS.append(NUMBERS.sqrt(1 + ROOTS[0]))  # a root over a root
rationals = st.fractions(-4, 4, max_denominator=6).map(lambda q: flint.fmpq(q.numerator, q.denominator))
leaves = rationals | st.sampled_from(ROOTS)
algebraics = st.recursive(
    leaves,
    lambda inner: (
        st.tuples(inner, inner).map(lambda p: p[0] + p[1]) | st.tuples(inner, inner).map(lambda p: p[0] * p[1])
    ),
    max_leaves=4,
)
invertible = algebraics.filter(lambda p: p != 0)


@settings(max_examples=80)
@given(algebraics, algebraics, algebraics, invertible)
def test_numbers_with_roots_are_a_field(p: Any, q: Any, r: Any, d: Any) -> None:
    assert p + q == q + p
    assert p * q == q * p
    assert p * (q + r) == p * q + p * r
    assert (p * q) * r == p * (q * r)
    assert p - q == -(q - p)
    assert p / d * d == p
    assert 1 / (1 / d) == d
    assert 2 - p == -(p - 2)
    assert hash(p + q) == hash(q + p)


@settings(max_examples=60)
@given(algebraics, invertible)
def test_numbers_with_roots_agree_with_balls(p: Any, q: Any) -> None:
    assert approximate(p * q + p / q).overlaps(approximate(p) * approximate(q) + approximate(p) / approximate(q))
    assert NUMBERS.positive(q * q)
    assert NUMBERS.positive(q) != NUMBERS.positive(-q)


def test_roots_stay_independent() -> None:
    numbers = Rationals(0)
    two, three, six = (numbers.sqrt(flint.fmpq(n)) for n in (2, 3, 6))
    assert two * three == six
    assert numbers.sqrt(flint.fmpq(8)) == 2 * two
    assert numbers.sqrt(flint.fmpq(9, 4)) == flint.fmpq(3, 2)
    assert two * two == 2
    assert two - two == 0
    assert two != 2 and two != "two"


def test_a_root_that_the_others_have_is_written_with_them() -> None:
    numbers = Rationals(0)
    two = numbers.sqrt(flint.fmpq(2))
    three = numbers.sqrt(flint.fmpq(3))
    assert numbers.sqrt(3 + 2 * two) == 1 + two
    assert numbers.sqrt(3 - 2 * two) == two - 1
    assert numbers.sqrt(5 + 2 * two * three) == two + three
    deep = numbers.sqrt(2 + two)  # sqrt(2 + sqrt 2) sqrt(2 - sqrt 2) = sqrt 2
    assert numbers.sqrt(2 - two) * deep == two
    total = 1 + two + three + deep
    assert numbers.sqrt(total * total) == total


def test_numbers_without_a_value() -> None:
    numbers = Rationals(0)
    with pytest.raises(UndefinedError, match="negative"):
        numbers.sqrt(flint.fmpq(-2))
    with pytest.raises(UndefinedError, match="negative"):
        numbers.sqrt(1 - numbers.sqrt(flint.fmpq(2)))
    with pytest.raises(ZeroDivisionError):
        Algebraic([], {}).inverse()
    assert Algebraic([], {0: flint.fmpq(2)}).inverse() == flint.fmpq(1, 2)


def test_dependent_roots_are_noticed() -> None:
    roots = [flint.fmpq(2), flint.fmpq(2)]  # as if sqrt(2) had been adjoined twice
    first, second = (Algebraic(roots, {1 << k: flint.fmpq(1)}) for k in (0, 1))
    with pytest.raises(UndefinedError, match="dependent"):
        (first - second).inverse()


def test_a_number_with_roots_scales_an_array() -> None:
    two, array = ROOTS[0], np.array([[flint.fmpq(1)], [flint.fmpq(2)]], dtype=object)
    for product in (two * array, array * two):
        assert [*product.reshape(-1)] == [two, 2 * two]
    assert [*(array / two).reshape(-1)] == [1 / two, 2 / two]


def test_angles_are_drawn_once() -> None:
    numbers = Rationals(3)
    c = flint.fmpq(1, 3)
    assert numbers.arccos(c) == numbers.arccos(c)
    assert numbers.arccos(-c) == numbers.pi - numbers.arccos(c)
    assert [numbers.arccos(flint.fmpq(n)) for n in (1, 0, -1)] == [0, numbers.pi / 2, numbers.pi]
    sine, cosine = numbers.circle(flint.fmpq(5, 7))
    assert sine**2 + cosine**2 == 1
    assert numbers.circle(flint.fmpq(5, 7)) == (sine, cosine)
    assert Rationals(3).arccos(c) == numbers.arccos(c) != Rationals(4).arccos(c)


# -- jets -------------------------------------------------------------------------------------------------------------


def jets() -> tuple[Jet, Jet]:
    eye = np.eye(2)
    return Jet(0.7, eye[0]), Jet(1.3, eye[1])


@pytest.mark.parametrize(
    ("function", "first", "second"),
    [
        (lambda x, y: x * y, (1.3, 0.7), ((0, 1), (1, 0))),
        (lambda x, y: x / y, (1 / 1.3, -0.7 / 1.69), ((0, -1 / 1.69), (-1 / 1.69, 1.4 / 1.3**3))),
        (lambda x, y: x**3 - 2, (3 * 0.49, 0), ((4.2, 0), (0, 0))),
        (lambda x, y: 2 - y, (0, -1), ((0, 0), (0, 0))),
        (lambda x, y: 1 / x, (-1 / 0.49, 0), ((2 / 0.343, 0), (0, 0))),
        (lambda x, y: y**-2, (0, -2 / 1.3**3), ((0, 0), (0, 6 / 1.3**4))),
        (lambda x, y: -x + 3 + y * 2, (-1, 2), ((0, 0), (0, 0))),
        (lambda x, y: Jet(2.0) * x + Jet(1.0), (2, 0), ((0, 0), (0, 0))),
    ],
)
def test_a_jet_carries_two_derivatives(function: Any, first: Any, second: Any) -> None:
    jet = function(*jets())
    assert jet.first == pytest.approx(np.array(first))
    assert jet.second == pytest.approx(np.array(second))


def test_a_constant_jet_has_no_derivatives() -> None:
    one = Jet(1.0)
    for jet in (one + 1, -one, one * one, one**0, one.chain(1.0, 0.0, 0.0), 1 / one):
        assert jet.first is None and jet.second is None


def test_a_jet_divided_by_an_integer_stays_exact() -> None:
    half = Jet(flint.fmpq(1), np.array([flint.fmpq(1)], dtype=object)) / 2
    assert isinstance(half.value, flint.fmpq) and half.value == flint.fmpq(1, 2)
    root = Jet(ROOTS[0], np.array([flint.fmpq(1)], dtype=object)) / 2
    assert root.value * 2 == ROOTS[0]


def test_a_jet_of_zero_has_no_inverse() -> None:
    with pytest.raises(UndefinedError):
        Jet(0.0).inverse()


# -- evaluation -------------------------------------------------------------------------------------------------------

STATE: dict[Name, Any] = {
    POINTS[0]: (Fraction(0), Fraction(0), Fraction(0)),
    POINTS[1]: (Fraction(2), Fraction(0), Fraction(0)),
    POINTS[2]: (Fraction(3), Fraction(4), Fraction(0)),
    U[0]: Fraction(5, 4),
    U[1]: Fraction(-1, 2),
    **dict(zip(PARAMETERS, (Fraction(3), Fraction(1, 4), Fraction(2)), strict=True)),
}
MADE = section()


def balls(formula: str, energy: str = "0") -> list[float]:
    evaluation = Evaluation(MADE, STATE, Balls(), read_formula(energy))
    return [float(part) for part in entries(evaluation.value(read_formula(formula)))]


@pytest.mark.parametrize(
    ("formula", "values"),
    [
        (r"\mathbf{x}_1 \times \mathbf{x}_2", [0, 0, 8]),
        (r"\mathbf{x}_1 \cdot \mathbf{x}_2", [6]),
        (r"(2 \cdot a) \cdot \mathbf{x}_1", [12, 0, 0]),
        (r"\mathbf{x}_1^T \mathbf{I} \mathbf{x}_2", [6]),
        (r"\mathbf{x}_1 \mathbf{x}_2^T", [6, 8, 0, 0, 0, 0, 0, 0, 0]),
        (r"(\mathbf{x}_1 \mathbf{x}_2^T)^T", [6, 0, 0, 8, 0, 0, 0, 0, 0]),
        (r"a^T", [3]),
        (r"a^{-2} + a^{0} + a^1", [1 / 9 + 1 + 3]),
        (r"\|{-a}\| + |b| + |u_2|", [3.75]),
        (r"\sqrt{a} \tan b", [3**0.5 * np.tan(0.25)]),
        (r"\sin(\arccos(b)) + \cos(\pi)", [(1 - 1 / 16) ** 0.5 - 1]),
        (r"\|\mathbf{x}_2 - \mathbf{x}_1\|", [17**0.5]),
    ],
)
def test_trees_have_their_values(formula: str, values: list[float]) -> None:
    assert balls(formula) == pytest.approx(values)
    floats = Evaluation(MADE, STATE, Floats()).value(read_formula(formula))
    assert [float(part) for part in entries(floats)] == pytest.approx(values)


@pytest.mark.parametrize(
    ("formula", "values"),
    [
        (r"\mathbf{F}_{\mathbf{x}_1}", [-12, 0, 0]),
        (r"F_{u_1}", [-2.5]),
        ("V", [12 + 1.25**2]),
        (r"\frac{\partial F_{u_1}}{\partial u_1}", [-2]),
        (r"\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_1}", [-6, 0, 0, 0, -6, 0, 0, 0, -6]),
        (r"\frac{\partial F_{u_1}}{\partial \mathbf{x}_1}", [0, 0, 0]),
        (r"\frac{\partial u_1}{\partial u_1} + \frac{\partial a}{\partial u_1}", [1]),
        (r"F_{u_2}", [0]),
    ],
)
def test_blocks_are_derivatives_of_the_energy(formula: str, values: list[float]) -> None:
    assert balls(
        formula, r"a (\mathbf{x}_1 - \mathbf{x}_0) \cdot (\mathbf{x}_1 - \mathbf{x}_0) + u_1^2"
    ) == pytest.approx(values)


def test_the_blocks_of_a_constant_energy_are_zero() -> None:
    assert balls(r"F_{u_1}", "a") == balls(r"\frac{\partial F_{u_1}}{\partial u_1}", "a") == [0]


def _angles() -> Iterator[tuple[str, str]]:
    for t in (T, TURN):
        yield rf"\sin^2({t}) + \cos^2({t})", "1"
        yield rf"2 \sin(\frac{{1}}{{2}} {t}) \cos(\frac{{1}}{{2}} {t})", rf"\sin({t})"
        yield rf"\cos(\frac{{\pi}}{{2}} - {t})", rf"\sin({t})"
        yield rf"\sin({t} + \pi)", rf"-\sin({t})"
        yield rf"\cos(\frac{{3 {t}}}{{2}} - 0)", rf"4 \cos^3(\frac{{{t}}}{{2}}) - 3 \cos(\frac{{{t}}}{{2}})"
        yield rf"\sin(\frac{{{t}}}{{3}})^2 + \cos(\frac{{{t}}}{{3}})^2", "1"
        yield rf"\cos({t} a)^2 - 1", rf"-\sin(a {t})^2"
    yield r"\cos(\frac{1}{2} \pi)", "0"
    yield r"\sin(0)", "0"
    yield r"\tan(a) \cos(a)", r"\sin(a)"


@pytest.mark.parametrize(("left", "right"), [*_angles()])
def test_exact_angles_obey_their_laws(left: str, right: str) -> None:
    places = zip(POINTS, ((0, 1, 0), (2, 4, 0), (1, 2, 4)), strict=True)
    near = {**STATE, **{name: tuple(Fraction(part, 8) for part in place) for name, place in places}}
    evaluation = Evaluation(MADE, near, Rationals(0))
    assert evaluation.value(read_formula(left)) == evaluation.value(read_formula(right))


@pytest.mark.parametrize(
    "formula",
    [
        r"\frac{1}{a - a}",
        r"\frac{1}{\|\mathbf{x}_1 - \mathbf{x}_1\|}",
        r"(u_1 - u_1)^{-1}",
        r"\tan(\frac{\pi}{2})",
        r"\sqrt{-a}",
    ],
)
@pytest.mark.parametrize("numbers", [Rationals(0), Balls(), Floats()])
def test_a_formula_without_a_value_is_told(formula: str, numbers: Any) -> None:
    evaluation = Evaluation(MADE, STATE, numbers)
    if formula == r"\tan(\frac{\pi}{2})" and not numbers.exact and isinstance(numbers, Floats):
        return  # cos(pi/2) is 6e-17 in floats
    with pytest.raises(UndefinedError):
        evaluation.value(read_formula(formula))


def test_an_irrational_number_divides_what_it_does_not_vanish_in() -> None:
    value = Evaluation(MADE, STATE, Rationals(0)).value(read_formula(r"\frac{\sqrt{2}}{\sqrt{8}}"))
    assert value == flint.fmpq(1, 2)


# -- states -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("domain", "holds"),
    [
        ("u_1 > u_2", lambda s: s[U[0]] > s[U[1]]),
        (r"0 < u_1 - u_2 < a", lambda s: 0 < s[U[0]] - s[U[1]] < s[PARAMETERS[0]]),
        (r"u_1 \ge 8, u_2 \le -b", lambda s: s[U[0]] >= 8 and s[U[1]] <= -s[PARAMETERS[1]]),
        (r"\|\mathbf{x}_1 - \mathbf{x}_0\| > u_1 > \frac{1}{u_2}", lambda s: s[U[0]] > 1 / s[U[1]]),
    ],
)
def test_states_satisfy_the_assumptions_and_are_doubles(domain: str, holds: Any) -> None:
    made: Section = section(domain)
    states = list(islice(StateMaker(made, NAMES, frozenset(PARAMETERS)).states(seed=5), 20))
    assert len(states) == 20
    for state in states:
        assert holds(state)
        assert all(state[name] > 0 for name in PARAMETERS)
        for value in state.values():
            for part in value if isinstance(value, tuple) else (value,):
                assert Fraction(float(part)) == part
        for name in POINTS[1:]:  # lengths are rational there
            square = sum((p - q) ** 2 for p, q in zip(state[name], state[POINTS[0]], strict=True))
            assert square.denominator == 1 and int(square) == round(float(square) ** 0.5) ** 2
    assert states == list(islice(StateMaker(made, NAMES, frozenset(PARAMETERS)).states(seed=5), 20))
    assert states != list(islice(StateMaker(made, NAMES, frozenset(PARAMETERS)).states(seed=6), 20))


def test_an_assumption_that_nothing_meets_gives_no_state() -> None:
    made = section("u_1 > u_1")
    assert list(StateMaker(made, NAMES).states(tries=50)) == []


def test_four_points_are_drawn_too() -> None:
    names = (*POINTS, Name("x", "3", bold=True), Name("x", "4", bold=True))
    state = next(StateMaker(section(), names).states())
    assert len({state[name] for name in names}) == 5
    square = sum((p - q) ** 2 for p, q in zip(state[names[4]], state[POINTS[0]], strict=True))
    assert int(square) == round(float(square) ** 0.5) ** 2
    assert Expr("symbol", value=names[3]).name in state
