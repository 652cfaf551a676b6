"""``yarnverify check``: call somebody's implementation, judge every block, say what is wrong."""

from __future__ import annotations

import importlib
import re
import shlex
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.check.cases import Cases, hard_cases
from yarnverify.check.conventions import Convention, Output, Results, decoded, output_named, rows_in_order
from yarnverify.check.exchange import key_of, kind_of, read_results, write_inputs
from yarnverify.check.expressions import assignments, evaluated
from yarnverify.check.hints import factor_hints, order_hint, sign_hints
from yarnverify.check.judge import Block, judged, narrowed
from yarnverify.check.recognise import Diagnosis, Judge
from yarnverify.check.running import Ran, ending, run_target
from yarnverify.errors import InputError, NotRunError
from yarnverify.library import derivations

Array = NDArray[Any]
Advance = Callable[[str, int], None]
LIBRARIES = (".so", ".dylib", ".dll")
WHOLE = ("energy", "gradient", "hessian")


@dataclass(frozen=True)
class Options:
    """What a person says about an implementation; see the command's help."""

    energy: str | None = None
    order: str | None = None
    returns: tuple[str, ...] = ()
    force: bool = False
    jacobian: bool = False
    layout: str = "auto"
    column_major: bool = False
    float32: bool = False
    given: tuple[str, ...] = ()
    fix: tuple[str, ...] = ()
    count: int = 16
    regimes: tuple[str, ...] = ()
    extreme: bool = False
    time_limit: float = 10.0
    derivations: Path | None = None


@dataclass
class Checked:
    """All that was found.

    Attributes
    ----------
    target, cases, convention
        What was checked, on what, and how it was called.
    found
        Each block and what is wrong with it.
    troubles
        What happened at how many states, and the first of them: crashes, exceptions.
    left
        States that were not tried, since too many ended the process.
    extra
        Coordinates that the energy does not have, and the largest result for each, which must be 0.
    invented
        How many states without derivatives came back with some.
    hints, notes
        Conventions that would match; what was taken for granted.
    """

    target: str
    cases: Cases
    convention: Convention
    found: list[tuple[Block, Diagnosis]]
    troubles: list[tuple[str, int, int]] = field(default_factory=list)
    left: int = 0
    extra: dict[str, float] = field(default_factory=dict)
    invented: int = 0
    hints: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def passes(self) -> bool:
        return all(block.passes for block, _ in self.found) and not self.troubles and not any(self.extra.values())


def energy_of(target: str | None, options: Options) -> str:
    """The energy that is meant: as said, or the only one whose name is in the target's.

    Raises
    ------
    InputError
        Where it cannot be told.
    """
    from yarnverify.symbolic.declare import load_declarations

    if options.energy is not None:
        return options.energy
    names = [energy.name for energy in load_declarations(options.derivations or derivations()).energies]
    said = [target or "", *_functions(target or "")]
    found = [name for name in names if any(name in text for text in said)]
    if len(found) != 1:
        raise InputError(f"say which energy with --energy; there are {', '.join(names)}")
    return found[0]


def _functions(target: str) -> list[str]:
    """Names of the functions of a Python file, which may say what they are for."""
    path = Path(target)
    if path.suffix != ".py" or not path.is_file():
        return []
    return re.findall(r"^def ([a-z]\w*)", path.read_text(encoding="utf-8", errors="replace"), re.MULTILINE)


