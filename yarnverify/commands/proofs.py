"""Commands on documents and energies: ``init``, ``prove``, ``derive``, ``generate``, ``report``, ``tutorial``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from yarnverify.commands.shared import Annotations, Derivations, Json, Junit, Summary, finish, progress, write_json


def init(folder: Path, /) -> None:
    """A small working start for energies and a document of your own.

    Parameters
    ----------
    folder
        A new folder; nothing is overwritten.
    """
    from yarnverify.init import init as start

    print("\n".join(start(folder)))


def prove(
    document: Path | None = None,
    /,
    *,
    derivations: Derivations = None,
    json_file: Json = None,
    junit: Junit = None,
    summary: Summary = None,
    annotations: Annotations = False,
    cache: Annotated[bool, Parameter(help="Use and keep results that are already known.")] = True,
) -> None:
    """A verdict on every printed equation.

    Parameters
    ----------
    document
        Markdown or text with numbered formulas, or a folder that holds it; the paper's document by default.
    """
    from yarnverify import ci
    from yarnverify.errors import InputError
    from yarnverify.project import document_of
    from yarnverify.show import show_verdicts
    from yarnverify.verdicts import path_of, verdicts

    document = document_of(document)
    try:
        with progress("proving") as advance:
            record, took = verdicts(document, derivations, cache, advance)
    except InputError as error:
        if annotations and error.place:
            print(ci.annotation("error", *error.place, "yarnverify", error.message), file=sys.stderr)
        raise
    path = ci.shown_path(path_of(document))
    ci.write(record, path, junit, summary)
    quiet = write_json(record, json_file)
    if not quiet:
        show_verdicts(record, took)
    if annotations:
        print(*ci.workflow_commands(record, path), sep="\n", file=sys.stderr if quiet else sys.stdout)
    if not record["as_expected"]:
        sys.exit(1)


def derive(
    energy: str,
    /,
    *,
    format: Literal["text", "latex", "markdown"] = "text",
    derivations: Annotated[Path | None, Parameter(help="Folder of declared energies.")] = None,
    json_file: Json = None,
) -> None:
    """The derivation of an energy: measures, their derivatives, the chain rule, the result.

    Parameters
    ----------
    energy
        Name of a declared energy, such as bending; one of your own as FOLDER/NAME.
    """
    from yarnverify.project import find
    from yarnverify.symbolic.explain import explain, explanation

    if derivations is None:
        place, name = find(energy)
        derivations, energy = place.folder, name or ""
    record = explanation(energy, derivations)
    if not write_json(record, json_file):
        print(explain(record, format))


def generate(
    folder: Path | None = None,
    /,
    *,
    check: Annotated[bool, Parameter(negative="", help="Compare with the files instead of writing them.")] = False,
    json_file: Json = None,
    cache: Annotated[bool, Parameter(help="Use and keep results that are already known.")] = True,
) -> None:
    """The kernels, from the derivations.

    Parameters
    ----------
    folder
        Folder with energies of your own; its kernels are written to FOLDER/kernels. The package's own by default.
    """
    from yarnverify.generation import generate_kernels
    from yarnverify.project import project

    with progress("generating") as advance:
        outcome = generate_kernels(check, advance, cache, project(folder))
    finish(outcome, json_file)


def report(
    folder: Path | None = None,
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(help="Folder for the pages and the records behind them; reports, or FOLDER/reports, by default."),
    ] = None,
    check: Annotated[bool, Parameter(negative="", help="Compare with the files instead of writing them.")] = False,
    pictures: Annotated[
        bool, Parameter(negative="", help="Draw the pictures of measured records (needs matplotlib).")
    ] = False,
    json_file: Json = None,
    junit: Junit = None,
    summary: Summary = None,
    annotations: Annotations = False,
) -> None:
    """All of it, to reports/: verdicts, corrections, derivations, kernels, and what was measured; a page an energy.

    Parameters
    ----------
    folder
        Folder with energies, and perhaps a document, of your own: its kernels are written to FOLDER/kernels and measured.
        The paper's by default.
    """
    from yarnverify import ci
    from yarnverify.project import project
    from yarnverify.reporting import build_report

    of = project(folder)
    with progress("reporting") as advance:
        outcome = build_report(out, check, advance, pictures, of)
    path, found = ci.shown_path(of.folder / of.document), ci.of_report(outcome.verdicts, outcome.record)
    ci.write(found, path, junit, summary)
    if annotations:
        outcome.lines += ci.workflow_commands(found, path)
    finish(outcome, json_file)


def tutorial(
    folder: Path | None = None,
    /,
    *,
    out: Annotated[Path, Parameter(help="Folder of reports that holds the record.")] = Path("reports"),
    write: Annotated[bool, Parameter(negative="", help="Write the record.")] = False,
    check: Annotated[bool, Parameter(negative="", help="Compare with the record instead of showing the page.")] = False,
) -> None:
    """Run the tutorial, all its commands and examples, and show it with what they print.

    Parameters
    ----------
    folder
        A new folder that keeps the files of the tutorial; none are kept without.
    """
    from yarnverify.tutorial import tutorial as run

    with progress("running") as advance:
        outcome = run(folder, out, write, check, advance)
    finish(outcome, None)
