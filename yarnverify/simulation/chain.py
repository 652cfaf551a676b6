"""All yarns of a fabric one after the other, as flat arrays: neighbours are next to each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from yarnverify.simulation.cloth import Yarn

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Chain:
    """Yarns in a row.

    Attributes
    ----------
    nodes, slides, yarn
        Node, index into Q of the sliding coordinate, and index of the yarn at each place, (p,).
    closed
        Whether that yarn is closed, (p,).
    warp_of, weft_of, crossings
        As in ``Fabric``.
    """

    nodes: Indices
    slides: Indices
    yarn: Indices
    closed: NDArray[np.bool_]
    node_count: int
    crossings: Indices
    warp_of: Indices
    weft_of: Indices

    @classmethod
    def of(
        cls, yarns: tuple[Yarn, ...], node_count: int, crossings: Indices, warp_of: Indices, weft_of: Indices
    ) -> Chain:
        """The chain of some yarns."""
        counts = [len(y.nodes) for y in yarns]
        return cls(
            np.concatenate([y.nodes for y in yarns]),
            np.concatenate([y.slides for y in yarns]),
            np.repeat(np.arange(len(yarns)), counts),
            np.repeat([y.closed for y in yarns], counts),
            node_count,
            crossings,
            warp_of,
            weft_of,
        )

    @cached_property
    def _joined(self) -> NDArray[np.bool_]:
        """Whether a place and the next one are on one yarn, (p - 1,)."""
        return self.yarn[1:] == self.yarn[:-1]

    @cached_property
    def pairs(self) -> tuple[Indices, Indices]:
        """Places at both ends of each segment; the first segment of a closed yarn is not repeated at its end."""
        repeated = np.zeros(len(self._joined), bool)
        repeated[:-1] = self._joined[:-1] & ~self._joined[1:]
        repeated[-1:] = self._joined[-1:]
        first = np.flatnonzero(self._joined & ~(repeated & self.closed[:-1]))
        return first, first + 1

    @cached_property
    def triples(self) -> tuple[Indices, Indices, Indices]:
        """Places before, at and after each node that has two neighbours on its yarn."""
        first = np.flatnonzero(self._joined[:-1] & self._joined[1:])
        return first, first + 1, first + 2

    @cached_property
    def neighbours(self) -> tuple[Indices, Indices]:
        """Nodes before and after each place on its yarn, -1 where the yarn ends, (p,) each."""
        before, after = np.full((2, len(self.nodes)), -1)
        after[:-1] = np.where(self._joined, self.nodes[1:], -1)
        before[1:] = np.where(self._joined, self.nodes[:-1], -1)
        return before, after

    @cached_property
    def of_crossings(self) -> tuple[Indices, Indices]:
        """Places of each crossing on its warp and on its weft, (c,) each."""
        found = np.full((2, self.node_count), -1)
        is_warp = np.zeros(int(self.yarn[-1]) + 1, bool)
        is_warp[self.warp_of] = True
        crossing = np.zeros(self.node_count, bool)
        crossing[self.crossings] = True
        for family, row in ((True, found[0]), (False, found[1])):
            places = np.flatnonzero((is_warp[self.yarn] == family) & crossing[self.nodes])
            row[self.nodes[places]] = places
        return found[0][self.crossings], found[1][self.crossings]
