"""Fabrics to simulate: a yarn, a ring, a woven cloth of any pattern.

cloth = weave("twill 2/2", size=(40, 60), L=1e-3, R=0.2e-3)
thread = yarn(0.1, segments=160)
segments(cloth), bends(cloth), shears(cloth), contacts(cloth)     tables of elements, see tables
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError
from yarnverify.simulation.cloth import Fabric, Yarn
from yarnverify.simulation.patterns import pattern as pattern_of
from yarnverify.simulation.tables import Table, bends, contacts, segments, shears, table
from yarnverify.simulation.weaving import woven

__all__ = ["Fabric", "Table", "Yarn", "bends", "contacts", "ring", "segments", "shears", "table", "weave", "yarn"]

Numbers = NDArray[np.float64]
Indices = NDArray[np.int64]


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


def _single(points: Numbers, arc: NDArray[Any], nodes: Indices, L: float, R: float, *, closed: bool) -> Fabric:
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
