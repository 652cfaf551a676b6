"""A study on a terminal: what was run, and a table of errors, orders and seconds for each way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any


def study_lines(result: Mapping[str, Any], timings: Mapping[str, Any]) -> Iterator[str]:
    """The lines to print."""
    yield f"{result['scene']}: {result['title']}"
    for name, own in result["parameters"].items():
        value = f"{own['value']:.10g}" if isinstance(own["value"], float) else own["value"]
        reason = f"   {own['reason']}" if own["reason"] else ""
        unit = "" if own["unit"] == "1" else own["unit"]
        yield f"  {name} = {value} {unit}".rstrip() + reason
    if result["wall"]:
        yield f"  The wall is {result['wall']}."
    if result["source"]:
        yield f"  Known: {result['source']}."
    for line, timed in zip(result["lines"], timings["lines"], strict=True):
        energies = ", ".join(f"{name} {count}" for name, count in line["runs"][-1]["energies"].items())
        yield ""
        yield f"{line['name']}; energies and elements: {energies}"
        yield from _table(result["size"], line["runs"], [run["seconds"] for run in timed["runs"]])
    yield ""
    yield from result["missed"]
    answers = sum(len(line["runs"]) * len(line["runs"][0]["answers"]) for line in result["lines"])
    if answers:
        missed = len(result["missed"])
        yield f"{missed} of the goals missed." if missed else "Every error and every order as expected."


def _table(size: str, runs: list[dict[str, Any]], seconds: list[float]) -> Iterator[str]:
    rows = [(size, "unknowns", "iterations", "seconds", "answer", "found", "exact", "error", "order")]
    for run, time in zip(runs, seconds, strict=True):
        first = (str(run["size"]), str(run["unknowns"]), str(run["iterations"]), f"{time:.3g}")
        for answer in run["answers"] or [None]:
            if answer is None:
                rows.append((*first, "", "", "", "", ""))
                continue
            unit = f" {answer['unit']}" if answer["unit"] not in ("", "1") else ""
            order = (
                "exact"
                if answer["expected order"] is None
                else ""
                if answer["order"] is None
                else f"{answer['order']:.2f}"
            )
            rows.append((*first, answer["name"], f"{answer['found']:.8g}{unit}", f"{answer['exact']:.8g}{unit}",
                         f"{answer['error']:.1e}", order))  # fmt: skip
            first = ("", "", "", "")
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        yield (
            "  "
            + "  ".join(
                cell.ljust(width) if k == 4 else cell.rjust(width)
                for k, (cell, width) in enumerate(zip(row, widths, strict=True))
            ).rstrip()
        )
