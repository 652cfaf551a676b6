"""Tables of the accuracy record, as rows and as Markdown."""

from __future__ import annotations

from typing import Any

from yarnverify.report.table import Table, number

_OUTPUTS = ("E", "G", "H")
_MARK = {"exact": "", "conditioning": "ᶜ", "computation": "*", "not finite": "*"}
VARIANTS = {  # what the columns are
    "printed": "the document's own formulas, misprints included",
    "differentiated": "what differentiating an energy and printing code gives",
    "fast": "the derived formulas in plain arithmetic",
    "accurate": "the default kernels: the derived formulas in forms that lose nothing",
    "reference": "twice the digits, rounded once; slow",
}
_KEY = (
    "No mark: at most 16 units. ᶜ: more, explained by the condition of the state (16 units and 8 for each unit of the "
    "condition number). *: lost by the computation. ∞: not finite where the true result is. –: no true result in range."
)


def kinds(record: dict[str, Any], energy: str) -> list[str]:
    """The floating-point types in which an energy was measured, widest first."""
    return sorted({cell["dtype"] for cell in record["cells"] if cell["energy"] == energy}, reverse=True)


def error_table(record: dict[str, Any], energy: str, dtype: str = "float64") -> Table:
    """Worst errors of an energy: a row a regime, a column a variant.

    Parameters
    ----------
    record
        As ``yarnverify accuracy`` writes it.
    energy, dtype
        Which cells; one of those that :func:`kinds` lists.
    """
    cells = [cell for cell in record["cells"] if cell["energy"] == energy and cell["dtype"] == dtype]
    variants = list(dict.fromkeys(cell["variant"] for cell in cells))
    found = {(cell["regime"], cell["variant"]): cell for cell in cells}
    unit = {"float64": "2^-53", "float32": "2^-24"}[dtype]
    title = (
        f"Worst error of energy / gradient / Hessian in units of {unit} ({dtype}), "
        f"{record['points']} states a regime, normwise by blocks"
    )
    rows = tuple(
        (regime, *(_entry(found.get((regime, variant))) for variant in variants))
        for regime in dict.fromkeys(cell["regime"] for cell in cells)
    )
    missing = tuple(f"Not run: {text}." for text in record["not_run"] if energy in text.split(":")[0].split())
    return Table(title, ("regime", *variants), rows, (_KEY, *missing))


def accuracy_table(record: dict[str, Any], energy: str, dtype: str = "float64") -> str:
    """The table of worst errors as Markdown."""
    if dtype not in kinds(record, energy):
        return f"Accuracy of {energy} in {dtype}: not run.\n"
    table = error_table(record, energy, dtype)
    lines = [f"{table.title}:", "", f"| {' | '.join(table.headings)} |", "|---" * len(table.headings) + "|"]
    lines += [f"| {' | '.join(row)} |" for row in table.rows]
    return "\n".join([*lines, "", *table.notes]) + "\n"


def worst_state(record: dict[str, Any], energy: str, variant: str) -> str | None:
    """The state at which a variant did worst, as ``yarnverify accuracy --replay`` takes it."""
    outputs = [
        cell["outputs"][output]
        for cell in record["cells"]
        if cell["energy"] == energy and cell["variant"] == variant and cell["dtype"] == "float64"
        for output in _OUTPUTS
    ]
    there = [found for found in outputs if isinstance(found["worst"], float | int) and found.get("replay")]
    return max(there, key=lambda found: found["worst"])["replay"] if there else None


def _entry(cell: dict[str, Any] | None) -> str:
    return "not run" if cell is None else " / ".join(_number(cell["outputs"][output]) for output in _OUTPUTS)


def _number(found: dict[str, Any]) -> str:
    worst = found["worst"]
    if worst is None:
        return "–"
    if worst == "inf":
        return "∞*"
    return number(worst) + _MARK[found["label"]]
