"""Scenes of the simulation record, for the HTML report: what is known, what was found, and what it cost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from yarnverify.report.table import Table


@dataclass(frozen=True)
class Shown:
    """A scene as a page shows it.

    Attributes
    ----------
    missed
        Goals that were missed, a line each.
    parameters
        Name, value with unit, reason.
    runs
        A row a way and size; None for a scene that compares with nothing.
    """

    name: str
    title: str
    source: str
    wall: str
    missed: tuple[str, ...]
    parameters: Table
    runs: Table | None


def scenes(record: Mapping[str, Any] | None) -> list[Shown]:
    """The scenes of a record, in its order; none where the record is missing."""
    return [] if record is None else [_shown(each["result"], each.get("timings")) for each in record["scenes"]]


def overview(record: Mapping[str, Any]) -> Table:
    """A row for each answer of each scene: worst error at the largest size, order, and whether that is what it should be."""
    rows = []
    for each in record["scenes"]:
        result = each["result"]
        last = [line["runs"][-1] for line in result["lines"]]
        for name in _names(result):
            answers = [answer for run in last for answer in run["answers"] if answer["name"] == name]
            answers = [one for one in answers if one["allowed"] is not None] or answers  # ways that are to be judged
            worst = max(answers, key=lambda one: _size(one["error"]))
            orders = [one["order"] for one in answers if one["order"] is not None and one["expected order"] is not None]
            order = f"{min(orders):.2f}" if orders else "exact" if worst["expected order"] is None else "–"
            rows.append(
                (
                    result["scene"].replace("_", " "),
                    name,
                    _error(worst["error"]),
                    order,
                    _error(worst["allowed"]),
                )
            )
    headings = ("scene", "answer", "relative error", "order", "allowed")
    return Table("Worst of all ways at the largest size", headings, tuple(rows))


def _shown(result: Mapping[str, Any], timings: Mapping[str, Any] | None) -> Shown:
    parameters = tuple(
        (name, f"{_value(own['value'])} {own['unit']}".strip(), own["reason"])
        for name, own in result["parameters"].items()
    )
    return Shown(
        result["scene"],
        result["title"],
        result["source"],
        result["wall"],
        tuple(result.get("missed", ())),
        Table("Parameters", ("parameter", "value", "reason or source"), parameters),
        _runs(result, timings) if result["lines"][0]["runs"][0]["answers"] else None,
    )


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
                cells += [_error(answer["error"]), "" if answer["order"] is None else f"{answer['order']:.2f}"]
            if timings is not None:
                cells.append(f"{timings['lines'][number]['runs'][place]['seconds']:.2g}")
            rows.append(tuple(cells))
    if timings is not None:
        headings.append("seconds")
    return Table("Relative errors", tuple(headings), tuple(rows))


def _names(result: Mapping[str, Any]) -> list[str]:
    """Answers of a scene, in the order in which its ways have them."""
    return list(dict.fromkeys(answer["name"] for line in result["lines"] for answer in line["runs"][0]["answers"]))


def _size(error: float | None) -> float:
    return float("inf") if error is None else float(error)


def _error(value: float | None) -> str:
    return "none" if value is None else "0" if value == 0 else f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e")


def _value(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
