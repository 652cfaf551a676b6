"""One run of a problem, step by step, from the start or from a saved state to the same end.

run = Run(problem)
for reached in run.go(): ...      arrays = reached.arrays() can be saved; run.go(arrays) goes on from there
run.outcome(arrays)               what answers are read from
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.errors import InputError
from yarnverify.simulation.assembly import System
from yarnverify.simulation.dynamics import Dynamics, Motion
from yarnverify.simulation.linear import Solver, SuperLU
from yarnverify.simulation.newton import NotConverged, stages
from yarnverify.simulation.setting import Moving, Outcome, Setting, Static

Array = NDArray[Any]
State = Mapping[str, Any]
STIFFEST = 1e16  # k_s l^2/k_b
SHORTEST = 1e-6  # of its rest length in the fabric: a segment below it has drawn together
RESIDUAL = 1e-15  # of the greatest force: to rounding, so that exact answers come out to their last digits


@dataclass(frozen=True, eq=False)
class Reached:
    """How far a run has come.

    Attributes
    ----------
    time
        s, or stages.
    Q
        Configuration, (size,), m.
    arrays
        Makes all that is needed to go on from here, or to end here.
    frame
        Whether it is one to draw.
    """

    time: float
    Q: Array
    arrays: Callable[[], dict[str, Any]]
    frame: bool = True


@dataclass(eq=False)
class Run:
    """A problem and what solves it.

    Attributes
    ----------
    problem
        What is run.
    solver
        ``direct`` or ``superlu``.
    report
        Called with a line on what goes on, now and then.
    """

    problem: Setting
    solver: str = "direct"
    report: Callable[[str], None] | None = None
    _dynamics: Dynamics | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        p = self.problem
        start = np.array(p.fabric.Q if p.start is None else p.start, float)
        if start.shape != (p.fabric.size,):
            raise ValueError(f"the start must have shape ({p.fabric.size},), not {start.shape}")
        self.start = start
        _told(p)
        if isinstance(p, Moving):
            self._dynamics = Dynamics(p.fabric.Q, p.terms, p.active, p.kinetic, p.loads, scheme=p.scheme, held=p.held,
                                      **p.options)  # fmt: skip
            self.system = self._dynamics.system
            self._dynamics.solver = self._linear()
        else:
            self.system = System(p.fabric.Q, p.terms, p.active)
        self._names = ["time", *p.watch]

    @property
    def length(self) -> float:
        """Stages, or seconds of time."""
        return self.problem.until if isinstance(self.problem, Moving) else float(len(self.problem.stages))

    @property
    def moving(self) -> bool:
        """Whether time goes on, rather than stages."""
        return isinstance(self.problem, Moving)

    def outcome(self, state: State) -> Outcome:
        """What a state has come to."""
        recorded = {name: np.asarray(state[f"recorded {name}"], float) for name in self._names}
        motion = Motion.of(state) if self.moving else None
        return Outcome(self.problem.fabric, np.asarray(state["Q"], float), self.system, recorded, motion)

    def go(self, state: State | None = None) -> Iterator[Reached]:
        """States after each stage or step, from a state on or from the start.

        Raises
        ------
        NotConverged, ElementError, LinearSolveError
            A stage or step cannot be solved.
        """
        yield from self._move(state) if self.moving else self._rest(state)

    # -- how

    def _linear(self) -> Solver | None:
        return SuperLU(self.system.nodes, self.system.coordinates) if self.solver == "superlu" else None

    def _check(self, Q: Array) -> None:
        """Refuse an end at the border of the domain, where rounding makes any force."""
        for term in self.problem.terms:
            if term.kernel.KERNEL.name != "stretch":
                continue
            first, second = (term.table.rows[term.kernel.DOFS.index(label)] for label in ("u0", "u1"))
            share = (Q[second] - Q[first]) / (self.problem.fabric.Q[second] - self.problem.fabric.Q[first])
            if share.size and not share.min() > SHORTEST:
                at = int(np.argmin(share))
                left = f"{share[at]:.0e} of the yarn between them is left"
                raise NotConverged(f"the ends of {term.name} {at} have drawn together; {left}", Q, [], None)

    def _watched(self, time: float, Q: Array, motion: Motion | None) -> list[float]:
        seen = Outcome(self.problem.fabric, Q, self.system, {}, motion)
        return [time, *(float(value(seen)) for value in self.problem.watch.values())]

    def _rest(self, state: State | None) -> Iterator[Reached]:
        p = self.problem
        assert isinstance(p, Static)
        done, iterations = (int(state["stage"]), int(state["iterations"])) if state else (0, 0)
        Q = np.array(state["Q"], float) if state else self.start
        before = np.array(state["Q before"], float) if state else self.start
        rows = self._rows(state)
        solver = self._linear()
        options = {"residual": RESIDUAL, **p.options}
        for stage in p.stages[:done]:  # loads that a stage leaves are those of the one before
            self.system.loads = self.system.loads if stage.loads is None else np.array(stage.loads, float)
        for number, stage in list(enumerate(p.stages))[done:]:
            guess = Q.copy()
            guess[self.system.active] += (Q - before)[self.system.active]  # as the stage before went
            for found in stages(
                self.system, guess, [stage.loads], [stage.held], solver, report=self._tell(number), **options
            ):
                before, Q, iterations = Q, found.Q, iterations + found.iterations
                self._check(Q)
            rows.append(self._watched(number + 1.0, Q, None))
            own: Callable[[], State] = partial(
                dict, {"Q": Q, "Q before": before, "stage": number + 1, "iterations": iterations}
            )
            yield Reached(number + 1.0, Q, partial(self._saved, rows, len(rows), own))

    def _tell(self, number: int) -> Callable[[Any], None] | None:
        if self.report is None:
            return None
        report, of = self.report, f"stage {number + 1} of {int(self.length)}, " if self.length > 1 else ""
        return lambda line: report(f"{of}residual {line.residual:.0e} N")

    def _move(self, state: State | None) -> Iterator[Reached]:
        p, dynamics = self.problem, self._dynamics
        assert isinstance(p, Moving) and dynamics is not None
        if state:
            motion, frames = Motion.of(state), list(np.asarray(state["frames"], float))
            times = [float(t) for t in state["frame times"]]
        else:
            motion = dynamics.start(self.start, p.V)
            frames, times = [motion.Q], [0.0]
        rows = self._rows(state) or [self._watched(0.0, motion.Q, motion)]
        for after in dynamics.run(motion, p.until, p.h, p.tolerance):
            frame = int(after.time / p.until * p.frames + 1e-9) > int(motion.time / p.until * p.frames + 1e-9)
            if frame:
                frames, times = [*frames, after.Q], [*times, after.time]
            motion = after
            self._check(motion.Q)
            rows.append(self._watched(motion.time, motion.Q, motion))
            own = partial(_of_motion, motion, frames, times)
            yield Reached(motion.time, motion.Q, partial(self._saved, rows, len(rows), own), frame)

    def _rows(self, state: State | None) -> list[list[float]]:
        """What was watched up to a state, a row a step."""
        if state is None:
            return []
        return np.stack([np.asarray(state[f"recorded {name}"], float) for name in self._names], axis=1).tolist()

    def _saved(self, rows: list[list[float]], count: int, own: Callable[[], State]) -> dict[str, Any]:
        """What is saved: of rows that go on growing, those of a state."""
        columns = np.array(rows[:count]).reshape(count, len(self._names)).T
        return {**own(), **{f"recorded {name}": column for name, column in zip(self._names, columns, strict=True)}}


def _told(problem: Setting) -> None:
    """Refuse yarns so stiff that rounding of their coordinates makes more force than bending them does, or their weight."""
    given = {term.kernel.KERNEL.name: term.parameters for term in problem.terms if term.table.count}
    if "stretch" not in given:
        return
    k_s, extent = (
        float(np.max(given["stretch"]["k_s"])),
        float(np.ptp(problem.fabric.points(problem.fabric.Q), axis=0).max()),
    )
    if "bending" in given:
        most = STIFFEST * float(np.min(given["bending"]["k_b"])) / extent**2
        other, does = f"k_b over the square of {extent:g} m", "bends"
    elif "gravity" in given:
        weight = given["gravity"]["rho"] * np.linalg.norm(given["gravity"]["g"], axis=0)
        most, other, does = STIFFEST * float(np.min(weight)) * extent, f"the weight of {extent:g} m of it", "hangs"
    else:
        return
    if k_s > most:
        raise InputError(f"k_s = {k_s:g} N is {STIFFEST * k_s / most:.0e} times {other}: "
                         f"coordinates cannot tell how such a yarn {does}; at most {most:.2g} N")  # fmt: skip


def _of_motion(motion: Motion, frames: list[Array], times: list[float]) -> dict[str, Any]:
    own = {"frames": np.array(frames), "frame times": np.array(times), "iterations": motion.steps}
    return {**motion.arrays(), **own}
