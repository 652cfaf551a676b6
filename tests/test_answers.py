"""Exact answers, each against something computed another way: mpmath, integration, or the forces of the kernels."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

from yarnverify.kernels import bending, gravity, kinetic, parallel_contact, shear, stretch
from yarnverify.simulation import answers

ALPHAS = [1e-9, 1e-3, 0.3, 1.0, 1.19, 1.21, 2.0, 5.0, 10.0, 14.9, 15.1, 40.0, 200.0]


# -- elastica ---------------------------------------------------------------------------------------------------------


def elliptic(alpha: float) -> tuple[Any, Any, Any]:
    """The formulas of the elastica as they are printed, with 60 digits, the root by bisection."""
    with mpmath.workdps(60):

        def modulus(y: Any) -> Any:
            return (1 + 1 / (1 + mpmath.exp(-y))) / 2

        def parts(m: Any) -> tuple[Any, Any]:
            p = mpmath.asin(1 / mpmath.sqrt(2 * m))
            return mpmath.ellipk(m) - mpmath.ellipf(p, m), mpmath.ellipe(m) - mpmath.ellipe(p, m)

        low, high = mpmath.mpf(-60), mpmath.mpf(60)
        root = mpmath.sqrt(mpmath.mpf(alpha))
        for _ in range(170):
            middle = (low + high) / 2
            low, high = (middle, high) if parts(modulus(middle))[0] < root else (low, middle)
        m = modulus(low)
        sine = 2 * m - 1
        return mpmath.asin(sine), mpmath.sqrt(2 * sine) / root, 1 - 2 * parts(m)[1] / root


@pytest.mark.parametrize("alpha", ALPHAS)
def test_elastica_agrees_with_elliptic_integrals_of_many_digits(alpha: float) -> None:
    tip = answers.elastica(alpha)
    for found, true in zip((tip.angle, tip.along, tip.deflection), elliptic(alpha), strict=True):
        assert found == pytest.approx(float(true), rel=4e-15)


def test_elastica_of_the_literature() -> None:
    """Bisshopp and Drucker (1945); Mattiasson, Int. J. Numer. Methods Eng. 17 (1981), 145, table for 1, 2, 5, 10."""
    table = {1.0: (0.30172, 0.05643), 2.0: (0.49346, 0.16064), 5.0: (0.71379, 0.38763), 10.0: (0.81061, 0.55500)}
    for alpha, (across, shortening) in table.items():
        tip = answers.elastica(alpha)
        assert (round(tip.deflection, 5), round(1 - tip.along, 5)) == (across, shortening)


def test_elastica_of_a_small_load_is_linear() -> None:
    tip = answers.elastica(1e-7)
    assert tip.deflection == pytest.approx(1e-7 / 3, rel=1e-13) and tip.angle == pytest.approx(5e-8, rel=1e-13)
    assert answers.elastica(1e5).deflection == pytest.approx(1 - 2 * (1 - math.sqrt(0.5)) / math.sqrt(1e5), rel=1e-12)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_elastica_shape_agrees_with_the_differential_equation(alpha: float) -> None:
    """Integrated backwards from the tip, where a deviation from the vertical grows with the rod and keeps its digits."""
    s = np.linspace(0, 1, 9)
    theta, place = answers.elastica_shape(alpha, s)
    tip = answers.elastica(alpha)

    def slope(t: float, y: Any) -> list[float]:
        return [y[1], alpha * math.sin(y[0]), math.sin(y[0]), math.cos(y[0])]

    start = math.pi / 2 - tip.angle
    found = solve_ivp(slope, (0, 1), [start, 0, 0, 0], "DOP853", rtol=1e-13, atol=1e-15, t_eval=1 - s[::-1]).y[:, ::-1]
    near = 1e-12 + 3e-16 * math.exp(math.sqrt(alpha))  # what the last digit of the tip's angle grows to
    assert theta == pytest.approx(np.pi / 2 - found[0], abs=near)
    assert place == pytest.approx((found[2:, :1] - found[2:]).T, abs=near)
    assert place[0] == pytest.approx([0, 0], abs=1e-15) and abs(theta[0]) < 1e-12
    assert [*place[-1], theta[-1]] == pytest.approx([tip.along, tip.deflection, tip.angle], rel=1e-13)


def test_elastica_shape_takes_any_shape_of_arc_lengths() -> None:
    for alpha in (0.1, 3.0, 100.0):
        theta, place = answers.elastica_shape(alpha, [[0.2, 1.0], [0.2, 0.0]])
        single, spot = answers.elastica_shape(alpha, 0.2)
        assert theta.shape == (2, 2) and place.shape == (2, 2, 2) and single.shape == () and spot.shape == (2,)
        assert theta[0, 0] == theta[1, 0] == pytest.approx(float(single), rel=1e-13) and place[1, 0] == pytest.approx(
            spot
        )


@pytest.mark.parametrize("alpha", [0.0, -1.0, math.inf, math.nan, 1e6])
def test_elastica_refuses(alpha: float) -> None:
    with pytest.raises(ValueError, match="alpha = P L"):
        answers.elastica(alpha)


# -- heavy cantilever -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("beta", "alpha"), [(0.5, 0.0), (10.0, 0.0), (60.0, 0.0), (5.0, 3.0), (0.0, 10.0)])
def test_a_heavy_cantilever_started_from_its_tip_reaches_the_wall_level(beta: float, alpha: float) -> None:
    found = answers.cantilever(beta, alpha)
    assert found.residual < 1.01e-11

    def slope(t: float, y: Any) -> list[float]:
        return [y[1], (alpha + beta * t) * math.sin(y[0]), math.sin(y[0]), math.cos(y[0])]

    start = [math.pi / 2 - found.tip.angle, 0, 0, 0]
    wall = solve_ivp(slope, (0, 1), start, "DOP853", rtol=1e-13, atol=1e-16).y[:, -1]
    assert wall[0] == pytest.approx(math.pi / 2, abs=1e-12 * (1 + beta))
    assert [found.tip.along, found.tip.deflection] == pytest.approx(wall[2:], abs=1e-11)
    theta, place = found.at([0, 1])
    assert [*theta, *place[1]] == pytest.approx([0, found.tip.angle, found.tip.along, found.tip.deflection], abs=1e-14)


def test_a_cantilever_without_weight_is_the_elastica_and_a_light_one_is_linear() -> None:
    found, wanted = answers.cantilever(0.0, 10.0).tip, answers.elastica(10.0)
    assert (found.angle, found.along, found.deflection) == pytest.approx(
        (wanted.angle, wanted.along, wanted.deflection), abs=1e-13
    )
    assert answers.cantilever(1e-4).tip.deflection == pytest.approx(1e-4 / 8, rel=1e-8)
    with pytest.raises(ValueError, match="is not solved"):
        answers.cantilever(100.0, tolerance=1e-13)


# -- chains -----------------------------------------------------------------------------------------------------------


def chain_state(points: Any, rest: Any) -> Any:
    """Elements (8, n) of a chain in the plane x, z, for the kernels of segments."""
    u = np.concatenate([[0], np.cumsum(rest)])
    x = np.stack([points[:, 0], 0 * u, points[:, 1]])
    return np.concatenate([x[:, :-1], x[:, 1:], u[None, :-1], u[None, 1:]])


def unbalanced(points: Any, rest: Any, *, k_s: float, rho: float, g: float) -> Any:
    """Forces on all nodes from stretch and gravity, (3, n + 1)."""
    q = chain_state(points, rest)
    force = -stretch.gradient(q, k_s=k_s) - gravity.gradient(q, rho=rho, g=(0, 0, -g))
    total = np.zeros((3, len(points)))
    total[:, :-1] += force[:3]
    total[:, 1:] += force[3:6]
    return total


YARN = {"k_s": 250.0, "rho": 1e-4, "g": 9.81}


def test_a_hanging_chain_is_in_balance() -> None:
    rest = np.array([0.3, 0.1, 0.25, 0.05])
    chain = answers.hanging_chain(rest, tip_force=2e-3, **YARN)
    forces = unbalanced(chain.points, rest, **YARN)
    assert forces[:, 1:-1] == pytest.approx(0, abs=1e-15 * 250) and forces[2, -1] == pytest.approx(2e-3, rel=1e-9)
    assert -forces[2, 0] == pytest.approx(YARN["rho"] * 9.81 * 0.7 + 2e-3, rel=1e-9)
    assert chain.tension[0] == pytest.approx(YARN["rho"] * 9.81 * 0.55 + 2e-3)


@pytest.mark.parametrize("segments", [1, 7, 100])
def test_a_hanging_chain_sinks_as_far_as_the_continuous_yarn(segments: int) -> None:
    soft = {"k_s": 0.5, "rho": 0.1, "g": 9.81}
    chain = answers.hanging_chain(np.full(segments, 2.0 / segments), tip_force=0.1, **soft)
    for at in (0, segments // 2, segments):
        sunk = answers.hanging_elongation(2.0, tip_force=0.1, at=at / segments, **soft)
        assert -chain.points[at, 1] == pytest.approx(2.0 * at / segments + sunk, rel=1e-13)
    assert answers.hanging_elongation(2.0, **soft) == pytest.approx(0.1 * 9.81 * 4 / (2 * 0.5))


@pytest.mark.parametrize(
    ("length", "span", "rise"),
    [
        (1.0, 0.8, 0.0),
        (1.0, 1 - 1e-9, 0.0),
        (1.0, 1e-3, 0.0),
        (5.0, 2.0, 1.5),
        (5.0, 2.0, -4.0),
        (1.0, 0.6, 0.8 - 1e-6),
    ],
)
def test_a_catenary_has_its_length_and_ends(length: float, span: float, rise: float) -> None:
    found = answers.catenary(length, span, rise)
    with mpmath.workdps(40):
        a, low = mpmath.mpf(found.a), mpmath.mpf(found.low)
        reach = a * (mpmath.sinh((span - low) / a) + mpmath.sinh(low / a))
        height = a * (mpmath.cosh((span - low) / a) - mpmath.cosh(low / a))
    ends = found.at([0.0, length])
    stiff = 1 / (1 - math.hypot(span, rise) / length)  # of a taut yarn the last digit of the length moves the sag far
    assert float(reach) == pytest.approx(length, rel=1e-14 + 1e-15 * stiff * (rise != 0))
    assert float(height) == pytest.approx(rise, abs=1e-13 + 1e-15 * stiff)
    assert ends == pytest.approx(np.array([[0, 0], [span, rise]]), abs=1e-12 + 1e-15 * stiff)


def test_a_catenary_agrees_with_its_differential_equation() -> None:
    found = answers.catenary(3.0, 2.0, 0.7)
    start = math.sinh(-found.low / found.a)

    def slope(s: float, y: Any) -> list[float]:  # tangent of the angle grows by s/a
        rise = start + s / found.a
        return [1 / math.hypot(1, rise), rise / math.hypot(1, rise)]

    s = np.linspace(0, 3, 7)
    way = solve_ivp(slope, (0, 3), [0, 0], "DOP853", rtol=1e-13, atol=1e-15, t_eval=s).y.T
    assert way[-1] == pytest.approx([2.0, 0.7], abs=1e-12) and found.at(s) == pytest.approx(way, abs=1e-12)
    assert found.y(found.at(s)[:, 0]) == pytest.approx(way[:, 1], abs=1e-12)
    assert found.sag == pytest.approx(-float(found.y(found.low)), rel=1e-12)


@pytest.mark.parametrize(
    ("length", "span", "rise"), [(1.0, 1.0, 0.0), (1.0, 0.6, 0.8), (1.0, 0.0, 0.5), (1.0, -1.0, 0.0)]
)
def test_a_catenary_refuses(length: float, span: float, rise: float) -> None:
    with pytest.raises(ValueError, match=r"does not reach|must be apart"):
        answers.catenary(length, span, rise)


@pytest.mark.parametrize(
    ("k_s", "span", "rise"), [(2.0, 0.8, 0.0), (2.0, 1.3, 0.2), (1e3, 0.5, -0.3), (1e6, 0.9, 0.0), (1e3, 1.0005, 0.0)]
)
def test_a_hung_chain_is_in_balance(k_s: float, span: float, rise: float) -> None:
    yarn = {"k_s": k_s, "rho": 0.01, "g": 9.81}
    rest = np.array([0.05, 0.1, 0.15, 0.1, 0.1, 0.2, 0.1, 0.05, 0.1, 0.05])
    chain = answers.hung_chain(rest, span=span, rise=rise, **yarn)
    assert chain.points[-1] == pytest.approx([span, rise], abs=1e-13)
    forces = unbalanced(chain.points, rest, **yarn)[:, 1:-1]
    assert forces == pytest.approx(0, abs=k_s * 1e-13)
    edges = np.diff(chain.points, axis=0)
    assert chain.tension == pytest.approx(k_s * (np.linalg.norm(edges, axis=1) / rest - 1), abs=k_s * 1e-13)


def test_a_stiff_chain_of_short_segments_is_a_catenary() -> None:
    gaps = []
    for segments in (20, 40, 80):
        chain = answers.hung_chain(np.full(segments, 1.2 / segments), span=1.0, rise=0.1, k_s=1e9, rho=0.01, g=9.81)
        exact = answers.catenary(1.2, 1.0, 0.1).at(np.linspace(0, 1.2, segments + 1))
        gaps.append(np.abs(chain.points - exact).max())
    assert gaps[0] / gaps[1] == pytest.approx(4, rel=0.02) and gaps[1] / gaps[2] == pytest.approx(4, rel=0.02)


def test_tension_is_equal_where_a_yarn_has_slid() -> None:
    split = answers.sliding_split(0.3, 0.5, 0.7)
    one = stretch.gradient(np.array([[0, 0, 0, 0.3, 0, 0, 0, split]]).T, k_s=3.0)[7, 0]
    other = stretch.gradient(np.array([[0, 0, 0, 0.5, 0, 0, split, 0.7]]).T, k_s=3.0)[6, 0]
    assert one + other == pytest.approx(0, abs=1e-15)


# -- arcs, rings, buckling, vibrations --------------------------------------------------------------------------------


@pytest.mark.parametrize("corners", [3, 4, 17])
def test_every_regular_polygon_holds_the_energy_of_the_ring(corners: int) -> None:
    length = 0.4
    turn = 2 * np.pi * np.arange(corners) / corners
    points = np.stack([np.cos(turn), np.sin(turn), 0 * turn])
    u = np.tile([[length / corners], [-length / corners]], corners)
    q = np.concatenate([points, np.roll(points, -1, axis=1), np.roll(points, 1, axis=1), u])
    assert bending.energy(q, k_b=3e-6).sum() == pytest.approx(answers.ring_energy(3e-6, length), rel=1e-13)


def test_an_end_moment_bends_an_arc() -> None:
    angle, place = answers.arc(2.0, k_b=4.0, length=3.0, s=[0.0, 0.5, 1.0])
    assert angle == pytest.approx([0, 0.75, 1.5])
    assert place == pytest.approx(2.0 * np.stack([np.sin(angle), 1 - np.cos(angle)], axis=-1))
    assert answers.arc(1e-9, k_b=1.0, length=1.0)[1] == pytest.approx([1, 5e-10])


def beam(segments: int, length: float, k_b: float, k_s: float, load: float, rho: float) -> tuple[Any, Any]:
    """Hessian and mass matrix across of a straight pinned chain that is pressed by a load, from the kernels."""
    h = length / segments
    x = np.arange(segments + 1) * h * (1 - load / k_s)
    points = np.stack([x, 0 * x, 0 * x])
    u = np.arange(segments + 1) * h
    ends = np.concatenate([points[:, :-1], points[:, 1:], u[None, :-1], u[None, 1:]])
    turns = np.concatenate([points[:, 1:-1], points[:, 2:], points[:, :-2], u[None, 2:], u[None, :-2]])
    moving = np.concatenate([ends, np.zeros((8, segments))])
    stiffness, mass = np.zeros((2, segments + 1, segments + 1))
    for i, block in enumerate(np.moveaxis(stretch.hessian(ends, k_s=k_s), -1, 0)):
        stiffness[i : i + 2, i : i + 2] += block[np.ix_([1, 4], [1, 4])]
    for i, block in enumerate(np.moveaxis(kinetic.hessian(moving, rho=rho), -1, 0)):
        mass[i : i + 2, i : i + 2] += block[np.ix_([9, 12], [9, 12])]
    for i, block in enumerate(np.moveaxis(bending.hessian(turns, k_b=k_b), -1, 0)):
        at = np.array([i + 1, i + 2, i])
        stiffness[np.ix_(at, at)] += block[np.ix_([1, 4, 7], [1, 4, 7])]
    return stiffness[1:-1, 1:-1], mass[1:-1, 1:-1]


@pytest.mark.parametrize("segments", [2, 3, 20])
@pytest.mark.parametrize("k_s", [1e7, 200.0])
def test_a_chain_buckles_where_its_stiffness_vanishes(segments: int, k_s: float) -> None:
    load = answers.buckling_load(2.0, 1.5, k_s=k_s, segments=segments)
    least = [np.linalg.eigvalsh(beam(segments, 1.5, 2.0, k_s, share * load, 1.0)[0])[0] for share in (0.999, 1, 1.001)]
    assert least[0] > 0 > least[2] and abs(least[1]) < 1e-6 * least[0]


def test_buckling_loads() -> None:
    euler = answers.buckling_load(2.0, 1.5)
    assert euler == pytest.approx(np.pi**2 * 2 / 2.25, rel=1e-15)
    many = [euler - answers.buckling_load(2.0, 1.5, segments=n) for n in (50, 100)]
    assert many[0] / many[1] == pytest.approx(4, rel=1e-3)
    factors = [
        answers.buckling_load(2.0, 1.5, ends=ends) / euler for ends in ("clamped", "clamped-free", "clamped-pinned")
    ]
    assert factors == pytest.approx([4, 0.25, 2.04574852], rel=1e-8)
    soft = answers.buckling_load(2.0, 1.5, k_s=100.0)
    assert soft * (1 - soft / 100) == pytest.approx(euler)
    with pytest.raises(ValueError, match="shortens without buckling"):
        answers.buckling_load(2.0, 1.5, k_s=30.0)
    with pytest.raises(ValueError, match="pinned ends"):
        answers.buckling_load(2.0, 1.5, ends="clamped", segments=3)


@pytest.mark.parametrize("load", [1 + 1e-6, 1.1, 1.5, 2.18, 5.0, 30.0])
def test_a_buckled_strut_agrees_with_its_differential_equation(load: float) -> None:
    angle, span, across = answers.buckled(load)
    pull = np.pi**2 * load

    def slope(s: float, y: Any) -> list[float]:
        return [y[1], -pull * math.sin(y[0]), math.cos(y[0]), math.sin(y[0])]

    found = solve_ivp(slope, (0, 1), [angle, 0, 0, 0], "DOP853", rtol=1e-13, atol=1e-16, t_eval=[0.5, 1]).y
    assert found[0] == pytest.approx([0, -angle], abs=1e-9) and found[3] == pytest.approx([across, 0], abs=1e-9)
    assert found[2] == pytest.approx([span / 2, span], abs=1e-9)


def test_a_strut_below_its_load_is_straight() -> None:
    with pytest.raises(ValueError, match="is straight"):
        answers.buckled(1.0)


@pytest.mark.parametrize("segments", [2, 5, 24])
@pytest.mark.parametrize("tension", [0.0, 3.0])
def test_frequencies_of_a_chain_are_those_of_its_matrices(segments: int, tension: float) -> None:
    yarn = {"k_b": 2.0, "rho": 0.3, "length": 1.5}
    stiffness, mass = beam(segments, 1.5, 2.0, 1e9, -tension, 0.3)
    for kind, m in (("consistent", mass), ("lumped", np.eye(segments - 1) * 0.3 * 1.5 / segments)):
        true = np.sqrt(eigh(stiffness, m, eigvals_only=True)) / (2 * np.pi)
        modes = [
            answers.frequency(n + 1, segments=segments, tension=tension, mass=kind, **yarn) for n in range(segments - 1)
        ]
        assert modes == pytest.approx(true, rel=1e-8)


def test_frequencies_of_a_beam() -> None:
    yarn = {"k_b": 2.0, "rho": 0.3, "length": 1.5}
    exact = answers.frequency(3, **yarn)
    assert exact == pytest.approx(9 * np.pi / (2 * 1.5**2) * np.sqrt(2.0 / 0.3), rel=1e-15)
    fast, slow = (answers.frequency(3, segments=200, mass=mass, **yarn) - exact for mass in ("consistent", "lumped"))
    assert fast == pytest.approx(-slow, rel=1e-2) or (fast > slow)
    with pytest.raises(ValueError, match="has modes 1 to 3"):
        answers.frequency(4, segments=4, **yarn)


# -- cloth ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("delta", [-0.02, 1e-9, 0.01, 0.035])
def test_a_picture_frame_pulls_as_its_energy_changes(delta: float) -> None:
    side, crossings, stiffness = 0.1, 81, {"k_x": 0.02, "L": 1e-3}

    def energy(delta: float) -> float:
        half = math.acos(math.sqrt(0.5) + delta / (2 * side))  # the bars and the diagonal
        warp = [math.cos(half), math.sin(half), 0]
        weft = [math.cos(half), -math.sin(half), 0]
        signs = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
        q = np.array([[0, 0, 0, *(a * np.array(warp)), *(b * np.array(weft))] for a, b in signs]).T
        return crossings * float(shear.energy(q, **stiffness).sum())

    gamma, force = answers.picture_frame(delta, side=side, crossings=crossings, **stiffness)
    assert gamma == pytest.approx(math.pi / 2 - 2 * math.acos(math.sqrt(0.5) + delta / (2 * side)), abs=1e-14)
    step = 1e-5
    assert force == pytest.approx((energy(delta + step) - energy(delta - step)) / (2 * step), rel=1e-5, abs=1e-9)
    assert math.copysign(1, gamma) == math.copysign(1, delta) == math.copysign(1, force)


def test_small_shear_keeps_its_digits() -> None:
    gamma, _ = answers.picture_frame(1e-13, side=0.1, crossings=1, k_x=1.0, L=1.0)
    assert gamma == pytest.approx(math.sqrt(2) * 1e-12, rel=1e-11)
    assert answers.bias_extension(1e-13, height=0.3, width=0.1) == pytest.approx((1e-12, 5e-13), rel=1e-11)


def test_bias_extension() -> None:
    central, side = answers.bias_extension(0.05, height=0.3, width=0.1)
    assert (
        central == pytest.approx(math.pi / 2 - 2 * math.acos(0.25 / (math.sqrt(2) * 0.2)), rel=1e-14)
        and side == central / 2
    )
    with pytest.raises(ValueError, match="twice its width"):
        answers.bias_extension(0.01, height=0.15, width=0.1)
    with pytest.raises(ValueError, match="cannot be deformed so far"):
        answers.bias_extension(0.1, height=0.3, width=0.1)
    with pytest.raises(ValueError, match="cannot be deformed so far"):
        answers.picture_frame(0.06, side=0.1, crossings=1, k_x=1.0, L=1.0)


def test_contact_balances_the_force_that_presses() -> None:
    gap = answers.contact_gap(3e-3, k_c=50.0, L=1e-3, d=0.8)
    pressed = parallel_contact.gradient(np.array([[0.0, gap]]).T, k_c=50.0, L=1e-3, d=0.8)
    assert pressed[:, 0] == pytest.approx([3e-3, -3e-3], rel=1e-12)
    assert answers.contact_gap(0.0, k_c=50.0, L=1e-3, d=0.8) == 0.8
    with pytest.raises(ValueError, match="does not pull"):
        answers.contact_gap(-1.0, k_c=50.0, L=1e-3, d=0.8)
