"""Errors, conditions and hard cases; that a broken kernel is caught; one state again."""

from __future__ import annotations

import json
import types
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from yarnverify import kernels
from yarnverify.accuracy import cells as cells_module
from yarnverify.accuracy.cells import Unit, cells, compute, kernel, label, run_unit, short_hex, significant
from yarnverify.accuracy.conditioning import condition, hessian_condition
from yarnverify.accuracy.metrics import UNIT, blocks_of, measure, norm
from yarnverify.accuracy.record import grown, make_record, missed_targets
from yarnverify.accuracy.regimes import LIMITS, REGIMES, curve_points, curves, points_of, regimes
from yarnverify.accuracy.replay import parse_replay, replay, replay_lines
from yarnverify.accuracy.shape import shape_of
from yarnverify.accuracy.sweep import PROFILES
from yarnverify.accuracy.truth import Points, Truth, truth
from yarnverify.errors import InputError
from yarnverify.report.accuracy import accuracy_table
from yarnverify.symbolic.declare import Point, Positive, Sliding, deviation, energy, length

Array = NDArray[Any]
ENERGIES = ("stretch", "bending", "shear", "parallel_contact")
U = 2.0**-53


def declared(declarations: Any, name: str) -> Any:
    return next(energy for energy in declarations.energies if energy.name == name)


def unit(folder: Path, **changes: Any) -> Unit:
    made = Unit("bending", "float64", "moderate", ("differentiated",), 6, 1, False, str(folder))
    return replace(made, **changes)


# -- errors by hand ---------------------------------------------------------------------------------------------------


def flat_truth(gradient: Array, hessian: Array | None = None) -> Truth:
    """A truth of parallel contact (u0, u1) with given gradients (2, n)."""
    n = gradient.shape[1]
    hessian = np.ones((2, 2, n)) if hessian is None else hessian
    return Truth(
        gradient[0], gradient, hessian, np.zeros(n), np.zeros((2, n)), np.zeros((2, 2, n)),
        np.zeros((5, n)), np.zeros((2, 5, n)), np.ones(n, bool), np.ones(n, bool), np.zeros((3, n), bool), np.zeros(n, int),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("true", "computed", "error"),
    [
        (1.0, 1.0, 0.0),
        (1.0, 1 + 4 * U, 4.0),
        (-2.0, -2 + 4 * U, 2.0),
        (0.0, 0.0, 0.0),
        (0.0, -0.0, 0.0),
        (0.0, 5e-324, 2.0),  # one subnormal is two units of 2^-53 times the smallest normal number
        (1e-320, 1.0005e-320, 2.0),
        (0.0, 1e-300, 1e-300 * 2.0**1022 * 2.0**53),
        (1.0, np.nan, np.inf),
        (1.0, np.inf, np.inf),
        (np.inf, np.nan, np.nan),
        (np.inf, 3.0, np.nan),
    ],
)
def test_errors_are_defined_everywhere(true: float, computed: float, error: float, declarations: Any) -> None:
    exact, found = flat_truth(np.array([[true], [1.0]])), np.array([[computed], [1.0]])
    errors = measure("G", found, exact, declared(declarations, "parallel_contact").unknowns, "float64")
    assert errors.blocks == ("u0", "u1")
    np.testing.assert_equal(errors.normwise[:, 0], [error, 0.0])
    np.testing.assert_equal(errors.componentwise[:, 0], [error, 0.0])
    assert errors.nan[0] == (bool(np.isnan(computed)) and np.isfinite(true))
    assert errors.infinite[0] == (bool(np.isinf(computed)) and np.isfinite(true))
    assert errors.overflow[0] == np.isinf(true)
    assert errors.underflow[0] == (0 < true < 1e-310)


def test_what_is_left_of_the_true_value_counts(declarations: Any) -> None:
    exact = flat_truth(np.array([[1.0], [1.0]]))
    exact.gradient_low[0] = U / 4
    unknowns = declared(declarations, "parallel_contact").unknowns
    assert measure("G", np.ones((2, 1)), exact, unknowns, "float64").normwise.tolist() == [[0.25], [0.0]]


