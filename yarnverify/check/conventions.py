"""How an implementation is called, and what it returns: order of rows, sign, layout, names of the outputs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.errors import InputError

Array = NDArray[Any]
LAYOUTS = ("single", "component", "element")
SIGNED = {"energy": ("E", 1), "gradient": ("G", 1), "force": ("G", -1), "hessian": ("H", 1), "jacobian": ("H", -1)}
ALIASES = {
    "e": "energy", "v": "energy", "potential": "energy", "g": "gradient", "grad": "gradient", "f": "force", "forces": "force",
    "h": "hessian", "hess": "hessian", "k": "hessian", "stiffness": "hessian", "j": "jacobian", "jac": "jacobian",
    "dfdx": "jacobian",
}  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One entry of a state as the implementation has it.

    Attributes
    ----------
    label
        ``x0.x``, ``u1``, or what the person called it.
    index
        Of the row of the energy, None for a coordinate that the energy does not have.
    checked
        Whether results of a coordinate that the energy does not have must be zero.
    """

    label: str
    index: int | None
    checked: bool = True


@dataclass(frozen=True)
class Output:
    """One output: its name, which it is (E, G, H), its sign, and of a block the rows (and columns).

    Rows are places in the order of the convention.
    """

    name: str
    kind: str
    sign: int
    rows: tuple[int, ...] = ()
    columns: tuple[int, ...] = ()
    whole: bool = True

    @property
    def size(self) -> int:
        return max(1, len(self.rows)) * max(1, len(self.columns))


@dataclass(frozen=True)
class Convention:
    """How an implementation is called.

    Attributes
    ----------
    rows
        The entries of a state, in order.
    outputs
        In the order in which they come; empty until known.
    force, jacobian
        Whether gradients are forces, and Hessians are Jacobians of forces: both with the opposite sign.
    layout
        ``single``: one state a call, (rows,). ``component``: (rows, n). ``element``: (n, rows).
    column_major
        Whether matrices are stored column by column.
    dtype
        Of all numbers.
    """

    rows: tuple[Row, ...]
    outputs: tuple[Output, ...] = ()
    force: bool = False
    jacobian: bool = False
    layout: str = "single"
    column_major: bool = False
    dtype: str = "float64"

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(row.label for row in self.rows)


@dataclass
class Results:
    """What came back, in the energy's own order and sign.

    Attributes
    ----------
    energy, gradient, hessian
        (n,), (dof, n), (dof, dof, n); NaN where not given.
    given
        ``E``, ``G``, ``H`` to bool arrays of the shape of one state: what is returned at all.
    extra
        Labels of coordinates that the energy does not have to the largest size of what is returned for them, which must be 0.
    stray
        The same to what is returned, (n,), where it is not all zero.
    """

    energy: Array
    gradient: Array
    hessian: Array
    given: dict[str, Array]
    extra: dict[str, float] = field(default_factory=dict)
    stray: dict[str, Array] = field(default_factory=dict)

    def part(self, kind: str) -> Array:
        return {"E": self.energy, "G": self.gradient, "H": self.hessian}[kind]


def rows_in_order(order: str | None, labels: Sequence[tuple[str, slice]]) -> tuple[Row, ...]:
    """The rows of a state in a person's order.

    Parameters
    ----------
    order
        Names separated by commas: unknowns (``x0`` is three rows), single rows (``x0.x``), ``_`` for an entry to be passed
        over, any other name for a coordinate that the energy does not have. The energy's own order if None.
    labels
        The energy's unknowns and their rows.

    Raises
    ------
    InputError
        For an unknown that is missing or named twice.
    """
    places = dict(labels)
    single = {
        f"{name}.{axis}": rows.start + i for name, rows in labels for i, axis in enumerate("xyz") if size(rows) == 3
    }
    single |= {name: rows.start for name, rows in labels if size(rows) == 1}
    words = [name for name, _ in labels] if order is None else [word.strip() for word in order.split(",")]
    found: list[Row] = []
    for word in words:
        if word in places and size(places[word]) == 3:
            found += [Row(f"{word}.{axis}", places[word].start + i) for i, axis in enumerate("xyz")]
        elif word in single:
            found.append(Row(word, single[word]))
        elif word == "_":
            found.append(Row("_", None, False))
        elif re.fullmatch(r"[A-Za-z]\w*", word):
            found.append(Row(word, None))
        else:
            raise InputError(
                f"--order: {word!r} is no name; give unknowns such as {', '.join(places)}, separated by commas"
            )
    indices = [row.index for row in found if row.index is not None]
    missing = [label for label, index in single.items() if index not in indices]
    twice = [label for label, index in single.items() if indices.count(index) > 1]
    if missing or twice:
        few, names = len(missing or twice) == 1, ", ".join(missing or twice)
        what = f"{names} {'is' if few else 'are'} missing" if missing else f"{names} {'comes' if few else 'come'} twice"
        raise InputError(f"--order: {what}; every unknown must come once: {', '.join(places)}")
    return tuple(found)


def size(rows: slice) -> int:
    return int(rows.stop - rows.start)


