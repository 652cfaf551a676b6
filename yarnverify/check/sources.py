"""Where results come from: a Python or C function in another process, a command line, or a file."""

from __future__ import annotations

import shlex
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.check.conventions import Convention
from yarnverify.check.exchange import key_of, read_results, write_inputs
from yarnverify.check.formats import format_of
from yarnverify.check.running import Ran, ending, run_target
from yarnverify.check.setting import Options, Setting
from yarnverify.errors import InputError, NotRunError

Array = NDArray[Any]
Advance = Callable[[str, int], None]
LIBRARIES = (".so", ".dylib", ".dll")
WHOLE = ("energy", "gradient", "hessian")


@dataclass(frozen=True)
class Again:
    """An implementation that can be called once more.

    Attributes
    ----------
    run
        Takes (m, rows) of states, the number of the case that each is of, and (m,) of arguments that are to be others; gives
        (m, total), or None where it does not come back.
    by_name
        Whether it takes its unknowns by name.
    states
        (n, rows) as it was called with.
    positions
        What it was passed after the state, in order and not by name: (n,) by what a person called it.
    """

    run: Callable[[Array, Array, Mapping[str, Array]], Array | None]
    by_name: bool
    states: Array
    positions: Mapping[str, Array]


def called(
    target: str,
    setting: Setting,
    options: Options,
    q: Array,
    values: dict[str, Array],
    notes: list[str],
    advance: Advance,
) -> tuple[Ran, Convention | None, Again | None]:
    place = target.rpartition(":")[0] if ":" in target[2:] else target
    library = Path(place).suffix in LIBRARIES
    if library and (place == target or not target.rpartition(":")[2]):
        raise InputError(f"{target}: say which function, as {target}:FUNCTION")
    if library:
        if not Path(place).is_file():
            raise InputError(f"{place}: there is no such file")
        target = f"{Path(place).resolve()}:{target.rpartition(':')[2]}"
        if options.layout not in ("auto", "single"):
            raise InputError("--layout: a C function takes one state a call")
    returns = list(options.returns) or (list(WHOLE) if library else None)
    known = setting.outputs(returns or [])
    task = {
        "kind": "c" if library else "python",
        "target": target,
        "unknowns": [label for label, _ in setting.cases.labels]
        + [row.label for row in setting.rows if row.index is None],
        "parameters": [p for p in setting.cases.points.parameters if p not in setting.fixed],
        "arguments": setting.parameters,
        "returns": [output.name for output in known] if library else returns,
        "sizes": {output.name: output.size for output in known},
        "pieces": [(label, rows.stop - rows.start) for label, rows in setting.cases.labels],
        "points": _points_first([row.label for row in setting.rows]),
        "layout": options.layout,
        "dtype": setting.cases.dtype,
    }
    ran = run_target(task, q, values, setting.groups(), options.time_limit, advance)
    if ran.decided is None:
        return ran, None, None
    convention = replace(
        setting.convention,
        outputs=setting.outputs(ran.decided["returns"], "--returns" if options.returns else f"{target} returns"),
        layout=ran.decided["layout"],
    )
    if not options.returns and not library:
        notes.append(f"taken as: {', '.join(ran.decided['returns'])}; called with {_manner(ran.decided['layout'])}")
    if ran.decided["dtype"] == "float32" and setting.cases.dtype == "float64":
        notes.append("gives float32: hold it to single precision with --float32")

    def run(states: Array, at: Array, others: Mapping[str, Array]) -> Array | None:
        by_row = states.T
        repeated = {name: value[at] for name, value in values.items()}
        columns = {row.label: by_row[i] for i, row in enumerate(setting.rows)}
        for label, rows in setting.cases.labels:
            parts = [columns[f"{label}.{axis}"] for axis in "xyz"] if rows.stop - rows.start == 3 else [columns[label]]
            repeated[label] = np.column_stack(parts) if len(parts) == 3 else parts[0]
        repeated |= others
        try:
            found = run_target(
                {**task, "layout": convention.layout}, states, repeated, [(0, len(states))], options.time_limit
            )
        except (InputError, NotRunError):
            return None
        return found.flat if found.decided is not None and found.flat.shape[1] == ran.flat.shape[1] else None

    positions = {name: values[name] for name in setting.parameters} if library else {}
    return ran, convention, Again(run, bool(ran.decided.get("by_name")), q, positions)


