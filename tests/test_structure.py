"""Who may import whom, and that the README tells the truth."""

from __future__ import annotations

import ast
import doctest
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from yarnverify.show import tally_lines

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "yarnverify"
README = (ROOT / "README.md").read_text(encoding="utf-8")


def imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return found


def outside(names: set[str], allowed: tuple[str, ...]) -> set[str]:
    """Imports that are neither allowed nor of the standard library."""
    return {n for n in names if n.split(".")[0] not in sys.stdlib_module_names and not n.startswith(allowed)}


RULES = [
    (
        "analysis",
        (
            "numpy",
            "scipy",
            "yarnverify.analysis",
            "yarnverify.errors",
            "yarnverify.files",
            "yarnverify.kernels",
            "yarnverify.simulation",
        ),
    ),
    ("kernels", ("numpy", "yarnverify.files", "yarnverify.kernels")),
    ("report", ("jinja2", "markupsafe", "latex2mathml", "matplotlib", "yarnverify.report")),
    (
        "simulation/view",
        (
            "numpy",
            "scipy",
            "matplotlib",
            "pyvista",
            "PIL",
            "imageio_ffmpeg",
            "yarnverify.errors",
            "yarnverify.files",
            "yarnverify.simulation",
        ),
    ),
]


@pytest.mark.parametrize(("folder", "allowed"), RULES)
def test_import_rules(folder: str, allowed: tuple[str, ...]) -> None:
    files = sorted((PACKAGE / folder).rglob("*.py"))
    assert files
    for path in files:
        assert not outside(imports(path), allowed), path


def test_sympy_lives_in_symbolic_and_nowhere_else() -> None:
    for path in sorted(PACKAGE.rglob("*.py")):
        # the truth of accuracy/ is ball arithmetic; it must not see the derivation that it judges
        # people who do without kernels start from SymPy, and so do some of the peers
        barred = () if "symbolic" in path.parts else ("sympy",) if "accuracy" in path.parts else ("sympy", "flint")
        barred = ("flint",) if "peers" in path.parts else barred
        assert not any(name.split(".")[0] in barred for name in imports(path)), path


def test_the_overview_of_symbolic_names_every_module() -> None:
    overview = (PACKAGE / "symbolic" / "__init__.py").read_text(encoding="utf-8")
    words = set(re.findall(r"\w+", overview))
    assert not {path.stem for path in (PACKAGE / "symbolic").glob("*.py")} - words - {"__init__"}


def test_the_truth_shares_no_code_with_the_derivation() -> None:
    first = (
        ".normal",
        ".reading",
        ".measures",
        ".laws",
        ".scalars",
        ".derive",
        ".court",
        ".prove",
        ".emit",
        ".steps",
        ".printing",
        ".programs",
        ".modules",
    )
    for path in sorted((PACKAGE / "accuracy").glob("*.py")):
        assert not any(found.endswith(first) or "sympy" in found for found in imports(path)), path


def test_the_second_reading_shares_no_code_with_the_first() -> None:
    first = (
        *(".polynomials", ".square_roots", ".roots", ".circles", ".slopes", ".normal", ".blocks", ".reading"),
        *(".measures", ".laws", ".scalars", ".derive", ".court", ".prove"),
    )
    second = ("algebraic", "numbers", "linear", "jets", "forward", "states", "signs", "evidence")
    for name in (f"{part}.py" for part in second):
        assert not any("sympy" in found or found.endswith(first) for found in imports(PACKAGE / "symbolic" / name))


def test_nothing_heavy_is_imported_for_help() -> None:
    code = (
        "import sys; from yarnverify.cli import app; import yarnverify.kernels.runtime\n"
        "print(sorted({'sympy', 'lark', 'flint', 'rich.table', 'jinja2', 'matplotlib', 'hypothesis'} & set(sys.modules)))"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.strip() == "[]"


def test_peers_and_pictures_are_imported_only_where_they_are_wanted() -> None:
    for path in sorted(PACKAGE.rglob("*.py")):
        allowed = {"peers": ("jax", "casadi", "numba"), "report": ("matplotlib",), "view": ("matplotlib",)}.get(
            path.parent.name, ()
        )
        for name in ("jax", "casadi", "numba", "matplotlib"):
            assert name in allowed or not any(found.split(".")[0] == name for found in imports(path)), path
    code = (
        "import sys; import yarnverify.benchmark.run, yarnverify.benchmark.show\n"
        "print(sorted({'jax', 'casadi', 'numba', 'sympy.printing.pycode', 'matplotlib'} & set(sys.modules)))"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.strip() == "[]"


def test_top_level_of_the_repository() -> None:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a git checkout")
    top = {name.split("/")[0] for name in listed.stdout.split() if not name.startswith(".")}
    assert top == {"LICENSE", "README.md", "derivations", "pyproject.toml", "reports", "tests", "yarnverify"}


def test_readme_examples_run() -> None:
    examples = "\n".join(re.findall(r"```python\n(.*?)```", README, re.DOTALL))
    test = doctest.DocTestParser().get_doctest(examples, {}, "README.md", "README.md", 0)
    runner = doctest.DocTestRunner(optionflags=doctest.IGNORE_EXCEPTION_DETAIL | doctest.ELLIPSIS)
    runner.run(test)
    assert runner.failures == 0 and runner.tries >= 6


def test_readme_quotes_what_prove_prints(record: dict[str, Any], folder: Path) -> None:
    from yarnverify.library import MAIN_DOCUMENT, Shelf, errata
    from yarnverify.verdicts import settle

    shelf = Shelf(folder, MAIN_DOCUMENT, "")
    settle(record, shelf, errata(shelf))
    quoted = re.search(r"<!-- output of: yarnverify prove -->\n```\n(.*?)```", README, re.DOTALL)
    assert quoted is not None
    assert quoted[1].splitlines() == tally_lines(record)


def test_readme_document_is_read_and_proved(tmp_path: Path) -> None:
    from yarnverify.verdicts import verdicts

    text = re.search(r"```\n(## Spring.*?)```", README, re.DOTALL)
    assert text is not None
    path = tmp_path / "spring.md"
    path.write_text(text[1], encoding="utf-8")
    found, _ = verdicts(path, cache=False)
    assert found["tally"]["proved"] == 6 == len(found["claims"])
    assert [part["verdict"] for part in found["completeness"]] == ["proved"]


def test_doctests_of_the_package() -> None:
    import yarnverify.symbolic.grammar
    import yarnverify.symbolic.latex
    import yarnverify.symbolic.plain

    for module in (yarnverify.symbolic.latex, yarnverify.symbolic.plain, yarnverify.symbolic.grammar):
        assert doctest.testmod(module).failed == 0 < doctest.testmod(module).attempted
