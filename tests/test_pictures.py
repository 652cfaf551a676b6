"""Pictures from records alone: the same bytes twice, and everybody on them."""

from __future__ import annotations

import copy
import math
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("matplotlib", reason="matplotlib is not installed")

from yarnverify.report.marks import front, mark, spaced
from yarnverify.report.names import HIGH, LETTER, places
from yarnverify.report.pictures import error_against_angle, speed_against_error, write

DISTANCES = [10.0**-k for k in range(0, 16, 3)]
VARIANTS = ("printed", "accurate", "newcomer")


def curve(towards: str, condition: float = 1e6) -> dict[str, Any]:
    growing: list[Any] = [1.0 / d for d in DISTANCES]
    broken = [*growing[:2], "inf", "inf", None, 3e39]
    lines = {"printed": broken, "accurate": [4.0] * 6, "newcomer": growing}
    return {
        "energy": "bending",
        "dtype": "float64",
        "towards": towards,
        "distance": DISTANCES,
        "condition": {output: [1.0, condition, 2.0, 3.0, None, "inf"] for output in "EGH"},
        "variants": {name: dict.fromkeys("EGH", line) for name, line in lines.items()},
    }


ACCURACY = {"curves": [curve("0"), curve("pi"), curve("right angle", 2.0), {**curve("0"), "dtype": "float32"}]}
ERRORS = {
    "mixed": {"accurate": 5.0, "printed": 30.0, "jax": 40.0, "newcomer": 2.0},
    "1e-8 from rest": {"accurate": 6.0, "printed": None, "jax": None, "newcomer": 1e20},
}
SPEED = {
    "energies": {
        "bending": {
            "contestants": {
                name: {"kind": kind}
                for name, kind in (("accurate", "kernel"), ("printed", "kernel"), ("jax", "peer"), ("newcomer", "peer"))
            },
            "states": {
                "mixed": [
                    {"n": 10, "ns": {"newcomer": [9000.0, 8000.0, 9900.0], "jax": [1e6, 1e6, 1e6]}},
                    {
                        "n": 100,
                        "ns": {
                            "accurate": [250.0, 240.0, 300.0],
                            "printed": [500.0, 450.0, 600.0],
                            "jax": [1000.0, 900.0, 1100.0],
                            "memory floor": [10.0, 9.0, 11.0],
                        },
                    },
                ]
            },
            "errors": {
                state: {name: dict.fromkeys("EGH", value) for name, value in by_name.items()}
                for state, by_name in ERRORS.items()
            },
        }
    }
}
PICTURES = {
    "angle": lambda: error_against_angle(ACCURACY, "bending"),
    "speed": lambda: speed_against_error(SPEED, "bending"),
}


@pytest.mark.parametrize("name", PICTURES)
def test_the_same_record_gives_the_same_bytes(name: str, tmp_path: Path) -> None:
    files = [write(PICTURES[name], tmp_path / f"{name}{i}") for i in range(2)]
    for one, two in zip(*files, strict=True):
        assert one.read_bytes() == two.read_bytes()
    svg = files[0][0].read_text()
    assert svg.startswith("<?xml") and "<dc:date>" not in svg
    assert files[0][1].read_bytes().startswith(b"\x89PNG")


def test_records_are_not_changed_by_drawing(tmp_path: Path) -> None:
    before = copy.deepcopy((ACCURACY, SPEED))
    for name, draw in PICTURES.items():
        write(draw, tmp_path / name)
    assert before == (ACCURACY, SPEED)


def texts(figure: Any) -> list[str]:
    from matplotlib.text import Text

    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


def test_everybody_is_named() -> None:
    figure = error_against_angle(ACCURACY, "bending")
    assert figure is not None
    assert len(figure.axes) == 6  # three outputs, towards 0 and pi; nothing happens at the right angle
    for name in VARIANTS:
        assert texts(figure).count(name) == 4  # at the end of three lines, and in the legend
    figure = speed_against_error(SPEED, "bending")
    (legend,) = figure.legends
    assert {text.get_text() for text in legend.get_texts()} >= {"accurate", "printed", "jax", "newcomer"}
    for axes in figure.axes:  # beside its spot, who is on the front
        spots = [line for line in axes.lines if line.get_linestyle() == "None"]
        best = [spot for spot in spots if spot.get_markerfacecolor() != "none"]
        assert 0 < len(best) < len(spots)
        assert len([text for text in texts(axes) if text in {each.get_text() for each in legend.get_texts()}]) == len(
            best
        )
    assert "memory floor" not in texts(figure)


