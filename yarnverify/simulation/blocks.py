"""Unknowns that always occur together, the coordinates of a point, are a block; a sliding coordinate is one of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from yarnverify.kernels.runtime import Kernel
from yarnverify.kernels.tape import Trace, Traced

Array = NDArray[Any]


class Elements(NamedTuple):
    """A table as the pattern sees it: rows (dofs, n), names of the dofs, and entries of the packed Hessian that are zero."""

    rows: Array
    labels: Sequence[str]
    zeros: frozenset[int] = frozenset()


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks with an unknown in them, numbered in the order of their unknowns.

    Attributes
    ----------
    of
        Block of each entry of the configuration, -1 where no unknown is in it, (size,).
    inner
        Place of each entry in its block, (size,).
    height
        Number of entries of each block, unknown or not.
    pointer
        Unknowns of block b are ``pointer[b]`` to ``pointer[b + 1]``.
    """

    of: Array
    inner: Array
    height: Array
    pointer: Array

    @property
    def count(self) -> int:
        """Number of blocks."""
        return len(self.height)

    @staticmethod
    def made(size: int, active: Array, tables: Sequence[Elements]) -> Blocks:
        """The blocks of sorted unknowns.

        Raises
        ------
        ValueError
            The rows of a point do not follow each other, or an element has the same point twice.
        """
        head = np.arange(size, dtype=np.int32)
        height = np.ones(size, np.int8)
        for rows, labels, _ in tables:
            parts = groups(labels)
            for group in parts:
                first = rows[group[0]]
                height[first] = len(group)
                for k in group[1:]:
                    if not (rows[k] == first + k - group[0]).all():
                        raise ValueError(f"the rows of {labels[group[0]]} and {labels[k]} do not follow each other")
                    head[rows[k]] = first
            for a, one in enumerate(parts):
                for other in parts[a + 1 :]:
                    if (rows[one[0]] == rows[other[0]]).any():
                        raise ValueError(f"an element has the same entry for {labels[one[0]]} and {labels[other[0]]}")
        heads, number = np.unique(head[active], return_inverse=True)
        of = np.full(size, -1, np.int32)
        of[heads] = np.arange(len(heads), dtype=np.int32)
        pointer = np.searchsorted(number, np.arange(len(heads) + 1)).astype(np.int32)
        inner = (np.arange(size, dtype=np.int32) - head).astype(np.int8)
        return Blocks(of[head], inner, height[heads].astype(np.int32), pointer)


def groups(labels: Sequence[str]) -> list[list[int]]:
    """Rows that belong together: the axes of a point, or a coordinate alone."""
    found: dict[str, list[int]] = {}
    for k, label in enumerate(labels):
        found.setdefault(label.partition(".")[0], []).append(k)
    return list(found.values())


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
