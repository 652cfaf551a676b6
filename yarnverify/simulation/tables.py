"""Tables of elements: which entries of a configuration Q each element of a kernel reads, by the kernel's argument names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError
from yarnverify.kernels import bending, parallel_contact, shear, stretch

if TYPE_CHECKING:
    from yarnverify.simulation.cloth import Fabric

Integers = NDArray[np.int32]
Numbers = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Table:
    """Elements of one kernel.

    Attributes
    ----------
    rows
        Indices into Q in the order of the kernel's ``DOFS``, (dofs, n).
    parameters
        What the geometry knows of the kernel's parameters, by name, each a number () or (n,).
    places
        Where an element lies, by name, each (n,): ``yarn`` (index), ``node`` (the one it is about, or the first of two),
        ``place`` (that node's place in the fabric's chain).
    """

    rows: Integers
    parameters: Mapping[str, Numbers] = field(default_factory=dict)
    places: Mapping[str, Integers] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of elements."""
        return int(self.rows.shape[1])

    def take(self, chosen: ArrayLike) -> Table:
        """The table of some of the elements, by a mask or by indices."""
        chosen = np.asarray(chosen)
        return Table(
            np.ascontiguousarray(self.rows[:, chosen]),
            {name: values[chosen] if values.ndim else values for name, values in self.parameters.items()},
            {name: values[chosen] for name, values in self.places.items()},
        )


def table(
    kernel: ModuleType,
    arguments: Mapping[str, ArrayLike],
    parameters: Mapping[str, Any] | None = None,
    places: Mapping[str, ArrayLike] | None = None,
) -> Table:
    """The table of a kernel from its arguments.

    Parameters
    ----------
    kernel
        Has ``DOFS``. Those like ``x0.y`` are rows of a point, those like ``u1`` are rows of their own.
    arguments
        By argument name: nodes (n,) for points, indices into Q (n,) for what has one row. Those that the kernel does not have
        are passed over.

    Raises
    ------
    InputError
        An argument of the kernel is not given.
    """
    given = {name: np.atleast_1d(np.asarray(values)) for name, values in arguments.items()}
    missing = sorted({label.split(".")[0] for label in kernel.DOFS} - set(given))
    if missing:
        raise InputError(
            f"elements of {kernel.__name__.split('.')[-1]} need {', '.join(missing)}; given: {', '.join(given)}"
        )
    count = np.broadcast_shapes(*(values.shape for values in given.values()))[0]
    rows = np.empty((len(kernel.DOFS), count), np.int32)
    for row, label in zip(rows, kernel.DOFS, strict=True):
        name, _, axis = label.partition(".")
        row[:] = 3 * given[name] + "xyz".index(axis) if axis else given[name]
    known = {name: np.asarray(value, float)
             for name, value in (parameters or {}).items() if name in kernel.PARAMETERS}  # fmt: skip
    return Table(rows, known, {name: np.asarray(value, np.int32) for name, value in (places or {}).items()})


def segments(fabric: Fabric, kernel: ModuleType = stretch) -> Table:
    """Pieces of yarn between neighbouring nodes: x0, x1, u0, u1, and their rates v0, v1, w0, w1 where a kernel has them."""
    first, second = fabric.chain.pairs
    nodes, slides = fabric.chain.nodes, fabric.chain.slides
    x0, x1, u0, u1 = nodes[first], nodes[second], slides[first], slides[second]
    arguments = {"x0": x0, "x1": x1, "u0": u0, "u1": u1, "v0": x0, "v1": x1, "w0": u0, "w1": u1}
    return table(kernel, arguments, None, {"yarn": fabric.chain.yarn[first], "node": x0, "place": first})


def bends(fabric: Fabric, kernel: ModuleType = bending) -> Table:
    """Nodes inside a yarn: x0 the node, x1 and u1 the next one, x2 and u2 the one before."""
    before, here, after = fabric.chain.triples
    nodes, slides = fabric.chain.nodes, fabric.chain.slides
    arguments = {"x0": nodes[here], "x1": nodes[after], "x2": nodes[before], "u0": slides[here], "u1": slides[after],
                 "u2": slides[before]}  # fmt: skip
    return table(kernel, arguments, None, {"yarn": fabric.chain.yarn[here], "node": nodes[here], "place": here})


def shears(fabric: Fabric, kernel: ModuleType = shear) -> Table:
    """Quadrants of crossings, up to four each: x0 the crossing, x1 beside it on its warp, x3 beside it on its weft."""
    warp, weft = fabric.chain.of_crossings
    before, after = fabric.chain.neighbours
    found = []
    for along in (after, before):
        for across in (after, before):
            x1, x3 = along[warp], across[weft]
            there = (x1 >= 0) & (x3 >= 0)
            found.append((fabric.crossings[there], x1[there], x3[there]))
    x0, x1, x3 = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.argsort(x0, kind="stable")  # the quadrants of a crossing together, so that what they read lies together
    arguments = {"x0": x0[order], "x1": x1[order], "x3": x3[order]}
    return table(kernel, arguments, {"L": fabric.L}, {"node": x0[order]})


def contacts(fabric: Fabric, kernel: ModuleType = parallel_contact) -> Table:
    """Neighbouring parallel yarns, met at neighbouring crossings u0 < u1 of a yarn across them.

    Their distance of contact d is 4R where that yarn changes sides between them (it passes through), 2R on a float.
    """
    first, second = fabric.chain.pairs
    nodes = fabric.chain.nodes
    side = np.zeros(fabric.nodes, np.int8)
    side[fabric.crossings] = fabric.over
    both = (side[nodes[first]] != 0) & (side[nodes[second]] != 0)
    first, second = first[both], second[both]
    opposite = side[nodes[first]] != side[nodes[second]]
    arguments = {"u0": fabric.chain.slides[first], "u1": fabric.chain.slides[second]}
    distance = np.where(opposite, 4 * fabric.R, 2 * fabric.R)
    places = {"yarn": fabric.chain.yarn[first], "node": nodes[first], "next": nodes[second], "place": first}
    return table(kernel, arguments, {"L": fabric.L, "d": distance}, places)