def _points_first(labels: Sequence[str]) -> int:
    """How many whole points come first, all other rows being scalars; 0 where the rows are not of that kind."""
    first = [label.endswith((".x", ".y", ".z")) for label in labels]
    count = sum(first)
    return count // 3 if 0 < count < len(labels) and all(first[:count]) else 0


def _manner(layout: str) -> str:
    return {"single": "one state at a time", "component": "arrays (rows, states)", "element": "arrays (states, rows)"}[
        layout
    ]


def from_files(
    command: str | None,
    outputs: Path | None,
    kind: str,
    setting: Setting,
    options: Options,
    q: Array,
    values: dict[str, Array],
    notes: list[str],
) -> tuple[Ran, Convention | None]:
    given = {name: values[name] for name in setting.parameters}
    key, n = key_of(q, given), len(setting.cases)
    if outputs is not None:
        return _results(outputs, setting, options, key, notes)
    assert command is not None
    if "{in}" not in command or "{out}" not in command:
        raise InputError("--command: must hold {in} and {out}, the files that it reads and writes")
    with tempfile.TemporaryDirectory(prefix="yarnverify-check-") as folder:
        source, sink = (Path(folder) / f"{name}.{kind}" for name in ("in", "out"))
        write_inputs(source, setting.cases.energy.name, setting.convention, q, given, setting.cases.tags)
        words = [word.replace("{in}", str(source)).replace("{out}", str(sink)) for word in shlex.split(command)]
        limit = max(60.0, options.time_limit)
        try:
            done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, timeout=limit)
        except FileNotFoundError:
            raise InputError(f"--command: there is no program {words[0]}") from None
        except PermissionError:
            raise InputError(f"--command: {words[0]} cannot be executed") from None
        except subprocess.TimeoutExpired:
            return Ran(np.zeros((n, 0)), np.zeros(n, bool), None, {0: f"does not end within {limit:g} s"}), None
        if done.returncode:
            said = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
            text = f"ends with {ending(done.returncode)}" + (f" ({said[0][:160]})" if said else "")
            return Ran(np.zeros((n, 0)), np.zeros(n, bool), None, {0: text}), None
        if not sink.exists():
            raise InputError(f"--command: wrote no file {sink.name}")
        return _results(sink, setting, options, key, notes)


def _results(path: Path, setting: Setting, options: Options, key: str, notes: list[str]) -> tuple[Ran, Convention]:
    """What a file holds: what a person says, or else all outputs that it has by name, or that fill a line of a CSV file."""
    by_line = format_of(path, "--outputs").read is None
    names: Sequence[str] = options.returns or (WHOLE if by_line else (*WHOLE, "force", "jacobian"))
    wanted = [(output.name, output.size) for output in setting.outputs(names)]
    if by_line and not options.returns:
        wanted = _fitting(path, wanted)
    n = len(setting.cases)
    names, flat = read_results(path, wanted, n, key, bool(options.returns))
    if not options.returns:
        notes.append(f"taken as: {', '.join(names)}")
    return Ran(flat, np.ones(n, bool), {}), replace(setting.convention, outputs=setting.outputs(names))


def _fitting(path: Path, wanted: list[tuple[str, int]]) -> list[tuple[str, int]]:
    """The first few outputs whose numbers fill a line of a CSV file; all of them if none do."""
    try:
        line = path.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-1:]
    except OSError:
        return wanted
    count = len(line[0].replace(",", " ").replace(";", " ").split()) if line else 0
    for number in range(1, len(wanted) + 1):
        if sum(size for _, size in wanted[:number]) == count:
            return wanted[:number]
    return wanted
