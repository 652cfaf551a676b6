"""Commands that run scenes: ``simulate``, ``analyse``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from yarnverify.commands.shared import Json, progress, time_left, write_json


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
            path, missed = record_all(out or Path("reports"), pictures, tell)
            print("\n".join([*missed, f"{path}: written"]))
            sys.exit(1 if missed else 0)
        found, lines = run(scene, size or (), settings or (), solver, out, resume, every, pictures, tell)
    if not write_json({"result": found.result, "timings": found.timings}, json_file):
        print("\n".join([*study_lines(found.result, found.timings), *lines]))
    if found.missed:
        sys.exit(1)


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
    if not write_json(record, json_file):
        print("\n".join(lines))
