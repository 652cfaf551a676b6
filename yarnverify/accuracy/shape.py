"""What a declared energy is made of, as far as its hard cases go: edges, angles, sliding coordinates, and how it scales."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.forms import Form, reduce
from yarnverify.accuracy.truth import Points
from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.dimensions import length_power
from yarnverify.symbolic.tree import Expr, Name

Array = NDArray[Any]


@dataclass(frozen=True)
class Edge:
    """The vector from one point to another."""

    head: Name
    tail: Name


@dataclass(frozen=True)
class Shape:
    """Parts of an energy.

    Attributes
    ----------
    energy
        As declared.
    edges
        The vectors that occur, those of the first angle first.
    angle
        Whether the first two edges enclose an angle that the energy depends on.
    only_angles
        Whether lengths of edges do not matter by themselves, so that points and sliding coordinates scale independently.
    sliding
        The scalar unknowns.
    lengths
        Parameters in metres.
    others
        The other parameters that have a unit: each with its power of length, newton and second being the other base units.
    """

    energy: Energy
    edges: tuple[Edge, ...]
    angle: bool
    only_angles: bool
    sliding: tuple[Name, ...]
    lengths: tuple[str, ...]
    others: Mapping[str, int]

    @property
    def points(self) -> tuple[Name, ...]:
        return tuple(name for name in self.energy.unknowns if name.bold)

    def rest(self) -> dict[str, Array] | None:
        """The declared state of rest, each value (3,) or scalar; None where a point has none."""
        given = self.energy.rest
        names = {name.label for name in self.energy.unknowns}
        if not names <= set(given):
            return None
        return {name: np.array(given[name], float) for name in names} | {
            p.label: np.array(given.get(p.label, 1.0), float) for p in self.energy.parameters
        }

    def pack(self, values: Mapping[str, Array], dtype: str) -> Points:
        """Points from arrays by label: (3, n) for points, (n,) for scalars; rounded to a type."""
        rows = [np.atleast_2d(values[name.label]) for name in self.energy.unknowns]
        q = np.vstack(rows).astype(dtype).astype(np.float64)
        names = [parameter.label for parameter in self.energy.parameters]
        return Points(q, {name: values[name].astype(dtype).astype(np.float64) for name in names})


def shape_of(energy: Energy) -> Shape:
    """Find the parts of an energy in its expression."""
    reduced = reduce(energy)
    forms = {form.symbol: form for form in reduced.forms}
    pairs: list[list[Name]] = []
    for node in reduced.expression.walk():
        if node.op == "call" and node.value == "arccos":
            vectors = dict.fromkeys(part.name for part in node.walk() if part.op == "symbol" and part.name.bold)
            pairs.append(list(vectors))
    pair = next((pair for pair in pairs if len(pair) == 2 and all(_edge(forms[name]) for name in pair)), [])
    order = [*pair, *(name for name in forms if name.bold and name not in pair)]
    found = (_edge(forms[name]) for name in order)
    points = set(energy.unknowns)  # a parameter may be a vector too, and is no end of an edge
    edges = tuple(edge for edge in found if edge is not None and {edge.head, edge.tail} <= points)
    parameters = [(parameter.label, parameter.unit) for parameter in energy.parameters]
    return Shape(
        energy,
        edges,
        angle=bool(pair),
        only_angles=bool(pair) and not _vectors_outside_angles(reduced.expression),
        sliding=tuple(name for name in energy.unknowns if not name.bold),
        lengths=tuple(name for name, unit in parameters if unit == "m"),
        others={name: length_power(unit) for name, unit in parameters if unit not in ("m", "1", "rad")},
    )


def _edge(form: Form) -> Edge | None:
    by_sign = {sign: name for name, sign in form.signs}
    return Edge(by_sign[1], by_sign[-1]) if len(form.signs) == 2 and set(by_sign) == {1, -1} else None


def _vectors_outside_angles(expr: Expr) -> bool:
    if expr.op == "call" and expr.value == "arccos":
        return False
    if expr.op == "symbol":
        return expr.name.bold
    return any(_vectors_outside_angles(arg) for arg in expr.args)
