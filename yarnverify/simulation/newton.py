"""Equilibria by Newton's method.

found = minimise(system, fabric.Q)                    one load
for found in stages(system, fabric.Q, loads): ...     one after the other, halved where a stage is too large
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.simulation.assembly import System
from yarnverify.simulation.linear import Solver
from yarnverify.simulation.outcome import UNSOLVED, Equilibrium, Iteration, NotConverged, Options
from yarnverify.simulation.problem import Problem
from yarnverify.simulation.search import Search
from yarnverify.simulation.steps import Steps

__all__ = ["Equilibrium", "Iteration", "NotConverged", "Options", "Problem", "minimise", "stages"]

Array = NDArray[Any]


def minimise(
    problem: Problem,
    Q: Array,
    solver: Solver | None = None,
    *,
    report: Callable[[Iteration], None] | None = None,
    **options: Any,
) -> Equilibrium:
    """A stable equilibrium near a configuration.

    Parameters
    ----------
    Q
        Where to start, (size,). What is not active stays as it is.
    solver
        For symmetric matrices; the problem's direct one if not given.
    report
        Called with each iteration.
    options
        As in ``Options``.

    Raises
    ------
    NotConverged
        With what is known about it.
    ElementError
        An element has no energy at the start.
    """
    limits = Options(**options)
    start = np.array(Q, float)
    steps = Steps(problem, solver or problem.direct)
    first = Search(steps, start, report, limits, returns=lambda: 1000 if problem.softness(start) > 0.1 else 1)
    try:
        return first.run()
    except NotConverged as error:
        softness = problem.softness(start)
        if softness > 0.1 or len(error.history) >= limits.iterations:
            raise
        return _stiffened(first, error, softness)


def _stiffened(first: Search, error: NotConverged, softness: float) -> Equilibrium:
    """The equilibrium of yarns that are made stiffer by and by, ten times each, from the best state of a search that crept.

    A line search creeps along the valley of inextensible yarns, but not where they stretch.
    """
    count = int(np.ceil(-np.log10(softness)))
    Q = error.Q
    found = None
    for factor in [*np.geomspace(softness, 1.0, count + 1)]:
        problem = first.steps.problem
        steps = Steps(problem if factor == 1 else problem.softened(factor), first.steps.solver, first.steps.seconds)
        stage = Search(steps, Q, first.report, first.options, searching=0 if found else 15)
        stage.history, stage.departures = first.history, first.departures
        found = stage.run()
        first.departures = stage.departures
        Q = found.Q
    assert found is not None
    return found


def stages(
    system: System,
    Q: Array,
    loads: Iterable[Array | None],
    held: Iterable[Array | None] | None = None,
    solver: Solver | None = None,
    halvings: int = 8,
    **options: Any,
) -> Iterator[Equilibrium]:
    """Equilibria under loads that change by stages, each started at the one before.

    Parameters
    ----------
    loads
        ``System.loads`` of each stage, (size,); None to leave them.
    held
        For each stage a configuration whose entries that are not active are imposed, (size,); None to leave them.
    halvings
        How often a stage that fails may be halved.

    Raises
    ------
    NotConverged
        A stage fails however small.
    """
    fixed = np.ones(system.size, bool)
    fixed[system.active] = False
    Q = np.array(Q, float)
    wanted = list(loads)
    imposed = [None] * len(wanted) if held is None else list(held)
    for load, place in zip(wanted, imposed, strict=True):
        load_before, Q_before = system.loads, Q
        load_after = load_before if load is None else np.asarray(load, float)
        Q_after = Q_before if place is None else np.asarray(place, float)
        done, size = 0.0, 1.0
        while done < 1:
            now = min(1.0, done + size)
            system.loads = load_after if now == 1 else load_before + now * (load_after - load_before)
            start = np.where(fixed, Q_after if now == 1 else Q_before + now * (Q_after - Q_before), Q)
            try:
                found = minimise(system, start, solver, **options)
            except UNSOLVED:
                size /= 2
                if size < 0.5**halvings:
                    system.loads = load_before + done * (load_after - load_before)
                    raise
                continue
            done, Q = now, found.Q
        yield found
