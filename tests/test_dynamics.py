"""Motion: the schemes against exact solutions, all terms of inertia against an independent Lagrangian, what must be kept."""

from collections import deque
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from yarnverify.errors import InputError
from yarnverify.kernels import bending, gravity, kinetic, parallel_contact, shear, stretch
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.dynamics import ORDERS, Dynamics, Motion
from yarnverify.simulation.fabric import bends, contacts, segments, shears, weave, yarn
from yarnverify.simulation.search import NotConverged
from yarnverify.simulation.state import load, save

G = np.array([0.0, 0.0, -9.81])
SCHEMES = tuple(ORDERS)


def last(states):
    return deque(states, maxlen=1)[0]


# -- one segment along its axis is a harmonic oscillator: node 0 held, mass rho l/3, stiffness k_s/l

LENGTH, K_S, RHO = 0.1, 0.02, 3e-4
OMEGA = np.sqrt(3 * K_S / RHO) / LENGTH
SWING = 0.01


def oscillator(scheme, held=None, **options):
    fabric = yarn(LENGTH, 1)
    terms = [Term(stretch, segments(fabric), {"k_s": K_S})]
    mass = Term(kinetic, segments(fabric, kinetic), {"rho": RHO})
    motion = Dynamics(fabric.Q, terms, fabric.positions([1], "x"), mass, scheme=scheme, held=held, **options)
    Q = fabric.Q.copy()
    Q[3] += SWING
    return motion, motion.start(Q)


def swung(scheme, h, steps):
    motion, start = oscillator(scheme)
    return np.array([state.Q[3] - LENGTH for state in motion.run(start, steps * h, h)])


def test_the_midpoint_rule_swings_with_its_exact_discrete_frequency():
    h = 0.5 / OMEGA
    k = np.arange(1, 61)
    assert swung("midpoint", h, 60) == pytest.approx(SWING * np.cos(2 * k * np.arctan(OMEGA * h / 2)), abs=1e-14)


def test_implicit_euler_damps_by_its_exact_factor():
    h = 0.5 / OMEGA
    k = np.arange(1, 31)
    assert swung("implicit_euler", h, 30) == pytest.approx(SWING * ((1 - 0.5j) ** -k).real, abs=1e-14)


