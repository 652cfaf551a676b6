"""Nested dissection of the graph of nodes, by coordinates where they are known: the order in which a direct solver eliminates.

All parts of a level are halved at once. A separator is made of those nodes of one half that touch the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Dissection:
    """A tree of groups of nodes.

    Attributes
    ----------
    groups
        Nodes of each group; children come before their parent, and the last is the root.
    parents
        Index of the parent of each group, -1 for the root.
    """

    groups: list[Array]
    parents: list[int]

    @property
    def order(self) -> Array:
        """All nodes in the order of elimination."""
        return np.concatenate([np.empty(0, np.int64), *self.groups])


def coordinates_of(graph: sparse.csr_array) -> Array:
    """A coordinate for graphs that have none: the reverse Cuthill-McKee number, which grows along the graph."""
    if not graph.shape[0]:
        return np.empty((0, 1))
    order = reverse_cuthill_mckee(sparse.csr_matrix(graph), symmetric_mode=True)
    place = np.empty(len(order))
    place[order] = np.arange(len(order))
    return place[:, None]


def dissect(graph: sparse.csr_array, coordinates: Array | None = None, leaf: int = 40) -> Dissection:
    """Nested dissection of a symmetric graph (n, n) until parts have at most ``leaf`` nodes."""
    n = graph.shape[0]
    where = coordinates_of(graph) if coordinates is None else coordinates
    row = np.repeat(np.arange(n, dtype=np.int32), np.diff(graph.indptr))
    column = graph.indices
    part = np.zeros(n, np.int64)  # number of the part in the level, -1 once in a group; children of p are 2p and 2p + 1
    owner: dict[tuple[int, int], Array] = {}
    level = 0
    while (part >= 0).any():
        inside = np.flatnonzero(part >= 0)
        order = inside[np.argsort(part[inside], kind="stable")]
        cuts = np.flatnonzero(np.diff(part[order], prepend=-1))
        upper = np.zeros(n, bool)
        split = np.zeros(n, bool)
        for nodes in np.split(order, cuts[1:]):
            if len(nodes) <= leaf:
                owner[level, int(part[nodes[0]])] = nodes
                part[nodes] = -1
                continue
            spread = np.ptp(where[nodes], axis=0)
            along = where[nodes, np.argmax(spread)]
            upper[nodes[np.argsort(along, kind="stable")[len(nodes) // 2 :]]] = True
            split[nodes] = True
        crossing = split[row] & upper[row] & (part[row] == part[column]) & ~upper[column]
        cut = np.zeros(n, bool)
        cut[row[crossing]] = True
        for nodes in _by_part(part, cut):
            owner[level, int(part[nodes[0]])] = nodes
        stay = split & ~cut
        part[cut] = -1
        part[stay] = 2 * part[stay] + upper[stay]
        keep = stay[row] & stay[column] & (part[row] == part[column])
        row, column = row[keep], column[keep]
        level += 1
    return _tree(owner)


def _by_part(part: Array, chosen: Array) -> list[Array]:
    nodes = np.flatnonzero(chosen)
    if not nodes.size:
        return []
    nodes = nodes[np.argsort(part[nodes], kind="stable")]
    return np.split(nodes, np.flatnonzero(np.diff(part[nodes])) + 1)


def _tree(owner: dict[tuple[int, int], Array]) -> Dissection:
    """Groups in postorder; a part without a separator passes its children on to the group above."""
    groups: list[Array] = []
    parents: list[int] = []
    children: dict[tuple[int, int], list[int]] = {}
    for level, number in sorted(owner, key=lambda key: (-key[0], key[1])):
        groups.append(owner[level, number])
        parents.append(-1)
        here = len(groups) - 1
        for child in children.pop((level, number), []):
            parents[child] = here
        above = (level - 1, number // 2)
        while above[0] >= 0 and above not in owner:
            above = (above[0] - 1, above[1] // 2)
        if above[0] >= 0:
            children.setdefault(above, []).append(here)
    return Dissection(groups, parents)
