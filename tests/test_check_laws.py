"""Other laws are called by their names: energies as people write them, differentiated by complex steps, not by this package."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from yarnverify.check.cases import Cases, hard_cases
from yarnverify.check.conventions import Results
from yarnverify.check.judge import Block, judged
from yarnverify.check.laws import LAWS, SPREAD
from yarnverify.check.recognise import Diagnosis, Judge
from yarnverify.library import derivations

Law = Callable[..., Any]


def _norm(a: Any) -> Any:
    return np.sqrt((a * a).sum(axis=0))


def _angle(a: Any, b: Any) -> Any:
    return np.arccos((a * b).sum(axis=0) / (_norm(a) * _norm(b)))


def _stretch(law: Law) -> Law:
    return lambda q, p: p["k_s"] * law(_norm(q[3:6] - q[:3]), q[7] - q[6])


def _spring(law: Law) -> Law:
    return lambda q, p: p["k"] * law(_norm(q[3:6] - q[:3]), p["L"])


def _bending(law: Law) -> Law:
    def energy(q: Any, p: Any) -> Any:
        a, b = q[3:6] - q[:3], q[:3] - q[6:9]
        return p["k_b"] * law(_angle(a, b), q[9] - q[10], _norm(a) + _norm(b), _norm(a - b))

    return energy


def _shear(law: Law) -> Law:
    def energy(q: Any, p: Any) -> Any:
        a, b = q[3:6] - q[:3], q[6:9] - q[:3]
        return p["k_x"] * p["L"] * law(_angle(a, b), (a * b).sum(axis=0), _norm(a), p["L"])

    return energy


def _contact(law: Law) -> Law:
    return lambda q, p: np.where((q[1] - q[0]).real < p["d"], p["k_c"] * p["L"] * law(q[1] - q[0], p["d"]), 0)


def _gradient(energy: Law, cases: Cases) -> Any:
    rows = []
    for row in range(cases.dof):
        moved = cases.points.q.astype(complex)
        step = 1e-30
        moved[row] += step * 1j
        rows.append(np.imag(energy(moved, cases.points.parameters)) / step)
    return np.array(rows)


def found(
    name: str, energy: Law, count: int = 6, outputs: str = "EG", regimes: tuple[str, ...] = ("moderate",)
) -> list[tuple[Block, Diagnosis]]:
    """What is said about an energy and its gradient, in states where nothing is hard."""
    folder = derivations() / "rod" if name == "spring" else None
    cases = hard_cases(name, folder, "float64", count, regimes)
    e, g = energy(cases.points.q, cases.points.parameters), _gradient(energy, cases)
    given = {
        "E": np.array("E" in outputs),
        "G": np.full(cases.dof, "G" in outputs),
        "H": np.zeros((cases.dof,) * 2, bool),
    }
    results = Results(np.asarray(e), g, np.full((cases.dof, cases.dof, len(cases)), np.nan), given)
    blocks = judged(results, cases, np.ones(len(cases), bool))
    judge = Judge(cases, blocks, lambda: None)
    return [(block, judge.diagnosis(block)) for block in blocks]


def said(name: str, energy: Law, **options: Any) -> set[str]:
    return {"; ".join(diagnosis.reasons) or diagnosis.status for _, diagnosis in found(name, energy, **options)}


PRESENT = "takes the present length for the rest length that it is spread on"


@pytest.mark.parametrize(
    ("name", "energy", "text"),
    [
        (
            "stretch",
            _stretch(lambda h, r: r * (h**2 / r**2 - 1) ** 2 / 8),
            "takes Green's strain (l^2/r^2 - 1)/2 for l/r - 1",
        ),
        (
            "stretch",
            _stretch(lambda h, r: r * np.log(h / r) ** 2 / 2),
            "takes the logarithmic strain log(l/r) for l/r - 1",
        ),
        ("stretch", _stretch(lambda h, r: r * (1 - r / h) ** 2 / 2), "takes 1 - r/l for l/r - 1"),
        (
            "stretch",
            _stretch(lambda h, r: r * (1 - r**2 / h**2) ** 2 / 8),
            "takes Almansi's strain (1 - r^2/l^2)/2 for l/r - 1",
        ),
        ("stretch", _stretch(lambda h, r: (h / r - 1) ** 2 / 2), "leaves out the rest length that it is spread on"),
        (
            "stretch",
            _stretch(lambda h, r: (h - r) ** 2 / 2),
            "takes the square of the rest length that it is spread on",
        ),
        ("stretch", _stretch(lambda h, r: h * (h / r - 1) ** 2 / 2), PRESENT),
        (
            "bending",
            _bending(lambda a, r, *_: (1 - np.cos(a)) / r),
            "takes 2 sin(angle/2) for the angle, and so 2 (1 - cos(angle)) for its square; 1/2 times that",
        ),
        (
            "bending",
            _bending(lambda a, r, *_: 4 * np.tan(a / 2) ** 2 / r),
            "takes 2 tan(angle/2), as discrete elastic rods have it, for the angle",
        ),
        ("bending", _bending(lambda a, r, *_: np.sin(a) ** 2 / r), "takes sin(angle) for the angle"),
        ("bending", _bending(lambda a, r, *_: np.tan(a) ** 2 / r), "takes tan(angle) for the angle"),
        ("bending", _bending(lambda a, r, *_: a / r), "takes the angle for its square"),
        ("bending", _bending(lambda a, r, h, c: c**2 / r), "takes |x_1 - 2 x_0 + x_2| for the angle"),
        ("bending", _bending(lambda a, r, h, c: a**2 / (h / 2)), f"{PRESENT}; 2 times that"),
        (
            "bending",
            _bending(lambda a, r, h, c: 4 * np.tan(a / 2) ** 2 / h),
            f"takes 2 tan(angle/2), as discrete elastic rods have it, for the angle, and {PRESENT}",
        ),
        ("bending", _bending(lambda a, r, *_: a**2 / r**3), "takes the cube of the rest length that it is spread on"),
        (
            "spring",
            _spring(lambda h, r: (h**2 - r**2) ** 2 / (8 * r**2)),
            "takes Green's strain, (l^2 - r^2)/(2 r) for l - r",
        ),
        (
            "spring",
            _spring(lambda h, r: (h**2 - r**2) ** 2 / 2),
            "takes Green's strain, (l^2 - r^2)/(2 r) for l - r; 4 L^2 times that",
        ),
        (
            "spring",
            _spring(lambda h, r: (r * np.log(h / r)) ** 2 / 2),
            "takes the logarithmic strain, r log(l/r) for l - r",
        ),
        ("shear", _shear(lambda a, *_: np.cos(a) ** 2 / 2), "takes cos(angle) for pi/2 - angle"),
        ("shear", _shear(lambda a, *_: np.tan(np.pi / 2 - a) ** 2 / 2), "takes cot(angle) for pi/2 - angle"),
        (
            "shear",
            _shear(lambda a, dot, *_: dot**2 / 2),
            "takes the scalar product of edges that are not made unit for pi/2 - angle",
        ),
        ("shear", _shear(lambda a, *_: (a - np.pi / 4) ** 2 / 2), "takes pi/4 for pi/2"),
        ("shear", _shear(lambda a, *_: (a - np.pi) ** 2), "takes pi for pi/2; 2 times that"),
        ("shear", _shear(lambda a, *_: a**2 / 2), "leaves out pi/2"),
        ("parallel_contact", _contact(lambda r, d: d - r), "takes the overlap for its square; 2 times that"),
        ("parallel_contact", _contact(lambda r, d: (d - r) ** 3 / 2), "takes the cube of the overlap for its square"),
        (
            "parallel_contact",
            _contact(lambda r, d: -((d - r) ** 2) * np.log(r / d) / 2),
            "takes a barrier, -(d - r)^2 log(r/d) for (d - r)^2",
        ),
    ],
)
def test_another_law_is_one_line_for_all_that_follows_from_it(name: str, energy: Law, text: str) -> None:
    known = found(name, energy)
    assert {"; ".join(diagnosis.reasons) for block, diagnosis in known if block.judged.any()} == {text}
    assert all(diagnosis.status == "wrong" and diagnosis.sign == 1 for _, diagnosis in known)


def test_the_table_has_no_row_that_is_not_tried() -> None:
    (mark,) = test_another_law_is_one_line_for_all_that_follows_from_it.pytestmark  # type: ignore[attr-defined]
    tried = " ".join(case[2] for case in mark.args[1])
    assert [law.text for law in (*LAWS, *SPREAD) if law.text not in tried] == []


def test_a_force_of_the_other_sign_by_another_law() -> None:
    energy = _stretch(lambda h, r: -r * np.log(h / r) ** 2 / 2)
    assert said("stretch", energy, outputs="G") == {
        "takes the logarithmic strain log(l/r) for l/r - 1, and has the wrong sign"
    }


def test_no_force_in_compression_besides_another_law() -> None:
    energy = _stretch(lambda h, r: r * np.where(h.real > r.real, (h**2 / r**2 - 1) ** 2, 0) / 2)
    text = "takes Green's strain (l^2/r^2 - 1)/2 for l/r - 1; 4 times that, and is zero where the yarn is shorter than at rest"
    assert said("stretch", energy, regimes=("moderate", "near rest")) == {text}


def _exchanged(energy: Law) -> Law:
    """With x0 and x2 in each other's place."""
    return lambda q, p: energy(np.concatenate([q[6:9], q[3:6], q[:3], q[9:]]), p)


