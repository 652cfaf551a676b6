"""The nodes and yarns of a woven cloth from the sides on which its yarns cross."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.errors import InputError
from yarnverify.simulation.cloth import Fabric, Family, Yarn

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


def woven(over: NDArray[np.int8], L: float, R: float, tails: float | None, keep: Any) -> Fabric:
    """A flat cloth.

    Parameters
    ----------
    over
        +1 where the warp lies over the weft, else -1, (warps, wefts).
    tails, keep
        As in ``fabric.weave``.
    """
    kept = _kept(keep, over.shape, L)
    grid = np.argwhere(kept)
    number = np.full(over.shape, -1)
    number[kept] = np.arange(len(grid))
    points = [np.column_stack([grid * L, np.zeros(len(grid))])]
    count = len(grid)
    yarns: list[tuple[str, Family, Indices]] = []
    arcs: list[NDArray[np.float64]] = []
    of: dict[str, Indices] = {}
    families: tuple[tuple[Family, Indices], ...] = (("warp", number), ("weft", number.T))
    for family, numbers in families:
        lines, runs = _runs(numbers)
        of[family] = np.empty(len(grid), np.int64)
        first = len(yarns)
        of[family][np.concatenate(runs)] = first + np.repeat(np.arange(len(runs)), [len(run) for run in runs])
        if tails is not None:
            step = np.array([0.0, tails, 0.0] if family == "warp" else [tails, 0.0, 0.0])
            heads = np.array([run[0] for run in runs])
            lasts = np.array([run[-1] for run in runs])
            added = np.empty((2 * len(runs), 3))
            added[0::2], added[1::2] = points[0][heads] - step, points[0][lasts] + step
            points.append(added)
        parts: dict[int, int] = {}
        for k, (line, run) in enumerate(zip(lines, runs, strict=True)):
            parts[line] = parts.get(line, -1) + 1
            arc: NDArray[np.float64] = L * np.arange(len(run), dtype=float)
            if tails is not None:
                run = np.concatenate([[count + 2 * k], run, [count + 2 * k + 1]])
                arc = np.concatenate([[0.0], tails + arc, [tails + arc[-1] + tails]])
            yarns.append((f"{family} {line}" + (f" part {parts[line]}" if parts[line] else ""), family, run))
            arcs.append(arc)
        count += 0 if tails is None else 2 * len(runs)
    positions = np.concatenate(points)
    starts = positions.size + np.concatenate([[0], np.cumsum([len(arc) for arc in arcs])])
    made = tuple(
        Yarn(name, family, nodes, np.arange(start, start + len(nodes)))
        for (name, family, nodes), start in zip(yarns, starts[:-1], strict=True)
    )
    Q = np.concatenate([positions.ravel(), *arcs])
    crossings = np.arange(len(grid))
    return Fabric(Q, count, made, crossings, over[kept], grid, of["warp"], of["weft"], L, R)


def _kept(keep: Any, shape: tuple[int, ...], L: float) -> Mask:
    if keep is None:
        return np.ones(shape, bool)
    x, y = L * np.indices(shape)
    mask = np.asarray(keep(x, y) if callable(keep) else keep)
    if mask.shape != shape or mask.dtype != bool:
        raise InputError(f"keep must give a mask of {shape[0]} warps by {shape[1]} wefts, True where a crossing stays")
    if not mask.any():
        raise InputError("keep leaves no crossing")
    return mask


def _runs(numbers: Indices) -> tuple[Indices, list[Indices]]:
    """Crossings in a row, line by line: the line and the crossings of each run; numbers (lines, k) are -1 in gaps."""
    lines, places = np.nonzero(numbers >= 0)
    breaks = 1 + np.flatnonzero((np.diff(lines) != 0) | (np.diff(places) != 1))
    return lines[np.concatenate([[0], breaks])], np.split(numbers[lines, places], breaks)
