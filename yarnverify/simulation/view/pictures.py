"""Still pictures and movies as files, with scale and legend."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from yarnverify.errors import InputError
from yarnverify.files import whole
from yarnverify.simulation.cloth import Fabric
from yarnverify.simulation.solids import Ball
from yarnverify.simulation.view.camera import Camera, camera
from yarnverify.simulation.view.drawing import FAMILIES, Body, Pixels, body, pixels, table_of
from yarnverify.simulation.view.measures import Measure, measure, shown
from yarnverify.simulation.view.movies import write_movie
from yarnverify.simulation.view.probe import required
from yarnverify.simulation.view.sheet import BOTTOM, RIGHT, TOP, Sheet
from yarnverify.simulation.view.strands import strands

Colour = str | Measure | None
View = str | tuple[ArrayLike, ArrayLike]
ROOM = (0.03, RIGHT, BOTTOM, TOP)


def picture(
    fabric: Fabric,
    Q: ArrayLike,
    path: str | Path,
    *,
    colour: Colour = None,
    limits: tuple[float, float] | None = None,
    view: View = "oblique",
    title: str = "",
    note: str = "",
    size: tuple[int, int] = (1600, 1200),
    solids: Sequence[Ball] = (),
) -> Path:
    """Draw a configuration as PNG (or any format that pillow knows).

    Parameters
    ----------
    Q
        Configuration, (size,), m.
    colour
        ``stretch``, ``bending``, ``shear``, ``contact``, ``sliding``, or a ``Measure``; None shows warp and weft.
    limits
        Ends of the scale, in the unit of the measure; by default what the configuration has.
    view
        See ``camera.camera``.
    title, note
        Written above, at the left and at the right.
    size
        Width and height in pixels.
    solids
        What the yarns lie on.

    Raises
    ------
    NotRunError
        The extra ``view`` is not installed, or the file cannot be written.
    """
    required()
    chosen = _chosen(fabric, Q, colour)
    drawn = body(fabric, Q, chosen, limits, **_fineness(fabric), solids=solids)
    seen = camera([drawn.tubes.points], view, aspect=size[0] / size[1], room=ROOM)
    sheet = Sheet(fabric, size, seen, chosen, limits, title)
    return _save(sheet.compose(pixels(drawn, seen, size), note), Path(path))


def movie(
    fabric: Fabric,
    frames: Sequence[ArrayLike],
    path: str | Path,
    *,
    times: Sequence[float] | None = None,
    colour: str | Sequence[Measure] | None = None,
    limits: tuple[float, float] | None = None,
    view: View = "oblique",
    turn: float = 0.0,
    title: str = "",
    size: tuple[int, int] = (960, 720),
    rate: float = 20.0,
    solids: Sequence[Ball] = (),
) -> Path:
    """A movie of configurations over time, or of a standing one from all around: GIF, or MP4 where imageio-ffmpeg is installed.

    Camera and scale are the same in all frames.

    Parameters
    ----------
    frames
        Configurations, (size,) each.
    times
        Of each frame, s; written into the picture.
    colour
        As in ``picture``, or one measure a frame.
    turn
        Turns of the camera about the vertical from the first frame to the end.
    rate
        Frames a second.
    solids
        What the yarns lie on.

    Raises
    ------
    InputError
        No frames, or a file name that does not end in .gif or .mp4.
    """
    required()
    path = Path(path)
    if path.suffix not in (".gif", ".mp4"):
        raise InputError(f"{path.name}: a movie ends in .gif or .mp4")
    if not len(frames) or (times is not None and len(times) != len(frames)):
        raise InputError(f"a movie needs frames, and a time for each: {len(frames)} frames")
    given: Sequence[Colour] = [colour] * len(frames) if colour is None or isinstance(colour, str) else list(colour)
    measures = [_chosen(fabric, Q, one) for Q, one in zip(frames, given, strict=True)]
    scale, measures = _common(measures, limits)
    fineness = _fineness(fabric, moving=True)

    def bodies() -> Iterator[Body]:
        for Q, one in zip(frames, measures, strict=True):
            yield body(fabric, Q, one, scale, **fineness, solids=solids)

    clouds = [strands(fabric, Q, 2).points for Q in frames] + [solid.surface(12)[0] for solid in solids]
    seen = camera(clouds, view, aspect=size[0] / size[1], room=ROOM, margin=fabric.R, turning=turn != 0)
    sheet = Sheet(fabric, size, seen, measures[0], scale, title)
    notes = [""] * len(frames) if times is None else [time_note(t, max(map(abs, times))) for t in times]
    images = (
        sheet.compose(pixels(drawn, _turned(seen, turn * k / len(frames)), size), note)
        for k, (drawn, note) in enumerate(zip(bodies(), notes, strict=True))
    )
    keep = np.array(list(FAMILIES.values()), np.uint8) if measures[0] is None else table_of(measures[0].signed)[::4]
    return write_movie(images, path, rate, keep)


def turntable(
    fabric: Fabric, Q: ArrayLike, path: str | Path, *, colour: Colour = None, frames: int = 48, view: View = "oblique",
    title: str = "", size: tuple[int, int] = (960, 720), rate: float = 16.0,
) -> Path:  # fmt: skip
    """A movie once around a configuration."""
    given = [colour] * frames if isinstance(colour, Measure) else colour
    return movie(fabric, [Q] * frames, path, colour=given, view=view, turn=1.0, title=title, size=size, rate=rate)


def _turned(seen: Camera, turns: float) -> Camera:
    return seen.turned(2 * np.pi * turns) if turns else seen


def _chosen(fabric: Fabric, Q: ArrayLike, colour: Colour) -> Measure | None:
    return measure(fabric, Q, colour) if isinstance(colour, str) else shown(colour) if colour is not None else None


def _common(
    measures: list[Measure | None], limits: tuple[float, float] | None
) -> tuple[tuple[float, float] | None, list[Measure | None]]:
    """One scale, and one unit, for all frames."""
    known = [m for m in measures if m is not None]
    if not known:
        return None, measures
    if limits is None:
        limits = (min(m.limits[0] for m in known), max(m.limits[1] for m in known))
    return limits, measures


def _fineness(fabric: Fabric, moving: bool = False) -> dict[str, int]:
    """Samples a segment and faces around: fewer where there are so many yarns that nobody could see them."""
    count = len(fabric.chain.nodes)
    for most, detail, sides in ((2000, 12, 24), (10_000, 8, 16), (60_000, 6, 10)):
        if count <= most:
            return {"detail": detail - 2 * moving, "sides": sides - 4 * moving}
    return {"detail": 4, "sides": 6}


def time_note(t: float, most: float) -> str:
    """A time in seconds with the unit that suits the latest one."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if most >= size:
            return f"t = {t / size:.{2 if unit == 's' else 1}f} {unit}"
    return f"t = {t:.3g} s"


def _save(image: Pixels, path: Path) -> Path:
    from PIL import Image

    with whole(path) as part:
        Image.fromarray(image).save(part)
    return path
