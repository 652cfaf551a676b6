"""``yarnverify tutorial``: the tutorial's commands and examples, run one after the other, with what they print.

``tutorial.md`` is written by a person and holds no output. Its ``sh`` blocks are commands, blocks with a name behind the
language are files, and the others examples at ``>>>``.
"""

from __future__ import annotations

import contextlib
import difflib
import importlib
import io
import json
import re
import shlex
import sys
import traceback
from collections.abc import Callable, Iterator
from doctest import DocTestParser, Example
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from yarnverify.errors import InputError
from yarnverify.files import write_record
from yarnverify.generation import Outcome

SOURCE = Path(__file__).with_name("tutorial.md")
RECORD = Path("records") / "tutorial.json"
_BLOCK = re.compile(r"^```(\w*)([^\n]*)\n(.*?)^```\n", re.DOTALL | re.MULTILINE)
_SECONDS = re.compile(r"(?m)^((?: +\d+){3} +)([\d.e+-]+)(?=  )")  # of the moment, in the tables of ``simulate``
_TOOK = re.compile(r"(?m)^(derived and proved|known from an earlier run) in .* s\.\n")
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
Advance = Callable[[str, int], None]


def parts(text: str) -> Iterator[dict[str, Any]]:
    """Prose and blocks in their order; ``more`` is what stands behind a block's language."""
    at = 0
    for found in _BLOCK.finditer(text):
        yield {"kind": "prose", "text": text[at : found.start()]}
        language, more, body = found.groups()
        kind = "commands" if language == "sh" else "file" if more.strip() else "examples"
        yield {"kind": kind, "language": language, "more": more.strip(), "text": body, "output": ""}
        at = found.end()
    yield {"kind": "prose", "text": text[at:]}


def run(folder: Path, advance: Advance = lambda label, total: None) -> dict[str, Any]:
    """The record of the tutorial, run in a folder, which then holds all that it makes.

    Parameters
    ----------
    folder
        An empty one.
    advance
        Called as each part is done.
    """
    found = list(parts(SOURCE.read_text(encoding="utf-8")))
    folder = folder.resolve()
    names: dict[str, Any] = {"__name__": "__main__"}
    with importing_from(folder), contextlib.chdir(folder):
        for part in found:
            if part["kind"] == "file":
                Path(part["more"]).write_text(part["text"], encoding="utf-8")
            elif part["kind"] == "commands":
                done = [_command(line) for line in part["text"].splitlines()]
                part["output"] = _shortened("".join(text for text, _ in done), part["more"])
                part["status"] = [status for _, status in done]
            elif part["kind"] == "examples":
                importlib.invalidate_caches()  # kernels may have been written a moment ago
                part["text"] = "".join(_examples(part["text"], names))
            advance(part["kind"], len(found))
    return {"schema": 1, "command": "yarnverify tutorial --write", "parts": found}


@contextlib.contextmanager
def importing_from(folder: Path) -> Iterator[None]:
    """Modules of a folder can be imported, and are forgotten at the end; another folder may have others of their names."""
    folder, known = folder.resolve(), set(sys.modules)
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        for name in set(sys.modules) - known:
            places = [getattr(sys.modules[name], "__file__", None), *getattr(sys.modules[name], "__path__", ())]
            if any(place and Path(place).resolve().is_relative_to(folder) for place in places):
                del sys.modules[name]


def _command(line: str) -> tuple[str, int]:
    """What a command line prints, errors included, and its exit status."""
    from yarnverify.cli import main

    shown, before = io.StringIO(), sys.argv
    sys.argv = shlex.split(line, comments=True)
    assert sys.argv[0] == "yarnverify"
    try:
        with contextlib.redirect_stdout(shown), contextlib.redirect_stderr(shown):
            main()
        status = 0
    except SystemExit as stop:
        status = int(stop.code or 0)
    finally:
        sys.argv = before
    return _steady(shown.getvalue()), status


def _steady(text: str) -> str:
    """An output without what differs from run to run."""
    return _SECONDS.sub(lambda found: found[1] + "…".rjust(len(found[2])), _TOOK.sub("", text))


def _shortened(text: str, wish: str) -> str:
    """The first or the last lines of an output, as ``first=3`` or ``last=12`` asks for; all without."""
    which, _, count = wish.partition("=")
    lines = text.splitlines(keepends=True)
    if not count or len(lines) <= int(count):
        return text
    return "".join([*lines[: int(count)], "...\n"] if which == "first" else ["...\n", *lines[-int(count) :]])


def _examples(text: str, names: dict[str, Any]) -> Iterator[str]:
    """The examples again, each with what it prints now; an error as its last line, as doctest reads it."""
    for piece in DocTestParser().parse(text):
        if not isinstance(piece, Example):
            yield piece
            continue
        first, *more = piece.source.splitlines(keepends=True)
        yield f">>> {first}" + "".join(f"... {line}" for line in more)
        shown = io.StringIO()
        with contextlib.redirect_stdout(shown):
            try:
                exec(compile(piece.source, "<tutorial>", "single"), names)
            except Exception as error:
                last = traceback.format_exception_only(error)[-1]
                shown.write(f"Traceback (most recent call last):\n    ...\n{last}")
        yield _steady(shown.getvalue())


def differences(old: str, new: str) -> list[str]:
    """What differs between two pages, beyond the rounding errors that are each machine's own."""
    before, now = old.splitlines(), new.splitlines()
    if len(before) == len(now):
        now = [a if _alike(a, b) else b for a, b in zip(before, now, strict=True)]
    return list(difflib.unified_diff(before, now, "record", "now", lineterm=""))


def _alike(old: str, new: str) -> bool:
    """Whether two lines are the same but for numbers that are rounding errors in both, and pass."""
    if _NUMBER.sub("#", old) != _NUMBER.sub("#", new):
        return False
    pairs = [(float(a), float(b)) for a, b in zip(_NUMBER.findall(old), _NUMBER.findall(new), strict=True)]
    if " u at K = " in old and "times" not in old:  # of a block that passes
        return True
    return all(a == b for a, b in (pairs[:-1] if old.endswith("  exact") else pairs))


def tutorial(
    folder: Path | None, out: Path, write: bool, check: bool, advance: Advance = lambda label, total: None
) -> Outcome:
    """Run the tutorial and show it, or keep its record, or compare with that.

    Parameters
    ----------
    folder
        A new folder that keeps what the tutorial makes; nothing is kept if None.
    out
        Folder of reports, for the record.
    write, check
        What to do with the record; the page itself is shown without.

    Raises
    ------
    InputError
        For a folder that holds something, and a record that is not there.
    """
    from yarnverify.report.pages import tutorial_page

    path = out / RECORD
    if write and check:
        raise InputError("give one of --write and --check")
    if check and not path.is_file():
        raise InputError(f"{path}: no such file; it is written by: yarnverify tutorial --write")
    if folder is None:
        with TemporaryDirectory() as place:
            record = run(Path(place), advance)
    else:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(f"{folder}: is there already, and nothing is overwritten; give a new folder")
        folder.mkdir(parents=True, exist_ok=True)
        record = run(folder, advance)
    page = tutorial_page(record)
    if write:
        write_record(record, path)
        return Outcome(record, [f"{path}: written; its page is written by: yarnverify report"])
    if check:
        lines = differences(tutorial_page(json.loads(path.read_text(encoding="utf-8"))), page)
        return Outcome(record, lines or ["The tutorial prints what its page shows."], bool(lines))
    return Outcome(record, page.splitlines())
