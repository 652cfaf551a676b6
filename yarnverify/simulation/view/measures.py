"""What yarns are coloured by: numbers with a name and a unit, at segments or at nodes of yarns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError
from yarnverify.simulation.cloth import Fabric
from yarnverify.simulation.tables import Table, bends, contacts, segments, shears
from yarnverify.simulation.view.strands import Strands

Numbers = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Measure:
    """Values on the yarns of a fabric.

    Attributes
    ----------
    name, unit
        For the legend.
    values
        One for each place of the fabric's chain, (p,); NaN where there is none.
    at
        ``segments``: the value of the segment that starts at a place, the same on all of it; ``nodes``: of the node there,
        blending into the next one.
    signed
        Whether zero is the middle of the scale.
    least
        Below it in size all is rounding, and a scale is that of zero.
    """

    name: str
    unit: str
    values: Numbers
    at: Literal["segments", "nodes"]
    signed: bool = False
    least: float = 0.0

    @property
    def label(self) -> str:
        """Name and unit."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    @property
    def limits(self) -> tuple[float, float]:
        """Least and greatest value for a scale: symmetric about zero where signed, else from zero."""
        known = self.values[np.isfinite(self.values)]
        most = float(np.abs(known).max(initial=0.0))
        if most <= self.least:
            return (0.0, 0.0)
        return (
            (-most, most) if self.signed else (min(float(known.min(initial=0.0)), 0.0), float(known.max(initial=0.0)))
        )

    def lacking(self, fabric: Fabric) -> bool:
        """Whether some yarn is left without a colour."""
        first, second = fabric.chain.pairs
        none = np.isnan(self.values)
        return bool((none[first] if self.at == "segments" else none[first] & none[second]).any())

    def on_samples(self, strands: Strands) -> Numbers:
        """Values at the samples of strands, (m,)."""
        here = self.values[strands.place]
        if self.at == "segments":
            return here
        after = self.values[np.minimum(strands.place + 1, len(self.values) - 1)]
        here, after = np.where(np.isnan(here), after, here), np.where(np.isnan(after), here, after)
        return (1 - strands.part) * here + strands.part * after


def strain(fabric: Fabric, Q: ArrayLike) -> Measure:
    """Strain of each segment, per cent of its rest length."""
    made, q = _elements(fabric, Q, segments)
    strained = np.linalg.norm(q[3:6] - q[:3], axis=0) / (q[7] - q[6]) - 1
    return Measure("stretch", "%", _at(fabric, made, 100 * strained), "segments", True, 1e-9)


def turning(fabric: Fabric, Q: ArrayLike) -> Measure:
    """Turning angle of each yarn at its nodes, degrees."""
    made, q = _elements(fabric, Q, bends)
    return Measure(
        "bending angle", "°", _at(fabric, made, np.degrees(_angle(q[3:6] - q[:3], q[:3] - q[6:9]))), "nodes", least=1e-9
    )


def shearing(fabric: Fabric, Q: ArrayLike) -> Measure:
    """Deviation of warp and weft from the right angle, degrees: the mean size in the quadrants of each crossing."""
    made, q = _elements(fabric, Q, shears)
    away = np.abs(90 - np.degrees(_angle(q[3:6] - q[:3], q[6:9] - q[:3])))
    count = np.bincount(made.places["node"], minlength=fabric.nodes)
    total = np.bincount(made.places["node"], away, fabric.nodes)
    mean = np.divide(total, count, out=np.full(fabric.nodes, np.nan), where=count > 0)
    return Measure("shear", "°", mean[fabric.chain.nodes], "nodes", least=1e-5)


def pressing(fabric: Fabric, Q: ArrayLike) -> Measure:
    """How far neighbouring parallel yarns overlap, millimetres, on the piece of yarn that lies between them."""
    made, q = _elements(fabric, Q, contacts)
    overlap = np.maximum(made.parameters["d"] - (q[1] - q[0]), 0.0)
    return Measure("contact", "mm overlap", _at(fabric, made, 1e3 * overlap), "segments", least=1e-12)


def slipping(fabric: Fabric, Q: ArrayLike) -> Measure:
    """How far each yarn has slid through its nodes since rest, millimetres."""
    slides = fabric.chain.slides
    return Measure("sliding", "mm", 1e3 * np.abs(np.asarray(Q, float)[slides] - fabric.Q[slides]), "nodes", least=1e-12)


def energy(fabric: Fabric, table: Table, energies: ArrayLike, name: str) -> Measure:
    """Energies of the elements of a table, joules: on the segment or at the node that they belong to.

    Parameters
    ----------
    energies
        As a kernel gives them, (n,).
    """
    values = np.asarray(energies, float)
    if values.shape != (table.count,):
        raise InputError(f"energy of {name}: {values.size} values for {table.count} elements")
    if "place" not in table.places:  # quadrants of crossings
        total = np.bincount(table.places["node"], values, fabric.nodes)
        known = np.bincount(table.places["node"], minlength=fabric.nodes) > 0
        return Measure(f"energy of {name}", "J", np.where(known, total, np.nan)[fabric.chain.nodes], "nodes")
    at: Literal["segments", "nodes"] = "nodes" if len(table.rows) == 11 else "segments"
    return Measure(f"energy of {name}", "J", _at(fabric, table, values), at)


MEASURES: dict[str, Callable[[Fabric, ArrayLike], Measure]] = {
    "stretch": strain,
    "bending": turning,
    "shear": shearing,
    "contact": pressing,
    "sliding": slipping,
}


def measure(fabric: Fabric, Q: ArrayLike, name: str) -> Measure:
    """A measure by name: ``stretch``, ``bending``, ``shear``, ``contact`` or ``sliding``."""
    if name not in MEASURES:
        raise InputError(f"colour by {name!r}: there are {', '.join(MEASURES)}, or give a Measure")
    return MEASURES[name](fabric, Q)


def shown(measure: Measure) -> Measure:
    """The measure in a unit with a prefix in which its largest value is easy to read: nJ rather than 1e-9 J."""
    most = max(map(abs, measure.limits))
    if measure.unit != "J" or not most > 0:
        return measure
    power = int(np.clip(np.floor(np.log10(most) / 3), -6, 0))
    prefix = {0: "", -1: "m", -2: "µ", -3: "n", -4: "p", -5: "f", -6: "a"}[power]
    return replace(measure, unit=prefix + measure.unit, values=measure.values / 10.0 ** (3 * power))


@lru_cache(maxsize=8)  # a run asks for the same ones at every step
def _table(of: Callable[[Fabric], Table], fabric: Fabric) -> Table:
    return of(fabric)


def _elements(fabric: Fabric, Q: ArrayLike, of: Callable[[Fabric], Table]) -> tuple[Table, Numbers]:
    made = _table(of, fabric)
    return made, np.asarray(Q, float)[made.rows]


def _at(fabric: Fabric, table: Table, values: Numbers) -> Numbers:
    found = np.full(len(fabric.chain.nodes), np.nan)
    found[table.places["place"]] = values
    if any(y.closed for y in fabric.yarns) and len(table.rows) == 11:  # the node of a ring's seam is there twice
        for y in fabric.yarns:
            if y.closed:
                start = int(np.flatnonzero(fabric.chain.slides == y.slides[0])[0])
                found[start] = found[start + len(y.nodes) - 2]
    return found


def _angle(a: Numbers, b: Numbers) -> Numbers:
    return np.arctan2(np.linalg.norm(np.cross(a, b, axis=0), axis=0), (a * b).sum(0))
