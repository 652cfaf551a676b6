"""Records on a terminal: tables with colour, or plain text in a pipe."""

from __future__ import annotations

import shutil
import sys
from typing import Any

_STYLE = {"proved": "green", "refuted": "red", "undecided": "yellow", "inconsistent": "magenta"}


def show_verdicts(record: dict[str, Any], took: str) -> None:
    """Print the verdict of every equation, every mistake with its correction, and the tally."""
    rows = list(equation_rows(record))
    if sys.stdout.isatty():
        _table(rows)
    else:
        for equation, blocks, verdict, line in rows:
            print(f"{equation:>8}  line {line:<5} {verdict.upper():<12} {blocks}")
    print()
    for text in mistake_lines(record):
        print(text)
    for text in tally_lines(record):
        print(text)
    print(f"{took}.")


def equation_rows(record: dict[str, Any]) -> list[tuple[str, str, str, int]]:
    """One row for each equation and verdict: (number, blocks, verdict, line)."""
    rows: dict[tuple[str, str, int], list[str]] = {}
    for claim in record["claims"]:
        key = (claim["equation"], claim["verdict"], claim["line"])
        rows.setdefault(key, []).append(claim["block"])
    return [
        (equation, " ".join(dict.fromkeys(blocks)), verdict, line) for (equation, verdict, line), blocks in rows.items()
    ]


def _table(rows: list[tuple[str, str, str, int]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD)
    for heading, justify in (("equation", "right"), ("line", "right"), ("verdict", "left"), ("claims", "left")):
        table.add_column(heading, justify=justify)  # type: ignore[arg-type]
    for equation, blocks, verdict, line in rows:
        table.add_row(equation, str(line), f"[{_STYLE[verdict]}]{verdict.upper()}[/]", blocks)
    Console(width=shutil.get_terminal_size((100, 24)).columns).print(table)


def mistakes(record: dict[str, Any]) -> list[dict[str, Any]]:
    """The claims that are not proved, one for each equation and reason, with the blocks of all of them."""
    groups: dict[tuple[str, str, str | None], dict[str, Any]] = {}
    for claim in record["claims"]:
        if claim["verdict"] == "proved":
            continue
        key = (claim["equation"], claim["reason"], claim["change"])
        if key in groups:
            groups[key]["blocks"].append(claim["block"])
        else:
            groups[key] = {**claim, "blocks": [claim["block"]]}
    return list(groups.values())


def mistake_lines(record: dict[str, Any]) -> list[str]:
    lines: list[str] = []
    for claim in mistakes(record):
        lines.append(
            f"({claim['equation']}) {', '.join(claim['blocks'])}: {claim['verdict'].upper()}, {claim['reason']}"
        )
        if claim["because"]:
            continue
        lines.append(f"    printed    {claim['printed']}")
        if claim["correction"]:
            lines.append(f"    {'corrected' if claim['change'] else 'derived  '}  {claim['correction']}")
        if claim["change"]:
            lines.append(f"    change     {claim['change']}")
        if claim["effect"]:
            lines.append(f"    effect     {claim['effect']}")
        if claim["witness"]:
            lines += _witness_lines(claim["witness"])
        lines.append(
            f"    erratum    {'accepted: ' + claim['erratum'] if claim['erratum'] else 'new: not in errata.toml'}"
        )
    for part in record["completeness"]:
        for item in part["missing"]:
            lines.append(f"{part['section']}: the document does not list {item['latex']}, which is not zero")
            if item["derived"]:
                lines.append(f"    derived    {item['derived']}")
    return [*lines, ""] if lines else []


def _witness_lines(witness: dict[str, Any]) -> list[str]:
    def text(value: Any) -> str:
        return f"({', '.join(value)})" if isinstance(value, list) else str(value)

    point = ", ".join(f"{name} = {text(value)}" for name, value in witness["point"].items())
    exact = ", ".join(f"{name} = {text(value)}" for name, value in witness["hex"].items())
    lines = [f"    witness    {point}", f"    as floats  {exact}"]
    if not witness["residual"]:
        return [*lines, "    there      what is printed has no value"]
    worst = max(range(len(witness["residual"])), key=lambda i: abs(float(witness["residual"][i])))
    entry = f" (entry {worst // 3 + 1},{worst % 3 + 1})" if len(witness["residual"]) == 9 else ""
    return [*lines, f"    there      printed {witness['printed'][worst]}, true {witness['true'][worst]}{entry}"]


def tally_lines(record: dict[str, Any]) -> list[str]:
    tally = record["tally"]
    total = sum(tally.values())
    counts = ", ".join(
        f"{count} {verdict}" for verdict, count in tally.items() if count or verdict in ("proved", "refuted")
    )
    numbers = {claim["equation"] for claim in record["claims"] if not claim["equation"].startswith("line")}
    claims = "1 claim" if total == 1 else f"{total} claims"
    lines = [f"{claims} in {len(numbers)} of {len(record['equations'])} numbered equations: {counts}."]
    if record["given"]:
        names = ", ".join(f"{g['block']} ({g['equation']})" for g in record["given"])
        lines.append(f"Taken as given, since nothing declared says what they should be: {names}.")
    lacking = [
        f"{part['section']} does not list {', '.join(missing['block'] for missing in part['missing'])}"
        for part in record["completeness"]
        if part["missing"]
    ]
    unknown = [block for part in record["completeness"] for block in part["unknown"]]
    listed = sum(len(part["listed"]) for part in record["completeness"])
    lines.append(
        f"Lists of non-zero forces and Jacobians: incomplete, {'; '.join(lacking)}."
        if lacking
        else f"Lists of non-zero forces and Jacobians: complete, {listed} block{'s' * (listed != 1)}."
    )
    if unknown:
        lines.append(f"Not examined, being too large: {', '.join(unknown)}.")
    errata = record["errata"]
    for kind, what in (
        ("accepted", "Accepted errata"),
        ("new", "NEW, not in errata.toml"),
        ("stale", "STALE in errata.toml"),
    ):
        if errata[kind]:
            lines.append(f"{what}: {', '.join(f'({number})' for number in errata[kind])}.")
    lines.append(f"Judged {record['judged']}.")
    return lines
