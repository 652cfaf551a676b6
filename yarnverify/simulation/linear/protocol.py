"""What a linear solver is, and the check that every solution passes."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
TOLERANCE = 1e-9  # of a residual, relative to |A| |x| + |b|


class LinearSolveError(ArithmeticError):
    """A matrix that could not be factorised, or a solution that does not solve.

    ``direction`` is a vector v with v.A v < 0, where a solver has come upon one.
    """

    def __init__(self, message: str, direction: Array | None = None) -> None:
        super().__init__(message)
        self.direction = direction


class Factor(Protocol):
    """A factorised matrix."""

    @property
    def negative(self) -> int | None:
        """Number of negative eigenvalues; None if this is not known."""

    def solve(self, b: Array) -> Array:
        """The solution for a right-hand side (n,)."""


class Solver(Protocol):
    """Factorises matrices of one pattern."""

    def factorise(self, matrix: Any) -> Factor:
        """The factor of a sparse matrix (n, n)."""


def same_pattern(matrix: Any, known: Any) -> bool:
    """Whether a sparse matrix has a known pattern (see ``pattern_of``); None is none."""
    if known is None:
        return False
    return all(a is b or np.array_equal(a, b) for a, b in zip(pattern_of(matrix), known, strict=True))


def pattern_of(matrix: Any) -> tuple[Array, Array]:
    """What a sparse matrix is without its values, to compare with."""
    return matrix.indptr, matrix.indices


def checked(matrix: Any, b: Array, x: Array, again: Any, name: str, tolerance: float = TOLERANCE) -> Array:
    """A solution whose residual is small, refined once where it is not.

    Parameters
    ----------
    again
        A function that solves for another right-hand side.

    Raises
    ------
    LinearSolveError
        Values that are not finite, or a residual that stays large.
    """
    for attempt in range(2):
        residual = b - matrix @ x
        given = np.maximum.reduce(np.abs(b), initial=0.0)
        worst = float(np.maximum.reduce(np.abs(residual), initial=0.0))  # not a number, or infinite, where x is
        if worst <= min(tolerance, 0.1) * given:
            return x
        if not np.isfinite(x).all():
            raise LinearSolveError(f"{name}: the solution is not finite: the matrix is singular")
        size = norm(matrix) * np.maximum.reduce(np.abs(x), initial=0.0) + given
        if worst <= tolerance * size and worst <= 0.1 * given:
            return x
        if attempt == 0:
            x = x + again(residual)
    raise LinearSolveError(
        f"{name}: the residual {worst:.1e} is too large against |A| |x| + |b| = {size:.1e}: the matrix is singular or nearly so"
    )


def norm(matrix: Any) -> float:
    """Greatest entry of a sparse matrix in absolute value: a lower bound of its norm."""
    data = matrix.data
    return max(float(np.maximum.reduce(data, initial=0.0)), -float(np.minimum.reduce(data, initial=0.0)))
