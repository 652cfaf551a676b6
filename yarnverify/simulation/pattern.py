"""Where the entries of element Hessians stand in a sparse symmetric matrix: worked out once, for any number of evaluations.

Unknowns that always occur together (the coordinates of a node) are a block; the pattern is found on blocks, which are
fewer, and then spread out. Only the upper triangle is summed; the full matrix is read from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from yarnverify.kernels.batch import upper
from yarnverify.kernels.runtime import Kernel
from yarnverify.kernels.tape import Trace, Traced

Array = NDArray[Any]


class Elements(NamedTuple):
    """A table as the pattern sees it: rows (dofs, n), names of the dofs, and entries of the packed Hessian that are zero."""

    rows: Array
    labels: Sequence[str]
    zeros: frozenset[int] = frozenset()


@dataclass(frozen=True, eq=False)
class Places:
    """Where the Hessian of one table goes.

    Attributes
    ----------
    pairs
        Which rows of the packed upper triangle have both unknowns active somewhere, (k,).
    at
        Their places in the sums, (k, n) int32; the last place is for what belongs nowhere.
    """

    pairs: Array
    at: Array


class Pattern:
    """The sparsity pattern of a symmetric matrix of unknowns.

    Parameters
    ----------
    size
        Length of the configuration.
    active
        Sorted indices of the unknowns in it.
    tables
        All that is summed into it.
    """

    def __init__(self, size: int, active: Array, tables: Sequence[Elements]) -> None:
        self.count = len(active)
        self.local = np.full(size, -1, np.int32)  # place of each entry of the configuration among the unknowns
        self.local[active] = np.arange(self.count, dtype=np.int32)
        block = _blocks(size, active, tables)
        self._block: Array = np.full(size, -1, np.int32)
        of_unknown = block[active]
        starts = np.flatnonzero(np.diff(of_unknown, prepend=-1))
        self._first = starts.astype(np.int32)  # first unknown of each block
        self._width = np.diff(starts, append=self.count).astype(np.int32)
        number = np.repeat(np.arange(len(starts), dtype=np.int32), self._width)
        self._block[active] = number
        self._graph(tables)
        self._spread(number)
        self.places = [self._places(table) for table in tables]
        del self._keys, self._offset, self._row_pointer, self._widths, self._upper, self._diagonal

    def _graph(self, tables: Sequence[Elements]) -> None:
        """Which blocks share an element."""
        blocks = len(self._first)
        found: sparse.csr_array = sparse.eye_array(blocks, dtype=bool, format="csr")
        for rows, labels, _ in tables:
            heads = [self._heads(rows, group) for group in groups(labels)]
            used = [head for head in heads if (head >= 0).any()]
            if not used or not rows.shape[1]:
                continue
            columns = np.stack(used, axis=1)
            mask = columns >= 0
            pointer = np.concatenate([[0], np.cumsum(mask.sum(1))]).astype(np.int32)
            data = np.ones(pointer[-1], bool)
            incidence = sparse.csr_array((data, columns[mask], pointer), shape=(rows.shape[1], blocks))
            found = found + (incidence.T.tocsr() @ incidence)
        found.sort_indices()
        self.graph = found  # blocks that are coupled
        row = np.repeat(np.arange(blocks, dtype=np.int64), np.diff(found.indptr))
        self._keys = row * blocks + found.indices
        widths = self._width[found.indices].astype(np.int64)
        total = np.concatenate([[0], np.cumsum(widths)])
        self._offset = (total[:-1] - np.repeat(total[found.indptr[:-1]], np.diff(found.indptr))).astype(np.int32)
        self._row_pointer, self._widths = total[found.indptr], widths

    def _spread(self, number: Array) -> None:
        """From blocks to unknowns, full matrix and upper triangle."""
        total = int(self._widths.sum())
        inside = np.arange(total, dtype=np.int32) - np.repeat(
            np.cumsum(self._widths) - self._widths, self._widths
        ).astype(np.int32)
        columns = np.repeat(self._first[self.graph.indices], self._widths) + inside
        length = np.diff(self._row_pointer)[number]
        pointer = np.concatenate([[0], np.cumsum(length)])
        kind: Any = np.int32 if pointer[-1] < 2**31 else np.int64
        self.indptr = pointer.astype(kind)
        shift = (self._row_pointer[number] - pointer[:-1]).astype(kind)
        self.indices = columns[np.repeat(shift, length) + np.arange(pointer[-1], dtype=kind)].astype(np.int32)
        rows = np.repeat(np.arange(self.count, dtype=np.int32), length)
        above: NDArray[np.bool_] = self.indices >= rows
        del rows
        number_above = np.add.reduceat(above, self.indptr[:-1], dtype=kind) if self.count else np.empty(0, kind)
        self._upper = np.concatenate([[0], np.cumsum(number_above)]).astype(kind)
        self.sums = int(self._upper[-1])
        self._diagonal = (self.indptr[1:] - number_above).astype(kind)  # where the diagonal stands in each row
        source: NDArray[np.integer[Any]] = np.empty(int(pointer[-1]), kind)
        source[above] = np.arange(self.sums, dtype=kind)
        shape = (self.count, self.count)
        other = sparse.csr_array((np.arange(pointer[-1], dtype=kind), self.indices, self.indptr), shape=shape).T.tocsr()
        below = ~above
        source[below] = source[other.data[below]]
        self._source = source

    def _heads(self, rows: Array, group: Sequence[int]) -> Array:
        """The block of each element's group of rows, -1 where none of it is active; (n,)."""
        found = self._block[rows[group[0]]]
        for k in group[1:]:
            found = np.maximum(found, self._block[rows[k]])
        return found

    def _places(self, table: Elements) -> Places:
        rows, labels, nothing = table
        local = [self.local[row] for row in rows]
        some = [bool((row >= 0).any()) for row in local]
        pairs = [k for k, (i, j) in enumerate(upper(len(labels))) if some[i] and some[j] and k not in nothing]
        at = np.empty((len(pairs), rows.shape[1]), np.int32 if self.sums < 2**31 else np.int64)
        number = {pair: k for k, pair in enumerate(upper(len(labels)))}
        target = {k: m for m, k in enumerate(pairs)}
        parts = groups(labels)
        heads = [self._heads(rows, group) for group in parts]
        blocks = len(self._first)
        for a, first in enumerate(parts):
            for b, second in enumerate(parts[a:], a):
                wanted = [(i, j) for i in first for j in second if i <= j and number[i, j] in target]
                if not wanted:
                    continue
                low, high = np.minimum(heads[a], heads[b]), np.maximum(heads[a], heads[b])
                there = low >= 0
                key = np.where(there, low.astype(np.int64) * blocks + high, self._keys[0])
                shift = self._offset[np.searchsorted(self._keys, key)] - self._first[high]
                for i, j in wanted:
                    row, column = np.minimum(local[i], local[j]), np.maximum(local[i], local[j])
                    place = self.indptr[row] + shift + column - self._diagonal[row] + self._upper[row]
                    at[target[number[i, j]]] = np.where(row >= 0, place, self.sums)
        return Places(np.array(pairs, np.int64), at)

    def matrix(self, sums: Array) -> sparse.csc_array:
        """The full symmetric matrix of summed upper entries (sums + 1,)."""
        shape = (self.count, self.count)
        found = sparse.csc_array((sums.take(self._source), self.indices, self.indptr), shape=shape)
        found.has_sorted_indices = True
        found.has_canonical_format = True
        return found

    def skew(self, sums: Array) -> sparse.csr_array:
        """The matrix that has the summed entries above its diagonal and their negatives below."""
        row = np.repeat(np.arange(self.count, dtype=np.int32), np.diff(self.indptr))
        data = sums.take(self._source) * np.sign(self.indices - row)
        return sparse.csr_array((data, self.indices, self.indptr), shape=(self.count, self.count))

    @cached_property
    def bytes(self) -> int:
        """Memory that it takes."""
        held = [self.local, self._block, self.indptr, self.indices, self._source, *(p.at for p in self.places)]
        return sum(a.nbytes for a in held)


