"""The command line: exit status, the one line of an error, JSON, and what is imported when."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from tests.commands import caller
from yarnverify import __version__
from yarnverify.errors import NotRunError
from yarnverify.library import MAIN_DOCUMENT

DOCUMENT = r"""## Spring

$$V = \frac{1}{2} k u_1^2 \quad (1)$$

$$F_{u_1} = -k u_1 \quad (2)$$

$$\frac{\partial F_{u_1}}{\partial u_1} = -k \quad (3)$$
"""
SPRING = """from yarnverify.symbolic.declare import *
@energy(document="d.md", section="Spring")
def spring(u1: Sliding, *, k: Positive["N/m"]):
    return k * u1**2 / 2
"""
ERRATUM = '[[erratum]]\ndocument = "d.md"\nequation = "2"\nchange = "none"\nreason = "slip"\n'


# it suspects that a test forgot to say what to parse; these set sys.argv, as the installed command finds it
pytestmark = pytest.mark.filterwarnings("ignore:Cyclopts application invoked without tokens")


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small folder of derivations that is the working directory, with a cache of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "d.md").write_text(DOCUMENT, encoding="utf-8")
    (tmp_path / "spring.py").write_text(SPRING, encoding="utf-8")
    return tmp_path


@pytest.fixture
def run(home: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run the command with arguments: exit status, standard output, standard error."""
    return caller(monkeypatch, capsys)


def one_line(err: str) -> str:
    assert err.endswith("\n") and err.count("\n") == 1 and "Traceback" not in err
    return err.removesuffix("\n")


# -- prove ------------------------------------------------------------------------------------------------------------


def test_a_right_document_is_status_0(run: Any) -> None:
    status, out, err = run("prove", "d.md")
    assert (status, err) == (0, "")
    assert "3 claims in 3 of 3 numbered equations: 3 proved, 0 refuted." in out
    assert out.count("PROVED") == 3 and "\x1b" not in out


def test_a_wrong_equation_is_status_1_and_printed_with_its_correction(home: Path, run: Any) -> None:
    (home / "d.md").write_text(DOCUMENT.replace("= -k u_1", "= k u_1"), encoding="utf-8")
    status, out, err = run("prove", "d.md")
    assert (status, err) == (1, "")
    for words in (
        "(2) F_u1: REFUTED",
        "printed    F_{u_1} = k u_1",
        "corrected  F_{u_1} = -k u_1",
        "witness",
        "NEW, not in errata.toml: (2).",
    ):
        assert words in out


def test_an_accepted_erratum_is_status_0_and_a_stale_one_status_1(home: Path, run: Any) -> None:
    (home / "d.md").write_text(DOCUMENT.replace("= -k u_1", "= k u_1"), encoding="utf-8")
    run("prove", "d.md", "--json", "r.json")
    (change,) = [c["change"] for c in json.loads(Path("r.json").read_text(encoding="utf-8"))["claims"] if c["change"]]
    (home / "errata.toml").write_text(ERRATUM.replace("none", change), encoding="utf-8")
    status, out, _ = run("prove", "d.md")
    assert status == 0 and "accepted: slip" in out and "Accepted errata: (2)." in out
    (home / "d.md").write_text(DOCUMENT, encoding="utf-8")
    status, out, _ = run("prove", "d.md")
    assert status == 1 and "STALE in errata.toml: (2)." in out


def test_a_block_that_is_not_listed_is_status_1(home: Path, run: Any) -> None:
    (home / "d.md").write_text(DOCUMENT.rpartition("$$\\frac")[0], encoding="utf-8")
    status, out, _ = run("prove", "d.md")
    assert status == 1 and r"does not list \frac{\partial F_{u_1}}{\partial u_1}, which is not zero" in out


