"""The directions in which an equilibrium is unstable."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigsh

from yarnverify.simulation.linear import Factor, LinearSolveError

Array = NDArray[Any]
SMALL = 700  # unknowns up to which a dense matrix is faster: soft directions make Lanczos vectors converge slowly


def lowest(matrix: Any, factor: Factor, count: int) -> Array:
    """Unit eigenvectors of the lowest eigenvalues of a small matrix, else of the negative ones nearest to zero; (n, count).

    Raises
    ------
    LinearSolveError
        They were not found.
    """
    n = matrix.shape[0]
    if n <= SMALL:
        return np.asarray(eigh(matrix.toarray(), subset_by_index=[0, count - 1])[1])
    inverse = LinearOperator((n, n), matvec=factor.solve, dtype=float)
    start = np.random.default_rng(0).normal(size=n)
    try:  # the most negative of the inverse eigenvalues belong to the negative ones nearest to zero
        return eigsh(matrix, k=count, sigma=0.0, which="SA", OPinv=inverse, v0=start, tol=1e-6, maxiter=300)[1]
    except (ArpackError, ArpackNoConvergence) as error:
        raise LinearSolveError(f"eigenvectors were not found: {error}") from None


def downhill(matrix: Any, factor: Factor, step: Array) -> Array:
    """Newton's step with its part along negative directions turned round, so that it leads away from saddles."""
    assert factor.negative
    vectors = lowest(matrix, factor, factor.negative)
    return step - 2 * vectors @ (vectors.T @ step)


def negative_direction(matrix: Any, factor: Factor | None) -> Array | None:
    """A direction v, greatest entry 1, in which a symmetric matrix is negative (v.A v < 0 beyond rounding), or None."""
    if factor is None:
        return None
    try:
        v = lowest(matrix, factor, 1)[:, 0]
    except LinearSolveError:
        return None
    return v / v[np.argmax(np.abs(v))] if is_negative(matrix, v) else None


def is_negative(matrix: Any, v: Array) -> bool:
    """Whether v.A v is less than zero by more than rounding explains."""
    size = np.abs(v)
    noise = 16 * np.finfo(float).eps * float(size @ (abs(matrix) @ size))
    return bool(v @ (matrix @ v) < -noise)