def by_component(values: Mapping[str, Array], axis: int) -> dict[str, Array]:
    """Values by name, those of a vector, whose components lie along an axis, as one each: g.x, g.y, g.z."""
    found: dict[str, Array] = {}
    for name, value in values.items():
        parts = dict(zip("xyz", np.moveaxis(value, axis, 0), strict=True)) if value.ndim == 2 else {}
        found |= {f"{name}.{letter}": part for letter, part in parts.items()} or {name: value}
    return found


def output_named(
    text: str, convention: Convention, labels: Sequence[tuple[str, slice]], where: str = "--returns"
) -> Output | None:
    """An output by name, None for ``_``.

    Raises
    ------
    InputError
        For a name that means nothing.
    """
    if text == "_":
        return None
    name = ALIASES.get(text.lower(), text.lower())
    every = tuple(range(len(convention.rows)))
    if name in SIGNED:
        kind, sign = SIGNED[name]
        if (name == "gradient" and convention.force) or (name == "hessian" and convention.jacobian):
            sign = -1
        return Output(text, kind, sign, () if kind == "E" else every, every if kind == "H" else ())
    places = dict(labels)
    parts = [part.strip() for part in re.split(r"[,:]", text)]
    of_force = force_block(text, list(places))
    if of_force:
        blocks = [_rows_of(convention, places[part]) for part in of_force]
        return Output(text, "GH"[len(blocks) - 1], -1, blocks[0], blocks[1] if len(blocks) == 2 else (), False)
    if len(parts) > 2 or any(part not in places for part in parts):
        raise InputError(
            f"{where}: {text!r} is no output; there are energy, gradient or force, hessian or jacobian, blocks of the gradient "
            f"such as {next(iter(places))} or of the force such as F_{next(iter(places))}, blocks of the Hessian such as "
            f"{text_pair(places)} or of the Jacobian such as dF_{text_pair(places).replace(',', '/d')}, and _ to pass one over"
        )
    rows = [_rows_of(convention, places[part]) for part in parts]
    if len(parts) == 1:
        return Output(text, "G", -1 if convention.force else 1, rows[0], (), False)
    return Output(text, "H", -1 if convention.jacobian else 1, rows[0], rows[1], False)


def force_block(text: str, labels: Sequence[str]) -> tuple[str, ...]:
    """The unknowns of a block of the force or its Jacobian, as the document and code write them: F_x1, dF_x1/du1, dFx1dx1."""
    for pattern in (r"f_?(.+)", r"df_?(.+?)_?/?d_?(.+)"):
        found = re.fullmatch(pattern, text, re.IGNORECASE)
        if found is not None and all(name in labels for name in found.groups()):
            return found.groups()
    return ()


def text_pair(places: Mapping[str, slice]) -> str:
    names = list(places)
    return f"{names[0]},{names[-1]}"


def _rows_of(convention: Convention, rows: slice) -> tuple[int, ...]:
    """Places of an unknown's rows, in the energy's order."""
    at = {row.index: place for place, row in enumerate(convention.rows) if row.index is not None}
    return tuple(at[index] for index in range(rows.start, rows.stop))


def decoded(flat: Array, convention: Convention, dof: int) -> Results:
    """Results in the energy's own order and sign.

    Parameters
    ----------
    flat
        (n, total): for each state all outputs one after the other, each row by row (or column by column).
    convention
        With its outputs.
    dof
        Rows of the energy.
    """
    n = flat.shape[0]
    results = Results(
        np.full(n, np.nan),
        np.full((dof, n), np.nan),
        np.full((dof, dof, n), np.nan),
        {"E": np.zeros((), bool), "G": np.zeros(dof, bool), "H": np.zeros((dof, dof), bool)},
    )
    at = 0
    for output in convention.outputs:
        values = flat[:, at : at + output.size].T * output.sign
        at += output.size
        if output.kind == "E":
            results.energy, results.given["E"] = values[0], np.ones((), bool)
        elif output.kind == "G":
            for place, value in zip(output.rows, values, strict=True):
                _put(results, convention, (place,), value)
        else:
            shape = (len(output.rows), len(output.columns))
            grid = (
                values.reshape(*shape[::-1], n).swapaxes(0, 1) if convention.column_major else values.reshape(*shape, n)
            )
            for i, row in enumerate(output.rows):
                for j, column in enumerate(output.columns):
                    _put(results, convention, (row, column), grid[i, j])
    return results


def _put(results: Results, convention: Convention, places: tuple[int, ...], value: Array) -> None:
    rows = [convention.rows[place] for place in places]
    indices = tuple(row.index for row in rows)
    if None not in indices:
        kind = "G" if len(indices) == 1 else "H"
        results.part(kind)[indices] = value
        results.given[kind][indices] = True
    elif all(row.checked for row in rows):
        label = " by ".join(row.label for row in rows)
        with np.errstate(invalid="ignore"):
            worst = float(np.max(np.where(np.isnan(value), 0.0, np.abs(value)))) if value.size else 0.0
        results.extra[label] = max(worst, results.extra.get(label, 0.0))
        if worst:
            results.stray[label] = value
