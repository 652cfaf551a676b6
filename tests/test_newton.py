"""Equilibria: few steps where yarns hardly stretch, the stable one of several, and an error where there is none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from yarnverify.kernels import ElementError, bending, gravity, stretch
from yarnverify.simulation import newton
from yarnverify.simulation.answers import buckled, buckling_load, elastica, hanging_chain, hung_chain
from yarnverify.simulation.assembly import System
from yarnverify.simulation.fabric import Fabric, bends, segments, weave, yarn
from yarnverify.simulation.linear import LinearSolveError
from yarnverify.simulation.newton import NotConverged, minimise, stages
from yarnverify.simulation.steps import Steps
from yarnverify.simulation.terms import Term

Array = np.ndarray[Any, Any]


def cantilever(n: int, alpha: float, k_s: float, start: Any = (0.0, 0.0, 0.0)) -> tuple[Fabric, System]:
    """Length 1, k_b 1, a load alpha down at its tip; the wall is in the middle of the first segment, which is held."""
    thread = yarn(n / (n - 0.5), n, start=start)
    terms = [Term(stretch, segments(thread), {"k_s": k_s}), Term(bending, bends(thread), {"k_b": 1.0})]
    loads = np.zeros(thread.size)
    loads[thread.position(n)[0, 1]] = -alpha
    return thread, System(thread.Q, terms, thread.positions(np.arange(2, n + 1)), loads)


def deflection(thread: Fabric, Q: Array) -> float:
    return float(-(thread.points(Q) - thread.points(thread.Q))[-1, 1])


@pytest.mark.parametrize("alpha", [0.1, 1.0, 10.0, 40.0])
@pytest.mark.parametrize("k_s", [1e6, 1e8, 1e10])
def test_hardly_extensible_yarns_take_few_steps(alpha: float, k_s: float) -> None:
    thread, system = cantilever(80, alpha, k_s)
    found = minimise(system, thread.Q)
    assert found.iterations <= (9 if alpha <= 10 else 14)
    assert found.negative == 0 and found.departures == 0
    assert abs(deflection(thread, found.Q) - elastica(alpha).deflection) < 1.5e-4 * alpha / (1 + alpha) * max(
        1, alpha / 10
    )


def test_the_error_falls_with_the_square_of_the_segments() -> None:
    errors = []
    for n in (20, 40, 80):
        thread, system = cantilever(n, 10.0, 1e8)
        errors.append(abs(deflection(thread, minimise(system, thread.Q).Q) - elastica(10.0).deflection))
    for order in np.log2(np.array(errors[:-1]) / errors[1:]):
        assert abs(order - 2) < 0.1


def test_far_from_the_origin_is_no_worse_than_rounding_makes_it() -> None:
    here = cantilever(20, 10.0, 1e6)
    there = cantilever(20, 10.0, 1e6, start=(1e5, -1e5, 3e4))
    one, two = (minimise(system, thread.Q) for thread, system in (here, there))
    assert two.iterations <= 2 * one.iterations
    assert abs(deflection(here[0], one.Q) - deflection(there[0], two.Q)) < 1e-9  # 1e5 has 1.5e-11 to its last digit


def test_the_end_is_an_equilibrium_and_the_same_every_time() -> None:
    thread, system = cantilever(30, 3.0, 1e4)
    one, two = minimise(system, thread.Q), minimise(system, thread.Q)
    assert np.array_equal(one.Q, two.Q) and one.history == two.history
    assert np.abs(system.gradient(one.Q)).max() < 1e-9
    assert one.energy == system.energy(one.Q)
    again = minimise(system, one.Q)
    assert again.iterations <= 1 and np.abs(again.Q - one.Q).max() < 1e-13
    assert np.array_equal(one.Q[: 3 * 2], thread.Q[: 3 * 2])
    assert one.history[-1].kind == "end" and one.seconds["solve"] > 0


def chain(n: int = 12) -> tuple[Fabric, System]:
    """A slack yarn without bending, hung at both ends."""
    thread = yarn(1.0, n)
    terms = [
        Term(stretch, segments(thread), {"k_s": 100.0}),
        Term(gravity, segments(thread, gravity), {"rho": 0.1, "g": [0.0, 0.0, -9.81]}),
    ]
    return thread, System(thread.Q, terms, thread.positions(np.arange(1, n)))


@pytest.mark.parametrize("start", ["flat", "up", "folded"])
def test_slack_chains_end_hanging_however_they_start(start: str) -> None:
    thread, system = chain()
    Q = thread.Q.copy()
    points = thread.points(Q)
    points[:, 0] *= 0.7
    s = np.linspace(0, 1, len(points))
    if start == "up":
        points[:, 2] += 0.6 * s * (1 - s)
    if start == "folded":
        points[1:-1, 2] += 0.05 * (-1.0) ** np.arange(len(points) - 2)
    found = minimise(system, Q)
    assert found.negative == 0
    hanging = thread.points(found.Q)
    assert (hanging[1:-1, 2] < 0).all()
    assert np.abs(hanging[:, 1]).max() < 1e-12
    assert np.abs(hanging[:, 2] - hanging[::-1, 2]).max() < 1e-9
    answer = hung_chain(np.full(12, 1 / 12), span=0.7, k_s=100.0, rho=0.1, g=9.81)
    assert np.abs(hanging[:, [0, 2]] - answer.points).max() < 1e-12


def test_an_equilibrium_that_is_not_stable_is_left_only_if_so_wished() -> None:
    """Two segments: the chain pointing straight up is an equilibrium."""
    thread = yarn(1.0, 2)
    terms = [
        Term(stretch, segments(thread), {"k_s": 100.0}),
        Term(gravity, segments(thread, gravity), {"rho": 0.1, "g": [0.0, 0.0, -9.81]}),
    ]
    system = System(thread.Q, terms, thread.positions([1, 2]))
    Q = thread.Q.copy()
    thread.points(Q)[:] = [[0, 0, 0], [0, 0, 0.5], [0, 0, 1.0]]
    upright = minimise(system, Q, stable=False)
    assert thread.points(upright.Q)[2, 2] > 0.9 and upright.departures == 0 and upright.negative is None
    found = minimise(system, Q)
    assert found.departures >= 1 and found.negative == 0
    answer = hanging_chain([0.5, 0.5], k_s=100.0, rho=0.1, g=9.81)
    assert np.abs(thread.points(found.Q)[:, [0, 2]] - answer.points).max() < 1e-12


@pytest.mark.parametrize("ratio", [0.95, 1.05, 1.5])
def test_yarns_buckle_above_their_load_and_not_below(ratio: float) -> None:
    n, k_s = 60, 1e7
    thread = yarn(1.0, n)
    terms = [Term(stretch, segments(thread), {"k_s": k_s}), Term(bending, bends(thread), {"k_b": 1.0})]
    load = ratio * buckling_load(1.0, 1.0, segments=n)
    active = np.concatenate([thread.positions(np.arange(1, n), axes="xy"), [3 * n]])
    loads = np.zeros(thread.size)
    loads[3 * n] = -load
    found = minimise(System(thread.Q, terms, np.sort(active), loads), thread.Q)
    middle = float(np.abs(thread.points(found.Q)[n // 2, 1]))
    assert found.negative == 0
    if ratio < 1:
        assert middle < 1e-9 and found.departures == 0
    else:
        assert found.departures >= 1
        assert abs(middle - buckled(ratio)[2]) < 2e-3


def test_a_strut_far_beyond_buckling_is_found_from_a_rough_start() -> None:
    """Sixteen times its load, from a wave of many turns: saddles on the way, and a turn about its axis that costs little."""
    n = 80
    thread = yarn(1.0, n)
    terms = [Term(stretch, segments(thread), {"k_s": 1e4}), Term(bending, bends(thread), {"k_b": 1.0})]
    loads = np.zeros(thread.size)
    loads[3 * n : 3 * n + 2] = -40.0, -0.1
    system = System(thread.Q, terms, thread.positions(np.arange(2, n + 1)), loads)
    Q = thread.Q.copy()
    points = thread.points(Q)
    points[2:, 1] += 0.02 * np.sin(40 * points[2:, 0])
    found = minimise(system, Q)
    assert found.negative == 0 and found.iterations <= 100
    tip = thread.points(found.Q)[-1]
    assert tip[1] < -0.1 and abs(tip[2]) < 1e-6  # on the side that the small load chooses


@pytest.mark.parametrize("k_s", [1e6, 1e9, 1e11])
def test_a_strut_that_hardly_shortens_buckles_too(k_s: float) -> None:
    """Rounding hides the negative eigenvalue from the matrix as a whole, and the way down from the energy."""
    thread = yarn(1.0, 20)
    terms = [Term(stretch, segments(thread), {"k_s": k_s}), Term(bending, bends(thread), {"k_b": 1.0})]
    push = np.zeros(thread.size)
    push[thread.position(20)[0, 0]] = -1.2 * buckling_load(1.0, 1.0)
    active = np.setdiff1d(thread.positions(axes="xz"), [*thread.positions([0], "xz"), *thread.positions([20], "z")])
    system = System(thread.Q, terms, active, push)
    Q = thread.Q.copy()
    for part in (0.999, 1.2):  # as the scene does
        system.loads = push * part / 1.2
        Q = minimise(system, Q, residual=1e-15).Q
    span, height = buckled(1.2)[1:]
    assert abs(thread.points(Q)[10, 2]) == pytest.approx(height, rel=0.02)
    assert thread.points(Q)[20, 0] == pytest.approx(span, rel=0.02)


def test_a_step_that_leaves_a_saddle_grows_as_long_as_the_energy_falls() -> None:
    thread = yarn(1.0, 20)
    terms = [Term(stretch, segments(thread), {"k_s": 1e4}), Term(bending, bends(thread), {"k_b": 1.0})]
    system = System(thread.Q, terms, thread.positions(range(1, 20)))
    Q = thread.Q.copy()
    thread.points(Q)[:, 0] *= 0.99  # pressed ten times beyond its load, and straight
    aside = np.zeros(thread.size)
    aside[thread.positions(range(1, 20)).reshape(-1, 3)[:, 1]] = np.sin(np.pi * np.arange(1, 20) / 20)
    short = 1e-6 * aside[system.active]
    steps = Steps(system, system.direct)
    share = steps.stretched(Q, system.energy(Q + 1e-6 * aside), short)
    assert np.log2(share) % 1 == 0 and 1e-6 * share > 0.03  # 2/pi sqrt(0.01) = 0.064 takes up all that it is too long
    along = [system.energy(Q + 1e-6 * 2.0**k * aside) for k in range(int(np.log2(share)) + 2)]
    assert (np.diff(along[:-1]) < 0).all() and along[-1] >= along[-2]
    assert steps.stretched(Q, -np.inf, short) == 1


def test_stages_end_where_the_whole_load_does() -> None:
    thread, system = cantilever(20, 1.0, 1e5)
    whole = minimise(system, thread.Q)
    final = system.loads.copy()
    found = list(stages(system, thread.Q, [0.2 * final, 0.6 * final, final]))
    assert len(found) == 3 and np.array_equal(system.loads, final)
    assert np.abs(found[-1].Q - whole.Q).max() < 1e-9
    assert [deflection(thread, each.Q) for each in found] == sorted(deflection(thread, each.Q) for each in found)


def test_what_is_held_may_be_moved_by_stages() -> None:
    thread, system = chain()
    ends = []
    for width in (0.9, 0.6):
        Q = thread.Q.copy()
        thread.points(Q)[-1, 0] = width
        ends.append(Q)
    found = list(stages(system, thread.Q, [None, None], ends))
    assert [thread.points(each.Q)[-1, 0] for each in found] == [0.9, 0.6]
    start = ends[-1].copy()
    thread.points(start)[1:-1, 2] -= 0.1
    assert abs(found[-1].energy - minimise(system, start).energy) < 1e-10


def test_a_stage_that_is_too_large_is_halved_and_one_that_never_works_fails_cleanly(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    thread, system = cantilever(10, 1.0, 1e4)
    final, made, real = system.loads.copy(), [], newton.minimise
    system.loads = 0 * final

    def careful(system: System, Q: Array, solver: Any = None, **options: Any) -> Any:
        load = float(np.abs(system.loads).max())
        if load - (made[-1] if made else 0.0) > 0.3 or load > limit:
            raise NotConverged("too much at once", Q, [], None)
        made.append(load)
        return real(system, Q, solver, **options)

    monkeypatch.setattr(newton, "minimise", careful)
    limit = 2.0
    found = list(stages(system, thread.Q, [final]))
    assert len(found) == 1 and made == [0.25, 0.5, 0.75, 1.0]
    made.clear()
    limit, system.loads = 0.6, 0 * final
    with pytest.raises(NotConverged, match="too much at once"):
        list(stages(system, thread.Q, [final], halvings=5))
    assert 0.5 < np.abs(system.loads).max() <= 0.6  # what was reached


def test_without_convergence_there_is_a_history_and_the_worst_element() -> None:
    thread, system = cantilever(40, 10.0, 1e8)
    with pytest.raises(NotConverged) as caught:
        minimise(system, thread.Q, iterations=3)
    error = caught.value
    assert len(error.history) == 3 and "\n" not in str(error)
    assert "no equilibrium after 3 iterations" in str(error) and "worst element: " in str(error)
    assert error.worst is not None
    term = next(t for t in system.terms if t.name == error.worst.term)
    assert np.array_equal(error.worst.state, error.Q[term.table.rows[:, error.worst.element]])
    assert system.energy(error.Q) == min(line.energy for line in error.history)
    assert minimise(system, error.Q).negative == 0  # one can go on from there


def test_a_yarn_that_nothing_holds_has_no_equilibrium() -> None:
    thread = yarn(1.0, 5)
    terms = [Term(stretch, segments(thread), {"k_s": 100.0}), Term(bending, bends(thread), {"k_b": 1.0})]
    loads = np.zeros(thread.size)
    loads[0] = 1.0
    with pytest.raises(NotConverged):
        minimise(System(thread.Q, terms, thread.positions(), loads), thread.Q, iterations=60)
    still = minimise(System(thread.Q, terms, thread.positions()), thread.Q)
    assert np.array_equal(still.Q, thread.Q) and still.iterations == 0


def test_at_rest_nothing_moves() -> None:
    cloth = weave("plain", (4, 4))
    terms = [Term(stretch, segments(cloth), {"k_s": 10.0}), Term(bending, bends(cloth), {"k_b": 1e-9})]
    found = minimise(System(cloth.Q, terms, cloth.positions(np.arange(1, cloth.nodes))), cloth.Q)
    assert np.array_equal(found.Q, cloth.Q) and found.iterations == 0
    nothing = minimise(System(cloth.Q, terms, []), cloth.Q)
    assert nothing.iterations == 0


def test_a_start_outside_the_domain_is_named() -> None:
    thread, system = cantilever(5, 1.0, 1e3)
    Q = thread.Q.copy()
    Q[thread.position(3)] = Q[thread.position(2)]
    with pytest.raises(
        ElementError, match=r"(stretch: element 2|bending: element 1): the segment x0-x1 has length zero"
    ):
        minimise(system, Q)


class Broken:
    """A solver that does what is asked of it a few times, and then no more."""

    def __init__(self, times: int, wrong: Any) -> None:
        self.times, self.wrong, self.good = times, wrong, None

    def factorise(self, matrix: Any) -> Any:
        from yarnverify.simulation.linear import Multifrontal

        self.times -= 1
        if self.times < 0:
            return self.wrong(matrix)
        return Multifrontal().factorise(matrix)


def test_a_solver_that_fails_leaves_the_last_good_state() -> None:
    def fails(matrix: Any) -> Any:
        raise LinearSolveError("out of order")

    thread, system = cantilever(20, 10.0, 1e6)
    with pytest.raises(NotConverged, match="no descent direction") as caught:
        minimise(system, thread.Q, Broken(3, fails))
    assert len(caught.value.history) == 3
    assert np.isfinite(system.energy(caught.value.Q))


def test_an_element_that_loses_its_derivative_on_the_way_leaves_the_last_good_state(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    thread, system = cantilever(20, 10.0, 1e6)
    real, calls = System.evaluate, []

    def evaluate(self: System, Q: Array, definite: bool = False) -> Any:
        calls.append(Q)
        if len(calls) > 4:
            raise ElementError("bending: element 3: theta is pi, where the energy has no derivative", np.array([3]))
        return real(self, Q, definite)

    monkeypatch.setattr(System, "evaluate", evaluate)
    with pytest.raises(NotConverged, match=r"theta is pi") as caught:
        minimise(system, thread.Q)
    assert np.isfinite(system.energy(caught.value.Q))


@pytest.mark.parametrize("wrong", [{"tolerance": 1e-8}, {"iterations": 0}, {"residual": -1.0}, {"step": float("nan")}])
def test_options_that_mean_nothing_are_refused(wrong: dict[str, Any]) -> None:
    thread, system = cantilever(5, 1.0, 1e3)
    with pytest.raises((TypeError, ValueError), match=next(iter(wrong))):
        minimise(system, thread.Q, **wrong)
