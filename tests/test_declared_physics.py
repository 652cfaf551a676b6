"""Gravity, kinetic energy, obstacles: units, the integral, what is proved of them, and that the proofs bite."""

import random
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

from tests.variants import kernel
from yarnverify.accuracy.conditioning import condition
from yarnverify.accuracy.metrics import measure
from yarnverify.accuracy.rule import allowed
from yarnverify.accuracy.truth import Points, truth
from yarnverify.errors import InputError
from yarnverify.kernels import gravity, kinetic, plane, sphere
from yarnverify.library import MAIN_DOCUMENT
from yarnverify.symbolic.court import Verdict
from yarnverify.symbolic.declare import Declarations, Energy, Point, Positive, Sliding, Vector, energy, length
from yarnverify.symbolic.derive import declared_section
from yarnverify.symbolic.dimensions import DimensionError, check_dimensions, dimension_of_unit, length_power, unit_text
from yarnverify.symbolic.integrals import integral
from yarnverify.symbolic.invariants import prove_invariants
from yarnverify.symbolic.modules import kernel_modules
from yarnverify.symbolic.programs import proved
from yarnverify.symbolic.sums import Exact, Stages
from yarnverify.symbolic.tree import Expr, symbol

OWN = ("gravity", "kinetic", "plane", "sphere")
VARIANTS = ("accurate", "fast", "reference")


def named(declarations: Declarations, name: str) -> Energy:
    return next(e for e in declarations.energies if e.name == name)


# -- units ------------------------------------------------------------------------------------------------------------


def test_every_declared_energy_comes_out_in_joules(declarations: Declarations) -> None:
    assert len(declarations.energies) == 8
    for each in declarations.energies:
        assert each.unit == "J"
        check_dimensions(each)


def units_of(each: Energy) -> list[str]:
    return [*each.units, *(parameter.unit for parameter in each.parameters)]


@pytest.mark.parametrize("name", ["stretch", "bending", "shear", "parallel_contact", *OWN])
@pytest.mark.parametrize("factor", ["m", "s^-1", "kg"])
def test_one_wrong_unit_is_seen(declarations: Declarations, name: str, factor: str) -> None:
    """A unit that is off by any factor, of any unknown or parameter, never leaves joules; nor does the energy's own."""
    each = named(declarations, name)
    for i in range(len(each.unknowns)):
        units = tuple(f"{unit} {factor}" if i == j else unit for j, unit in enumerate(each.units))
        with pytest.raises(DimensionError):
            check_dimensions(replace(each, units=units))
    for i in range(len(each.parameters)):
        changed = [replace(p, unit=f"{p.unit} {factor}") if i == j else p for j, p in enumerate(each.parameters)]
        with pytest.raises(DimensionError):
            check_dimensions(replace(each, parameters=tuple(changed)))
    with pytest.raises(DimensionError, match="the energy comes out in kg m\\^2 s\\^-2, and J "):
        check_dimensions(replace(each, unit=f"J {factor}"))


def test_units_are_read() -> None:
    assert dimension_of_unit("N m^2") == dimension_of_unit("kg m^3 s^-2") == (1, 3, -2)
    assert dimension_of_unit("Pa m^3") == dimension_of_unit("J") and dimension_of_unit("rad") == dimension_of_unit("1")
    assert unit_text(dimension_of_unit("N")) == "kg m s^-2" and unit_text(dimension_of_unit("1")) == "1"
    assert dimension_of_unit("kg/m/s^2") == dimension_of_unit("Pa") and dimension_of_unit("N/m") == dimension_of_unit(
        "N m^-1"
    )
    for unit in ("furlong", "m^x", "m/", "/s", "m^-"):
        with pytest.raises(DimensionError, match="unknown unit"):
            dimension_of_unit(unit)
    assert [length_power(unit) for unit in ("kg m^-1", "m s^-2", "N m^2", "J", "1", "Pa", "N/m")] == [
        -2,
        1,
        2,
        1,
        0,
        -2,
        -1,
    ]


@energy()
def angle_of_a_length(x0: Point, x1: Point, *, k: Positive["J"]) -> Expr:
    return k * Expr("call", (length(x1 - x0),), "sin")


@energy()
def more_than_its_length(x0: Point, x1: Point, *, k: Positive["N"]) -> Expr:
    return k * (length(x1 - x0) + 1)


