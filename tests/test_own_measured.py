"""Energies of one's own, vectors among their parameters, in what measures and exports them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from tests.commands import caller
from yarnverify.accuracy.cells import kernel
from yarnverify.check.cases import hard_cases
from yarnverify.errors import InputError, NotRunError
from yarnverify.export.command import export
from yarnverify.fuzzing import command as fuzzing
from yarnverify.fuzzing.search import search
from yarnverify.generation import generate_kernels
from yarnverify.project import project
from yarnverify.strategies import Element, element, elements

ENERGIES = """
from yarnverify.symbolic.declare import *


@energy
def anchor(x0: Point, *, k: Positive["N/m"], c: Vector["m"]):
    return k * square(x0 - c) / 2


@energy
def fibre(x0: Point, x1: Point, *, k: Positive["J"], a: Positive["1"], L: Positive["m"]):
    return k * (exp(a * (length(x1 - x0) / L - 1) ** 2) - 1)


@energy
def toda(x0: Point, x1: Point, *, k: Positive["J"], L: Positive["m"]):
    e = length(x1 - x0) / L - 1
    return k * (exp(e) - 1 - e)


@energy
def turned(x0: Point, x1: Point, x2: Point, *, k: Positive["N m^2"], a: Positive["rad"], b: Real["rad"], L: Positive["m"]):
    return k * (angle(x1 - x0, x0 - x2) - a - b) ** 2 / (2 * L)


@energy
def signed(x0: Point, *, k: Positive["N/m"]):
    return k * square(x0) / 2
"""
COMPILER = shutil.which("cc") or shutil.which("gcc")


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("measured") / "own"
    folder.mkdir()
    (folder / "energies.py").write_text(ENERGIES, encoding="utf-8")
    generate_kernels(False, of=project(folder))
    return folder


@pytest.fixture
def run(own: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run the command beside the folder: exit status, standard output, standard error."""
    monkeypatch.chdir(own.parent)
    return caller(monkeypatch, capsys)


def test_errors_with_a_vector_are_measured_at_moderate_states_and_replayed(run: Any, tmp_path: Path) -> None:
    out = tmp_path / "found.json"
    status, shown, err = run("accuracy", "own/anchor", "--executor", "serial", "--json", str(out))
    assert (status, err) == (0, "") and "all as expected" in shown
    cells = json.loads(out.read_text(encoding="utf-8"))["cells"]
    assert {cell["regime"] for cell in cells} == {"moderate"} and len(cells) == 5
    again = next(
        cell["outputs"]["E"]["replay"] for cell in cells if (cell["variant"], cell["dtype"]) == ("fast", "float64")
    )
    worst = next(
        cell["outputs"]["E"]["worst"] for cell in cells if (cell["variant"], cell["dtype"]) == ("fast", "float64")
    )
    status, shown, _ = run("accuracy", "own/anchor", "--replay", again, "--json", "-")
    assert status == 0 and json.loads(shown)["blocks"][0]["error"] == worst
    assert {"c.x", "c.y", "c.z"} <= set(json.loads(shown)["state"])
    status, _, err = run("accuracy", "own/anchor", "--replay", re.sub("c=[^ ]*", "c=1", again))
    assert status == 2 and err == "--replay: c is a vector, x,y,z\n"


