"""The equations of an energy as LaTeX: the document's own, corrected where it is wrong; or the derivation if it prints none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.explain import explain, explanation


def latex_text(energy: Energy, folder: Path) -> str:
    """A LaTeX document that stands by itself.

    Parameters
    ----------
    energy, folder
        As declared, and where.
    """
    body = _equations(energy, folder) if energy.document else explain(explanation(energy.name, folder), "latex")
    return "\n".join(
        [
            f"% Written by: yarnverify export {energy.name}",
            r"\documentclass{article}",
            r"\usepackage{amsmath}",
            r"\usepackage[landscape,margin=1cm]{geometry}",
            r"\begin{document}",
            "",
            rf"\section*{{{energy.section or energy.name}}}",
            "",
            body.strip(),
            "",
            r"\end{document}",
            "",
        ]
    )


def _equations(energy: Energy, folder: Path) -> str:
    """The numbered equations of the energy's section and the definitions before the first, each with its correction."""
    from yarnverify.verdicts import verdicts

    record, _ = verdicts(folder / energy.document, str(folder))
    found: dict[tuple[str, int, int], dict[str, Any]] = {}
    for claim in [*record["claims"], *record["given"]]:
        if claim.get("section") in ("", None, energy.section) and claim["equation"] in record["equations"]:
            found.setdefault((claim["equation"], claim["line"], claim.get("column", 1)), claim)
    displays: dict[str, list[str]] = {}
    changes: dict[str, str] = {}
    for (number, _, _), claim in sorted(found.items(), key=lambda item: item[0][1:]):
        displays.setdefault(number, []).append(claim.get("correction") or claim["printed"])
        if claim.get("change"):
            changes[number] = claim["change"]
    lines = []
    for number, relations in displays.items():
        if number in changes:
            lines.append(f"% equation ({number}) is corrected: {changes[number]}")
        lines += [r"\begin{equation*}", r", \quad ".join(relations), rf"\tag{{{number}}}", r"\end{equation*}", ""]
    return "\n".join(lines)
