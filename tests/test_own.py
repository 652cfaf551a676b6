"""Folders of one's own: a start, energies of many kinds, a second document, and what is told of mistakes."""

from __future__ import annotations

import doctest
import importlib
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.commands import caller
from yarnverify.accuracy.cells import Unit, kernel, run_unit
from yarnverify.accuracy.truth import Points, truth
from yarnverify.errors import InputError
from yarnverify.generation import generate_kernels
from yarnverify.init import init
from yarnverify.project import find, project
from yarnverify.symbolic.loading import load_declarations
from yarnverify.tutorial import importing_from

HEAD = "from yarnverify.symbolic.declare import *\n"

pytestmark = pytest.mark.filterwarnings("ignore:Cyclopts application invoked without tokens")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("own")


@pytest.fixture
def run(place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run the command in the folder: exit status, standard output, standard error."""
    monkeypatch.chdir(place)
    monkeypatch.setenv("XDG_CACHE_HOME", str(place / "cache"))
    return caller(monkeypatch, capsys)


# -- a start ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def started(place: Path) -> Path:
    init(place / "my_model")
    return place / "my_model"


def test_a_start_is_whole_and_reports_at_once(started: Path, run: Any) -> None:
    assert {path.name for path in started.iterdir()} >= {"spring.py", "my_model.md", "errata.toml", "README.md"}
    status, out, err = run("report", "my_model")
    assert (status, err) == (0, "") and "7 proved, 0 refuted." in out and "all as expected." in out
    page = (started / "reports" / "spring.md").read_text(encoding="utf-8")
    assert "](../my_model.md#L9)" in page and "`yarnverify prove my_model`" in page
    assert (started / "my_model.md").read_text(encoding="utf-8").splitlines()[8].startswith("$$V =")
    assert "reference" in page and "| moderate |" in page
    for name in ("verdicts", "derivations", "kernels", "accuracy"):
        assert json.loads((started / "reports" / "records" / f"{name}.json").read_text(encoding="utf-8"))
    assert "Report on" in (started / "reports" / "report.html").read_text(encoding="utf-8")
    for check in (("report", "my_model", "--check"), ("generate", "my_model", "--check")):
        assert run(*check)[0] == 0


def test_commands_that_are_told_are_those_that_work_from_here(
    started: Path, run: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    text = (started / "spring.py").read_text(encoding="utf-8")
    (tmp_path / "spring.py").write_text(text.replace("document=", "#"), encoding="utf-8")
    assert "made by: yarnverify generate " + str(tmp_path) in run("accuracy", str(tmp_path))[2]
    monkeypatch.chdir(tmp_path)
    assert run("accuracy", ".")[2].endswith("made by: yarnverify generate .\n")


def test_what_is_not_proved_of_one_energy_leaves_the_others_theirs(
    tmp_path: Path, run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from yarnverify.errors import NotRunError
    from yarnverify.symbolic import modules

    def proved(energy: Any, declarations: Any) -> Any:
        if energy.name == "second":
            raise NotRunError("second: derived block dF_x0/dx0 is undecided: too long")
        return real(energy, declarations)

    real = modules.proved
    monkeypatch.setattr(modules, "proved", proved)
    body = "(x0: Point, *, k: Positive['N/m']):\n    return k * square(x0)\n\n"
    (tmp_path / "two.py").write_text(f"{HEAD}\n@energy\ndef first{body}@energy\ndef second{body}", encoding="utf-8")
    status, out, _ = run("generate", str(tmp_path), "--no-cache")
    assert status == 1 and (tmp_path / "kernels" / "first.py").is_file()
    assert "second: derived block dF_x0/dx0 is undecided: too long; it gets no kernels" in out
    assert not (tmp_path / "kernels" / "second.py").exists()
    status, out, _ = run("report", str(tmp_path))
    assert status == 1 and "it gets no kernels" in out and (tmp_path / "reports" / "first.md").is_file()


def test_the_examples_of_a_start_run(started: Path, run: Any) -> None:
    run("generate", "my_model")
    text = (started / "README.md").read_text(encoding="utf-8")
    test = doctest.DocTestParser().get_doctest(text, {}, "README.md", "README.md", 0)
    runner = doctest.DocTestRunner()
    with importing_from(started.parent):
        runner.run(test)
    assert runner.failures == 0 and runner.tries >= 5
    commands = [line.partition("#")[0].split()[1:] for line in text.splitlines() if line.startswith("yarnverify ")]
    assert [command[0] for command in commands] == ["report", "prove", "derive", "generate", "accuracy"]
    for command in commands[1:4]:
        assert run(*command)[0] == 0


def test_a_damaged_kernel_and_page_of_ones_own_are_shown(started: Path, run: Any) -> None:
    run("report", "my_model")
    for path in (started / "kernels" / "accurate" / "spring.py", started / "reports" / "spring.md"):
        good = path.read_text(encoding="utf-8")
        path.write_text(good.replace("spring", "sprung", 1), encoding="utf-8")
        status, out, _ = run("report", "my_model", "--check")
        assert status == 1 and "sprung" in out and "yarnverify" in out
        path.write_text(good, encoding="utf-8")
    (started / "kernels" / "accurate" / "old.py").write_text('"""Generated by yarnverify."""\n', encoding="utf-8")
    (started / "kernels" / "mine.py").write_text("x = 1\n", encoding="utf-8")
    _, out, _ = run("generate", "my_model")
    assert "accurate/old.py: removed" in out and (started / "kernels" / "mine.py").exists()
    (started / "kernels" / "mine.py").unlink()


@pytest.mark.parametrize(
    ("name", "words"),
    [("2d-rods", "call it model_2d_rods"), ("my model", "call it my_model"), ("taken", "nothing is overwritten")],
)
def test_a_start_is_refused(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=words):
        init(tmp_path / name)
    assert (tmp_path / "taken" / "notes.txt").read_text(encoding="utf-8") == "mine"
    assert not (tmp_path / name).exists() or name == "taken"


# -- energies of many kinds -------------------------------------------------------------------------------------------

KINDS = {
    "hinge": '''
@energy
def hinge(x0: Point, x1: Point, x2: Point, x3: Point, *, k: Positive["N m"], phi_0: Real["rad"]):
    """Two triangles about the edge x0-x1."""
    phi = angle(cross(x1 - x0, x2 - x0), cross(x3 - x0, x1 - x0))
    return k * (phi - phi_0) ** 2 / 2
''',
    "spring": '''
@energy()
def spring(x0: Point, x1: Point, *, k: Positive["N/m"], L: Positive["m"]):
    return k * (length(x1 - x0) - L) ** 2 / 2
''',
    "torsion": '''
@energy()
def torsion(x0: Point, x1: Point, x2: Point, *, k: Positive["N m"], theta_0: Real["rad"]):
    return k * (angle(x1 - x0, x2 - x0) - theta_0) ** 2 / 2
''',
    "barrier": '''
@energy(domain=lambda x0, x1, h: length(x1 - x0) < h, elsewhere="zero")
def barrier(x0: Point, x1: Point, *, k: Positive["N m^-1"], h: Positive["m"]):
    """Without bound as the points meet, nothing beyond h."""
    l = length(x1 - x0)
    return -k * (l - h) ** 2 * log(l / h)
''',
    "fibre": '''
@energy()
def fibre(x0: Point, x1: Point, *, k: Positive["J"], a: Positive["1"], L: Positive["m"]):
    """Stiffens exponentially."""
    e = length(x1 - x0) / L - 1
    return k * (exp(a * e ** 2) - 1)
''',
}  # fmt: skip


KINDS["signed"] = '''
@energy
def signed(x0: Point, x1: Point, x2: Point, x3: Point, *, k: Positive["N m"]):
    """The same, with a sign."""
    e = x1 - x0
    n1, n2 = cross(e, x2 - x0), cross(x3 - x0, e)
    return k * atan2(dot(cross(n1, n2), e) / length(e), dot(n1, n2)) ** 2 / 2
'''
KINDS["fan"] = """
@energy
def fan(x0: Point, x1: Point, x2: Point, x3: Point, *, k: Positive["N m"], a: Real["rad"]):
    return k / 2 * ((angle(x1 - x0, x2 - x0) - a) ** 2 + angle(x2 - x0, x3 - x0) ** 2)  # x1 and x3 do not feel each other
"""
KINDS["green"] = """
@energy(domain=lambda u0, u1: u1 > u0)
def green(x0: Point, x1: Point, u0: Sliding, u1: Sliding, *, k: Positive["N"]):
    l, du = length(x1 - x0), u1 - u0
    return k * (l**2 - du**2) ** 2 / du**3
"""
KINDS["strain"] = """
@energy()
def strain(u0: Sliding, u1: Sliding, *, k: Positive["N"], L: Positive["m"]):
    return k * L * log((u1 - u0) / L) ** 2
"""


# well away from states where an angle is 0 or pi, so that plain formulas lose few digits
SHAPED = {"x0": (0, 0, 0), "x1": (1, 0, 0), "x2": (0.3, 1, 0), "x3": (0.3, -0.4, 0.9), "u0": (0.5,), "u1": (1.5,)}


@pytest.fixture(scope="module")
def kinds(place: Path) -> Path:
    folder = place / "kinds"
    folder.mkdir()
    for name, text in KINDS.items():
        (folder / f"{name}.py").write_text(HEAD + text, encoding="utf-8")
    generate_kernels(False, of=project(folder))
    return folder


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("variant", ["accurate", "fast"])
def test_kernels_of_any_energy_agree_with_ball_arithmetic(kinds: Path, name: str, variant: str) -> None:
    energy = next(e for e in load_declarations(kinds).energies if e.name == name)
    draw = np.random.default_rng(3)
    base = np.concatenate([SHAPED[unknown.label] for unknown in energy.unknowns])
    q = base[:, None] + draw.uniform(-0.15, 0.15, (len(base), 8))
    values = {p.label: draw.uniform(1.6, 2.0, 8) for p in energy.parameters}
    exact = truth(energy, Points(q, values))
    assert exact.has_derivatives.all()
    found = kernel(variant, name, kinds).evaluate(q, **values)
    for part, true in zip(found, (exact.energy, exact.gradient, exact.hessian), strict=True):
        flat, flat_true = part.reshape(-1, 8), true.reshape(-1, 8)
        assert (np.abs(flat - flat_true).max(axis=0) <= 1e-11 * np.abs(flat_true).max(axis=0)).all()


def test_what_an_energy_promises_is_what_it_can_keep(kinds: Path) -> None:
    promises = {name: kernel("accurate", name, kinds).KERNEL.promise for name in KINDS}
    expected = {"hinge": "none", "spring": "units", "torsion": "condition", "barrier": "none", "fibre": "condition"}
    expected |= {"green": "units", "signed": "none", "strain": "condition", "fan": "none"}
    assert promises == expected


@pytest.mark.parametrize("regime", ["moderate", "ratios", "sliding", "scales"])
def test_a_difference_of_coordinates_is_not_opened_in_a_power(kinds: Path, regime: str) -> None:
    """``3 l^2 + (u1 - u0)^2`` has no digit left where the square is opened and the coordinates are far from 0."""
    unit = Unit("green", "float64", regime, ("accurate", "fast"), 60, 1, False, str(kinds))
    for cell in run_unit(unit)["cells"]:
        assert [found["of_target"] <= 1 for found in cell["outputs"].values()] == [True] * 3


def test_a_contact_acts_only_within_its_distance(kinds: Path) -> None:
    barrier = kernel("accurate", "barrier", kinds)
    q = np.array([[0.0, 0, 0, 2, 0, 0], [0.0, 0, 0, 1, 0, 0], [0.0, 0, 0, 1e-8, 0, 0]]).T
    e = barrier.energy(q, k=1.0, h=1.5)
    assert e[0] == 0 < e[1] < e[2] and e[1] == pytest.approx(0.25 * np.log(1.5), rel=1e-15)
    with pytest.raises(ValueError, match="length zero"):
        barrier.energy(np.zeros((6, 1)), k=1.0, h=1.5)


def test_what_a_logarithm_cannot_be_taken_of_is_named(kinds: Path) -> None:
    strain = kernel("accurate", "strain", kinds)
    with pytest.raises(
        ValueError, match=r"element 0: the logarithm of \(u1 - u0\) / L is taken, which is not positive"
    ):
        strain.gradient(np.array([[1.0], [0.5]]), k=1.0, L=1.0)


def test_what_has_no_kernel_is_told_with_its_reason(kinds: Path) -> None:
    notes = generate_kernels(True, of=project(kinds)).lines
    assert "barrier: no variant in twice the digits: its numbers have no log" in notes
    assert not (kinds / "kernels" / "reference" / "barrier.py").exists()


def test_plain_differentiation_says_so_in_its_derivation(kinds: Path, run: Any) -> None:
    status, out, _ = run("derive", "kinds/hinge")
    assert status == 0 and "not a law of known measures" in out and "Proof: none of plain differentiation" in out
    status, out, _ = run("derive", "kinds/barrier.py")
    assert status == 0 and "ln" not in out and "log (l1 / h)" in out and "Proved exactly" in out


def test_code_is_checked_against_an_energy_of_ones_own(started: Path, run: Any) -> None:
    code = "def spring(x0, x1, k, L):\n    d = x1 - x0\n    l = (d @ d) ** 0.5\n    return {} * k * (l - L) / l * d\n"
    for sign, status in (("-1", 0), ("1", 1)):
        (started.parent / "mine.py").write_text(code.format(sign), encoding="utf-8")
        arguments = ("mine.py", "--energy", "my_model/spring", "--returns", "x1", "--force", "--count", "2")
        assert run("check", *arguments)[0] == status
    status, _, err = run("export", "my_model/sprong", "--out", "golden")
    assert status == 2 and "sprong: no such energy; there are spring" in err


# -- a second document ------------------------------------------------------------------------------------------------


def test_the_mistake_in_the_second_document_is_found_and_mended(place: Path, folder: Path, run: Any) -> None:
    shutil.copytree(folder / "rod", place / "rod", ignore=shutil.ignore_patterns("kernels", "reports"))
    status, out, _ = run("prove", "rod")
    assert status == 0 and "22 claims in 13 of 17 numbered equations: 21 proved, 1 refuted." in out
    assert r"change     sign of \mathbf{P}_2 \mathbf{d}_1 \mathbf{d}_2^T" in out and "Accepted errata: (13)." in out
    (place / "rod" / "errata.toml").unlink()
    status, out, _ = run("prove", "rod")
    assert status == 1 and "NEW, not in errata.toml: (13)." in out


# -- folders ----------------------------------------------------------------------------------------------------------


def test_the_package_is_a_project_like_any_other(folder: Path) -> None:
    mine = project()
    assert project(folder) == mine and not mine.own and mine.document == "cirio2014.md"
    assert find(None) == (mine, None) and find("bending") == (mine, "bending")


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("nowhere/spring", "nowhere: no such folder; a new one is made by: yarnverify init nowhere"),
        ("empty/spring", "has no energy (*.py) and no document"),
        ("two", "two: has 2 documents, a.md and b.md; give each a folder of its own"),
        ("lost", "its energies name the document c.md, which is not there"),
        ("my_model/my_model.md/x", "is a file; give the folder that it is in, my_model"),
    ],
)
def test_a_folder_that_is_none_is_told(place: Path, started: Path, run: Any, target: str, words: str) -> None:
    (place / "empty").mkdir(exist_ok=True)
    for name, files in {"two": {"a.md": "$$V = k \\quad (1)$$", "b.md": "$$V = k \\quad (1)$$"}, "lost": {
        "e.py": '@energy(document="c.md")\n'
    }}.items():  # fmt: skip
        (place / name).mkdir(exist_ok=True)
        for file, text in files.items():
            (place / name / file).write_text(text, encoding="utf-8")
    status, out, err = run("accuracy", target)
    assert (status, out) == (2, "") and words in err and err.count("\n") == 1


def test_a_folder_without_a_document_has_nothing_to_prove(kinds: Path, run: Any) -> None:
    status, _, err = run("prove", "kinds")
    assert (
        status == 2 and "has no document with numbered formulas to prove; its energies: yarnverify report kinds" in err
    )
    status, _, err = run("derive", "kinds/sprong")
    assert status == 2 and "no energy 'sprong' is declared in kinds; there are: barrier, fan, fibre" in err


# -- mistakes ---------------------------------------------------------------------------------------------------------


def declared(formula: str, options: str = "", was: str = "", now: str = "") -> str:
    """An energy with a formula and options, and a part of its first line changed."""
    line = 'def e(x0: Point, x1: Point, *, k: Positive["N/m"], L: Positive["m"]):'
    return f"@energy({options})\n{line.replace(was, now, 1) if was else line}\n    return {formula}\n"


MISTAKES = {  # text after the import in line 1, line and column, words
    "no quotation marks": (declared("k", was='"m"', now="m"), "3:1", "name 'm' is not defined"),
    "unknown unit": (declared("k", was="N/m", now="lbf"), "3:32", "unknown unit 'lbf'; known are 1, rad, kg"),
    "wrong dimension": (declared("k * length(x1 - x0)"), "4:12", "in kg m s^-2, and J is kg m^2 s^-2"),
    "metres and numbers": (declared("k * (length(x1 - x0) - 1) ** 2"), "4:12", "no sum of these"),
    "unknown function": (declared("k * lenght(x1 - x0) ** 2"), "4:16", "did you mean length?"),
    "another library": ("import math\n" + declared("k * math.sqrt(L)"), "5:16", "use the functions of yarnverify"),
    "no return": (declared("k").replace("return ", ""), "3:1", "is the word return missing?"),
    "vector": (declared("k * (x1 - x0)"), "4:12", "an energy is a scalar, and this is a vector"),
    "sum of shapes": (declared("k * L**2 + x1"), "4:12", "cannot add a vector to a scalar"),
    "unknown behind the star": (declared("k", was="x1: Point, *,", now="*, x1: Point,"), "3:21", "goes before the *"),
    "parameter before the star": (declared("k", was="*, k", now="k"), "3:29", "goes behind the *"),
    "two names of one symbol": (declared("k", was="x1: P", now="x_0: P"), "3:18", "'x_0' and 'x0' are one symbol"),
    "a name of derivations": (declared("k", was="L: ", now="l_1: "), "3:52", "'l_1' is taken: derivations"),
    "a name of kernels": (declared("k", was="L: ", now="out: "), "3:52", "'out' is taken: every kernel"),
    "rest of nothing": (declared("k * L**2", "rest={'x7': 1}"), "2:9", "no use for 'x7'"),
    "rest of one number": (declared("k * L**2", "rest={'x0': 1}"), "2:9", "'x0' takes three numbers"),
    "no such motion": (declared("k * L**2", "unchanged='rotation'"), "2:9", "takes a tuple of"),
    "zero everywhere": (declared("k * L**2", "elsewhere='zero'"), "2:9", "a domain of one inequality"),
    "no such symbol": (declared("k * L**2", "domain=lambda z: z > 0"), "2:9", "there are x0, x1, k, L"),
    "no inequality": (declared("k * L**2", "domain=lambda L: L"), "2:9", "gives an inequality such as"),
    "pi in small letters": (declared("k * L**2 * pi"), "4:23", "did you mean PI?"),
    "a component": (declared("k * L * x0.z"), "4:20", "a component of a point is dot(x0, e), with"),
    "abs": (declared("k * L * abs(dot(x0, x1))"), "4:20", "length(a) is the size of a number too"),
    "a branch": (declared("k * max(length(x1 - x0) - L, 0) ** 2"), "4:16", 'elsewhere="zero"): where it acts'),
    "a decimal number": (declared("0.15 * k * L**2"), "4:12", "write 3 * k / 20 for 0.15 * k, or Fraction(3, 20) of"),
    "pi in digits": ("import math\n" + declared("math.pi * k * L**2"), "5:12", "whose numbers are exact: write PI"),
    "many digits": (declared("0.12345678 * k"), "4:12", 'write Fraction("0.12345678") of the module fractions'),
    "another library's name": (declared("k * acos(dot(x0, x1) / L**2)"), "4:16", "here it is arccos"),
    "a half power": (declared("k / L * length(x1 - x0) ** 2.5"), "4:20", "not 2.5; write sqrt(...) ** 5"),
    "a closed domain": (declared("k * L", "domain=lambda k, L: k * L >= 1"), "2:29", "write > for >="),
    "a logarithm of a length": (
        declared("k * L**2 * log(L)"),
        "4:12",
        "log of what is in m; it takes a plain number, such as a ratio",
    ),
    "a root as a power": (declared("k * L**0.5"), "4:16", "an exponent must be an integer, not 0.5; write sqrt(...)"),
    "a power of a formula": (declared("2**k"), "4:12", "whole powers, no **; other powers are exp(p * log(a))"),
    "a remainder": (declared("k % 2"), "4:12", "a formula has + - * / and whole powers, no %"),
    "an index": (declared("k * L * x0[2]"), "4:20", "a formula is not a list; a component of a point is dot(x0, e)"),
    "a method": (declared("k * x0.norm()"), "4:16", "a formula has no .norm; use the functions angle, "),
    "a missing star": (declared("k(L)"), "4:12", "a formula is not a function; is a * missing?"),
    "NumPy": ("import numpy as np\n" + declared("np.sqrt(k)"), "5:12", "NumPy computes with numbers, and a formula is"),
    "a constant vector": (
        declared("dot(x0, [0, 0, 1])"),
        "4:12",
        'no constant vectors: make it a parameter e: Vector["1"]',
    ),
    "a length of a number": (declared("length(0.5)"), "4:12", "0.5 cannot stand in a formula"),
    "another error": (declared("{}['k']"), "4:12", "KeyError: 'k'"),
    "no unknown": ('@energy()\ndef e(*, k: Positive["J"]):\n    return k\n', "3:1", "has no unknown"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_an_energy_is_one_line_at_its_place(tmp_path: Path, run: Any, mistake: str) -> None:
    text, where, words = MISTAKES[mistake]
    (tmp_path / "e.py").write_text(HEAD + text, encoding="utf-8")
    status, out, err = run("report", str(tmp_path))
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"{tmp_path / 'e.py'}:{where}: ") and words in err
    assert "TypeError" not in err and "Expr" not in err  # a message of ours, not of Python's insides


@pytest.mark.parametrize(
    ("text", "where", "words"),
    [
        ("[[erratum]]\ndocument = 'm.md'\n", "1:1", "erratum 1 needs a text for 'equation'"),
        ("x = \n", "1:5", "Invalid value"),
        ("\n[[erratum]]\ndocument = 'm.md'\nequation = '3'\n", "2:1", "for 'change' as yarnverify prove proposes it"),
    ],
)
def test_a_mistake_in_the_errata_is_one_line_at_its_place(
    tmp_path: Path, run: Any, text: str, where: str, words: str
) -> None:
    init(tmp_path / "m")
    (tmp_path / "m" / "errata.toml").write_text(text, encoding="utf-8")
    status, _, err = run("prove", str(tmp_path / "m"))
    assert status == 2 and err.startswith(f"{tmp_path / 'm' / 'errata.toml'}:{where}: ") and words in err


def test_an_invariance_that_does_not_hold_is_told(tmp_path: Path, run: Any) -> None:
    text = declared("k * square(x0 - x1) + k * square(x0)", "unchanged=('translation',)")
    (tmp_path / "e.py").write_text(HEAD + text, encoding="utf-8")
    status, _, err = run("generate", str(tmp_path))
    assert status == 2 and f"{tmp_path / 'e.py'}:2:9: e: invariance under translation is refuted" in err


def test_a_section_that_is_not_there_is_told(place: Path, tmp_path: Path, run: Any) -> None:
    init(tmp_path / "m")
    path = tmp_path / "m" / "spring.py"
    path.write_text(path.read_text(encoding="utf-8").replace('"Spring"', '"Sprung"'), encoding="utf-8")
    status, _, err = run("prove", str(tmp_path / "m"))
    assert status == 2 and "spring.py:8:5: spring: " in err and "has no section 'Sprung'; there are 'Spring'" in err


def test_a_chain_of_inequalities_in_python_is_refused_with_advice(tmp_path: Path) -> None:
    text = declared("k * L**2", "domain=lambda k, L: 1 > k > L")
    (tmp_path / "e.py").write_text(HEAD + text, encoding="utf-8")
    with pytest.raises(InputError, match=r"e\.py:2:.*write a chain such as a > b > c.*as a list"):
        load_declarations(tmp_path)


def test_kernels_of_ones_own_are_imported_like_any_module(kinds: Path) -> None:
    with importing_from(kinds.parent):
        spring = importlib.import_module("kinds.kernels.spring")
        assert spring.VARIANT == "accurate"
    assert "kinds.kernels.spring" not in sys.modules
    assert spring.energy(np.array([[0.0, 0, 0, 2, 0, 0]]).T, k=2.0, L=1.0)[0] == 1.0
    code = "import kinds.kernels.spring, sys; print('sympy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=kinds.parent, capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
