"""Newton's method that lets the good full step through.

A nearly inextensible yarn bends along a curved valley. A full step leaves the valley, high up, and the next one comes back,
much further on; a line search on the energy would forbid the first and creep. So full steps are taken as long as there is
progress now and then, in the energy or in the length of the step (a watchdog; Chamberlain and others 1982), and only when
there is none does the search go back to the best state and continue with a line search. At the end the energy must have
decreased, and the Hessian must have no negative eigenvalue: an unstable equilibrium is left along the negative direction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from yarnverify.kernels import ElementError
from yarnverify.simulation.assembly import Evaluation, Worst
from yarnverify.simulation.linear import Banded, Factor, LinearSolveError, Multifrontal, Solver
from yarnverify.simulation.linear.threads import one_thread
from yarnverify.simulation.stability import downhill, negative_direction

Array = NDArray[Any]
EPSILON = float(np.finfo(float).eps)
FEW = 4  # negative eigenvalues up to which their directions are found one by one
NEAR = 0.1  # of the extent: the length of a step within which its negative directions mean a saddle
NARROW = 24  # band up to which banded Cholesky beats fronts


class Problem(Protocol):
    """What can be minimised: a system, or a step of a motion."""

    @property
    def active(self) -> Array:
        """Indices of the unknowns."""

    @property
    def nodes(self) -> Array:
        """Node of each unknown."""

    @property
    def coordinates(self) -> Array | None:
        """Coordinates of the nodes, where all have some."""

    def energy(self, Q: Array) -> float:
        """Energy of a configuration."""

    def evaluate(self, Q: Array, definite: bool = False) -> Evaluation:
        """Energy, gradient, Hessian or its semi-definite form, and the size of forces."""

    def worst(self, Q: Array) -> Worst | None:
        """The element of the greatest residual."""

    def softness(self, Q: Array) -> float:
        """The factor by which stretch would have to be softer to be no stiffer than the rest; 1 where it is not."""

    def softened(self, factor: float) -> Problem:
        """The problem with softer stretch."""


class Iteration(NamedTuple):
    """One iteration: energy, J; greatest entry of the gradient; of the step, m; how the step was made."""

    energy: float
    residual: float
    step: float
    kind: Literal["full", "search", "departure", "return", "end"]


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """What was found.

    Attributes
    ----------
    Q, energy
        The configuration and its energy.
    history
        All iterations; the last one made no step.
    negative
        Negative eigenvalues of the Hessian: 0, or None if the solver cannot tell.
    departures
        Unstable equilibria that were left.
    seconds
        Time by ``evaluation`` and ``solve``.
    """

    Q: Array
    energy: float
    history: list[Iteration]
    negative: int | None
    departures: int
    seconds: dict[str, float]

    @property
    def iterations(self) -> int:
        """Number of steps."""
        return sum(line.kind not in ("end", "return") for line in self.history)


class NotConverged(ArithmeticError):
    """No equilibrium was found.

    Attributes
    ----------
    Q
        The best state: of lowest energy.
    history
        All iterations.
    worst
        The element that holds most of the greatest residual there: its term, element, energy and state.
    """

    def __init__(self, reason: str, Q: Array, history: list[Iteration], worst: Worst | None) -> None:
        residuals = ", ".join(f"{line.residual:.1e}" for line in history[-5:])
        text = f"{reason}; last residuals {residuals} N"
        if worst is not None:
            text += f"; worst element: {worst.term} {worst.element}, energy {worst.energy:.3e} J, state {worst.state.tolist()}"
        super().__init__(text)
        self.reason, self.Q, self.history, self.worst = reason, Q, history, worst


@dataclass(frozen=True)
class Options:
    """How far and how long.

    Attributes
    ----------
    residual
        Greatest entry of the gradient, relative to the greatest force in any element.
    step
        Greatest entry of a step, relative to the extent of the configuration.
    iterations
        Greatest number of them.
    patience
        Full steps without progress before a line search.
    stable
        Whether unstable equilibria are left.
    """

    residual: float = 1e-12
    step: float = 1e-14
    iterations: int = 300
    patience: int = 5
    stable: bool = True


def solver_for(problem: Problem, matrix: Any) -> Solver:
    """A direct solver that suits a matrix: banded for a narrow band, else multifrontal."""
    column = np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))
    if matrix.nnz == 0 or np.abs(matrix.indices - column).max() <= NARROW:
        return Banded()
    return Multifrontal(problem.nodes, problem.coordinates)


@dataclass(eq=False)
class Search:
    """A search and its state: where it is, the best so far, and how many line searches are still to be made."""

    problem: Problem
    Q: Array
    solver: Solver | None
    report: Callable[[Iteration], None] | None
    options: Options
    returns: int = 1000  # how often it may go back to the best state before it gives up
    searching: int = 0  # line searches still to be made
    history: list[Iteration] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=lambda: {"evaluation": 0.0, "solve": 0.0})
    departures: int = 0
    _next: Evaluation | None = None
    _lowest: Array = field(default_factory=lambda: np.empty(0))
    _lowest_energy: float = np.inf
    _energy: float = np.inf
    _residual: float = np.inf
    _step: float = np.inf
    _stale: int = 0
    _fulls: int = 0

    @one_thread()
    def run(self) -> Equilibrium:
        """Iterate to the end."""
        self._lowest, self._lowest_energy = self.Q.copy(), np.inf
        self._start_again(self.Q, self.searching)
        ceiling, first = np.inf, True  # energy that the end must not exceed
        while len(self.history) < self.options.iterations and self.returns >= 0:
            value = self._evaluate(False)
            ceiling = min(ceiling, value.energy) if first else ceiling
            first = False
            progress = self._remember(value)
            factor, step = None, np.zeros(0)
            rest = float(np.abs(value.gradient).max(initial=0.0)) <= self.options.residual * value.force
            if not rest:
                factor, step = self._direction(value)
                rest = self._explained(value, step)
            if rest:
                departure, negative = self._stability(value, factor)
                if departure is not None:
                    self.departures += 1
                    self._note(value, float(np.abs(departure - self.Q).max()), "departure")
                    self._start_again(departure, 3)
                elif value.energy > ceiling + 1e-9 * abs(ceiling):
                    self._return(value)
                else:
                    self._note(value, 0.0, "end")
                    return Equilibrium(self.Q, value.energy, self.history, negative, self.departures, self.seconds)
                continue
            size = float(np.abs(step).max())
            progress |= size < 0.5 * self._step
            self._step = min(size, self._step)
            self._stale = 0 if progress or self.searching else self._stale + 1
            self._fulls += not self.searching
            if self._stale > self.options.patience or self._fulls > 6 * self.options.patience:
                self._return(value)
            elif self.searching:
                self.searching -= 1
                self._note(value, self._search(value, step), "search")
            else:
                self._note(value, self._full(value, step), "full")
        worst = self.problem.worst(self._lowest)
        raise NotConverged(f"no equilibrium after {len(self.history)} iterations", self._lowest, self.history, worst)

    # -- the course of a search

    def _start_again(self, Q: Array, searches: int) -> None:
        self.Q, self._next = Q.copy(), None
        self._energy, self._step, self._stale, self._fulls = np.inf, np.inf, 0, 0
        self._residual, self.searching = np.inf, searches

    def _return(self, value: Evaluation) -> None:
        self._note(value, 0.0, "return")
        self.returns -= 1
        self._start_again(self._lowest, 15)

    def _remember(self, value: Evaluation) -> bool:
        """Keep the best state; whether the energy has decreased since the last start."""
        if value.energy < self._lowest_energy:
            self._lowest, self._lowest_energy = self.Q.copy(), value.energy
        if not value.energy < self._energy:
            return False
        self._energy = value.energy
        return True

    def _note(self, value: Evaluation, step: float, kind: Any) -> None:
        line = Iteration(value.energy, float(np.abs(value.gradient).max(initial=0.0)), step, kind)
        self.history.append(line)
        if self.report is not None:
            self.report(line)

    def _explained(self, value: Evaluation, step: Array) -> bool:
        """Whether the coordinates cannot be told any better: the step or the residual is what rounding them makes of it."""
        size, extent = float(np.abs(step).max()), float(np.ptp(self.Q))
        if size <= self.options.step * extent:
            return True
        if size > 1e-7 * extent:
            return False
        found = np.abs(value.gradient)
        before, self._residual = self._residual, float(found.max())
        noise = EPSILON * (abs(value.matrix) @ np.abs(self.Q[self.problem.active]))
        if (found <= np.maximum(noise, self.options.residual * value.force)).all():
            return True
        return bool((found <= 8 * noise).all()) and self._residual > 0.5 * before

    # -- steps

    def _timed(self, Q: Array, definite: bool) -> Evaluation:
        start = perf_counter()
        try:
            return self.problem.evaluate(Q, definite)
        finally:
            self.seconds["evaluation"] += perf_counter() - start

    def _evaluate(self, definite: bool) -> Evaluation:
        known, self._next = self._next, None
        value = self._timed(self.Q, definite) if known is None or definite else known
        if not np.isfinite(value.gradient).all():
            raise NotConverged("the gradient is not finite", self._lowest, self.history, None)
        return value

    def _direction(self, value: Evaluation) -> tuple[Factor | None, Array]:
        """Newton's step; near a saddle with negative directions turned round, else with a semi-definite form of the Hessian."""
        try:
            factor = self._factorise(value.matrix)
            if factor.negative is None or factor.negative <= FEW:
                step = self._solve(factor, -value.gradient)
                if not factor.negative:
                    return factor, step
                if float(np.abs(step).max()) < NEAR * float(np.ptp(self.Q)):
                    return factor, self._short(downhill(value.matrix, factor, step))
        except LinearSolveError:
            pass
        matrix = self._evaluate(True).matrix
        size = float(matrix.diagonal().max(initial=0.0)) or 1.0
        shift = 0.0
        for _ in range(12):
            try:
                factor = self._factorise(
                    matrix + shift * sparse.eye_array(matrix.shape[0], format="csc") if shift else matrix
                )
                if not factor.negative:
                    return None, self._short(self._solve(factor, -value.gradient))
            except LinearSolveError:
                pass
            shift = max(10 * shift, 1e-11 * size)
        raise NotConverged("no descent direction", self._lowest, self.history, self.problem.worst(self.Q))

    def _short(self, step: Array) -> Array:
        """A step of at most the extent: a form without negative curvature may have none at all in some directions."""
        size, extent = float(np.abs(step).max()), float(np.ptp(self.Q))
        return step * (extent / size) if size > extent else step

    def _factorise(self, matrix: Any) -> Factor:
        if self.solver is None:
            self.solver = solver_for(self.problem, matrix)
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

    def _at(self, step: Array, share: float) -> Array:
        Q = self.Q.copy()
        Q[self.problem.active] += share * step
        return Q

    def _energy_at(self, Q: Array) -> float:
        """Energy, infinite where it does not exist."""
        start = perf_counter()
        try:
            found = self.problem.energy(Q)
            return found if np.isfinite(found) else np.inf
        except ElementError:
            return np.inf
        finally:
            self.seconds["evaluation"] += perf_counter() - start

    def _full(self, value: Evaluation, step: Array) -> float:
        """The full step, or a search where it leads out of the domain of an element."""
        Q = self._at(step, 1.0)
        try:
            self._next = self._timed(Q, False)
        except ElementError:
            return self._search(value, step)
        self.Q = Q
        return float(np.abs(step).max())

    def _search(self, value: Evaluation, step: Array) -> float:
        """A step that decreases the energy enough (Armijo), by halving."""
        slope = float(value.gradient @ step)
        noise = 1e-13 * abs(value.energy)
        share = 1.0
        for _ in range(60):
            Q = self._at(step, share)
            if self._energy_at(Q) <= value.energy + 1e-4 * share * slope + noise:
                self.Q = Q
                return share * float(np.abs(step).max())
            share /= 2
        return 0.0  # there is nothing to be gained in this direction

    def _stability(self, value: Evaluation, factor: Factor | None) -> tuple[Array | None, int | None]:
        """A state of lower energy beside an unstable equilibrium, and else the number of negative eigenvalues."""
        if not self.options.stable or not value.gradient.size:
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
        size = 0.1 * float(np.ptp(self.Q))
        for _ in range(30):
            for sign in (1.0, -1.0):
                Q = self._at(direction, sign * size)
                if self._energy_at(Q) < value.energy - 1e-14 * abs(value.energy):
                    return Q, None
            size /= 2
        return None, 0  # neutral, as far as the energy can tell
