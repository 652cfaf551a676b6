"""The data of a fabric: its nodes, yarns and crossings, and one vector Q that holds every position and sliding coordinate.

Q starts with three numbers a node, x y z; then comes one sliding coordinate for each yarn at each of its nodes, yarn by
yarn: the rest arc length that lies there. Metres. Which of them are unknowns is the scene's to say: ``positions`` and
``slides`` give the indices to say it with.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError
from yarnverify.simulation.chain import Chain

Family = Literal["warp", "weft", "yarn"]
Numbers = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Yarn:
    """A yarn.

    Attributes
    ----------
    nodes, slides
        Nodes in order and the indices into Q of its sliding coordinates there, (k,) each; coordinates grow along the yarn. A
        closed yarn lists its first two nodes again at its end, one length further on, so that they grow over the seam too.
    """

    name: str
    family: Family
    nodes: Indices
    slides: Indices
    closed: bool = False


@dataclass(frozen=True, eq=False)
class Fabric:
    """Yarns and how they cross, at rest.

    Attributes
    ----------
    Q
        Rest configuration, (size,), m.
    nodes
        Number of nodes; the crossings come first.
    crossings, over, grid
        Nodes that are crossings (c,), +1 where the warp lies over the weft, else -1 (c,), and the numbers of warp and
        weft (c, 2).
    warp_of, weft_of
        Index of the yarn of either family at each crossing, (c,).
    L, R
        Rest distance of neighbouring yarns (of neighbouring nodes in a single yarn), and radius of the yarns, m.
    """

    Q: Numbers
    nodes: int
    yarns: tuple[Yarn, ...]
    crossings: Indices
    over: NDArray[np.int8]
    grid: Indices
    warp_of: Indices
    weft_of: Indices
    L: float
    R: float

    @property
    def size(self) -> int:
        """Length of Q."""
        return int(self.Q.size)

    @cached_property
    def chain(self) -> Chain:
        """All yarns one after the other, from which tables are made."""
        return Chain.of(self.yarns, self.nodes, self.crossings, self.warp_of, self.weft_of)

    def points(self, Q: ArrayLike) -> Numbers:
        """Positions of the nodes, (nodes, 3), a view into Q where Q is an array."""
        return np.asarray(Q, float)[: 3 * self.nodes].reshape(-1, 3)

    def position(self, nodes: ArrayLike) -> Indices:
        """Indices into Q of nodes (m,), (m, 3)."""
        return 3 * np.atleast_1d(np.asarray(nodes, np.int64))[:, None] + np.arange(3)

    def positions(self, nodes: ArrayLike | None = None, axes: str = "xyz") -> Indices:
        """Sorted indices into Q of the positions of some nodes, or of all."""
        chosen = np.arange(self.nodes) if nodes is None else np.unique(np.asarray(nodes, np.int64))
        return np.sort(self.position(chosen)[:, ["xyz".index(axis) for axis in axes]], axis=None)

    def slides(self, of: Family | Literal["all"] | Iterable[int] = "all", ends: bool = False) -> Indices:
        """Sorted indices into Q of the sliding coordinates of all yarns, of a family, or of yarns by their index.

        Parameters
        ----------
        ends
            Whether those at the ends of a yarn are among them. They are fixed by default: the yarn ends there. On a closed
            yarn those of both nodes of the seam stay fixed.
        """
        chosen = [self.yarns[k] for k in self.select(of)]
        inside = {False: slice(1, -1), True: slice(2, -2)}
        parts = [y.slides if ends and not y.closed else y.slides[inside[y.closed]] for y in chosen]
        return np.sort(np.concatenate([np.empty(0, np.int64), *parts]))

    def select(self, of: Family | Literal["all"] | Iterable[int]) -> list[int]:
        """Indices of yarns: all, those of a family, or those given."""
        if not isinstance(of, str):
            return [int(k) for k in of]
        if of not in ("all", "warp", "weft", "yarn"):
            raise InputError(f"yarns {of!r}: say all, warp, weft, or their indices")
        return [k for k, y in enumerate(self.yarns) if of in ("all", y.family)]

    def ends(self, of: Family | Literal["all"] | Iterable[int] = "all") -> Indices:
        """First and last node of yarns, (k, 2)."""
        return np.array([self.yarns[k].nodes[[0, -1]] for k in self.select(of)], np.int64).reshape(-1, 2)

    def node(self, warp: int, weft: int) -> int:
        """The crossing of a warp and a weft by their numbers, negative ones from the end."""
        counts = self.grid.max(0, initial=-1) + 1
        numbers = [number + (count if number < 0 else 0) for number, count in zip((warp, weft), counts, strict=True)]
        found = np.flatnonzero((self.grid == numbers).all(1))
        if not found.size:
            raise InputError(f"warp {warp} and weft {weft} do not cross in this fabric")
        return int(self.crossings[found[0]])

    def describe(self, index: int) -> str:
        """An entry of Q in words, for messages."""
        if index < 3 * self.nodes:
            return f"{'xyz'[index % 3]} of {self._node_name(index // 3)}"
        place = int(np.flatnonzero(self.chain.slides == index)[0])
        return (
            f"sliding of {self.yarns[self.chain.yarn[place]].name} at {self._node_name(int(self.chain.nodes[place]))}"
        )

    def _node_name(self, node: int) -> str:
        if node < len(self.crossings):
            return f"crossing ({self.grid[node, 0]}, {self.grid[node, 1]})"
        return f"node {node}"
