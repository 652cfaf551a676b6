"""Sparse LDL^T by dense blocks: the multifrontal method of Duff and Reid (1983) on a nested dissection of the nodes.

A front is the dense matrix of a group of unknowns and of those that its elimination touches; what is left of it after the
elimination is added to the front of its parent. Dense Cholesky does nearly all of the work; where a group is not positive
definite it is pivoted inside, which also gives the number of negative eigenvalues: by Haynsworth's additivity it is the sum
over the groups.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from yarnverify.simulation.linear.ordering import Dissection, dissect
from yarnverify.simulation.linear.protocol import LinearSolveError, checked, pattern_of, same_pattern
from yarnverify.simulation.linear.superlu import node_graph
from yarnverify.simulation.linear.threads import one_thread

Array = NDArray[Any]


class _Block(NamedTuple):
    """Entries of the matrix that go to a dense block: where from, where to (column by column)."""

    source: Array
    target: Array


@dataclass(frozen=True, eq=False)
class _Front:
    """Unknowns ``first`` to ``last`` in the order of elimination, and those later ones that they touch."""

    first: int
    last: int
    touched: Array
    own: _Block
    below: _Block
    parent: int
    runs: list[
        tuple[int, int, int]
    ]  # touched unknowns start to stop, and their place among the parent's own and touched


class Multifrontal:
    """A direct solver for symmetric matrices of one pattern.

    Parameters
    ----------
    nodes
        Node of each unknown, (n,); each its own without it.
    coordinates
        Coordinates of the nodes, (nodes, k).
    leaf
        Nodes of the smallest groups.
    """

    def __init__(self, nodes: Array | None = None, coordinates: Array | None = None, leaf: int = 40) -> None:
        self._nodes, self._coordinates, self._leaf = nodes, coordinates, leaf
        self._fronts: list[_Front] | None = None
        self._known: Any = None

    @one_thread()
    def factorise(self, matrix: Any) -> MultifrontalFactor:
        """Factorise a symmetric sparse matrix (n, n), both triangles given.

        Raises
        ------
        LinearSolveError
            A group is exactly singular.
        """
        if self._fronts is None or not same_pattern(matrix, self._known):
            self._analyse(matrix)
        assert self._fronts is not None
        rest: list[list[tuple[_Front, Array]]] = [[] for _ in self._fronts]
        done: list[_Eliminated] = []
        for number, front in enumerate(self._fronts):
            p, s = front.last - front.first, front.touched.size
            own, below = np.zeros((p, p), order="F"), np.zeros((s, p), order="F")
            left = np.zeros((s, s), order="F")
            own.reshape(-1, order="F")[front.own.target] = matrix.data[front.own.source]
            below.reshape(-1, order="F")[front.below.target] = matrix.data[front.below.source]
            for child, part in rest[number]:
                _extend(own, below, left, child.runs, part)
            rest[number] = []
            with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is found when solving
                eliminated, left = _eliminate(own, below, left)
            done.append(eliminated)
            if s:
                rest[front.parent].append((front, left))
        return MultifrontalFactor(matrix, self._order, self._fronts, done)

    def _analyse(self, matrix: Any) -> None:
        n = matrix.shape[0]
        nodes = np.arange(n) if self._nodes is None else np.unique(self._nodes, return_inverse=True)[1]
        where = None
        if self._nodes is not None and self._coordinates is not None:
            where = self._coordinates[np.unique(self._nodes)]
        graph = node_graph(matrix, nodes)
        tree = dissect(graph, where, self._leaf)
        rank = np.empty(graph.shape[0], np.int64)
        rank[tree.order] = np.arange(graph.shape[0])
        self._order = np.argsort(rank[nodes], kind="stable")
        place = np.empty(n, np.int64)
        place[self._order] = np.arange(n)
        start = np.concatenate([[0], np.cumsum(np.bincount(rank[nodes], minlength=graph.shape[0]))])
        column = np.repeat(np.arange(n), np.diff(matrix.indptr))
        row, column = place[matrix.indices], place[column]
        lower = np.flatnonzero(row >= column)
        lower = lower[np.argsort(column[lower], kind="stable")].astype(np.int32 if matrix.nnz < 2**31 else np.int64)
        pointer = np.searchsorted(column[lower], np.arange(n + 1))
        entries = (lower, row[lower], column[lower], pointer)
        self._fronts = list(_fronts(tree, graph, rank, start, entries))
        self._known = pattern_of(matrix)


def _fronts(tree: Dissection, graph: Any, rank: Array, start: Array, entries: Any) -> Iterator[_Front]:
    lower, row, column, pointer = entries
    touched: list[Array] = [np.empty(0, np.int64) for _ in tree.groups]
    ends = np.cumsum([len(group) for group in tree.groups])
    gathered: list[list[Array]] = [[] for _ in tree.groups]
    for k, group in enumerate(tree.groups):  # ranks of the nodes that each group touches
        around = [graph.indices[graph.indptr[node] : graph.indptr[node + 1]] for node in group]
        found = np.unique(np.concatenate([rank[np.concatenate(around)], *gathered[k]]))
        touched[k] = found[found >= ends[k]]
        gathered[k] = []
        if touched[k].size:
            gathered[tree.parents[k]].append(touched[k])
    unknowns = [_spread(start, ranks) for ranks in touched]
    for k, group in enumerate(tree.groups):
        first, last = int(start[ends[k] - len(group)]), int(start[ends[k]])
        own, s = last - first, unknowns[k].size
        part = slice(int(pointer[first]), int(pointer[last]))
        i, j, source = row[part], column[part] - first, lower[part]
        inside = i < last
        own_block = _Block(source[inside], (j[inside] * own + i[inside] - first).astype(np.int32))
        target = j[~inside] * s + np.searchsorted(unknowns[k], i[~inside])
        below = _Block(source[~inside], target.astype(np.int32 if own * s < 2**31 else np.int64))
        parent = tree.parents[k]
        runs: list[tuple[int, int, int]] = []
        if s:
            end = int(start[ends[parent]])
            begin = int(start[ends[parent] - len(tree.groups[parent])])
            place = np.where(
                unknowns[k] < end, unknowns[k] - begin, end - begin + np.searchsorted(unknowns[parent], unknowns[k])
            )
            # a run ends where places jump, and between the parent's own and the others
            cuts = np.flatnonzero((np.diff(place, prepend=-2) != 1) | (place == end - begin))
            runs = [(int(a), int(b), int(place[a])) for a, b in pairwise([*cuts, s])]
        yield _Front(first, last, unknowns[k], own_block, below, parent, runs)


def _extend(own: Array, below: Array, left: Array, runs: list[tuple[int, int, int]], part: Array) -> None:
    """Add what is left of a child (lower triangle; the other one holds nothing of use) to its parent's blocks."""
    p = len(own)
    for number, (a, b, column) in enumerate(runs):
        for c, d, row in runs[number:]:
            if row < p:
                own[row : row + d - c, column : column + b - a] += part[c:d, a:b]
            elif column < p:
                below[row - p : row - p + d - c, column : column + b - a] += part[c:d, a:b]
            else:
                left[row - p : row - p + d - c, column - p : column - p + b - a] += part[c:d, a:b]


