"""The tutorial: every command and example of its page is run, and prints what the page shows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from yarnverify import tutorial
from yarnverify.errors import InputError
from yarnverify.report.pages import tutorial_page

REPORTS = Path(__file__).parent.parent / "reports"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    pytest.importorskip("matplotlib")
    return tutorial.run(tmp_path_factory.mktemp("tutorial"))


def test_the_page_shows_what_comes_out(made: dict[str, Any]) -> None:
    page = (REPORTS / "tutorial.md").read_text(encoding="utf-8")
    assert tutorial.differences(page, tutorial_page(made)) == [], "yarnverify tutorial --write, yarnverify report"


def test_every_command_ends_as_the_text_says(made: dict[str, Any]) -> None:
    found = {
        line: (status, part["output"])
        for part in made["parts"]
        if part["kind"] == "commands"
        for line, status in zip(part["text"].splitlines(), part["status"], strict=True)
    }
    wrong = [line for line, (status, _) in found.items() if status]
    assert wrong == ["yarnverify prove spring.md"]  # the check of mine.py is there twice, and passes the second time
    first, second = (part for part in made["parts"] if "check mine.py" in part["text"] and part["kind"] == "commands")
    assert first["status"] == [1] and "lacks a factor (u1 - u0)/|x1 - x0|" in first["output"]
    assert second["status"] == [0] and "PASS" in second["output"]


# -- the mechanism, on small pages ------------------------------------------------------------------------------------

SMALL = """# Small

```python name.py
x = 1
```

```sh
yarnverify simulate nothing
```

```python
>>> from name import x
>>> x + {}
>>> for i in range(2):
...     print(i)
>>> 1 / 0
```
"""


@pytest.fixture
def small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    def write(number: int) -> None:
        (tmp_path / "source.md").write_text(SMALL.format(number), encoding="utf-8")
        monkeypatch.setattr(tutorial, "SOURCE", tmp_path / "source.md")

    return write


def test_files_are_written_commands_run_and_examples_tried(small: Any, tmp_path: Path) -> None:
    small(1)
    lines = tutorial.tutorial(tmp_path / "kept", tmp_path, False, False).lines
    assert (tmp_path / "kept" / "name.py").read_text(encoding="utf-8") == "x = 1\n"
    text = "\n".join(lines)
    assert ">>> x + 1\n2\n>>> for i in range(2):\n...     print(i)\n0\n1\n>>> 1 / 0\nTraceback" in text
    assert text.endswith("    ...\nZeroDivisionError: division by zero\n```")
    assert "```text\nthere is no scene 'nothing'" in text


def test_a_record_is_compared(small: Any, tmp_path: Path) -> None:
    small(1)
    tutorial.tutorial(None, tmp_path, True, False)
    assert json.loads((tmp_path / tutorial.RECORD).read_text(encoding="utf-8"))["parts"][3]["status"] == [2]
    assert not tutorial.tutorial(None, tmp_path, False, True).differs
    small(2)
    found = tutorial.tutorial(None, tmp_path, False, True)
    assert found.differs and {"-2", "+3"} <= set(found.lines)


def test_what_cannot_be_is_one_line(tmp_path: Path) -> None:
    for given, words in (
        ((None, tmp_path, False, True), "records/tutorial.json: no such file; it is written by: yarnverify tutorial"),
        ((None, tmp_path, True, True), "give one of --write and --check"),
        ((REPORTS, tmp_path, False, False), "is there already, and nothing is overwritten"),
    ):
        with pytest.raises(InputError, match=words):
            tutorial.tutorial(*given)


def test_rounding_errors_are_the_machines_own_and_nothing_else_is() -> None:
    same = [
        ("worst 2 u at K = 1.25, 0.08 of what is allowed", "worst 3.1 u at K = 1.25, 0.12 of what is allowed"),
        ("  12  3  …  length  0.13 m  0.13 m  1.1e-16  exact", "  12  3  …  length  0.13 m  0.13 m  2.2e-16  exact"),
    ]
    other = [
        ("worst 2 u at K = 1.25, 0.08 of what is allowed", "worst 2 u at K = 1.25, 0.08 times what is allowed"),
        ("worst 2e+15 u at K = 1, 1e+14 times what is allowed", "worst 3e+15 u at K = 1, 1e+14 times what is allowed"),
        ("array([0.30842514])", "array([0.30842515])"),
        ("  12  3  …  length  0.13 m  0.13 m  1.1e-16  exact", "  12  3  …  length  0.14 m  0.13 m  1.1e-16  exact"),
        ("  12  3  …  length  0.13 m  0.13 m  1.1e-06  1.00", "  12  3  …  length  0.13 m  0.13 m  2.2e-06  1.00"),
        ("a", "b"),
    ]
    assert not any(tutorial.differences(*pair) for pair in same)
    assert all(tutorial.differences(*pair) for pair in other)
