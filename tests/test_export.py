"""``yarnverify export``: every file says the same, the C source is right to the last digits, the formulas are proved."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

from yarnverify.check.cases import hard_cases
from yarnverify.check.command import check
from yarnverify.check.setting import Options
from yarnverify.cli import app
from yarnverify.errors import InputError, NotRunError
from yarnverify.export.command import export
from yarnverify.library import derivations

COMPILER = shutil.which("cc") or shutil.which("gcc")
ENERGIES = ("stretch", "bending", "shear", "parallel_contact")
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler here")


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory, record: dict[str, Any]) -> Path:
    """What is exported; with the verdicts on the document that other tests have worked out already."""
    out = tmp_path_factory.mktemp("export")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("yarnverify.verdicts.verdicts", lambda *_: (record, ""))
        for energy in ENERGIES:
            export(energy, out, None, 1 if energy in ("bending", "shear") else 3, False)
    return out


def build(exported: Path, *words: str) -> None:
    assert COMPILER is not None
    done = subprocess.run([COMPILER, *FLAGS, *words, "-lm"], cwd=exported, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@needs_compiler
@pytest.mark.parametrize("energy", ENERGIES)
def test_the_c_source_is_held_to_the_golden_vectors(exported: Path, energy: str) -> None:
    build(exported, f"{energy}_test.c", f"{energy}.c", "-o", f"{energy}_test")
    done = subprocess.run([exported / f"{energy}_test"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert re.search(rf"^{energy}: [1-9]\d* blocks at \d+ states: 0 wrong", done.stdout)


@needs_compiler
def test_the_golden_vectors_refuse_a_wrong_source(exported: Path) -> None:
    text = (exported / "stretch.c").read_text()
    wrong = re.sub(r"(out\[4\] = )(\S+);", r"\1-\2;", text)
    assert wrong != text
    (exported / "wrong.c").write_text(wrong)
    build(exported, "stretch_test.c", "wrong.c", "-o", "wrong_test")
    done = subprocess.run([exported / "wrong_test"], capture_output=True, text=True)
    assert done.returncode == 1
    assert "gradient x1  at moderate 0: off by" in done.stdout and "gradient x0 " not in done.stdout


@needs_compiler
@pytest.mark.parametrize("energy", ENERGIES)
def test_the_c_source_passes_the_check_at_every_size(exported: Path, energy: str) -> None:
    build(exported, "-shared", "-fPIC", f"{energy}.c", "-o", f"lib{energy}.so")
    found = check(f"{exported}/lib{energy}.so:{energy}", Options(count=3, extreme=True))
    assert found.passes
    assert max(block.error for block, _ in found.found) <= 16
    assert found.invented == 0


@pytest.mark.parametrize("energy", ENERGIES)
def test_every_file_says_the_same(exported: Path, energy: str) -> None:
    stored = dict(np.load(exported / f"{energy}_golden.npz"))
    matlab = loadmat(exported / f"{energy}_golden.mat")
    states = json.loads((exported / f"{energy}_golden.json").read_text())["states"]
    header = (exported / f"{energy}_golden.h").read_text()
    assert [state["tag"] for state in states] == stored["tags"].tolist()
    for name in ("q", "energy", "gradient", "hessian"):
        read = np.array(numbers([state[name] for state in states]))
        assert np.array_equal(read, stored[name], equal_nan=True), name
        assert np.array_equal(np.squeeze(matlab[name]), np.squeeze(stored[name]), equal_nan=True), name
    for at, value in enumerate(stored["energy"]):
        assert np.isnan(value) or float(value).hex() in header, at
    cases = hard_cases(energy, None, "float64", 1 if energy in ("bending", "shear") else 3)
    assert np.array_equal(stored["hessian"], np.moveaxis(cases.truth.hessian, -1, 0), equal_nan=True)
    known = ~np.isnan(stored["condition_energy"])
    assert np.array_equal(known, cases.truth.has_derivatives) and known.any()
    assert not np.isnan(stored["condition_hessian"][known]).any()


@needs_compiler
def test_an_energy_of_another_paper(tmp_path: Path) -> None:
    rod = derivations() / "rod"
    export("spring", tmp_path, rod, 2, False)
    build(tmp_path, "spring_test.c", "spring.c", "-o", "spring_test")
    assert subprocess.run([tmp_path / "spring_test"], capture_output=True).returncode == 0
    build(tmp_path, "-shared", "-fPIC", "spring.c", "-o", "libspring.so")
    assert check(f"{tmp_path}/libspring.so:spring", Options(count=2, derivations=rod)).passes
    assert r"\tag{1}" in (tmp_path / "spring.tex").read_text()


def numbers(value: Any) -> Any:
    return [numbers(part) for part in value] if isinstance(value, list) else float.fromhex(value)


def test_the_same_bytes_every_time(
    exported: Path, tmp_path: Path, record: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("yarnverify.verdicts.verdicts", lambda *_: (record, ""))
    hard_cases.cache_clear()
    lines = export("parallel_contact", tmp_path, None, 3, False)
    assert len(lines) == 8
    for path in sorted(tmp_path.iterdir()):
        assert path.read_bytes() == (exported / path.name).read_bytes(), path.name


@pytest.mark.parametrize(("energy", "corrected"), [("bending", ["18", "21"]), ("stretch", ["8"])])
def test_the_formulas_are_the_corrected_ones(exported: Path, tmp_path: Path, energy: str, corrected: list[str]) -> None:
    from yarnverify.verdicts import verdicts

    text = (exported / f"{energy}.tex").read_text()
    assert re.findall(r"% equation \((\d+)\) is corrected: ", text) == corrected
    displays = re.findall(r"\\begin\{equation\*\}\n(.*?)\n\\tag\{(\d+)\}\n\\end\{equation\*\}", text, re.DOTALL)
    general = [f"$${body} \\quad ({number})$$" for body, number in displays if int(number) <= 4]
    own = [f"$${body} \\quad ({number})$$" for body, number in displays if int(number) > 4]
    assumed = {"bending": "$u_1 > u_0 > u_2$", "stretch": r"$\Delta u = u_1 - u_0 > 0$"}[energy]
    document = "\n\n".join([*general, f"## {energy.capitalize()}", f"Assumed: {assumed}.", *own])
    (tmp_path / "mended.md").write_text(document)
    record, _ = verdicts(tmp_path / "mended.md", str(derivations()), cache=False)
    assert record["tally"]["refuted"] == record["tally"]["undecided"] == 0 < record["tally"]["proved"]


def test_what_cannot_be_exported_says_why(
    tmp_path: Path, record: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match="bent: no such energy; there are bending"):
        export("bent", tmp_path, None, 1, False)
    with pytest.raises(InputError, match="--count 0: give a positive number"):
        export("bending", tmp_path, None, 0, False)
    monkeypatch.setattr("yarnverify.verdicts.verdicts", lambda *_: (record, ""))
    (tmp_path / "file").write_text("")
    with pytest.raises(NotRunError, match="cannot write: "):
        export("parallel_contact", tmp_path / "file", None, 1, False)


def test_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], record: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("yarnverify.verdicts.verdicts", lambda *_: (record, ""))
    with pytest.raises(SystemExit) as end:
        app(["export", "parallel_contact", "--out", str(tmp_path), "--count", "1"], exit_on_error=False)
    assert not end.value.code
    shown = capsys.readouterr().out
    assert f"{tmp_path}/parallel_contact.c: energy, gradient and Hessian in C" in shown
    assert len(shown.splitlines()) == len(list(tmp_path.iterdir())) == 8
