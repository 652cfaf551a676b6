"""The benchmark: pairing and medians on a clock of our own, peers against the truth, nobody left out silently."""

from __future__ import annotations

import builtins
import importlib
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.commands import status_of
from yarnverify.accuracy.metrics import measure
from yarnverify.benchmark import run
from yarnverify.benchmark.contestants import Contestant, contestants, kernels
from yarnverify.benchmark.errors import errors_of, exact
from yarnverify.benchmark.inputs import STATES, error_states, timed_states
from yarnverify.benchmark.peers import PEERS
from yarnverify.benchmark.timing import Spread, paired, speedups, spread
from yarnverify.benchmark.ways import Way, empty_outputs, unified
from yarnverify.errors import InputError
from yarnverify.kernels import VARIANTS
from yarnverify.report.benchmark import benchmark_table, tables
from yarnverify.symbolic.declare import Energy, Point, Positive, cross
from yarnverify.symbolic.declare import angle as angle_between
from yarnverify.symbolic.declare import energy as energy_of

ENERGIES = ("stretch", "bending", "shear", "parallel_contact")


@pytest.fixture(scope="module")
def declared(declarations: Any) -> dict[str, Energy]:
    return {energy.name: energy for energy in declarations.energies}


# -- timing -----------------------------------------------------------------------------------------------------------


class Machine:
    """A clock that calls move forward; each call costs its own time, times how busy the machine is just then."""

    def __init__(self, busy: Callable[[int], float] = lambda calls: 1.0) -> None:
        self.now = 0.0
        self.calls: list[str] = []
        self.busy = busy

    def call(self, name: str, seconds: float) -> Callable[[], None]:
        def work() -> None:
            self.now += seconds * self.busy(len(self.calls))
            self.calls.append(name)

        return work


def test_every_round_times_everybody_and_starts_with_somebody_else() -> None:
    machine = Machine()
    calls = {name: machine.call(name, 1.0) for name in "abc"}
    times = paired(calls, 4, clock=lambda: machine.now, least=0.5)
    assert times == {name: [1.0] * 4 for name in "abc"}
    assert "".join(machine.calls) == "abc" + "abc" + "bca" + "cab" + "abc"  # a trial, then the rounds


def test_short_calls_are_repeated_and_averaged() -> None:
    machine = Machine()
    times = paired(
        {"short": machine.call("short", 0.25), "long": machine.call("long", 2.0)}, 1, lambda: machine.now, 1.0
    )
    assert times == {"short": [0.25], "long": [2.0]}
    assert machine.calls.count("short") == 1 + 4 and machine.calls.count("long") == 1 + 1


