"""``yarnverify report``: work out the records, then make the pages from the records alone."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from yarnverify.errors import InputError, NotRunError
from yarnverify.generation import Outcome, generate_kernels, settle_files
from yarnverify.library import declared_files, known
from yarnverify.project import Project, project
from yarnverify.reference import reference
from yarnverify.show import mistake_lines, tally_lines
from yarnverify.verdicts import nothing_printed, verdicts

MEASURED = (
    "accuracy",
    "benchmark",
    "analysis",
    "simulation",
    "simulation-speed",
    "tutorial",
)  # of commands of their own

COMMANDS = {
    "accuracy": "yarnverify accuracy --write",
    "benchmark": "yarnverify benchmark --json reports/records/benchmark.json",
    "analysis": "yarnverify analyse --write",
    "simulation": "yarnverify simulate --write",
    "simulation-speed": "yarnverify benchmark simulation --json reports/records/simulation-speed.json",
    "tutorial": "yarnverify tutorial --write",
}


def build_report(
    out: Path | None,
    check: bool,
    advance: Callable[[str, int], None] = lambda label, total: None,
    pictures: bool = False,
    of: Project | None = None,
) -> Outcome:
    """Write the report into a folder, or compare it with what is there.

    Parameters
    ----------
    out
        The folder, that of the project by default; ``records/`` below it holds the JSON that the pages are made from.
    check
        Compare instead of writing.
    advance
        Called as each step is done.
    pictures
        Draw the pictures of measured records anew; the pages show those that are there.
    of
        The project; the package's own by default. The kernels of your own are written and measured too, unless ``check``.

    Raises
    ------
    InputError, NotRunError
        For derivations that cannot be read or proved, pictures without matplotlib, and files that cannot be written.
    """
    from yarnverify.report.pages import pages

    of = of or project()
    out = of.reports if out is None else out
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is not a folder; give --out another one")
    records, lines, expected = _records(of, check, advance)
    texts = {
        f"records/{name}.json": json.dumps(record, indent=1, ensure_ascii=False) + "\n"
        for name, record in records.items()
    }
    if of.own and not check:
        said, met = _sweep(of, out, advance)
        lines, expected = [*lines, *said], expected and met
    measured = _measured(out)
    if pictures:
        _draw(out / "pictures", measured, list(records["derivations"]), lines)
    drawn = sorted(path.name for path in (out / "pictures").glob("*.png"))
    texts |= pages(
        {name: json.loads(texts[f"records/{name}.json"]) for name in records} | measured, drawn, of.source, of.name
    )
    there = {path.relative_to(out).as_posix() for pattern in ("*.md", "records/*.json") for path in out.glob(pattern)}
    there -= {f"records/{name}.json" for name in MEASURED}
    if not check:  # made from the same records at any time, and so not kept under version control
        texts["report.html"] = _page(records | measured, out, of.name)
    outcome = settle_files(out, texts, check, sorted(there - set(texts)), of.here("yarnverify report"))
    outcome.lines = [*lines, *outcome.lines]
    outcome.record = {
        "tally": records["verdicts"]["tally"],
        "as_expected": expected,
        "as_generated": not outcome.differs,
        "files": sorted(texts),
    }
    outcome.differs |= not expected
    outcome.verdicts = records["verdicts"]
    return outcome


def _page(records: dict[str, Any], out: Path, name: str) -> str:
    """The HTML report, with the pictures that are there, and the scenes that ``simulate --out`` left in ``scenes/``."""
    from yarnverify.report.html import page

    svg = {path.stem: path.read_text(encoding="utf-8") for path in sorted((out / "pictures").glob("*.svg"))}
    drawn = {path.stem: path for path in sorted((out / "pictures").glob("*.png"))}
    recorded = records.get("simulation") or {}
    named = [each["result"]["scene"] for part in ("scenes", "shown") for each in recorded.get(part, ())]
    photos = {scene: drawn[scene].read_bytes() for scene in named if scene in drawn}
    turned, gallery = {}, []
    for path in sorted((out / "scenes").glob("*/result.json")):
        try:
            gallery.append(json.loads(path.read_text(encoding="utf-8")))
            scene = gallery[-1]["scene"]
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(f"{path}: is not a result of yarnverify simulate --out: {error}") from None
        if (photo := path.with_name(f"{scene}.png")).is_file():
            photos[scene] = photo.read_bytes()
        if (whole := path.with_name(f"{scene}.html")).is_file():
            turned[scene] = whole.read_text(encoding="utf-8")
    return page(records, svg, name, gallery=gallery, photos=photos, turned=turned)


def _draw(folder: Path, measured: dict[str, Any], energies: list[str], lines: list[str]) -> None:
    """Pictures of error against angle and of speed against error, as SVG and PNG."""
    try:
        from yarnverify.report import analysis_pictures, simulation_pictures
        from yarnverify.report.pictures import error_against_angle, speed_against_error, write
        from yarnverify.report.precision import precision
    except ImportError:
        raise NotRunError("pictures need matplotlib: pip install 'yarnverify[view]'") from None

    def curves(accuracy: dict[str, Any], energy: str) -> Any:
        return error_against_angle(accuracy, energy)

    folder.mkdir(parents=True, exist_ok=True)
    for energy in energies:
        accuracy, benchmark = measured["accuracy"], measured["benchmark"]
        if accuracy is not None and any(curve["energy"] == energy for curve in accuracy["curves"]):
            write(partial(curves, accuracy, energy), folder / f"{energy}-error")
            lines.append(f"pictures/{energy}-error: drawn")
        if benchmark is not None and energy in benchmark["energies"]:
            write(partial(speed_against_error, benchmark, energy), folder / f"{energy}-speed")
            lines.append(f"pictures/{energy}-speed: drawn")
    for kind, drawings in (
        ("analysis", analysis_pictures.PICTURES),
        ("simulation-speed", simulation_pictures.PICTURES),
    ):
        if measured[kind] is not None:
            for name, draw in drawings.items():
                write(partial(draw, measured[kind]), folder / name)
                lines.append(f"pictures/{name}: drawn")
    if measured["simulation"] is not None:
        for each in measured["simulation"]["scenes"]:
            name = each["result"]["scene"]
            write(partial(precision, each["result"], each["timings"]), folder / f"{name}-precision")
            lines.append(f"pictures/{name}-precision: drawn")


def _measured(out: Path) -> dict[str, Any]:
    """Records that are there from commands of their own; None for one that was not run."""
    found: dict[str, Any] = {}
    for name in MEASURED:
        path = out / "records" / f"{name}.json"
        try:
            found[name] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None
        except ValueError as error:
            raise InputError(f"{path}: {error}; {COMMANDS[name]} makes it anew") from None
    return found


def _sweep(of: Project, out: Path, advance: Callable[[str, int], None]) -> tuple[list[str], bool]:
    """Measure the kernels of a project on their hard cases and write the record; what to say, and whether all met targets."""
    from yarnverify.accuracy.command import accuracy
    from yarnverify.accuracy.record import missed_targets

    try:
        measured = accuracy((), (), "quick", "processes", None, None, out, True, False, advance, of)
    except NotRunError as error:
        return [f"Not measured: {error}"], True
    return [*missed_targets(measured.record, of.here("yarnverify accuracy")), measured.lines[-1]], not measured.differs


def _records(of: Project, check: bool, advance: Callable[[str, int], None]) -> tuple[dict[str, Any], list[str], bool]:
    """The records behind the pages, what to say of them, and whether all is as expected."""
    from yarnverify.accuracy.regimes import not_drawn, regimes
    from yarnverify.symbolic.declare import load_declarations
    from yarnverify.symbolic.explain import explain_energy

    declarations = load_declarations(of.folder)
    energies = [energy for energy in declarations.energies if energy.document in (of.document, "")]
    found, took = nothing_printed(), "No document"
    if of.document:
        found, took = verdicts(of.folder / of.document, advance=advance)
    kernels = generate_kernels(check or not of.own, advance, of=of)
    order = [part["section"] for part in found["completeness"]]
    energies.sort(key=lambda energy: order.index(energy.section) if energy.section in order else len(order))
    derived = {}
    for energy in energies:
        title = energy.section or energy.name.replace("_", " ").capitalize()
        explained, _ = known(
            [b"derivation", energy.name.encode(), *declared_files(of.folder)],
            partial(explain_energy, energy, declarations),
        )
        why = not_drawn(energy)
        hard = {} if why else {regime.name: regime.meaning for regime in regimes(energy)}
        about = {"section": energy.section, "title": title, "not_swept": why, "hard_cases": hard}
        derived[energy.name] = {**about, **explained}
        advance(f"explaining {energy.name}", len(energies))
    lines = (
        [*mistake_lines(found), *tally_lines(found), f"{took}."]
        if of.document
        else ["No document: nothing printed to judge."]
    )
    if of.own:
        lines += kernels.lines
    elif kernels.differs:
        lines.append("The kernels differ from what the derivations give; see: yarnverify generate --check")
    proved = all(record["all_proved"] for record in derived.values() if record["measures"])
    records = {"verdicts": found, "derivations": derived, "kernels": kernels.record}
    if not of.own:
        records["reference"] = reference()
    return (
        records,
        lines,
        found["as_expected"] and proved and not kernels.differs,
    )
