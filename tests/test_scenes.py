"""Scenes: every one against its known answer, at other parameters too, and what cannot be run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from yarnverify.errors import InputError
from yarnverify.kernels import stretch
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import segments, yarn
from yarnverify.simulation.quantities import choice, positive, real, whole
from yarnverify.simulation.scene import Scene, scene
from yarnverify.simulation.scenes import SCENES
from yarnverify.simulation.setting import Known, Stage, Static
from yarnverify.simulation.study import study

BY_NAME = {each.name: each for each in SCENES}
AT_REST = [each for each in SCENES if each.validates and isinstance(each.problem(each.sizes[0]), Static)]
CONDITIONED = {"load at which it buckles"}  # its Hessian loses size**4 units


@pytest.mark.parametrize("each", AT_REST, ids=lambda each: each.name)
def test_a_scene_comes_out_as_known(each: Scene) -> None:
    assert len(each.sizes) >= 3
    found = study(each, each.sizes, {})
    assert found.missed == []
    exact = [
        answer
        for line in found.result["lines"]
        for run in line["runs"]
        for answer in run["answers"]
        if answer["expected order"] is None and not (each.name == "bias_extension" or answer["name"] in CONDITIONED)
    ]
    assert all(answer["error"] <= 1e-12 for answer in exact), [a for a in exact if a["error"] > 1e-12]


@pytest.mark.parametrize("alpha", [1.0, 10.0])
def test_the_elastica_to_1e_4_at_160_segments_and_of_second_order(alpha: float) -> None:
    runs = study(BY_NAME["elastica"], (20, 40, 80, 160), {"alpha": alpha, "wall": "middle"}).result["lines"][0]["runs"]
    for answers in zip(*(run["answers"] for run in runs), strict=True):
        assert answers[-1]["error"] < 1e-4
        assert all(abs(answer["order"] - 2) < 0.1 for answer in answers[1:])


OTHERS: list[tuple[str, tuple[int, ...], dict[str, Any]]] = [
    ("hanging_yarn", (7, 33), {"k_s": 1e-4, "tip_force": 0.0}),
    ("elastica", (40, 80, 160), {"alpha": 30.0, "length": 0.2}),
    ("heavy_cantilever", (30, 60), {"length": 0.01}),
    ("end_moment", (20, 40), {"turn": -6.28}),
    ("end_moment", (20,), {"turn": -5.0}),  # the mirror image
    ("closed_ring", (3, 5, 50), {"flat": 1.5}),
    ("buckling", (10, 30), {"load": 1.8}),
    ("catenary", (10, 40), {"span": 0.11, "rise": -0.03}),
    ("sliding_yarn", (2, 9), {"uneven": 10.0, "strain": 0.5}),
    ("pressed_yarns", (2, 3, 50), {"force": 1e-4, "L": 0.5e-3}),
    ("pressed_yarns", (4,), {"L": 900.0}),
    ("picture_frame", (2, 5), {"delta": -0.01}),
    ("picture_frame", (4,), {"delta": 1e-6}),  # coordinates hold an angle of 3e-5 to some 1e-11 of it
    ("bias_extension", (4, 6), {"ratio": 4, "strain": 0.3}),
]


@pytest.mark.parametrize(("name", "sizes", "values"), OTHERS, ids=[name for name, *_ in OTHERS])
def test_answers_follow_the_parameters(name: str, sizes: tuple[int, ...], values: dict[str, Any]) -> None:
    assert study(BY_NAME[name], sizes, values, solver="direct").missed == []


def test_the_ways_to_solve_are_lines_of_the_diagram() -> None:
    lines = study(BY_NAME["hanging_yarn"], (4,), {}).result["lines"]
    assert [line["name"] for line in lines] == ["direct", "superlu"]
    walls = study(BY_NAME["elastica"], (10, 20, 40), {}).result["lines"]
    assert [line["name"] for line in walls] == ["middle", "node"]
    assert walls[1]["runs"][-1]["answers"][0]["order"] == pytest.approx(1, abs=0.1)


# -- what a scene has to say wrong ------------------------------------------------------------------------------------


@scene(title="a yarn that is pulled", size="segments", sizes=(2, 4, 8), source="Hooke", wall="at its first node")
def pulled(
    size: int, k_s: float = positive(2.0, "N"), force: float = real(0.5, "N"), power: float = real(0.0, ""),
    count: int = whole(1), way: str = choice("right", "wrong"), order: float = positive(2.0, ""),
) -> Static:  # fmt: skip
    fabric = yarn(1.0, size)
    loads = 0 * fabric.Q
    loads[fabric.position(size)[0, 0]] = force
    exact = (1 + force / k_s) * (1 + (power != 0) * size**-power)
    known = Known("length", "m", exact + (way == "wrong"), lambda end: end.points[-1, 0], order if power else None)
    return Static(fabric, [Term(stretch, segments(fabric), {"k_s": k_s})], fabric.positions(range(1, size + 1)),
                  [known], [Stage(loads)] * count)  # fmt: skip


def test_a_wrong_answer_and_a_wrong_order_are_missed_goals() -> None:
    assert study(pulled, (2, 4), {}).missed == []
    (wrong, *_) = study(pulled, (2, 4), {"way": "wrong"}).missed
    assert "length has the error" in wrong and "1e-12 is allowed" in wrong
    assert study(pulled, (20, 40), {"power": 2.0}, "direct").missed == [
        "pulled, direct, size 20: length has the error 2.5e-03, and 1e-12 is allowed",
        "pulled, direct, size 40: length has the error 6.2e-04, and 1e-12 is allowed",
    ]
    assert "order 1.00, and 2 is expected" in study(pulled, (200, 400), {"power": 1.0}, "direct").missed[-1]


def test_a_nan_is_no_answer() -> None:
    known = Known("nothing", "m", [1.0, 1.0], lambda end: np.array([1.0, np.nan]))
    assert np.isnan(known.compared(None)[2])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"k_s": -1.0}, "pulled: k_s must be positive, in N; not -1.0"),
        ({"k_s": "0"}, "k_s must be positive"),
        ({"k_s": "nan"}, "k_s must be finite"),
        ({"k_s": float("inf")}, "k_s must be finite"),
        ({"k_s": "1e300"}, "k_s must be between 1e-30 and 1e+30 in size, in N; not '1e300'"),
        ({"force": -1e-300}, "force must be between 1e-30 and 1e+30 in size"),
        ({"k_s": "1 kg"}, "k_s is a number in N; '1 kg' has the unit 'kg'"),
        ({"k_s": "much"}, "k_s must be a number, in N; not 'much'"),
        ({"k_s": "1..2"}, "k_s must be a number, in N; not '1..2'"),
        ({"k_s": True}, "k_s must be a number"),
        ({"order": "2 m"}, "order is a number without a unit"),
        ({"count": "1.5"}, "count must be a whole number, at least 1; not '1.5'"),
        ({"way": "left"}, "way is one of right, wrong; not 'left'"),
        ({"force": "-3 N"}, None),
        ({"ks": "1"}, "pulled has no parameter 'ks'; did you mean k_s?"),
        ({"zeal": "1"}, "pulled has no parameter 'zeal'; it has k_s, force, power, count, way, order"),
    ],
)
def test_parameters_that_cannot_be(values: dict[str, Any], message: str | None) -> None:
    if message is None:
        assert pulled.values(values)["force"] == -3.0
        return
    with pytest.raises(InputError) as raised:
        study(pulled, (2,), values)
    assert message in str(raised.value) and "\n" not in str(raised.value)


@pytest.mark.parametrize(("size", "least"), [(0, 1), (-3, 1), (1, 2), (2.0, 1), (True, 1)])
def test_sizes_that_cannot_be(size: Any, least: int) -> None:
    each = BY_NAME["hanging_yarn"] if least == 1 else BY_NAME["elastica"]
    with pytest.raises(InputError, match=f"whole number, at least {least}"):
        each.problem(size)


def test_scenes_that_are_not_declared_well() -> None:
    def bare(size: int, force: float = 3.0) -> Static:
        return pulled.build(size)  # type: ignore[return-value]

    def sizeless(k_s: float = positive(1.0, "N")) -> Static:
        return pulled.build(2)  # type: ignore[return-value]

    def plain(size: int, k_s: float = positive(1.0, "N")) -> Static:
        return pulled.build(size)  # type: ignore[return-value]

    declare: dict[str, Any] = {"title": "", "size": "", "sizes": (1, 2, 3)}
    with pytest.raises(InputError, match="force must be declared"):
        scene(**declare)(bare)
    with pytest.raises(InputError, match="the first argument is the size"):
        scene(**declare)(sizeless)
    with pytest.raises(InputError, match="what is compared, 'k_s', must be a parameter declared by choice"):
        scene(**declare, compare="k_s")(plain)
