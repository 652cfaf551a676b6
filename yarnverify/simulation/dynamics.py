"""Motion: one-step schemes on positions and momenta.

dynamics = Dynamics(fabric.Q, terms, active, kinetic, scheme="midpoint")
motion = dynamics.start(fabric.Q, V)
for motion in dynamics.run(motion, until=1.0, h=1e-3): ...

``implicit_euler`` is of first order and damps; ``midpoint``, the variational rule of the midpoint Lagrangian, is of second
order, symmetric and symplectic, keeps momenta, and its energy does not drift; ``bdf2`` is of second order and damps what is
fast. Each step starts from the state in a ``Motion`` and from nothing else, so that a run can be taken up again anywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.kernels import ElementError
from yarnverify.simulation.assembly import System, Term
from yarnverify.simulation.increment import Increment
from yarnverify.simulation.inertia import Inertia, elements_of
from yarnverify.simulation.linear import LinearSolveError, Solver, SuperLU
from yarnverify.simulation.newton import minimise
from yarnverify.simulation.search import NotConverged

Array = NDArray[Any]
Scheme = Literal["implicit_euler", "midpoint", "bdf2"]
ORDERS: Mapping[str, int] = {"implicit_euler": 1, "midpoint": 2, "bdf2": 2}


@dataclass(frozen=True, eq=False)
class Motion:
    """The state of a motion.

    Attributes
    ----------
    time
        s.
    Q, P, V
        Configuration, momenta, and the velocity of the last step, (size,) each.
    kinetic, potential
        Energies where the last step evaluated them, J: in its middle for the midpoint rule, else at its end.
    h
        Length of the last step, s, 0 at the start; ``next``: of the next one, where it adapts.
    Q_before, P_before
        One step before.
    steps, rejected, error
        Steps so far, steps that were made again smaller, and the estimated error of the last one, m.
    """

    time: float
    Q: Array
    P: Array
    V: Array
    kinetic: float
    potential: float
    h: float
    next: float
    Q_before: Array
    P_before: Array
    steps: int = 0
    rejected: int = 0
    error: float = 0.0

    def arrays(self) -> dict[str, Any]:
        """All of it by name, to save."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @staticmethod
    def of(arrays: Mapping[str, Any]) -> Motion:
        """From what ``arrays`` gave."""
        numbers = {"steps": int, "rejected": int}
        found: dict[str, Any] = {
            f.name: np.array(arrays[f.name], float)
            if np.ndim(arrays[f.name])
            else numbers.get(f.name, float)(arrays[f.name])
            for f in fields(Motion)
        }
        return Motion(**found)