@energy(domain="u_1 > k")
def wrong_domain(u1: Sliding, *, k: Positive["N"]) -> Expr:
    return k * u1


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (angle_of_a_length, "sin of what is in m"),
        (more_than_its_length, "is in m, 1 in 1"),
        (wrong_domain, "is in m, k in"),
    ],
)
def test_what_cannot_have_a_unit_is_refused(wrong: Energy, words: str) -> None:
    with pytest.raises(DimensionError, match=words):
        check_dimensions(wrong)


def test_generate_refuses_an_energy_with_wrong_units(tmp_path: Path, folder: Path) -> None:
    (tmp_path / MAIN_DOCUMENT).write_bytes((folder / MAIN_DOCUMENT).read_bytes())
    text = (folder / "gravity.py").read_text(encoding="utf-8")
    (tmp_path / "gravity.py").write_text(text.replace('"m s^-2"', '"m s^-1"'), encoding="utf-8")
    with pytest.raises(
        InputError, match=r"gravity.py:12:12: gravity: the energy comes out in kg m\^2 s\^-1, and J is kg m\^2 s\^-2"
    ):
        kernel_modules(tmp_path, MAIN_DOCUMENT, "accurate")


# -- what is proved ---------------------------------------------------------------------------------------------------


def test_declared_motions_leave_the_energies_unchanged(declarations: Declarations) -> None:
    counts = {}
    for each in declarations.energies:
        found = prove_invariants(each, declarations.motions)
        assert {finding.verdict for finding in found.values()} == {Verdict.PROVED}, each.name
        counts[each.name] = len(found)
    assert counts["kinetic"] == 5 and sum(counts.values()) == 20


def test_a_motion_that_changes_an_energy_is_refuted(declarations: Declarations) -> None:
    lifted = replace(named(declarations, "gravity"), unchanged=("translation",))
    assert [finding.verdict for finding in prove_invariants(lifted).values()] == [Verdict.REFUTED]
    with pytest.raises(InputError, match="gravity: invariance under translation is refuted"):
        proved(lifted, declarations)
    (first, _) = (m for m in declarations.motions if m.energy == "kinetic")
    turned = replace(first, rates=((first.rates[0][0], -first.rates[0][1]), first.rates[1]))
    (finding,) = prove_invariants(replace(named(declarations, "kinetic"), unchanged=()), [turned]).values()
    assert finding.verdict is Verdict.REFUTED


@pytest.mark.parametrize("name", ["gravity", "kinetic", "plane"])
def test_a_changed_derivative_is_found(declarations: Declarations, name: str) -> None:
    each = named(declarations, name)
    stages = Stages(each, declared_section(each))
    assert stages.prove() == []
    stages.gradient[0] = -stages.gradient[0]
    stages.hessian[-1] = stages.hessian[-1] + stages.rows[0]
    assert stages.prove() == [str(stages.rows[0]), f"{stages.rows[-1]},{stages.rows[-1]}"]


def test_the_mass_matrix_has_rank_six(declarations: Declarations) -> None:
    """In exact arithmetic at every state: two null vectors (proved motions), and a positive block of six."""
    each = named(declarations, "kinetic")
    stages = Stages(each, declared_section(each))
    exact = Exact(stages)
    slopes = [exact.energy.diff(row) for row in exact.rows]
    mass = [[slopes[i].diff(exact.rows[j]) for j in range(8, 16)] for i in range(8, 16)]
    u0, u1 = exact.rows[6:8]
    rho = exact.field.gens[-1]
    for i in range(6):
        for j in range(6):
            assert mass[i][j] == (rho * (u1 - u0) * (2 if i == j else 1) / 6 if (i - j) % 3 == 0 else 0)
    tangent = [(exact.rows[3 + k] - exact.rows[k]) / (u1 - u0) for k in range(3)]
    for vector in ([*tangent, 0, 0, 0, 1, 0], [0, 0, 0, *tangent, 0, 1]):
        assert all(sum((m * v for m, v in zip(row, vector, strict=True)), exact.field(0)) == 0 for row in mass)
    assert sp.Matrix([[2, 1], [1, 2]]).is_positive_definite
    # kinetic energy is the mass matrix between velocities, and nothing else
    v = exact.rows[8:]
    assert sum((v[i] * mass[i][j] * v[j] for i in range(8) for j in range(8)), exact.field(0)) == 2 * exact.energy


