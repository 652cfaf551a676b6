"""Surfaces of yarns as quadrilaterals, in NumPy: the same for every way of drawing them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from yarnverify.simulation.view.strands import Strands

Numbers = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Tubes:
    """Tubes of true radius with flat ends.

    Attributes
    ----------
    points, normals
        Vertices and unit normals, (v, 3).
    quads
        Vertices of the mantles, (q, 4), counterclockwise from outside.
    caps
        Vertices of the ends, (c, sides).
    sample
        Sample of the strands that a vertex belongs to, (v,).
    interval
        First sample of the interval that a face belongs to, quads then caps, (q + c,).
    """

    points: Numbers
    normals: Numbers
    quads: Indices
    caps: Indices
    sample: Indices
    interval: Indices


def tubes(strands: Strands, sides: int = 12) -> Tubes:
    """The surface of strands, ``sides`` faces around."""
    line, R = strands.points, strands.R
    tangent, side = _frames(strands)
    angle = 2 * np.pi * np.arange(sides) / sides
    across = np.cross(tangent, side)
    outward = np.cos(angle)[None, :, None] * side[:, None] + np.sin(angle)[None, :, None] * across[:, None]
    points = (line[:, None] + R * outward).reshape(-1, 3)
    first = strands.intervals
    here = first[:, None] * sides + np.arange(sides)
    turned = first[:, None] * sides + (np.arange(sides) + 1) % sides
    quads = np.stack([here, turned, turned + sides, here + sides], axis=2).reshape(-1, 4)
    count = len(points)
    starts = np.flatnonzero(np.r_[True, strands.yarn[1:] != strands.yarn[:-1]])
    ends = np.r_[starts[1:] - 1, len(line) - 1]
    open_ends = ~strands.closed[strands.yarn[starts]]
    starts, ends = starts[open_ends], ends[open_ends]
    rims = np.concatenate([starts, ends])
    rim = (rims[:, None] * sides + np.arange(sides)).reshape(-1)
    caps = count + np.arange(len(rim)).reshape(-1, sides)
    caps[: len(starts)] = caps[: len(starts), ::-1]
    facing = np.concatenate([-tangent[starts], tangent[ends]])
    return Tubes(
        np.concatenate([points, points[rim]]),
        np.concatenate([outward.reshape(-1, 3), np.repeat(facing, sides, axis=0)]),
        quads,
        caps,
        np.concatenate([np.repeat(np.arange(len(line)), sides), np.repeat(rims, sides)]),
        np.concatenate([np.repeat(first, sides), starts, ends - 1]),
    )


def _frames(strands: Strands) -> tuple[Numbers, Numbers]:
    """Unit tangents, and unit vectors at right angles to them that turn little from one sample to the next, (m, 3) each."""
    line = strands.points
    step = np.diff(line, axis=0)
    joined = strands.yarn[1:] == strands.yarn[:-1]
    step[~joined] = 0.0
    length = np.linalg.norm(step, axis=1, keepdims=True)
    step = np.divide(step, length, out=np.zeros_like(step), where=length > 0)
    tangent = np.zeros_like(line)
    tangent[:-1] += step
    tangent[1:] += step
    starts = np.flatnonzero(np.r_[True, ~joined])
    ends = np.r_[starts[1:] - 1, len(line) - 1]
    for first, last in zip(starts[strands.closed[strands.yarn[starts]]], ends, strict=False):
        tangent[first] = tangent[last] = tangent[first] + tangent[last]
    tangent = _unit(tangent)
    tangent[~tangent.any(1)] = (1.0, 0.0, 0.0)
    side = np.empty_like(line)
    for first, last in zip(starts, ends + 1, strict=True):
        own = tangent[first:last]
        # the direction that the yarn keeps away from most; where it comes near even so, a frame is carried along
        reference = np.linalg.eigh(own.T @ own)[1][:, 0]
        across = np.cross(own, reference)
        if np.linalg.norm(across, axis=1).min() > 0.2:
            side[first:last] = _unit(np.cross(across, own))
        else:
            side[first:last] = _carried(own, bool(strands.closed[strands.yarn[first]]))
    return tangent, side


def _carried(tangent: Numbers, closed: bool) -> Numbers:
    """A vector carried along a curve without turning about it, (k, 3)."""
    side = np.empty_like(tangent)
    side[0] = _unit(np.cross(tangent[0], np.eye(3)[np.argmin(np.abs(tangent[0]))]))
    for k in range(1, len(tangent)):
        moved = side[k - 1] - (side[k - 1] @ tangent[k]) * tangent[k]
        side[k] = moved / np.linalg.norm(moved) if moved.any() else side[k - 1]
    if closed:  # what is missing to meet itself is spread over the whole length
        across = np.cross(tangent, side)
        missing = np.arctan2(side[0] @ across[-1], side[0] @ side[-1]) * np.linspace(0, 1, len(side))[:, None]
        side = np.cos(missing) * side + np.sin(missing) * across
    return side


def _unit(vectors: Numbers) -> Numbers:
    norm = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, norm, out=np.zeros_like(vectors), where=norm > 0)
