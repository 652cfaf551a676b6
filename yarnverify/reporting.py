"""``yarnverify report``: work out the records, then make the pages from the records alone."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from yarnverify.errors import InputError
from yarnverify.generation import Outcome, generate_kernels, settle_files
from yarnverify.library import MAIN_DOCUMENT, derivations
from yarnverify.show import mistake_lines, tally_lines
from yarnverify.verdicts import verdicts

_OTHERS = ("accuracy",)  # records that commands of their own write


def build_report(out: Path, check: bool, advance: Callable[[str, int], None] = lambda label, total: None) -> Outcome:
    """Write the report into a folder, or compare it with what is there.

    Parameters
    ----------
    out
        The folder; ``records/`` below it holds the JSON that the pages are made from.
    check
        Compare instead of writing.
    advance
        Called as each step is done.

    Raises
    ------
    InputError, NotRunError
        For derivations that cannot be read or proved, and files that cannot be written.
    """
    from yarnverify.report.pages import pages

    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is not a folder")
    records, lines, expected = _records(advance)
    texts = {
        f"records/{name}.json": json.dumps(record, indent=1, ensure_ascii=False) + "\n"
        for name, record in records.items()
    }
    texts |= pages({name: json.loads(texts[f"records/{name}.json"]) for name in records})
    there = {path.relative_to(out).as_posix() for pattern in ("*.md", "records/*.json") for path in out.glob(pattern)}
    there -= {f"records/{name}.json" for name in _OTHERS}
    outcome = settle_files(out, texts, check, sorted(there - set(texts)), "yarnverify report")
    outcome.lines = [*lines, *outcome.lines]
    outcome.differs |= not expected
    outcome.record = {"tally": records["verdicts"]["tally"], "as_expected": expected, "files": sorted(texts)}
    return outcome


def _records(advance: Callable[[str, int], None]) -> tuple[dict[str, Any], list[str], bool]:
    """The records behind the pages, what to say of them, and whether all is as expected."""
    from yarnverify.symbolic.declare import load_declarations
    from yarnverify.symbolic.explain import explain_energy

    found, took = verdicts(advance=advance)
    kernels = generate_kernels(check=True, advance=advance)
    declarations = load_declarations(derivations())
    energies = [energy for energy in declarations.energies if energy.document == MAIN_DOCUMENT]
    order = [part["section"] for part in found["completeness"]]
    energies.sort(key=lambda energy: order.index(energy.section) if energy.section in order else len(order))
    derived = {}
    for energy in energies:
        derived[energy.name] = {"section": energy.section, **explain_energy(energy, declarations)}
        advance(f"explaining {energy.name}", len(energies))
    lines = [*mistake_lines(found), *tally_lines(found), f"{took}."]
    if kernels.differs:
        lines.append("The kernels differ from what the derivations give; see: yarnverify generate --check")
    proved = all(record["all_proved"] for record in derived.values() if record["measures"])
    return (
        {"verdicts": found, "derivations": derived, "kernels": kernels.record},
        lines,
        found["as_expected"] and proved and not kernels.differs,
    )
