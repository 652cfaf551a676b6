"""What is kept of a sweep, ``reports/records/accuracy.json``, and how the next sweep is compared with it.

The states of a record are the same bits on every machine. So are the results of variants that call nothing but correctly
rounded operations; others depend on the machine's library functions, so a record is compared by size, not by text.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from yarnverify.accuracy.cells import Unit
from yarnverify.accuracy.sweep import Profile
from yarnverify.errors import InputError, why

WORSE = 2.0  # a tolerated growth of an error
_ONE = 1.0  # an error of up to one unit is as good as none


def make_record(
    profile: Profile,
    units: Sequence[Unit],
    results: Sequence[dict[str, Any]],
    missing: Sequence[str],
    command: str = "yarnverify accuracy",
) -> dict[str, Any]:
    """The record of a sweep."""
    return {
        "schema": 1,
        "profile": profile.name,
        "points": profile.count,
        "seed": units[0].seed if units else None,
        "command": command,
        "not_run": list(missing),
        "cells": [cell for result in results for cell in result.get("cells", ())],
        "curves": [result["curve"] for result in results if "curve" in result],
    }


def record_text(record: dict[str, Any]) -> str:
    """JSON with a line for each cell and curve, so that a change of one shows as one line."""
    parts = []
    for key, value in record.items():
        if key in ("cells", "curves") and value:
            lines = ",\n  ".join(json.dumps(entry, ensure_ascii=False) for entry in value)
            parts.append(f"{json.dumps(key)}: [\n  {lines}\n ]")
        else:
            parts.append(f"{json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}")
    return "{\n " + ",\n ".join(parts) + "\n}\n"


def read_record(path: Path) -> dict[str, Any]:
    """A record from a file.

    Raises
    ------
    InputError
        Where there is none.
    """
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        reason = why(error)
        raise InputError(f"{path}: {reason}; the same command with --write instead of --check makes it") from None
    except ValueError as error:
        raise InputError(f"{path}: is not JSON: {error}") from None
    if not isinstance(record, dict) or record.get("schema") != 1 or not isinstance(record.get("cells"), list):
        raise InputError(f"{path}: is no record of yarnverify accuracy")
    return record


def key_of(cell: dict[str, Any]) -> tuple[str, str, str, str]:
    return cell["energy"], cell["variant"], cell["dtype"], cell["regime"]


def missed_targets(record: dict[str, Any], command: str = "yarnverify accuracy") -> list[str]:
    """One line for each output of a cell whose error exceeds its target, with the ``command`` that replays it."""
    lines = []
    for cell in record["cells"]:
        name = ", ".join(key_of(cell))
        if cell["target"] is None:
            continue
        if cell["invented"]:
            lines.append(f"{name}: {cell['invented']} results where there are none")
        for output, found in cell["outputs"].items():
            share = found.get("of_target")
            if share is not None and float(share) > 1:
                again = found.get("replay_target", found["replay"])
                lines.append(
                    f"{name}: {output} exceeds its target {share}-fold (worst error {found['worst']} u); "
                    f"{command} --replay '{again}'"
                )
    return lines


def grown(old: dict[str, Any], new: dict[str, Any], whole: bool = True) -> list[str]:
    """One line for each error that grew beyond twice its record, and for each cell that only one of the two has.

    Parameters
    ----------
    old, new
        Records of the same profile.
    whole
        Whether the new one should have every cell of the old one.
    """
    known = {key_of(cell): cell for cell in old["cells"]}
    lines = []
    for cell in new["cells"]:
        name, before = ", ".join(key_of(cell)), known.pop(key_of(cell), None)
        if before is None:
            lines.append(f"{name}: is not in the record; write it with: yarnverify accuracy --write")
            continue
        for output, found in cell["outputs"].items():
            for what in ("worst", "componentwise"):
                was, now = before["outputs"][output].get(what), found.get(what)
                if now is None:
                    continue
                if was is None or float(now) > WORSE * max(float(was), _ONE):
                    kind, record = "normwise" if what == "worst" else what, "none" if was is None else f"{was} u"
                    again = f"yarnverify accuracy --replay '{found['replay']}'"
                    lines.append(f"{name}: {output} {kind} error {now} u, in the record {record}; {again}")
    if whole:
        lines += [f"{', '.join(key)}: is in the record, and was not run" for key in known]
    return lines
