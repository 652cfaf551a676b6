"""Scenes of motion with other parameters than their own, and the scenes that people know, small."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from yarnverify.errors import InputError
from yarnverify.simulation.command import find
from yarnverify.simulation.runs import Run
from yarnverify.simulation.scene import Scene
from yarnverify.simulation.scenes import SCENES
from yarnverify.simulation.setting import Moving, Outcome
from yarnverify.simulation.study import study

MOVING = [each for each in SCENES if each.validates and isinstance(each.problem(each.sizes[0]), Moving)]


@pytest.mark.parametrize("each", MOVING, ids=lambda each: each.name)
def test_a_scene_comes_out_as_known(each: Scene) -> None:
    assert len(each.sizes) >= 3
    assert study(each, each.sizes, {}).missed == []


@pytest.mark.parametrize(
    ("name", "sizes", "values"),
    [
        ("swinging_yarn", (20, 40), {"mode": "2", "k_b": "1e-7", "rho": "1e-4 kg/m", "length": "0.4 m"}),
        ("still_cloth", (5,), {"k_s": "1e5", "L": "5e-4", "R": "1e-4 m", "h": "1.0"}),
        ("rigid_motion", (7,), {"angle": "-2.5 rad", "speed": "-0.3", "k_s": "400"}),
        ("thrown_cloth", (24,), {"k_s": "50", "spin": "-60", "speed": "2 m/s", "g": "1.6", "scheme": "midpoint"}),
        ("axial_swing", (100, 200), {"mode": "2", "segments_": "5", "k_s": "7", "scheme": "midpoint"}),
        ("axial_swing", (40, 80), {"periods": "3", "amplitude": "1e-4", "scheme": "midpoint"}),
        ("energy_over_time", (200, 400), {"angle": "-2.0 rad", "length": "0.3", "scheme": "midpoint"}),
    ],
)
def test_other_parameters_come_out_as_known(name: str, sizes: tuple[int, ...], values: dict[str, str]) -> None:
    assert study(find(name), sizes, values).missed == []


def test_the_diagram_draws_answers_that_one_scheme_alone_has() -> None:
    pytest.importorskip("matplotlib", reason="matplotlib is not installed")
    from yarnverify.report.precision import precision

    found = study(find("axial_swing"), (10, 20), {"periods": "0.2"})
    panels = {axes.get_title(): len(axes.get_lines()) for axes in precision(found.result, found.timings).axes}
    assert set(panels) == {"displacement of the free end", "energy"}
    allowed = 1  # a line of its own in each panel
    assert panels["energy"] == 1 + allowed and panels["displacement of the free end"] in (3, 3 + allowed)


def test_energy_has_no_trend_over_many_swings() -> None:
    found = study(find("energy_over_time"), (60,), {"swings": "5", "scheme": "midpoint"})
    (answer,) = [a for a in found.result["lines"][0]["runs"][0]["answers"] if a["name"].startswith("trend")]
    assert answer["error"] < 0.1 and found.missed == []


@pytest.mark.parametrize(
    ("name", "size", "values", "message"),
    [
        ("swinging_yarn", 4, {"mode": "4"}, "4 segments has modes 1 to 3, not 4"),
        ("axial_swing", 40, {"mode": "9"}, "modes 1 to 4, not 9"),
        ("axial_swing", 40, {"amplitude": "0.1"}, "amplitude = 0.1 m would press a segment"),
        ("rigid_motion", 3, {"speed": "1e9"}, r"speed = 1e\+09 m/s takes the cloth"),
        ("hung_cloth", 4, {"slack": "0.95"}, "slack = 0.95 must be less than 0.9"),
        ("draped_cloth", 4, {"radius": "1e-3"}, "radius = 0.001 m"),
        ("pulled_yarn", 4, {"pull": "0.02"}, "pull = 0.02 m draws the tail"),
        ("still_cloth", 4, {"R": "1e-3"}, "neighbouring yarns touch"),
        ("thrown_cloth", 10, {"rho": "-1"}, "rho must be positive"),
    ],
)
def test_what_cannot_be_is_one_clear_error(name: str, size: int, values: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message) as error:
        find(name).problem(size, values)
    assert "\n" not in str(error.value)


def ended(name: str, size: int, values: dict[str, Any]) -> tuple[Any, Outcome]:
    run = Run(find(name).problem(size, values))
    *_, last = run.go()
    return run.problem, run.outcome(last.arrays())


def test_a_hung_cloth_hangs_below_its_corners() -> None:
    problem, end = ended("hung_cloth", 6, {"until": 0.2, "h": 0.01, "tilt": 1.5})
    cloth, start = problem.fabric, problem.fabric.points(problem.start)
    corners = [cloth.node(0, -1), cloth.node(-1, -1)]
    assert (end.points[corners] == start[corners]).all()
    assert end.points[[cloth.node(0, 0), cloth.node(-1, 0)], 2].max() < -2 * cloth.L  # it has swung down
    mirrored = end.points[[cloth.node(5 - i, j) for i, j in cloth.grid]]
    mirrored[:, 0] = start[corners, 0].sum() - mirrored[:, 0]
    assert mirrored == pytest.approx(end.points[cloth.crossings], abs=1e-6)  # as symmetric as it began
    energy = end.recorded["energy"]
    assert energy[-1] < energy[0]


def test_the_edge_between_the_corners_of_a_hung_cloth_is_a_swag() -> None:
    problem, end = ended("hung_cloth", 13, {"until": 0.6})
    cloth = problem.fabric
    edge = end.points[[cloth.node(i, -1) for i in range(13)]]
    assert edge[6, 2] < edge[0, 2] - 1.2 * cloth.L and (np.diff(edge[4:9, 2], 2) > 0).all()  # it sags as a chain does
    middle = end.points[[cloth.node(i, 6) for i in range(13)], 1]
    assert np.ptp(middle) > 2 * cloth.L  # and the cloth below is folded


def test_a_draped_cloth_lies_on_the_sphere() -> None:
    problem, end = ended("draped_cloth", 9, {"until": 0.2, "radius": 12e-3})
    cloth, (ball,) = problem.fabric, problem.solids
    away = np.linalg.norm(end.points, axis=1) - ball.radius
    assert away.min() > 1.5 * cloth.R  # no yarn is drawn inside
    assert 0.2e-3 < away[cloth.node(4, 4)] < 3 * cloth.R
    assert end.points[cloth.node(0, 0), 2] < end.points[cloth.node(4, 4), 2] - 0.05e-3  # its corners hang


def test_a_pulled_yarn_slides_and_the_others_stay() -> None:
    problem, end = ended("pulled_yarn", 4, {"h": 5e-3, "pull": 5e-3})
    cloth = problem.fabric
    (known,) = problem.known
    assert known.compared(end)[2] < known.within
    warp = cloth.yarns[cloth.warp_of[2 * 4]]
    others = np.setdiff1d(np.arange(cloth.nodes), warp.nodes)
    assert np.abs(end.points - cloth.points(cloth.Q))[others].max() < 1e-5
    first, last = warp.nodes[[0, -1]]
    assert end.points[[first, last], 1] - cloth.points(cloth.Q)[[first, last], 1] == pytest.approx(5e-3, rel=1e-3)
    assert set(problem.active) >= set(cloth.slides([cloth.warp_of[8]]))
    assert not set(problem.active) & set(
        np.setdiff1d(cloth.slides(), warp.slides)
    )  # what does not slide is not unknown


@pytest.mark.parametrize("name", ["thrown_cloth", "pulled_yarn"])
def test_a_run_taken_up_again_has_the_same_bits(name: str) -> None:
    values = {"h": 1e-2, "pull": 5e-3} if name == "pulled_yarn" else {"scheme": "bdf2"}
    size = 4 if name == "pulled_yarn" else 12
    states = [at.arrays() for at in Run(find(name).problem(size, values)).go()]
    *_, last = Run(find(name).problem(size, values)).go(states[5])
    again = last.arrays()
    assert set(again) == set(states[-1])
    for key, value in states[-1].items():
        assert np.asarray(value).tobytes() == np.asarray(again[key]).tobytes(), key
