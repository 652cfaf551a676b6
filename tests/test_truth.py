"""The truth: against closed forms in mpmath, written here again, and at the states where it is hard to come by."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import flint
import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from yarnverify.accuracy.forms import reduce
from yarnverify.accuracy.truth import Points, rounded_ball, truth
from yarnverify.errors import InputError
from yarnverify.symbolic.algebraic import UndefinedError
from yarnverify.symbolic.forward import Evaluation
from yarnverify.symbolic.numbers import Balls, Rationals
from yarnverify.symbolic.reader import read_formula
from yarnverify.symbolic.states import StateMaker

from .test_normal import PARAMETERS, POINTS, TURN, U, section

Array = NDArray[Any]
mp = mpmath.mp


def declared(declarations: Any, name: str) -> Any:
    return next(energy for energy in declarations.energies if energy.name == name)


# -- closed forms -----------------------------------------------------------------------------------------------------


def _edge(q: Any, head: int, tail: int) -> Any:
    return [q[3 * head + k] - q[3 * tail + k] for k in range(3)]


def _norm(a: Any) -> Any:
    return mpmath.sqrt(sum(x * x for x in a))


def _angle(a: Any, b: Any) -> Any:
    cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    return mpmath.atan2(_norm(cross), sum(x * y for x, y in zip(a, b, strict=True)))


CLOSED: dict[str, Callable[..., Any]] = {
    "stretch": lambda q, k_s: k_s * (q[7] - q[6]) * (_norm(_edge(q, 1, 0)) / (q[7] - q[6]) - 1) ** 2 / 2,
    "bending": lambda q, k_b: k_b * _angle(_edge(q, 1, 0), _edge(q, 0, 2)) ** 2 / (q[9] - q[10]),
    "shear": lambda q, k_x, L: k_x * L * (_angle(_edge(q, 1, 0), _edge(q, 2, 0)) - mp.pi / 2) ** 2 / 2,
    "parallel_contact": lambda q, k_c, L, d: k_c * L * (q[1] - q[0] - d) ** 2 / 2,
}
STATES = {
    "stretch": [
        ([0.1, 0.2, 0.3, 1.7, -0.4, 0.25, 0.0, 1.5], [2.0]),
        ([1e6, 0.2, 0.3, 1e6 + 1, 0.2, 0.3, 0.0, 1.0 + 2**-50], [2.0]),
    ],
    "bending": [
        ([0.1, 0.2, 0.3, 1.7, -0.4, 0.25, -1.0, 0.5, 0.75, 1.0, -1.25], [3.0]),
        ([0.1, 0.2, 0.3, 1.1, 0.2, 0.3, -0.9, 0.2, 0.3 + 1e-12, 1.0, -1.25], [3.0]),  # nearly straight
        ([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1e-12, 0.0, 1.0, -1.25], [3.0]),  # nearly folded
    ],
    "shear": [
        ([0.1, 0.2, 0.3, 1.7, -0.4, 0.25, -1.0, 0.5, 0.75], [3.0, 0.5]),
        ([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1e-13, 1.0, 0.25], [3.0, 0.5]),  # nearly square
        ([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 1e-10, 1e-11], [3.0, 0.5]),  # nearly on each other
    ],
    "parallel_contact": [([0.25, 1.0 - 2**-53], [2.0, 0.5, 0.75]), ([0.0, 0.3], [2.0, 0.5, 0.75])],
}
CASES = [(name, at) for name, states in STATES.items() for at in range(len(states))]


@pytest.mark.parametrize(("name", "at"), CASES)
def test_truth_is_the_closed_form_and_its_differences(name: str, at: int, declarations: Any) -> None:
    q, given = STATES[name][at]
    energy = declared(declarations, name)
    names = [str(parameter.name) for parameter in energy.parameters]
    points = Points(np.array(q)[:, None], {key: np.array([value]) for key, value in zip(names, given, strict=True)})
    found = truth(energy, points)
    assert found.has_energy.all() and found.has_derivatives.all()
    with mp.workdps(200):
        exact, step = [mpmath.mpf(value) for value in q], mpmath.mpf(10) ** -60

        def closed(*moves: tuple[int, int]) -> Any:
            moved = list(exact)
            for i, sign in moves:
                moved[i] += sign * step
            return CLOSED[name](moved, **{key: mpmath.mpf(value) for key, value in zip(names, given, strict=True)})

        count = range(len(q))
        # central differences: their own error is the square of the step, 100 digits down
        gradient = [(closed((i, 1)) - closed((i, -1))) / (2 * step) for i in count]
        hessian = [
            [
                (closed((i, 1), (j, 1)) - closed((i, 1), (j, -1)) - closed((i, -1), (j, 1)) + closed((i, -1), (j, -1)))
                / (4 * step**2)
                for j in count
            ]
            for i in count
        ]
        for high, low, want in (
            (found.energy, found.energy_low, closed()),
            *((found.gradient[i], found.gradient_low[i], gradient[i]) for i in count),
            *((found.hessian[i, j], found.hessian_low[i, j], hessian[i][j]) for i in count for j in count),
        ):
            if abs(want) < 1e-60:  # zero, up to the differences' own error
                assert high[0] == 0 == low[0]
                continue
            assert high[0] == float(want)
            rest = want - mpmath.mpf(float(high[0]))
            assert abs(rest - mpmath.mpf(float(low[0]))) <= abs(want) * mpmath.mpf(2) ** -70


# -- where values are hard to come by ---------------------------------------------------------------------------------


def bent(declarations: Any, *rows: float, k_b: float = 1.0) -> Any:
    return truth(declared(declarations, "bending"), Points(np.array(rows, float)[:, None], {"k_b": np.array([k_b])}))


@pytest.mark.parametrize("direction", [(1, 0, 0), (1, 2, 3), (-3, 5, 7)])
def test_a_straight_yarn_has_no_energy_no_gradient_and_a_hessian(direction: Any, declarations: Any) -> None:
    a = np.array(direction, float)
    found = bent(declarations, 0, 0, 0, *a, *-a, 1, -1)
    assert found.energy[0] == 0 and not found.gradient.any() and found.has_derivatives[0]
    length = a @ a
    want = 2 * (np.eye(3) - np.outer(a, a) / length) / length / 2  # 2 P / l^2, over u1 - u2
    assert found.hessian[3:6, 3:6, 0] == pytest.approx(want, rel=1e-15, abs=1e-300)
    assert not np.signbit(found.gradient).any()


def test_tiny_deviations_are_seen_and_what_vanishes_is_told(declarations: Any) -> None:
    found = bent(declarations, 0, 0, 0, 1, 1e-200, 0, -1, 0, 0, 1, -1)
    assert found.energy[0] == 0 and found.flushed[0, 0]  # 1e-400
    assert found.gradient[4, 0] == 1e-200
    found = bent(declarations, 0, 0, 0, 1, 5e-324, 0, -1, 0, 0, 1, -1)
    assert found.gradient[4, 0] == 5e-324 and found.gradient[1, 0] == -1e-323


@pytest.mark.parametrize(
    ("rows", "energy"),
    [
        ((0, 0, 0, 1, 2, 3, 2, 4, 6, 1, -1), np.pi**2 / 2),  # folded
        ((0, 0, 0, 0, 0, 0, 2, 4, 6, 1, -1), None),  # a segment of length zero
        ((0, 0, 0, 1, 2, 3, 2, 4, 7, 1, 1), None),  # no yarn to spread on
        ((0, 0, 0, 1, 2, 3, 2, 4, 7, -1, 1), None),
    ],
)
def test_states_without_a_value_are_told(rows: Any, energy: float | None, declarations: Any) -> None:
    found = bent(declarations, *rows)
    assert not found.has_derivatives[0] and np.isnan(found.gradient).all() and np.isnan(found.hessian).all()
    assert found.has_energy[0] == (energy is not None)
    assert np.isnan(found.energy[0]) if energy is None else found.energy[0] == pytest.approx(energy)


def test_an_energy_that_does_not_act_is_zero(declarations: Any) -> None:
    energy = declared(declarations, "parallel_contact")
    q = np.array([[0.0, 0.0, 0.0], [1.0, np.nextafter(1, 0), np.nextafter(1, 2)]])
    found = truth(energy, Points(q, {key: np.ones(3) for key in ("k_c", "L", "d")}))
    assert found.has_derivatives.all()
    assert found.energy.tolist() == [0.0, 2.0**-107, 0.0]
    assert found.hessian[0, 0].tolist() == [0.0, 1.0, 0.0]


def test_results_out_of_range_are_infinite(declarations: Any) -> None:
    found = bent(declarations, 0, 0, 0, 1e-200, 0, 0, 0, 1e-200, 0, 1, -1)
    assert found.has_derivatives[0] and np.isfinite(found.energy[0]) and np.isinf(found.hessian[3, 4, 0])


def test_values_that_are_no_numbers_are_refused(declarations: Any) -> None:
    with pytest.raises(InputError, match=r"state 0: x_1\.y is nan"):
        bent(declarations, 0, 0, 0, 1, np.nan, 0, 0, 1, 0, 1, -1)
    with pytest.raises(InputError, match="12 values, not 11"):
        bent(declarations, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1)


# -- its parts --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cosine", [-0.999, -0.5, 0.0, 0.3, 0.97, 1 - 1e-9])
def test_the_squared_angle_has_its_closed_derivatives(cosine: float) -> None:
    with flint.ctx.workprec(400), mp.workdps(120):
        value, slope, bend = Balls.squared_arccos(flint.arb(cosine))
        c = mpmath.mpf(cosine)
        theta, sine = mpmath.acos(c), mpmath.sqrt(1 - c * c)
        for ball, want in (
            (value, theta**2),
            (slope, -2 * theta / sine),
            (bend, 2 * (sine - theta * c) / sine**3),
        ):
            assert abs(ball - flint.arb(mpmath.nstr(want, 60))) < 1e-30


def test_the_squared_angle_is_smooth_where_the_angle_is_zero() -> None:
    assert [float(part) for part in Balls.squared_arccos(flint.arb(1))] == [0.0, -2.0, 2 / 3]
    value, slope, bend = Balls.squared_arccos(flint.arb(1, 1e-30))
    assert value.contains(0) and float(value.rad()) < 1e-28
    assert slope.contains(-2) and bend.contains(flint.arb(2) / 3)
    with pytest.raises(UndefinedError):
        Balls.squared_arccos(flint.arb(-1, 1e-30))


def test_even_powers_of_an_angle_agree_in_both_readings() -> None:
    """The exact reading differentiates the angle, the balls its square: their derivatives must be the same functions."""
    energy = read_formula(rf"a ({TURN})^4 + (-{TURN})^2")
    made = section()
    block = read_formula(r"\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_1}")
    state = next(StateMaker(made, (*POINTS, *U, *PARAMETERS)).states())
    exact, balls = Rationals(0), Balls()
    with flint.ctx.workprec(300):
        smooth = Evaluation(made, state, balls, energy).block(block).reshape(-1)
        plain = Evaluation(
            made, state, balls, read_formula(rf"a ({TURN}) ({TURN}) ({TURN}) ({TURN}) + ({TURN}) ({TURN})")
        )
        for a, b in zip(smooth, plain.block(block).reshape(-1), strict=True):
            assert a.overlaps(b) and abs(a - b) < 1e-60
    both = [read_formula(rf"({TURN})^2"), read_formula(rf"({TURN}) ({TURN})")]
    first, second = (Evaluation(made, state, exact, tree).block(block).reshape(-1).tolist() for tree in both)
    assert first == second


@pytest.mark.parametrize(
    ("ball", "want"),
    [
        (lambda: flint.arb(3) / 2, (1.5, 0.0, False)),
        (lambda: flint.arb(0), (0.0, 0.0, False)),
        (lambda: flint.arb(0, 1) * flint.arb(2) ** -1100, (0.0, 0.0, False)),  # whatever it is, it rounds to zero
        (lambda: flint.arb(0, 1) * flint.arb(2) ** -1000, None),
        (lambda: flint.arb(2) ** -1080, (0.0, 0.0, True)),
        (lambda: flint.arb(2) ** 1025, (np.inf, 0.0, False)),
        (lambda: 1 + flint.arb(2) ** -60, (1.0, 2.0**-60, False)),
        (lambda: flint.arb(1, 1e-10), None),
        (lambda: 1 + flint.arb(2) ** -53 + flint.arb(0, 1e-40), None),  # a tie within the ball
        (lambda: flint.arb("nan"), None),
        (lambda: flint.arb("inf"), None),
    ],
)
def test_a_ball_becomes_one_double_or_none(ball: Callable[[], Any], want: Any) -> None:
    with flint.ctx.workprec(200):
        assert rounded_ball(ball()) == want


def test_forms_are_the_differences_that_occur(declarations: Any) -> None:
    made = reduce(declared(declarations, "bending"))
    assert [[(str(name), sign) for name, sign in form.signs] for form in made.forms] == [
        [("k_b", 1)],
        [("x_0", -1), ("x_1", 1)],
        [("x_0", 1), ("x_2", -1)],
        [("u_1", 1), ("u_2", -1)],
    ]
    assert made.hessian.index.shape == (12, 12) and len(made.hessian.terms) < 70
    assert (made.hessian.index == made.hessian.index.T).all()
