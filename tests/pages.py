"""The HTML report of the committed records and of two small scenes, for the tests that read it and those that open it."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from yarnverify.report.html import page

REPORTS = Path(__file__).parent.parent / "reports"


def records() -> dict[str, Any]:
    return {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in (REPORTS / "records").glob("*.json")}


@cache
def simulated() -> dict[str, Any]:
    """A record of two scenes at small sizes."""
    from yarnverify.simulation.command import find
    from yarnverify.simulation.study import study

    found = [study(find("hanging_yarn"), (4, 8), {}), study(find("elastica"), (10, 20), {})]
    scenes = [json.loads(json.dumps({"result": each.result, "timings": each.timings})) for each in found]
    return {"schema": 1, "command": "yarnverify simulate", "scenes": scenes}


@cache
def drawn(folder: Path) -> dict[str, Any]:
    """A photo and a scene to turn, of a small cloth; none where nothing can be drawn."""
    try:
        from yarnverify.simulation.fabric import weave
        from yarnverify.simulation.view import scene
    except ImportError:
        return {}
    cloth = weave("plain", (3, 3))
    path = scene(cloth, cloth.Q, folder / "elastica.html", detail=2, sides=5, title="a small cloth")
    return {"turned": {"elastica": path.read_text(encoding="utf-8")}}


def whole_page(found: dict[str, Any] | None = None, name: str = "", **more: Any) -> str:
    pictures = {path.stem: path.read_text(encoding="utf-8") for path in (REPORTS / "pictures").glob("*.svg")}
    return page(records() | {"simulation": simulated()} if found is None else found, pictures, name, **more)