# -- the integral -----------------------------------------------------------------------------------------------------


def test_the_kinetic_energy_is_the_integral_over_the_segment() -> None:
    """Simpson's rule is exact for a square of what is linear; all in fractions."""
    draw = random.Random(3)
    x, y, v, w = ([Fraction(draw.randint(-9, 9), draw.randint(1, 5)) for _ in range(3)] for _ in range(4))
    u0, u1, s0, s1, rho = Fraction(-2, 3), Fraction(5, 4), Fraction(3, 7), Fraction(-2, 5), Fraction(7, 3)

    def density(share: Fraction) -> Fraction:
        slide = (1 - share) * s0 + share * s1
        moved = [(1 - share) * v[k] + share * w[k] - (y[k] - x[k]) / (u1 - u0) * slide for k in range(3)]
        return rho / 2 * sum(part**2 for part in moved)

    wanted = (u1 - u0) / 6 * (density(Fraction(0)) + 4 * density(Fraction(1, 2)) + density(Fraction(1)))
    q = np.array([float(p) for p in (*x, *y, u0, u1, *v, *w, s0, s1)])[:, None]
    assert kinetic.energy(q, rho=float(rho))[0] == pytest.approx(float(wanted), rel=1e-14)


def test_integrals() -> None:
    u0, u1, a, b = symbol("u", "0"), symbol("u", "1"), symbol("a", bold=True), symbol("b", bold=True)

    def value(tree: Expr, **numbers: Any) -> Any:
        @energy()
        def made(u0: Sliding, u1: Sliding, *, a: Vector["m"], b: Vector["m"]) -> Expr:
            return tree

        stages = Stages(made, declared_section(made))
        return Exact(stages).energy

    linear = integral(lambda u: 2 * u, u0, u1)
    assert value(linear) == value(u1**2 - u0**2)
    assert value(integral(lambda u: (a * u - b).T * a, u0, u1)) == value(
        a.T * a * (u1**2 - u0**2) / 2 - b.T * a * (u1 - u0)
    )
    assert value(integral(lambda u: (-(u / 2 * a)).T * b, u0, u1)) == value(-(a.T * b) * (u1**2 - u0**2) / 4)
    for wrong in (lambda u: length(u * a), lambda u: Expr("cross", (u * a, b)).T * a):
        with pytest.raises(TypeError, match="an integrand cannot hold"):
            integral(wrong, u0, u1)


# -- kernels ----------------------------------------------------------------------------------------------------------


def states(name: str, count: int = 40) -> tuple[Any, dict[str, Any]]:
    draw = np.random.default_rng(5)
    module = kernel(name, "accurate")
    q = draw.normal(size=(len(module.DOFS), count))
    if "u0" in module.DOFS:
        q[7] = q[6] + draw.uniform(0.5, 2, count)
    given = {
        "rho": draw.uniform(0.1, 2, count), "g": draw.normal(size=(3, count)), "k": draw.uniform(0.5, 2, count),
        "n": draw.normal(size=(3, count)), "p": draw.normal(size=(3, count)), "c": draw.normal(size=(3, count)) / 4, "R": 1.0,
    }  # fmt: skip
    return q, {key: given[key] for key in module.PARAMETERS}


@pytest.mark.parametrize("name", OWN)
@pytest.mark.parametrize("variant", VARIANTS)
def test_derivatives_agree_with_the_energy_to_second_order(name: str, variant: str) -> None:
    module = kernel(name, variant)
    q, parameters = states(name)
    _, g, h = module.evaluate(q, **parameters)
    assert h.tobytes() == h.transpose(1, 0, 2).tobytes()
    for call, wanted in ((module.energy, g), (module.gradient, h)):
        gaps = []
        for step in (1e-3, 2e-3):
            shifts = step * np.eye(len(q))
            found = [
                (call(q + s[:, None], **parameters) - call(q - s[:, None], **parameters)) / (2 * step) for s in shifts
            ]
            gaps.append(np.abs(np.array(found) - wanted).max(axis=-1).max())
        assert gaps[0] < 1e-3 * (1 + np.abs(wanted).max())
        assert gaps[0] < 1e-9 or gaps[1] / gaps[0] == pytest.approx(4, rel=0.1)


