"""The steps of a search: how far, in which direction, and how an unstable equilibrium is left."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from yarnverify.kernels import ElementError
from yarnverify.simulation.linear import Factor, LinearSolveError, Solver
from yarnverify.simulation.problem import Evaluation, Problem
from yarnverify.simulation.stability import downhill, negative_direction

Array = NDArray[Any]
FEW = 4  # negative eigenvalues up to which their directions are found one by one
NEAR = 0.1  # of the extent: the longest step where there are negative directions


@dataclass(eq=False)
class Steps:
    """Evaluations and solutions of a problem, and the time that they take."""

    problem: Problem
    solver: Solver
    seconds: dict[str, float] = field(default_factory=lambda: {"evaluation": 0.0, "solve": 0.0})

    def evaluate(self, Q: Array, definite: bool = False) -> Evaluation:
        """Energy, gradient and Hessian of a configuration."""
        start = perf_counter()
        try:
            return self.problem.evaluate(Q, definite)
        finally:
            self.seconds["evaluation"] += perf_counter() - start

    def energy(self, Q: Array) -> float:
        """Energy, infinite where it does not exist."""
        start = perf_counter()
        try:
            found = self.problem.energy(Q)
            return found if np.isfinite(found) else np.inf
        except ElementError:
            return np.inf
        finally:
            self.seconds["evaluation"] += perf_counter() - start

    def moved(self, Q: Array, step: Array, share: float = 1.0) -> Array:
        """The configuration after a share of a step."""
        Q = Q.copy()
        Q[self.problem.active] += share * step
        return Q

    def direction(self, Q: Array, value: Evaluation) -> tuple[Factor | None, Array]:
        """Newton's step; near a saddle with negative directions turned round, else with a semi-definite form of the Hessian.

        Raises
        ------
        LinearSolveError
            Not even a shifted form can be solved with.
        """
        try:
            factor = self._factorise(value.matrix)
            if factor.negative is None or factor.negative <= FEW:
                step = self._solve(factor, -value.gradient)
                if not factor.negative:
                    return factor, step
                return factor, _short(Q, downhill(value.matrix, factor, step), NEAR)
        except LinearSolveError:
            pass
        matrix = self.evaluate(Q, True).matrix
        size = float(matrix.diagonal().max(initial=0.0)) or 1.0
        shift = 0.0
        for _ in range(12):
            try:
                factor = self._factorise(
                    matrix + shift * sparse.eye_array(matrix.shape[0], format="csc") if shift else matrix
                )
                if not factor.negative:
                    return None, _short(Q, self._solve(factor, -value.gradient))
            except LinearSolveError:
                pass
            shift = max(10 * shift, 1e-11 * size)
        raise LinearSolveError("no descent direction")

    def line_search(self, Q: Array, value: Evaluation, step: Array) -> tuple[Array, float]:
        """A configuration of enough less energy (Armijo), found by halving, and the length of the way there."""
        slope = float(value.gradient @ step)
        noise = 1e-13 * abs(value.energy)
        share = 1.0
        for _ in range(60):
            tried = self.moved(Q, step, share)
            if self.energy(tried) <= value.energy + 1e-4 * share * slope + noise:
                return tried, share * float(np.abs(step).max())
            share /= 2
        return Q, 0.0  # there is nothing to be gained in this direction

    def stretched(self, Q: Array, energy: float, step: Array) -> float:
        """How much of a step to make, by doubling as long as the energy falls below that at its end.

        A semi-definite form is as stiff as ever where the Hessian is hardly negative, so that its steps away from a saddle
        are far too short.
        """
        share, longest = 1.0, float(np.ptp(Q))
        while 2 * share * float(np.abs(step).max()) < longest:
            further = self.energy(self.moved(Q, step, 2 * share))
            if not further < energy:
                break
            share, energy = 2 * share, further
        return share

    def beside(self, Q: Array, value: Evaluation, factor: Factor | None) -> tuple[Array | None, int | None]:
        """A state of lower energy beside an unstable equilibrium, and else the number of negative eigenvalues."""
        if not value.gradient.size:
            return None, None
        try:
            factor = factor or self._factorise(value.matrix)
            if factor.negative == 0:
                return None, 0
            if factor.negative is None:
                self._solve(factor, np.random.default_rng(0).normal(size=value.gradient.size))
                return None, None
        except LinearSolveError as error:
            direction = error.direction
        else:
            direction = None
        direction = negative_direction(value.matrix, factor) if direction is None else direction
        if direction is None:
            return None, 0
        size = 0.1 * float(np.ptp(Q))
        for _ in range(30):
            for sign in (1.0, -1.0):
                tried = self.moved(Q, direction, sign * size)
                if self.energy(tried) < value.energy - 1e-14 * abs(value.energy):
                    return tried, None
            size /= 2
        # rounding hides it from the energy, as it does where yarns hardly stretch; Newton's method finds on from further away
        return self.moved(Q, direction, 0.01 * float(np.ptp(Q))), None

    def _factorise(self, matrix: Any) -> Factor:
        start = perf_counter()
        try:
            return self.solver.factorise(matrix)
        finally:
            self.seconds["solve"] += perf_counter() - start

    def _solve(self, factor: Factor, b: Array) -> Array:
        start = perf_counter()
        try:
            return factor.solve(b)
        finally:
            self.seconds["solve"] += perf_counter() - start


def _short(Q: Array, step: Array, share: float = 1.0) -> Array:
    """A step of at most a share of the extent: in some directions there may be next to no curvature to hold it."""
    size, longest = float(np.abs(step).max()), share * float(np.ptp(Q))
    return step * (longest / size) if size > longest else step