class Dynamics:
    """A system in motion.

    Parameters
    ----------
    Q, terms, active, loads
        As for ``System``.
    kinetic
        Kinetic kernel, its table and linear density.
    solver
        For constant mass a solver of symmetric matrices, for sliding coordinates one of any; direct if not given.
    held
        Gives the entries that are not active at a time: ``held(time, Q)`` changes Q (size,) in place.
    tolerance
        Options of ``minimise`` for each step.
    """

    def __init__(
        self,
        Q: ArrayLike,
        terms: Sequence[Term],
        active: ArrayLike,
        kinetic: Term,
        loads: ArrayLike | None = None,
        *,
        scheme: Scheme = "midpoint",
        solver: Solver | None = None,
        held: Callable[[float, Array], None] | None = None,
        engine: Literal["auto", "numpy", "compiled"] = "auto",
        **options: Any,
    ) -> None:
        if scheme not in ORDERS:
            raise ValueError(f"scheme must be one of {', '.join(ORDERS)}, not {scheme!r}")
        self.system = System(Q, terms, active, loads, others=[elements_of(kinetic)], engine=engine)
        self.inertia = Inertia(self.system, kinetic, moving=held is not None)
        self.scheme, self.solver, self.held = scheme, solver, held
        self.options = {"residual": 1e-13, "stable": False, "iterations": 100, **options}

    def start(self, Q: ArrayLike, V: ArrayLike | None = None, time: float = 0.0) -> Motion:
        """The state at rest or with velocities (size,), m/s."""
        Q = np.array(Q, float)
        V = np.zeros(Q.size) if V is None else np.array(V, float)
        found = self.inertia.kinetic(Q, V)
        return Motion(time, Q, found.momentum, V, found.energy, self.system.energy(Q), 0.0, 0.0, Q, found.momentum)

    def step(self, motion: Motion, h: float) -> Motion:
        """The state a time h later.

        Raises
        ------
        NotConverged
            The step could not be solved for.
        """
        problem = self._increment(motion, h)
        first = motion.Q + h * motion.V
        start = motion.Q.copy()
        start[self.system.active] = first[self.system.active]
        if self.held is not None:
            self.held(motion.time + h, start)
        try:
            end = self._solve(problem, start)
        except ElementError:  # the velocity leads out of the domain
            calm = start.copy()
            calm[self.system.active] = motion.Q[self.system.active]
            end = self._solve(problem, calm)
        q, v = problem.at(end), problem.rate(end)
        found = self.inertia.kinetic(q, v)
        force = found.slope - self.system.slope(q)
        if self.scheme == "midpoint":
            momentum = motion.P + h * force
            momentum[self._fixed] = (2 * found.momentum - motion.P)[self._fixed]
        else:
            momentum = problem.momentum + problem.tau * force
            momentum[self._fixed] = found.momentum[self._fixed]
        return replace(
            motion, time=motion.time + h, Q=end, P=momentum, V=v, kinetic=found.energy, potential=self.system.energy(q), h=h,
            Q_before=motion.Q, P_before=motion.P, steps=motion.steps + 1,
        )  # fmt: skip

    def run(self, motion: Motion, until: float, h: float, tolerance: float | None = None) -> Iterator[Motion]:
        """States up to a time, by steps of h, or by adapted ones that start with h.

        Parameters
        ----------
        tolerance
            Greatest error of a step in any unknown, m. The error is estimated by making each step in two halves as well.
        """
        begin, done = motion.time, 0
        while motion.time < until - 1e-9 * h:
            if tolerance is None:
                motion = replace(self.step(motion, h), time=begin + (done + 1) * h)
                done += 1
            else:
                wanted = motion.next or h
                motion = self._adapted(motion, min(wanted, until - motion.time), wanted, tolerance)
            yield motion

    # -- how

    @property
    def _fixed(self) -> Array:
        fixed = np.ones(self.system.size, bool)
        fixed[self.system.active] = False
        return fixed

    def _increment(self, motion: Motion, h: float) -> Increment:
        Q, P = motion.Q, motion.P
        nothing = np.zeros_like(Q)
        if self.scheme == "midpoint":
            return Increment(self.inertia, Q / 2, 0.5, Q, h, P)
        if self.scheme == "implicit_euler" or motion.h == 0:
            return Increment(self.inertia, nothing, 1.0, Q, h, P)
        ratio = h / motion.h
        one, two = (1 + ratio) ** 2 / (1 + 2 * ratio), ratio**2 / (1 + 2 * ratio)
        back, momentum = one * Q - two * motion.Q_before, one * P - two * motion.P_before
        return Increment(self.inertia, nothing, 1.0, back, h * (1 + ratio) / (1 + 2 * ratio), momentum)

    def _solve(self, problem: Increment, start: Array) -> Array:
        self.inertia.bind(start)
        if self.inertia.constant:
            return minimise(problem, start, self._symmetric(problem), **self.options).Q
        if self.solver is None:
            self.solver = SuperLU(problem.nodes, problem.coordinates)
        return problem.solve(start, self.solver)

    def _symmetric(self, problem: Increment) -> Solver:
        if self.solver is None:
            from yarnverify.simulation.search import solver_for

            self.solver = solver_for(problem, self.inertia.active_mass)
        return self.solver

    def _adapted(self, motion: Motion, h: float, wanted: float, tolerance: float) -> Motion:
        """A step of at most h whose estimated error is within the tolerance; what it returns was made in two halves."""
        order = ORDERS[self.scheme]
        rejected = motion.rejected
        for _ in range(40):
            try:
                whole = self.step(motion, h)
                twice = self.step(self.step(motion, h / 2), h / 2)
            except (NotConverged, ElementError, LinearSolveError):
                h /= 4
                wanted, rejected = h, rejected + 1
                continue
            active = self.system.active
            error = float(np.abs(whole.Q - twice.Q)[active].max(initial=0.0)) / (2**order - 1)
            factor = 0.9 * (tolerance / error) ** (1 / (order + 1)) if error > 0 else 2.0
            if error <= tolerance:
                following = max(wanted if h < wanted else 0.0, h * min(max(factor, 0.3), 2.0))
                return replace(twice, time=motion.time + h, next=following, rejected=rejected, error=error)
            h *= min(max(factor, 0.1), 0.7)
            wanted, rejected = h, rejected + 1
        raise NotConverged(f"no step from time {motion.time:g} s is accurate enough", motion.Q, [], None)
