"""The directions in which an equilibrium is unstable."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigsh

from yarnverify.simulation.linear import Factor, LinearSolveError

Array = NDArray[Any]
SMALL = 200  # unknowns up to which all eigenvalues cost next to nothing


def negative_direction(matrix: Any, factor: Factor | None) -> Array | None:
    """A direction v, greatest entry 1, in which a symmetric matrix is negative: v.A v < 0 beyond rounding; None if none is found.

    Parameters
    ----------
    factor
        Of the matrix, for inverse iteration; without it only small matrices are looked at.
    """
    n = matrix.shape[0]
    if n <= SMALL:
        v = np.linalg.eigh(matrix.toarray())[1][:, 0]
    elif factor is None:
        return None
    else:
        inverse = LinearOperator((n, n), matvec=factor.solve, dtype=float)
        start = np.random.default_rng(0).normal(size=n)
        try:  # the most negative of the inverse eigenvalues is the negative one nearest to zero
            v = eigsh(matrix, k=1, sigma=0.0, which="SA", OPinv=inverse, v0=start, tol=1e-4, maxiter=300)[1][:, 0]
        except (ArpackError, ArpackNoConvergence, LinearSolveError):
            return None
    return v / v[np.argmax(np.abs(v))] if is_negative(matrix, v) else None


def is_negative(matrix: Any, v: Array) -> bool:
    """Whether v.A v is less than zero by more than rounding explains."""
    size = np.abs(v)
    noise = 16 * np.finfo(float).eps * float(size @ (abs(matrix) @ size))
    return bool(v @ (matrix @ v) < -noise)
