"""What is simulated: nodes, yarns and crossings, and one vector Q that holds every position and sliding coordinate.

    cloth = weave("twill 2/2", size=(40, 60), L=1e-3, R=0.2e-3)
    thread = yarn(0.1, segments=160)
    segments(cloth), bends(cloth), shears(cloth), contacts(cloth)     tables of elements, see tables

Q starts with three numbers a node, x y z; then comes one sliding coordinate for each yarn at each of its nodes, yarn by yarn: the
rest arc length that lies there. Metres. Which of them are unknowns is the scene's to say: ``positions`` and ``slides`` give
the indices to say it with.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError
from yarnverify.simulation.chain import Chain
from yarnverify.simulation.patterns import pattern as pattern_of
from yarnverify.simulation.tables import Table, bends, contacts, segments, shears, table

__all__ = ["Fabric", "Table", "Yarn", "bends", "contacts", "ring", "segments", "shears", "table", "weave", "yarn"]

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
        Nodes that are crossings (c,), +1 where the warp lies over the weft, else -1 (c,), and the number of warp and weft (c, 2).
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
        numbers = [number % count for number, count in zip((warp, weft), self.grid.max(0, initial=0) + 1, strict=True)]
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


def yarn(
    length: float,
    segments: int,
    *,
    R: float = 0.2e-3,
    start: ArrayLike = (0.0, 0.0, 0.0),
    direction: ArrayLike = (1.0, 0.0, 0.0),
) -> Fabric:
    """A straight yarn of equal segments, from ``start`` along ``direction``.

    Parameters
    ----------
    length, R
        Rest length and radius, m.
    """
    _positive(length=length, R=R)
    _whole("segments", segments, 1)
    arc = np.linspace(0.0, length, segments + 1)
    along = np.asarray(direction, float)
    norm = float(np.linalg.norm(along))
    if along.shape != (3,) or not norm > 0:
        raise InputError("a yarn needs a direction of three numbers that are not all zero")
    points = np.asarray(start, float) + arc[:, None] * (along / norm)
    return _single(points, arc, np.arange(segments + 1), length / segments, R, closed=False)


def ring(length: float, segments: int, *, R: float = 0.2e-3) -> Fabric:
    """A closed yarn, a regular polygon around the origin in the plane z = 0, whose sides are as long as at rest.

    Parameters
    ----------
    length, R
        Rest length of the whole yarn and its radius, m.
    """
    _positive(length=length, R=R)
    _whole("segments", segments, 3)
    angle = 2 * np.pi * np.arange(segments) / segments
    radius = length / segments / (2 * np.sin(np.pi / segments))
    points = radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(segments)], axis=1)
    arc = length / segments * np.arange(segments + 2)
    return _single(points, arc, np.arange(segments + 2) % segments, length / segments, R, closed=True)


def _single(points: Numbers, arc: Numbers, nodes: Indices, L: float, R: float, *, closed: bool) -> Fabric:
    none = np.empty(0, np.int64)
    slides = points.size + np.arange(len(nodes))
    made = Yarn("yarn", "yarn", nodes, slides, closed)
    Q = np.concatenate([points.ravel(), arc])
    return Fabric(Q, len(points), (made,), none, none.astype(np.int8), none.reshape(0, 2), none, none, L, R)


def weave(
    pattern: str | ArrayLike = "plain",
    size: tuple[int, int] = (8, 8),
    L: float = 1e-3,
    R: float = 0.2e-3,
    *,
    tails: float | None = None,
    keep: ArrayLike | Callable[[Numbers, Numbers], Any] | None = None,
    pressed: bool = False,
) -> Fabric:
    """A flat woven cloth in the plane z = 0: warp i runs along y at x = i L, weft j runs along x at y = j L.

    Parameters
    ----------
    pattern
        See ``patterns.pattern``: ``plain``, ``twill A/B step S``, ``satin N counter C``, or a matrix of zeros and ones.
    size
        Number of warps and of wefts.
    L, R
        Rest distance of neighbouring yarns and radius of the yarns, m.
    tails
        None: yarns end at the crossings of the border. A length in m: they go on by so much, to nodes of their own.
    keep
        The crossings to keep where the cloth is not a rectangle: a mask (warps, wefts), or a function of the coordinates
        x and y (warps, wefts) that gives one. A line of crossings that is interrupted is several yarns.
    pressed
        Whether neighbouring yarns may touch at rest. If not, L must be greater than the contact distance, which is
        4R as soon as a yarn changes sides between neighbours.

    Raises
    ------
    InputError
        In one line, whatever cannot be woven.
    """
    from yarnverify.simulation.weaving import woven

    _positive(L=L, R=R, **({} if tails is None else {"tails": tails}))
    try:
        warps, wefts = size
    except (TypeError, ValueError):
        raise InputError(f"size is a pair: number of warps, number of wefts; not {size!r}") from None
    _whole("number of warps", warps, 1)
    _whole("number of wefts", wefts, 1)
    sides = pattern_of(pattern)
    rows, columns = -(-wefts // sides.shape[0]), -(-warps // sides.shape[1])
    over = np.tile(sides, (rows, columns))[:wefts, :warps].T
    touching = 4 * R if (over[1:] != over[:-1]).any() or (over[:, 1:] != over[:, :-1]).any() else 2 * R
    if (warps > 1 or wefts > 1) and not pressed and touching >= L:
        raise InputError(
            f"L = {L:g} m is not greater than {touching:g} m, at which neighbouring yarns touch ({touching / R:.0f} R); "
            "pressed=True allows contact at rest"
        )
    if pressed and 2 * R > L:
        raise InputError(f"L = {L:g} m is less than 2 R = {2 * R:g} m: neighbouring yarns would intersect")
    return woven(over, L, R, tails, keep)


def _positive(**lengths: float) -> None:
    for name, value in lengths.items():
        if not isinstance(value, int | float | np.number) or not np.isfinite(value) or value <= 0:
            raise InputError(f"{name} = {value!r} must be a positive length in metres")


def _whole(name: str, value: Any, least: int) -> None:
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
        raise InputError(f"{name} = {value!r} must be a whole number, at least {least}")
