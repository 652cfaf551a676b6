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


def _scale(matrix: Any) -> Array:
    """What makes the diagonal of ``S A S`` plus and minus one: a direction in which one is negative is one for the other too.

    Yarns that hardly stretch make A so uneven that its own small eigenvalues drown in rounding.
    """
    size = np.sqrt(np.abs(matrix.diagonal()))
    return 1 / np.where(size > 0, size, 1.0)


def _lowest(matrix: Any, factor: Factor, scale: Array, count: int) -> Array:
    """Unit eigenvectors of ``S A S``, of its lowest eigenvalues if small, else of the negative ones nearest zero; (n, count).

    Raises
    ------
    LinearSolveError
        They were not found.
    """
    n = matrix.shape[0]
    if n <= SMALL:
        return np.asarray(eigh(scale[:, None] * matrix.toarray() * scale, subset_by_index=[0, count - 1])[1])
    even = LinearOperator((n, n), matvec=lambda v: scale * (matrix @ (scale * v)), dtype=float)
    inverse = LinearOperator((n, n), matvec=lambda v: factor.solve(v / scale) / scale, dtype=float)
    start = np.random.default_rng(0).normal(size=n)
    try:  # the most negative of the inverse eigenvalues belong to the negative ones nearest to zero
        return eigsh(even, k=count, sigma=0.0, which="SA", OPinv=inverse, v0=start, tol=1e-6, maxiter=300)[1]
    except (ArpackError, ArpackNoConvergence) as error:
        raise LinearSolveError(f"eigenvectors were not found: {error}") from None


def downhill(matrix: Any, factor: Factor, step: Array) -> Array:
    """Newton's step with its part along negative directions turned round, so that it leads away from saddles."""
    assert factor.negative
    scale = _scale(matrix)
    vectors = _lowest(matrix, factor, scale, factor.negative)
    return step - scale * (2 * vectors @ (vectors.T @ (step / scale)))


def negative_direction(matrix: Any, factor: Factor | None) -> Array | None:
    """A direction v, greatest entry 1, in which a symmetric matrix is negative (v.A v < 0 beyond rounding), or None."""
    if factor is None:
        return None
    scale = _scale(matrix)
    try:
        v = scale * _lowest(matrix, factor, scale, 1)[:, 0]
    except LinearSolveError:
        return None
    return v / v[np.argmax(np.abs(v))] if is_negative(matrix, v) else None


def is_negative(matrix: Any, v: Array) -> bool:
    """Whether v.A v is less than zero by more than rounding explains."""
    size = np.abs(v)
    noise = 16 * np.finfo(float).eps * float(size @ (abs(matrix) @ size))
    return bool(v @ (matrix @ v) < -noise)
