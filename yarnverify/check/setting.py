"""What a person says about an implementation, and the states and arguments that follow from it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.check.cases import declared, hard_cases
from yarnverify.check.conventions import Convention, Output, output_named, rows_in_order
from yarnverify.check.exchange import write_inputs
from yarnverify.check.expressions import assignments, evaluated
from yarnverify.errors import InputError
from yarnverify.library import derivations

Array = NDArray[Any]


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


def energy_of(target: str | None, options: Options) -> str:
    """The energy that is meant: as said, or the only one whose name is in the target's.

    Raises
    ------
    InputError
        Where it cannot be told.
    """
    if options.energy is not None:
        return options.energy
    names = [energy.name for energy in declared(options.derivations or derivations())]
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

    def outputs(self, names: Sequence[str], where: str = "--returns") -> tuple[Output, ...]:
        """Outputs by name; ``where`` they are named, for messages."""
        found = [output_named(name, self.convention, self.cases.labels, where) for name in names]
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
            try:
                value = evaluated(text, {**found, **base}, f"--with {name}")
            except InputError as error:
                if name in base:
                    raise InputError(
                        f"{error}; write an argument of yours on the left: {name} is the energy's"
                    ) from None
                raise
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
