"""From a configuration to coloured surfaces, and from these to pixels by whatever can draw here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.simulation.cloth import Fabric
from yarnverify.simulation.solids import Ball
from yarnverify.simulation.view.camera import Camera
from yarnverify.simulation.view.measures import Measure
from yarnverify.simulation.view.probe import tell, why_not, without_display
from yarnverify.simulation.view.strands import Strands, strands
from yarnverify.simulation.view.tubes import Tubes, tubes

Pixels = NDArray[np.uint8]
FAMILIES = {"warp": (46, 84, 130), "weft": (222, 196, 150), "yarn": (178, 76, 56)}  # indigo, ecru, madder
UNKNOWN = (190, 190, 190)  # where a measure has no value
STONE = (206, 202, 196)  # what yarns lie on


@dataclass(frozen=True, eq=False)
class Body:
    """Coloured tubes.

    Attributes
    ----------
    colours
        Of faces, quads then caps, where a measure is constant by segments, else of vertices: (faces or v, 3), 0 to 255.
    """

    strands: Strands
    tubes: Tubes
    colours: Pixels
    by_face: bool


def body(
    fabric: Fabric,
    Q: ArrayLike,
    measure: Measure | None = None,
    limits: tuple[float, float] | None = None,
    *,
    detail: int = 8,
    sides: int = 12,
    solids: Sequence[Ball] = (),
) -> Body:
    """What is drawn: tubes coloured by a measure on a scale, or by the family of their yarn; and what they lie on."""
    lines = strands(fabric, Q, detail)
    surface = tubes(lines, sides)
    if measure is None:
        families = np.array([FAMILIES[y.family] for y in fabric.yarns], np.uint8)
        made = Body(lines, surface, families[lines.yarn[surface.interval]], True)
    else:
        values = measure.on_samples(lines)
        colours = colours_of(values, limits or measure.limits, measure.signed)
        by_face = measure.at == "segments"
        made = Body(lines, surface, colours[surface.interval if by_face else surface.sample], by_face)
    for solid in solids:
        made = _with(made, solid)
    return made


def _with(body: Body, solid: Ball) -> Body:
    """The body and a solid beside it."""
    points, normals, quads = solid.surface()
    old = body.tubes
    count = len(quads if body.by_face else points)
    at = len(old.quads) if body.by_face else len(old.points)
    stone = np.tile(np.array(STONE, np.uint8), (count, 1))
    tubes = replace(
        old, points=np.concatenate([old.points, points]), normals=np.concatenate([old.normals, normals]),
        quads=np.concatenate([old.quads, quads + len(old.points)]),
    )  # fmt: skip
    return replace(body, tubes=tubes, colours=np.concatenate([body.colours[:at], stone, body.colours[at:]]))


def colours_of(values: NDArray[np.float64], limits: tuple[float, float], signed: bool) -> Pixels:
    """Colours of values on a scale, (n, 3); grey where there is no value."""
    low, high = limits
    width = high - low
    middle = 127.5 if signed else 0.0
    place = np.where(np.isfinite(values), 255 * (values - low) / width if width > 0 else middle, 0.0)
    found = table_of(signed)[np.clip(np.rint(place), 0, 255).astype(int)]
    return np.where(np.isfinite(values)[:, None], found, np.array(UNKNOWN, np.uint8))


def families_of(fabric: Fabric) -> list[str]:
    """Families that a legend has to tell apart."""
    return [name for name in ("warp", "weft") if any(y.family == name for y in fabric.yarns)]


@cache
def table_of(signed: bool) -> Pixels:
    """The 256 colours of a scale, (256, 3): both keep their order for the colour-blind, and show the shape at zero."""
    import matplotlib

    name, low, high = ("coolwarm", 0.0, 1.0) if signed else ("YlOrRd", 0.04, 0.92)
    made = matplotlib.colormaps[name](np.linspace(low, high, 256), bytes=True)
    return np.asarray(made[:, :3], np.uint8)


def pixels(body: Body, seen: Camera, size: tuple[int, int]) -> Pixels:
    """The picture alone, without any writing, (height, width, 3): by VTK, or by matplotlib where that cannot render."""
    reason = why_not()
    if reason is None:
        return _by_vtk(body, seen, size)
    tell(reason)
    from yarnverify.simulation.view.flat import drawn

    return drawn(body, seen, size)


def _by_vtk(body: Body, seen: Camera, size: tuple[int, int]) -> Pixels:
    plotter = plotter_of(body, seen, size)
    try:
        return np.asarray(plotter.screenshot(None, return_img=True), np.uint8)[..., :3]
    finally:
        plotter.close()


def plotter_of(body: Body, seen: Camera, size: tuple[int, int], off_screen: bool = True) -> Any:
    """A pyvista plotter that shows the body, to draw from or to add to."""
    without_display()
    import pyvista

    plotter = pyvista.Plotter(off_screen=off_screen, window_size=list(size), lighting="none")
    plotter.set_background("white")
    for place, intensity in (((-0.6, 0.9, 1.0), 0.62), ((0.9, 0.3, 0.7), 0.28), ((0.0, -0.4, 1.0), 0.3)):
        direction = np.asarray(place) @ seen.axes  # lights go with the eye, so that a turntable is lit evenly
        light = pyvista.Light(
            position=tuple(seen.centre + direction), focal_point=tuple(seen.centre), intensity=intensity
        )
        light.positional = False
        plotter.add_light(light)
    actor = plotter.add_mesh(
        mesh(body), scalars="colour", rgb=True, ambient=0.12, diffuse=0.95, specular=0.18,
        specular_power=18, show_scalar_bar=False,
    )  # fmt: skip
    actor.prop.interpolation = "Phong"  # with our own normals; smooth_shading would make others
    eye = plotter.camera
    eye.parallel_projection = True
    span = float(np.ptp(body.tubes.points, axis=0).max()) + seen.height
    eye.focal_point = tuple(seen.centre)
    eye.position = tuple(seen.centre + 2 * span * seen.axes[2])
    eye.up = tuple(seen.axes[1])
    eye.parallel_scale = seen.height / 2
    eye.clipping_range = (0.2 * span, 5 * span)
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def mesh(body: Body) -> Any:
    """The body as pyvista's PolyData, with normals and ``colour``."""
    without_display()
    import pyvista

    quads, caps = body.tubes.quads, body.tubes.caps
    faces = [np.column_stack([np.full(len(f), f.shape[1]), f]).ravel() for f in (quads, caps)]
    surface = pyvista.PolyData(body.tubes.points, faces=np.concatenate(faces))
    surface.point_data.active_normals = body.tubes.normals
    if body.by_face:
        surface.cell_data["colour"] = body.colours
    else:
        surface.point_data["colour"] = body.colours
    return surface