def test_a_busy_moment_does_not_change_ratios() -> None:
    machine = Machine(lambda calls: 5.0 if (calls - 2) // 2 == 1 else 1.0)  # the second round, after two trials
    calls = {"slow": machine.call("slow", 3.0), "quick": machine.call("quick", 1.0)}
    times = paired(calls, 3, lambda: machine.now, 0.1)
    assert times == {"slow": [3.0, 15.0, 3.0], "quick": [1.0, 5.0, 1.0]}
    assert speedups(times, "slow") == {"slow": Spread(1.0, 1.0, 1.0), "quick": Spread(3.0, 3.0, 3.0)}


def test_ratios_are_taken_within_rounds() -> None:
    """The median of ratios; the ratio of medians would be 2 in the second case too."""
    ratios = speedups({"base": [2.0, 4.0, 30.0], "own": [1.0, 4.0, 2.0]}, "base")
    assert ratios["own"] == Spread(2.0, 1.0, 15.0)
    ratios = speedups({"base": [2.0, 4.0, 6.0], "own": [4.0, 1.0, 2.0]}, "base")
    assert ratios["own"] == Spread(3.0, 0.5, 4.0)
    assert spread([5.0]) == Spread(5.0, 5.0, 5.0)


# -- inputs -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("state", STATES)
def test_states_are_reproducible_and_inside_the_domain(energy: str, state: str, declared: dict[str, Energy]) -> None:
    one, two = (timed_states(declared[energy], state, 500) for _ in range(2))
    np.testing.assert_array_equal(one.q, two.q)
    assert one.q.shape[1] == 500 and one.parameters == two.parameters
    true = exact(declared[energy], one.first(20))
    assert true.has_derivatives.all()
    assert (true.energy > 0).all()  # parallel contact is zero outside its domain


def angle(declared: dict[str, Energy], energy: str, state: str) -> Any:
    """The angle, or its deviation from the right one, as the energy has it."""
    inputs = error_states(declared[energy])[state]
    true = exact(declared[energy], inputs)
    if energy == "bending":
        (k,) = inputs.parameters
        return np.sqrt(true.energy * (inputs.q[9] - inputs.q[10]) / k)
    k, length = inputs.parameters
    return np.sqrt(2 * true.energy / (k * length))


@pytest.mark.parametrize("size", ["1e-4", "1e-8"])
def test_hard_states_are_as_hard_as_they_say(size: str, declared: dict[str, Energy]) -> None:
    # within rest, two points and the hub each move by up to the size along each axis
    assert (angle(declared, "bending", f"{size} from rest") < 8 * float(size)).all()
    assert (angle(declared, "bending", f"{size} from rest") > 0).all()
    np.testing.assert_allclose(np.pi - angle(declared, "bending", f"{size} from a fold"), float(size), rtol=1e-6)
    np.testing.assert_allclose(np.pi / 2 - angle(declared, "shear", f"{size} from a fold"), float(size), rtol=1e-6)


def test_energies_without_an_angle_have_no_fold(declared: dict[str, Energy]) -> None:
    assert list(error_states(declared["stretch"])) == ["mixed", "1e-4 from rest", "1e-8 from rest"]


def test_an_angle_between_triangles_is_not_folded_by_moving_a_point() -> None:
    @energy_of()
    def hinge(x0: Point, x1: Point, x2: Point, x3: Point, *, k: Positive["J"]) -> Any:
        return k * angle_between(cross(x1 - x0, x2 - x0), cross(x3 - x0, x1 - x0)) ** 2

    assert list(error_states(hinge)) == ["mixed", "1e-4 from rest", "1e-8 from rest"]


# -- contestants ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("peer", PEERS)
def test_peers_give_the_true_values(energy: str, peer: str, declared: dict[str, Energy]) -> None:
    """Every way of every peer, on states whose angle is neither small nor near pi.

    Error bounds are those of the method. Differentiated formulas amplify roundings by 1/sin^2 of the angle at most, below
    40 here, over some hundred operations. Differences leave truncation of about step^2 and rounding of u/step^order,
    times the fourth derivative, which short segments make large.
    """
    energies = declared[energy]
    able, missing = contestants(energies, [peer])
    found = [each for each in able if each.name == peer]
    if not found and ("not installed" in missing[peer] or "compiler" in missing[peer]):
        pytest.skip(f"{peer}: {missing[peer]}")
    assert found, missing
    inputs = timed_states(energies, "mixed", 200)
    true = exact(energies, inputs)
    fit = ordinary(inputs.q, energy)
    assert fit.sum() >= 20
    for way in found[0].ways:
        outputs = unified(way, way.run(inputs.q, inputs.parameters))
        for output, computed in zip("EGH", outputs, strict=True):
            errors = measure(output, computed, true, energies.unknowns, "float64").worst_block[fit]
            limit = 1e4 if peer != "differences" or output == "E" else 2.0**53 * (1e-4 if output == "G" else 1e-2)
            assert errors.max() < limit, (way.how, output)


def test_jax_is_measured_as_people_write_it_too(declared: dict[str, Energy]) -> None:
    pytest.importorskip("jax", reason="jax is not installed")
    found = {each.name: each.ways for each in contestants(declared["bending"], ["jax"])[0]}
    (written,) = found["jax as written"]
    assert written.how.startswith("jit(vmap(hessian))") and written.hessian == "full"
    assert written in found["jax"]


def ordinary(q: Any, energy: str) -> Any:
    """Elements with segments of length above a half, and sines above 0.3."""
    if energy == "parallel_contact":
        return q[1] - q[0] > -np.inf
    sides = [q[at : at + 3] - q[0:3] for at in ((3,) if energy == "stretch" else (3, 6))]
    lengths = [np.linalg.norm(side, axis=0) for side in sides]
    fit = np.min(lengths, axis=0) > 0.5
    if energy == "stretch":
        return fit & (np.abs(lengths[0] / (q[7] - q[6]) - 1) > 0.1)
    fit &= np.linalg.norm(np.cross(*sides, axis=0), axis=0) > 0.3 * lengths[0] * lengths[1]
    if energy == "shear":
        return fit & (np.abs((sides[0] * sides[1]).sum(axis=0)) > 0.1 * lengths[0] * lengths[1])
    return fit & (q[9] - q[10] > 0.3)


def test_a_wrong_peer_shows(declared: dict[str, Energy]) -> None:
    energy = declared["stretch"]
    (kernel,) = (each for each in contestants(energy, [])[0] if each.name == "differentiated")
    way = kernel.ways[0]

    def wrong(q: Any, values: Any) -> Any:
        e, g, h = way.run(q, values)
        g[3] *= 1 + 1e-9
        h[0, 5] = np.nan
        return e, g, h

    broken = Way("broken", way.hessian, way.layout, wrong, way.bytes_at)
    found = errors_of(energy, {"right": way, "wrong": broken}, 8)["mixed"]
    assert found["right"]["G"] < 1e3 < 1e5 < found["wrong"]["G"] < 1e8
    assert found["wrong"]["H"] is None and found["right"]["H"] is not None
    assert found["wrong"]["E"] == found["right"]["E"]


@pytest.mark.parametrize(("hessian", "layout"), [("packed", "component-first"), ("full", "element-first")])
def test_outputs_of_any_layout_become_the_same(hessian: str, layout: str) -> None:
    dof, n = 3, 2
    full = np.arange(dof * dof * n, dtype=float).reshape(dof, dof, n)
    full += full.transpose(1, 0, 2)
    e, g = np.arange(2.0), np.arange(6.0).reshape(3, 2)
    h = full[np.triu_indices(dof)] if hessian == "packed" else full
    if layout == "element-first":
        g, h = g.T.copy(), np.moveaxis(h, -1, 0).copy()
    way = Way("", hessian, layout, lambda q, values: (e, g, h), lambda n: 0)
    got = unified(way, (e, g, h))
    np.testing.assert_array_equal(got[1], np.arange(6.0).reshape(3, 2))
    np.testing.assert_array_equal(got[2], full)


def test_a_peer_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch, declared: dict[str, Energy]) -> None:
    real = builtins.__import__

    def missing(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "casadi":
            raise ModuleNotFoundError("No module named 'casadi'", name="casadi")
        return real(name, *args, **kwargs)

    monkeypatch.delitem(sys.modules, "yarnverify.benchmark.peers.casadi", raising=False)
    monkeypatch.setattr(builtins, "__import__", missing)
    able, reasons = contestants(declared["stretch"], ["casadi", "differences"])
    assert reasons["casadi"] == "casadi is not installed"
    assert [each.name for each in able if each.kind == "peer"] == ["differences"]


def test_a_peer_that_fails_is_named(monkeypatch: pytest.MonkeyPatch, declared: dict[str, Energy]) -> None:
    module = importlib.import_module("yarnverify.benchmark.peers.lambdify")

    def fails(energy: Energy) -> Any:
        raise RuntimeError("out of\nluck")

    monkeypatch.setattr(module, "ways", fails)
    assert contestants(declared["stretch"], ["lambdify"])[1]["lambdify"] == "RuntimeError: out of luck"


def test_a_compiler_that_is_missing_or_fails_is_named(
    monkeypatch: pytest.MonkeyPatch, declared: dict[str, Energy]
) -> None:
    pytest.importorskip("casadi", reason="casadi is not installed")
    module: Any = importlib.import_module("yarnverify.benchmark.peers.casadi")
    monkeypatch.setattr(module.shutil, "which", lambda name: None)
    assert contestants(declared["stretch"], ["casadi"])[1]["casadi"] == "no C compiler: install gcc"
    monkeypatch.setattr(module.shutil, "which", lambda name: "false")
    assert contestants(declared["stretch"], ["casadi"])[1]["casadi"] == "false failed: no message"


def test_an_energy_of_anybody_can_be_measured() -> None:
    """Functions and operations that the four energies do not use: norms of sliding differences, tan, cross, sqrt."""
    from yarnverify.symbolic.declare import Point, Positive, Sliding, angle, length
    from yarnverify.symbolic.declare import energy as declare
    from yarnverify.symbolic.tree import Expr

    def twice_tan(x0: Point, x1: Point, x2: Point, u1: Sliding, u2: Sliding, *, k: Positive["N m^2"]):  # type: ignore[no-untyped-def, valid-type]
        half = angle(x1 - x0, x0 - x2) / 2  # type: ignore[operator]
        across = length(Expr("cross", (x1 - x0, x2 - x0)))  # type: ignore[operator]
        tangent = Expr("call", (half,), "tan")
        return k * (2 * tangent) ** 2 / length(u1 - u2) + Expr("sqrt", (across,)) * k  # type: ignore[operator]

    twice_tan.__annotations__ = {
        **dict.fromkeys(("x0", "x1", "x2"), Point),
        **dict.fromkeys(("u1", "u2"), Sliding),
        "k": Positive["N m^2"],
    }
    found = declare(rest={"x0": (0, 0, 0), "x1": (1, 0, 0), "x2": (-1, 0, 0), "u1": 1, "u2": -1})(twice_tan)
    able, reasons = contestants(found, ["lambdify", "jax", "casadi", "numba"])
    assert reasons.keys() >= set(VARIANTS)  # no kernel of this energy is there
    inputs = timed_states(found, "mixed", 50)
    true = exact(found, inputs)
    fit = ordinary(inputs.q, "bending")
    for each in able:
        outputs = unified(each.ways[0], each.ways[0].run(inputs.q, inputs.parameters))
        for output, computed in zip("EGH", outputs, strict=True):
            assert measure(output, computed, true, found.unknowns, "float64").worst_block[fit].max() < 1e5, each.name


# -- the record and its tables ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def measured() -> dict[str, Any]:
    return run.benchmark("parallel_contact", [1, 50], ["lambdify", "differences"], rounds=2, points=4)


def test_the_record_is_complete(measured: dict[str, Any]) -> None:
    found = json.loads(json.dumps(measured))["energies"]["parallel_contact"]
    names = {*kernels(), "lambdify", "differences"}
    assert set(found["contestants"]) | set(found["not_run"]) == names
    assert set(found["states"]) == set(STATES)
    for entries in found["states"].values():
        assert [entry["n"] for entry in entries] == [1, 50]
        for entry in entries:
            assert set(entry["ns"]) == set(found["contestants"]) | {run.FLOOR}
            assert entry["times as fast as"]["lambdify"]["lambdify"] == [1.0, 1.0, 1.0]
            for median, least, most in entry["ns"].values():
                assert 0 < least <= median <= most
    assert found["bytes"] == 8 * (2 + 1 + 2 + 3)
    assert (
        measured["command"]
        == "yarnverify benchmark parallel_contact --sizes 1 50 --peers lambdify differences --rounds 2"
    )
    assert measured["environment"]["packages"].keys() >= {"numpy", "sympy"}


def test_tables_show_everybody(measured: dict[str, Any]) -> None:
    text = benchmark_table(measured, "parallel_contact")
    for name in (*measured["energies"]["parallel_contact"]["contestants"], run.FLOOR):
        assert text.count(f"\n| {name} |") >= 2, name
    assert "shown, and compared with nothing" in text and f"`{measured['command']}`" in text
    assert benchmark_table(measured, "shear") == "Speed of shear: not run. Command: `yarnverify benchmark shear`.\n"


def test_what_did_not_run_is_shown_as_not_run(measured: dict[str, Any]) -> None:
    changed = json.loads(json.dumps(measured))
    found = changed["energies"]["parallel_contact"]
    found["not_run"]["jax"] = "jax is not installed"
    entry = found["states"]["mixed"][1]
    for part in (entry["ns"], entry["times as fast as"]["lambdify"], entry["times the floor"]):
        del part["differences"]
    entry["not_run"]["differences"] = "needs 5.0 GB, more than 4"
    speed, *_, errors, how = tables(changed, "parallel_contact")
    assert "jax: not run, jax is not installed." in how.notes
    assert "differences at n = 50: not run, needs 5.0 GB, more than 4." in speed.notes
    (row,) = (row for row in speed.rows if row[0] == "differences")
    assert row[2] == "not run"
    found["errors"]["mixed"]["differences"]["H"] = None
    errors = tables(changed, "parallel_contact")[-2]
    assert next(row for row in errors.rows if row[0] == "differences")[1].endswith("/ ∞")


def test_what_fails_or_needs_too_much_memory_is_left_out_and_said() -> None:
    def never(q: Any, values: Any) -> Any:
        raise AssertionError("must not be called")

    small = Way("small", "packed", "component-first", lambda q, values: empty_outputs(*q.shape), lambda n: 100 * n)
    large = Way("large", "packed", "component-first", never, lambda n: 10**9 * n)
    inputs = run.Inputs(np.zeros((2, 5)), ())
    broken = Way("broken", "packed", "component-first", never, lambda n: n)
    entry = run._timed({"small": small, "large": large, "broken": broken}, inputs, 1, time.process_time)
    assert set(entry["ns"]) == {"small", run.FLOOR}
    assert entry["not_run"] == {
        "large": "needs 5.0 GB, more than 4",
        "broken": "AssertionError: must not be called",
    }
    assert (
        run._fastest(Contestant("both", "peer", (large, broken)), inputs, time.process_time)
        == "AssertionError: must not be called"
    )
    assert run._fastest(Contestant("large", "peer", (large,)), inputs, time.process_time) == "needs 5.0 GB, more than 4"
    chosen = run._fastest(Contestant("mostly", "peer", (broken, small)), inputs, time.process_time)
    assert isinstance(chosen, Way) and chosen.run is small.run and chosen.how == "small; fastest of 1 ways"


def test_pinning_is_undone() -> None:
    import os

    if not hasattr(os, "sched_getaffinity"):
        pytest.skip("this system does not let a process choose its processors")
    before = os.sched_getaffinity(0)
    with run.pinned(1) as processors:
        assert processors == len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == before


BAD = [
    (
        {"energy": "bendin"},
        "bendin: no such energy; there are bending, gravity, kinetic, parallel_contact, plane, shear, sphere, stretch",
    ),
    ({"peers": ["torch"]}, "torch: no such peer; there are lambdify, jax, casadi, numba, differences"),
    ({"sizes": [0, 10]}, "sizes must be at least 1, not 0, 10"),
    ({"sizes": []}, "sizes must be at least 1, not none"),
    ({"threads": 0}, "threads must be at least 1, not 0"),
    ({"rounds": 0}, "rounds must be at least 1, not 0"),
]


@pytest.mark.parametrize(("options", "message"), BAD)
def test_bad_options(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        run.benchmark(**options)
    assert str(caught.value) == message


def command(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    return status_of(monkeypatch, "benchmark", *words)


def test_the_command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    words = ("parallel_contact", "--sizes", "1", "3", "--peers", "none", "--rounds", "1")
    assert command(monkeypatch, *words, "--json", str(tmp_path / "speed.json")) == 0
    out = capsys.readouterr().out
    assert "parallel_contact, mixed: energy, gradient and Hessian, ns per element" in out
    assert "Command: yarnverify benchmark parallel_contact --sizes 1 3 --peers none --rounds 1" in out
    assert json.loads((tmp_path / "speed.json").read_text())["rounds"] == 1
    assert command(monkeypatch, *words, "--json", "-") == 0
    assert json.loads(capsys.readouterr().out)["schema"] == 1


def test_status_of_a_peer_that_was_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    module = importlib.import_module("yarnverify.benchmark.peers.lambdify")

    def gone(energy: Energy) -> Any:
        raise ModuleNotFoundError("gone", name="somepackage")

    monkeypatch.setattr(module, "ways", gone)
    words = ("parallel_contact", "--sizes", "1", "--rounds", "1", "--peers", "lambdify")
    assert command(monkeypatch, *words) == 3
    shown = capsys.readouterr()
    assert shown.err == "lambdify: not run: somepackage is not installed\n"
    assert "lambdify: not run, somepackage is not installed." in shown.out
    assert command(monkeypatch, "nothing") == 2
    assert capsys.readouterr().err.startswith("nothing: no such energy")
