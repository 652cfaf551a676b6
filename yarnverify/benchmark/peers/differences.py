"""Central differences of the energy in NumPy, as SymPy prints it: what one reaches for when no derivative is at hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from yarnverify.benchmark.peers.symbols import energy_expression
from yarnverify.benchmark.peers.walk import FORMS
from yarnverify.benchmark.ways import (
    Array,
    Outputs,
    Way,
    chunks,
    degrees_of_freedom,
    kept_outputs,
    outputs_bytes,
)
from yarnverify.symbolic.declare import Energy

PACKAGES = ("numpy", "sympy")
CHUNKS = (1024, 8192)
# the steps at which truncation and rounding errors balance for coordinates of order 1: u^(1/3) and u^(1/4)
FIRST, SECOND = 2.0**-18, 2.0**-13


def ways(energy: Energy) -> tuple[Way, ...]:
    """One way for each size of chunk."""
    dof = degrees_of_freedom(energy)
    rows, parameters, expression = energy_expression(energy, FORMS[1])
    function = sp.lambdify([*rows, *parameters], expression, modules="numpy", cse=True)

    arrays = kept_outputs(dof)

    def way(chunk: int) -> Way:
        def run(q: Array, values: tuple[float, ...]) -> Outputs:
            out = arrays(q.shape[1])
            for where in chunks(q.shape[1], chunk):
                with np.errstate(all="ignore"):  # a shifted state may leave the domain of a root; the result shows it
                    _differences(function, q[:, where], values, *(part[..., where] for part in out))
            return out

        return Way(f"chunks of {chunk}", "packed", "component-first", run, lambda n: n * outputs_bytes(dof))

    return tuple(way(chunk) for chunk in CHUNKS)


def _differences(function: Any, q: Array, values: tuple[float, ...], e: Array, g: Array, h: Array) -> None:
    def shifted(*steps: tuple[int, float]) -> Array:
        moved = q.copy()
        for row, step in steps:
            moved[row] += step
        value: Array = function(*moved, *values)
        return value

    dof = len(q)
    e[:] = middle = shifted()
    for i in range(dof):
        g[i] = (shifted((i, FIRST)) - shifted((i, -FIRST))) / (2 * FIRST)
    sums = [shifted((i, SECOND)) + shifted((i, -SECOND)) for i in range(dof)]
    at = 0
    for i in range(dof):
        h[at] = (sums[i] - 2 * middle) / SECOND**2
        at += 1
        for j in range(i + 1, dof):
            both = shifted((i, SECOND), (j, SECOND)) + shifted((i, -SECOND), (j, -SECOND))
            h[at] = (both - sums[i] - sums[j] + 2 * middle) / (2 * SECOND**2)
            at += 1