@pytest.mark.skipif(COMPILER is None, reason="no C compiler here")
def test_golden_vectors_with_a_vector_say_the_same_in_every_file(own: Path, tmp_path: Path, run: Any) -> None:
    export("anchor", tmp_path, own, 3, False)
    stored = dict(np.load(tmp_path / "anchor_golden.npz"))
    states = json.loads((tmp_path / "anchor_golden.json").read_text())["states"]
    exact = hard_cases("anchor", own, "float64", 3).points.parameters["c"]
    for at, axis in enumerate("xyz"):
        assert np.array_equal(stored[f"c_{axis}"], exact[at])
        assert [float.fromhex(state["parameters"][f"c_{axis}"]) for state in states] == exact[at].tolist()
    assert "parameters  4: k in N/m, c_x in m, c_y in m, c_z in m" in (tmp_path / "anchor.h").read_text()
    flags = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror")
    compile_ = [str(COMPILER), *flags, "anchor_test.c", "anchor.c", "-o", "anchor_test", "-lm"]
    subprocess.run(compile_, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "anchor_test"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.startswith("anchor: 9 blocks at 3 states: 0 wrong")
    subprocess.run(
        [str(COMPILER), *flags, "-shared", "-fPIC", "anchor.c", "-o", "libanchor.so"], cwd=tmp_path, check=True
    )
    status, shown, _ = run("check", f"{tmp_path}/libanchor.so:anchor", "--energy", "own/anchor", "--count", "3")
    assert status == 0 and "no hard cases: what is hard about a vector is not known" in shown


def test_a_word_of_c_is_no_name_for_c(own: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="signed: 'signed' is a word of C"):
        export("signed", tmp_path / "out", own, 1, False)
    assert not (tmp_path / "out").exists()


def test_a_search_draws_vectors_and_lengths_near_the_size(own: Path) -> None:
    found = search("anchor", "accurate", 60.0, 1, most=100, folder=own)
    assert found.cases == 100 and not found.found and found.worst_element is not None
    again = element(*re.findall(r'"([^"]*)"', repr(found.worst_element))[:1], k="0x1p+0", c="0x1p+0 0x0p+0 -0x1p+0")
    assert again.parameters["c"].tolist() == [1.0, 0.0, -1.0] and repr(again).endswith('c="0x1p+0 0x0p+0 -0x1p+0")')


def test_an_angle_that_must_be_positive_is_drawn_so(own: Path) -> None:
    drawn: list[Element] = []
    found = search("turned", "fast", 60.0, 1, most=200, folder=own)
    assert found.cases == 200
    module = kernel("fast", "turned", str(own))

    @settings(max_examples=100)
    @given(elements(module, units={"a": "rad", "b": "rad"}))
    def collect(element: Element) -> None:
        drawn.append(element)

    collect()
    assert min(e.parameters["a"] for e in drawn) >= 0 > min(e.parameters["b"] for e in drawn)


def test_what_hypothesis_says_of_being_stopped_is_no_error(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stopped within a draw it may find that draws differ; but what it says before the time is up is told."""

    def stopped(progress: Any, number: int) -> None:
        try:
            while True:
                pass
        except BaseException:
            raise RuntimeError("draws differ") from None

    def failing(progress: Any, number: int) -> None:
        raise RuntimeError("a mistake")

    monkeypatch.setattr("yarnverify.fuzzing.search._round", stopped)
    assert search("anchor", "accurate", -0.9, 1, folder=own).cases == 0
    monkeypatch.setattr("yarnverify.fuzzing.search._round", failing)
    with pytest.raises(RuntimeError, match="a mistake"):
        search("anchor", "accurate", 60.0, 1, folder=own)


def test_a_search_tells_what_a_kernel_does_not_promise(own: Path, run: Any) -> None:
    lines, (record,) = fuzzing.fuzz("toda", "accurate", 2.0, 1, lambda label, total: None, project(own))
    assert "limit 16 u + 8 u x condition, which it does not promise)" in lines[0]
    assert "error" in {flaw["kind"] for flaw in record["found"]}  # exp(e) - 1 - e loses digits at small e
    assert "accepted" not in {flaw["kind"] for flaw in record["found"]}  # an exponential that overflows is infinite
    status, _, err = run("fuzz", "own/nothing", "--time", "1")
    assert status == 2 and err == "there is no energy 'nothing'; one of anchor, fibre, signed, toda, turned\n"


def test_ones_own_energies_are_timed_beside_the_peers(run: Any) -> None:
    for energy, peer in (("anchor", "lambdify"), ("anchor", "casadi"), ("fibre", "lambdify")):
        arguments = ("--sizes", "10", "--rounds", "1", "--json", "-", "--peers", peer)
        status, shown, err = run("benchmark", f"own/{energy}", *arguments)
        record = json.loads(shown)
        found = record["energies"][energy]
        assert status == (3 if peer in found["not_run"] else 0), err  # casadi may not be installed
        assert {"accurate", "fast"} <= set(found["contestants"]) and record["energies"].keys() == {energy}
        assert record["command"] == f"yarnverify benchmark own/{energy} --sizes 10 --peers {peer} --rounds 1"
        for name in found["contestants"]:
            assert found["errors"]["mixed"][name]["G"] < 1e6, name  # the same energy, and the same vector


def test_without_kernels_it_is_told_how_they_are_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from yarnverify.benchmark.run import benchmark

    (tmp_path / "bare").mkdir()
    (tmp_path / "bare" / "energies.py").write_text(ENERGIES, encoding="utf-8")
    words = "bare: has no .*kernels.*; they are made by: yarnverify generate .*bare"
    with pytest.raises(NotRunError, match=words):
        fuzzing.fuzz(None, "accurate", 1.0, 1, lambda label, total: None, project(tmp_path / "bare"))
    with pytest.raises(NotRunError, match=words):
        benchmark(None, (10,), (), of=project(tmp_path / "bare"))


def test_a_third_is_divided_by_where_digits_are_twice_as_many() -> None:
    import sympy as sp

    from yarnverify.symbolic.printing import text_of

    x, y = sp.symbols("x y")
    assert [text_of(value, divides=True) for value in (x * y / 3, -x / 6 + y, (x / 3) ** 2)] == [
        "(x*y)/3",
        "(-x)/6 + y",
        "(x*x)/9",
    ]
    assert text_of(x / 3) == "(1/3)*x" and text_of(x / 4, divides=True) == "(1/4)*x"
