"""Safe forms: proofs of what they rest on, energies that no document has, and damage that must be refused."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import product
from typing import Any

import flint
import numpy as np
import pytest

from yarnverify.accuracy.conditioning import condition
from yarnverify.accuracy.metrics import measure
from yarnverify.accuracy.truth import Points, truth
from yarnverify.kernels import ElementError, geometry
from yarnverify.kernels.series import TURNING
from yarnverify.symbolic import angles, safe, safe_laws
from yarnverify.symbolic.declare import (
    Declarations,
    Energy,
    Point,
    Positive,
    Real,
    Sliding,
    angle,
    deviation,
    energy,
    length,
)
from yarnverify.symbolic.derive import derive_declared
from yarnverify.symbolic.modules import module_text
from yarnverify.symbolic.programs import Proved, derived_programs, proved
from yarnverify.symbolic.tree import Expr

U = 2.0**-53


# -- scalar functions -------------------------------------------------------------------------------------------------


def test_stated_derivatives_are_proved() -> None:
    assert angles.prove_derivatives() == [function.__name__ for function in angles.FUNCTIONS]


def test_a_wrong_derivative_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(angles.theta_squared, "slope", staticmethod(lambda c: 2 * angles.theta_over_sine(c)))
    with pytest.raises(angles.NotRunError, match="theta_squared: its stated derivative"):
        angles.prove_derivatives()


def test_the_series_is_proved_and_a_wrong_definition_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    angles.prove_recurrence()
    monkeypatch.setattr(angles.theta_over_sine, "definition", staticmethod(lambda t: t))
    with pytest.raises(angles.NotRunError, match="is not proved: step 1"):
        angles.prove_recurrence()


@pytest.mark.parametrize("degree", [5, 8, 13])
def test_the_bound_of_the_polynomial_holds(degree: int) -> None:
    """Against the closed form in balls, and within a factor of 4 of what is seen: a bound, not a wish."""
    series = angles.turning_series(Fraction(97, 500), degree)
    worst = 0.0
    with flint.ctx.workprec(200):
        for i in range(1, 400):
            square = flint.arb(flint.fmpq(97 * i, 500 * 400))
            t = 2 * square.sqrt().asin()
            true = (t.sin() - t * t.cos()) / t.sin() ** 3
            value = sum((flint.arb(c) * square**k for k, c in enumerate(series.coefficients)), flint.arb(0))
            worst = max(worst, abs(float(value / true - 1)))
    assert worst <= float(series.bound) <= 4 * worst


def test_the_kernels_use_the_polynomial_that_is_proved() -> None:
    series = angles.turning_series(Fraction(97, 500), 13)
    assert series.coefficients == TURNING and series.bound < 1.5 * U
    assert np.sin(np.arccos(-0.25) / 4) ** 2 < series.top


@pytest.mark.parametrize("t", [1e-300, 1e-9, 0.3, 1.0471, 1.0473, 1.5707, 1.5709, 2.5, 3.1, 3.1415])
def test_angles_and_their_functions(t: float) -> None:
    with flint.ctx.workprec(300):
        ball = flint.arb(t)
        sine, cosine = float(ball.sin()), float(ball.cos())
        f, g = float(ball / ball.sin()), float((ball.sin() - ball * ball.cos()) / ball.sin() ** 3)
        right = float(ball - flint.arb.pi() / 2)
    assert geometry.angle(sine, cosine) == pytest.approx(t, rel=6 * U)
    assert geometry.deviation(sine, cosine) == pytest.approx(right, rel=1e-15)
    if cosine > -0.9 and t > 1e-100:
        squared, over, excess = geometry.turning(sine * sine, cosine)
        assert squared == pytest.approx(t * t, rel=16 * U)
        assert over == pytest.approx(f, rel=16 * U) and excess == pytest.approx(g, rel=40 * U)
    assert geometry.versine(sine * sine, cosine) == pytest.approx(2 * np.sin(t / 2) ** 2, rel=16 * U)
    assert geometry.half_tangent(sine, cosine) == pytest.approx(np.tan(t / 2), rel=16 * U)


# -- energies of nobody's document ------------------------------------------------------------------------------------


@energy(rest={"x1": (1, 0, 0), "x2": (-1, 0, 0)}, domain=r"u_1 > u_2")
def resting(
    x0: Point, x1: Point, x2: Point, u1: Sliding, u2: Sliding, *, k: Positive["N m^2"], theta_0: Real["rad"]
) -> Expr:
    """Bending about a rest angle; its gradient has no direction where the yarn is straight."""
    return k * (angle(x1 - x0, x0 - x2) - theta_0) ** 2 / (u1 - u2)


@energy(domain=r"u_1 > u_2")
def tangent(x0: Point, x1: Point, x2: Point, u1: Sliding, u2: Sliding, *, k: Positive["N m^2"]) -> Expr:
    """Bending by 2 tan(theta/2), as in discrete elastic rods."""
    curvature = 2 * Expr("call", (angle(x1 - x0, x0 - x2) / 2,), "tan")
    return k * curvature**2 / (u1 - u2)


@energy()
def cosine(x0: Point, x1: Point, x2: Point, *, k: Positive["N m"]) -> Expr:
    """Bending by 1 - cos(theta)."""
    return k * (1 - Expr("call", (angle(x1 - x0, x0 - x2),), "cos"))


@energy()
def raised(x0: Point, x1: Point, x2: Point, *, k: Positive["N m"]) -> Expr:
    """An energy that vanishes at a fold as 1 + cos(theta) does."""
    return k * (1 + Expr("call", (angle(x1 - x0, x0 - x2),), "cos"))


@energy()
def repelled(x0: Point, x1: Point, x2: Point, *, k: Positive["N m"]) -> Expr:
    """An energy that is infinite at a fold as 1/(1 + cos(theta)) is."""
    return k / (1 + Expr("call", (angle(x1 - x0, x0 - x2),), "cos"))


@energy()
def spring(x0: Point, x1: Point, *, k: Positive["N m^-1"], L: Positive["m"]) -> Expr:
    """A spring of rest length L."""
    return k * (length(x1 - x0) - L) ** 2 / 2


@energy(domain=r"u_1 > u_0")
def crimped(x0: Point, x1: Point, x3: Point, u0: Sliding, u1: Sliding, *, k: Positive["N"]) -> Expr:
    """A length and a shear angle in one energy."""
    return k * deviation(x1 - x0, x3 - x0) ** 2 * length(x1 - x0) ** 2 / (u1 - u0)


@energy()
def joint(x0: Point, x1: Point, x2: Point, *, k: Positive["N m"]) -> Expr:
    """A turning angle whose corner is the middle point of a chain."""
    return k * angle(x1 - x0, x2 - x1) ** 2


OWN = (resting, tangent, cosine, raised, repelled, spring, crimped, joint)
SHAPES = {
    "resting": ["polar"], "tangent": ["smooth", "polar"], "cosine": ["smooth", "polar"], "raised": ["smooth", "polar"],
    "repelled": ["smooth", "polar"], "spring": ["smooth"],
    "crimped": ["polar"], "joint": ["smooth", "polar"],
}  # fmt: skip


def made(declared: Energy, variant: str) -> Any:
    """The module of a declared energy, as ``generate`` would write it; what it rests on is proved in a test of its own."""
    derivation = derive_declared(declared, ())
    assert derivation is not None
    found = Proved(derivation, tuple(safe_laws.safe_shapes(derivation)))
    programs, notes = derived_programs(declared, found, variant)
    assert not notes
    text, _ = module_text(declared, variant, programs, ["own.md"], notes, found)
    namespace: dict[str, Any] = {}
    exec(compile(text, f"<{declared.name}>", "exec"), namespace)
    return type("Module", (), namespace)


@pytest.mark.parametrize("declared", OWN, ids=lambda e: e.name)
def test_every_block_of_every_shape_is_proved(declared: Energy) -> None:
    derivation = derive_declared(declared, ())
    assert derivation is not None
    shapes = safe_laws.safe_shapes(derivation)
    assert [shape.shape for shape in shapes] == SHAPES[declared.name]
    for shape in shapes:
        found = shape.check()
        assert len(found) == 1 + len(declared.unknowns) * (1 + len(declared.unknowns))
        assert {finding.verdict.value for finding in found.values()} == {"proved"}


def states(declared: Energy, half_turn: Callable[[int], float]) -> tuple[np.ndarray, dict[str, Any]]:
    """States whose angle at x0 is given, in random frames."""
    draw = np.random.default_rng(7)
    n = 8
    q = np.empty((sum(3 if name.bold else 1 for name in declared.unknowns), n))
    for i in range(n):
        frame, _ = np.linalg.qr(draw.standard_normal((3, 3)))
        phi, lengths, row = half_turn(i), draw.uniform(0.5, 2, 3), 0
        for name in declared.unknowns:
            if not name.bold:
                q[row, i] = {"0": -1.0, "1": 1.0, "2": -1.0}[name.sub] * draw.uniform(0.5, 1)
                row += 1
                continue
            turned = {"0": 0.0, "1": 1.0}.get(name.sub)
            local = (
                np.array([np.cos(phi), np.sin(phi), 0.0]) * lengths[0]
                if turned is None
                else turned * np.eye(3)[0] * lengths[1]
            )
            q[row : row + 3, i] = frame @ local
            row += 3
    parameters = {str(p.name): np.full(n, 0.75) for p in declared.parameters}
    return q, parameters


WHERE: dict[str, Callable[[int], float]] = {
    "moderate": lambda i: 0.4 + 0.3 * i, "towards pi": lambda i: np.pi - 0.1 ** (i + 1), "towards 0": lambda i: 0.1 ** (i + 1)
}  # fmt: skip


@pytest.mark.parametrize("declared", [e for e in OWN if e is not joint], ids=lambda e: e.name)
def test_an_energy_of_ones_own_gets_the_safe_variants(declared: Energy) -> None:
    """The targets of ``fast`` and ``reference``; where the law does not cancel, ``accurate`` is held to twice its own."""
    for where, variant in product(WHERE, ("accurate", "fast", "reference")):
        module = made(declared, variant)
        q, parameters = states(declared, WHERE[where])
        points = Points(q, parameters)
        exact = truth(declared, points)
        assert exact.has_derivatives.all()
        amplified = condition("G", declared, points, exact).max(axis=0)
        _hold(declared, variant, module.evaluate(q, **parameters), exact, amplified)


def _hold(declared: Energy, variant: str, results: Any, exact: Any, amplified: Any) -> None:
    for output, computed in zip("EGH", results, strict=True):
        errors = measure(output, computed, exact, declared.unknowns, "float64")
        if variant == "reference":
            assert errors.worst_component.max() <= 1.0
            continue
        assert (errors.worst_block <= 16 + 8 * amplified).all()
        if variant == "accurate" and declared is not resting:  # theta - theta_0 cancels
            assert errors.worst_block.max() <= 32


def test_a_rest_angle_has_no_gradient_at_a_straight_yarn_and_a_square_has() -> None:
    straight = np.array([[0.0, 0, 0, 1, 0, 0, -1, 0, 0, 1, -1]]).T
    with pytest.raises(ElementError, match="resting: element 0: theta is 0 or pi, where the energy has no derivative"):
        made(resting, "accurate").gradient(straight, k=1.0, theta_0=0.5)
    assert made(resting, "accurate").energy(straight, k=1.0, theta_0=0.5)[0] == 0.125
    assert np.isfinite(made(tangent, "accurate").hessian(straight, k=1.0)).all()


@pytest.mark.parametrize(("declared", "pole"), [(tangent, True), (repelled, True), (raised, False), (cosine, False)])
def test_a_pole_at_a_fold_has_no_value_and_promises_less(declared: Energy, pole: bool) -> None:
    module = made(declared, "accurate")
    assert module.KERNEL.promise == ("condition" if pole else "units")
    folded = np.array([[0.0, 0, 0, 1, 0, 0, 1, 0, 0, 1, -1]]).T[: len(module.DOFS)]
    with pytest.raises(
        ElementError, match="theta is pi, where the energy has no " + ("value" if pole else "derivative")
    ):
        module.gradient(folded, k=1.0)
    if not pole:
        assert module.energy(folded, k=1.0)[0] == (0.0 if declared is raised else 2.0)


# -- damage -----------------------------------------------------------------------------------------------------------

WRONG: dict[str, Callable[[Any, Any, Any], Expr]] = {
    "sign": lambda self, right, at: -right(self, *at),
    "factor": lambda self, right, at: 2 * right(self, *at),
    "transpose": lambda self, right, at: Expr("transpose", (right(self, *at),)),
}


@pytest.mark.parametrize("damage", WRONG)
@pytest.mark.parametrize("shape", ["smooth", "polar"])
def test_a_wrong_block_is_refuted(damage: str, shape: str, declarations: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    right = getattr(safe.Safe, f"_{shape}_block")

    def wrong(self: Any, *at: str) -> Expr:
        block: Expr = right(self, *at)
        return WRONG[damage](self, right, at) if at == ("a", "b") else block

    monkeypatch.setattr(safe.Safe, f"_{shape}_block", wrong)
    bending = next(e for e in declarations.energies if e.name == "bending")
    derivation = derive_declared(bending, declarations.quantities)
    assert derivation is not None
    found = next(s for s in safe_laws.safe_shapes(derivation) if s.shape == shape).check()
    assert found["dF_x1/dx2"].verdict.value == "refuted"


def test_laws_without_a_safe_form_say_so(declarations: Any) -> None:
    @energy()
    def odd(x0: Point, x1: Point, x2: Point, *, k: Positive["N m"]) -> Expr:
        return k * Expr("call", (angle(x1 - x0, x0 - x2) / 3,), "sin")

    programs, notes = derived_programs(odd, proved(odd, Declarations((odd,))), "accurate")
    assert notes == [
        "no law of lengths and one angle of segments: differentiated step by step, which promises no digits"
    ]
    assert len(programs) == 1 and replace(programs[0]) == programs[0]
