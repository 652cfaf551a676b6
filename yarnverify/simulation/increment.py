"""One time step as a problem to solve.

The schemes differ in where they evaluate and how they weight. With the unknown q1,

    q = base + a q1,  v = (q1 - back)/tau,  residual  dT/dv(q, v) - P - a tau (dT/dq - dV/dq)(q, v)  =  0

is implicit Euler (a = 1), the variational midpoint rule (a = 1/2) and BDF2 (a = 1, ``back`` and P from two steps before).
Where the mass is constant this is the gradient of an incremental potential, which is minimised; where coordinates slide, it
is not, and the residual is solved with all terms of inertia.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.kernels import ElementError
from yarnverify.simulation.assembly import Evaluation, Worst
from yarnverify.simulation.frozen import Frozen
from yarnverify.simulation.inertia import Inertia
from yarnverify.simulation.linear import LinearSolveError, Solver, SuperLU
from yarnverify.simulation.newton import minimise
from yarnverify.simulation.search import EPSILON, Iteration, NotConverged

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Increment:
    """A step: what is known before it. ``base``, ``back`` and ``momentum`` have shape (size,)."""

    inertia: Inertia
    base: Array
    a: float
    back: Array
    tau: float
    momentum: Array

    @property
    def active(self) -> Array:
        """Indices of the unknowns."""
        return self.inertia.system.active

    @property
    def nodes(self) -> Array:
        """Node of each unknown."""
        return self.inertia.system.nodes

    @property
    def direct(self) -> Solver:
        """A direct solver, which knows the pattern."""
        return self.inertia.system.direct

    @property
    def coordinates(self) -> Array | None:
        """Coordinates of the nodes."""
        return self.inertia.system.coordinates

    def at(self, Q: Array) -> Array:
        """Where potential and masses are evaluated for an end of the step."""
        return self.base + self.a * Q

    def rate(self, Q: Array) -> Array:
        """The velocity for an end of the step."""
        return (Q - self.back) / self.tau

    # -- the incremental potential, for constant mass; in J

    def _inertial(self, Q: Array) -> tuple[float, Array]:
        V = self.rate(Q)
        momentum = self.inertia.mass @ V
        return float(np.add.reduce(V * momentum)) / 2 - float(
            np.add.reduce(self.momentum * (Q - self.back))
        ) / self.tau, (momentum - self.momentum) / self.tau

    def energy(self, Q: Array) -> float:
        """The incremental potential."""
        return self.inertia.system.energy(self.at(Q)) + self._inertial(Q)[0]

    def evaluate(self, Q: Array, definite: bool = False) -> Evaluation:
        """Incremental potential, gradient, Hessian, and the size of forces."""
        energy, gradient, matrix, force = self.inertia.system.evaluate(self.at(Q), definite)
        work, slope = self._inertial(Q)
        matrix.data *= self.a * self.a
        self.inertia.add_mass(matrix, 1 / self.tau**2)
        size = float(np.abs(self.momentum[self.active]).max(initial=0.0)) / self.tau
        return Evaluation(energy + work, self.a * gradient + slope[self.active], matrix, max(self.a * force, size))

    def lacking(self, gradient: Array, step: Array) -> Array:
        """Momentum (active,) by which the end of a step differs where a step of less than rounding is still to be made.

        With the residual r and the step d, K the stiffness: force and inertia balance at ``F - a K d``, and
        ``(a a K + M/tau^2) d = -r``.
        """
        return (gradient + self.inertia.active_mass @ step / self.tau**2) * self.tau / self.a

    def worst(self, Q: Array) -> Worst | None:
        """The element of the greatest residual."""
        return self.inertia.system.worst(self.at(Q))

    def softness(self, Q: Array) -> float:
        """One: inertia keeps a step from creeping."""
        return 1.0

    def softened(self, factor: float) -> Increment:
        """Itself."""
        return self

    # -- the residual, for any mass

    def residual(self, Q: Array) -> tuple[Array, float]:
        """Residual over the time step (active,), N, and the size of the forces in it."""
        system = self.inertia.system
        q, v = self.at(Q), self.rate(Q)
        kinetic = self.inertia.kinetic(q, v)
        slope = system.slope(q)
        total = (kinetic.momentum - self.momentum) / self.tau - self.a * (kinetic.slope - slope)
        size = max(np.abs(part[system.active]).max(initial=0.0) for part in (kinetic.momentum / self.tau, slope))
        return total[system.active], float(size)

    def solve(self, Q: Array, solver: Any = None, iterations: int = 60) -> Array:
        """The end of the step by Newton's method on the residual, started anew with frozen inertia where it fails.

        Raises
        ------
        NotConverged
            No solution after so many iterations, or no step possible.
        """
        try:
            return self._newton(Q, solver, iterations // 2)
        except NotConverged as error:
            failed = error
        for _ in range(3):
            try:
                Q = minimise(Frozen(self, Q), Q, residual=1e-9, step=1e-12, stable=False, iterations=100).Q
                return self._newton(Q, solver, iterations // 2)
            except (NotConverged, ElementError) as error:
                failed = error if isinstance(error, NotConverged) else failed
        raise failed

    def _newton(self, Q: Array, solver: Any, iterations: int) -> Array:
        system = self.inertia.system
        history: list[Iteration] = []
        solver = solver or SuperLU(self.nodes, self.coordinates)
        best, last = Q, np.inf
        for _ in range(iterations):
            q, v = self.at(Q), self.rate(Q)
            found, size = self.residual(Q)
            worst = float(np.abs(found).max(initial=0.0))
            even, skew = self.inertia.jacobian(q, v, 1 / self.tau**2, self.a / self.tau, self.a * self.a)
            matrix = (even + self.a * self.a * system.hessian(q) + skew).tocsc()
            try:
                step = solver.factorise(matrix).solve(-found)
            except LinearSolveError as error:
                raise NotConverged(f"the step cannot be solved for: {error}", best, history, self.worst(Q)) from error
            length = float(np.abs(step).max(initial=0.0))
            history.append(Iteration(0.0, worst, length, "full"))
            noise = 4 * EPSILON * (abs(matrix) @ np.abs(Q[self.active]))
            if (
                length <= 1e-14 * np.ptp(Q)
                or worst <= 1e-13 * size
                or (length < 1e-9 * np.ptp(Q) and (np.abs(found) <= noise).all())
            ):
                return self._moved(Q, step)
            if length < last:
                best, last = Q, length
            Q = self._tried(Q, step, best, history)
        raise NotConverged(f"no end of the step after {iterations} iterations", best, history, self.worst(best))

    def _moved(self, Q: Array, step: Array) -> Array:
        Q = Q.copy()
        Q[self.active] += step
        return Q

    def _tried(self, Q: Array, step: Array, best: Array, history: list[Iteration]) -> Array:
        for share in 0.5 ** np.arange(30):
            end = self._moved(Q, share * step)
            try:
                self.inertia.system.slope(self.at(end))
                return end
            except ElementError:
                continue
        raise NotConverged("no step is possible", best, history, self.worst(best))
