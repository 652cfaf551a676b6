"""``yarnverify simulate --write``: every scene that has a known answer, and what it would cost with everything switched on."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from yarnverify.machine import environment
from yarnverify.simulation.frugality import frugality
from yarnverify.simulation.scene import Scene
from yarnverify.simulation.study import Tell, study
from yarnverify.simulation.view.files import whole

COMMAND = "yarnverify simulate --write"
ROUNDS = 2  # the shorter time of these counts: the first one meets cold memory


def measure(scenes: Sequence[Scene], tell: Tell = lambda label, done: None) -> dict[str, Any]:
    """The record: ``scenes``, the same each time on a machine, and ``timings``, which belong to a machine and a moment."""
    found: list[dict[str, Any]] = []
    timings: dict[str, Any] = {}
    for number, scene in enumerate(scenes):

        def told(label: str, done: float, number: int = number, name: str = scene.name) -> None:
            tell(f"{name}, {label}", (number + 0.5 * done) / len(scenes))

        rounds = [study(scene, scene.sizes, {}, tell=told) for _ in range(ROUNDS)]
        line, size = scene.lines()[0], scene.sizes[1]
        told(f"{size}: with everything switched on", 1.0)
        spared, spared_timed = frugality(scene.problem(size, line.values), size)
        found.append({**rounds[0].result, "frugality": spared})
        timings[scene.name] = {
            "lines": _shortest([each.timings["lines"] for each in rounds]),
            "frugality": spared_timed,
        }
    return {
        "schema": 1,
        "command": COMMAND,
        "scenes": found,
        "timings": {"environment": environment(("scipy",), None), "rounds": ROUNDS, "scenes": timings},
    }


def _shortest(rounds: Sequence[list[dict[str, Any]]]) -> list[dict[str, Any]]:
    return [
        {"name": lines[0]["name"], "runs": [min(runs, key=lambda run: float(run["seconds"]))
                                            for runs in zip(*(line["runs"] for line in lines), strict=True)]}
        for lines in zip(*rounds, strict=True)
    ]  # fmt: skip


def write(record: dict[str, Any], folder: Path) -> Path:
    """Write it below a folder of reports."""
    path = folder / "records" / "simulation.json"
    with whole(path) as part:
        part.write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return path