def test_unknowns_in_each_others_place() -> None:
    right = _bending(lambda a, r, *_: a**2 / r)
    assert said("bending", _exchanged(right)) == {"has x0 and x2 exchanged"}
    turned = _bending(lambda a, r, *_: -(a**2) / r)
    assert "has the wrong sign, as with u1 and u2 exchanged" in said("bending", turned, outputs="E")


def test_one_zero_in_compression_is_no_law() -> None:
    """Such as of a result that underflows: one of several states in which the yarn is shorter than at rest."""
    regimes = ("moderate", "near rest")
    cases = hard_cases("stretch", None, "float64", 6, regimes)
    assert cases.shorter is not None
    last = np.arange(len(cases)) == np.flatnonzero(cases.shorter)[-1]
    assert cases.shorter.sum() > 1
    energy = _stretch(lambda h, r: r * np.where(last, 0 * h, np.log(h / r) ** 2) / 2)
    assert said("stretch", energy, regimes=regimes) == {"takes the logarithmic strain log(l/r) for l/r - 1"}


def test_what_follows_from_a_wrong_energy_is_no_mistake_of_its_own() -> None:
    energy = _shear(lambda a, dot, first, L: first / L * (a - np.pi / 2) ** 2)
    assert said("shear", energy) == {"is 2 |x1 - x0|/L times what it should be", "follows from the energy as it came"}