class Setting:
    """States in somebody's order, and their arguments by name."""

    def __init__(self, energy: str, options: Options) -> None:
        dtype = "float32" if options.float32 else "float64"
        if options.count < 1:
            raise InputError(f"--count {options.count}: give a positive number")
        if not options.time_limit > 0:
            raise InputError(f"--time-limit {options.time_limit}: give a positive number of seconds")
        fixed = {name: evaluated(text, {}, "--fix") for name, text in assignments(options.fix, "--fix").items()}
        self.cases = hard_cases(
            energy,
            options.derivations,
            dtype,
            options.count,
            options.regimes,
            options.extreme,
            tuple(sorted(fixed.items())),
        )
        self.fixed = set(fixed)
        self.rows = rows_in_order(options.order, self.cases.labels)
        self.convention = Convention(
            self.rows, (), options.force, options.jacobian, options.layout, options.column_major, dtype
        )
        self.given = assignments(options.given, "--with")

    def outputs(self, names: Sequence[str]) -> tuple[Output, ...]:
        found = [output_named(name, self.convention, self.cases.labels) for name in names]
        return tuple(output for output in found if output is not None)

    @property
    def parameters(self) -> list[str]:
        """Names of the arguments after the state: as said, or the energy's parameters that are not fixed."""
        labels = {label for label, _ in self.cases.labels} | {row.label for row in self.rows}
        said = [name for name in self.given if name not in labels]
        return said or [name for name in self.cases.points.parameters if name not in self.fixed]

    def values(self) -> dict[str, Array]:
        """(n,) or (n, 3) of everything that has a name: unknowns, parameters, what was said, coordinates of others."""
        base = self.cases.values()
        found: dict[str, Any] = dict(base)
        for name, text in self.given.items():
            value = evaluated(text, {**found, **base}, f"--with {name}")
            found[name] = np.broadcast_to(value, (3, len(self.cases)) if np.ndim(value) == 2 else (len(self.cases),))
        for row in self.rows:
            if row.index is None and row.label not in found:
                found[row.label] = self._other(row.label)
        return {name: np.array(value.T, dtype=self.cases.dtype) for name, value in found.items()}

    def _other(self, label: str) -> Array:
        """A coordinate that the energy does not have: in the middle of its own, or as its number says."""
        own = [self.cases.points.q[rows.start] for _, rows in self.cases.labels if rows.stop - rows.start == 1]
        digits = "".join(c for c in label if c.isdigit())
        return np.mean(own, axis=0) if own else np.full(len(self.cases), float(digits or 0))

    def states(self, values: Mapping[str, Array]) -> Array:
        """(n, rows) in somebody's order."""
        q = self.cases.points.q
        columns = [q[row.index] if row.index is not None else values[row.label] for row in self.rows]
        return np.column_stack(columns).astype(self.cases.dtype)

    def groups(self) -> list[tuple[int, int]]:
        """Ranges of states of one regime."""
        n, regime = len(self.cases), self.cases.regime
        return list(pairwise([0, *(i for i in range(1, n) if regime(i) != regime(i - 1)), n]))


def check(
    target: str | None, options: Options, command: str | None = None, outputs: Path | None = None, kind: str = "json",
    advance: Advance = lambda label, total: None,
) -> Checked:  # fmt: skip
    """Check one implementation.

    Parameters
    ----------
    target
        ``module:function``, ``file.py:function``, a module or file with functions of known names, ``library.so:function``.
    options
        How it is called.
    command, outputs
        Instead of a target: a command line with ``{in}`` and ``{out}``, or a file with results.
    kind
        Of the files of a command: json, npz or csv.

    Raises
    ------
    InputError
        Where the target is not there, or the options do not fit it.
    NotRunError
        Where it could not be run here.
    """
    if sum(given is not None for given in (target, command, outputs)) != 1:
        raise InputError("give one of: a target, --command, --outputs")
    setting = Setting(energy_of(target or command, options), options)
    values = setting.values()
    q = setting.states(values)
    notes: list[str] = []
    run_again = None
    if target is not None:
        ran, convention, run_again = _called(target, setting, options, q, values, notes, advance)
    else:
        ran, convention = _from_files(command, outputs, kind, setting, options, q, values)
    name = target or command or str(outputs)
    if convention is None:
        return Checked(
            name, setting.cases, setting.convention, [], _troubles(ran, setting.cases), ran.left, notes=notes
        )
    return _judged(name, setting.cases, convention, ran, notes, run_again, advance)


def write_states(path: Path, options: Options) -> str:
    """Write the states that an implementation in any language is to be tried on; one line that says what was written.

    Raises
    ------
    InputError, NotRunError
        Where the options do not fit, or the file cannot be written.
    """
    setting = Setting(energy_of(str(path), options), options)
    values = setting.values()
    given = {name: values[name] for name in setting.parameters}
    write_inputs(path, setting.cases.energy.name, setting.convention, setting.states(values), given, setting.cases.tags)
    columns = ", ".join([*setting.convention.labels, *given])
    return f"{path}: {len(setting.cases)} states of {setting.cases.energy.name}: {columns}"


def _called(
    target: str,
    setting: Setting,
    options: Options,
    q: Array,
    values: dict[str, Array],
    notes: list[str],
    advance: Advance,
) -> tuple[Ran, Convention | None, Callable[[Array, Array], Array | None] | None]:
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
        "layout": options.layout,
        "dtype": setting.cases.dtype,
    }
    ran = run_target(task, q, values, setting.groups(), options.time_limit, advance)
    if ran.decided is None:
        return ran, None, None
    convention = replace(
        setting.convention, outputs=setting.outputs(ran.decided["returns"]), layout=ran.decided["layout"]
    )
    if not options.returns and not library:
        notes.append(f"taken as: {', '.join(ran.decided['returns'])}; called with {_manner(ran.decided['layout'])}")
    if ran.decided["dtype"] == "float32" and setting.cases.dtype == "float64":
        notes.append("gives float32: hold it to single precision with --float32")

    def again(states: Array, at: Array) -> Array | None:
        by_row = states.T
        repeated = {name: value[at] for name, value in values.items()}
        columns = {row.label: by_row[i] for i, row in enumerate(setting.rows)}
        for label, rows in setting.cases.labels:
            parts = [columns[f"{label}.{axis}"] for axis in "xyz"] if rows.stop - rows.start == 3 else [columns[label]]
            repeated[label] = np.column_stack(parts) if len(parts) == 3 else parts[0]
        try:
            found = run_target(
                {**task, "layout": convention.layout}, states, repeated, [(0, len(states))], options.time_limit
            )
        except (InputError, NotRunError):
            return None
        return found.flat if found.decided is not None and found.flat.shape[1] == ran.flat.shape[1] else None

    return ran, convention, again


