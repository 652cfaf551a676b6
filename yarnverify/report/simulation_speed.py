"""Tables of the record of ``yarnverify benchmark simulation``: on a terminal and as Markdown.

Timings belong to the machine and the moment that the record names; they are shown, and compared with nothing.
"""

from __future__ import annotations

from typing import Any

from yarnverify.report.table import Table

PARTS = ("kernels", "assembly", "factorise", "solve", "rest")
SOLVERS = {
    "direct": "direct solver (multifrontal)",
    "gradients": "conjugate gradients (yarn-line preconditioner)",
}
LARGE = 5_000  # crossings from which memory per crossing says something: before, the smallest parts outweigh them


def speed_tables(record: dict[str, Any]) -> list[Table]:
    """An iteration on cloth for each solver, shares of the floor and growth, then the cantilever."""
    cloth = record["cloth"]
    return [
        *(_iteration(cloth[name], record["growth"][name], title) for name, title in SOLVERS.items() if name in cloth),
        *(
            _cantilever(goal, found, record["cantilever"]["alpha"])
            for goal, found in record["cantilever"]["goals"].items()
        ),
    ]


def _iteration(found: list[dict[str, Any]], growth: list[dict[str, Any]], solver: str) -> Table:
    headings = (
        "crossings", "unknowns", *(f"{part}, ms" for part in PARTS), "iteration, ms", "over its linear solve",
        "bytes per crossing", "engine",
    )  # fmt: skip
    rows = []
    for line in found:
        seconds = line["seconds"]
        linear = seconds["factorise"] + seconds["solve"]
        memory = f"{line['bytes']}" if line["bytes"] is not None and line["crossings"] >= LARGE else "–"
        rows.append(
            (
                str(line["crossings"]),
                str(line["unknowns"]),
                *(milliseconds(seconds[part]) for part in PARTS),
                milliseconds(seconds["iteration"]),
                f"{seconds['iteration'] / linear:.2f}",
                memory,
                line["engine"],
            )
        )
    for line in growth:
        own = line["exponents"]
        cells = (f"n^{own[part]:.2f}" if part in own else "" for part in (*PARTS, "iteration"))
        rows.append((f"{line['from']} to {line['to']}", "", *cells, f"solve: n^{own['linear solve']:.2f}", "", ""))
    notes = [_floor_note(found[-1])]
    inner = ", ".join(f"{line['inner']:.0f}" for line in found)
    if any(line["inner"] for line in found):
        notes.append(f"Steps of conjugate gradients in a solve, to a residual of 1e-10: {inner}.")
    notes += [
        f"{line['crossings']} crossings: {line['bytes not known']}." for line in found if "bytes not known" in line
    ]
    return Table(f"One Newton iteration of a cloth, {solver}", headings, tuple(rows), tuple(notes))


def _floor_note(line: dict[str, Any]) -> str:
    shares = ", ".join(
        f"{part} {100 * line['floor'][part] / line['seconds'][part]:.2g} %"
        for part in PARTS[:4]
        if line["seconds"][part] > 0
    )
    return f"Share of the time that moving the bytes alone would take, at {line['crossings']} crossings: {shares}."


def _cantilever(goal: str, found: dict[str, Any], alpha: float) -> Table:
    rows, notes = [], []
    base = ""
    for name, line in found["lines"].items():
        base = next(key for key in line if key.startswith("times "))
        middle, least, most = line[base]
        rows.append(
            (
                name,
                str(line["segments"]),
                f"{line['error']:.1e}",
                milliseconds(line["seconds"][0]),
                f"{middle:.3g} ({least:.3g} to {most:.3g})",
                f"{line['first']:.2g}",
            )
        )
        notes.append(f"{name}: {line['how']}.")
    notes += [f"{name}: not run, {reason}." for name, reason in found["not_run"].items()]
    headings = ("", "segments", "error", "time, ms", f"{base}: median (least to most)", "first call, s")
    return Table(f"Cantilever, alpha = {alpha:g}: time to an error of {goal}", headings, tuple(rows), tuple(notes))


def milliseconds(seconds: float) -> str:
    """Three digits."""
    value = 1000 * seconds
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"
