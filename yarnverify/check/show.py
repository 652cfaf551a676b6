"""What a check found: a record for JSON, and text for a terminal or a pipe."""

from __future__ import annotations

import re
import shutil
import sys
from typing import Any

import numpy as np

from yarnverify.accuracy.cells import significant
from yarnverify.accuracy.metrics import UNIT
from yarnverify.accuracy.rule import AMPLIFIED, EXACT, allowed
from yarnverify.check.command import Checked
from yarnverify.check.conventions import by_component
from yarnverify.check.judge import Block
from yarnverify.check.recognise import Diagnosis

RULE = (
    f"each block at each state: norm of the error <= ({EXACT:g} + {AMPLIFIED:g} K) u times norm of the truth, "
    "K its condition number"
)
_WORDS = {
    "pass": "pass", "not judged": "NOT JUDGED", "wrong": "WRONG", "approximate": "APPROXIMATE",
    "loses digits": "LOSES DIGITS", "no value": "NO VALUE",
}  # fmt: skip
_STYLE = {
    "pass": "green",
    "not judged": "magenta",
    "wrong": "bold red",
    "approximate": "red",
    "loses digits": "yellow",
    "no value": "magenta",
}


def record(checked: Checked) -> dict[str, Any]:
    """All of it, ready for JSON."""
    cases, convention = checked.cases, checked.convention
    return {
        "schema": 1,
        "target": checked.target,
        "energy": cases.energy.name,
        "dtype": cases.dtype,
        "unit": UNIT[cases.dtype],
        "states": len(cases),
        "rule": RULE,
        "passes": checked.passes,
        "convention": {
            "rows": list(convention.labels),
            "returns": [output.name for output in convention.outputs],
            "force": convention.force,
            "jacobian": convention.jacobian,
            "layout": convention.layout,
            "column_major": convention.column_major,
        },
        "blocks": [_block(checked, block, diagnosis) for block, diagnosis in checked.found],
        "troubles": [
            {"what": text, "states": count, "first": _state(checked, first)} for text, count, first in checked.troubles
        ],
        "not_tried": checked.left,
        "not_zero": checked.extra,
        "invented": checked.invented,
        "hints": checked.hints,
        "notes": checked.notes,
    }


def _block(checked: Checked, block: Block, diagnosis: Diagnosis) -> dict[str, Any]:
    return {
        "output": {"E": "energy", "G": "gradient", "H": "hessian"}[block.kind],
        "block": block.name,
        "passes": block.passes,
        "status": diagnosis.status,
        "reasons": list(diagnosis.reasons),
        "judged": int(block.judged.sum()),
        "worst": {
            **_state(checked, block.worst),
            "error": significant(block.error),
            "condition": significant(block.condition),
            "allowed": significant(allowed(block.condition)),
            "share": significant(block.share),
            "computed": [_number(value) for value in block.computed[:, block.worst]],
            "true": [_number(value) for value in block.true[:, block.worst]],
        },
    }


def _number(value: float) -> float | str:
    return float(value) if np.isfinite(value) else str(float(value))


def _state(checked: Checked, at: int) -> dict[str, Any]:
    cases = checked.cases
    labels = [
        f"{name}.{axis}" if axis else name
        for name, rows in cases.labels
        for axis in (("x", "y", "z") if rows.stop - rows.start == 3 else ("",))
    ]
    values = dict(zip(labels, cases.points.q[:, at].tolist(), strict=True))
    values |= {name: value[at] for name, value in by_component(cases.points.parameters, axis=0).items()}
    return {"tag": cases.tags[at], "state": {name: float(value).hex() for name, value in values.items()}}


def grouped(checked: Checked) -> list[tuple[list[Block], Diagnosis]]:
    """Blocks of one output with the same verdict and reasons together, in order.

    Reasons that differ in the numbers in brackets only are the same; the longest is kept.
    """
    groups: dict[Any, tuple[list[Block], Diagnosis]] = {}
    for block, diagnosis in checked.found:
        gist = tuple(re.sub(r" \(.*?\)|: .*", "", reason) for reason in diagnosis.reasons)
        same = diagnosis.reasons if diagnosis.status == "wrong" else gist
        blocks, longest = groups.get((block.kind, diagnosis.status, same), ([], diagnosis))
        longest = max(longest, diagnosis, key=lambda found: sum(map(len, found.reasons)))
        groups[block.kind, diagnosis.status, same] = ([*blocks, block], longest)
    return list(groups.values())


def names(blocks: list[Block]) -> str:
    """Blocks by name."""
    if blocks[0].kind == "E":
        return "energy"
    what = "gradient" if blocks[0].kind == "G" else "Hessian"
    if len(blocks) > 9:
        return f"{what}, {len(blocks)} blocks"
    return f"{what} {' '.join(block.name for block in blocks)}"


