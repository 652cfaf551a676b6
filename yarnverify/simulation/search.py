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
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from yarnverify.kernels import ElementError
from yarnverify.simulation.linear import Factor, LinearSolveError
from yarnverify.simulation.linear.threads import one_thread
from yarnverify.simulation.outcome import Equilibrium, Iteration, Kind, NotConverged, Options
from yarnverify.simulation.problem import Evaluation
from yarnverify.simulation.steps import Steps

__all__ = ["EPSILON", "Equilibrium", "Iteration", "NotConverged", "Options", "Search"]

Array = NDArray[Any]
EPSILON = float(np.finfo(float).eps)
SEEN = 1e-13  # of the extent: steps that count, of a state whose forces are all explained by rounding
_NOTHING = sparse.csc_array((0, 0))


def greatest(values: Array) -> float:
    """The greatest entry in absolute value, 0 of none."""
    return float(np.maximum.reduce(np.abs(values), initial=0.0))


@dataclass(eq=False)
class Search:
    """A search and its state: where it is, the best so far, and how many line searches are still to be made."""

    steps: Steps
    Q: Array
    report: Callable[[Iteration], None] | None
    options: Options
    returns: int | Callable[[], int] = 1000  # how often it may go back to the best state; asked for when it first does
    searching: int = 0  # line searches still to be made
    history: list[Iteration] = field(default_factory=list)
    departures: int = 0
    _next: Evaluation | None = None
    _lowest: Array = field(default_factory=lambda: np.empty(0))
    _lowest_energy: float = np.inf
    _energy: float = np.inf
    _residual: float = np.inf
    _shown: float = np.inf
    _extent: float = 0.0
    _step: float = np.inf
    _stale: int = 0
    _fulls: int = 0
    _left: int = 0
    _gone: bool = False

    @one_thread()
    def run(self) -> Equilibrium:
        """Iterate to the end."""
        self._lowest, self._lowest_energy = self.Q, np.inf  # no configuration is changed in place
        self._start_again(self.Q, self.searching)
        ceiling, first = np.inf, True  # energy that the end must not exceed
        while len(self.history) < self.options.iterations and self._left >= 0:
            value = self._evaluate()
            ceiling = min(ceiling, value.energy) if first else ceiling
            first = False
            progress = self._remember(value)
            factor, step = None, np.zeros(0)
            residual = size = greatest(value.gradient)
            if not isfinite(residual):
                raise NotConverged("the gradient is not finite", self._lowest, self.history, None)
            rest = residual <= self.options.residual * value.force
            if not rest:
                factor, step = self._direction(value)
                size = greatest(step)
                rest = self._explained(value, residual, size)
            if rest:
                departure, negative = self._beside(value, factor)
                if departure is not None:
                    self.departures += 1
                    self._note(value, residual, greatest(departure - self.Q), "departure")
                    self._start_again(departure, 3)
                elif value.energy > ceiling + 1e-9 * abs(ceiling):
                    self._return(value, residual)
                else:
                    self._note(value, residual, 0.0, "end")
                    left = step if step.size else np.zeros_like(value.gradient)
                    return Equilibrium(self.Q, value.energy, self.history, negative, self.departures, self.steps.seconds,
                                       value.gradient, left)  # fmt: skip
                continue
            rough = factor is None  # a step of the semi-definite form
            # the memory of matrix and factor goes before that of the next ones comes
            value, factor = Evaluation(value.energy, value.gradient, _NOTHING, value.force), None
            progress |= size < 0.5 * self._step
            self._step = min(size, self._step)
            self._stale = 0 if progress or self.searching else self._stale + 1
            self._fulls += not self.searching
            if self._stale > self.options.patience or self._fulls > 6 * self.options.patience:
                self._return(value, residual)
            elif self.searching:
                self.searching -= 1
                self._note(value, residual, self._searched(value, step), "search")
            else:
                self._note(value, residual, self._full(value, step, size, rough), "full")
        raise self._failed(f"no equilibrium after {len(self.history)} iterations")

    # -- the course of a search

    def _start_again(self, Q: Array, searches: int) -> None:
        self.Q, self._next = Q, None
        self._energy, self._step, self._stale, self._fulls = np.inf, np.inf, 0, 0
        self._residual, self._shown, self.searching = np.inf, np.inf, searches
        self._extent = float(np.ptp(Q))

    def _return(self, value: Evaluation, residual: float) -> None:
        self._note(value, residual, 0.0, "return")
        if not self._gone:
            self._left = self.returns() if callable(self.returns) else self.returns
        self._gone, self._left = True, self._left - 1
        self._start_again(self._lowest, 15)

    def _remember(self, value: Evaluation) -> bool:
        """Keep the best state; whether the energy has decreased since the last start."""
        if value.energy < self._lowest_energy:
            self._lowest, self._lowest_energy = self.Q, value.energy
        if not value.energy < self._energy:
            return False
        self._energy = value.energy
        return True

    def _note(self, value: Evaluation, residual: float, step: float, kind: Kind) -> None:
        line = Iteration(value.energy, residual, step, kind)
        self.history.append(line)
        if self.report is not None:
            self.report(line)

    def _explained(self, value: Evaluation, residual: float, size: float) -> bool:
        """Whether the coordinates cannot be told any better: the step or the residual is what rounding them makes of it."""
        extent = self._extent
        if size <= self.options.step * extent:
            return True
        # a soft direction may go to and fro with rounding for ever
        idle = self._stale >= 2 and residual <= 1e-6 * value.force
        if size > 1e-7 * extent and not idle:
            return False
        found = np.abs(value.gradient)
        before, self._residual = self._residual, residual
        noise = EPSILON * (abs(value.matrix) @ np.abs(self.Q[self.steps.problem.active]))
        small = bool((found <= np.maximum(noise, self.options.residual * value.force)).all())
        if not small and (self._residual <= 0.5 * before or (found > 8 * noise).any()):
            return False
        # forces are those of the coordinates as they are rounded, so that steps go on telling where residuals cannot
        shorter, self._shown = size < 0.5 * self._shown, size
        return size <= SEEN * extent or not shorter

    # -- steps

    def _evaluate(self) -> Evaluation:
        known, self._next = self._next, None
        try:
            value = self.steps.evaluate(self.Q) if known is None else known
        except ElementError as error:
            if not self.history:
                raise
            raise NotConverged(f"the search led to where {error}", self._lowest, self.history, None) from error
        return value

    def _direction(self, value: Evaluation) -> tuple[Factor | None, Array]:
        try:
            return self.steps.direction(self.Q, value)
        except LinearSolveError as error:
            raise self._failed(str(error)) from error

    def _full(self, value: Evaluation, step: Array, size: float, rough: bool) -> float:
        """The full step, or a search where it leads out of the domain of an element; more of it where it is a rough one."""
        Q, share = self.steps.moved(self.Q, step), 1.0
        try:
            self._next = self.steps.evaluate(Q)
        except ElementError:
            return self._searched(value, step)
        if rough and self._next.energy < value.energy:
            share = self.steps.stretched(self.Q, self._next.energy, step)
        if share > 1:
            Q, self._next = self.steps.moved(self.Q, step, share), None
        self.Q = Q
        return share * size

    def _searched(self, value: Evaluation, step: Array) -> float:
        self.Q, length = self.steps.line_search(self.Q, value, step)
        return length

    def _beside(self, value: Evaluation, factor: Factor | None) -> tuple[Array | None, int | None]:
        return self.steps.beside(self.Q, value, factor) if self.options.stable else (None, None)

    def _failed(self, reason: str) -> NotConverged:
        return NotConverged(reason, self._lowest, self.history, self.steps.problem.worst(self._lowest))