def test_one_block_that_fits_another_law_is_not_that_law() -> None:
    """Where the rest of the gradient is right, a square was forgotten, and no other law taken."""
    right = _bending(lambda a, r, *_: a**2 / r)
    cases = hard_cases("bending", None, "float64", 8, ("moderate",))
    g = _gradient(right, cases)
    g[9:] /= np.sqrt(right(cases.points.q, cases.points.parameters).real * (cases.points.q[9] - cases.points.q[10]))
    g[9:] *= np.sqrt(cases.points.parameters["k_b"])
    given = {"E": np.zeros((), bool), "G": np.ones(11, bool), "H": np.zeros((11, 11), bool)}
    results = Results(np.zeros(8), g, np.full((11, 11, 8), np.nan), given)
    blocks = judged(results, cases, np.ones(8, bool))
    judge = Judge(cases, blocks, lambda: None)
    assert {judge.diagnosis(block).reasons for block in blocks if block.name[0] == "u"} == {("lacks a factor angle",)}


@pytest.mark.parametrize(
    ("name", "energy", "text"),
    [
        ("stretch", _stretch(lambda h, r: r * (h / (r + 1e-6) - 1) ** 2 / 2), "adds 1e-06 to r in the strain l/r - 1"),
        (
            "stretch",
            _stretch(lambda h, r: (r + 1e-8) * (h / (r + 1e-8) - 1) ** 2 / 2),
            "adds 1e-08 to the difference of sliding coordinates",
        ),
        ("stretch", _stretch(lambda h, r: r * ((h + 1e-6) / r - 1) ** 2 / 2), "adds 1e-06 to the length of a segment"),
        (
            "stretch",
            _stretch(lambda h, r: r * (np.sqrt(h**2 + 1e-10) / r - 1) ** 2 / 2),
            "adds 1e-10 to the squared length of a segment",
        ),
        (
            "bending",
            _bending(lambda a, r, *_: a**2 / (r + 1e-9)),
            "adds 1e-09 to the difference of sliding coordinates",
        ),
    ],
)
def test_a_small_number_against_a_division_by_zero_is_seen(name: str, energy: Law, text: str) -> None:
    known = found(name, energy)
    assert {diagnosis.reasons for block, diagnosis in known if block.kind == "E"} == {(text,)}
    assert {diagnosis.reasons for block, diagnosis in known if diagnosis.status == "approximate"} == {(text,)}


@pytest.mark.parametrize("name", ["stretch", "bending", "shear", "parallel_contact"])
def test_a_right_energy_is_taken_for_no_other_law(name: str) -> None:
    right = {
        "stretch": _stretch(lambda h, r: r * (h / r - 1) ** 2 / 2),
        "bending": _bending(lambda a, r, *_: a**2 / r),
        "shear": _shear(lambda a, *_: (a - np.pi / 2) ** 2 / 2),
        "parallel_contact": _contact(lambda r, d: (d - r) ** 2 / 2),
    }[name]
    assert all(block.passes or diagnosis.status == "loses digits" for block, diagnosis in found(name, right))
    doubled = found(name, lambda q, p: 2 * right(q, p))
    assert {diagnosis.reasons for _, diagnosis in doubled} == {("is 2 times what it should be",)}
