"""An interactive scene as one HTML file that needs nothing else: no server, no network, no library."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError
from yarnverify.files import whole
from yarnverify.simulation.cloth import Fabric
from yarnverify.simulation.solids import Ball
from yarnverify.simulation.view.camera import VIEWS, camera
from yarnverify.simulation.view.drawing import FAMILIES, STONE, UNKNOWN, table_of
from yarnverify.simulation.view.measures import MEASURES, Measure, measure
from yarnverify.simulation.view.pictures import time_note
from yarnverify.simulation.view.probe import required
from yarnverify.simulation.view.strands import strands

_LEVELS = 253  # 254 means that there is no value, 255 is for what yarns lie on


def scene(
    fabric: Fabric,
    frames: ArrayLike | Sequence[ArrayLike],
    path: str | Path,
    *,
    times: Sequence[float] | None = None,
    colours: Sequence[str] = tuple(MEASURES),
    title: str = "",
    rate: float = 20.0,
    detail: int = 6,
    sides: int = 12,
    solids: Sequence[Ball] = (),
) -> Path:
    """Write a scene to turn, zoom and play in a browser (WebGL 2).

    Parameters
    ----------
    frames
        One configuration (size,) or several, m.
    times
        Of each frame, s.
    colours
        Names of measures to choose from, besides warp and weft. Each has one scale for all frames.
    rate
        Frames a second.
    detail, sides
        Samples a segment and faces around a yarn.
    solids
        What the yarns lie on.
    """
    required()
    several = np.atleast_2d(np.asarray(frames, float))
    if several.ndim != 2 or several.shape[1] != fabric.size or not len(several):
        raise InputError(f"a scene needs configurations of {fabric.size} numbers; got an array {several.shape}")
    if times is not None and len(times) != len(several):
        raise InputError(f"a scene needs a time for each of its {len(several)} frames; got {len(times)}")
    lines = [strands(fabric, Q, detail) for Q in several]
    points = np.stack([line.points for line in lines])
    low, high = points.min((0, 1)), points.max((0, 1))
    step = float(max((high - low).max(), fabric.R) / 65535)
    first = lines[0]
    starts = np.flatnonzero(np.r_[True, first.yarn[1:] != first.yarn[:-1]])
    clouds = [*points, *(solid.surface(12)[0] for solid in solids)]
    low_seen, high_seen = (end([end(cloud, axis=0) for cloud in clouds], axis=0) for end in (np.min, np.max))
    seen = {name: camera(clouds, name, aspect=4 / 3, room=(0.06, 0.15, 0.14, 0.1), margin=fabric.R) for name in VIEWS}
    start = seen["oblique"]
    data: dict[str, Any] = {
        "title": title,
        "frames": len(several),
        "rate": rate,
        "notes": [""] * len(several) if times is None else [time_note(t, max(map(abs, times))) for t in times],
        "starts": [*starts.tolist(), len(first.yarn)],
        "closed": first.closed[first.yarn[starts]].tolist(),
        "R": fabric.R,
        "sides": sides,
        "low": low.tolist(),
        "step": step,
        "lines": _packed(np.rint((points - low) / step).astype("<u2")),
        "solids": [_solid(solid) for solid in solids],
        "measures": [_families(fabric, first), *(_measured(fabric, several, lines, name) for name in colours)],
        "families": [
            (name, FAMILIES[name])
            for name in FAMILIES
            if name != "yarn" and any(y.family == name for y in fabric.yarns)
        ],
        "views": [
            {"name": name, "axes": seen[name].axes.tolist(), "height": seen[name].height}
            for name in sorted(VIEWS, key="oblique".__ne__)
        ],
        "home": {
            "centre": start.centre.tolist(),
            "pivot": start.pivot.tolist(),
            "height": start.height,
            "aspect": 4 / 3,
            "depth": float(2 * np.linalg.norm(high_seen - low_seen) + 20 * fabric.R),
        },
    }
    page = files("yarnverify.simulation.view").joinpath("scene.html").read_text(encoding="utf-8")
    text = json.dumps(data, ensure_ascii=False).replace("</", "<\\/")
    with whole(Path(path)) as part:
        part.write_text(page.replace("/*DATA*/null", text), encoding="utf-8")
    return Path(path)


def _packed(array: NDArray[Any]) -> str:
    return base64.b64encode(gzip.compress(array.tobytes(), 6, mtime=0)).decode()


def _solid(solid: Ball) -> dict[str, str]:
    points, normals, quads = solid.surface()
    triangles = quads[:, [0, 1, 2, 0, 2, 3]]
    arrays = {"points": points.astype("<f4"), "normals": normals.astype("<f4"), "triangles": triangles.astype("<u4")}
    return {name: _packed(values) for name, values in arrays.items()}


def _families(fabric: Fabric, line: Any) -> dict[str, Any]:
    """Which yarn is which, as a measure with three colours."""
    names = list(FAMILIES)
    index = np.array([names.index(y.family) for y in fabric.yarns], np.uint8)
    return {
        "name": "yarns",
        "colours": [*map(list, FAMILIES.values()), *[list(UNKNOWN)] * (255 - len(FAMILIES)), list(STONE)],
        "values": _packed(index[line.yarn]),
        "still": True,
        "stepped": True,
    }


def _measured(fabric: Fabric, frames: NDArray[np.float64], lines: Sequence[Any], name: str) -> dict[str, Any]:
    found: list[Measure] = [measure(fabric, Q, name) for Q in frames]
    low, high = min(m.limits[0] for m in found), max(m.limits[1] for m in found)
    width = high - low if high > low else 1.0
    values = np.stack([m.on_samples(line) for m, line in zip(found, lines, strict=True)])
    middle = _LEVELS / 2 if found[0].signed and not high > low else 0.0
    levels = np.where(np.isfinite(values), np.clip(np.rint((values - low) / width * _LEVELS + middle), 0, _LEVELS), 254)
    colours = table_of(found[0].signed)[np.rint(np.arange(_LEVELS + 1) / _LEVELS * 255).astype(int)]
    return {
        "name": found[0].name,
        "label": found[0].label,
        "lacking": found[0].lacking(fabric),
        "colours": [*colours.tolist(), list(UNKNOWN), list(STONE)],
        "values": _packed(levels.astype(np.uint8)),
        "stepped": found[0].at == "segments",
        "ticks": _ticks(low, high),
    }


def _ticks(low: float, high: float) -> list[tuple[float, str]]:
    """Round numbers on a scale: how far up, and what to write."""
    if not high > low:
        return [(0.5 if low < 0 else 0.0, "0")]
    raw = (high - low) / 5
    power = 10.0 ** np.floor(np.log10(raw))
    step = float(power * next(s for s in (1, 2, 2.5, 5, 10) if s * power >= raw * (1 - 1e-12)))
    numbers = step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1)
    return [((number - low) / (high - low), f"{number + 0.0:.4g}") for number in numbers.tolist()]