def test_names_cover_no_spot_no_line_and_no_other_name() -> None:
    spots = {"one": (50.0, 50.0), "another": (54.0, 52.0), "third": (60.0, 48.0), "far": (150.0, 90.0)}
    lines = [((10.0, 81.0), (190.0, 81.0))]
    frame = 0.0, 0.0, 200.0, 100.0
    found = places(spots, spots, lines, frame)
    boxes = {}
    for name, (shift, led) in found.items():
        x, y, wide = spots[name][0] + shift[0], spots[name][1] + shift[1], LETTER * len(name) / 2
        boxes[name] = x - wide, y - HIGH / 2, x + wide, y + HIGH / 2
        assert frame[0] <= boxes[name][0] and boxes[name][2] <= frame[2]
        assert frame[1] <= boxes[name][1] and boxes[name][3] <= frame[3]
        inside = [
            1 for a, b in spots.values() if boxes[name][0] < a < boxes[name][2] and boxes[name][1] < b < boxes[name][3]
        ]
        assert not inside and not boxes[name][1] < 81 < boxes[name][3]
        assert not led or name != "far"
    for a, b in combinations(boxes.values(), 2):
        assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def test_no_leader_runs_through_another_name() -> None:
    """Two spots at the edge, one above the other, shut in by lines and by spots beside them: the best front of shear."""
    fronts = {"fast compiled": (80.0, 99.0), "accurate compiled": (80.0, 87.0)}
    spots = fronts | {
        "fast": (101.0, 99.0),
        "accurate": (109.0, 87.0),
        "numba": (93.0, 108.0),
        "printed": (99.0, 108.0),
    }
    spots |= {
        "casadi": (97.0, 112.0),
        "jax": (115.0, 112.0),
        "lambdify": (124.0, 108.0),
        "jax as written": (144.0, 112.0),
    }
    lines = [((80.0, 361.0), (80.0, 99.0)), ((80.0, 99.0), (80.0, 87.0)), ((80.0, 87.0), (366.0, 87.0))]
    found = places(fronts, spots, lines, (56.0, 60.0, 383.0, 361.0))
    (one, _), (other, _) = found.values()
    assert any(led for _, led in found.values())
    for (name, (shift, led)), (beside, there) in (
        (("fast compiled", found["fast compiled"]), ("accurate compiled", other)),
        (("accurate compiled", found["accurate compiled"]), ("fast compiled", one)),
    ):
        x, y, wide = spots[beside][0] + there[0], spots[beside][1] + there[1], LETTER * len(beside) / 2
        for k in range(101):
            a, b = (spots[name][axis] + k / 100 * shift[axis] for axis in (0, 1))
            assert not led or not (abs(a - x) < wide and abs(b - y) < HIGH / 2)


def test_the_right_angle_is_shown_where_the_condition_grows() -> None:
    record = {"curves": [curve("0"), curve("right angle"), curve("pi")]}
    figure = error_against_angle(record, "bending")
    assert figure is not None and len(figure.axes) == 9
    assert error_against_angle(record, "stretch") is None


def test_what_is_not_finite_lies_in_the_band_at_the_top() -> None:
    figure = error_against_angle({"curves": [curve("0")]}, "bending")
    assert figure is not None
    axes = figure.axes[0]
    marks = [line for line in axes.lines if line.get_linestyle() == "None"]
    heights = [height for line in marks for height in line.get_ydata()]
    assert heights and all(7e18 < height < axes.get_ylim()[1] for height in heights)
    solid = [line for line in axes.lines if len(line.get_ydata()) == len(DISTANCES) and line not in marks]
    drawn = [height for line in solid for height in line.get_ydata() if not math.isnan(height)]
    assert max(drawn) < 7e18


def test_marks_differ_without_colour() -> None:
    names = ["accurate", "fast", "reference", "differentiated", "printed", "lambdify", "jax", "casadi", "numba"]
    names += ["differences", "one", "two", "three", "four"]
    assert len({mark(name, names).marker for name in names}) == len(names)
    assert len({str(mark(name, names).line) for name in names[:5]}) == 5


def test_the_front() -> None:
    points = {"a": (1.0, 9.0), "b": (2.0, 5.0), "c": (3.0, 5.0), "d": (2.5, 7.0), "e": (4.0, 1.0), "f": (5.0, math.inf)}
    assert front(points) == ["a", "b", "e"]
    assert front({"slow": (2.0, math.inf), "fast": (1.0, math.inf)}) == ["fast"]
    assert front({"twin": (1.0, 1.0), "other": (1.0, 1.0)}) == ["other", "twin"]


def test_names_are_moved_apart_and_keep_their_order() -> None:
    assert spaced([1.0, 5.0, 3.0], 1.0, 0.0, 10.0) == [1.0, 5.0, 3.0]
    assert spaced([2.0, 2.0, 2.0], 1.0, 0.0, 10.0) == [1.0, 2.0, 3.0]
    assert spaced([0.0, 0.0], 1.0, 0.0, 10.0) == [0.0, 1.0]
    assert spaced([9.9, 10.0, 9.8], 1.0, 0.0, 10.0) == [9.0, 10.0, 8.0]
    crowded = spaced([1.0, 1.2, 1.9, 2.4, 8.0], 1.0, 0.0, 10.0)
    assert all(b - a >= 1 - 1e-9 for a, b in pairwise(crowded))


@pytest.mark.parametrize("scene", ["energy_over_time", "axial_swing"])  # three ways; one answer and two
def test_the_legend_of_a_work_precision_diagram_is_not_cut(scene: str, tmp_path: Path) -> None:
    from tests.pages import records
    from yarnverify.report.precision import precision

    (each,) = [each for each in records()["simulation"]["scenes"] if each["result"]["scene"] == scene]
    drawn: list[Any] = []

    def draw() -> Any:
        drawn.append(precision(each["result"], each["timings"]))
        return drawn[-1]

    write(draw, tmp_path / "picture")
    figure = drawn[0]
    figure.draw_without_rendering()
    (legend,) = figure.legends
    box, whole = legend.get_window_extent(), figure.bbox
    assert whole.x0 <= box.x0 < box.x1 <= whole.x1
    assert box.y1 <= whole.y1
