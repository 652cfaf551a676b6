"""The sweep: its plan, its executors, what an interruption leaves, its record, and the command."""

from __future__ import annotations

import json
import threading
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.commands import status_of
from yarnverify.accuracy import command, sweep
from yarnverify.accuracy.cells import Unit, run_unit
from yarnverify.accuracy.record import grown, make_record, read_record, record_text
from yarnverify.accuracy.sweep import PROFILES, executor_named, finish, plan, run, state_folder
from yarnverify.errors import InputError, NotRunError

TINY = replace(PROFILES["quick"], count=4, orientations=1)


@pytest.fixture(scope="module")
def units() -> list[Unit]:
    planned, _ = plan(TINY, ["stretch", "parallel_contact"], ["printed", "differentiated"])
    return [unit for unit in planned if unit.kind == "cells"][:12]


@pytest.fixture(scope="module")
def text(units: list[Unit]) -> str:
    return as_text(units, run(units))


def as_text(units: list[Unit], results: list[dict[str, Any]]) -> str:
    return record_text(make_record(TINY, units, results, []))


def test_the_plan_holds_every_energy_variant_type_and_regime() -> None:
    units, missing = plan(PROFILES["quick"])
    vectors = {"gravity", "plane", "sphere"}  # are among their parameters, whose hard cases are not known
    assert {unit.energy for unit in units} == {"stretch", "bending", "shear", "parallel_contact"} | vectors
    assert {(unit.kind, unit.regime) for unit in units if unit.energy in vectors} == {("cells", "moderate")}
    assert {unit.dtype for unit in units} == {"float64", "float32"}
    assert len(units) == len({(unit.kind, unit.name) for unit in units})
    assert all("reference" not in unit.variants for unit in units if unit.dtype == "float32")
    for variant in sweep.VARIANTS:
        has = any(variant in unit.variants for unit in units)
        assert has != any(line.startswith(f"{variant} ") for line in missing)
    with pytest.raises(InputError, match="no such energy"):
        plan(TINY, ["cheer"])
    with pytest.raises(InputError, match="no such variant"):
        plan(TINY, variants=["quick"])


def test_what_has_no_kernel_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep, "has_kernel", lambda variant, energy, folder: variant == "printed")
    units, missing = plan(TINY, ["shear"], ["fast", "printed"])
    assert all(unit.variants == ("printed",) for unit in units)
    assert missing == ["fast shear: there is no such kernel"]


def test_processes_give_the_same_bytes(units: list[Unit], text: str) -> None:
    with executor_named("processes", 2) as pool:
        assert as_text(units, run(units, pool)) == text


def test_threads_give_the_same_bytes(units: list[Unit], text: str) -> None:
    """FLINT has one working precision for all threads, so the truth must not let them in at once."""
    with ThreadPoolExecutor(4) as pool:
        assert as_text(units, run(units, pool)) == text


def test_a_cluster_gives_the_same_bytes(units: list[Unit], text: str) -> None:
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster,
        executor_named(f"dask:{cluster.scheduler_address}") as pool,
    ):
        assert as_text(units, run(units, pool)) == text


def test_executors_that_are_not_there_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="give serial, processes, or dask:ADDRESS"), executor_named("grid"):
        pass
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(NotRunError, match="cluster"), executor_named("dask:tcp://127.0.0.1:1"):
        pass


class _Backwards(Executor):
    """Runs the last unit first, to show that results keep the plan's order."""

    def __init__(self) -> None:
        self.waiting: list[Any] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.waiting.append((future, fn, args))
        if len(self.waiting) == 12:
            threading.Thread(target=self._run).start()
        return future

    def _run(self) -> None:
        for future, fn, args in reversed(self.waiting):
            if future.set_running_or_notify_cancel():
                future.set_result(fn(*args))


def test_results_keep_the_order_of_the_plan(units: list[Unit], text: str) -> None:
    assert as_text(units, run(units, _Backwards())) == text