def test_errors_are_by_blocks(declarations: Any) -> None:
    unknowns = declared(declarations, "stretch").unknowns
    assert [name for name, _ in blocks_of("H", unknowns)] == [
        "x0,x0", "x0,x1", "x0,u0", "x0,u1", "x1,x1", "x1,u0", "x1,u1", "u0,u0", "u0,u1", "u1,u1",
    ]  # fmt: skip
    gradient = np.array([3.0, 4.0, 0.0, 1e-9, 0, 0, 1, 1])[:, None]
    exact = replace(flat_truth(np.ones((2, 1))), gradient=gradient, gradient_low=np.zeros_like(gradient))
    computed = gradient.copy()
    computed[2] = 10 * U
    errors = measure("G", computed, exact, unknowns, "float64")
    assert errors.normwise[:, 0].tolist() == [2.0, 0.0, 0.0, 0.0]
    assert errors.componentwise[0, 0] == 2 / U  # a zero beside 5 is held to 5 u, in units of which 10 u is 2/u
    assert errors.worst_block.tolist() == [2.0]


def test_single_precision_has_its_own_unit_and_range(declarations: Any) -> None:
    unknowns = declared(declarations, "parallel_contact").unknowns
    exact = flat_truth(np.array([[1.0, 1e39, 1e-40], [1.0, 1.0, 1.0]]))
    computed = np.array([[1 + 2.0**-23, np.inf, 1e-40], [1.0, 1.0, 1.0]], np.float32)
    errors = measure("G", computed, exact, unknowns, "float32")
    assert errors.normwise[0, 0] == 2.0
    assert errors.overflow.tolist() == [False, True, False] and errors.underflow.tolist() == [False, False, True]
    assert UNIT["float32"] == 2.0**-24


def test_the_norm_neither_overflows_nor_vanishes() -> None:
    for size in (1e-300, 1.0, 1e300):
        assert norm(np.array([[3.0], [4.0]]) * size)[0] == pytest.approx(5 * size, rel=1e-15)
    assert norm(np.zeros((3, 2))).tolist() == [0.0, 0.0]


# -- conditions -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ENERGIES)
def test_condition_numbers_are_those_of_perturbed_inputs(name: str, declarations: Any) -> None:
    """Against true values at inputs that are really moved, one by one, in doubles."""
    made = declared(declarations, name)
    points = points_of(made, REGIMES[0], "float64", 1, 3)
    exact, rows, dof = truth(made, points), points.rows()[:, 0], points.q.shape[0]
    step = 2.0**-30
    changes: dict[str, list[Array]] = {"E": [], "G": [], "H": []}
    for i in range(rows.size):
        moved = rows.copy()
        moved[i] *= 1 + step
        names = list(points.parameters)
        there = truth(
            made, Points(moved[:dof, None], {key: moved[dof + k : dof + k + 1] for k, key in enumerate(names)})
        )
        changes["E"].append((there.energy - exact.energy) / step)
        changes["G"].append((there.gradient - exact.gradient) / step)
        changes["H"].append((there.hessian - exact.hessian) / step)
    for output, values in (("E", exact.energy), ("G", exact.gradient), ("H", exact.hessian)):
        if output == "H":
            found = hessian_condition(made, points, exact, 0)
            below = hessian_condition(made, points, exact, 0, draws=1)
            assert (below <= found * (1 + 1e-12)).all() and (below > 0).any()
        else:
            found = condition(output, made, points, exact)[:, 0]
        for at, (_, place) in enumerate(blocks_of(output, made.unknowns)):
            total = sum(float(norm(change[place].reshape(-1, 1))[0]) for change in changes[output])
            assert found[at] == pytest.approx(total / float(norm(values[place].reshape(-1, 1))[0]), rel=1e-4)


