"""What can be minimised, and what is known of it at a configuration."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

from numpy.typing import NDArray
from scipy import sparse

from yarnverify.simulation.linear import Solver

Array = NDArray[Any]


class Evaluation(NamedTuple):
    """Energy, gradient (active,) and Hessian (active, active) of a state, and the size of the forces in it."""

    energy: float
    gradient: Array
    matrix: sparse.csc_array
    force: float


class Worst(NamedTuple):
    """The element that holds most of the greatest residual."""

    term: str
    element: int
    energy: float
    state: Array


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

    @property
    def direct(self) -> Solver:
        """A direct solver for its Hessian."""

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
