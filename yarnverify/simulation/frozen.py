"""A step whose sliding coordinates have inertia of their own, with that inertia frozen: then it has a potential to minimise.

Where Newton's method on the residual finds no end, the minimum for inertia frozen at the best guess is a better one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.simulation.linear import Solver
from yarnverify.simulation.problem import Evaluation, Worst

if TYPE_CHECKING:
    from yarnverify.simulation.increment import Increment

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Frozen:
    """``V(q) + T(q*, v) - P.v - a tau dT/dq(q*, v*).v`` for an end of the step, q* and v* those of a guess (size,)."""

    increment: Increment
    guess: Array

    @property
    def active(self) -> Array:
        """Indices of the unknowns."""
        return self.increment.active

    @property
    def nodes(self) -> Array:
        """Node of each unknown."""
        return self.increment.nodes

    @property
    def direct(self) -> Solver:
        """A direct solver, which knows the pattern."""
        return self.increment.direct

    @property
    def coordinates(self) -> Array | None:
        """Coordinates of the nodes."""
        return self.increment.coordinates

    @cached_property
    def _known(self) -> Array:
        """``P + a tau dT/dq(q*, v*)``, the same for every end, (size,)."""
        step, guess = self.increment, self.guess
        return step.momentum + step.a * step.tau * step.inertia.kinetic(step.at(guess), step.rate(guess)).slope

    def _inertial(self, Q: Array) -> tuple[float, Array]:
        step, v = self.increment, self.increment.rate(Q)
        found = step.inertia.kinetic(step.at(self.guess), v)
        return found.energy - float(np.add.reduce(self._known * v)), (found.momentum - self._known) / step.tau

    def energy(self, Q: Array) -> float:
        """The potential, J."""
        return self.increment.inertia.system.energy(self.increment.at(Q)) + self._inertial(Q)[0]

    def evaluate(self, Q: Array, definite: bool = False) -> Evaluation:
        """Potential, gradient, Hessian, and the size of forces."""
        step = self.increment
        found = step.inertia.system.evaluate(step.at(Q), definite)
        work, slope = self._inertial(Q)
        mass, _ = step.inertia.jacobian(step.at(self.guess), step.rate(Q), 1 / step.tau**2, 0.0, 0.0)
        matrix = (mass + step.a * step.a * found.matrix).tocsc()
        size = float(np.abs(step.momentum[self.active]).max(initial=0.0)) / step.tau
        gradient = step.a * found.gradient + slope[self.active]
        return Evaluation(found.energy + work, gradient, matrix, max(step.a * found.force, size))

    def worst(self, Q: Array) -> Worst | None:
        """The element of the greatest residual."""
        return self.increment.worst(Q)

    def softness(self, Q: Array) -> float:
        """One: inertia keeps a step from creeping."""
        return 1.0

    def softened(self, factor: float) -> Frozen:
        """Itself."""
        return self
