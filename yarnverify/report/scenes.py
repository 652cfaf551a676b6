"""Scenes of the simulation record, for the HTML report: what is known, what was found, and what it cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from yarnverify.report.simulation import error_text
from yarnverify.report.table import Table


@dataclass(frozen=True)
class Shown:
    """A scene as a page shows it.

    Attributes
    ----------
    size
        What its size counts, and the largest that was run.
    missed
        Goals that were missed, a line each.
    parameters
        Name, value with unit, reason.
    runs
        A row a way and size; None for a scene that compares with nothing.
    command
        Runs it at the sizes shown, and draws it.
    pictured
        What drew its picture, and the scene to turn, where that was a run of its own; else empty.
    """

    name: str
    title: str
    source: str
    wall: str
    size: tuple[str, int]
    missed: tuple[str, ...]
    parameters: Table
    runs: Table | None
    command: str
    pictured: str = ""


def scenes(record: Mapping[str, Any] | None, gallery: Sequence[Mapping[str, Any]] = ()) -> list[Shown]:
    """The scenes of a record, in its order, those to be looked at last, then those results of a gallery that it lacks."""
    recorded = [] if record is None else [*record["scenes"], *record.get("shown", ())]
    known = {each["result"]["scene"] for each in recorded}
    own = {result["scene"]: result for result in gallery}
    found = [_shown(each["result"], each.get("timings"), own.get(each["result"]["scene"])) for each in recorded]
    return [*found, *(_shown(result, None, None) for name, result in own.items() if name not in known)]


def _shown(result: Mapping[str, Any], timings: Mapping[str, Any] | None, drawn: Mapping[str, Any] | None) -> Shown:
    parameters = tuple(
        (name, f"{_value(own['value'])} {own['unit']}".strip(), own["reason"])
        for name, own in result["parameters"].items()
    )
    return Shown(
        result["scene"],
        result["title"],
        result["source"],
        result["wall"],
        (result["size"], result["lines"][0]["runs"][-1]["size"]),
        tuple(result.get("missed", ())),
        Table("Parameters", ("parameter", "value", "reason or source"), parameters),
        _runs(result, timings) if result["lines"][0]["runs"][0]["answers"] else None,
        _command(result),
        _command(drawn, result) if drawn is not None else "",
    )


def _command(result: Mapping[str, Any], beside: Mapping[str, Any] | None = None) -> str:
    """What runs a scene at its sizes, with those parameters that another result has otherwise."""
    own = result["parameters"]
    other = {} if beside is None else {key: value["value"] for key, value in beside["parameters"].items()}
    given = [f"{key}={own[key]['value']}" for key in own if key in other and own[key]["value"] != other[key]]
    words = ["yarnverify simulate", result["scene"], *(f"--set {each}" for each in given), "--size"]
    words += [str(run["size"]) for run in result["lines"][0]["runs"]]
    return " ".join([*words, "--out", f"reports/scenes/{result['scene']}"])


def _runs(result: Mapping[str, Any], timings: Mapping[str, Any] | None) -> Table:
    names = _names(result)
    headings = [result["compared"], result["size"], "unknowns", "iterations"]
    for name in names:
        headings += [f"{name}: error", "order"]
    rows = []
    for number, line in enumerate(result["lines"]):
        for place, run in enumerate(line["runs"]):
            cells = [line["name"], str(run["size"]), str(run["unknowns"]), str(run["iterations"])]
            by_name = {answer["name"]: answer for answer in run["answers"]}
            for name in names:
                answer = by_name.get(name, {"error": None, "order": None})  # not every way has every answer
                cells += [error_text(answer["error"]), "" if answer["order"] is None else f"{answer['order']:.2f}"]
            if timings is not None:
                cells.append(f"{timings['lines'][number]['runs'][place]['seconds']:.2g}")
            rows.append(tuple(cells))
    if timings is not None:
        headings.append("seconds")
    return Table("Relative errors", tuple(headings), tuple(rows))


def _names(result: Mapping[str, Any]) -> list[str]:
    """Answers of a scene, in the order in which its ways have them."""
    return list(dict.fromkeys(answer["name"] for line in result["lines"] for answer in line["runs"][0]["answers"]))


def _value(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
