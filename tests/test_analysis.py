"""Analysis against closed forms: spectra, explicit steps, vibrations, moduli; the command and its page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.commands import caller
from yarnverify.analysis.command import analysis, scene_modes
from yarnverify.analysis.cotton import Cotton, cotton
from yarnverify.analysis.moduli import compliance, moduli, stiffness
from yarnverify.analysis.spectra import FAMILIES, at_rest, negative, sign_map, spectrum
from yarnverify.analysis.steps import conditions, greatest_frequency, lumped, stabilities
from yarnverify.analysis.vibrations import modes, observed_order, pinned_yarn, tight_net
from yarnverify.errors import InputError
from yarnverify.kernels import bending, stretch
from yarnverify.simulation.answers.rods import buckling_load
from yarnverify.simulation.assembly import System, Term
from yarnverify.simulation.fabric import bends, segments, yarn

BY_NAME = {family.name: family for family in FAMILIES}


# -- spectra ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        # stretch: w w^T k_s/h with w = (-d, d, 1, -1); bending: k_b/h^3 (1, -2, 1)(1, -2, 1)^T across the yarn, twice
        ("stretch", [(4.0, 1), (0.0, 7)]),
        ("bending", [(6.0, 2), (0.0, 9)]),
        # shear: k_x L g g^T with g = (-d1 - d3, d3, d1)/L; contact: k_c L (1, -1)(1, -1)^T
        ("shear", [(4.0, 1), (0.0, 8)]),
        ("parallel_contact", [(2.0, 1), (0.0, 1)]),
        # gravity: rho g (z0 + z1)(u1 - u0)/2; plane and sphere: cubes of the depth
        ("gravity", [(1.0, 1), (-1.0, 1), (0.0, 6)]),
        ("plane", [(0.0, 3)]),
        ("sphere", [(0.0, 3)]),
    ],
)
def test_eigenvalues_at_rest_are_those_of_the_closed_forms(name: str, expected: list[tuple[float, int]]) -> None:
    found = at_rest(BY_NAME[name])
    assert [count for _, count in found] == [count for _, count in expected]
    assert [value for value, _ in found] == pytest.approx([value for value, _ in expected], abs=1e-12)


@pytest.mark.parametrize("length", [0.3, 0.8, 1.0, 1.7])
def test_stretch_is_indefinite_just_where_it_is_compressed(length: float) -> None:
    q = np.array([0, 0, 0, length, 0, 0, 0, 1.0])[:, None]
    across = 2 * (1 - 1 / length)
    held = spectrum(stretch, q, sliding=False, k_s=1.0)[:, 0]
    free = spectrum(stretch, q, k_s=1.0)[:, 0]
    assert held == pytest.approx(sorted([2, across, across, 0, 0, 0]), abs=1e-12)
    assert free == pytest.approx(sorted([2 + 2 * length**2, across, across, 0, 0, 0, 0, 0]), abs=1e-12)
    assert negative(free[:, None])[0] == (2 if length < 1 else 0)


def test_maps_show_every_state_but_rest_as_indefinite_for_angles() -> None:
    bent, sheared = sign_map(BY_NAME["bending"]), sign_map(BY_NAME["shear"])
    assert (bent.free < 0).all() and bent.counts == (3,)
    right = np.isclose(BY_NAME["shear"].angle[1], 90)
    assert (sheared.free[:, right] == 0).all()
    assert (sheared.free[:, ~right] < 0).all()
    assert sheared.held is not None and np.array_equal(sheared.held, sheared.free)  # it has no sliding coordinates
    pressed = sign_map(BY_NAME["parallel_contact"])
    assert pressed.held is None and (pressed.free == 0).all()


def test_a_plane_pushes_stably_and_a_sphere_does_not() -> None:
    """2 k (R - r) along, and -k (R - r)^2/r across, where the force is not parallel all around."""
    flat, round_ = sign_map(BY_NAME["plane"]), sign_map(BY_NAME["sphere"])
    assert flat.counts == (0,) and round_.counts == (2,)
    r = BY_NAME["sphere"].stretch[1]
    along, across = 2 * (1 - r), -((1 - r) ** 2) / r
    assert round_.free[:, 0] == pytest.approx(across / np.maximum(along, -across), rel=1e-12)


def test_gravity_is_indefinite_only_where_yarns_slide() -> None:
    found = sign_map(BY_NAME["gravity"])
    assert found.held is not None and (found.held == 0).all()
    assert found.free == pytest.approx(-1)


@pytest.mark.parametrize(
    "family", [f for f in FAMILIES if not {"n", "c", "g"} & set(f.parameters)], ids=lambda family: family.name
)
def test_spectra_do_not_depend_on_where_an_element_lies(family: Any) -> None:
    rng = np.random.default_rng(7)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    angle, length = np.array([0.7]), np.array([0.6])
    q = family.state(angle, length)
    moved = q.copy()
    for first in range(0, int((~family.sliding).sum()), 3):
        moved[first : first + 3] = turn @ q[first : first + 3] + 0.25
    one, other = (spectrum(family.kernel, rows, **family.parameters) for rows in (q, moved))
    assert other == pytest.approx(one, abs=1e-12 * np.abs(one).max())


# -- explicit steps ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [8, 60])
def test_greatest_frequency_of_a_yarn_is_that_of_a_chain(count: int) -> None:
    fabric = yarn(0.1, count)
    k_s, rho = 50.0, 1e-4
    system = System(fabric.Q, [Term(stretch, segments(fabric), {"k_s": k_s})], fabric.positions())
    mass = lumped(fabric, rho)
    assert mass[: 3 * fabric.nodes : 3].sum() == pytest.approx(rho * 0.1, rel=1e-14)
    assert mass[3 * fabric.nodes :].sum() == 0
    omega = greatest_frequency(system.hessian(fabric.Q), mass[system.active])
    assert omega == pytest.approx(2 * count / 0.1 * np.sqrt(k_s / rho), rel=1e-10)


def test_steps_are_stable_below_the_bound_and_no_more_above() -> None:
    """Central differences with the real forces, not with the matrix that the bound was made from."""
    fabric = yarn(0.01, 8)
    terms = [Term(stretch, segments(fabric), {"k_s": 50.0}), Term(bending, bends(fabric), {"k_b": 1e-9})]
    system = System(fabric.Q, terms, fabric.positions())
    mass = lumped(fabric, 1e-4)[system.active]
    bound = 2 / greatest_frequency(system.hessian(fabric.Q), mass)
    start = 1e-9 * np.random.default_rng(3).normal(size=system.count)

    def largest(step: float) -> float:
        Q, before = fabric.Q.copy(), fabric.Q.copy()
        Q[system.active] += start
        before[system.active] += start
        for _ in range(600):
            after = Q.copy()
            after[system.active] += (Q - before)[system.active] - step**2 * system.gradient(Q) / mass
            before, Q = Q, after
            if np.abs(Q - fabric.Q).max() > 1e-5:
                return np.inf
        return float(np.abs(Q - fabric.Q).max())

    assert largest(0.98 * bound) < 1e-7
    assert largest(1.02 * bound) == np.inf


def test_softer_or_heavier_fabric_takes_longer_steps() -> None:
    base = {each.name: each.step for each in stabilities(Cotton(), 6)}
    soft = {each.name: each.step for each in stabilities(Cotton(k_s=12.5), 6)}
    heavy = {each.name: each.step for each in stabilities(Cotton(rho=20e-5), 6)}
    assert list(base) == ["stretch", "bending", "shear", "together"]
    assert soft["stretch"] == pytest.approx(2 * base["stretch"], rel=1e-9)
    assert soft["bending"] == pytest.approx(base["bending"], rel=1e-9)
    assert all(heavy[name] == pytest.approx(2 * base[name], rel=1e-9) for name in base)
    assert base["together"] <= min(base["stretch"], base["bending"], base["shear"]) * (1 + 1e-12)


def test_condition_grows_with_the_size_and_shrinks_with_scaling() -> None:
    small, large = conditions(Cotton(), 6), conditions(Cotton(), 12)
    assert large[0] > 4 * small[0] and large[1] > 4 * small[1]
    assert all(scaled < plain for plain, scaled in (small, large))


# -- vibrations -------------------------------------------------------------------------------------------------------


def test_pinned_yarn_has_the_frequencies_of_euler_and_bernoulli() -> None:
    found = [pinned_yarn(n, 3, k_s=20.0, k_b=3e-9, rho=2e-4, length=0.2) for n in (8, 16, 32)]
    assert all(each.discrete_error < 1e-9 for each in found)
    assert observed_order(found) == pytest.approx(4, abs=0.15)
    assert found[-1].limit[0] == pytest.approx(np.pi / (2 * 0.2**2) * np.sqrt(3e-9 / 2e-4), rel=1e-14)


def test_tight_net_swings_like_a_membrane() -> None:
    found = [tight_net(n, k_s=30.0, rho=1e-4, L=0.02 / n, R=0.002 / n, strain=0.03)[0] for n in (5, 10, 20)]
    assert all(each.discrete_error < 1e-9 for each in found)
    assert observed_order(found) == pytest.approx(2, abs=0.05)


@pytest.mark.parametrize(("share", "stable"), [(0.9, True), (1.1, False), (60.0, False)])
def test_modes_tell_a_strut_beyond_its_buckling_load(share: float, stable: bool) -> None:
    count, k_b, k_s = 12, 1e-9, 5.0
    fabric = yarn(0.05, count)
    load = share * buckling_load(k_b, 0.05, k_s=k_s, segments=count)
    Q = fabric.Q.copy()
    fabric.points(Q)[:] *= 1 - load / k_s
    terms = [Term(stretch, segments(fabric), {"k_s": k_s}), Term(bending, bends(fabric), {"k_b": k_b})]
    active = np.concatenate([fabric.positions(range(1, count), axis) for axis in "xz"])
    found = modes(fabric, terms, active, 1e-4, Q, 2)
    assert (found.frequencies[0] > 0) == stable
    assert found.frequencies[0] < found.frequencies[1]
    exact = np.linalg.eigvalsh(System(Q, terms, active).hessian(Q).toarray())
    assert (exact[0] > 0) == stable
    assert np.abs(found.shapes).max(axis=0) == pytest.approx(1)


# -- moduli -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pattern", ["plain", "twill 2/1"])
def test_moduli_are_their_closed_forms(pattern: str) -> None:
    cloth = Cotton(L=0.7e-3, R=0.15e-3, k_s=13.0, k_b=4e-9, k_x=0.05)
    for each in moduli(cloth, 7, pattern):
        assert abs(each.computed - each.closed) <= 1e-9 * (each.closed or cloth.k_s / cloth.L), each


def test_sliding_changes_no_modulus_at_rest() -> None:
    free, held = stiffness(Cotton(), 6), stiffness(Cotton(), 6, sliding=False)
    assert free[0] == pytest.approx(held[0], abs=1e-9 * 5e4)
    assert free[1:] == pytest.approx(held[1:], rel=1e-9)


def test_compliance_along_the_yarns_is_one_over_their_modulus() -> None:
    membrane = np.diag([10.0, 20.0, 3.0])
    assert compliance(membrane, np.array([0.0, np.pi / 2])) == pytest.approx([0.1, 0.05])
    bias = compliance(membrane, np.array([np.pi / 4]))[0]
    assert bias == pytest.approx((1 / 10 + 1 / 20 + 1 / 3) / 4)


# -- command and page -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    return analysis(["k_s=20"])


def test_record_is_the_same_each_time_and_names_its_command(found: dict[str, Any]) -> None:
    assert json.dumps(analysis(["k_s=20"])) == json.dumps(found)
    assert found["command"] == "yarnverify analyse --write --set k_s=20"
    assert found["fabric"]["k_s"] == {"value": 20.0, "unit": "N"}
    assert all(row["agree within 1e-9"] for row in found["moduli"]["rows"])
    assert all(row["exact within 1e-8"] for name in ("yarn", "net") for row in found["vibrations"][name]["rows"])


def test_pages_and_pictures_are_made_from_the_record(found: dict[str, Any], tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from yarnverify.report.analysis import analysis_lines
    from yarnverify.report.analysis_pictures import PICTURES
    from yarnverify.report.pictures import write

    text = "\n".join(analysis_lines(found))
    assert "bending           6 (twice), 0 (9 times)  k_b/h^3" in text
    assert "NO" not in text.split("Small-strain")[1]
    for name, draw in PICTURES.items():
        assert draw(found).axes, name
    texts = [
        [path.read_bytes() for path in write(lambda: PICTURES["analysis-moduli"](found), tmp_path / "a")] for _ in "12"
    ]
    assert texts[0] == texts[1]


def test_a_modulus_that_disagrees_is_shouted() -> None:
    from yarnverify.report.analysis import analysis_tables

    record = json.loads((Path(__file__).parent.parent / "reports/records/analysis.json").read_text(encoding="utf-8"))
    record["moduli"]["rows"][0]["agree within 1e-9"] = False
    assert analysis_tables(record)[-1].rows[0][-1] == "NO"


def test_modes_of_a_scene() -> None:
    record = scene_modes("elastica", ["alpha=0.001"], 20, 3)
    # a cantilever that is hardly loaded: 1.8751^2/(2 pi l^2) sqrt(k_b/rho), the wall half a segment along
    length = 0.05
    assert record["scene"] == "elastica"
    assert record["frequencies"][0] == pytest.approx(
        1.8751**2 / (2 * np.pi * length**2) * np.sqrt(1e-9 / 5e-5), rel=0.002
    )
    assert record["grows"] == [False] * 3


@pytest.mark.parametrize(
    ("tokens", "message"),
    [
        (["--set", "k_s=-1"], "k_s = -1.0 must be a positive number, N"),
        (["--set", "k_s=soft"], "--set k_s=soft: 'soft' is not a number; k_s is in N"),
        (["--set", "k_z=1"], "--set k_z: the fabric has L, R, rho, k_s, k_b, k_x, k_c"),
        (["elastica", "--modes", "0"], "positions that move: ask for 1 to"),
        (["elasica"], "there is no scene 'elasica'"),
        (["elastica", "--set", "rho=0"], "rho = 0.0 must be a positive number, kg/m"),
    ],
)
def test_errors_are_one_line(
    tokens: list[str], message: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    status, _, shown = caller(monkeypatch, capsys)("analyse", *tokens)
    assert status == 2
    assert message in shown and len(shown.splitlines()) == 1


def test_fabric_refuses_what_is_not_a_number() -> None:
    with pytest.raises(InputError, match="must be a positive number"):
        cotton(["L=nan"])
