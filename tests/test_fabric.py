"""Fabrics of every kind: what is a node, what is an element, what cannot be woven."""

from __future__ import annotations

import time
from math import gcd, pi
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from yarnverify.errors import InputError
from yarnverify.kernels import bending, parallel_contact, shear, stretch
from yarnverify.simulation.fabric import Fabric, bends, contacts, ring, segments, shears, table, weave, yarn
from yarnverify.simulation.patterns import pattern, satin, twill

PATTERNS = ["plain", "twill 2/1", "twill 1/3 step -1", "satin 5", "satin 8 counter 3", [[1, 0, 0], [0, 1, 1]]]


def drawn(text: str) -> np.ndarray[Any, Any]:
    """A pattern as a weaver draws it: a row for each weft, the last at the top; X where the warp is over."""
    return np.array([[1 if mark == "X" else -1 for mark in line] for line in reversed(text.split())])


DRAFTS = {
    "plain": ".X X.",
    "twill 2/1": ".XX XX. X.X",
    "twill 2/2": "..XX .XX. XX.. X..X",
    "twill 2/2 step -1": ".XX. ..XX X..X XX..",
    "satin 5 counter 2": "XXX.X X.XXX XXXX. XX.XX .XXXX",
}


@pytest.mark.parametrize("name", DRAFTS)
def test_patterns_are_those_that_weavers_draw(name: str) -> None:
    assert np.array_equal(pattern(name), drawn(DRAFTS[name]))


@given(st.integers(1, 5), st.integers(1, 5), st.integers(-9, 9))
def test_twills_climb_by_their_step(over: int, under: int, step: int) -> None:
    n = over + under
    if step % n == 0:
        with pytest.raises(InputError, match="would not interlace"):
            twill(over, under, step)
        return
    sides = twill(over, under, step)
    assert np.array_equal((sides > 0).sum(0), [over] * n)
    for warp in range(n):
        assert np.array_equal(np.roll(sides[:, warp], step), sides[:, (warp + 1) % n])


@given(st.integers(5, 40), st.data())
def test_satins_bind_once_a_yarn_and_never_side_by_side(n: int, data: st.DataObject) -> None:
    possible = [c for c in range(2, n - 1) if gcd(c, n) == 1]
    if not possible:
        with pytest.raises(InputError, match="no regular satin of 6"):
            satin(n)
        return
    sides = satin(n, data.draw(st.sampled_from(possible)))
    assert ((sides < 0).sum(0) == 1).all() and ((sides < 0).sum(1) == 1).all()
    binding = np.argwhere(sides < 0)
    apart = np.abs(np.diff(binding[:, 1]))
    assert ((apart > 1) & (apart < n - 1)).all()


FABRICS: dict[str, Any] = {
    **{f"{p}": lambda p=p: weave(p, (7, 9)) for p in map(str, PATTERNS[:-1])},
    "matrix": lambda: weave(PATTERNS[-1], (4, 5)),
    "tails": lambda: weave("plain", (5, 4), tails=0.4e-3),
    "one warp": lambda: weave("plain", (1, 6)),
    "one crossing": lambda: weave("plain", (1, 1), tails=1e-3),
    "cut": lambda: weave("twill", (9, 9), keep=lambda x, y: abs(x - 4e-3) + abs(y - 4e-3) < 3.3e-3, tails=1e-3),
    "hole": lambda: weave("plain", (6, 5), keep=np.array([[(i, j) != (2, 3) for j in range(5)] for i in range(6)])),
    "yarn": lambda: yarn(0.3, 11, direction=(1, 2, -2)),
    "ring": lambda: ring(0.3, 7),
}


@pytest.fixture(params=FABRICS)
def fabric(request: pytest.FixtureRequest) -> Fabric:
    return FABRICS[request.param]()


def slow_pairs(fabric: Fabric) -> list[tuple[int, int]]:
    """Segments by a plain loop, by their pairs of places in Q."""
    found = []
    for y in fabric.yarns:
        count = len(y.nodes) - (2 if y.closed else 1)
        found += [(int(y.slides[k]), int(y.slides[k + 1])) for k in range(count)]
    return found


def test_rest_is_at_rest(fabric: Fabric) -> None:
    """Nothing is stretched, bent (but the ring), sheared or pressed, to the last digits."""
    rest = fabric.Q[segments(fabric).rows]
    assert stretch.energy(rest, k_s=1.0) == pytest.approx(0, abs=1e-24)
    bent = bending.energy(fabric.Q[bends(fabric).rows], k_b=1.0).sum()
    assert bent == pytest.approx(2 * pi**2 / 0.3 if fabric.yarns[0].closed else 0.0, rel=1e-12, abs=1e-24)
    quadrants, pressed = shears(fabric), contacts(fabric)
    if quadrants.count:
        assert shear.energy(fabric.Q[quadrants.rows], k_x=1.0, **quadrants.parameters) == pytest.approx(0, abs=1e-24)
    if pressed.count:
        assert parallel_contact.energy(fabric.Q[pressed.rows], k_c=1.0, **pressed.parameters) == pytest.approx(0, abs=0)


