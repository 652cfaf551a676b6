"""Matrices with a narrow band, such as those of a single yarn: LAPACK's banded Cholesky, or banded LU where it fails."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from yarnverify.simulation.linear.protocol import LinearSolveError, checked, pattern_of, same_pattern
from yarnverify.simulation.linear.superlu import SuperLU

Array = NDArray[Any]


class Banded:
    """Cholesky on the band; a matrix that is not positive definite goes to SuperLU, which counts its negative pivots."""

    def __init__(self) -> None:
        self._shape: tuple[Array, Array] | None = None
        self._width = 0
        self._known: Any = None
        self._other = SuperLU()

    def factorise(self, matrix: Any) -> Any:
        """Factorise a symmetric sparse matrix."""
        if self._shape is None or not same_pattern(matrix, self._known):
            column = np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))
            below = np.flatnonzero(matrix.indices >= column)
            row, column = matrix.indices[below] - column[below], column[below]
            self._width = int(row.max(initial=0))
            self._shape = (below, column * (self._width + 1) + row)
            self._known = pattern_of(matrix)
        below, place = self._shape
        band = np.zeros((matrix.shape[1], self._width + 1))
        band.reshape(-1)[place] = matrix.data[below]
        factor, info = lapack.dpbtrf(band.T, lower=1, overwrite_ab=1)
        if info == 0:
            return BandFactor(matrix, factor)
        return self._other.factorise(matrix)


class BandFactor:
    """A banded Cholesky factor."""

    negative = 0

    def __init__(self, matrix: Any, factor: Array) -> None:
        self._matrix, self._factor = matrix, factor

    def solve(self, b: Array) -> Array:
        """The solution, residual checked."""
        return checked(self._matrix, b, self._raw(b), self._raw, "banded Cholesky")

    def _raw(self, b: Array) -> Array:
        x, info = lapack.dpbtrs(self._factor, b, lower=1)
        if info:
            raise LinearSolveError(f"banded Cholesky: LAPACK says {info}")
        return x