def test_an_undefined_symbol_is_a_finding_on_its_equation_alone(home: Path, run: Any) -> None:
    (home / "d.md").write_text(DOCUMENT.replace("= -k u_1", "= -q u_1"), encoding="utf-8")
    status, out, _ = run("prove", "d.md")
    assert status == 1 and "undefined symbol q" in out and "corrected  F_{u_1} = -k u_1" in out
    assert "2 proved, 1 refuted" in out


def test_a_document_without_declared_energies_is_judged_by_itself(run: Any) -> None:
    status, out, _ = run("prove", "d.md", "--derivations", "none")
    assert status == 0 and "Taken as given" in out and "V (1)" in out


KEYS = {"equation", "block", "verdict", "line", "column", "correction", "witness"}


@pytest.mark.parametrize("args", [("--json", "-"), ("--json=-",), ("--json", "r.json")])
def test_the_record_as_json(home: Path, run: Any, args: tuple[str, ...]) -> None:
    (home / "d.md").write_text(DOCUMENT.replace("= -k u_1", "= k u_1"), encoding="utf-8")
    status, out, _ = run("prove", "d.md", *args)
    record = json.loads(out if args[-1].endswith("-") else (home / args[-1]).read_text(encoding="utf-8"))
    assert status == 1 and (record["schema"], record["document"]) == (1, "d.md")
    assert all(set(claim) >= KEYS for claim in record["claims"])
    found = [
        (c["equation"], c["block"], c["verdict"], c["line"], c["column"], c["correction"]) for c in record["claims"]
    ]
    assert found == [
        ("1", "V", "proved", 3, 1, None),
        ("2", "F_u1", "refuted", 5, 1, "F_{u_1} = -k u_1"),
        ("3", "dF_u1/du1", "proved", 7, 1, None),
    ]
    witness = record["claims"][1]["witness"]
    assert {"point", "hex", "printed", "true", "residual"} <= set(witness) and set(witness["point"]) == {"u1", "k"}
    for name, text in witness["point"].items():
        above, _, below = text.partition("/")
        assert float.fromhex(witness["hex"][name]) * int(below or 1) == int(above)
    assert record["claims"][0]["witness"] is None


@pytest.mark.parametrize("target", [".", "no/such/folder/r.json"])
def test_a_record_that_cannot_be_written_is_status_2(run: Any, target: str) -> None:
    status, _, err = run("prove", "d.md", "--json", target)
    assert status == 2 and "cannot write" in one_line(err) and target in err


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("", "d.md:1:1: the document is empty"),
        (b"a\n\0", "d.md:2:1: not a text file"),
        (b"\xef\xbb\xbf\n\xff", "d.md:2:1: not a text file"),
        (DOCUMENT.replace("(2)", "(1)"), "d.md:5:26: equation number (1) is used twice"),
        (DOCUMENT.replace("-k u_1", "-k \\oops"), "d.md:5:16: unknown LaTeX command \\oops"),
        (DOCUMENT.replace("-k u_1", "\\mathbf{x}_1 + u_1"), "d.md:5:28: equation (2): cannot add a scalar to a vector"),
        (DOCUMENT.replace("-k u_1", "{-k u_1"), "d.md:5:13: unbalanced braces"),
        (DOCUMENT.replace("V =", "E ="), "d.md:1:1: section 'Spring' has no energy"),
        (DOCUMENT.replace("k u_1^2", "\\theta") + "\n$\\theta = \\phi$ and $\\phi = \\theta$", "d.md:9:"),
        (DOCUMENT.replace("-k u_1", "(" * 3000 + "k" + ")" * 3000), "d.md:5:"),
    ],
)  # fmt: skip
def test_bad_input_is_status_2_and_one_line(home: Path, run: Any, data: str | bytes, message: str) -> None:
    (home / "d.md").write_bytes(data if isinstance(data, bytes) else data.encode())
    status, out, err = run("prove", "d.md")
    assert (status, out) == (2, "") and one_line(err).startswith(message)