def zeros(kernel: Kernel) -> frozenset[int]:
    """Entries of the packed Hessian that are zero whatever the element, found by following the kernel's formulas."""
    count = len(kernel.dofs) * (len(kernel.dofs) + 1) // 2
    found = set(range(count))
    for shape in range(len(kernel.shapes)):
        trace = Trace(np.dtype(float))
        inputs = [Traced(trace, trace.node("input", i)) for i in range(len(kernel.dofs) + len(kernel.parameters))]
        values = kernel.outputs(shape, "H")(inputs)[:count]
        found &= {k for k, value in enumerate(values) if trace.nodes[trace.lift(value).number] == ("constant", 0.0)}
    return frozenset(found)


def groups(labels: Sequence[str]) -> list[list[int]]:
    """Rows that belong together: the axes of a point, or a coordinate alone."""
    found: dict[str, list[int]] = {}
    for k, label in enumerate(labels):
        found.setdefault(label.partition(".")[0], []).append(k)
    return list(found.values())


def _blocks(size: int, active: Array, tables: Sequence[Elements]) -> Array:
    """The first entry of the block of each entry of the configuration, (size,)."""
    block = np.arange(size, dtype=np.int32)
    for rows, labels, _ in tables:
        for group in groups(labels):
            head = rows[group[0]]
            for k in group[1:]:
                if not (rows[k] == head + k - group[0]).all():
                    raise ValueError(f"the rows of {labels[group[0]]} and {labels[k]} do not follow each other")
                block[rows[k]] = head
    return block
