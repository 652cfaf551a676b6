"""Bodies that yarns lie on, as pictures show them. What they do to yarns is an energy of the scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Ball:
    """A ball: centre and radius, m."""

    centre: tuple[float, float, float]
    radius: float

    def surface(self, rings: int = 48) -> tuple[Numbers, Numbers, Indices]:
        """Points and unit normals, (v, 3), and quadrilaterals (q, 4), counterclockwise from outside."""
        latitude = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
        longitude = 2 * np.pi * np.arange(2 * rings) / (2 * rings)
        up, around = np.meshgrid(latitude, longitude, indexing="ij")
        normals = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1).reshape(
            -1, 3
        )
        ring, place = np.indices((rings, 2 * rings))
        here, turned = ring * 2 * rings + place, ring * 2 * rings + (place + 1) % (2 * rings)
        quads = np.stack([here, turned, turned + 2 * rings, here + 2 * rings], axis=-1).reshape(-1, 4)
        return np.asarray(self.centre) + self.radius * normals, normals, quads
