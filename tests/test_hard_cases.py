"""Elements that are hard to get right, each with the result that is expected there.

A case is judged against the true values by the limit of its variant, or is expected to be refused with a reason. The
variants whose formulas divide by the sine of an angle are tried where that does no harm (``plain``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from tests.variants import ENERGIES, FUNCTIONS, SAFE, bits, kernel, outputs
from yarnverify.fuzzing.judge import declared, judge
from yarnverify.kernels import ElementError
from yarnverify.strategies import Element, Turn

PI = np.pi
ULP = 2.0**-52
ORIGIN = np.zeros(3)
X, Y, Z = np.eye(3)
GENERIC = np.array([3.0, 4.0, 12.0])  # of length 13
ACROSS = np.array([4.0, -3.0, 0.0])  # of length 5, perpendicular to it
FAR = np.array([0.5, -1.0, 0.75])


def made(*rows: Any, dtype: Any = np.float64, **parameters: float) -> Element:
    return Element(np.concatenate([np.ravel(row) for row in rows]).astype(dtype)[:, None], parameters)


def bent(a: Any, b: Any, at: Any = ORIGIN, u: tuple[float, float] = (1.0, -1.0), **options: Any) -> Element:
    """A crossing with a bent yarn, from its two edges."""
    return made(at, at + a, at + b, *u, k_b=2.0, **options)


def sheared(a: Any, b: Any, at: Any = ORIGIN, **options: Any) -> Element:
    """A crossing with a warp and a weft segment, from its two edges."""
    return made(at, at + a, at + b, k_x=2.0, L=0.5, **options)


def stretched(edge: Any, rest: float, at: Any = ORIGIN, **options: Any) -> Element:
    return made(at, at + edge, 0.0, rest, k_s=3.0, **options)


def touching(gap: float, d: float = 0.5) -> Element:
    return made(0.0, gap, k_c=2.0, L=3.0, d=d)


def turned(turn: Turn, length: float = 1.0, first: Any = X, second: Any = Y) -> Any:
    """An edge that makes an angle with ``first``."""
    return length * (turn.cosine * first + turn.sine * second)


def towards(angle: float, side: str = "0") -> Any:
    """The second edge of a yarn that turns by an angle, or by pi less that angle."""
    return turned(Turn("pi" if side == "0" else "0", angle))


def generic(turn: Turn) -> Any:
    """An edge in the generic frame, of length 1."""
    return turned(turn, 1.0, GENERIC / 13, ACROSS / 5)


@dataclass(frozen=True)
class Case:
    """An element and whether the variants with plain formulas manage it too."""

    name: str
    energy: str
    element: Element
    plain: bool = False


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
    from yarnverify.accuracy.truth import truth
    from yarnverify.fuzzing.judge import points_of

    true = truth(declared("bending"), points_of([element]))
    pairs = zip(outputs(module, element), (true.energy, true.gradient, true.hessian), strict=True)
    return [float((got * (got - want)).sum() / (want * want).sum()) * 2.0**53 for got, want in pairs]


# -- bad numbers, shapes and types ------------------------------------------------------------------------------------

REGULAR = {
    "stretch": stretched(GENERIC, 10.0),
    "bending": bent(GENERIC, Y - Z),
    "shear": sheared(GENERIC, Y - Z),
    "parallel_contact": touching(0.25),
}
EACH = pytest.mark.parametrize("energy", ENERGIES)


def replaced(element: Element, row: int, value: float) -> Element:
    q = element.q.copy()
    q[row] = value
    return Element(q, element.parameters)


@EACH
@ALL
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_coordinate_that_is_not_finite_is_named(energy: str, variant: str, value: float) -> None:
    module = kernel(energy, variant)
    for row, label in enumerate(module.DOFS):
        broken = replaced(REGULAR[energy], row, value)
        for function in FUNCTIONS:
            with pytest.raises(ElementError) as caught:
                outputs(module, broken, function)
            assert str(caught.value) == f"{energy}: element 0: {label} is {value}"
            assert all(np.isnan(array).all() for array in outputs(module, broken, function, errors="mask"))


@EACH
@ALL
def test_bad_parameters_are_named(energy: str, variant: str) -> None:
    module = kernel(energy, variant)
    q, parameters = REGULAR[energy]
    for name in module.PARAMETERS:
        for value, kind, text in [
            (-1.0, ValueError, "{} = -1.0 must be finite and not negative"),
            (np.nan, ValueError, "{} = nan must be finite and not negative"),
            (np.inf, ValueError, "{} = inf must be finite and not negative"),
            ([-2.0], ValueError, "{}[0] = -2.0 must be finite and not negative"),
            ([1.0, 2.0], ValueError, "{} must be a number or have shape (1,), not (2,)"),
            (1j, TypeError, "{} must be real, not complex128"),
        ]:
            with pytest.raises(kind) as caught:
                module.evaluate(q, **parameters | {name: value})
            assert str(caught.value) == f"{energy}: {text.format(name)}"


@EACH
@ALL
@pytest.mark.parametrize("function", FUNCTIONS)
def test_bad_arrays_are_described(energy: str, variant: str, function: str) -> None:
    module = kernel(energy, variant)
    _, parameters = REGULAR[energy]
    dof = len(module.DOFS)
    for q, kind, text in [
        (np.zeros((dof, 1), complex), TypeError, "q must be float32, float64 or integer, not complex128"),
        (np.zeros((dof, 1), object), TypeError, "q must be float32, float64 or integer, not object"),
        (np.full((dof, 1), "1"), TypeError, "q must be float32, float64 or integer, not <U1"),
        (np.zeros(dof), ValueError, f"q must have shape ({dof}, n), not ({dof},)"),
        (np.zeros((dof + 1, 4)), ValueError, f"q must have shape ({dof}, n), not ({dof + 1}, 4)"),
        (np.zeros((4, dof)), ValueError, f"q must have shape ({dof}, n), not (4, {dof})"),
    ]:
        with pytest.raises(kind) as caught:
            getattr(module, function)(q, **parameters)
        assert str(caught.value) == f"{energy}: {text}"


@EACH
@ALL
def test_an_empty_batch(energy: str, variant: str) -> None:
    module = kernel(energy, variant)
    dof = len(module.DOFS)
    for q in (np.empty((dof, 0)), np.empty((dof, 0), np.float32)):
        found = module.evaluate(q, **REGULAR[energy].parameters)
        assert [array.shape for array in found] == [(0,), (dof, 0), (dof, dof, 0)]
        assert {array.dtype for array in found} == {q.dtype}
    assert module.packed(np.empty((dof, 0)), **REGULAR[energy].parameters)[2].shape == (dof * (dof + 1) // 2, 0)


@EACH
@ALL
def test_integers_are_promoted(energy: str, variant: str) -> None:
    module = kernel(energy, variant)
    whole = {
        "stretch": [0, 0, 0, 3, 4, 12, 0, 10],
        "bending": [0, 0, 0, 3, 4, 12, 0, 1, -1, 1, -1],
        "shear": [0, 0, 0, 3, 4, 12, 0, 1, -1],
        "parallel_contact": [0, 0],
    }[energy]
    q = np.array(whole)[:, None]
    parameters = REGULAR[energy].parameters
    as_float = bits(module.evaluate(q.astype(float), **parameters))
    for kind in (np.int64, np.int32, np.int8):
        assert bits(module.evaluate(q.astype(kind), **parameters)) == as_float


@pytest.mark.parametrize("variant", SAFE)
@pytest.mark.parametrize(
    "case",
    [
        Case("straight", "bending", bent(X, -X, dtype=np.float32)),
        Case("deviation 1e-6", "bending", bent(X, towards(1e-6), dtype=np.float32)),
        Case("bent", "bending", bent(GENERIC, Y - Z, dtype=np.float32)),
        Case("pi less 1e-4", "bending", bent(X, towards(1e-4, "pi"), dtype=np.float32)),
        Case("offset 1e4", "bending", bent(X, towards(0.5), 1e4 * FAR, dtype=np.float32)),
        Case("right angle and 1e-6", "shear", sheared(X, turned(Turn("pi/2", 1e-6)), dtype=np.float32)),
        Case("near 0 by 1e-4", "shear", sheared(X, turned(Turn("0", 1e-4)), dtype=np.float32)),
        Case("strain 1e-6", "stretch", stretched(GENERIC, 13 * (1 - 1e-6), dtype=np.float32)),
    ],
    ids=lambda case: f"{case.energy}-{case.name}".replace(" ", "_"),
)
def test_single_precision(case: Case, variant: str) -> None:
    """The same limits, in units of single precision, against the truth at the exact single-precision inputs."""
    module = kernel(case.energy, variant)
    assert {array.dtype for array in outputs(module, case.element)} == {np.dtype(np.float32)}
    assert judge(module, declared(case.energy), case.element).flaws == ()


# -- one bad element among many ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", (*SAFE, "differentiated"))
@pytest.mark.parametrize("function", ["energy", "gradient"])
def test_one_bad_element_among_a_million(variant: str, function: str) -> None:
    module = kernel("stretch", variant)
    n, bad = 10**6, 654_321
    q = np.repeat(REGULAR["stretch"].q, n, axis=1)
    q[3] += np.linspace(0, 1, n)
    (good,) = (getattr(module, function)(q, k_s=1.0),)
    q[4, bad] = np.nan
    with pytest.raises(ElementError) as caught:
        getattr(module, function)(q, k_s=1.0)
    assert str(caught.value) == f"stretch: element {bad}: x1.y is nan"
    assert caught.value.elements.tolist() == [bad]
    masked = getattr(module, function)(q, k_s=1.0, errors="mask")
    assert np.isnan(masked[..., bad]).all()
    others = np.arange(n) != bad
    assert masked[..., others].tobytes() == good[..., others].tobytes()


@EACH
@ALL
def test_several_bad_elements_each_for_its_reason(energy: str, variant: str) -> None:
    """The first is named with its reason, all are listed, and the others keep their bits."""
    module = kernel(energy, variant)
    n = 20_000  # more than two chunks
    q = np.repeat(REGULAR[energy].q, n, axis=1)
    q[0] += np.linspace(0, 1e-2, n)
    good = module.packed(q, **REGULAR[energy].parameters)
    q[1, [19_999, 8_192]] = np.inf
    q[0, 8_191] = -np.inf
    with pytest.raises(ElementError) as caught:
        module.packed(q, **REGULAR[energy].parameters)
    assert str(caught.value) == f"{energy}: element 8191: {module.DOFS[0]} is -inf (and 2 more)"
    assert caught.value.elements.tolist() == [8_191, 8_192, 19_999]
    masked = module.packed(q, **REGULAR[energy].parameters, errors="mask")
    others = np.delete(np.arange(n), [8_191, 8_192, 19_999])
    for before, after in zip(good, masked, strict=True):
        assert np.isnan(after[..., [8_191, 8_192, 19_999]]).all()
        assert after[..., others].tobytes() == before[..., others].tobytes()