def _manner(layout: str) -> str:
    return {"single": "one state at a time", "component": "arrays (rows, states)", "element": "arrays (states, rows)"}[
        layout
    ]


def _from_files(
    command: str | None,
    outputs: Path | None,
    kind: str,
    setting: Setting,
    options: Options,
    q: Array,
    values: dict[str, Array],
) -> tuple[Ran, Convention | None]:
    given = {name: values[name] for name in setting.parameters}
    key = key_of(q, given)
    wanted = [(output.name, output.size) for output in setting.outputs(options.returns or WHOLE)]
    n = len(setting.cases)
    if outputs is not None:
        if kind_of(outputs, "--outputs") == ".csv" and not options.returns:
            wanted = _fitting(outputs, wanted)
        names, flat = read_results(outputs, wanted, n, key, bool(options.returns))
        return Ran(flat, np.ones(n, bool), {}), replace(setting.convention, outputs=setting.outputs(names))
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
        if kind == "csv" and not options.returns:
            wanted = _fitting(sink, wanted)
        names, flat = read_results(sink, wanted, n, key, bool(options.returns))
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


def _judged(
    name: str, cases: Cases, convention: Convention, ran: Ran, notes: list[str],
    again: Callable[[Array, Array], Array | None] | None, advance: Advance,
) -> Checked:  # fmt: skip
    results = decoded(ran.flat, convention, cases.dof)
    blocks = judged(results, cases, ran.done)
    judge = Judge(cases, blocks, lambda: printed(cases))
    found = []
    for block in blocks:
        diagnosis = judge.diagnosis(block)
        if diagnosis.status in ("wrong", "approximate"):
            block = narrowed(block, cases, judge.plain & ~np.isinf(block.errors))  # the plainest state shows it best
        found.append((block, diagnosis))
        advance("judging", len(blocks))
    checked = Checked(name, cases, convention, found, notes=notes, extra={k: v for k, v in results.extra.items() if v})
    checked.left = ran.left
    checked.troubles = _troubles(ran, cases)
    checked.invented = _invented(results, cases, ran)
    if not checked.passes:
        checked.hints = sign_hints(found, convention) + factor_hints(found, cases)
        unknown = any(
            (diagnosis.status == "wrong" and not diagnosis.reasons) or diagnosis.status == "no value"
            for _, diagnosis in found
        )
        if again is not None and unknown and not checked.hints:
            by_name = bool(ran.decided and ran.decided.get("by_name"))
            checked.hints = order_hint(convention, cases, again, by_name)
    return checked


def _troubles(ran: Ran, cases: Cases) -> list[tuple[str, int, int]]:
    """What happened, at how many states, and the first of them; refusing a state without value is no trouble."""
    has = cases.valued
    found: dict[str, list[int]] = {}
    for at, text in ran.troubles.items():
        ends = text.startswith(
            ("crashes", "does not come back", "does not end", "ends", "it calls exit", "MemoryError: ")
        )
        if ends or has[at]:
            found.setdefault(text.removeprefix("MemoryError: "), []).append(at)
    return [(text, len(states), states[0]) for text, states in found.items()]


def _invented(results: Results, cases: Cases, ran: Ran) -> int:
    """States without derivatives at which finite ones came back."""
    finite = np.zeros(len(cases), bool)
    for kind in "GH":
        given = results.given[kind]
        if given.any():
            finite |= np.isfinite(results.part(kind)[given]).all(axis=0)
    return int((finite & ran.done & ~cases.truth.has_derivatives).sum())


def printed(cases: Cases) -> dict[str, Array] | None:
    """What the formulas give as the document prints them; None where it prints none."""
    try:
        module = importlib.import_module(f"yarnverify.kernels.printed.{cases.energy.name}")
    except ModuleNotFoundError:
        return None
    _, gradient, hessian = module.evaluate(cases.points.q, **cases.points.parameters, errors="mask")
    return {"G": np.asarray(gradient), "H": np.asarray(hessian)}
