"""Every example of the README: commands are understood, files do what is said of them, notebook cells show something."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from yarnverify import cli, notebook
from yarnverify.accuracy.cells import kernel
from yarnverify.generation import generate_kernels
from yarnverify.init import init
from yarnverify.project import project
from yarnverify.symbolic.loading import load_declarations

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
COMMANDS = sorted(
    {
        line.partition(" #")[0].strip()
        for block in re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
        for line in block.splitlines()
        if line.startswith("yarnverify ")
    }
    | {text for text in re.findall(r"`(yarnverify [^`]+)`", README) if "." not in text.split()[1]}
)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_readme_is_understood(command: str) -> None:
    tokens = shlex.split(command)[1:]
    _, bound, ignored = cli.app.parse_args(tokens, exit_on_error=False, print_error=False)[:3]
    assert bound is not None and not ignored


def test_there_are_many_commands() -> None:
    assert len(COMMANDS) > 20


def file_of_the_readme(name: str) -> str:
    found = re.search(rf"<!-- {re.escape(name)} -->\n```python\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found[1]


def test_the_energy_of_the_readme_works(tmp_path: Path) -> None:
    init(tmp_path / "my_model")
    (tmp_path / "my_model" / "spring.py").unlink()
    (tmp_path / "my_model" / "my_model.md").unlink()
    path = tmp_path / "my_model" / "barrier.py"
    path.write_text(file_of_the_readme("my_model/barrier.py"), encoding="utf-8")
    generate_kernels(False, cache=False, of=project(tmp_path / "my_model"))
    barrier = kernel("accurate", "barrier", tmp_path / "my_model")
    assert barrier.energy([[0.0], [0], [0], [1], [0], [0]], k=1.0, h=0.5)[0] == 0


def test_the_mistake_of_the_readme_is_told_as_quoted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("my_model").mkdir()
    text = file_of_the_readme("my_model/barrier.py").replace("(l - h) ** 2", "(l - h)")
    Path("my_model/barrier.py").write_text(text, encoding="utf-8")
    with pytest.raises(Exception, match="kg m") as error:
        load_declarations(Path("my_model"))
    assert f"```\n{error.value}\n```" in README


# -- notebooks --------------------------------------------------------------------------------------------------------


def test_three_cells_reach_a_picture(record: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("yarnverify.verdicts.verdicts", lambda document, cache: (record, "known"))
    first, *cells = file_of_the_readme("three cells").rstrip().split("\n\n")
    assert first == "%pip install 'yarnverify[view]'"
    names: dict[str, Any] = {}
    shown = []
    for cell in cells:
        *lines, last = cell.replace("size=10", "size=4").splitlines()
        exec("\n".join(lines), names)
        shown.append(eval(last, names))
    equation, scene = shown
    assert equation.verdict == "refuted" and 'class="was"' in equation._repr_html_()
    assert scene.png.startswith(b"\x89PNG") and scene._repr_png_() == scene.png
    assert "data:image/png;base64," in scene._repr_html_() and "Every error and every order as expected." in repr(scene)


def test_without_anything_that_draws_it_is_said_what_to_install() -> None:
    """In a process of its own: a package that is imported anew has lost the parts that others hold of it."""
    code = "import sys; sys.modules |= dict.fromkeys(['matplotlib', 'pyvista'])\n"
    code += "from yarnverify import notebook; notebook.simulate('hanging_yarn', size=2)"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert ended.stderr.splitlines()[-1].endswith("needs matplotlib: pip install 'yarnverify[view]'")
    assert "NotRunError" in ended.stderr


def test_verdicts_show_themselves(record: dict[str, Any]) -> None:
    from yarnverify.library import MAIN_DOCUMENT, Shelf
    from yarnverify.verdicts import settle

    settle(record, Shelf(None, MAIN_DOCUMENT, ""), ())
    found = notebook.Verdicts(record)
    page = found._repr_html_()
    assert page.count("<tr>") == len(found.equations) >= 40 and "REFUTED" in page and "http" not in page
    assert "79 claims in 44 of 44" in repr(found) and repr(found[18]) == "(18) dF_x1/dx1: REFUTED"
    assert found["12"]._repr_latex_().startswith(r"$\displaystyle \theta = \arccos") and found["12"].verdict == "proved"
    with pytest.raises(KeyError, match=r"no equation \(99\) claims anything; there are 1, 2"):
        found["99"]


def test_a_derivation_shows_itself(declarations: Any) -> None:
    found = notebook.derive("stretch")
    page = found._repr_html_()
    assert "<math" in page and "Chain rule" in page and "Proved exactly" in page and r"\frac" in found._repr_latex_()
    assert "∂V/∂q" in repr(found)
    energy = next(e for e in declarations.energies if e.name == "parallel_contact")
    assert energy._repr_latex_() == r"$\displaystyle V = \frac{k_c L \left( u_1 - u_0 - d \right)^2}{2}$"
    assert energy.expression._repr_latex_() in energy._repr_latex_().replace("V = ", "")


# -- the reference page -----------------------------------------------------------------------------------------------


def test_the_reference_holds_what_can_be_imported() -> None:
    import importlib

    from yarnverify.reference import reference

    found = reference()["modules"]
    assert len(found) >= 9
    for module in found:
        there = importlib.import_module(module["name"])
        assert module["entries"], module["name"]
        for entry in module["entries"]:
            assert hasattr(there, entry["name"]), (module["name"], entry["name"])
    page = (Path(__file__).parent.parent / "reports" / "reference.md").read_text(encoding="utf-8")
    assert "### barrier" not in page and "### energy\n" in page and "Raises\n------" in page
    anchors = {re.sub(r"[^\w\- ]", "", line[3:]).lower() for line in page.splitlines() if line.startswith("## ")}
    assert set(re.findall(r"\]\(#([^)]+)\)", page)) <= anchors
