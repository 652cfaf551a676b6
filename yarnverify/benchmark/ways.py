"""A way of getting energy, gradient and Hessian of many elements, whoever it belongs to."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from yarnverify.kernels.memory import aligned

Array = NDArray[Any]
Layout = Literal["component-first", "element-first"]
Outputs = tuple[Array, Array, Array]


@dataclass(frozen=True)
class Way:
    """One way of calling a contestant; its outputs may be the same arrays at every call.

    Attributes
    ----------
    how
        What is special about it, for the reader of a table.
    hessian
        ``packed``, the upper triangle row by row, or ``full``.
    layout
        ``component-first``, (dof, n), or ``element-first``, (n, dof): whichever is faster for the contestant.
    run
        Takes ``q`` (dof, n) and the parameters as a tuple of floats, three for a vector; gives energy, gradient and Hessian.
    bytes_at
        Memory in bytes that a call with so many elements needs at its peak, about.
    """

    how: str
    hessian: str
    layout: Layout
    run: Callable[[Array, tuple[float, ...]], Outputs]
    bytes_at: Callable[[int], int]


def sizes(dof: int) -> int:
    """Entries of the upper triangle of a Hessian."""
    return dof * (dof + 1) // 2


def outputs_bytes(dof: int) -> int:
    """Bytes per element that a call reads and writes: q, energy, gradient, packed Hessian."""
    return 8 * (dof + 1 + dof + sizes(dof))


def chunks(n: int, chunk: int | None) -> Iterator[slice]:
    """Slices of ``chunk`` elements, or one of all."""
    step = n if chunk is None else chunk
    for start in range(0, n, max(step, 1)):
        yield slice(start, min(start + step, n))


def empty_outputs(dof: int, n: int, layout: Layout = "component-first") -> Outputs:
    """New arrays that begin at cache lines: (n,), (dof, n) and the packed (dof (dof+1)/2, n), or the latter two turned."""
    shapes = (n,), (dof, n), (sizes(dof), n)
    turned = shapes if layout == "component-first" else tuple(shape[::-1] for shape in shapes)
    energy, gradient, hessian = (aligned(shape, float) for shape in turned)
    return energy, gradient, hessian


def kept_outputs(dof: int, layout: Layout = "component-first") -> Callable[[int], Outputs]:
    """Arrays for so many elements, the same ones again as long as the number stays, as a simulation keeps its own.

    What the system takes to hand out fresh memory varies threefold from call to call, and is nobody's formula.
    """
    last: dict[int, Outputs] = {}

    def arrays(n: int) -> Outputs:
        if n not in last:
            last.clear()
            last[n] = empty_outputs(dof, n, layout)
        return last[n]

    return arrays


def unified(way: Way, outputs: Outputs) -> Outputs:
    """Outputs of any way as (n,), (dof, n) and (dof, dof, n)."""
    e, g, h = (np.asarray(part) for part in outputs)
    if way.layout == "element-first":
        g, h = g.T, np.moveaxis(h, 0, -1)
    dof = g.shape[0]
    if way.hessian == "packed":
        full = np.empty((dof, dof, h.shape[-1]), h.dtype)
        rows, columns = np.triu_indices(dof)
        full[rows, columns] = h
        full[columns, rows] = h
        h = full
    return e, g, h


def degrees_of_freedom(energy: Any) -> int:
    """Rows of q of a declared energy."""
    return sum(3 if name.bold else 1 for name in energy.unknowns)


def count_of_parameters(energy: Any) -> int:
    """Numbers that its parameters are, three of a vector."""
    return sum(3 if parameter.name.bold else 1 for parameter in energy.parameters)


def named(energy: Any, parameters: Sequence[float]) -> dict[str, Array]:
    """Parameters by name, () or (3,), from all their numbers."""
    found, at = {}, 0
    for parameter in energy.parameters:
        size = 3 if parameter.name.bold else 1
        found[parameter.label] = np.array(parameters[at : at + size] if size == 3 else parameters[at])
        at += size
    return found
