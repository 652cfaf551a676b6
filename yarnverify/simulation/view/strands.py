"""Where yarns are drawn: smooth curves through the nodes, on their own side of each crossing.

A crossing is one point of the model. Drawn there, the two yarns would run through each other; so each is moved by its radius
to its side, and swings over from crossing to crossing. If the yarns meet at the angle phi and both curve by k towards each
other, the squared distance of their centre lines s and t away from the crossing is
4 R^2 + (1 - 2 R k)(s^2 + t^2) - 2 s t cos(phi) + ..., so that they touch there without overlap where
k <= (1 - |cos(phi)|) / (2 R). The swing is a cosine as long as that holds, and flatter at its ends where it would not.
Where a dense cloth is sheared so far that there is no room for its yarns, they overlap, for the configuration does.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.simulation.cloth import Fabric

Numbers = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Strands:
    """Centre lines of yarns for display.

    Attributes
    ----------
    points
        Samples of all yarns, (m, 3), m.
    yarn
        Yarn of each sample, (m,).
    place, part
        The place in the fabric's chain before each sample and how far it is to the next, 0 to 1, (m,).
    closed
        Whether each yarn is closed, (yarns,); its last sample then repeats its first.
    R
        Radius of the yarns, m.
    """

    points: Numbers
    yarn: Indices
    place: Indices
    part: Numbers
    closed: NDArray[np.bool_]
    R: float

    @property
    def intervals(self) -> Indices:
        """First samples of all pairs that follow each other on a yarn."""
        return np.flatnonzero(self.yarn[1:] == self.yarn[:-1])


def strands(fabric: Fabric, Q: ArrayLike, detail: int = 8, crimp: bool = True) -> Strands:
    """Centre lines of a configuration.

    Parameters
    ----------
    Q
        Configuration, (size,), m.
    detail
        Samples a segment.
    crimp
        Whether yarns pass over and under each other; else they run through the crossings.
    """
    from scipy.interpolate import CubicSpline

    points = fabric.points(Q)
    chain = fabric.chain
    first, second = chain.pairs
    owner = chain.yarn[first]
    starts = np.flatnonzero(np.r_[True, owner[1:] != owner[:-1], True])
    tau = np.arange(detail) / detail
    curves, places, parts, owners = [], [], [], []
    for begin, end in pairwise(starts):
        along = np.r_[first[begin:end], second[end - 1]]
        nodes = points[chain.nodes[along]]
        chord = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
        chord = np.maximum(chord, 1e-9 * chord.max(initial=0.0) + 1e-300)  # a spline needs growing parameters
        arc = np.r_[0.0, np.cumsum(chord)]
        closed = bool(chain.closed[along[0]])
        spline = CubicSpline(arc, nodes, bc_type="periodic" if closed else "natural")
        place = np.append(np.repeat(along[:-1], detail), along[-2])
        part = np.append(np.tile(tau, end - begin), 1.0)
        curves.append(spline(_spread(arc, tau)))
        places.append(place)
        parts.append(part)
        owners.append(np.full(len(place), owner[begin]))
    place, part = np.concatenate(places), np.concatenate(parts)
    curve = np.concatenate(curves)
    if crimp and len(fabric.crossings):
        curve = curve + _crimp(fabric, points, place, part)
    closed_yarns = np.array([y.closed for y in fabric.yarns])
    return Strands(curve, np.concatenate(owners), place, part, closed_yarns, fabric.R)


def _spread(arc: Numbers, tau: Numbers) -> Numbers:
    inside = (arc[:-1, None] + np.diff(arc)[:, None] * tau).ravel()
    return np.append(inside, arc[-1])


def _crimp(fabric: Fabric, points: Numbers, place: Indices, part: Numbers) -> Numbers:
    """Offset of each sample, (m, 3)."""
    chain = fabric.chain
    sides, normals, bounds = _sides(fabric, points)
    after = np.minimum(place + 1, len(chain.nodes) - 1)
    length = np.linalg.norm(points[chain.nodes[after]] - points[chain.nodes[place]], axis=1)
    height = _swing(sides[place], sides[after], length, np.minimum(bounds[place], bounds[after]), part)
    normal = (1 - part)[:, None] * normals[place] + part[:, None] * normals[after]
    return height[:, None] * _unit(normal)


def _sides(fabric: Fabric, points: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """At each place of the chain: height over the cloth (p,), m; the cloth's normal, weft cross warp, (p, 3); the greatest
    curvature that keeps the yarns apart (p,), 1/m.
    """
    chain = fabric.chain
    before, after = chain.neighbours
    warp, weft = chain.of_crossings

    def tangent(places: Indices) -> Numbers:
        a, b = after[places], before[places]
        own = chain.nodes[places]
        return _unit(points[np.where(a < 0, own, a)] - points[np.where(b < 0, own, b)])

    along_warp, along_weft = tangent(warp), tangent(weft)
    normal = _unit(np.cross(along_weft, along_warp))
    bound = 0.9 * (1 - np.abs((along_warp * along_weft).sum(1))) / (2 * fabric.R)
    sides, normals = np.zeros(len(chain.nodes)), np.zeros((len(chain.nodes), 3))
    bounds = np.full(len(chain.nodes), np.inf)
    for places, sign in ((warp, 1.0), (weft, -1.0)):
        sides[places] = sign * fabric.over * fabric.R
        normals[places] = normal
        bounds[places] = bound
    lone = np.flatnonzero(~normals.any(1))  # a tail goes straight on from the last crossing
    for shift in (1, -1):
        near = np.clip(lone + shift, 0, len(chain.nodes) - 1)
        usable = (chain.yarn[near] == chain.yarn[lone]) & ~normals[lone].any(1)
        normals[lone[usable]], sides[lone[usable]] = normals[near[usable]], sides[near[usable]]
    return sides, normals, bounds


def _swing(start: Numbers, end: Numbers, length: Numbers, bound: Numbers, part: Numbers) -> Numbers:
    """Height between two crossings, level at both and curved there by no more than a bound."""
    cosine = (1 - np.cos(np.pi * part)) / 2
    level = part**3 * (10 - 15 * part + 6 * part**2)  # no curvature at its ends
    curvature = np.pi**2 / 2 * np.abs(end - start)  # of the cosine at its ends, times length squared
    allowed = np.where(np.isfinite(bound), bound, 0.0) * length**2
    free = ~np.isfinite(bound) | (allowed >= curvature)
    weight = np.where(free, 1.0, np.divide(allowed, curvature, out=np.ones_like(length), where=curvature > 0))
    return start + (end - start) * (weight * cosine + (1 - weight) * level)


def _unit(vectors: Numbers) -> Numbers:
    norm = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, norm, out=np.zeros_like(vectors), where=norm > 0)
