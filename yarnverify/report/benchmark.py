"""Tables of the benchmark record: for a page, as Markdown, and for a terminal, as rows.

Timings belong to the machine and the moment that the record names; they are shown, and compared with nothing.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from yarnverify.report.table import Table

SHOWN_AT = 100_000  # ratios are those at the largest batch up to this
FLOOR = "memory floor"


def benchmark_table(record: dict[str, Any], energy: str) -> str:
    """Speed and error of an energy's kernels and of the peers, as Markdown.

    Parameters
    ----------
    record
        As ``yarnverify benchmark --json`` writes it.
    energy
        Name of an energy; where the record lacks it, the text says that it was not run.
    """
    if energy not in record["energies"]:
        return f"Speed of {energy}: not run. Command: `yarnverify benchmark {energy}`.\n"
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return templates.get_template("benchmark.md.jinja").render(
        record=record, tables=tables(record, energy), where=where(record)
    )


def tables(record: dict[str, Any], energy: str) -> list[Table]:
    """A table of speed for each timed state, then one of errors, then who was measured and how."""
    found = record["energies"][energy]
    return [
        *(_speed(energy, found, state) for state in found["states"]),
        _errors(energy, found),
        _contestants(energy, found),
    ]


def where(record: dict[str, Any]) -> str:
    """The machine and the packages of a record, in one sentence."""
    own = record["environment"]
    packages = ", ".join(f"{name} {version}" for name, version in own["packages"].items())
    held = own["held to processors"]
    threads = f"held to {held} of {own['cores']} processors" if held else "not held to a processor"
    return f"{own['processor']}, {threads}; {own['system']}, Python {own['python']}, {packages}"


def shown_size(sizes: list[int]) -> int:
    """The batch size at which ratios are shown."""
    return max((n for n in sizes if n <= SHOWN_AT), default=min(sizes))


def _speed(energy: str, found: dict[str, Any], state: str) -> Table:
    by_size = {entry["n"]: entry for entry in found["states"][state]}
    at = by_size[shown_size(list(by_size))]
    bases = list(at["times as fast as"])
    headings = ["", *(f"n = {_count(n)}" for n in by_size)]
    headings += ["times the floor", *(f"times as fast as {base}" for base in bases)]
    rows, notes = [], []
    for name in [*found["contestants"], FLOOR]:
        cells = [name]
        for entry in by_size.values():
            cells.append(_time(entry["ns"][name][0]) if name in entry["ns"] else "not run")
            if name in entry["not_run"]:
                notes.append(f"{name} at n = {_count(entry['n'])}: not run, {entry['not_run'][name]}.")
        cells.append(_range(at["times the floor"].get(name)))
        cells += [_range(at["times as fast as"][base].get(name)) for base in bases]
        rows.append(tuple(cells))
    notes.append(_batch_of_one(by_size))
    ratios = f"Ratios at n = {_count(at['n'])}: median (least to most) of {at['rounds']} paired rounds."
    notes.append(f"{ratios} The floor is a copy that moves {found['bytes']} bytes per element.")
    title = f"{energy}, {state}: energy, gradient and Hessian, ns per element"
    return Table(title, tuple(headings), tuple(rows), tuple(note for note in notes if note))


def _batch_of_one(by_size: dict[int, dict[str, Any]]) -> str:
    if 1 not in by_size:
        return ""
    costs = (f"{name} {_time(ns[0] / 1000)}" for name, ns in by_size[1]["ns"].items() if name != FLOOR)
    return f"A batch of one, microseconds: {', '.join(costs)}."


def _errors(energy: str, found: dict[str, Any]) -> Table:
    states = list(found["errors"])
    rows = []
    for name in found["contestants"]:
        cells = (" / ".join(_error(found["errors"][state][name][output]) for output in "EGH") for state in states)
        rows.append((name, *cells))
    note = "Normwise by blocks, at the exact floats; ∞: NaN or infinite where the true result is finite."
    title = f"{energy}: worst error of energy / gradient / Hessian, in units of 2^-53"
    return Table(title, ("", *states), tuple(rows), (note,))


def _contestants(energy: str, found: dict[str, Any]) -> Table:
    rows = [(name, own["how"], own["hessian"], own["layout"]) for name, own in found["contestants"].items()]
    notes = tuple(f"{name}: not run, {reason}." for name, reason in found["not_run"].items())
    return Table(f"{energy}: how each was called", ("", "called as", "Hessian", "outputs"), tuple(rows), notes)


def _count(n: int) -> str:
    power = len(str(n)) - 1
    return f"10^{power}" if n == 10**power and n > 1000 else str(n)


def _time(value: float) -> str:
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def _range(values: list[float] | None) -> str:
    return (
        ""
        if values is None
        else "{} ({} to {})".format(*(f"{value:.2g}" if value < 100 else f"{value:.0f}" for value in values))
    )


def _error(value: float | None) -> str:
    if value is None:
        return "∞"
    if value < 1000:
        return f"{value:.0f}" if value >= 10 else f"{value:.2g}"
    return f"{value:.0e}".replace("e+", "e").replace("e0", "e")
