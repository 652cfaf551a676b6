"""A report in a few sentences, each from a record and with the place where the rest is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from yarnverify.report.benchmark import shown_size
from yarnverify.report.table import number

DEFAULT = "accurate"
_LOST = ("computation", "not finite")


def brief(records: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Anchor of a part of the page and what it comes to; parts that were not run are left out.

    Parameters
    ----------
    records
        As for :func:`yarnverify.report.pages.pages`.
    """
    ways = {"accuracy": _accuracy, "speed": _speed, "scenes": _scenes, "analysis": _analysis}
    names = {"speed": "benchmark", "scenes": "simulation"}
    found = ((part, way, records.get(names.get(part, part))) for part, way in ways.items())
    lines = ((part, " ".join(way(record))) for part, way, record in found if record is not None)
    return [(part, line) for part, line in lines if line]


def _accuracy(record: Mapping[str, Any]) -> Iterator[str]:
    cells = [cell for cell in record["cells"] if cell["dtype"] == "float64"]
    own = [cell for cell in cells if cell["variant"] == DEFAULT]
    if own:
        worst = [each["worst"] for cell in own for each in cell["outputs"].values() if each["worst"] is not None]
        energies = len({cell["energy"] for cell in own})
        size = "not finite" if "inf" in worst else f"{number(max(worst, default=0))} units of 2^-53"
        where = f"of {energies} energies" if energies > 1 else f"of {own[0]['energy']}"
        yield f"The default kernels' worst error is {size}, over {len(own)} kinds of hard states {where}."
    printed = [cell for cell in cells if cell["variant"] == "printed"]
    if printed:
        lost = sum(any(each.get("label") in _LOST for each in cell["outputs"].values()) for cell in printed)
        yield f"The formulas as printed lose digits, or have no value, on {lost or 'none'} of {len(printed)}."


def _speed(record: Mapping[str, Any]) -> Iterator[str]:
    last = []
    for own in record["energies"].values():
        sizes = {entry["n"]: entry for entry in next(iter(own["states"].values()))}
        entry = sizes[shown_size(list(sizes))]
        if DEFAULT in entry["ns"]:
            last.append(entry)
    if not last:
        return
    times = _range([entry["ns"][DEFAULT][0] for entry in last])
    bases = {
        base: [
            entry["times as fast as"][base][DEFAULT][0] for entry in last if DEFAULT in entry["times as fast as"][base]
        ]
        for base in last[0]["times as fast as"]
    }
    compared = ", ".join(f"{_range(ratios)} times as fast as {base}" for base, ratios in bases.items() if ratios)
    yield f"Energy, gradient and Hessian of an element take {times} ns{': ' + compared if compared else ''}."


def _scenes(record: Mapping[str, Any]) -> Iterator[str]:
    found = [each["result"] for each in (*record["scenes"], *record.get("shown", ()))]
    answers = sum(len(run["answers"]) for scene in found for line in scene["lines"] for run in line["runs"])
    missed = sum(len(scene["missed"]) for scene in found)
    outcome = f"{missed} goals missed" if missed else "every error and order as expected"
    yield f"{len(found)} simulations, {answers} answers beside known ones: {outcome}."


def _analysis(record: Mapping[str, Any]) -> Iterator[str]:
    moduli = record["moduli"]["rows"]
    agree = sum(row["agree within 1e-9"] for row in moduli)
    shared = f"All {agree}" if agree == len(moduli) else f"{agree} of {len(moduli)}"
    step = min(row["step"] for row in record["steps"]["rows"])
    yield f"{shared} moduli of the weave agree with their closed forms; explicit steps are stable up to {step:.2g} s."


def _range(values: list[float]) -> str:
    low, high = number(min(values)), number(max(values))
    return low if low == high else f"{low} to {high}"
