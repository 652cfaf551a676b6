"""Elements that are hard to get right, each with the result that is expected there.

A case is judged against the true values by the limit of its variant, or is expected to be refused with a reason. The
variants whose formulas divide by the sine of an angle are tried where that does no harm (``plain``).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.cases import (
    ACROSS,
    FAR,
    GENERIC,
    ORIGIN,
    Case,
    X,
    Y,
    Z,
    bent,
    generic,
    sheared,
    stretched,
    touching,
    towards,
    turned,
)
from tests.variants import FUNCTIONS, SAFE, kernel, outputs
from yarnverify.accuracy.truth import truth
from yarnverify.fuzzing.judge import declared, judge, points_of
from yarnverify.kernels import ElementError
from yarnverify.strategies import Element, Turn

ULP = 2.0**-52


def near(c: float, steps: int) -> Any:
    """An edge whose cosine with the x axis is some steps of its last digit from c."""
    return np.array([c + steps * ULP / 4, np.sqrt(1 - c * c), 0.0])


VALUES = [
    Case("straight along an axis", "bending", bent(X, -X)),
    Case("straight along an axis, far away", "bending", bent(X, -X, 2.0**40 * FAR)),
    Case("straight in a generic direction", "bending", bent(GENERIC, -GENERIC)),
    Case("straight in a generic direction, unequal", "bending", bent(GENERIC, -4 * GENERIC)),
    *(Case(f"deviation {t}", "bending", bent(X, towards(t))) for t in (1e-8, 1e-12, 1e-15, 1e-200, 5e-324)),
    *(Case(f"deviation {t}, generic", "bending", bent(GENERIC, generic(Turn("pi", t)))) for t in (1e-8, 1e-12, 1e-15)),
    Case("unequal by 1e8", "bending", bent(X, 1e8 * towards(0.3)), plain=True),
    Case("unequal by 1e-8", "bending", bent(GENERIC, 1e-8 * generic(Turn("pi", 0.3))), plain=True),
    Case("unequal by 1e8, nearly straight", "bending", bent(X, 1e8 * towards(1e-6))),
    Case("unequal by 1e8, nearly folded", "bending", bent(X, 1e8 * towards(1e-6, "pi"))),
    *(
        Case(f"cosine {c}, {steps} steps", "bending", bent(X, near(c, steps)), plain=True)
        for c in (-0.75, -0.5, 0.0, 0.5, 0.75)
        for steps in (-1, 0, 1)
    ),
    Case("right angle", "bending", bent(X, Y), plain=True),
    Case("right angle, generic", "bending", bent(GENERIC, ACROSS), plain=True),
    *(Case(f"pi less {t}", "bending", bent(X, towards(t, "pi"))) for t in (1e-4, 1e-8, 1e-12, 1e-15)),
    *(Case(f"pi less {t}, generic", "bending", bent(GENERIC, generic(Turn("0", t)))) for t in (1e-4, 1e-8, 1e-12)),
    Case("pi less 1e-8, equal lengths", "bending", bent(GENERIC / 13, generic(Turn("0", 1e-8)))),
    Case("folded but for 1e-200", "bending", bent(X, X + 1e-200 * Y)),
    *(Case(f"offset {x}", "bending", bent(X, towards(0.5), x * FAR)) for x in (1e6, 1e12)),
    *(Case(f"offset {x}, nearly straight", "bending", bent(X, towards(1e-3), x * FAR)) for x in (1e6, 1e12)),
    *(Case(f"offset {x}, nearly folded", "bending", bent(X, towards(1e-3, "pi"), x * FAR)) for x in (1e6, 1e12)),
    Case("segments of 1e200", "bending", bent(1e200 * X, 1e200 * towards(0.5))),
    Case("segments of 1e100", "bending", bent(1e100 * X, 1e100 * towards(0.5)), plain=True),
    Case("segments of 1e-100", "bending", bent(1e-100 * X, 1e-100 * towards(0.5)), plain=True),
    Case("right angle", "shear", sheared(X, Y)),
    Case("right angle, generic", "shear", sheared(GENERIC, ACROSS)),
    *(Case(f"right angle and {t}", "shear", sheared(X, turned(Turn("pi/2", t)))) for t in (1e-15, -1e-8, 1e-200)),
    *(Case(f"right angle and {t}, far", "shear", sheared(X, Y + t * X, 1e6 * FAR)) for t in (1e-3, -1e-6)),
    *(
        Case(f"near {side} by {t}", "shear", sheared(GENERIC, generic(Turn(side, t))))
        for side in ("0", "pi")
        for t in (1e-4, 1e-8, 1e-12)
    ),
    Case("phi = 0 but for 1e-200", "shear", sheared(X, X + 1e-200 * Y)),
    *(Case(f"offset {x}", "shear", sheared(X, turned(Turn("0", 1.0)), x * FAR)) for x in (1e6, 1e12)),
    Case("unequal by 1e8", "shear", sheared(X, 1e8 * turned(Turn("0", 1.0))), plain=True),
    Case("segments of 1e200", "shear", sheared(1e200 * X, 1e200 * turned(Turn("0", 1.0)))),
    Case("at rest", "stretch", stretched(X, 1.0), plain=True),
    Case("at rest, generic", "stretch", stretched(GENERIC, 13.0), plain=True),
    *(Case(f"strain {s}", "stretch", stretched(GENERIC, 13.0 * (1 - s))) for s in (1e-15, 1e-8, -1e-12)),
    Case("strain 1e-3, far", "stretch", stretched(X, 0.999, 1e12 * FAR)),
    Case("compressed to a half", "stretch", stretched(0.5 * X, 1.0), plain=True),
    Case("compressed to 1e-8", "stretch", stretched(1e-8 * X, 1.0), plain=True),
    Case("segment of 1e200", "stretch", stretched(1e200 * X, 0.5e200)),
    Case("segment of 1e-200", "stretch", stretched(1e-200 * X, 0.5e-200)),
    Case("at its distance", "parallel_contact", touching(0.5), plain=True),
    Case("just inside", "parallel_contact", touching(np.nextafter(0.5, 0)), plain=True),
    Case("just outside", "parallel_contact", touching(np.nextafter(0.5, 1)), plain=True),
    Case("far inside", "parallel_contact", touching(-7.0), plain=True),
    Case("far outside", "parallel_contact", touching(1e200), plain=True),
]


def chosen(cases: list[Case]) -> Any:
    """Every case with every variant that it is for."""
    return pytest.mark.parametrize(
        ("case", "variant"),
        [
            pytest.param(case, variant, id=f"{case.energy}-{case.name}-{variant}".replace(" ", "_"))
            for case in cases
            for variant in (*SAFE, *(("differentiated",) if case.plain else ()))
        ],
    )


@chosen(VALUES)
def test_values(case: Case, variant: str) -> None:
    """Finite, without a warning, and within the limit of the variant."""
    module = kernel(case.energy, variant)
    assert [flaw.text for flaw in judge(module, declared(case.energy), case.element).flaws] == []


FOLD = {"bending": "theta is (0 or )?pi", "shear": "phi is 0 or pi"}
SINGULAR = [
    Case("fold along an axis", "bending", bent(X, X)),
    Case("fold along an axis, unequal", "bending", bent(X, 3 * X)),
    Case("fold in a generic direction", "bending", bent(GENERIC, GENERIC)),
    Case("fold in a generic direction, unequal", "bending", bent(GENERIC, 4 * GENERIC)),
    Case("fold, far away", "bending", bent(GENERIC, 0.5 * GENERIC, 2.0**30 * FAR)),
    Case("phi = 0", "shear", sheared(X, 2 * X), plain=True),
    Case("phi = 0, generic", "shear", sheared(GENERIC, GENERIC)),
    Case("phi = pi", "shear", sheared(X, -X)),
    Case("phi = pi, generic", "shear", sheared(GENERIC, -0.5 * GENERIC)),
]


@chosen(SINGULAR)
def test_singular_angles_have_an_energy_and_nothing_else(case: Case, variant: str) -> None:
    """At a fold and at phi = 0 or pi the energy is finite; its gradient has no direction, so there is none."""
    module = kernel(case.energy, variant)
    if variant != "differentiated":
        assert judge(module, declared(case.energy), case.element).flaws == ()
    assert np.isfinite(outputs(module, case.element, "energy")[0]).all()
    for function in FUNCTIONS[1:]:
        with pytest.raises(ElementError, match=f"^{case.energy}: element 0: {FOLD[case.energy]}") as caught:
            outputs(module, case.element, function)
        assert caught.value.elements.tolist() == [0]
        assert all(np.isnan(array).all() for array in outputs(module, case.element, function, errors="mask"))


ZERO = "the segment {} has length zero"
REFUSED = [
    (Case("x1 at x0", "bending", bent(ORIGIN, X), plain=True), ZERO.format("x0-x1")),
    (Case("x2 at x0", "bending", bent(X, ORIGIN), plain=True), ZERO.format("x0-x2")),
    (Case("both at x0", "bending", bent(ORIGIN, ORIGIN), plain=True), ZERO.format("x0-x[12]")),
    (Case("swallowed by an offset", "bending", bent(X, -X, 1e17 * FAR), plain=True), ZERO.format("x0-x[12]")),
    (Case("no yarn", "bending", bent(X, Y, u=(1.0, 1.0)), plain=True), "u1 > u2 does not hold"),
    (Case("reversed yarn", "bending", bent(X, Y, u=(0.0, 1.0)), plain=True), "u1 > u2 does not hold"),
    (Case("x1 at x0", "shear", sheared(ORIGIN, X), plain=True), ZERO.format("x0-x1")),
    (Case("x3 at x0", "shear", sheared(X, ORIGIN), plain=True), ZERO.format("x0-x3")),
    (Case("both at x0", "shear", sheared(ORIGIN, ORIGIN), plain=True), ZERO.format("x0-x[13]")),
    (Case("swallowed by an offset", "shear", sheared(X, Y, 1e17 * FAR), plain=True), ZERO.format("x0-x[13]")),
    (Case("x1 at x0", "stretch", stretched(ORIGIN, 1.0), plain=True), ZERO.format("x0-x1")),
    (Case("swallowed by an offset", "stretch", stretched(X, 1.0, 1e17 * FAR), plain=True), ZERO.format("x0-x1")),
    (Case("no yarn", "stretch", stretched(X, 0.0), plain=True), "u1 > u0 does not hold"),
    (Case("reversed yarn", "stretch", stretched(X, -1.0), plain=True), "u1 > u0 does not hold"),
]


@pytest.mark.parametrize(
    ("case", "reason", "variant"),
    [
        pytest.param(case, reason, variant, id=f"{case.energy}-{case.name}-{variant}".replace(" ", "_"))
        for case, reason in REFUSED
        for variant in (*SAFE, "differentiated")
    ],
)
@pytest.mark.parametrize("function", FUNCTIONS)
def test_elements_without_a_value(case: Case, reason: str, variant: str, function: str) -> None:
    module = kernel(case.energy, variant)
    with pytest.raises(ElementError, match=f"^{case.energy}: element 0: {reason}") as caught:
        outputs(module, case.element, function)
    assert caught.value.elements.tolist() == [0]
    assert all(np.isnan(array).all() for array in outputs(module, case.element, function, errors="mask"))


OVERFLOWING = [
    Case("segments of 1e-200", "bending", bent(1e-200 * X, 1e-200 * towards(0.5))),
    Case("segments of 1e-200 in a generic direction", "bending", bent(1e-200 * GENERIC, 1e-200 * ACROSS)),
    Case("segments of 1e-200", "shear", sheared(1e-200 * X, 1e-200 * turned(Turn("0", 1.0)))),
]


@chosen(OVERFLOWING)
def test_only_what_overflows_is_refused(case: Case, variant: str) -> None:
    """Energy and gradient (1e200) fit; the Hessian (1e400) does not, and says so instead of being infinite or NaN."""
    module = kernel(case.energy, variant)
    assert judge(module, declared(case.energy), case.element).flaws == ()
    gradient = outputs(module, case.element, "gradient")[0]
    assert 1e199 < np.abs(gradient).max() < 1e202
    for function in ("hessian", "evaluate", "packed"):
        with pytest.raises(ElementError, match=f"^{case.energy}: element 0: the result is not finite"):
            outputs(module, case.element, function)


# -- exact expectations -----------------------------------------------------------------------------------------------

SAFE_ONLY = pytest.mark.parametrize("variant", SAFE)
ALL = pytest.mark.parametrize("variant", (*SAFE, "differentiated"))


@SAFE_ONLY
@pytest.mark.parametrize("axis", [X, Y, Z])
def test_a_straight_yarn_along_an_axis_exactly(variant: str, axis: Any) -> None:
    """With k_b = u1 - u2 and unit segments the energy is theta^2, and theta = |y1 + y2 - 2 y0| across the yarn."""
    e, g, h = outputs(kernel("bending", variant), bent(axis, -axis))
    across = np.diag(1 - np.abs(axis))
    weights = np.array([-2.0, 1.0, 1.0])
    expected = np.zeros((11, 11))
    expected[:9, :9] = 2 * np.kron(np.outer(weights, weights), across)
    assert e[0] == 0 and not g.any()
    np.testing.assert_array_equal(h[..., 0], expected)


@SAFE_ONLY
@pytest.mark.parametrize("lengths", [(1.0, 1.0), (1.0, 8.0), (0.25, 2.0)])
@pytest.mark.parametrize("at", [0.0, 2.0**20])
def test_a_straight_yarn_in_a_generic_direction(variant: str, lengths: tuple[float, float], at: float) -> None:
    """No energy and no force whatever, not even a rounding."""
    element = bent(lengths[0] * GENERIC, -lengths[1] * GENERIC, at * FAR)
    e, g, _ = outputs(kernel("bending", variant), element)
    assert e[0] == 0 and not g.any()


@SAFE_ONLY
def test_a_right_angle_exactly(variant: str) -> None:
    """With k_x L = 1 and unit segments along x and y, psi = x0.x - x3.x + x0.y - x1.y to first order."""
    e, g, h = outputs(kernel("shear", variant), sheared(X, Y))
    slope = np.array([-1.0, -1, 0, 0, 1, 0, 1, 0, 0])
    assert e[0] == 0 and not g.any()
    np.testing.assert_array_equal(h[..., 0], np.outer(slope, slope))


@ALL
def test_stretch_at_rest_exactly(variant: str) -> None:
    e, g, h = outputs(kernel("stretch", variant), stretched(X, 1.0))
    slope = np.array([-1.0, 0, 0, 1, 0, 0, 1, -1])
    assert e[0] == 0 and not g.any()
    np.testing.assert_array_equal(h[..., 0], 3 * np.outer(slope, slope))


@ALL
def test_contact_at_its_distance(variant: str) -> None:
    """At u1 - u0 = d and beyond there is nothing; one unit in the last place inside, a stiffness and a tiny force."""
    module = kernel("parallel_contact", variant)
    for gap in (0.5, np.nextafter(0.5, 1), 1.0):
        assert not any(array.any() for array in outputs(module, touching(gap)))
    e, g, h = outputs(module, touching(np.nextafter(0.5, 0)))
    overlap = 2.0**-54
    assert e[0] == 3 * overlap**2
    np.testing.assert_array_equal(g[:, 0], [6 * overlap, -6 * overlap])
    np.testing.assert_array_equal(h[..., 0], [[6, -6], [-6, 6]])


@pytest.mark.parametrize("variant", ["accurate"])
@pytest.mark.parametrize("c", [-0.75, -0.5, 0.0, 0.5, 0.75])
def test_no_jump_across_a_branch(variant: str, c: float) -> None:
    """Errors on the two sides of a branch point have the same mean within 4 u; the mean takes single roundings out."""
    module = kernel("bending", variant)
    sides = []
    for away in (-1.0, 1.0):
        cosines = c + away * ULP * np.arange(1, 65)
        single = [judge_sizes(module, bent(X, np.array([x, np.sqrt((1 - x) * (1 + x)), 0.0]))) for x in cosines]
        sides.append(np.mean(single, axis=0))
    assert np.abs(sides[0] - sides[1]).max() <= 4


def judge_sizes(module: Any, element: Element) -> Any:
    """Signed relative errors of the energy, and of the norms of gradient and Hessian, in u."""
    true = truth(declared("bending"), points_of([element]))
    pairs = zip(outputs(module, element), (true.energy, true.gradient, true.hessian), strict=True)
    return [float((got * (got - want)).sum() / (want * want).sum()) * 2.0**53 for got, want in pairs]