@pytest.mark.parametrize("name", OWN)
@pytest.mark.parametrize("variant", ["accurate", "fast"])
def test_errors_are_those_of_the_inputs(name: str, variant: str) -> None:
    """Against twice the digits: a few roundings of the result, and what the rounding of every input does to it."""
    q, parameters = states(name, 200)
    if name == "kinetic":
        q[:8] += 100 * np.repeat([1.0, 0.0], [6, 2])[:, None]  # far from the origin: only edges matter
    exact = kernel(name, "reference").evaluate(q, **parameters)
    found = kernel(name, variant).evaluate(q, **parameters)
    u = 2.0**-53
    size = np.abs(q).max(axis=0) + 1
    for a, b in zip(found, exact, strict=True):
        gap = np.abs(a - b).reshape(-1, q.shape[1]).max(axis=0)
        scale = np.abs(b).reshape(-1, q.shape[1]).max(axis=0) + sum(
            np.abs(x).reshape(-1, q.shape[1]).max(0) for x in exact
        )
        assert (gap <= 16 * u * scale * (1 + (size if name != "kinetic" else 0))).all()


HARD = {
    "moderate": lambda q, slope, draw: {},
    "the yarn at rest, nodes that slide along it": lambda q, slope, draw: {"v0": q[14] * slope, "v1": q[15] * slope},
    "at rest but for one end": lambda q, slope, draw: {"v0": q[14] * slope},
    "nearly at rest": lambda q, slope, draw: {
        "v0": q[14] * slope * (1 + 10 ** draw.uniform(-16, 0, q.shape[1])), "v1": q[15] * slope * (1 + 1e-9),
    },
    "nothing slides": lambda q, slope, draw: {"w0": 0, "w1": 0},
    "equal velocities": lambda q, slope, draw: {"v1": q[8:11], "w1": q[14]},
    "nothing moves": lambda q, slope, draw: {"v0": 0, "v1": 0, "w0": 0, "w1": 0},
}  # fmt: skip


@pytest.mark.parametrize("state", HARD)
def test_kinetic_energy_keeps_its_digits_where_velocities_cancel(declarations: Declarations, state: str) -> None:
    """The target of ``accurate``, 16 u, without a word of condition; ``fast`` is held to that as well by the same rule."""
    draw = np.random.default_rng(8)
    q = draw.normal(size=(16, 60))
    q[7] = q[6] + draw.uniform(0.5, 2, 60)
    places = {"v0": slice(8, 11), "v1": slice(11, 14), "w0": 14, "w1": 15}
    for name, value in HARD[state](q.copy(), (q[3:6] - q[:3]) / (q[7] - q[6]), draw).items():
        q[places[name]] = value
    points = Points(q, {"rho": draw.uniform(0.1, 2, 60)})
    each = named(declarations, "kinetic")
    exact = truth(each, points)
    for output, found in zip("EGH", kinetic.evaluate(q, **points.parameters), strict=True):
        assert measure(output, found, exact, each.unknowns, "float64").worst_block.max() <= 16
    errors = measure("G", kernel("kinetic", "fast").gradient(q, **points.parameters), exact, each.unknowns, "float64")
    assert (errors.normwise <= allowed(np.nan_to_num(condition("G", each, points, exact)))).all()


@pytest.mark.parametrize("variant", ["accurate", "fast"])
def test_second_derivatives_of_the_kinetic_energy_are_in_lowest_terms(declarations: Declarations, variant: str) -> None:
    """What the chain rule adds and takes away again is gone, so that nothing is left that cancels whatever the state."""
    q, parameters = states("kinetic", 60)
    each = named(declarations, "kinetic")
    exact = truth(each, Points(q, parameters))
    errors = measure("H", kernel("kinetic", variant).hessian(q, **parameters), exact, each.unknowns, "float64")
    by_u = [at for at, block in enumerate(errors.blocks) if {"u0", "u1"} & set(block.split(","))]
    assert len(by_u) == 15 and errors.normwise[by_u].max() <= 16


@pytest.mark.parametrize("state", ["level", "ends opposite", "both"])
def test_weight_keeps_its_digits_at_any_height(declarations: Declarations, state: str) -> None:
    q, parameters = states("gravity", 200)
    draw = np.random.default_rng(9)
    if state != "level":
        q[3:6] = -q[:3] * (1 + 1e-12 * draw.normal(size=(3, 200)))
    if state != "ends opposite":
        middle, g = q[:3] + q[3:6], parameters["g"]
        g[2] = -(g[0] * middle[0] + g[1] * middle[1]) / middle[2]
    each = named(declarations, "gravity")
    exact = truth(each, Points(q, parameters))
    assert gravity.KERNEL.promise == "units"
    for output, found in zip("EGH", gravity.evaluate(q, **parameters), strict=True):
        assert measure(output, found, exact, each.unknowns, "float64").worst_block.max() <= 16


