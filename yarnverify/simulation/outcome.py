"""What a search for an equilibrium may take, and what comes out of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from numpy.typing import NDArray

from yarnverify.kernels import ElementError
from yarnverify.simulation.linear import LinearSolveError
from yarnverify.simulation.problem import Worst

Array = NDArray[Any]
Kind = Literal["full", "search", "departure", "return", "end"]


class Iteration(NamedTuple):
    """One iteration: energy, J; greatest entry of the gradient; of the step, m; how the step was made."""

    energy: float
    residual: float
    step: float
    kind: Kind


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
    gradient, step
        Gradient there and the step that it still asks for, too small to be told from rounding, (active,); zeros if unknown.
    """

    Q: Array
    energy: float
    history: list[Iteration]
    negative: int | None
    departures: int
    seconds: dict[str, float]
    gradient: Array
    step: Array

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
        text = f"{reason}; last residuals {residuals} N" if history else reason
        if worst is not None:
            text += f"; worst element: {worst.term} {worst.element}, energy {worst.energy:.3e} J, state {worst.state.tolist()}"
        super().__init__(text)
        self.reason, self.Q, self.history, self.worst = reason, Q, history, worst


UNSOLVED = (NotConverged, ElementError, LinearSolveError)  # what keeps a stage or a step from its end


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

    def __post_init__(self) -> None:
        for name in ("residual", "step"):
            if not 0 <= getattr(self, name) < 1:
                raise ValueError(f"{name} = {getattr(self, name)} must be between 0 and 1: it is a relative size")
        for name in ("iterations", "patience"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} = {getattr(self, name)} must be at least 1")
