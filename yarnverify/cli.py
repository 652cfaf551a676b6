"""The command line: ``yarnverify prove | derive | generate | check | export | accuracy | benchmark | fuzz | simulate |
report``.

Exit status: 0 all as expected; 1 a check failed, or an erratum is new or stale; 2 bad usage or input; 3 asked for but
could not run. Heavy imports happen inside the commands, so that ``--help`` answers at once.
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn

import cyclopts
from cyclopts import App, Parameter

from yarnverify import __version__

if TYPE_CHECKING:
    from yarnverify.generation import Outcome

app = App(
    name="yarnverify",
    version=__version__,
    help="Proofs for printed yarn energies, forces and Jacobians, and NumPy kernels derived from them.",
)

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


def _stop(message: str, status: int = 2) -> NoReturn:
    print(message, file=sys.stderr)
    sys.exit(status)


def _json(record: Any, target: Path | None) -> bool:
    """Write a record where it was asked for; whether that was standard output, which then holds nothing else."""
    if target is None:
        return False
    if str(target) == "-":
        print(json.dumps(record, indent=2))  # ASCII: any terminal and any pipe takes it
        return True
    try:
        target.write_text(json.dumps(record, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    except OSError as error:
        _stop(f"{target}: cannot write: {(error.strerror or str(error)).lower()}")
    return False


def _finish(outcome: Outcome, target: Path | None) -> None:
    """Tell what a command did that writes or compares files, and end with its exit status."""
    shown = sys.stderr if _json(outcome.record, target) else sys.stdout
    for line in outcome.lines:
        print(line, file=shown)
    if outcome.differs:
        sys.exit(1)


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


@app.command
def init(folder: Path, /) -> None:
    """A small working start for energies and a document of your own.

    Parameters
    ----------
    folder
        A new folder; nothing is overwritten.
    """
    from yarnverify.init import init as start

    print("\n".join(start(folder)))


@app.command
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
    quiet = _json(record, json_file)
    if not quiet:
        show_verdicts(record, took)
    if annotations:
        print(*ci.workflow_commands(record, path), sep="\n", file=sys.stderr if quiet else sys.stdout)
    if not record["as_expected"]:
        sys.exit(1)


@app.command
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
    if not _json(record, json_file):
        print(explain(record, format))


@app.command
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
    _finish(outcome, json_file)


@app.command
def accuracy(
    energy: str | None = None,
    /,
    *,
    variant: Annotated[tuple[str, ...], Parameter(help="Variant to measure; all by default.", negative="")] = (),
    profile: Annotated[Literal["quick", "full"], Parameter(help="How many states are tried.")] = "quick",
    executor: Annotated[str, Parameter(help="Where it runs: processes, serial, or dask:ADDRESS.")] = "processes",
    jobs: Annotated[int | None, Parameter(help="How many processes; as many as there are cores by default.")] = None,
    state: Annotated[
        Path | None, Parameter(help="Folder for what is done, until all is; in the cache by default.")
    ] = None,
    out: Annotated[
        Path | None, Parameter(help="Folder of reports that holds the record; reports, or FOLDER/reports, by default.")
    ] = None,
    write: Annotated[bool, Parameter(negative="", help="Write the record.")] = False,
    check: Annotated[bool, Parameter(negative="", help="Compare with the record instead of showing tables.")] = False,
    replay: Annotated[
        str | None, Parameter(help="One state again, as the record writes it; nothing else is done.")
    ] = None,
    json_file: Json = None,
) -> None:
    """The error of every kernel where it is hard to get right, against the true result.

    Parameters
    ----------
    energy
        Name of a declared energy, such as bending; a folder with energies of your own, or one of them as FOLDER/NAME.
        All of the package by default.
    """
    from yarnverify.project import find

    of, name = find(energy)
    if replay is not None:
        from yarnverify.accuracy.replay import replay as replay_state
        from yarnverify.accuracy.replay import replay_lines

        found = replay_state(replay, of.folder, str(of.folder) if of.own else "")
        if not _json(found, json_file):
            print("\n".join(replay_lines(found)))
        return
    from yarnverify.accuracy.command import accuracy as measured

    with progress("measuring") as advance:
        names = () if name is None else (name,)
        outcome = measured(names, variant, profile, executor, jobs, state, out, write, check, advance, of)
    _finish(outcome, json_file)


@app.command
def benchmark(
    energy: str | None = None,
    /,
    *,
    sizes: Annotated[
        list[int] | None,
        Parameter(help="Batch sizes; 1, 10, ..., 10^6 by default.", consume_multiple=True, negative=""),
    ] = None,
    peers: Annotated[
        list[str] | None,
        Parameter(
            help="Whom to measure beside the kernels; all by default, or none.", consume_multiple=True, negative=""
        ),
    ] = None,
    threads: Annotated[int, Parameter(help="Threads for the kernels; everybody else runs on one.")] = 1,
    rounds: Annotated[int | None, Parameter(help="Paired repetitions; 7 by default.")] = None,
    pictures: Annotated[
        Path | None, Parameter(help="Folder for pictures of speed against error; none are drawn by default.")
    ] = None,
    json_file: Json = None,
) -> None:
    """Speed of every kernel, batch size by batch size, next to what people would use instead.

    Parameters
    ----------
    energy
        Name of a declared energy, such as bending; all by default. Or simulation: an iteration on cloth of so many crossings
        (--sizes; 10^2 to 10^5), and a cantilever beside jax and elastica (--peers).
    """
    from yarnverify.benchmark.command import measure, measure_simulation

    if energy == "simulation" and threads != 1:
        _stop("simulations run on one thread: leave --threads out", 2)
    with progress("measuring") as advance:
        record, asked_and_missing = (
            measure_simulation(sizes, peers, rounds, pictures, advance)
            if energy == "simulation"
            else measure(energy, sizes, peers, threads, rounds, pictures, advance)
        )
    if not _json(record, json_file):
        from yarnverify.benchmark.show import show_benchmark

        show_benchmark(record)
    if asked_and_missing:
        _stop(asked_and_missing, 3)


@app.command
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
    _finish(outcome, json_file)


@app.command
def check(
    target: str | None = None,
    /,
    *,
    energy: Annotated[str | None, Parameter(help="Which energy; found in the target's name by default.")] = None,
    order: Annotated[
        str | None,
        Parameter(
            help="Order of your unknowns: x0,x1,x2,u1,u2. A name that the energy lacks gets 0; _ is passed over."
        ),
    ] = None,
    returns: Annotated[
        list[str] | None,
        Parameter(
            help="What comes back, in order: energy, gradient or force, hessian or jacobian, blocks such as x1 or x1,u1.",
            consume_multiple=True,
            negative="",
        ),
    ] = None,
    force: Annotated[bool, Parameter(negative="", help="Your gradients are forces.")] = False,
    jacobian: Annotated[bool, Parameter(negative="", help="Your Hessians are Jacobians of forces.")] = False,
    layout: Annotated[
        Literal["auto", "single", "component", "element"],
        Parameter(
            help="One state a call, arrays (rows, states), or arrays (states, rows); tried in this order by default."
        ),
    ] = "auto",
    column_major: Annotated[bool, Parameter(negative="", help="Your matrices are stored column by column.")] = False,
    float32: Annotated[bool, Parameter(negative="", help="Hold it to single precision.")] = False,
    with_: Annotated[
        tuple[str, ...],
        Parameter(name="--with", help="What an argument of yours is: kb=k_b, R=d/4, du=u1-u0.", negative=""),
    ] = (),
    fix: Annotated[
        tuple[str, ...], Parameter(help="A parameter that your code has built in: k_b=1.", negative="")
    ] = (),
    command: Annotated[
        str | None,
        Parameter(help="Instead of a target, a command line: './mine {in} {out}'.", allow_leading_hyphen=True),
    ] = None,
    files: Annotated[Literal["json", "npz", "csv"], Parameter(help="What the command reads and writes.")] = "json",
    write_inputs: Annotated[Path | None, Parameter(help="Only write the states: a .json, .npz or .csv file.")] = None,
    outputs: Annotated[Path | None, Parameter(help="Instead of a target, results for the states so written.")] = None,
    count: Annotated[int, Parameter(help="States of each regime.")] = 16,
    regime: Annotated[
        tuple[str, ...], Parameter(help="Only these hard cases, such as 'small angle'.", negative="")
    ] = (),
    extreme: Annotated[
        bool, Parameter(negative="", help="Sizes from 1e-200 to 1e200 too, which no cloth has.")
    ] = False,
    time_limit: Annotated[float, Parameter(help="Seconds that a call may take.")] = 10.0,
    derivations: Annotated[Path | None, Parameter(help="Folder of declared energies.")] = None,
    json_file: Json = None,
) -> None:
    """Your own implementation against the truth, over the hard cases, block by block.

    Parameters
    ----------
    target
        module:function, file.py:function, a module or file with functions energy, gradient or force, hessian or jacobian;
        or library.so:function with the C interface that README.md describes.
    """
    from yarnverify.check.command import check as checked
    from yarnverify.check.setting import Options, write_states
    from yarnverify.check.show import record, show

    options = Options(
        energy, order, tuple(returns or ()), force, jacobian, layout, column_major, float32, with_, fix, count, regime,
        extreme, time_limit, derivations,
    )  # fmt: skip
    if write_inputs is not None:
        print(write_states(write_inputs, options))
        return
    try:
        with progress("checking") as advance:
            found = checked(target, options, command, outputs, files, advance)
    except KeyboardInterrupt:
        _stop("interrupted; nothing was judged", 3)
    if not _json(record(found), json_file):
        show(found)
    if not found.passes:
        sys.exit(1)


@app.command
def simulate(
    scene: str | None = None,
    /,
    *,
    size: Annotated[
        list[int] | None,
        Parameter(help="Sizes to run; by default those of the scene.", consume_multiple=True, negative=""),
    ] = None,
    settings: Annotated[
        list[str] | None,
        Parameter(name="--set", help="A parameter, name=value.", consume_multiple=True, negative=""),
    ] = None,
    solver: Annotated[str | None, Parameter(help="Linear solver: direct or superlu; all by default.")] = None,
    out: Annotated[
        Path | None, Parameter(help="Folder for results, states, pictures; none are written without.")
    ] = None,
    resume: Annotated[bool, Parameter(negative="", help="Go on with the run in --out that was interrupted.")] = False,
    every: Annotated[float, Parameter(help="Seconds between states that are kept in --out.")] = 10.0,
    pictures: Annotated[bool, Parameter(help="Draw what was found into --out.")] = True,
    write: Annotated[
        bool, Parameter(negative="", help="Write the record of all scenes into --out, reports by default.")
    ] = False,
    json_file: Json = None,
) -> None:
    """A reference scene, compared with its known answer.

    Parameters
    ----------
    scene
        Its name, or a Python file of your own that declares one. All are listed without.
    """
    from yarnverify.simulation.command import listing, record_all
    from yarnverify.simulation.command import simulate as run
    from yarnverify.simulation.show import study_lines

    if scene is None and not write:
        print("\n".join(listing()))
        return
    with time_left() as tell:
        if scene is None:
            path, missed = record_all(out or Path("reports"), tell)
            print("\n".join([*missed, f"{path}: written"]))
            sys.exit(1 if missed else 0)
        found, lines = run(scene, size or (), settings or (), solver, out, resume, every, pictures, tell)
    if not _json({"result": found.result, "timings": found.timings}, json_file):
        print("\n".join([*study_lines(found.result, found.timings), *lines]))
    if found.missed:
        sys.exit(1)


@app.command
def analyse(
    scene: str | None = None,
    /,
    *,
    settings: Annotated[
        list[str] | None,
        Parameter(name="--set", help="A parameter, name=value.", consume_multiple=True, negative=""),
    ] = None,
    size: Annotated[int | None, Parameter(help="Size of the scene; by default its smallest.")] = None,
    modes: Annotated[int, Parameter(help="How many modes of the scene.")] = 6,
    out: Annotated[Path, Parameter(help="Folder of reports that holds the record.")] = Path("reports"),
    write: Annotated[bool, Parameter(negative="", help="Write the record.")] = False,
    json_file: Json = None,
) -> None:
    """Where energies are unstable, largest explicit steps, vibrations and moduli of a cotton weave; or the modes of a scene.

    Parameters
    ----------
    scene
        A scene, or a Python file that declares one: its vibration modes, and nothing else.
    """
    from yarnverify.analysis import command
    from yarnverify.report.analysis import analysis_lines, mode_lines

    with progress("analysing") as advance:
        if scene is not None:
            record = command.scene_modes(scene, settings or (), size, modes, advance)
            lines = mode_lines(record)
        else:
            record = command.analysis(settings or (), advance)
            lines = analysis_lines(record)
    if write and scene is None:
        lines = [*lines, command.write(record, out)]
    if not _json(record, json_file):
        print("\n".join(lines))


@app.command
def export(
    energy: str,
    /,
    *,
    out: Annotated[Path, Parameter(help="Folder for the files.")],
    count: Annotated[int, Parameter(help="States of each hard case.")] = 8,
    extreme: Annotated[
        bool, Parameter(negative="", help="Sizes from 1e-200 to 1e200 too, which no cloth has.")
    ] = False,
    derivations: Annotated[Path | None, Parameter(help="Folder of declared energies.")] = None,
) -> None:
    """Golden vectors, corrected formulas and C source, for those who do not use Python.

    Parameters
    ----------
    energy
        Name of a declared energy, such as bending.
    """
    from yarnverify.export.command import export as run

    with progress("exporting") as advance:
        lines = run(energy, out, derivations, count, extreme, advance)
    print("\n".join(lines))


@app.command
def fuzz(
    energy: str | None = None,
    /,
    *,
    time: Annotated[float, Parameter(help="Seconds, for all energies together.")] = 300.0,
    variant: Annotated[str, Parameter(help="Which variant of the kernels.")] = "accurate",
    seed: Annotated[int | None, Parameter(help="Of the drawn elements; a new one each time by default.")] = None,
    json_file: Json = None,
) -> None:
    """Random search for elements at which a kernel breaks what it promises.

    Parameters
    ----------
    energy
        Name of an energy, such as bending; all of them by default.
    """
    from yarnverify.errors import NotRunError

    try:
        from yarnverify.fuzzing.command import fuzz as run
    except ModuleNotFoundError as error:
        if error.name != "hypothesis":
            raise
        raise NotRunError("the search needs Hypothesis: pip install 'yarnverify[fuzz]'") from None

    with progress("searching") as advance:
        lines, record = run(energy, variant, time, seed, advance)
    shown = sys.stderr if _json(record, json_file) else sys.stdout
    for line in lines:
        print(line, file=shown)
    if any(search["found"] for search in record):
        sys.exit(1)


def main() -> None:
    """Run the command line; bad input is one line on standard error and exit status 2."""
    from yarnverify.errors import InputError, NotRunError

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a terminal without Greek letters still gets the result
    try:
        app(sys.argv[1:], error_formatter=lambda error: f"yarnverify: {error}", exit_on_error=False, print_error=False)
    except cyclopts.CycloptsError as error:
        _stop(f"yarnverify: {' '.join(str(error).split())}")
    except InputError as error:
        _stop(str(error))
    except NotRunError as error:
        _stop(str(error), 3)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
