"""Tables of the accuracy record, as Markdown."""

from __future__ import annotations

from typing import Any

_OUTPUTS = ("E", "G", "H")
_MARK = {"exact": "", "conditioning": "ᶜ", "computation": "*", "not finite": "*"}


def accuracy_table(record: dict[str, Any], energy: str, dtype: str = "float64") -> str:
    """Worst errors of an energy: a row a regime, a column a variant.

    Parameters
    ----------
    record
        As ``yarnverify accuracy`` writes it.
    energy, dtype
        Which cells.
    """
    cells = [cell for cell in record["cells"] if cell["energy"] == energy and cell["dtype"] == dtype]
    if not cells:
        return f"Accuracy of {energy} in {dtype}: not run.\n"
    variants = list(dict.fromkeys(cell["variant"] for cell in cells))
    found = {(cell["regime"], cell["variant"]): cell for cell in cells}
    unit = {"float64": "2^-53", "float32": "2^-24"}[dtype]
    lines = [
        f"Worst error of energy / gradient / Hessian in units of {unit} ({dtype}), "
        f"{record['points']} states a regime, normwise by blocks:",
        "",
        "| regime | " + " | ".join(variants) + " |",
        "|---" * (len(variants) + 1) + "|",
    ]
    for regime in dict.fromkeys(cell["regime"] for cell in cells):
        entries = [_entry(found.get((regime, variant))) for variant in variants]
        lines.append(f"| {regime} | " + " | ".join(entries) + " |")
    lines += [
        "",
        "No mark: at most 16 units. ᶜ: more, explained by the condition of the state (16 units and 8 for each unit of the "
        "condition number). *: lost by the computation. ∞: not finite where the true result is. –: no true result in range.",
    ]
    lines += [f"Not run: {text}." for text in record["not_run"] if energy in text.split(":")[0].split()]
    return "\n".join(lines) + "\n"


def _entry(cell: dict[str, Any] | None) -> str:
    return "not run" if cell is None else " / ".join(_number(cell["outputs"][output]) for output in _OUTPUTS)


def _number(found: dict[str, Any]) -> str:
    worst = found["worst"]
    if worst is None:
        return "–"
    if worst == "inf":
        return "∞*"
    text = f"{worst:.2g}" if worst < 1000 else f"{worst:.0e}".replace("e+", "e").replace("e0", "e")
    return text + _MARK[found["label"]]