def test_tables_hold_every_element_once(fabric: Fabric) -> None:
    rows = segments(fabric).rows
    assert rows.dtype == np.int32
    assert sorted(zip(*rows[-2:].tolist(), strict=True)) == sorted(slow_pairs(fabric))
    inside = sum(len(y.nodes) - 2 for y in fabric.yarns if len(y.nodes) > 2)
    assert bends(fabric).count == inside
    around = {node: [0, 0] for node in fabric.crossings.tolist()}
    for y in fabric.yarns:
        for a, b in zip(y.nodes[:-1].tolist(), y.nodes[1:].tolist(), strict=True):
            for node in (a, b):
                if node in around:
                    around[node][y.family == "weft"] += 1
    assert shears(fabric).count == sum(a * b for a, b in around.values())
    for made in (segments(fabric), bends(fabric), shears(fabric), contacts(fabric)):
        assert made.rows.min(initial=0) >= 0 and made.rows.max(initial=0) < fabric.size
        assert all(values.shape in ((), (made.count,)) for values in made.parameters.values())
        assert all(values.shape == (made.count,) for values in made.places.values())


def test_every_position_and_sliding_coordinate_has_a_place_of_its_own(fabric: Fabric) -> None:
    slides = np.concatenate([y.slides for y in fabric.yarns])
    assert np.array_equal(np.sort(np.concatenate([fabric.positions(), slides])), np.arange(fabric.size))
    for y in fabric.yarns:
        assert (np.diff(fabric.Q[y.slides]) > 0).all()
    assert len({fabric.describe(index) for index in range(0, fabric.size)}) >= 3 * fabric.nodes
    inner, every = fabric.slides(), fabric.slides(ends=True)
    fixed = {int(y.slides[k]) for y in fabric.yarns if not y.closed for k in (0, -1)}
    assert set(inner) == set(every) - fixed
    assert set(fabric.slides("warp")) | set(fabric.slides("weft")) | set(fabric.slides("yarn")) == set(inner)


def test_crossings_know_their_yarns(fabric: Fabric) -> None:
    for place, node in enumerate(fabric.crossings):
        warp, weft = fabric.yarns[fabric.warp_of[place]], fabric.yarns[fabric.weft_of[place]]
        assert (warp.family, weft.family) == ("warp", "weft")
        assert node in warp.nodes and node in weft.nodes
        i, j = fabric.grid[place]
        assert fabric.node(i, j) == node == fabric.node(i - fabric.grid[:, 0].max() - 1, j)
        assert fabric.points(fabric.Q)[node] == pytest.approx([i * fabric.L, j * fabric.L, 0])


