"""Where the entries of element Hessians stand in a sparse symmetric matrix: worked out once, for any number of evaluations.

Elements are summed into the upper triangle by blocks, one place for each pair of blocks of an element; the matrix of the
unknowns is read from these sums.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from yarnverify.kernels.batch import upper
from yarnverify.simulation.blocks import Blocks, Elements, groups, zeros

__all__ = ["Elements", "Pattern", "Places", "zeros"]

Array = NDArray[Any]
TAKEN = 2**18  # entries of the matrix that are read from the sums at a time
ROWS = 16384  # blocks whose rows are made at a time, so that memory on the way stays small


@dataclass(frozen=True, eq=False)
class Places:
    """Where the Hessian of one table goes.

    Attributes
    ----------
    pairs
        Sorted rows of the packed Hessian that matter, (k,).
    base
        Where in the sums each pair of blocks of an element stands, (blocks, n); their end for what belongs nowhere.
    turned
        Whether it stands there transposed, (blocks, n) of 0 and 1, or (0, 0) where none does.
    block, which, straight, transposed
        In the order in which they are summed, (k,) each: the pair of blocks of each of ``pairs``, which of them it is, and
        its place in the block as it is and transposed.
    """

    pairs: Array
    base: Array
    turned: Array
    block: Array
    which: Array
    straight: Array
    transposed: Array

    @cached_property
    def rows(self) -> Array:
        """Row of the packed Hessian of each entry, in the order in which they are summed, (k,)."""
        return self.pairs[self.which]

    @cached_property
    def every(self) -> Array:
        """Where in the sums each entry of each element goes, in the order in which they are summed, (k n,)."""
        found = self.base[self.block].astype(np.intp)
        if self.turned.size:
            found += np.where(self.turned[self.block], self.transposed[:, None], self.straight[:, None])
        else:
            found += self.straight[:, None]
        return found.ravel()

    def turn(self, values: Array, part: slice) -> None:
        """Change the sign of entries (k, m) of a skew matrix where their block is summed transposed."""
        if self.turned.size:
            values[self.which] *= 1 - 2 * self.turned[self.block, part]


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
        self._blocks = Blocks.made(size, active, tables)
        wanted = [_wanted(self.local, table) for table in tables]
        keys = self._keys(tables, wanted)
        row, column = keys // max(self._blocks.count, 1), keys % max(self._blocks.count, 1)
        area = self._blocks.height[row].astype(np.int64) * self._blocks.height[column]
        start = np.concatenate([[0], np.cumsum(area)])
        self.sums = int(start[-1])
        self._kind: Any = np.int32 if self.sums + 9 < 2**31 else np.int64
        start = start[:-1].astype(self._kind)
        self.places = [self._places(t, w, keys, start) for t, w in zip(tables, wanted, strict=True)]
        self._spread(active, row.astype(np.int32), column.astype(np.int32), start)

    def zero(self) -> Array:
        """Sums to begin with."""
        return np.zeros(self.sums + 9)  # what belongs nowhere goes to the last nine

    # -- how it is found

    def _heads(self, table: Elements) -> list[Array]:
        """The block of each element's groups of rows, -1 where none of it is unknown; (n,) each."""
        return [self._blocks.of[table.rows[group[0]]] for group in groups(table.labels)]

    def _keys(self, tables: Sequence[Elements], wanted: Sequence[_Wanted]) -> Array:
        """Sorted numbers ``row * blocks + column`` of the blocks of the upper triangle that are not empty."""
        blocks = self._blocks.count
        found = np.arange(blocks, dtype=np.int64) * (blocks + 1)
        for table, pairs in zip(tables, wanted, strict=True):
            heads = self._heads(table)
            found = np.unique(np.concatenate([found, *(_key(heads[a], heads[b], blocks) for a, b in pairs if a != b)]))
        return found[np.searchsorted(found, 0) :]  # without the -1 of what is not unknown

    def _places(self, table: Elements, wanted: _Wanted, keys: Array, start: Array) -> Places:
        heads, sizes = self._heads(table), [len(group) for group in groups(table.labels)]
        base = np.full((len(wanted), table.rows.shape[1]), self.sums, self._kind)
        turned = np.zeros(base.shape, np.int8)
        entries = []
        for block, ((a, b), places) in enumerate(wanted.items()):
            key = _key(heads[a], heads[b], self._blocks.count)
            there = key >= 0
            base[block, there] = start[np.searchsorted(keys, key[there])]
            turned[block] = (heads[a] > heads[b]) & there
            entries += [(block, k, i * sizes[b] + j, j * sizes[a] + i) for k, i, j in places]
        block_of, pairs, straight, transposed = np.array(entries, np.int64).reshape(-1, 4).T
        needed = np.sort(pairs)
        kept = turned if turned.any() else np.empty((0, 0), np.int8)
        which = np.searchsorted(needed, pairs)
        return Places(needed, base, kept, *(np.ascontiguousarray(a) for a in (block_of, which, straight, transposed)))

    def _spread(self, active: Array, row: Array, column: Array, start: Array) -> None:
        """Rows of the matrix in its unknowns, and where in the sums its entries come from."""
        blocks, off = self._blocks, row != column
        above = sparse.csr_array((start, (row, column)), shape=(blocks.count,) * 2)
        below = sparse.csr_array((start[off], (column[off], row[off])), shape=above.shape)
        width = np.diff(blocks.pointer)
        length = np.zeros(blocks.count, np.int64)
        np.add.at(length, row, width[column])
        np.add.at(length, column[off], width[row[off]])
        number = np.repeat(np.arange(blocks.count, dtype=np.int32), width)
        pointer = np.concatenate([[0], np.cumsum(length[number])])
        kind: Any = np.int32 if pointer[-1] < 2**31 else np.int64
        self.indptr = pointer.astype(kind)
        self.indices = np.empty(int(pointer[-1]), np.int32)
        self._source = np.empty(int(pointer[-1]), self._kind)
        inner = blocks.inner[active].astype(self._kind)
        for part in range(0, blocks.count, ROWS):
            rows = slice(part, min(part + ROWS, blocks.count))
            self._rows(rows, below[rows], above[rows], inner)

    def _rows(self, rows: slice, below: Any, above: Any, inner: Array) -> None:
        """Some block rows: entries left of the diagonal, then the others, each block spread over its unknowns."""
        blocks = self._blocks
        mine = np.concatenate([np.repeat(np.arange(m.shape[0]), np.diff(m.indptr)) for m in (below, above)])
        lower = np.arange(mine.size) < below.nnz
        other = np.concatenate([below.indices, above.indices])
        start = np.concatenate([below.data, above.data])
        order = np.lexsort((other, mine))
        mine, lower, other, start = mine[order], lower[order], other[order], start[order]
        # columns: all unknowns of the other block
        width = np.diff(blocks.pointer)[other]
        entry = np.repeat(np.arange(mine.size), width)
        unknown = blocks.pointer[other][entry] + _counting(width)
        step = np.where(lower, 1, blocks.height[other])[entry]  # from one row of the block to the next
        base = start[entry] + inner[unknown] * np.where(lower, blocks.height[rows.start + mine], 1)[entry]
        diagonal = (rows.start + mine == other)[entry]
        # rows: all unknowns of the block itself
        size = np.bincount(mine, width, minlength=rows.stop - rows.start).astype(np.int64)
        first, last = int(blocks.pointer[rows.start]), int(blocks.pointer[rows.stop])
        of = np.repeat(np.arange(rows.stop - rows.start), np.diff(blocks.pointer[rows.start : rows.stop + 1]))
        line = np.repeat(np.arange(last - first), size[of])
        at = (np.cumsum(size) - size)[of][line] + _counting(size[of])
        r, c = inner[first:last][line], inner[unknown[at]]
        place = base[at] + r * step[at]
        swapped = diagonal[at] & (r > c)  # only the upper triangle of a diagonal block is summed
        place[swapped] += ((c - r) * (step[at] - 1))[swapped]
        here = slice(int(self.indptr[first]), int(self.indptr[last]))
        self.indices[here], self._source[here] = unknown[at], place

    # -- what it gives

    def matrix(self, sums: Array) -> sparse.csc_array:
        """The full symmetric matrix of sums (sums + 9,)."""
        found = sparse.csc_array.__new__(sparse.csc_array)
        found.__dict__ |= self._empty.__dict__  # a copy without the checks, which small matrices would feel
        found.data = self._entries(sums)
        return found

    def nonzero(self, sums: Array) -> tuple[Array, Array]:
        """Places and values of the entries of the matrix that are not zero."""
        parts = [slice(start, start + TAKEN) for start in range(0, self._source.size, TAKEN)]
        count = sum(int(np.count_nonzero(sums.take(self._source[part]))) for part in parts)
        places, values, done = np.empty(count, self.indptr.dtype), np.empty(count), 0
        for part in parts:
            entries = sums.take(self._source[part])
            at = np.flatnonzero(entries)
            here = slice(done, done + at.size)
            places[here], values[here], done = part.start + at, entries[at], here.stop
        return places, values

    def _entries(self, sums: Array) -> Array:
        if self._source.size <= TAKEN:
            return sums.take(self._source, mode="clip")
        found = np.empty(self._source.size)
        for start in range(0, found.size, TAKEN):  # all at once, NumPy would copy the indices to twice their size
            part = slice(start, start + TAKEN)
            np.take(sums, self._source[part], out=found[part], mode="clip")
        return found

    @cached_property
    def _empty(self) -> sparse.csc_array:
        """The matrix without its values, checked once."""
        shape = (self.count, self.count)
        nothing = np.broadcast_to(np.zeros(1), self.indices.shape)
        found = sparse.csc_array((nothing, self.indices, self.indptr), shape=shape)
        found.has_sorted_indices = True
        found.has_canonical_format = True
        return found

    def skew(self, sums: Array) -> sparse.csr_array:
        """The matrix that has the summed entries above its diagonal and their negatives below."""
        row = np.repeat(np.arange(self.count, dtype=np.int32), np.diff(self.indptr))
        data = self._entries(sums) * np.sign(self.indices - row)
        return sparse.csr_array((data, self.indices, self.indptr), shape=(self.count, self.count))

    @property
    def bytes(self) -> int:
        """Memory that it takes."""
        held = [self.local, self._blocks.of, self._blocks.inner, self.indptr, self.indices, self._source]
        return sum(a.nbytes for a in held) + sum(places.base.nbytes + places.turned.nbytes for places in self.places)


_Wanted = dict[tuple[int, int], list[tuple[int, int, int]]]


def _wanted(local: Array, table: Elements) -> _Wanted:
    """For each pair of groups of rows: rows of the packed Hessian that can matter, and their places in either group."""
    rows, labels, nothing = table
    some = [bool((local[row] >= 0).any()) for row in rows]
    parts = groups(labels)
    place = {k: (a, i) for a, group in enumerate(parts) for i, k in enumerate(group)}
    found: _Wanted = {}
    for k, (i, j) in enumerate(upper(len(labels))):
        if some[i] and some[j] and k not in nothing:
            (a, first), (b, second) = place[i], place[j]
            found.setdefault((a, b), []).append((k, first, second))
    return found


def _key(first: Array, second: Array, blocks: int) -> Array:
    """The number of a pair of blocks in the upper triangle, -1 where one of them is missing."""
    low, high = np.minimum(first, second).astype(np.int64), np.maximum(first, second)
    return np.where(low >= 0, low * blocks + high, -1)


def _counting(lengths: Array) -> Array:
    """0 to length - 1 for each length, one after the other."""
    return np.arange(int(lengths.sum())) - np.repeat(np.cumsum(lengths) - lengths, lengths)
