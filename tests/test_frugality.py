"""What scenes save by modelling only what they need: the record and its page."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from yarnverify.report.pages import pages
from yarnverify.report.simulation import frugality as spared_table
from yarnverify.simulation import record
from yarnverify.simulation.command import find
from yarnverify.simulation.frugality import everything, frugality

RECORDS = Path(__file__).parent.parent / "reports" / "records"


def test_everything_adds_the_energies_and_the_sliding_that_a_scene_does_without() -> None:
    own = find("picture_frame").problem(3)
    full = everything(own)
    assert [term.name for term in full.terms] == ["stretch", "shear", "bending", "parallel_contact", "gravity"]
    assert list(full.terms[:2]) == list(own.terms) and not full.terms[4].parameters["g"].any()
    assert set(own.fabric.slides()) <= set(np.asarray(full.active)) and set(np.asarray(own.active)) <= set(
        np.asarray(full.active)
    )
    assert list(everything(own, sliding=False).active) == list(np.asarray(own.active))


def test_costs_and_how_far_answers_move() -> None:
    # contact alone tells the gaps; with stretch, which is stiffer, they stay near rest
    found, timed = frugality(find("pressed_yarns").problem(6), 6)
    own, other = found["own"], found["all energies, all sliding"]
    assert (
        own["energies"] == {"parallel_contact": 5}
        and own["unknowns"] == 5
        and own["moved"] == []
        and not own["trouble"]
    )
    # 6 wefts of three nodes each and a warp of 8, with a quadrant towards each tail at each crossing
    assert other["energies"] == {"parallel_contact": 5, "stretch": 19, "bending": 12, "shear": 24, "gravity": 19}
    assert other["moved"][0]["name"] == "gap between neighbours" and other["moved"][0]["by"] > 0.01
    assert timed["own"]["bytes"] < timed["all energies"]["bytes"]
    # what a straight yarn does not need does not move it
    found, _ = frugality(find("hanging_yarn").problem(4), 4)
    assert max(move["by"] for move in found["all energies"]["moved"]) < 1e-12


def test_a_scene_without_an_answer_says_why_whatever_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = find("elastica").problem(6)
    monkeypatch.setattr("yarnverify.simulation.frugality.ITERATIONS", 40)
    found, timed = frugality(scene, 6)
    own, other = found["own"], found["all energies, all sliding"]
    assert not own["trouble"] and other["trouble"] == "no equilibrium after 40 iterations"
    assert other["iterations"] == 40 and other["moved"] == []
    assert 0 < other["falling"] < other["unknowns"]
    assert timed["all energies, all sliding"]["seconds an iteration"] > 0
    assert frugality(scene, 6)[0] == found  # the same each time


def test_an_answer_that_is_one_with_everything_too_is_found_from_itself() -> None:
    found, _ = frugality(find("hanging_yarn").problem(5), 5)
    other = found["all energies, all sliding"]  # from the start nodes slide along the yarn until two meet
    assert other["trouble"] and other["falling"] == 0
    assert max(move["by"] for move in other["moved"]) < 1e-12


def test_the_record_of_a_scene_and_its_page(tmp_path: Path) -> None:
    scene = find("sliding_yarn")
    made = record.measure([scene])
    path = record.write(made, tmp_path)
    assert path == tmp_path / "records" / "simulation.json"
    again: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    (each,) = again["scenes"]
    assert each["result"] == json.loads(
        json.dumps(record.measure([scene])["scenes"][0]["result"])
    )  # the same each time
    others = {name: json.loads((RECORDS / f"{name}.json").read_text(encoding="utf-8"))
              for name in ("verdicts", "derivations", "kernels")}  # fmt: skip
    text = pages({**others, "simulation": again})["simulation.md"]
    assert "| sliding_yarn | 64 segments | rest length of a segment |" in text
    assert "| sliding_yarn, 16 segments | as it is | stretch 16 | 15 | 43 |" in text
    assert "simulation.md" not in pages(others) and "To be looked at" not in text
    drawn: list[str] = []
    small = replace(find("draped_cloth"), sizes=(3,))
    seen = record.measure([], draw=lambda study: drawn.append(study.result["scene"]), shown=[small])
    text = pages({**others, "simulation": {**again, "shown": seen["shown"]}}, pictures={"draped_cloth.png"})[
        "simulation.md"
    ]
    assert (
        drawn == ["draped_cloth"] and "draped over a sphere: 3 yarns of each family, 63 unknowns, 60 steps in" in text
    )
    assert "![The end of the scene: a cloth draped over a sphere](pictures/draped_cloth.png)" in text
    del each["frugality"]
    assert spared_table(again) is None


def test_the_committed_record_is_of_all_scenes_and_misses_no_goal() -> None:
    from yarnverify.simulation.scenes import SCENES

    committed = json.loads((RECORDS / "simulation.json").read_text(encoding="utf-8"))
    assert [each["result"]["scene"] for each in committed["scenes"]] == [
        scene.name for scene in SCENES if scene.validates
    ]
    assert [line for each in committed["scenes"] for line in each["result"]["missed"]] == []
    for each in committed["scenes"]:
        scene = next(scene for scene in SCENES if scene.name == each["result"]["scene"])
        assert each["result"]["parameters"].keys() == scene.quantities.keys()
        assert tuple(run["size"] for run in each["result"]["lines"][0]["runs"]) == scene.sizes