def test_rows_follow_the_kernels_names() -> None:
    cloth = weave("plain", (4, 5))
    made = bends(cloth)
    labels = dict(zip(bending.DOFS, made.rows, strict=True))
    middle, after, before = (labels[f"{name}.x"] // 3 for name in ("x0", "x1", "x2"))
    assert np.array_equal(labels["x1.z"], 3 * after + 2)
    assert (cloth.Q[labels["u1"]] - cloth.Q[labels["u2"]]) == pytest.approx(2 * cloth.L)
    points = cloth.points(cloth.Q)
    assert points[after] + points[before] == pytest.approx(2 * points[middle])
    along_warp = np.array([cloth.yarns[k].family == "warp" for k in made.places["yarn"]])
    assert (points[after] - points[middle])[along_warp] == pytest.approx(
        np.tile([0, cloth.L, 0], (along_warp.sum(), 1))
    )
    with pytest.raises(InputError, match="elements of bending need u2, x2; given: x0, x1, u1"):
        table(bending, {"x0": [0], "x1": [1], "u1": [20]})
    assert made.take(made.places["yarn"] == 0).count == 3


def test_shears_have_one_quadrant_between_each_two_directions() -> None:
    cloth = weave("plain", (3, 3))
    made = shears(cloth)
    points = cloth.points(cloth.Q)
    x0, x1, x3 = (points[made.rows[row] // 3] for row in (0, 3, 6))
    middle = made.places["node"] == cloth.node(1, 1)
    signs = {
        (int(np.sign(a[1])), int(np.sign(b[0]))) for a, b in zip((x1 - x0)[middle], (x3 - x0)[middle], strict=True)
    }
    assert signs == {(1, 1), (1, -1), (-1, 1), (-1, -1)}
    assert np.abs((x1 - x0)[:, 0]).max() == 0 == np.abs((x3 - x0)[:, 1]).max()
    assert (made.parameters["L"] == cloth.L).all()


@pytest.mark.parametrize("name", PATTERNS[:-1])
def test_contact_distance_follows_the_interlacing(name: str) -> None:
    cloth = weave(name, (11, 12))
    sides = pattern(name)
    made = contacts(cloth)
    assert made.count == 10 * 12 + 11 * 11
    for first, second, d, k in zip(
        made.places["node"], made.places["next"], made.parameters["d"], made.places["yarn"], strict=True
    ):
        (i, j), (a, b) = cloth.grid[first], cloth.grid[second]
        assert (a - i, b - j) == ((0, 1) if cloth.yarns[k].family == "warp" else (1, 0))
        changed = sides[j % len(sides), i % len(sides)] != sides[b % len(sides), a % len(sides)]
        assert d == (4 if changed else 2) * cloth.R
    if name == "plain":
        assert (made.parameters["d"] == 4 * cloth.R).all()
    assert (cloth.Q[made.rows[1]] - cloth.Q[made.rows[0]]) == pytest.approx(cloth.L)


def test_nothing_touches_where_a_yarn_ends_in_a_tail() -> None:
    assert contacts(weave("plain", (3, 4), tails=1e-3)).count == contacts(weave("plain", (3, 4))).count == 2 * 4 + 3 * 3


WRONG: list[tuple[Any, str]] = [
    (lambda: weave("plian"), "weave 'plian' is not known; there are: plain, twill"),
    (lambda: weave("twill 2/0"), "at least one weft"),
    (lambda: weave("twill 2/1 step 3"), "step 3 is a multiple of 3"),
    (lambda: weave("satin 4"), "a repeat of at least 5"),
    (lambda: weave("satin 6"), "no regular satin of 6"),
    (lambda: weave("satin 8 counter 2"), "coprime to 8: 3, 5"),
    (lambda: weave([[1, 0], [0, 2]]), "entries 0 and 1"),
    (lambda: weave([[1, 0], [0]]), "rows of equal length"),
    (lambda: weave([[1, 0], [1, 0]]), "warp 0 lies on one side of all"),
    (lambda: weave([[1, 1], [1, 0]]), "weft 0 lies on one side of all"),
    (lambda: weave(size=(0, 5)), "number of warps = 0 must be a whole number, at least 1"),
    (lambda: weave(size=(4, 2.5)), "number of wefts = 2.5"),
    (lambda: weave(size=4), "size is a pair"),
    (lambda: weave(L=0.0), "L = 0.0 must be a positive length"),
    (lambda: weave(L=-1e-3), "L = -0.001 must be"),
    (lambda: weave(L=float("nan")), "L = nan must be"),
    (lambda: weave(R=0.0), "R = 0.0 must be"),
    (lambda: weave(L=0.8e-3, R=0.2e-3), r"L = 0.0008 m is not greater than 0.0008 m, at which .* \(4 R\)"),
    (lambda: weave(L=0.3e-3, R=0.2e-3, pressed=True), "would intersect"),
    (lambda: weave(tails=0.0), "tails = 0.0 must be"),
    (lambda: weave(keep=np.ones((2, 2), bool)), "a mask of 8 warps by 8 wefts"),
    (lambda: weave(keep=lambda x, y: x < 0), "leaves no crossing"),
    (lambda: yarn(0.0, 4), "length = 0.0 must be"),
    (lambda: yarn(1.0, 0), "segments = 0 must be"),
    (lambda: yarn(1.0, 4, direction=(0, 0, 0)), "a direction of three numbers"),
    (lambda: ring(1.0, 2), "segments = 2 must be a whole number, at least 3"),
    (lambda: weave().node(8, 0), "warp 8 and weft 0 do not cross"),
    (lambda: weave().slides("weeft"), "say all, warp, weft"),
]


@pytest.mark.parametrize(("make", "message"), WRONG)
def test_what_cannot_be_woven_is_told_in_one_line(make: Any, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_pressed_cloth_is_allowed_where_it_is_asked_for() -> None:
    cloth = weave("plain", (3, 3), L=0.5e-3, R=0.2e-3, pressed=True)
    assert (contacts(cloth).parameters["d"] > cloth.L).all()
    assert weave("twill 2/1", (1, 2), L=0.5e-3, R=0.2e-3).nodes == 2  # a float alone touches at 2 R


def test_a_large_cloth_takes_well_under_a_second() -> None:
    best = 9.0
    for _ in range(3):
        begin = time.perf_counter()
        cloth = weave("twill 3/1", (320, 320), tails=1e-3)
        for make in (segments, bends, shears, contacts):
            make(cloth)
        best = min(best, time.perf_counter() - begin)
    assert best < 1.0  # 0.1 s on two shared cores