def worst_of(blocks: list[Block]) -> Block:
    return max(blocks, key=lambda block: block.share)


def show(checked: Checked) -> None:
    """Print what was found."""
    groups = grouped(checked)
    states = len(checked.cases)
    print(f"{checked.cases.energy.name}: {checked.target}, {states} states, u = {UNIT[checked.cases.dtype]:.3g}")
    for note in checked.notes:
        print(f"  {note}")
    if groups:
        _tables(groups)
    for text in lines(checked, groups):
        print(text)


def _tables(groups: list[tuple[list[Block], Diagnosis]]) -> None:
    if not sys.stdout.isatty():
        print()
        for blocks, diagnosis in groups:
            worst = worst_of(blocks)
            print(f"  {_WORDS[diagnosis.status]:<13}{names(blocks)}")
            for reason in diagnosis.reasons or ([] if worst.passes else ["nothing was recognised"]):
                print(f"  {'':<13}  {reason}")
            print(f"  {'':<13}  {measured(worst)}")
        return
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD)
    for heading, justify in (
        ("verdict", "left"),
        ("blocks", "left"),
        ("worst / u", "right"),
        ("K", "right"),
        ("what", "left"),
    ):
        table.add_column(heading, justify=justify)  # type: ignore[arg-type]
    for blocks, diagnosis in groups:
        worst = worst_of(blocks)
        what = "; ".join(diagnosis.reasons) or ("" if worst.passes else "nothing was recognised")
        style = _STYLE[diagnosis.status]
        table.add_row(
            f"[{style}]{_WORDS[diagnosis.status]}[/]", names(blocks), size(worst.error), size(worst.condition), what
        )
    Console(width=shutil.get_terminal_size((100, 24)).columns).print(table)


def size(value: float) -> str:
    return f"{value:.3g}"


def measured(block: Block) -> str:
    """The worst error in words."""
    if not block.passes and not np.any(block.true[:, block.worst]):
        return "worst where the true value is 0"
    return f"worst {size(block.error)} u at K = {size(block.condition)}, {times(block)}"


def times(block: Block) -> str:
    if block.passes:
        return f"{block.share:.2g} of what is allowed"
    return f"{size(block.share)} times what is allowed" if np.isfinite(block.share) else "not finite"


def lines(checked: Checked, groups: list[tuple[list[Block], Diagnosis]]) -> list[str]:
    """Everything but the table."""
    found = [""]
    for text, count, first in checked.troubles:
        found.append(f"  {text}: at {count} state{'s' * (count != 1)}, first {checked.cases.tags[first]}")
        found += _state_lines(checked, first)
    for label, value in checked.extra.items():
        why = "since the energy does not depend on it"
        found.append(f"  results for {label} must be 0, {why}; the largest is {size(value)}")
    failing = [block for blocks, _ in groups for block in blocks if not block.passes and block.judged.any()]
    if failing:
        mistaken = [block for blocks, diagnosis in groups for block in blocks if diagnosis.status == "wrong"]
        worst = worst_of(mistaken or failing)
        at = worst.worst
        entry = int(np.argmax(np.nan_to_num(np.abs(worst.computed[:, at] - worst.true[:, at]), nan=np.inf)))
        component = "" if worst.kind == "E" or worst.computed.shape[0] == 1 else f" (number {entry + 1})"
        found += [
            f"  Worst: {worst.title}, {checked.cases.tags[at]}: came {worst.computed[entry, at]:.17g}, "
            f"true {worst.true[entry, at]:.17g}{component}",
            *_state_lines(checked, at),
        ]
    if checked.left:
        found.append(f"  {checked.left} states were not tried any more.")
    if checked.invented:
        which = f"{checked.invented} states that have none (folded exactly, of length zero)"
        found.append(f"  Note: derivatives came back at {which}.")
    found += [f"  {hint[0].upper()}{hint[1:]}." for hint in checked.hints]
    if len(found) > 1:
        found.append("")
    judged = [block for blocks, _ in groups for block in blocks]
    bad = len([block for block in judged if not block.passes])
    if checked.passes:
        found.append(f"PASS: {_blocks(judged)}; {RULE}.")
    elif not judged:
        found.append("FAIL: nothing came back.")
    elif not bad:
        found.append(f"FAIL: {_blocks(judged)} right where judged, but see above.")
    else:
        found.append(f"FAIL: {bad} of {_blocks(judged)}; {RULE}.")
    return found


def _blocks(blocks: list[Block]) -> str:
    return f"{len(blocks)} block{'s' * (len(blocks) != 1)}"


def _state_lines(checked: Checked, at: int) -> list[str]:
    state = _state(checked, at)["state"]
    words = [f"{name} = {value}" for name, value in state.items()]
    return [f"      {', '.join(words[i : i + 4])}" for i in range(0, len(words), 4)]
