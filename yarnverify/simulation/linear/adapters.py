"""Solvers of other packages, where they are installed: qdldl (LDL^T with the pivots in order) and pyamg (multigrid)."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from yarnverify.errors import NotRunError
from yarnverify.simulation.linear.protocol import LinearSolveError, checked

Array = NDArray[Any]


def _module(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise NotRunError(f"the solver {name} is not installed: pip install {name}") from None


class Qdldl:
    """``qdldl`` orders by approximate minimum degree and tells pivots apart by their sign."""

    def __init__(self) -> None:
        self._package = _module("qdldl")

    def factorise(self, matrix: Any) -> QdldlFactor:
        """Factorise a symmetric sparse matrix."""
        try:
            return QdldlFactor(matrix, self._package.Solver(sparse.csc_matrix(matrix)))
        except (RuntimeError, ValueError) as error:
            raise LinearSolveError(f"qdldl: {error}") from None


class QdldlFactor:
    """A factor of qdldl."""

    def __init__(self, matrix: Any, solver: Any) -> None:
        self._matrix, self._solver = matrix, solver

    @property
    def negative(self) -> int:
        """Number of negative pivots."""
        return int((self._solver.factors()[1] < 0).sum())

    def solve(self, b: Array) -> Array:
        """The solution, residual checked."""
        return checked(self._matrix, b, self._solver.solve(b), self._solver.solve, "qdldl")


class PyAMG:
    """Smoothed aggregation of ``pyamg`` as preconditioner of conjugate gradients."""

    def __init__(self, tolerance: float = 1e-10) -> None:
        self._package, self._tolerance = _module("pyamg"), tolerance

    def factorise(self, matrix: Any) -> PyAMGFactor:
        """Set up the levels for a positive definite sparse matrix."""
        levels = self._package.smoothed_aggregation_solver(sparse.csr_matrix(matrix))
        return PyAMGFactor(matrix, levels, self._tolerance)


class PyAMGFactor:
    """A multigrid hierarchy."""

    negative: int | None = None

    def __init__(self, matrix: Any, levels: Any, tolerance: float) -> None:
        self._matrix, self._levels, self._tolerance = matrix, levels, tolerance

    def solve(self, b: Array) -> Array:
        """The solution, residual checked."""

        def again(r: Array) -> Array:
            return np.asarray(self._levels.solve(r, tol=self._tolerance, accel="cg", maxiter=1000))

        return checked(self._matrix, b, again(b), again, "pyamg")
