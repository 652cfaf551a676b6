"""Tables of the analysis record: on a terminal, as Markdown, and for the HTML report."""

from __future__ import annotations

from typing import Any

from yarnverify.report.table import Table

_TIMES = {1: "", 2: " (twice)", 3: " (three times)"}


def analysis_tables(record: dict[str, Any]) -> list[Table]:
    """Everything but the maps, in the order of the page.

    Parameters
    ----------
    record
        As ``yarnverify analyse`` makes it.
    """
    return [_rest(record), _steps(record), _conditions(record), *_vibrations(record), _moduli(record)]


def fabric_line(record: dict[str, Any]) -> str:
    """The fabric in one sentence."""
    values = ", ".join(f"{name} = {own['value']:g} {own['unit']}" for name, own in record["fabric"].items())
    return f"Plain weave: {values}."


def analysis_lines(record: dict[str, Any]) -> list[str]:
    """The tables as text."""
    lines = [fabric_line(record)]
    for table in analysis_tables(record):
        lines += ["", *_text(table)]
    return lines


def mode_lines(record: dict[str, Any]) -> list[str]:
    """The modes of a scene as text."""
    lines = [f"{record['scene']}, size {record['size']}, about its end; rho = {record['rho']:g} kg/m, sliding held"]
    for number, (value, grows) in enumerate(zip(record["frequencies"], record["grows"], strict=True), 1):
        lines.append(
            f"{number:4}  unstable: grows e-fold in {1 / (2 * 3.141592653589793 * -value):.4g} s"
            if grows
            else f"{number:4}  {value:.6g} Hz"
        )
    return lines


def _text(table: Table) -> list[str]:
    rows = [table.headings, *table.rows]
    wide = [max(len(row[k]) for row in rows) for k in range(len(table.headings))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, wide, strict=True)).rstrip() for row in rows]
    return [f"{table.title}:", *lines, *table.notes]


def _rest(record: dict[str, Any]) -> Table:
    rows = []
    for name, own in record["energies"].items():
        values = ", ".join(f"{value:g}{_TIMES.get(count, f' ({count} times)')}" for value, count in own["rest"])
        share = f"{100 * own['indefinite']:.3g} %"
        rows.append((name, values, own["unit"], ", ".join(map(str, own["negative"])), share))
    headings = ("energy", "eigenvalues at rest", "unit", "negative ones on the map", "indefinite on the map")
    note = (
        "Of one element, with all unknowns free; h is the rest length of a segment. Parallel contact is taken where it sets "
        "in; plane and sphere set in without stiffness. Kinetic energy is no potential and is left out."
    )
    return Table("Hessian of each energy", headings, tuple(rows), (note,))


def _steps(record: dict[str, Any]) -> Table:
    rows = tuple((row["energy"], _number(row["omega"]), _number(row["step"])) for row in record["steps"]["rows"])
    notes = (
        "Mass lumped at the nodes, all nodes free, sliding held: without friction or a mass of its own, sliding along a "
        "straight yarn moves no material, and bounds no step. h = 2/omega for central differences at rest; bending stiffens "
        "without bound as its angle goes to pi, shear as its goes to 0 or pi.",
    )
    size = record["steps"]["size"]
    title = f"Largest stable explicit step, {size} by {size} yarns"
    return Table(title, ("energy", "greatest omega, rad/s", "largest step, s"), rows, notes)


def _conditions(record: dict[str, Any]) -> Table:
    rows = tuple(
        (str(row["size"]), _number(row["condition"]), _number(row["scaled"])) for row in record["conditions"]["rows"]
    )
    title = "Condition number of the stiffness at rest, border held"
    return Table(title, ("yarns each way", "as it is", "scaled to a unit diagonal"), rows)


def _vibrations(record: dict[str, Any]) -> list[Table]:
    yarn, net = record["vibrations"]["yarn"], record["vibrations"]["net"]
    known = "n^2 pi/(2 l^2) sqrt(k_b/rho)"
    titles = (
        f"Modes of a yarn of {yarn['length']:g} m with pinned ends, Hz, beside f_n = {known}",
        f"Modes of a net {net['side']:g} m wide, stretched by {100 * net['strain']:g} %, Hz, beside those of a membrane",
    )
    notes = (
        "With the mass of the declared kinetic energy, errors of stiffness and of mass cancel at second order.",
        "Here both errors have the same sign.",
    )
    return [_modes(own, *texts) for own, *texts in zip((yarn, net), titles, notes, strict=True)]


def _modes(own: dict[str, Any], title: str, note: str) -> Table:
    headings = (
        "segments",
        *(f"mode {k + 1}" for k in range(len(own["limit"]))),
        "greatest error",
        "as the discrete answer",
    )
    rows = [
        (
            str(row["size"]),
            *(f"{value:.6g}" for value in row["found"]),
            _number(row["error"]),
            "within 1e-8" if row["exact within 1e-8"] else "no",
        )
        for row in own["rows"]
    ]
    rows.append(("limit", *(f"{value:.6g}" for value in own["limit"]), "", ""))
    return Table(title, headings, tuple(rows), (f"Observed order of the error: {own['order']:.3g}. {note}",))


def _moduli(record: dict[str, Any]) -> Table:
    rows = tuple(
        (
            row["name"],
            f"{row['computed']:g}",
            f"{row['closed']:g}",
            row["unit"],
            "within 1e-9" if row["agree within 1e-9"] else "NO",
        )
        for row in record["moduli"]["rows"]
    )
    headings = ("modulus", "computed", "closed form", "unit", "agree")
    return Table("Small-strain moduli of the weave", headings, rows)


def _number(value: float) -> str:
    return f"{value:.3g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")
