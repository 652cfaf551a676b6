"""The strategies: that what is hard is really drawn, shrinks to what is plain, and reads back exactly."""

from __future__ import annotations

import doctest
import importlib
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import find, given, settings
from hypothesis.strategies import SearchStrategy

from yarnverify import strategies
from yarnverify.strategies import (
    Turn,
    angles,
    element,
    elements,
    length_ratios,
    magnitudes,
    offsets,
    orientations,
    scales,
    strains,
    turns,
)


def drawn(strategy: SearchStrategy[Any], count: int = 400) -> list[Any]:
    found: list[Any] = []

    @settings(max_examples=count, database=None, derandomize=True)
    @given(strategy)
    def collect(value: Any) -> None:
        found.append(value)

    collect()
    return found


@pytest.mark.parametrize("name", ["numbers", "frames", "build"])
def test_examples(name: str) -> None:
    outcome = doctest.testmod(importlib.import_module(f"yarnverify.strategies.{name}"))
    assert outcome.failed == 0 < outcome.attempted


def test_angles_are_drawn_near_both_ends() -> None:
    found = drawn(angles())
    assert all(0 < angle < math.pi for angle in found)
    for near in (1e-3, 1e-6, 1e-9, 1e-12, 2e-15):
        assert sum(angle < near for angle in found) > 20
        assert sum(math.pi - angle < near for angle in found) > 20
    assert min(found) < 1e-200
    assert max(found) == np.nextafter(math.pi, 0)


def test_angles_near_a_right_angle_are_drawn_on_demand() -> None:
    found = drawn(angles("pi/2"))
    assert all(abs(angle - math.pi / 2) <= math.pi / 4 for angle in found)
    assert sum(0 < abs(angle - math.pi / 2) < 1e-12 for angle in found) > 20


@pytest.mark.parametrize("side", ["0", "pi/2", "pi"])
def test_turns_keep_their_digits(side: Any) -> None:
    for turn in drawn(turns(side), 100):
        assert turn.side == side
        if turn.away:
            small = abs(turn.cosine) if side == "pi/2" else turn.sine
            assert small == pytest.approx(abs(math.sin(turn.away)), rel=1e-15)
        assert turn.sine**2 + turn.cosine**2 == pytest.approx(1, rel=1e-15)
        assert math.atan2(turn.sine, turn.cosine) == pytest.approx(float(turn), rel=1e-15)


def test_orientations_are_rotations() -> None:
    aligned, generic = drawn(orientations(generic=False)), drawn(orientations(aligned=False), 100)
    assert len({matrix.tobytes() for matrix in aligned}) == 24
    for matrix in aligned + generic:
        # an entry of a rotation by an integer quaternion is rounded once; a dot product of two columns has six of them
        np.testing.assert_allclose(matrix.T @ matrix, np.eye(3), rtol=0, atol=6 * 2.0**-53)
        assert np.linalg.det(matrix) > 0
    with pytest.raises(ValueError, match="neither was asked for"):
        orientations(aligned=False, generic=False)


@pytest.mark.parametrize(
    ("strategy", "low", "high"),
    [(magnitudes(1e-300, 3.0), 1e-300, 3.0), (length_ratios(), 1e-8, 1e8), (scales(), 1e-30, 1e30)],
)
def test_magnitudes_fill_their_range(strategy: SearchStrategy[float], low: float, high: float) -> None:
    found = drawn(strategy)
    assert low <= min(found) < low * 1e3 and high / 1e3 < max(found) <= high
    assert sum(0.1 < value < 10 for value in found) > 50
    assert find(strategy, lambda value: True) == 1


@pytest.mark.parametrize("bounds", [(0.0, 1.0), (2.0, 1.0), (1.0, math.inf), (math.nan, 1.0)])
def test_magnitudes_need_two_positive_bounds(bounds: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="between two positive numbers"):
        magnitudes(*bounds)


def test_strains_and_offsets() -> None:
    found = drawn(strains())
    assert min(found) == -0.9 and max(found) > 1 and 0.0 in found and any(0 < abs(s) < 1e-12 for s in found)
    far = drawn(offsets())
    assert (0.0, 0.0, 0.0) in far and any(abs(x) > 1e11 for place in far for x in place)