def test_an_energy_that_does_not_act_has_no_condition(declarations: Any) -> None:
    made = declared(declarations, "parallel_contact")
    points = Points(np.array([[0.0], [2.0]]), {key: np.ones(1) for key in ("k_c", "L", "d")})
    assert not hessian_condition(made, points, truth(made, points), 0).any()
    assert condition("E", made, points, truth(made, points)).tolist() == [[0.0]]


def test_an_energy_of_zero_at_rest_has_no_relative_accuracy_to_lose(declarations: Any) -> None:
    made = declared(declarations, "stretch")
    points = Points(np.array([[0.0, 0, 0, 2, 3, 6, 0, 7]]).T, {"k_s": np.ones(1)})
    assert condition("E", made, points, truth(made, points)).tolist() == [[np.inf]]


@pytest.mark.parametrize(
    ("error", "amplification", "what"),
    [
        (16.0, None, "exact"),
        (1e8, 1e8, "conditioning"),
        (1e9, 1e8, "computation"),
        (17.0, 0.0, "computation"),
        (np.inf, 1e30, "not finite"),
    ],
)
def test_a_loss_has_a_name(error: float, amplification: float | None, what: str) -> None:
    assert label(error, amplification) == what


def test_an_energy_far_below_the_rounding_of_its_inputs_is_explained_by_their_condition(folder: Path) -> None:
    """A deviation of 5e-32 that plain arithmetic finds to be 1e-16: its square is off by more than first order allows."""
    text = (
        "shear fast float64 0x0p+0,0x0p+0,-0x1.fffffffffffffp+0,-0x1p+1,-0x1p+0,0x0p+0,-0x1p+0,-0x1p+1,-0x1p+2"
        " k_x=0x1.33acb4b8d6cb6p+0 L=0x1.8p+1"
    )
    row = next(row for row in replay(text, folder)["blocks"] if row["output"] == "E")
    assert float(row["error"]) > 16 + 8 * float(row["condition"])
    assert row["label"] == "conditioning"


# -- regimes ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("name", ENERGIES)
def test_states_are_the_same_every_time_and_of_their_type(name: str, dtype: str, declarations: Any) -> None:
    made = declared(declarations, name)
    names = [regime.name for regime in regimes(made)]
    assert len(set(names)) == len(names) >= 7
    for regime in regimes(made):
        points = points_of(made, regime, dtype, 9, 5)
        again = points_of(made, regime, dtype, 9, 5)
        assert points.rows().tobytes() == again.rows().tobytes()
        assert points.rows().tobytes() != points_of(made, regime, dtype, 9, 6).rows().tobytes()
        assert np.isfinite(points.rows()).all() and len(points) == 9
        assert (points.rows().astype(dtype) == points.rows()).all()


def angles(q: Array) -> Array:
    """Angles between x1 - x0 and x0 - x2, by a formula that is exact near 0 and pi."""
    a, b = q[3:6] - q[:3], q[:3] - q[6:9]
    return np.arctan2(np.linalg.norm(np.cross(a.T, b.T), axis=1), (a * b).sum(axis=0))


@pytest.mark.parametrize(
    ("regime", "distance", "low", "high"),
    [
        ("small angle", lambda t: t, 1e-15, 1.0),
        ("near pi", lambda t: np.pi - t, 1e-12, 1.0),
        ("right angle", lambda t: np.abs(t - np.pi / 2), 1e-15, 1.0),
    ],
)
def test_angles_cover_their_range(regime: str, distance: Any, low: float, high: float, declarations: Any) -> None:
    made = declared(declarations, "bending")
    points = points_of(made, next(r for r in REGIMES if r.name == regime), "float64", 400, 0)
    sizes = np.log10(np.maximum(distance(angles(points.q)), 1e-18))
    counts, _ = np.histogram(sizes, np.linspace(np.log10(low) + 1, np.log10(high), 6))
    assert (counts > 30).all()


