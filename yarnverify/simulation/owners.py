"""Which node each unknown belongs to: what direct solvers order by."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.simulation.pattern import Elements

Array = NDArray[Any]


def owners(Q: Array, active: Array, tables: Sequence[Elements]) -> tuple[Array, Array | None]:
    """The node of each unknown (active,), and coordinates of the nodes (nodes, 3) if all have some."""
    head, point = _heads(tables, Q.size)
    heads, nodes = np.unique(head[active], return_inverse=True)
    return nodes, Q[heads[:, None] + np.arange(3)] if point[heads].all() else None


def _heads(tables: Sequence[Elements], size: int) -> tuple[Array, Array]:
    """The entry that stands for the node of each entry of a configuration, and which of them are points."""
    head, point = np.arange(size), np.zeros(size, bool)
    for table in tables:
        at = dict(zip(table.labels, table.rows, strict=True))
        for label, row in at.items():
            name, _, axis = label.partition(".")
            x = at.get(f"{name}.x" if axis else f"x{name[1:]}.x")
            if x is not None:  # a sliding coordinate u1 lies at the point x1
                head[row] = x
                point[x] = True
    return head, point
