"""The benchmark of the simulations: what is measured is right, whoever cannot run is named, and no test depends on speed."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.commands import caller
from yarnverify.benchmark.show import show_benchmark
from yarnverify.benchmark.simulation import cantilever, memory, run
from yarnverify.benchmark.simulation.cantilever import Solve, error, least, ours
from yarnverify.benchmark.simulation.cloth import PARTS, STEP, Cloth
from yarnverify.benchmark.simulation.run import benchmark_simulation
from yarnverify.errors import InputError, NotRunError
from yarnverify.report.pages import pages
from yarnverify.report.simulation_speed import milliseconds, speed_tables
from yarnverify.simulation.answers import elastica


@pytest.fixture(scope="module")
def record() -> dict[str, Any]:
    """A small one, as it comes back from its file."""
    patch = pytest.MonkeyPatch()
    patch.setattr(run, "peak", lambda side, solver: 1234.5)
    try:
        found = benchmark_simulation((9, 36), peers=(), rounds=1)
    finally:
        patch.undo()
    return dict(json.loads(json.dumps(found)))


def test_an_iteration_is_the_sum_of_its_parts(record: dict[str, Any]) -> None:
    for solver in ("direct", "gradients"):
        assert [line["crossings"] for line in record["cloth"][solver]] == [9, 36]
        for line in record["cloth"][solver]:
            seconds = line["seconds"]
            assert set(seconds) == {*PARTS, "iteration"}
            assert all(value >= 0 for value in seconds.values()) and seconds["iteration"] > 0
            assert line["unknowns"] == 3 * (line["crossings"] - 2)
            assert line["bytes"] in (1234, 1235)
    assert all(line["inner"] > 0 for line in record["cloth"]["gradients"])


@pytest.mark.parametrize("solver", ["direct", "gradients"])
def test_what_is_timed_is_the_time_step(solver: str) -> None:
    cloth, plain = Cloth.made(5, solver), Cloth.made(5, "direct")
    plain.dynamics.solver = None
    before = cloth.motion.Q.copy()
    found = cloth.step(2)
    assert cloth.solver.solves == 2
    assert abs(sum(found[part] for part in PARTS) - found["iteration"]) < 1e-12
    assert np.array_equal(cloth.motion.Q, before)
    del cloth.dynamics.options["report"]
    end, wanted = cloth.dynamics.step(cloth.motion, STEP), plain.dynamics.step(plain.motion, STEP)
    assert np.abs(end.Q - wanted.Q).max() < 1e-11
    held = [cloth.fabric.node(0, -1), cloth.fabric.node(-1, -1)]
    assert np.array_equal(cloth.fabric.points(end.Q)[held], cloth.fabric.points(before)[held])


def test_floors_count_the_bytes_of_what_is_there() -> None:
    cloth = Cloth.made(6, "direct")
    cloth.step(1)
    floors, system = cloth.floors(), cloth.dynamics.system
    assert floors["factorise"] == 12 * system.pattern.indices.size + cloth.solver.bytes
    outputs = sum(
        t.table.count * (1 + 2 * len(t.table.rows) + len(t.table.rows) * (len(t.table.rows) + 1) // 2)
        for t in system.terms
    )
    assert floors["kernels"] == 8 * outputs


def test_growth_is_the_slope_between_sizes() -> None:
    def line(crossings: int, power: float) -> dict[str, Any]:
        seconds = dict.fromkeys((*PARTS, "iteration"), 1e-6 * crossings**power)
        return {"crossings": crossings, "seconds": seconds}

    (found,) = run._growth([line(100, 1.5), line(10_000, 1.5)])
    assert set(found["exponents"].values()) == {1.5}
    assert run._growth([line(100, 1.0)]) == []


@pytest.mark.parametrize("engine", ["numpy", "compiled"])
def test_the_cantilever_reaches_its_goal(engine: str) -> None:
    for goal in (1e-3, 1e-4):
        found = least(lambda n: ours(n, 1.0, engine), 1.0, goal)
        assert found is not None
        n, solve, reached = found
        assert reached <= goal and error(solve.run(), 1.0) == reached
        before = cantilever.SEGMENTS[cantilever.SEGMENTS.index(n) - 1]
        assert error(ours(before, 1.0, engine).run(), 1.0) > goal


def test_the_least_number_of_segments_is_looked_for() -> None:
    exact = elastica(1.0).deflection
    found = least(lambda n: Solve("", lambda: exact + 1 / n), 1.0, 0.1, (5, 9, 10, 11, 20))
    assert found is not None and found[0] == 10
    assert least(lambda n: Solve("", lambda: exact + 1.0), 1.0, 0.1) is None
    assert error(float("nan"), 1.0) == np.inf


def test_the_generic_way_by_jax_reaches_the_goal() -> None:
    pytest.importorskip("jax")
    from yarnverify.benchmark.simulation.peers import jax

    assert error(jax.make(24, 1.0, 1e-3).run(), 1.0) < 5e-4


def test_peers_that_cannot_run_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("elastica", "jax"):
        sys.modules.pop(f"yarnverify.benchmark.simulation.peers.{name}", None)
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setattr(run, "OWN", ("yarnverify, NumPy",))
    labels: list[str] = []
    found = run._cantilever(1e-3, ["jax", "elastica"], 1, labels.append)
    assert found["not_run"] == {"jax": "jax is not installed", "elastica": "elastica is not installed"}
    assert list(found["lines"]) == ["yarnverify, NumPy"] and len(labels) == 3


def test_a_peer_that_fails_or_never_gets_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def make(n: int, alpha: float, goal: float) -> Solve:
        if goal < 1e-3:
            raise ZeroDivisionError("no such step")
        return Solve("wrong", lambda: 7.0)

    name = "yarnverify.benchmark.simulation.peers.jax"
    monkeypatch.setitem(sys.modules, name, SimpleNamespace(make=make, PACKAGES=()))
    monkeypatch.setattr(run, "OWN", ("yarnverify, NumPy",))
    assert run._cantilever(1e-3, ["jax"], 1, lambda label: None)["not_run"] == {"jax": "comes to no error of 0.001"}
    assert run._cantilever(1e-4, ["jax"], 1, lambda label: None)["not_run"] == {
        "jax": "ZeroDivisionError: no such step"
    }


def test_memory_is_that_of_a_process_of_its_own() -> None:
    found = memory.peak(24, "direct", "numpy")
    assert 1e3 < found < 1e6  # bytes per crossing, the smallest parts included
    with pytest.raises(NotRunError, match=r"memory of 24 x 24 crossings could not be measured: .*fortran"):
        memory.peak(24, "direct", "fortran")


def test_tables_page_and_terminal_say_the_same(record: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    tables = speed_tables(record)
    assert [len(table.rows) for table in tables[:2]] == [3, 3]
    for table in tables:
        assert all(len(row) == len(table.headings) for row in table.rows)
    assert tables[0].rows[0][0] == "9" and tables[0].rows[2][0] == "9 to 36"
    assert tables[0].rows[0][-2] == "–"  # memory per crossing says nothing of so small a cloth
    empty: dict[str, Any] = {
        "claims": [],
        "completeness": [],
        "errata": {"stale": []},
        "given": [],
        "document": "",
        "tally": {},
    }
    page = pages({"verdicts": empty, "derivations": {}, "kernels": {}, "simulation-speed": record})[
        "simulation-speed.md"
    ]
    show_benchmark(record)
    shown = capsys.readouterr().out
    for table in tables:
        assert f"## {table.title}\n" in page and table.title in shown
    assert record["command"] in page and record["command"] in shown
    assert milliseconds(0.0012345) == "1.23" and milliseconds(12.3) == "12300"


def test_the_picture_is_drawn(record: dict[str, Any], tmp_path: Path) -> None:
    from yarnverify.report.pictures import write
    from yarnverify.report.simulation_pictures import iteration

    first = [path.read_bytes() for path in write(lambda: iteration(record), tmp_path / "one")]
    assert [path.read_bytes() for path in write(lambda: iteration(record), tmp_path / "two")] == first


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--sizes", "4"], "sizes are numbers of crossings, at least 9, not 4"),
        (["--peers", "abaqus"], "abaqus: no such peer of the simulation; there are jax, elastica"),
        (["--rounds", "0"], "rounds must be at least 1, not 0"),
        (["--threads", "2"], "simulations run on one thread: leave --threads out"),
    ],
)
def test_options_out_of_range_are_refused_in_one_line(
    options: list[str], message: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    status, _, err = caller(monkeypatch, capsys)("benchmark", "simulation", *options)
    assert status == 2
    assert err.strip().splitlines()[-1] == message


def test_a_named_peer_that_is_missing_is_exit_status_3(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sys.modules.pop("yarnverify.benchmark.simulation.peers.elastica", None)
    monkeypatch.setitem(sys.modules, "elastica", None)
    monkeypatch.setattr(run, "peak", lambda side, solver: 1.0)
    target = tmp_path / "speed.json"
    options = ["--sizes", "9", "--peers", "elastica", "--rounds", "1", "--json", str(target)]
    status, _, err = caller(monkeypatch, capsys)("benchmark", "simulation", *options)
    assert status == 3
    assert "elastica: not run: elastica is not installed" in err
    assert (
        json.loads(target.read_text())["command"]
        == "yarnverify benchmark simulation --sizes 9 --peers elastica --rounds 1"
    )


def test_sizes_are_checked_before_anything_runs() -> None:
    with pytest.raises(InputError, match="not none"):
        benchmark_simulation(())
