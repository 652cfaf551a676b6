"""Golden vectors: states of the hard cases, the correctly rounded results, and the condition number of every block."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.metrics import blocks_of
from yarnverify.check.cases import Cases, hard_cases
from yarnverify.check.conventions import by_component
from yarnverify.symbolic.emit import dof_labels, given_symbols

Array = NDArray[Any]
Advance = Callable[[str, int], None]


@dataclass(frozen=True)
class Vectors:
    """Golden vectors, element first.

    Attributes
    ----------
    energy, summary, unit
        Which energy.
    rows, parameters, units
        Names of the entries of a state and of the parameters, a vector's components by themselves; units of the parameters.
    tags
        (n,) hard case and number.
    q, values
        (n, dof), and (n,) by parameter or component.
    energies, gradients, hessians
        (n,), (n, dof), (n, dof, dof): rounded to nearest; NaN where there is no value, infinite where it does not fit.
    blocks
        Names of the unknowns, and the first row and the number of rows of each.
    conditions
        ``energy`` (n,), ``gradient`` (n, blocks), ``hessian`` (n, blocks, blocks); NaN where there are no derivatives.
    """

    energy: str
    summary: str
    unit: str
    rows: tuple[str, ...]
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    tags: tuple[str, ...]
    q: Array
    values: dict[str, Array]
    energies: Array
    gradients: Array
    hessians: Array
    blocks: tuple[tuple[str, int, int], ...]
    conditions: dict[str, Array]

    def __len__(self) -> int:
        return len(self.tags)


def golden_vectors(
    name: str, folder: Path | None, count: int, extreme: bool, advance: Advance = lambda label, total: None
) -> Vectors:
    """The golden vectors of an energy.

    Parameters
    ----------
    name, folder
        Of a declared energy, and where it is declared.
    count
        States of each hard case.
    extreme
        Whether to take those too whose sizes no cloth has.

    Raises
    ------
    InputError
        Where there is no such energy.
    """
    cases = hard_cases(name, folder, "float64", count, (), extreme)
    energy, truth = cases.energy, cases.truth
    found = {"energy": np.full(len(cases), np.nan)}
    labels = cases.labels
    found["gradient"] = np.full((len(cases), len(labels)), np.nan)
    found["hessian"] = np.full((len(cases), len(labels), len(labels)), np.nan)
    for at in range(len(cases)):
        if truth.has_derivatives[at]:
            _conditions(cases, at, found)
        advance("conditions", len(cases))
    parts = by_component(cases.points.parameters, axis=0)
    values = {part.replace(".", "_"): value for part, value in parts.items()}  # as the C source calls them
    return Vectors(
        energy.name,
        energy.summary,
        energy.unit,
        dof_labels(energy.unknowns),
        tuple(values),
        tuple(parameter.unit for parameter in energy.parameters for _ in given_symbols(parameter.name)),
        cases.tags,
        np.ascontiguousarray(cases.points.q.T),
        values,
        truth.energy,
        np.ascontiguousarray(truth.gradient.T),
        np.ascontiguousarray(np.moveaxis(truth.hessian, -1, 0)),
        tuple((label, rows.start, rows.stop - rows.start) for label, rows in labels),
        found,
    )


def _conditions(cases: Cases, at: int, found: dict[str, Array]) -> None:
    labels = [label for label, _ in cases.labels]
    found["energy"][at] = cases.condition("E", "", at)
    for i, label in enumerate(labels):
        found["gradient"][at, i] = cases.condition("G", label, at)
    for block, _ in blocks_of("H", cases.energy.unknowns):
        a, b = (labels.index(part) for part in block.split(","))
        found["hessian"][at, a, b] = found["hessian"][at, b, a] = cases.condition("H", block, at)
