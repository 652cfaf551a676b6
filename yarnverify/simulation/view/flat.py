"""Drawing with matplotlib where VTK cannot render: the same tubes, faces sorted by depth and shaded by their normals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from yarnverify.simulation.view.camera import Camera

if TYPE_CHECKING:
    from yarnverify.simulation.view.drawing import Body

_LIGHTS = (((-0.6, 0.9, 1.0), 0.6), ((0.9, 0.3, 0.7), 0.25), ((0.0, -0.4, 1.0), 0.25))
_FINER = 2  # drawn so much larger without smoothed edges, then averaged: smoothed edges leave seams between faces


def drawn(body: Body, seen: Camera, size: tuple[int, int]) -> NDArray[np.uint8]:
    """The picture alone, without any writing, (height, width, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    width, height = _FINER * size[0], _FINER * size[1]
    points = (body.tubes.points - seen.centre) @ seen.axes.T
    normals = body.tubes.normals @ seen.axes.T
    figure = Figure(figsize=(width / 100, height / 100), dpi=100, facecolor="white")
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    half = seen.height / 2
    axes.set_xlim(-half * width / height, half * width / height)
    axes.set_ylim(-half, half)
    outlines, depths, paints = [], [], []
    start = 0
    for faces in (body.tubes.quads, body.tubes.caps):
        normal = normals[faces].mean(1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        front = normal[:, 2] > 0
        own = body.colours[start : start + len(faces)] if body.by_face else body.colours[faces].mean(1)
        start += len(faces)
        outlines += list(points[faces][front][:, :, :2])
        depths.append(points[faces][front][:, :, 2].mean(1))
        paints.append(_shaded(own[front] / 255, normal[front]))
    order = np.argsort(np.concatenate(depths), kind="stable")
    polygons = PolyCollection(
        [outlines[k] for k in order], facecolors=np.concatenate(paints)[order], edgecolors="none", antialiased=False
    )
    axes.add_collection(polygons)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    fine = np.asarray(canvas.buffer_rgba())[:height, :width, :3].astype(float)
    return np.rint(fine.reshape(size[1], _FINER, size[0], _FINER, 3).mean((1, 3))).astype(np.uint8)


def _shaded(colours: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    light = np.full(len(normals), 0.22)
    for place, strength in _LIGHTS:
        light += strength * np.maximum(normals @ (np.asarray(place) / np.linalg.norm(place)), 0.0)
    return np.clip(colours * light[:, None], 0, 1)
