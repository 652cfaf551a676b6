"""What is read off a configuration: tensions and angles of segments; and the energy of a motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.simulation.setting import Outcome
from yarnverify.simulation.tables import Table

Array = NDArray[Any]


def edges(Q: ArrayLike, table: Table) -> Array:
    """Vectors from the first to the second node of each element of a table of segments, (3, n), m."""
    q = np.asarray(Q, float)[table.rows]
    return q[3:6] - q[:3]


def rests(Q: ArrayLike, table: Table) -> Array:
    """Rest length of each segment, u1 - u0, (n,), m."""
    q = np.asarray(Q, float)[table.rows]
    return q[7] - q[6]


def tensions(Q: ArrayLike, table: Table, k_s: float) -> Array:
    """Tension of each segment, ``k_s (l/du - 1)``, (n,), N."""
    return k_s * (np.linalg.norm(edges(Q, table), axis=0) / rests(Q, table) - 1)


def slopes(Q: ArrayLike, table: Table, along: int, across: int) -> Array:
    """Angle of each segment in the plane of two axes, from the first towards the second, (n,), rad, without jumps."""
    edge = edges(Q, table)
    return np.unwrap(np.arctan2(edge[across], edge[along]))


def deviations(Q: ArrayLike, table: Table) -> Array:
    """Right angle less the angle between warp and weft in each quadrant of a table of shears, (n,), rad."""
    q = np.asarray(Q, float)[table.rows]
    warp, weft = q[3:6] - q[:3], q[6:9] - q[:3]
    return np.arctan2((warp * weft).sum(axis=0), np.linalg.norm(np.cross(warp, weft, axis=0), axis=0))


def energy_of_motion(at: Outcome) -> float:
    """Kinetic and potential energy, J; nan of a problem at rest."""
    return at.motion.energy if at.motion else np.nan