@pytest.mark.parametrize("energy", ["stretch", "bending", "shear", "parallel_contact"])
def test_elements_have_the_rows_and_parameters_of_their_kernel(energy: str) -> None:
    module = importlib.import_module(f"yarnverify.kernels.{energy}")
    for q, parameters in drawn(elements(energy), 200):
        assert q.shape == (len(module.DOFS), 1) and q.dtype == np.float64 and not q.flags.writeable
        assert tuple(parameters) == module.PARAMETERS and min(parameters.values()) > 0
        at = dict(zip(module.DOFS, q[:, 0], strict=True))
        if "x0.x" in at and "u1" in at:
            assert at["u1"] >= at.get("u0", at.get("u2"))
    energies = [module.energy(q, **parameters, errors="mask")[0] for q, parameters in drawn(elements(module), 100)]
    assert np.isfinite(energies).mean() > 0.5, "most elements have a value"


def test_elements_reach_the_hard_cases() -> None:
    found = [q[:, 0] for q, _ in drawn(elements("shear"), 500)]
    edges = [(q[3:6] - q[:3], q[6:9] - q[:3]) for q in found if (q[3:6] != q[:3]).any() and (q[6:9] != q[:3]).any()]
    lengths = [(np.linalg.norm(a), np.linalg.norm(b)) for a, b in edges]
    cosines = [float(a / la @ (b / lb)) for (a, b), (la, lb) in zip(edges, lengths, strict=True)]
    for near in (-1, 0, 1):
        assert sum(abs(cosine - near) < 1e-12 for cosine in cosines) > 20
    assert any(max(pair) > 1e6 * min(pair) for pair in lengths)
    assert any(np.abs(q).max() > 1e6 * la for q, (la, _) in zip(found, lengths, strict=False))
    contacts = [(q[1, 0] - q[0, 0]) / p["d"] for q, p in drawn(elements("parallel_contact"), 200)]
    assert any(gap == 1 for gap in contacts)
    assert sum(gap < 1 for gap in contacts) > 20 < sum(gap > 1 for gap in contacts)


def test_elements_in_single_precision() -> None:
    for q, parameters in drawn(elements("bending", dtype=np.float32), 50):
        assert q.dtype == np.float32 and np.isfinite(q).all() and 0 < parameters["k_b"] < 1000


def test_elements_of_other_kernels() -> None:
    other = SimpleNamespace(
        DOFS=(*(f"p{i}.{axis}" for i in range(4) for axis in "xyz"), "v1", "v0", "v2"), PARAMETERS=("k",)
    )
    for q, _ in drawn(elements(other, offset=offsets(1.0)), 50):
        assert q.shape == (15, 1) and q[14, 0] <= q[13, 0] <= q[12, 0]
    with pytest.raises(ValueError, match=r"the point a needs the rows a\.x, a\.y and a\.z"):
        elements(SimpleNamespace(DOFS=("a.x", "a.y"), PARAMETERS=()))
    with pytest.raises(ValueError, match="there is no kernel 'twist'"):
        elements("twist")


@given(elements("bending"))
def test_an_element_reads_back_from_its_repr(one: strategies.Element) -> None:
    again = eval(repr(one), {"element": element})
    assert again.q.tobytes() == one.q.tobytes() and again.parameters == one.parameters


def test_reading_an_element() -> None:
    single = element("0x1p+0 -0x0p+0", dtype="float32", k="0x1.8p-1")
    assert repr(single) == 'element("0x1p+0 -0x0p+0", k="0x1.8p-1", dtype="float32")'
    with pytest.raises(ValueError, match="invalid hexadecimal"):
        element("one")


def test_elements_shrink_to_plain_numbers() -> None:
    folded = find(elements("bending"), lambda one: one.q[3, 0] > 0 and one.q[6, 0] > 0)
    assert repr(folded) == (
        'element("0x0p+0 0x0p+0 0x0p+0 0x1p+0 0x0p+0 0x0p+0 0x1p+0 0x0p+0 0x0p+0 0x1p+1 0x0p+0", k_b="0x1p+0")'
    )
    assert repr(find(turns(), lambda turn: 0 < float(turn) < 1e-3)) == repr(Turn("0", 2.0**-10))