def test_measures_are_found_in_the_expression(declarations: Any) -> None:
    bending, stretch = (shape_of(declared(declarations, name)) for name in ("bending", "stretch"))
    assert bending.angle and bending.only_angles and bending.others == {"k_b": 2}
    assert [(edge.head.label, edge.tail.label) for edge in bending.edges] == [("x1", "x0"), ("x0", "x2")]
    assert not stretch.angle and not stretch.only_angles and stretch.others == {"k_s": 0}
    contact = shape_of(declared(declarations, "parallel_contact"))
    assert contact.edges == () and contact.lengths == ("L", "d") and contact.others == {"k_c": -2}


def test_an_energy_of_another_paper_has_regimes_without_further_work() -> None:
    @energy(unit="J", domain="u_1 > u_0")
    def trellis(x0: Point, x1: Point, x3: Point, u0: Sliding, u1: Sliding, *, k: Positive["N m^-1"]):
        """Shear whose stiffness grows with the length of the warp segment."""
        return k * length(x1 - x0) * deviation(x1 - x0, x3 - x0) ** 4 * (u1 - u0)

    names = [regime.name for regime in regimes(trellis)]
    assert {"small angle", "near pi", "right angle", "ratios", "offsets", "scales", "sliding"} <= set(names)
    assert "near rest" not in names  # nothing says where it rests
    for regime in regimes(trellis):
        points = points_of(trellis, regime, "float64", 4, 0)
        exact = truth(trellis, points)
        if regime.name == "without value":
            assert not exact.has_derivatives.any()
        elif regime.name not in ("exact", "deviations", "out of range"):
            assert exact.has_derivatives.all(), regime.name


@pytest.mark.parametrize("name", ENERGIES)
def test_curves_approach_what_is_hard(name: str, declarations: Any) -> None:
    made = declared(declarations, name)
    for towards in curves(made):
        distances, points = curve_points(made, towards, 2, 0)
        assert len(points) == 2 * len(distances) and len(distances) > 40
        assert distances == sorted(distances, reverse=True) and distances[-1] < 1e-15
    if name == "bending":
        _, points = curve_points(made, "pi", 1, 0)
        assert np.pi - angles(points.q)[30] == pytest.approx(2.0**-30, rel=1e-3)


def test_limits_are_those_that_accuracy_is_promised_for() -> None:
    limits = LIMITS["float64"]
    assert (limits.angle, limits.fold, limits.offset, limits.ratio) == (1e-15, 1e-12, 1e12, 1e8)


# -- cells ------------------------------------------------------------------------------------------------------------


def test_a_cell_says_what_was_found_and_how_to_see_it_again(folder: Path) -> None:
    cell = run_unit(unit(folder, regime="small angle", count=40))["cells"][0]
    assert (cell["energy"], cell["variant"], cell["points"]) == ("bending", "differentiated", 40)
    found = cell["outputs"]["G"]
    assert found["worst"] == "inf" and found["nan"] > 0 and found["label"] == "not finite"
    again = replay(found["replay"], folder)
    row = next(row for row in again["blocks"] if row["output"] == "G" and row["block"] == found["block"])
    assert row["error"] == found["worst"]
    assert json.loads(json.dumps(cell)) == cell


PROMISING = types.SimpleNamespace(promise="units")  # a kernel that its variant's target holds for


