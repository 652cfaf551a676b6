"""What commands share: options, progress, and how they end."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

from cyclopts import Parameter

from yarnverify.errors import why

if TYPE_CHECKING:
    from yarnverify.generation import Outcome

Derivations = Annotated[
    str | None,
    Parameter(help="Folder of declared energies to judge by, or 'none'; found out from the document by default."),
]


Json = Annotated[
    Path | None,
    Parameter(
        name="--json", allow_leading_hyphen=True, help="Write the data behind the output here; - for standard output."
    ),
]


Junit = Annotated[Path | None, Parameter(help="Write the verdicts as JUnit XML here.")]


Summary = Annotated[Path | None, Parameter(help="Write a short summary here, as Markdown.")]


Annotations = Annotated[
    bool,
    Parameter(negative="", help="Also print workflow commands of GitHub Actions, which mark lines of the document."),
]


def stop(message: str, status: int = 2) -> NoReturn:
    print(message, file=sys.stderr)
    sys.exit(status)


def write_json(record: Any, target: Path | None) -> bool:
    """Write a record where it was asked for; whether that was standard output, which then holds nothing else."""
    if target is None:
        return False
    if str(target) == "-":
        print(json.dumps(record, indent=2))  # ASCII: any terminal and any pipe takes it
        return True
    try:
        target.write_text(json.dumps(record, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    except OSError as error:
        stop(f"{target}: cannot write: {why(error)}")
    return False


def finish(outcome: Outcome, target: Path | None) -> None:
    """Tell what a command did that writes or compares files, and end with its exit status."""
    shown = sys.stderr if write_json(outcome.record, target) else sys.stdout
    for line in outcome.lines:
        print(line, file=shown)
    if outcome.differs:
        sys.exit(1)


def named(energy: str | None, derivations: Path | None) -> tuple[str | None, Path | None]:
    """An energy and the folder that declares it, where the name is ``FOLDER/NAME``."""
    if energy is None or derivations is not None:
        return energy, derivations
    from yarnverify.project import find

    place, name = find(energy)
    return name, place.folder if place.own else None


@contextmanager
def progress(what: str) -> Iterator[Callable[[str, int], None]]:
    """A progress bar on standard error, if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda label, total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn(what),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[label]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None, label="")
        yield lambda label, total: bar.update(task, advance=1, total=total, label=label)


@contextmanager
def time_left() -> Iterator[Callable[[str, float], None]]:
    """A bar on standard error, if that is a terminal, that takes the share of all that is done."""
    if not sys.stderr.isatty():
        yield lambda label, done: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[label]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("simulating", total=1.0, label="")
        yield lambda label, done: bar.update(task, completed=max(done, bar.tasks[0].completed), label=label)