def _spread(start: Array, ranks: Array) -> Array:
    """Unknowns of nodes."""
    width = start[ranks + 1] - start[ranks]
    return np.repeat(start[ranks] - np.cumsum(width) + width, width) + np.arange(int(width.sum()))


class _Eliminated(NamedTuple):
    """A group's factor: Cholesky (lower triangle, packed; below = L21), or LU with pivots (below = the block itself)."""

    factor: Array
    below: Array
    pivots: Array | None
    negative: int


def _eliminate(own: Array, below: Array, left: Array) -> tuple[_Eliminated, Array]:
    """Eliminate a group; its factor, and what is left for the parent (lower triangle)."""
    factor, info = lapack.dpotrf(own, lower=1, clean=0)
    if info == 0:
        if below.size:
            below = blas.dtrsm(1.0, factor, below, side=1, lower=1, trans_a=1, overwrite_b=1)
            left = blas.dsyrk(-1.0, below, beta=1.0, c=left, lower=1, overwrite_c=1)
        return _Eliminated(lapack.dtrttp(factor, uplo="L")[0], below, None, 0), left
    own = np.tril(own) + np.tril(own, -1).T
    factor, pivots, info = lapack.dgetrf(own)
    if info or not np.isfinite(factor).all():
        raise LinearSolveError("multifrontal: the matrix is singular")
    if below.size:
        solved, _ = lapack.dgetrs(factor, pivots, below.T)
        left = left - below @ solved
    return _Eliminated(factor, below, pivots, _negative(own)), left


def _negative(symmetric: Array) -> int:
    """Number of negative eigenvalues: Bunch-Kaufman pivots of size two have one of either sign."""
    factor, pivots, _ = lapack.dsytrf(symmetric, lower=1)
    single = pivots > 0
    return int((factor.diagonal()[single] < 0).sum() + (~single).sum() // 2)


class MultifrontalFactor:
    """A factorised matrix."""

    def __init__(self, matrix: Any, order: Array, fronts: list[_Front], done: list[_Eliminated]) -> None:
        self._matrix, self._order, self._fronts, self._done = matrix, order, fronts, done
        self.negative = sum(eliminated.negative for eliminated in done)

    @property
    def bytes(self) -> int:
        """Memory that the factor takes."""
        return sum(e.factor.nbytes + e.below.nbytes for e in self._done)

    @one_thread()
    def solve(self, b: Array) -> Array:
        """The solution, residual checked."""
        with np.errstate(over="ignore", invalid="ignore"):
            return checked(self._matrix, b, self._raw(b), self._raw, "multifrontal")

    def _raw(self, b: Array) -> Array:
        x = b[self._order]
        for front, (factor, below, pivots, _) in zip(self._fronts, self._done, strict=True):
            mine = x[front.first : front.last]
            if pivots is None:
                mine[:] = change = blas.dtpsv(mine.size, factor, mine, lower=1)
            else:
                change = lapack.dgetrs(factor, pivots, mine)[0]
            if front.touched.size:
                x[front.touched] -= below @ change
        for front, (factor, below, pivots, _) in zip(reversed(self._fronts), reversed(self._done), strict=True):
            mine = x[front.first : front.last]
            if front.touched.size:
                mine -= below.T @ x[front.touched]
            mine[:] = (
                blas.dtpsv(mine.size, factor, mine, lower=1, trans=1)
                if pivots is None
                else lapack.dgetrs(factor, pivots, mine)[0]
            )
        found = np.empty_like(x)
        found[self._order] = x
        return found