def _broken(name: str, change: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The differentiated kernel of an energy under the name of the accurate one, with something changed."""
    module = kernel("differentiated", name)

    def evaluate(q: Array, *, errors: str = "raise", **parameters: Any) -> Any:
        e, g, h = module.evaluate(q, errors=errors, **parameters)
        return change(e.copy(), g.copy(), h.copy())

    made = types.SimpleNamespace(
        KERNEL=PROMISING, evaluate=evaluate, energy=module.energy, gradient=module.gradient, hessian=module.hessian
    )
    monkeypatch.setattr(cells_module, "kernel", lambda variant, energy, folder: made)


def _sign(e: Array, g: Array, h: Array) -> Any:
    g[4] = -g[4]
    return e, g, h


def _factor(e: Array, g: Array, h: Array) -> Any:
    h[3:6, 3:6] *= 1 + 64 * U
    return e, g, h


def _transposed(e: Array, g: Array, h: Array) -> Any:
    h[:3, 3:6] = h[:3, 3:6].swapaxes(0, 1).copy()
    return e, g, h


def _noise(e: Array, g: Array, h: Array) -> Any:
    e *= 1 + 40 * U
    return e, g, h


@pytest.mark.parametrize("k_b", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize(("change", "output"), [(_sign, "G"), (_factor, "H"), (_transposed, "H"), (_noise, "E")])
def test_a_broken_kernel_misses_its_target(
    change: Any, output: str, k_b: float, folder: Path, declarations: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = declared(declarations, "bending")
    points = points_of(made, next(r for r in REGIMES if r.name == "right angle"), "float64", 12, 0)
    points = Points(points.q, {"k_b": points.parameters["k_b"] * k_b})
    asked = unit(folder, regime="right angle", variants=("accurate",))
    _broken("bending", lambda e, g, h: (e, g, h), monkeypatch)
    sound = cells(made, points, asked)
    _broken("bending", change, monkeypatch)
    found = cells(made, points, asked)
    assert found[0]["outputs"][output]["worst"] > 16 >= sound[0]["outputs"][output]["worst"]
    problems = missed_targets({"cells": found})
    assert any(f"{output} exceeds its target" in line and "--replay" in line for line in problems)
    before, after = ({"cells": part} for part in (sound, found))
    assert any(f": {output} normwise error" in line for line in grown(before, after))
    assert not grown(before, before) and not grown(after, before)


def test_the_fast_target_allows_what_the_condition_explains_and_no_more(
    folder: Path, declarations: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = declared(declarations, "shear")
    points = points_of(made, next(r for r in REGIMES if r.name == "right angle"), "float64", 30, 0)
    asked = unit(folder, energy="shear", regime="right angle", variants=("fast",))
    _broken("shear", lambda e, g, h: (e, g, h), monkeypatch)
    found = cells(made, points, asked)
    assert found[0]["outputs"]["E"]["worst"] > 1e6 and found[0]["outputs"]["E"]["label"] == "conditioning"
    assert not missed_targets({"cells": found})
    share = found[0]["outputs"]["E"]["of_target"]
    assert 0 < share <= 1
    _broken("shear", lambda e, g, h: (e * (1 + 1e-6), g, h), monkeypatch)
    found = cells(made, points, asked)
    assert found[0]["outputs"]["E"]["of_target"] > 1
    _broken("shear", lambda e, g, h: (e, g, h * (1 + 1e4 * U)), monkeypatch)
    assert cells(made, points, asked)[0]["outputs"]["H"]["of_target"] > 1


def test_the_reference_is_held_to_one_unit_by_component(folder: Path, declarations: Any, monkeypatch: Any) -> None:
    made = declared(declarations, "bending")
    points = points_of(made, REGIMES[0], "float64", 3, 0)
    exact = truth(made, points)
    perfect = types.SimpleNamespace(
        KERNEL=PROMISING, evaluate=lambda q, **rest: (exact.energy, exact.gradient, exact.hessian)
    )
    monkeypatch.setattr(cells_module, "kernel", lambda variant, energy, folder: perfect)
    found = cells(made, points, unit(folder, variants=("reference",)))
    assert all(0 < part["of_target"] <= 1 for part in found[0]["outputs"].values())
    exact.hessian[3, 4, 0] *= 1 + 4 * U
    assert cells(made, points, unit(folder, variants=("reference",)))[0]["outputs"]["H"]["of_target"] > 1


def test_invented_results_are_counted(folder: Path, declarations: Any, monkeypatch: Any) -> None:
    made = declared(declarations, "bending")
    regime = next(r for r in REGIMES if r.name == "without value")
    points = points_of(made, regime, "float64", 12, 0)
    zero = types.SimpleNamespace(
        KERNEL=PROMISING,
        evaluate=lambda q, **rest: (np.zeros(q.shape[1]), np.zeros(q.shape), np.zeros((11, *q.shape))),
        energy=lambda q, **rest: np.zeros(q.shape[1]),
        gradient=lambda q, **rest: np.zeros(q.shape),
        hessian=lambda q, **rest: np.zeros((11, *q.shape)),
    )
    monkeypatch.setattr(cells_module, "kernel", lambda variant, energy, folder: zero)
    found = cells(made, points, unit(folder, variants=("accurate",)))
    assert found[0]["invented"] == 12 == found[0]["without_value"]
    assert any("results where there are none" in line for line in missed_targets({"cells": found}))


def test_outputs_in_range_are_measured_where_another_overflows(declarations: Any) -> None:
    made = declared(declarations, "bending")
    q = np.array([0, 0, 0, 1e-120, 0, 0, 0, 1e-120, 0, 1, -1.0])[:, None]
    points = Points(q, {"k_b": np.array([1e90])})
    exact = truth(made, points)
    assert np.isinf(exact.hessian).any() and np.isfinite(exact.gradient).all()
    computed, _ = compute(kernel("differentiated", "bending"), points, exact, "float64")
    assert np.isfinite(computed["E"]).all() and np.isfinite(computed["G"]).all()


def test_the_full_profile_tells_the_conditions(folder: Path) -> None:
    cell = run_unit(unit(folder, count=2, everywhere=True))["cells"][0]
    assert all(cell["conditions"][output]["largest"] >= cell["conditions"][output]["median"] > 1 for output in "EGH")
    assert PROFILES["full"].everywhere


def test_a_curve_holds_a_line_for_each_variant_and_the_condition(folder: Path) -> None:
    curve = run_unit(unit(folder, kind="curve", regime="0", count=1))["curve"]
    assert curve["towards"] == "0" and len(curve["distance"]) == len(curve["condition"]["H"]) == 51
    error, amplification = curve["variants"]["differentiated"]["E"], curve["condition"]["E"]
    # at angles around 1e-6 the arc cosine loses twice the digits that the inputs do
    assert max(error[at] / amplification[at] for at in range(15, 25)) > 1e3
    assert amplification[20] > 1e5 and float(error[-1]) > 1e16


def test_numbers_are_short_and_exact() -> None:
    assert [significant(x) for x in (1.23456, 0.0, float("inf"), 987654.0)] == [1.23, 0.0, "inf", 988000.0]
    for value in (0.1, 1.0, -3.5e-310, 5e-324, 0.0):
        assert float.fromhex(short_hex(value)) == value
    assert short_hex(1.5) == "0x1.8p+0" and short_hex(1.0) == "0x1p+0"


# -- one state again --------------------------------------------------------------------------------------------------

BENT = "bending differentiated float64 0,0,0,1,0x1.1p-20,0,-1,0,0,1,-1 k_b=2"


def test_a_state_is_replayed(folder: Path) -> None:
    found = replay(BENT, folder)
    first = found["blocks"][0]
    assert first["true"][0] == pytest.approx((1.0625 * 2.0**-20) ** 2, rel=1e-9)
    assert first["error"] > 1e3 and first["label"] == "computation"
    assert first["condition"] == pytest.approx(6, rel=1e-6)  # x1 twice each way, and k_b and the sliding coordinates
    text = "\n".join(replay_lines(found))
    assert "0x1.1000000000000p-20" in text and "computation" in text and "H x0,x1" in text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "give ENERGY VARIANT"),
        ("shear differentiated float64 0,0,0 k_x=1 oops", "give ENERGY VARIANT"),
        ("cheer differentiated float64 0", "cheer: no such energy"),
        ("shear differentiated float16 0 k_x=1", "float16: no such type"),
        ("shear differentiated float64 0,0 k_x=1 L=1", "9 coordinates, not 2"),
        ("shear differentiated float64 0,0,0,1,0,0,0,1,0 k=1 L=1", "parameters k_x, L, not k, L"),
        ("shear differentiated float64 0,0,0,1,0,0,0,1,zero k_x=1 L=1", "zero"),
    ],
)
def test_a_state_that_cannot_be_read_is_told(text: str, message: str, folder: Path) -> None:
    with pytest.raises(InputError, match=message):
        parse_replay(text, folder)
    assert parse_replay(BENT, folder)[1:3] == ("differentiated", "float64")


# -- table ------------------------------------------------------------------------------------------------------------


def test_the_table_marks_losses_and_says_what_did_not_run(folder: Path) -> None:
    asked = [unit(folder, regime=name, count=30) for name in ("right angle", "small angle", "near pi")]
    record = make_record(
        PROFILES["quick"], asked, [run_unit(one) for one in asked], ["fast bending: there is no such kernel"]
    )
    table = accuracy_table(record, "bending")
    rows = {line.split("|")[1].strip(): line for line in table.splitlines() if line.startswith("| ")}
    assert "∞*" in rows["small angle"] and "*" not in rows["right angle"]
    assert "Not run: fast bending" in table
    assert "not run" in accuracy_table(record, "shear")


def test_every_kernel_of_the_package_is_found() -> None:
    for name in ENERGIES:
        assert kernel("printed", name).DOFS == getattr(kernels, name).DOFS
    with pytest.raises(InputError, match="no such kernel"):
        kernel("imagined", "bending")


@pytest.mark.parametrize("name", ENERGIES)
def test_a_perfect_kernel_meets_every_target_in_every_regime(
    name: str, folder: Path, declarations: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The targets ask for nothing that rounding the true result once does not give."""
    made = declared(declarations, name)

    def results(q: Array, **given: Any) -> Truth:
        return truth(made, Points(q.astype(float), {key: given[str(key)] for key in names}))

    names = [str(parameter.name) for parameter in made.parameters]

    def evaluate(q: Array, *, errors: str, **given: Any) -> Any:
        found = results(q, **given)
        return found.energy, found.gradient, found.hessian

    perfect = types.SimpleNamespace(
        KERNEL=PROMISING,
        evaluate=evaluate,
        energy=lambda q, errors, **given: results(q, **given).energy,
        gradient=lambda q, errors, **given: results(q, **given).gradient,
        hessian=lambda q, errors, **given: results(q, **given).hessian,
    )
    monkeypatch.setattr(cells_module, "kernel", lambda variant, energy, folder: perfect)
    for regime in regimes(made):
        asked = unit(folder, energy=name, regime=regime.name, variants=("accurate", "fast", "reference"), count=12)
        found = run_unit(asked)["cells"]
        assert not missed_targets({"cells": found}), regime.name
        for cell in found:
            assert all(part["worst"] is None or part["worst"] <= 1 for part in cell["outputs"].values()), regime.name


def test_there_is_one_pass_rule() -> None:
    """The sweep, the check of other code and the search allow the same error at the same condition number."""
    from yarnverify.accuracy import cells, rule
    from yarnverify.check import judge, show
    from yarnverify.fuzzing.judge import LIMITS

    assert cells.allowed is judge.allowed is show.allowed is rule.allowed
    for dtype, unit in (("float64", 2.0**-53), ("float32", 2.0**-24)):
        assert [rule.allowed(k, dtype) - 16 for k in (0.0, 1.0, 100.0)] == pytest.approx([0, 8, 800], rel=1e-4)
        for k in (0.0, 3.0, 1e5, 1e20):
            assert LIMITS["fast"].allowed(k, dtype) == rule.allowed(k, dtype)
            assert LIMITS["accurate"].allowed(k, dtype) == 16
        # a square of something of which h times its condition number changes twice its size: to the second order
        k = 4 / (8 * unit)
        assert rule.allowed(k, dtype) * unit == pytest.approx((1 + 4 / 2) ** 2 - 1, rel=1e-6)
    assert rule.allowed(np.inf) == np.inf