def test_an_interrupted_run_goes_on_where_it_stopped(units: list[Unit], text: str, tmp_path: Path) -> None:
    done: list[str] = []

    def stops(unit: Unit) -> dict[str, Any]:
        if len(done) == 5:
            raise KeyboardInterrupt
        done.append(unit.name)
        return run_unit(unit)

    def goes_on(unit: Unit) -> dict[str, Any]:
        done.append(unit.name)
        return run_unit(unit)

    with pytest.raises(KeyboardInterrupt):
        run(units, None, tmp_path, work=stops)
    assert len(list(tmp_path.glob("*.json"))) == 5
    (tmp_path / ".half.1.part.json").write_text("{", encoding="utf-8")  # what a killed writer leaves
    seen: list[str] = []
    results = run(units, None, tmp_path, lambda label, total: seen.append(label), goes_on)
    assert sorted(done) == sorted(unit.name for unit in units) == sorted(seen)
    assert as_text(units, results) == text
    finish(tmp_path)
    assert not tmp_path.exists()


def test_a_failing_unit_keeps_the_others(units: list[Unit], tmp_path: Path) -> None:
    def fails(unit: Unit) -> dict[str, Any]:
        if unit is units[3]:
            raise RuntimeError("out of memory")
        return run_unit(unit)

    with ThreadPoolExecutor(1) as pool, pytest.raises(RuntimeError, match="out of memory"):
        run(units, pool, tmp_path, work=fails)
    assert len(list(tmp_path.glob("*.json"))) >= 3


def test_what_another_plan_left_is_not_taken(units: list[Unit], tmp_path: Path) -> None:
    one = units[:1]
    run(one, None, tmp_path)
    again: list[Unit] = []

    def counts(unit: Unit) -> dict[str, Any]:
        again.append(unit)
        return run_unit(unit)

    run(one, None, tmp_path, work=counts)
    assert not again
    run([replace(one[0], seed=one[0].seed + 1)], None, tmp_path, work=counts)
    assert len(again) == 1
    next(iter(tmp_path.glob("*.json"))).write_text("not JSON", encoding="utf-8")
    run(one, None, tmp_path, work=counts)
    assert len(again) == 2