@pytest.mark.parametrize(
    ("file", "data", "message"),
    [
        ("spring.py", SPRING + "x = 0.5 +\n", "spring.py:5:"),
        (
            "spring.py",
            SPRING.replace("/ 2", "* 0.5"),
            "spring.py:4:12: 0.5 cannot stand in a formula, whose numbers are exact: write k / 2 ",
        ),
        ("spring.py", SPRING.replace('"d.md"', '"d.md", domain="u_1 >"'), "spring.py:2:"),
        ("errata.toml", "erratum = 3\n", "errata.toml"),
        ("errata.toml", ERRATUM.replace('"slip"', '""'), "errata.toml"),
    ],
)
def test_bad_declarations_and_errata_are_status_2_and_one_line(
    home: Path, run: Any, file: str, data: str, message: str
) -> None:
    (home / file).write_text(data, encoding="utf-8")
    status, out, err = run("prove", "d.md")
    assert (status, out) == (2, "") and one_line(err).startswith(message)


@pytest.mark.parametrize(
    "args",
    [
        ("prove", "none.md"),
        ("prove", "empty"),
        ("prove", "d.md", "more"),
        ("prove", "d.md", "--nonsense"),
        ("prove", "d.md", "--json"),
        ("prove", "d.md", "--derivations", "no/such/folder"),
        ("nonsense",),
        ("derive", "nonsense"),
        ("derive", "spring", "--format", "nonsense"),
        ("derive",),
    ],
)
def test_bad_usage_is_status_2_and_one_line(run: Any, args: tuple[str, ...]) -> None:
    status, out, err = run(*args)
    assert (status, out) == (2, "") and one_line(err)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("check", "m.py", "--with", "R=d/4", "Y=k_s", "B=1"), "write --with before each: --with Y=k_s --with B=1"),
        (("prove", "d.md", "more"), "nothing takes more: an option takes the one value right behind it"),
    ],
)
def test_words_that_no_option_takes(run: Any, args: tuple[str, ...], words: str) -> None:
    status, _, err = run(*args)
    assert status == 2 and err.strip() == f"yarnverify: {words}"


@pytest.mark.parametrize(("error", "status"), [(NotRunError("no viewer here"), 3), (KeyboardInterrupt(), 130)])
def test_what_could_not_run_has_a_status_of_its_own(
    run: Any, monkeypatch: pytest.MonkeyPatch, error: BaseException, status: int
) -> None:
    def fail(*args: Any) -> None:
        raise error

    monkeypatch.setattr("yarnverify.verdicts.verdicts", fail)
    found, _, err = run("prove", "d.md")
    assert found == status and str(error) in err and "Traceback" not in err


@pytest.mark.parametrize(("flag", "words"), [("--version", __version__), ("--help", "prove"), ("-h", "prove")])
def test_help_and_version(run: Any, flag: str, words: str) -> None:
    status, out, _ = run(flag)
    assert status == 0 and words in out


# -- the main document ------------------------------------------------------------------------------------------------


def test_the_main_document_is_as_expected(run: Any, monkeypatch: pytest.MonkeyPatch, record: dict[str, Any]) -> None:
    monkeypatch.setattr("yarnverify.symbolic.record.prove_source", lambda source, shelf, advance: deepcopy(record))
    status, out, _ = run("prove")
    assert status == 0 and "79 claims in 44 of 44 numbered equations: 73 proved, 6 refuted." in out
    assert "Accepted errata: (8), (18), (21)." in out


def test_a_changed_copy_of_the_main_document_is_status_1(home: Path, run: Any, folder: Path) -> None:
    """The paper's stretch section alone, its accepted mistake mended and another made."""
    text = (folder / MAIN_DOCUMENT).read_text(encoding="utf-8").partition("## Bending")[0]
    text = text.replace(r"\frac{k}", r"\frac{k_s}").replace(r"\frac{1}{2} k_s (\|", r"\frac{1}{3} k_s (\|")
    (home / "copy.txt").write_text(text, encoding="utf-8")
    status, out, _ = run("prove", "copy.txt")
    assert status == 1
    assert "NEW, not in errata.toml: (7)." in out and "STALE in errata.toml: (8).\n" in out


