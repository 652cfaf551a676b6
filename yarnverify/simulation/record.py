"""``yarnverify simulate --write``: every scene that has a known answer, and what it would cost with everything switched on;
and the scenes that are there to be looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from yarnverify.files import write_record
from yarnverify.machine import environment
from yarnverify.simulation.frugality import frugality
from yarnverify.simulation.scene import Scene
from yarnverify.simulation.study import Study, Tell, study

COMMAND = "yarnverify simulate --write"
ROUNDS = 2  # the shorter time of these counts: the first one meets cold memory


def measure(
    scenes: Sequence[Scene],
    tell: Tell = lambda label, done: None,
    draw: Callable[[Study], None] = lambda found: None,
    shown: Sequence[Scene] = (),
) -> dict[str, Any]:
    """The record: for each scene a ``result``, the same each time on a machine, and timings, which belong to a moment.

    Parameters
    ----------
    draw
        Called with each study, to make a picture of it.
    shown
        Scenes that are run once, to be drawn.
    """
    count = len(scenes) + len(shown)
    found = [_measured(scene, (number, count), tell, draw) for number, scene in enumerate(scenes)]
    seen = [_shown(scene, (number, count), tell, draw) for number, scene in enumerate(shown, len(scenes))]
    made = {"schema": 1, "command": COMMAND, "environment": environment(("scipy",), None), "scenes": found}
    return {**made, "shown": seen} if seen else made


def _shown(scene: Scene, place: tuple[int, int], tell: Tell, draw: Callable[[Study], None]) -> dict[str, Any]:
    found = study(
        scene, scene.sizes, {}, tell=lambda label, done: tell(f"{scene.name}, {label}", (place[0] + done) / place[1])
    )
    draw(found)
    return {"result": found.result, "timings": found.timings}


def _measured(scene: Scene, place: tuple[int, int], tell: Tell, draw: Callable[[Study], None]) -> dict[str, Any]:
    def told(label: str, done: float) -> None:
        tell(f"{scene.name}, {label}", (place[0] + 0.5 * done) / place[1])

    rounds = [study(scene, scene.sizes, {}, tell=told) for _ in range(ROUNDS)]
    draw(rounds[0])
    size = scene.sizes[1]
    told(f"{size}: with everything switched on", 1.0)
    spared, spared_timed = frugality(scene.problem(size, scene.lines()[0].values), size)
    lines = [_shortest(same) for same in zip(*(each.timings["lines"] for each in rounds), strict=True)]
    return {
        "result": rounds[0].result,
        "timings": {**rounds[0].timings, "lines": lines},
        "frugality": {"result": spared, "timings": spared_timed},
    }


def _shortest(lines: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The shortest run of each size."""
    sizes = zip(*(line["runs"] for line in lines), strict=True)
    return {"name": lines[0]["name"], "runs": [min(runs, key=lambda run: float(run["seconds"])) for runs in sizes]}


def write(record: dict[str, Any], folder: Path) -> Path:
    """Write it below a folder of reports."""
    path = folder / "records" / "simulation.json"
    write_record(record, path)
    return path
