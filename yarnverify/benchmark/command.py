"""``yarnverify benchmark``: the options, the measurement, the pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from yarnverify.benchmark.peers import PEERS
from yarnverify.benchmark.run import ROUNDS, SIZES, benchmark
from yarnverify.errors import InputError, NotRunError, why
from yarnverify.project import Project


def measure(
    of: Project,
    energy: str | None,
    sizes: Sequence[int] | None,
    peers: Sequence[str] | None,
    threads: int,
    rounds: int | None,
    pictures: Path | None,
    advance: Callable[[str, int], None],
) -> tuple[dict[str, Any], str]:
    """The record, and which peers that were named on the command line did not run; None stands for the default.

    Raises
    ------
    InputError
        For options out of range, and a folder that cannot be written.
    NotRunError
        Where pictures are asked for and matplotlib is not installed; found before anything is measured.
    """
    draw = None if pictures is None else _drawing(pictures)
    named = PEERS if peers is None else () if list(peers) == ["none"] else tuple(dict.fromkeys(peers))
    record = benchmark(energy, sizes or SIZES, named, threads, ROUNDS if rounds is None else rounds, advance, of=of)
    if draw is not None:
        for name in record["energies"]:
            draw(record, name)
    reasons = {
        f"{peer}: not run: {found['not_run'][peer]}"
        for found in record["energies"].values()
        for peer in named
        if peers is not None and peer in found["not_run"]
    }
    return record, "; ".join(sorted(reasons))


def measure_simulation(
    crossings: Sequence[int] | None,
    peers: Sequence[str] | None,
    rounds: int | None,
    pictures: Path | None,
    advance: Callable[[str, int], None],
) -> tuple[dict[str, Any], str]:
    """The record of the simulation's speed, and which peers that were named did not run; None stands for the default.

    Raises
    ------
    InputError, NotRunError
        As for ``measure``.
    """
    from yarnverify.benchmark.simulation import peers as known
    from yarnverify.benchmark.simulation import run

    writes = None if pictures is None else _writing(pictures)
    named = known.PEERS if peers is None else () if list(peers) == ["none"] else tuple(dict.fromkeys(peers))
    record = run.benchmark_simulation(crossings or run.SIZES, named, run.ROUNDS if rounds is None else rounds, advance)
    if writes is not None and pictures is not None:
        from yarnverify.report.simulation_pictures import PICTURES

        for name, draw in PICTURES.items():
            writes(partial(draw, record), pictures / name)
    missing = {
        f"{peer}: not run: {found['not_run'][peer]}"
        for found in record["cantilever"]["goals"].values()
        for peer in named
        if peers is not None and peer in found["not_run"]
    }
    return record, "; ".join(sorted(missing))


def _drawing(folder: Path) -> Callable[[dict[str, Any], str], None]:
    write = _writing(folder)
    from yarnverify.report.pictures import speed_against_error

    def draw(record: dict[str, Any], energy: str) -> None:
        write(lambda: speed_against_error(record, energy), folder / f"{energy}-speed")

    return draw


def _writing(folder: Path) -> Callable[..., Any]:
    """What writes pictures to a folder, made if need be."""
    try:
        from yarnverify.report.pictures import write
    except ImportError as error:
        raise NotRunError(f"pictures need {error.name}: pip install yarnverify[view]") from None
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot write: {why(error)}") from None
    return write