@pytest.mark.parametrize(
    ("equation", "right", "wrong"),
    [
        ("1", r"l_i = \|\mathbf{x}_i -", r"l_i = \|\mathbf{x}_i +"),
        ("2", r"\mathbf{d}_i = \frac{\mathbf{x}_i -", r"\mathbf{d}_i = \frac{\mathbf{x}_i +"),
        ("3", r"\mathbf{w}_i = \frac{\mathbf{x}_i -", r"\mathbf{w}_i = \frac{\mathbf{x}_i +"),
        ("4", r"\mathbf{P}_i = \mathbf{I} -", r"\mathbf{P}_i = \mathbf{I} +"),
    ],
)
def test_a_wrong_definition_for_all_sections_is_status_1(
    home: Path, run: Any, folder: Path, equation: str, right: str, wrong: str
) -> None:
    text = (folder / MAIN_DOCUMENT).read_text(encoding="utf-8").partition("## Bending")[0]
    (home / "copy.txt").write_text(text.replace(right, wrong), encoding="utf-8")
    status, out, err = run("prove", "copy.txt")
    assert (status, err) == (1, "") and f"NEW, not in errata.toml: ({equation})" in out


# -- as a program of its own ------------------------------------------------------------------------------------------


def program(*args: str, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *args], capture_output=True, text=True, encoding="utf-8", timeout=60, check=False, **options
    )


HEAVY = {"sympy", "numpy", "lark", "flint", "rich.progress"}
LAZY = f"import sys; {{}}; print([m for m in {sorted(HEAVY)} if m in sys.modules], file=sys.stderr)"


@pytest.mark.parametrize(
    "what",
    [
        "import yarnverify",
        "import yarnverify.cli",
        "import yarnverify.cli as c; sys.argv = ['yarnverify', '--help']\ntry: c.main()\nexcept SystemExit: pass\npass",
    ],
)
def test_heavy_imports_are_left_to_the_commands(what: str) -> None:
    done = program("-c", LAZY.format(what))
    assert (done.returncode, done.stderr) == (0, "[]\n")


def test_as_a_module_bad_input_leaves_no_traceback(home: Path) -> None:
    (home / "d.md").write_text("$$a", encoding="utf-8")
    done = program("-m", "yarnverify", "prove", "d.md", cwd=home)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "d.md:1:1: display opened by $$ is never closed\n")


def test_a_reader_that_leaves_early_causes_no_noise(home: Path) -> None:
    """As in `yarnverify prove | head -0`: the pipe is closed before anything is written."""
    read_end, write_end = os.pipe()
    os.close(read_end)
    with os.fdopen(write_end, "w") as pipe:
        done = subprocess.run(
            [sys.executable, "-m", "yarnverify", "prove", "d.md"],
            stdout=pipe,
            stderr=subprocess.PIPE,
            cwd=home,
            check=False,
        )
    assert done.stderr == b"" and done.returncode in (0, 141)


def test_a_narrow_encoding_of_the_output_is_no_traceback(home: Path) -> None:
    (home / "é.md").write_text(DOCUMENT.replace("Spring", "Sprïng"), encoding="utf-8")
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = program("-m", "yarnverify", "prove", "é.md", "--derivations", "none", "--json=-", cwd=home, env=environment)
    assert done.returncode == 0 and json.loads(done.stdout)["claims"][0]["section"] == "Sprïng"


def test_an_interruption_while_a_library_is_loaded_is_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Extension modules turn it into an ImportError; any other ImportError is one."""
    from yarnverify import cli

    def loading(cause: BaseException) -> Any:
        def app(*_: Any, **__: Any) -> None:
            raise ImportError("initialization failed") from cause

        return app

    monkeypatch.setattr(cli, "app", loading(KeyboardInterrupt()))
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 130
    monkeypatch.setattr(cli, "app", loading(ValueError()))
    with pytest.raises(ImportError):
        cli.main()
