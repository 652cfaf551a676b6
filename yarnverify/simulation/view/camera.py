"""Where a picture is seen from. Parallel projection, so that a scale bar holds everywhere in the picture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError

Numbers = NDArray[np.float64]
VIEWS = {  # towards the eye, and what is up
    "top": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "front": ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "side": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "oblique": ((-0.45, -1.0, 0.85), (0.0, 0.0, 1.0)),
}


@dataclass(frozen=True, eq=False)
class Camera:
    """A parallel projection.

    Attributes
    ----------
    axes
        Rows: right and up in the picture, and towards the eye; orthonormal, (3, 3).
    centre
        The point in the middle of the picture, (3,), m.
    height
        What the picture is high, m.
    pivot
        What it turns around, (3,), m.
    """

    axes: Numbers
    centre: Numbers
    height: float
    pivot: Numbers

    def turned(self, angle: float, axis: ArrayLike = (0.0, 0.0, 1.0)) -> Camera:
        """The camera carried around an axis by an angle in radians, its pivot staying where it is in the picture."""
        k = np.asarray(axis, float) / np.linalg.norm(axis)
        cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
        turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
        return replace(self, axes=self.axes @ turn.T, centre=self.pivot + turn @ (self.centre - self.pivot))


def camera(
    clouds: Iterable[Numbers],
    view: str | tuple[ArrayLike, ArrayLike] = "oblique",
    *,
    aspect: float = 4 / 3,
    room: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
    margin: float = 0.0,
    turning: bool = False,
) -> Camera:
    """A camera that sees all of some points.

    Parameters
    ----------
    clouds
        Points (m, 3) that have to be seen, m; for a movie those of every frame.
    view
        ``top``, ``front``, ``side``, ``oblique``, or two vectors: towards the eye, and up.
    aspect
        Width of the picture over its height.
    room
        Shares of the picture to leave free at its left, right, bottom and top.
    margin
        Added on all sides, m.
    turning
        Whether it is to see them from all around the vertical as well.
    """
    if isinstance(view, str) and view not in VIEWS:
        raise InputError(f"view {view!r}: there are {', '.join(VIEWS)}, or give two vectors: towards the eye, and up")
    towards, up = (np.asarray(v, float) for v in (VIEWS[view] if isinstance(view, str) else view))
    towards = towards / np.linalg.norm(towards)
    right = np.cross(up, towards)
    if not np.linalg.norm(right) > 0:
        raise InputError("the direction towards the eye must not be the one that is up")
    right = right / np.linalg.norm(right)
    axes = np.array([right, np.cross(towards, right), towards])
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for cloud in clouds:
        seen = cloud if turning else cloud @ axes.T
        low, high = np.minimum(low, seen.min(0)), np.maximum(high, seen.max(0))
    if turning:  # the upright cylinder around everything
        centre = (low + high) / 2
        radius = np.hypot(*(high - low)[:2]) / 2
        tall = (high - low)[2]
        size = np.array([2 * radius, tall * abs(axes[1, 2]) + 2 * radius * np.sqrt(max(0.0, 1 - axes[1, 2] ** 2)), 0.0])
    else:
        centre, size = axes.T @ ((low + high) / 2), high - low
    size = size + 2 * margin
    left, rest, bottom, top = room
    height = float(max(size[1] / (1 - bottom - top), size[0] / (aspect * (1 - left - rest)), 1e-12))
    shift = np.array([(rest - left) * aspect, top - bottom, 0.0]) * height / 2
    return Camera(axes, centre + shift @ axes, height, centre)
