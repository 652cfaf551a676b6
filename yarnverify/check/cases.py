"""The states that an implementation is tried on, their true results, and condition numbers when they are asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.conditioning import Conditions
from yarnverify.accuracy.metrics import UNIT, blocks_of, slices
from yarnverify.accuracy.regimes import points_of, regimes, vector_parameters
from yarnverify.accuracy.rule import AMPLIFIED
from yarnverify.accuracy.shape import shape_of
from yarnverify.accuracy.truth import Points, Truth, truth
from yarnverify.errors import InputError
from yarnverify.library import derivations
from yarnverify.symbolic.declare import Energy, load_declarations

Array = NDArray[Any]
EXTREME = ("scales", "out of range")  # sizes that no cloth has
SEED = 20145


@dataclass(frozen=True)
class Cases:
    """States and what is true there.

    Attributes
    ----------
    energy
        As declared.
    points, truth
        States, and the truth at each.
    tags
        Regime and number of each state.
    dtype
        In which the states are exact.
    """

    energy: Energy
    points: Points
    truth: Truth
    tags: tuple[str, ...]
    dtype: str

    def __len__(self) -> int:
        return len(self.points)

    @property
    def labels(self) -> list[tuple[str, slice]]:
        return slices(self.energy.unknowns)

    @property
    def dof(self) -> int:
        return int(self.points.q.shape[0])

    def regime(self, at: int) -> str:
        return self.tags[at].rsplit(" ", 1)[0]

    def of_regime(self, *names: str) -> Array:
        """(n,) bool: which states are of these regimes."""
        return np.array([self.regime(at) in names for at in range(len(self))], bool)

    @property
    def valued(self) -> Array:
        """(n,) bool: where there are derivatives, and all of them fit the format; elsewhere refusing is right."""
        largest = float(np.finfo(self.dtype).max)
        n = len(self)
        parts = np.vstack([self.truth.energy[None], self.truth.gradient, self.truth.hessian.reshape(-1, n)])
        return np.asarray(self.truth.has_derivatives & ~(np.abs(parts) > largest).any(axis=0))

    @cached_property
    def shorter(self) -> Array | None:
        """(n,) bool: where the only edge is no longer than the only difference of sliding coordinates; None without these."""
        shape = shape_of(self.energy)
        if vector_parameters(self.energy) or len(shape.edges) != 1 or len(shape.sliding) != 2:
            return None
        rows, q = dict(self.labels), self.points.q
        edge = q[rows[shape.edges[0].head.label]] - q[rows[shape.edges[0].tail.label]]
        first, second = (q[rows[name.label].start] for name in shape.sliding)
        return np.asarray(np.sqrt((edge**2).sum(axis=0)) <= np.abs(second - first))

    @property
    def idle(self) -> Array:
        """(n,) bool: where the energy, which does not act everywhere, does not act."""
        nothing = ~(self.truth.hessian != 0).any(axis=(0, 1)) & (self.truth.energy == 0)
        return np.asarray(nothing & (self.energy.elsewhere == "zero"))

    def values(self) -> dict[str, Array]:
        """Unknowns, (3, n) or (n,), and parameters, by name."""
        q = self.points.q
        found = {label: q[rows] if rows.stop - rows.start == 3 else q[rows.start] for label, rows in self.labels}
        return found | dict(self.points.parameters)

    def condition(self, kind: str, block: str, at: int, draws: int = 0) -> float:
        """Condition number of a block at a state; with ``draws`` a bound from below, which is cheaper for a Hessian."""
        if kind == "H" and self._jumps[at]:
            return float("inf")
        names = [name for name, _ in blocks_of(kind, self.energy.unknowns)]
        if kind == "H" and block not in names:
            block = ",".join(reversed(block.split(",")))
        column = self._conditions.at(kind, at, draws)
        return float(np.nan_to_num(column[names.index(block)], nan=0.0, posinf=np.inf))

    @cached_property
    def _conditions(self) -> Conditions:
        return Conditions(self.energy, self.points, self.truth)

    @cached_property
    def _jumps(self) -> Array:
        """(n,) bool: whether an energy that does not act everywhere begins or ends to act within the rounding of the inputs.

        Its Hessian jumps there, so that its condition number is infinite, and either value is right.
        """
        found = np.zeros(len(self), bool)
        if self.energy.elsewhere == "zero":
            acts = (self.truth.hessian != 0).any(axis=(0, 1))
            rows = self.points.rows()
            for row in range(len(rows)):
                for change in (-1, 1):
                    moved = rows.copy()
                    moved[row] *= 1 + change * len(rows) * AMPLIFIED * UNIT[self.dtype]
                    points = _from_rows(moved, self.points)
                    found |= (truth(self.energy, points).hessian != 0).any(axis=(0, 1)) != acts
        return found


@cache
def declared(folder: Path) -> tuple[Energy, ...]:
    """The energies that a folder declares; read once, since that may take longer than a check."""
    return load_declarations(folder).energies


def energy_named(name: str, folder: Path | None) -> Energy:
    """The declared energy of a name.

    Raises
    ------
    InputError
        Where none has that name.
    """
    there = declared(folder or derivations())
    energy = next((energy for energy in there if energy.name == name), None)
    if energy is None:
        raise InputError(f"{name}: no such energy; there are {', '.join(energy.name for energy in there)}")
    return energy


def _from_rows(rows: Array, like: Points) -> Points:
    """Points from their coordinates and parameters, one below the other."""
    parameters, at = {}, len(like.q)
    for name, value in like.parameters.items():
        parameters[name] = rows[at : at + 3] if value.ndim == 2 else rows[at]
        at += 3 if value.ndim == 2 else 1
    return Points(rows[: len(like.q)], parameters)


@cache
def hard_cases(
    name: str,
    folder: Path | None,
    dtype: str,
    count: int,
    wanted: tuple[str, ...] = (),
    extreme: bool = False,
    fixed: tuple[tuple[str, float], ...] = (),
) -> Cases:
    """The hard cases of an energy.

    Parameters
    ----------
    name, folder
        Of the energy, and where it is declared; those of the package if None.
    dtype
        float64 or float32.
    count
        States of each regime.
    wanted
        Names of regimes; all that the energy has by default.
    extreme
        Whether to take those too whose sizes no cloth has.
    fixed
        Parameters that have one value throughout.

    Raises
    ------
    InputError
        For names that are not there.
    """
    energy = energy_named(name, folder)
    there = regimes(energy)
    unknown = [w for w in wanted if w not in [regime.name for regime in there]]
    if unknown:
        raise InputError(
            f"--regime {unknown[0]}: {name} has no such hard cases; there are {', '.join(r.name for r in there)}"
        )
    chosen = [r for r in there if (r.name in wanted if wanted else extreme or r.name not in EXTREME)]
    parts = [points_of(energy, regime, dtype, count, SEED) for regime in chosen]
    tags = tuple(f"{regime.name} {i}" for regime in chosen for i in range(count))
    parameters = {key: np.concatenate([part.parameters[key] for part in parts], axis=-1) for key in parts[0].parameters}
    points = Points(np.hstack([part.q for part in parts]), parameters)
    return settled(energy, points, tags, dtype, dict(fixed))


def settled(energy: Energy, points: Points, tags: tuple[str, ...], dtype: str, fixed: Mapping[str, float]) -> Cases:
    """Cases from states."""
    names = list(points.parameters)
    for key, value in fixed.items():
        if key not in names:
            raise InputError(f"--fix {key}: {energy.name} has the parameters {', '.join(names)}")
        if points.parameters[key].ndim == 2:
            raise InputError(f"--fix {key}: is a vector, and no one number")
        if not np.isfinite(value):
            raise InputError(f"--fix {key}={value}: give a finite number")
    values = {key: np.full(len(points), float(np.dtype(dtype).type(value))) for key, value in fixed.items()}
    parameters = {key: values.get(key, value) for key, value in points.parameters.items()}
    points = replace(points, parameters=parameters)
    return Cases(energy, points, truth(energy, points), tags, dtype)


def angles(cases: Cases) -> Array:
    """(n,) the angle between the first two edges, to some 1e-16, in plain arithmetic; NaN for an energy without angle."""
    shape = shape_of(cases.energy)
    if not shape.angle or vector_parameters(cases.energy):
        return np.full(len(cases), np.nan)
    rows = dict(cases.labels)
    with np.errstate(all="ignore"):
        first, second = (
            cases.points.q[rows[e.head.label]] - cases.points.q[rows[e.tail.label]] for e in shape.edges[:2]
        )
        first, second = first / np.abs(first).max(axis=0), second / np.abs(second).max(axis=0)
        sine = np.sqrt((np.cross(first, second, axis=0) ** 2).sum(axis=0))
        return np.asarray(np.arctan2(sine, (first * second).sum(axis=0)))
