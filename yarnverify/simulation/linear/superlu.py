"""SciPy's SuperLU on the ordering of nodes; also for matrices that are not symmetric."""

from __future__ import annotations

import warnings
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import MatrixRankWarning, splu

from yarnverify.simulation.linear.ordering import dissect
from yarnverify.simulation.linear.protocol import LinearSolveError, checked, pattern_of, same_pattern

Array = NDArray[Any]


class SuperLU:
    """LU with diagonal pivots wherever they are not zero.

    Parameters
    ----------
    nodes
        Node of each unknown (n,). Without it, SuperLU orders the unknowns itself by minimum degree.
    coordinates
        Coordinates of the nodes, (nodes, k).
    """

    def __init__(self, nodes: Array | None = None, coordinates: Array | None = None) -> None:
        self._nodes, self._coordinates = nodes, coordinates
        self._order: Array | None = None
        self._known: Any = None

    def factorise(self, matrix: Any) -> SuperFactor:
        """Factorise a square sparse matrix.

        Raises
        ------
        LinearSolveError
            The matrix is exactly singular, or memory does not suffice.
        """
        matrix = sparse.csc_array(matrix)
        if self._nodes is not None and not same_pattern(matrix, self._known):
            self._known = pattern_of(matrix)
            self._order = np.argsort(ranks(matrix, self._nodes, self._coordinates), kind="stable")
        order = self._order
        options = {"SymmetricMode": True}
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", MatrixRankWarning)
                if order is None:
                    lu = splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
                else:
                    lu = splu(matrix[order][:, order].tocsc(), "NATURAL", diag_pivot_thresh=0.0, options=options)
        except (RuntimeError, MatrixRankWarning, MemoryError) as error:
            raise LinearSolveError(f"SuperLU: {error}") from None
        return SuperFactor(matrix, lu, order)


class SuperFactor:
    """An LU factorisation."""

    def __init__(self, matrix: Any, lu: Any, order: Array | None) -> None:
        self._matrix, self._lu, self._order = matrix, lu, order

    @cached_property
    def negative(self) -> int | None:
        """Negative pivots, if all were taken from the diagonal of a symmetric matrix."""
        if not np.array_equal(self._lu.perm_r, self._lu.perm_c):
            return None
        return int((self._lu.U.diagonal() < 0).sum())

    def solve(self, b: Array) -> Array:
        """The solution, residual checked."""
        return checked(self._matrix, b, self._raw(b), self._raw, "SuperLU")

    def _raw(self, b: Array) -> Array:
        if self._order is None:
            return np.asarray(self._lu.solve(b))
        x = np.empty_like(b)
        x[self._order] = self._lu.solve(b[self._order])
        return x


def node_graph(matrix: Any, nodes: Array) -> sparse.csr_array:
    """Which nodes a matrix couples, from which unknowns it couples."""
    count = int(nodes.max(initial=-1)) + 1
    collect = sparse.csr_array((np.ones(len(nodes), bool), (nodes, np.arange(len(nodes)))), shape=(count, len(nodes)))
    pattern = sparse.csr_array((np.ones(matrix.nnz, bool), matrix.indices, matrix.indptr), shape=matrix.shape)
    graph = sparse.csr_array(collect @ pattern @ collect.T)
    graph.sort_indices()
    return graph


def ranks(matrix: Any, nodes: Array, coordinates: Array | None) -> Array:
    """Place of each unknown's node in the order of elimination, (n,)."""
    order = dissect(node_graph(matrix, nodes), coordinates).order
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return rank[nodes]