def test_bdf2_follows_its_recurrence():
    h = 0.5 / OMEGA
    found, wanted = swung("bdf2", h, 30), [SWING * (1 + 0j), SWING / (1 - 0.5j)]
    while len(wanted) <= 30:  # q - i p of an oscillator turns by exp(i omega t)
        wanted.append((4 * wanted[-1] - wanted[-2]) / (3 - 2 * 0.5j))
    assert found == pytest.approx(np.real(wanted[1:]), abs=1e-14)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_order_against_the_exact_oscillation(scheme):
    end = 2.0 / OMEGA
    finest = {"implicit_euler": 320}.get(scheme, 80)
    error = [abs(swung(scheme, end / n, n)[-1] - SWING * np.cos(OMEGA * end)) for n in (finest // 2, finest)]
    assert np.log2(error[0] / error[1]) == pytest.approx(ORDERS[scheme], abs=0.1)


@pytest.mark.parametrize("scheme", ["midpoint", "bdf2"])
def test_order_where_an_end_is_moved(scheme):
    # y = q1 - q0 - l with q0 = a t^2/2:  m11 y'' + (k_s/l) y = -(m11 + m01) a,  m11 = rho l/3, m01 = rho l/6
    a, end = 0.01 * OMEGA**2, 2.0 / OMEGA

    def held(time, Q):
        Q[0] = a * time**2 / 2

    lag = SWING * np.cos(OMEGA * end) - RHO * LENGTH / 2 * a / (K_S / LENGTH) * (1 - np.cos(OMEGA * end))
    error = []
    for n in (40, 80):
        motion, start = oscillator(scheme, held)
        Q = last(motion.run(start, end, end / n)).Q
        error.append(abs(Q[3] - Q[0] - LENGTH - lag))
        assert Q[0] == pytest.approx(a * end**2 / 2, rel=1e-14)
    assert np.log2(error[0] / error[1]) == pytest.approx(2, abs=0.15)
    assert error[1] < 0.02 * SWING


# -- two segments over pulleys: nodes 1 and 3 held in place, yarn slides over them; a Lagrangian of its own

DENSE, SOFT, STIFF = 2e-4, 0.05, 2e-8
GAUSS = 0.5 + np.array([-1, 1]) / np.sqrt(12)  # exact for the square of a linear velocity


def over_pulleys():
    fabric = yarn(0.12, 4)
    Q = fabric.Q.copy()
    fabric.points(Q)[:] = [[0, 0, -0.029], [0, 0.002, 0], [0.03, 0, -0.003], [0.06, 0, 0], [0.063, 0, -0.029]]
    active = np.sort(np.r_[fabric.positions([0, 2, 4]), fabric.slides()[[0, 2]]])
    V = np.zeros_like(Q)
    V[active] = 0.1 * np.random.default_rng(1).normal(size=len(active))
    terms = [
        Term(stretch, segments(fabric), {"k_s": SOFT}),
        Term(bending, bends(fabric), {"k_b": STIFF}),
        Term(gravity, segments(fabric, gravity), {"rho": DENSE, "g": G}),
    ]
    return fabric, Q, V, active, terms, Term(kinetic, segments(fabric, kinetic), {"rho": DENSE})


def material_rates(Q):
    """Velocity of the material at two points of each of four segments, as a linear map of all rates; rest lengths."""
    x, u = Q[:15].reshape(5, 3), Q[15:]
    slope = np.diff(x, axis=0) / np.diff(u)[:, None]
    rates = np.zeros((4, 2, 3, 20), Q.dtype)
    for k in range(4):
        for i, part in enumerate(GAUSS):
            for node, weight in ((k, 1 - part), (k + 1, part)):
                rates[k, i, :, 3 * node : 3 * node + 3] = weight * np.eye(3)
                rates[k, i, :, 15 + node] = -weight * slope[k]
    return rates, np.diff(u)


def potential(Q):
    x, u = Q[:15].reshape(5, 3), Q[15:]
    edge, du = np.diff(x, axis=0), np.diff(u)
    size = np.sqrt((edge * edge).sum(1))
    angle = np.arccos((edge[1:] * edge[:-1]).sum(1) / (size[1:] * size[:-1]))
    weight = -DENSE / 2 * (du * ((x[1:] + x[:-1]) @ G)).sum()
    return (SOFT * du / 2 * (size / du - 1) ** 2).sum() + weight + STIFF * (angle**2 / (u[2:] - u[:-2])).sum()


def independent(end):
    """Unknowns at a time, from M qdd = dT/dq - dV/dq - Mdot qdot with derivatives by complex steps."""
    _, Q0, V0, active, _, _ = over_pulleys()
    tiny = 1e-30

    def mass(Q):
        rates, du = material_rates(Q)
        return DENSE / 2 * np.einsum("k,kgci,kgcj->ij", du, rates[..., active], rates[..., active])

    def moving(Q, V):
        rates, du = material_rates(Q)
        return DENSE / 4 * (du * ((rates @ V) ** 2).sum((1, 2))).sum()

    def slope(of, Q):
        return np.array([of(Q + 1j * tiny * (np.arange(20) == i)).imag / tiny for i in active])

    def rate(_, state):
        Q, V = Q0.copy(), np.zeros(20)
        Q[active], V[active] = np.split(state, 2)
        turning = mass(Q + 1j * tiny * V).imag / tiny @ V[active]
        force = slope(lambda q: moving(q, V), Q) - slope(potential, Q) - turning
        return np.r_[V[active], np.linalg.solve(mass(Q), force)]

    found = solve_ivp(rate, (0, end), np.r_[Q0[active], V0[active]], "DOP853", rtol=1e-9, atol=1e-11)
    return found.y[: len(active), -1]


@pytest.fixture(scope="module")
def pulled():
    return independent(0.01)


@pytest.mark.parametrize(("scheme", "steps"), [("midpoint", 25), ("bdf2", 60)])
def test_all_terms_of_sliding_inertia(scheme, steps, pulled):
    _, Q, V, active, terms, mass = over_pulleys()
    error = []
    for n in (steps, 2 * steps):
        motion = Dynamics(Q, terms, active, mass, scheme=scheme)
        found = last(motion.run(motion.start(Q, V), 0.01, 0.01 / n))
        error.append(np.abs(found.Q[active] - pulled).max())
    assert np.abs(pulled - Q[active])[[3, -1, -2]].min() > 2e-4  # the yarn does slide, by many times the error
    assert np.log2(error[0] / error[1]) == pytest.approx(2, abs=0.25)
    assert error[1] < 5e-5


def test_the_potential_of_the_independent_lagrangian_is_that_of_the_terms():
    _, Q, _, active, terms, mass = over_pulleys()
    motion = Dynamics(Q, terms, active, mass)
    assert motion.system.energy(Q) == pytest.approx(potential(Q), rel=1e-12)


# -- what must be kept


def loose(scheme, n=5):
    fabric = yarn(0.1, n)
    terms = [Term(stretch, segments(fabric), {"k_s": 1.0}), Term(bending, bends(fabric), {"k_b": 1e-6})]
    motion = Dynamics(
        fabric.Q, terms, fabric.positions(), Term(kinetic, segments(fabric, kinetic), {"rho": 1e-4}), scheme=scheme
    )
    random = np.random.default_rng(0)
    Q, V = fabric.Q.copy(), np.zeros(fabric.size)
    fabric.points(Q)[:] += 2e-3 * random.normal(size=(n + 1, 3))
    fabric.points(V)[:] = 0.3 * random.normal(size=(n + 1, 3)) + [1, 2, 3]
    return fabric, motion, motion.start(Q, V)


def momenta(fabric, state):
    x, p = fabric.points(state.Q), fabric.points(state.P)
    return p.sum(0), np.cross(x, p).sum(0)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_momenta_in_free_flight(scheme):
    fabric, motion, start = loose(scheme)
    linear, angular = momenta(fabric, start)
    end = last(motion.run(start, 0.05, 5e-4))
    now = momenta(fabric, end)
    assert np.abs(now[0] - linear).max() < 1e-12 * np.abs(linear).max()
    off = np.abs(now[1] - angular).max() / np.abs(angular).max()
    assert off < 2e-12 if scheme == "midpoint" else off > 1e-7  # the others do not keep it, and the test would see that
    centre = fabric.points(end.Q - start.Q)
    ends = np.r_[0.5, np.ones(4), 0.5] / 5
    assert ends @ centre == pytest.approx(0.05 * linear / 1e-5, rel=1e-9)  # a yarn of 0.1 m and 1e-4 kg/m


def test_energy_without_trend():
    fabric = yarn(LENGTH, 1)
    terms = [
        Term(stretch, segments(fabric), {"k_s": K_S}),
        Term(gravity, segments(fabric, gravity), {"rho": RHO, "g": G}),
    ]
    mass = Term(kinetic, segments(fabric, kinetic), {"rho": RHO})

    def energies(scheme, steps, h=0.02):
        motion = Dynamics(fabric.Q, terms, fabric.positions([1], "xz"), mass, scheme=scheme)
        return np.array([state.energy for state in motion.run(motion.start(fabric.Q), steps * h, h)])

    found = energies("midpoint", 400)
    parts = found.reshape(10, -1)
    spread = found.max() - found.min()
    assert spread > 0
    trend = np.polyfit(np.arange(10), parts.mean(1), 1)[0] * 10
    assert abs(trend) < 0.05 * spread
    damped = energies("implicit_euler", 40)
    assert damped[-1] < damped[0] - spread  # the test would see a drift


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("sliding", [False, True])
def test_a_cloth_without_load_stays_where_it_is(scheme, sliding):
    cloth = weave("twill 2/2", size=(4, 5), L=1e-3, R=0.2e-3)
    terms = [
        Term(stretch, segments(cloth), {"k_s": 100.0}),
        Term(bending, bends(cloth), {"k_b": 1e-9}),
        Term(shear, shears(cloth), {"k_x": 1e-3}),
        Term(parallel_contact, contacts(cloth), {"k_c": 1e3}),
    ]
    active = np.r_[cloth.positions(), cloth.slides()] if sliding else cloth.positions()
    mass = Term(kinetic, segments(cloth, kinetic), {"rho": 1e-4})
    motion = Dynamics(cloth.Q, terms, active, mass, scheme=scheme)
    end = last(motion.run(motion.start(cloth.Q), 0.2, 0.02))
    assert np.abs(end.Q - cloth.Q).max() <= 1e-14 * cloth.L
    assert end.energy <= 1e-28


def test_rigid_motion_costs_no_energy():
    fabric, motion, _ = loose("midpoint")
    V = np.zeros(fabric.size)
    fabric.points(V)[:] = [1.0, -2.0, 0.5]
    end = last(motion.run(motion.start(fabric.Q, V), 0.01, 1e-3))
    assert fabric.points(end.Q - fabric.Q) == pytest.approx(np.tile([0.01, -0.02, 0.005], (6, 1)), abs=1e-16 * 100)
    assert end.potential < 1e-26 * end.kinetic


# -- steps


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_estimate_is_the_error_of_a_step(scheme):
    motion, start = oscillator(scheme)
    tolerance = 1e-5 if scheme == "implicit_euler" else 3e-7
    states = [start, *motion.run(start, 1.5 / OMEGA, 0.05 / OMEGA, tolerance)]
    assert states[-1].time == 1.5 / OMEGA
    ratio = []
    for before, after in list(pairwise(states[3:]))[::3]:
        length = after.time - before.time
        exact = before
        for part in np.full(16, length / 16):  # what the step should have found, from where it started
            exact = motion.step(exact, part)
        ratio.append(np.abs(after.Q - exact.Q).max() / after.error)
    assert max(state.error for state in states) <= tolerance
    assert 0.3 < np.median(ratio) < 3


@pytest.mark.parametrize("scheme", SCHEMES)
def test_error_follows_the_tolerance(scheme):
    end, errors = 2.0 / OMEGA, []
    for tolerance in (3e-5, 1e-6) if scheme == "implicit_euler" else (1e-6, 3e-8):
        motion, start = oscillator(scheme)
        found = last(motion.run(start, end, 0.5 / OMEGA, tolerance))
        errors.append(abs(found.Q[3] - LENGTH - SWING * np.cos(OMEGA * end)))
    order = ORDERS[scheme]  # steps of error tolerance have a length like tolerance^(1/(p+1)), their sum has h^p
    assert np.log(errors[0] / errors[1]) / np.log(30) == pytest.approx(order / (order + 1), abs=0.2)


def test_steps_that_are_too_long_are_made_again():
    motion, start = oscillator("midpoint")
    first = next(motion.run(start, 100.0, 50 / OMEGA, 1e-6))
    assert first.rejected > 0
    assert first.time < 1 / OMEGA


def test_the_last_step_ends_at_the_end():
    motion, start = oscillator("bdf2")
    times = [state.time for state in motion.run(start, 1.0, 0.3)]
    assert times == [0.3, 0.6, pytest.approx(0.9, abs=1e-15), 1.0]
    times = [state.time for state in motion.run(start, 1.0, 0.1)]
    assert times == [pytest.approx(k / 10, abs=2e-16) for k in range(1, 11)]
    assert times[-1] == 1.0
    assert list(motion.run(start, 0.0, 0.1)) == []


def test_times_do_not_drift():
    state = Motion(0.0, *(np.zeros(1),) * 3, 0.0, 0.0, 0.0, 0.0, np.zeros(1), np.zeros(1))
    from yarnverify.simulation.dynamics import _later

    time, lost = 0.0, 0.0
    for _ in range(100_000):
        time, lost = _later(Motion(time, *(state.Q,) * 3, 0.0, 0.0, 0.0, 0.0, state.Q, state.Q, lost=lost), 1e-5)
    assert time == 100_000 * 1e-5


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("tolerance", [None, 1e-4])
def test_a_run_taken_up_again_has_the_same_bits(scheme, tolerance, tmp_path):
    _, Q, V, active, terms, mass = over_pulleys()

    def begun():
        return Dynamics(Q, terms, active, mass, scheme=scheme)

    motion = begun()
    whole = list(motion.run(motion.start(Q, V), 4e-3, 3e-4, tolerance))
    save(tmp_path / "state.npz", **whole[3].arrays())
    found = last(begun().run(Motion.of(load(tmp_path / "state.npz")), 4e-3, 3e-4, tolerance))
    for name, value in whole[-1].arrays().items():
        assert np.asarray(value).tobytes() == np.asarray(getattr(found, name)).tobytes(), name


def test_a_long_step_of_a_cloth_that_slides_and_falls() -> None:
    """From rest, flat: Newton's full steps leave it for good, and the step is found by way of frozen inertia."""
    cloth = weave("plain", size=(4, 4), L=1e-3, R=0.15e-3, tails=1e-3)
    terms = [
        Term(stretch, segments(cloth), {"k_s": 50.0}),
        Term(bending, bends(cloth), {"k_b": 1e-9}),
        Term(shear, shears(cloth), {"k_x": 1e-3}),
        Term(gravity, segments(cloth, gravity), {"rho": 2e-5, "g": G}),
    ]
    corners = cloth.positions([cloth.node(0, -1), cloth.node(-1, -1)])
    free = np.r_[np.setdiff1d(cloth.positions(), corners), cloth.slides()]
    mass = Term(kinetic, segments(cloth, kinetic), {"rho": 2e-5})
    motion = Dynamics(cloth.Q, terms, free, mass, scheme="implicit_euler")
    start = motion.start(cloth.Q)
    step = motion._increment(start, 5e-3)
    with pytest.raises(NotConverged):
        step._newton(start.Q, None, 30)
    end = motion.step(start, 5e-3)
    left, size = step.residual(end.Q)
    assert np.abs(left).max() < 1e-6 * size  # rounding of positions times 5e4 N/m
    fallen = (end.Q - cloth.Q)[cloth.position(cloth.node(1, 0))[0, 2]]
    assert (
        -1.5 * 9.81 * 5e-3**2 * 1.1 < fallen < -1e-5
    )  # the scheme's free fall is g h^2; the edge swings about the corners


# -- what goes wrong


def test_a_step_that_fails_says_where_and_leaves_the_state_before_it():
    _, Q, V, active, terms, mass = over_pulleys()
    motion = Dynamics(Q, terms, active, mass, scheme="implicit_euler")
    states = []
    with pytest.raises(
        NotConverged,
        match=r"step of 1e\+20 s from time 0\.0002 s has no end, a shorter one may have: .*worst element: \w+ \d",
    ) as error:
        for state in motion.run(motion.start(Q, V), 2e-4, 1e-4):
            states.append(state)
        motion.step(states[-1], 1e20)
    assert [state.steps for state in states] == [1, 2]
    assert error.value.history
    assert np.isfinite(motion.step(states[-1], 1e-4).Q).all()


def test_no_step_is_small_enough_where_the_state_is_bad():
    fabric = yarn(0.1, 2)
    terms = [Term(bending, bends(fabric), {"k_b": 1e-6})]
    mass = Term(kinetic, segments(fabric, kinetic), {"rho": 1e-4})
    motion = Dynamics(fabric.Q, terms, fabric.positions([2]), mass)
    Q = fabric.Q.copy()
    Q[6:9] = [0.02, 0.0, 0.0]  # folded: the energy is finite, but has no derivative
    start = motion.start(Q)
    with pytest.raises(
        NotConverged, match=r"step of 0.001 s from time 0 s has no end, a shorter one may have: .*theta is pi"
    ):
        motion.step(start, 1e-3)
    with pytest.raises(NotConverged, match=r"no step from time 0 s .* error below 1e-06 m"):
        next(motion.run(start, 1.0, 1e-3, 1e-6))


def test_bad_input_is_named():
    motion, start = oscillator("midpoint")
    for h in (0.0, -1e-3, np.nan, np.inf):
        with pytest.raises(InputError, match=r"^h = .* must be positive"):
            motion.step(start, h)
        with pytest.raises(InputError, match=r"^h = .* must be positive"):
            next(motion.run(start, 1.0, h))
    with pytest.raises(InputError, match=r"tolerance = 0\.0 must be positive"):
        next(motion.run(start, 1.0, 0.1, 0.0))
    with pytest.raises(InputError, match="until = nan"):
        next(motion.run(start, np.nan, 0.1))
    with pytest.raises(InputError, match=r"8 finite numbers V, not \(3,\)"):
        motion.start(start.Q, np.zeros(3))
    with pytest.raises(InputError, match="numbers Q"):
        motion.start(np.full(8, np.nan))
    with pytest.raises(InputError, match="implicit_euler, midpoint, bdf2, not 'rk4'"):
        oscillator("rk4")
