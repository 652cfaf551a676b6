"""Commands that measure kernels: ``accuracy``, ``benchmark``, ``fuzz``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from yarnverify.commands.shared import Json, finish, progress, stop, write_json


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
        if not write_json(found, json_file):
            print("\n".join(replay_lines(found)))
        return
    from yarnverify.accuracy.command import accuracy as measured

    with progress("measuring") as advance:
        names = () if name is None else (name,)
        outcome = measured(names, variant, profile, executor, jobs, state, out, write, check, advance, of)
    finish(outcome, json_file)


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
        Name of a declared energy, such as bending; a folder with energies of your own, or one of them as FOLDER/NAME; those of
        the document by default. Or simulation: an iteration on cloth of so many crossings (--sizes; 10^2 to 10^5), and a
        cantilever beside jax and elastica (--peers).
    """
    from yarnverify.benchmark.command import measure, measure_simulation
    from yarnverify.project import find

    if energy == "simulation" and threads != 1:
        stop("simulations run on one thread: leave --threads out", 2)
    with progress("measuring") as advance:
        record, asked_and_missing = (
            measure_simulation(sizes, peers, rounds, pictures, advance)
            if energy == "simulation"
            else measure(*find(energy), sizes, peers, threads, rounds, pictures, advance)
        )
    if not write_json(record, json_file):
        from yarnverify.benchmark.show import show_benchmark

        show_benchmark(record)
    if asked_and_missing:
        stop(asked_and_missing, 3)


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
        Name of an energy, such as bending; a folder with energies of your own, or one of them as FOLDER/NAME.
        Those of the document by default.
    """
    from yarnverify.errors import NotRunError
    from yarnverify.project import find

    try:
        from yarnverify.fuzzing.command import fuzz as run
    except ModuleNotFoundError as error:
        if error.name != "hypothesis":
            raise
        raise NotRunError("the search needs Hypothesis: pip install 'yarnverify[fuzz]'") from None

    with progress("searching") as advance:
        of, name = find(energy)
        lines, record = run(name, variant, time, seed, advance, of)
    shown = sys.stderr if write_json(record, json_file) else sys.stdout
    for line in lines:
        print(line, file=shown)
    if any(search["found"] for search in record):
        sys.exit(1)