def test_an_interruption_is_one_line(small: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    real, done = command.run, []

    def stops(units: Any, pool: Any, folder: Any, advance: Any) -> Any:
        def advances(label: str, total: int) -> None:
            done.append(label)
            if len(done) == 3:
                raise KeyboardInterrupt

        return real(units, pool, folder, advances)

    monkeypatch.setattr(command, "run", stops)
    asked = ["parallel_contact", "--executor", "serial"]
    assert call(asked, monkeypatch) == 3
    assert "interrupted; 3 of" in capsys.readouterr().err
    monkeypatch.setattr(command, "run", real)
    assert call([*asked, "--json", "-"], monkeypatch) == 0
    after = json.loads(capsys.readouterr().out)
    assert call([*asked, "--json", "-"], monkeypatch) == 0
    assert json.loads(capsys.readouterr().out) == after


def test_the_place_of_a_run_depends_on_its_plan(units: list[Unit], monkeypatch: Any, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert state_folder(units) == state_folder(list(units)) != state_folder(units[:-1])
    assert tmp_path in state_folder(units).parents


# -- record and command -----------------------------------------------------------------------------------------------


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setitem(PROFILES, "quick", TINY)
    monkeypatch.setattr(sweep, "curves", lambda energy: ("rest",) if energy.name == "parallel_contact" else ())
    monkeypatch.setattr(
        command,
        "plan",
        lambda profile, energies, variants, folder: plan(
            profile, energies or ["stretch", "parallel_contact"], variants
        ),
    )
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    # targets are judged on the real profile, by `yarnverify accuracy --check`; here the commands are
    monkeypatch.setattr(command, "missed_targets", lambda record, again: [])
    return tmp_path


def call(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> int:
    return status_of(monkeypatch, "accuracy", *arguments)


def test_the_record_is_written_and_compared(small: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    out = ["--executor", "serial", "--out", str(small)]
    assert call(["--write", *out], monkeypatch) == 0
    path = small / "records" / "accuracy.json"
    first = path.read_bytes()
    assert call(["--check", *out], monkeypatch) == 0
    assert "all as expected" in capsys.readouterr().out
    assert call(["--check", "parallel_contact", *out], monkeypatch) == 0

    record = json.loads(first)
    changed = next(c for c in record["cells"] if c["energy"] == "parallel_contact" and c["regime"] == "moderate")
    changed["outputs"]["E"]["worst"] = 0.0
    outputs = next(c for c in record["cells"] if c["energy"] == "stretch" and c["regime"] == "near rest")["outputs"]
    outputs["E"]["worst"] /= 2.5
    path.write_text(json.dumps(record), encoding="utf-8")
    assert call(["--check", *out], monkeypatch) == 1
    shown = capsys.readouterr().out
    assert "stretch, printed, float64, near rest: E normwise error" in shown and "--replay" in shown
    assert call(["--write", *out], monkeypatch) == 0
    assert path.read_bytes() == first


def test_cells_of_one_record_alone_are_told() -> None:
    cell = {"energy": "e", "variant": "v", "dtype": "float64", "regime": "r", "outputs": {}}
    one, none = {"cells": [cell]}, {"cells": []}
    assert grown(none, one) == ["e, v, float64, r: is not in the record; write it with: yarnverify accuracy --write"]
    assert grown(one, none) == ["e, v, float64, r: is in the record, and was not run"]
    assert grown(one, none, whole=False) == []


def test_an_error_below_a_unit_never_counts_as_grown() -> None:
    def record(worst: Any) -> dict[str, Any]:
        output = {"worst": worst, "componentwise": worst, "replay": ""}
        return {"cells": [{"energy": "e", "variant": "v", "dtype": "d", "regime": "r", "outputs": {"E": output}}]}

    assert (
        not grown(record(0.0), record(1.9))
        and not grown(record(3.0), record(5.9))
        and not grown(record("inf"), record("inf"))
    )
    for before, after in ((0.0, 2.1), (3.0, 6.1), (1e9, "inf"), (None, 1.0)):
        assert len(grown(record(before), record(after))) == 2
    assert not grown(record(1.0), record(None))


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (["cheer"], 2, "cheer: no such energy"),
        (["--variant", "quick"], 2, "quick: no such variant"),
        (["--check", "--out", "/nowhere"], 2, "the same command with --write instead of --check makes it"),
        (["--write", "bending"], 2, "--write takes the whole sweep"),
        (["--executor", "grid"], 2, "give serial"),
        (["--replay", "nonsense"], 2, "give ENERGY VARIANT"),
    ],
)
def test_bad_requests_are_one_line(
    arguments: list[str], status: int, message: str, monkeypatch: Any, capsys: Any
) -> None:
    assert call(arguments, monkeypatch) == status
    shown = capsys.readouterr().err
    assert message in shown and shown.count("\n") == 1


def test_a_record_of_another_profile_is_not_compared(small: Path, monkeypatch: Any, capsys: Any) -> None:
    path = small / "records" / "accuracy.json"
    path.parent.mkdir()
    path.write_text(json.dumps({"schema": 1, "profile": "full", "cells": []}), encoding="utf-8")
    assert call(["--check", "--out", str(small)], monkeypatch) == 2
    assert "made with --profile full" in capsys.readouterr().err
    for content in ("{", "[]", "{}"):
        path.write_text(content, encoding="utf-8")
        with pytest.raises(InputError):
            read_record(path)


def test_one_state_from_the_command_line(monkeypatch: Any, capsys: Any) -> None:
    state = "parallel_contact differentiated float64 0,0x1p-1 k_c=1 L=1 d=1"
    assert call(["--replay", state], monkeypatch) == 0
    assert "0.125" in capsys.readouterr().out
    assert call(["--replay", state, "--json", "-"], monkeypatch) == 0
    assert json.loads(capsys.readouterr().out)["blocks"][0]["true"] == [0.125]
