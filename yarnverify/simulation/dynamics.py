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

from yarnverify.errors import InputError
from yarnverify.kernels import ElementError
from yarnverify.simulation.assembly import System, Term
from yarnverify.simulation.increment import Increment
from yarnverify.simulation.inertia import Inertia, elements_of
from yarnverify.simulation.linear import Solver, SuperLU
from yarnverify.simulation.newton import minimise
from yarnverify.simulation.outcome import UNSOLVED, NotConverged

Array = NDArray[Any]
Scheme = Literal["implicit_euler", "midpoint", "bdf2"]
ORDERS: Mapping[str, int] = {"implicit_euler": 1, "midpoint": 2, "bdf2": 2}
NEARLY = 1e-9  # of a step: what is left of the time is less than a step only if it is so by more


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
    lost
        What rounding has taken from the time, s: steps add up to what their number says.
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
    lost: float = 0.0

    @property
    def energy(self) -> float:
        """Kinetic and potential, J."""
        return self.kinetic + self.potential

    def arrays(self) -> dict[str, Any]:
        """All of it by name, to save."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @classmethod
    def of(cls, arrays: Mapping[str, Any]) -> Motion:
        """From what ``arrays`` gave; the same bits."""
        whole, vectors = ("steps", "rejected"), ("Q", "P", "V", "Q_before", "P_before")
        made: dict[str, Any] = {name: int(arrays[name]) for name in whole}
        made |= {name: np.array(arrays[name], float) for name in vectors}
        made |= {f.name: float(arrays[f.name]) for f in fields(cls) if f.name not in made}
        return cls(**made)


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
            raise InputError(f"scheme must be one of {', '.join(ORDERS)}, not {scheme!r}")
        self.system = System(Q, terms, active, loads, others=[elements_of(kinetic)], engine=engine)
        self.inertia = Inertia(self.system, kinetic)
        self.scheme, self.held = scheme, held
        self.options = {"residual": 0.0, "step": 1e-16, "stable": False, "iterations": 100, **options}
        self.solver = solver
        self._any: Solver | None = None
        self._fixed = np.ones(self.system.size, bool)
        self._fixed[self.system.active] = False

    def start(self, Q: ArrayLike, V: ArrayLike | None = None, time: float = 0.0) -> Motion:
        """The state at rest or with velocities (size,), m/s.

        Raises
        ------
        ElementError
            An element has no energy there.
        """
        Q = np.array(Q, float)
        V = np.zeros(Q.size) if V is None else np.array(V, float)
        for name, given in (("Q", Q), ("V", V)):
            if given.shape != (self.system.size,) or not np.isfinite(given).all():
                raise InputError(f"a motion starts with {self.system.size} finite numbers {name}, not {given.shape}")
        found = self.inertia.kinetic(Q, V)
        return Motion(time, Q, found.momentum, V, found.energy, self.system.energy(Q), 0.0, 0.0, Q, found.momentum)

    def step(self, motion: Motion, h: float) -> Motion:
        """The state a time h later.

        Raises
        ------
        NotConverged
            The step could not be solved for; the state before it is whole.
        """
        _positive(h=h)
        problem = self._increment(motion, h)
        try:
            end, left = self._end(problem, motion, h)
            q, v = problem.at(end), problem.rate(end)
            found = self.inertia.kinetic(q, v)
            force = found.slope - self.system.slope(q)
            potential = self.system.energy(q)
        except UNSOLVED as error:
            reason = f"the step of {h:.6g} s from time {motion.time:.6g} s has no end, a shorter one may have: "
            if isinstance(error, NotConverged):
                raise NotConverged(reason + error.reason, error.Q, error.history, error.worst) from error
            raise NotConverged(reason + str(error), motion.Q, [], None) from error
        if self.scheme == "midpoint":
            momentum = motion.P + h * force
            momentum[self._fixed] = (2 * found.momentum - motion.P)[self._fixed]
        else:
            momentum = problem.momentum + problem.tau * force
            momentum[self._fixed] = found.momentum[self._fixed]
        momentum[self.system.active] += left
        time, lost = _later(motion, h)
        return replace(
            motion, time=time, lost=lost, Q=end, P=momentum, V=v, kinetic=found.energy, potential=potential, h=h,
            Q_before=motion.Q, P_before=motion.P, steps=motion.steps + 1,
        )  # fmt: skip

    def run(self, motion: Motion, until: float, h: float, tolerance: float | None = None) -> Iterator[Motion]:
        """States up to a time, by steps of h, or by adapted ones that start with h; the last one ends at that time.

        Parameters
        ----------
        tolerance
            Greatest error of a step in any unknown, m. The error is estimated by making each step in two halves as well.

        Raises
        ------
        NotConverged
            As ``step``; what was yielded before stays good, to save or to go on from with smaller steps.
        """
        _positive(h=h, **({} if tolerance is None else {"tolerance": tolerance}))
        if not np.isfinite(until):
            raise InputError(f"until = {until!r} must be a time in seconds")
        while (left := (until - motion.time) - motion.lost) > NEARLY * h:
            if tolerance is not None:
                wanted = motion.next or h
                parts = np.ceil(left / wanted * (1 - NEARLY))  # equal ones to the end, so that none is tiny
                last, motion = parts <= 1, self._adapted(motion, left / max(parts, 1), wanted, tolerance)
                last &= motion.time > until - NEARLY * h
            else:
                last = left <= h * (1 + NEARLY)
                motion = self.step(motion, left if left < h * (1 - NEARLY) else h)
            yield replace(motion, time=until, lost=0.0) if last else motion

    # -- how

    def _increment(self, motion: Motion, h: float) -> Increment:
        Q, P = motion.Q, motion.P
        nothing = np.zeros_like(Q)
        if self.scheme == "midpoint":
            return Increment(self.inertia, Q / 2, 0.5, Q, h, P)
        if self.scheme == "implicit_euler" or motion.h == 0:
            return Increment(self.inertia, nothing, 1.0, Q, h, P)
        ratio = h / motion.h
        share = ratio**2 / (1 + 2 * ratio)
        back, momentum = Q + share * (Q - motion.Q_before), P + share * (P - motion.P_before)
        return Increment(self.inertia, nothing, 1.0, back, h * (1 + ratio) / (1 + 2 * ratio), momentum)

    def _end(self, problem: Increment, motion: Motion, h: float) -> tuple[Array, Array]:
        """Where the step ends, and what the momenta there lack (active,) because positions are rounded."""
        start = motion.Q + h * motion.V
        start[self._fixed] = motion.Q[self._fixed]
        if self.held is not None:
            moved = start.copy()
            self.held(_later(motion, h)[0], moved)
            start[self._fixed] = moved[self._fixed]
        try:
            return self._solve(problem, start, motion)
        except ElementError:  # the velocity leads out of the domain
            active = self.system.active
            start[active] = motion.Q[active]
            return self._solve(problem, start, motion)

    def _solve(self, problem: Increment, start: Array, motion: Motion) -> tuple[Array, Array]:
        if self.inertia.bind(start, motion.Q, motion.Q_before):
            found = minimise(problem, start, self.solver, **self.options)
            return found.Q, problem.lacking(found.gradient, found.step)
        self._any = self._any or SuperLU(problem.nodes, problem.coordinates)
        return problem.solve(start, self.solver or self._any), np.zeros(self.system.count)

    def _adapted(self, motion: Motion, h: float, wanted: float, tolerance: float) -> Motion:
        """A step of at most h whose estimated error is within the tolerance; what it returns was made in two halves."""
        order, rejected = ORDERS[self.scheme], motion.rejected
        failed: NotConverged | None = None
        if self.scheme == "bdf2" and motion.h == 0:
            order = 1  # as it starts
        for _ in range(40):
            try:
                whole = self.step(motion, h)
                twice = self.step(self.step(motion, h / 2), h / 2)
            except NotConverged as error:
                failed = error
                h /= 4
                wanted, rejected = h, rejected + 1
                continue
            active = self.system.active
            apart = float(np.abs(whole.Q - twice.Q)[active].max(initial=0.0))
            found = _share(self.scheme, h, motion.h) * apart
            factor = 0.9 * (tolerance / found) ** (1 / (order + 1)) if found > 0 else 2.0
            if found <= tolerance:
                following = max(wanted if h < wanted else 0.0, h * min(max(factor, 0.3), 2.0))
                return replace(twice, next=following, rejected=rejected, error=found)
            h *= min(max(factor, 0.1), 0.7)
            wanted, rejected = h, rejected + 1
        reason = f"no step from time {motion.time:.6g} s down to {h:.2g} s has an error below {tolerance:g} m"
        history, worst = (failed.history, failed.worst) if failed else ([], None)
        raise NotConverged(reason, motion.Q, history, worst) from failed


def _later(motion: Motion, h: float) -> tuple[float, float]:
    """Time after a step and what rounding takes from it (compensated summation)."""
    step = h + motion.lost
    time = motion.time + step
    return time, step - (time - motion.time)


def _share(scheme: Scheme, h: float, before: float) -> float:
    """Error of a step made in two halves, over its distance from the step made at once.

    ``1/(2^p - 1)`` for a scheme that looks at one state; for BDF2 from the leading errors, whose size depends on the step
    before and of which it carries 4/3 of the first half's through the second.
    """
    if scheme != "bdf2":
        return 1.0 / (2 ** ORDERS[scheme] - 1)
    if before == 0:  # implicit Euler has h^2/2 at once and 4/3 (h/2)^2/2 at the end of the second half
        return 0.5

    def leading(h: float, before: float) -> float:
        return h * h * (h + before) * (h + before) / (before + 2 * h)

    twice = 4 / 3 * leading(h / 2, before) + leading(h / 2, h / 2)
    return twice / (leading(h, before) - twice)


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} = {value!r} must be positive")