def test_weight_and_momentum() -> None:
    q = np.array([[0, 0, 0, 3, 0, 4, 1, 3, 1, 2, 3, 1, 2, 3, 0, 0]], float).T
    down = np.array([0, 0, -10.0])
    force = -gravity.gradient(q[:8], rho=0.5, g=down)[:, 0]
    assert force[:3] + force[3:6] == pytest.approx([0, 0, -10.0]) and force[6] == -force[7]
    assert gravity.energy(q[:8], rho=0.5, g=down)[0] == pytest.approx(0.5 * 2 * 10 * 2)
    momentum = kinetic.gradient(q, rho=0.5)[8:14, 0].reshape(2, 3).sum(axis=0)
    assert momentum == pytest.approx([1, 2, 3]) and kinetic.energy(q, rho=0.5)[0] == pytest.approx(7)


def test_yarn_sliding_along_a_straight_segment_has_no_kinetic_energy() -> None:
    q = np.array([[0, 0, 0, 3, 0, 4, 1, 3.5, 3, 0, 4, 3, 0, 4, 2.5, 2.5]], float).T
    e, g, h = kinetic.evaluate(q, rho=0.5)
    assert e[0] == 0 and not g.any()
    assert np.linalg.matrix_rank(h[8:, 8:, 0]) == 6
    assert np.linalg.eigvalsh(h[8:, 8:, 0]).min() > -1e-14


def test_obstacles_are_smooth_where_they_set_in() -> None:
    depth = np.array([-1e-3, -1e-12, 0, 1e-12, 1e-3])
    q = np.zeros((3, 5))
    q[2] = 1.5 - depth
    at_plane = plane.evaluate(q, k=3.0, n=(0, 0, 1), p=(7, 8, 0.5), R=1.0)
    at_sphere = sphere.evaluate(q, k=3.0, c=(0, 0, 0.5), R=1.0)
    inside = np.maximum(0, 1.5 - q[2])
    for e, g, h in (at_plane, at_sphere):
        assert e == pytest.approx(inside**3) and g[2] == pytest.approx(-3 * inside**2, rel=1e-9, abs=1e-30)
        assert h[2, 2] == pytest.approx(6 * inside, rel=1e-9, abs=1e-30)
        assert not e[:3].any() and not g[:, :3].any() and not h[..., :3].any()


def test_vector_parameters() -> None:
    q, _ = states("gravity", 3)
    single = gravity.energy(q, rho=1.0, g=(1, 2, 3))
    assert np.array_equal(single, gravity.energy(q, rho=1.0, g=np.tile([[1], [2], [3]], 3)))
    assert np.array_equal(single[1:2], gravity.energy(q[:, 1:2], rho=1.0, g=[1, 2, 3]))
    for wrong in (1.0, np.ones(2), np.ones((3, 2)), np.ones((2, 3))):
        with pytest.raises(ValueError, match=r"gravity: g must have shape \(3,\) or \(3, 3\), not"):
            gravity.energy(q, rho=1.0, g=wrong)
    with pytest.raises(ValueError, match=r"gravity: g_z = nan must be finite"):
        gravity.energy(q, rho=1.0, g=(0, 0, np.nan))
    with pytest.raises(TypeError, match=r"gravity: g_x must be real"):
        gravity.energy(q, rho=1.0, g=np.ones(3, complex))


def test_what_has_no_value_is_named() -> None:
    q, parameters = states("kinetic", 3)
    q[7, 1] = q[6, 1]
    with pytest.raises(ValueError, match="kinetic: element 1: u1 > u0 does not hold"):
        kinetic.energy(q, **parameters)
    assert list(np.isnan(kinetic.energy(q, **parameters, errors="mask"))) == [False, True, False]
    with pytest.raises(ValueError, match="sphere: element 0: the segment c-x0 has length zero"):
        sphere.energy(np.ones((3, 1)), k=1.0, c=(1, 1, 1), R=2.0)
