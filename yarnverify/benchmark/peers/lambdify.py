"""SymPy's ``lambdify`` at its best: all outputs flat in one function, subexpressions shared, upper triangle, chunks."""

from __future__ import annotations

from typing import Any

import sympy as sp

from yarnverify.benchmark.peers.symbols import expressions
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

PACKAGES = ("sympy",)
CHUNKS = (1024, 4096, 16384, None)


def ways(energy: Energy) -> tuple[Way, ...]:
    """One way for each form of the energy and size of chunk; None is the whole batch at once."""
    return tuple(way for form in FORMS for way in _ways(energy, form))


def _ways(energy: Energy, form: str) -> list[Way]:
    rows, parameters, outputs = expressions(energy, form)
    function = sp.lambdify([*rows, *parameters], outputs, modules="numpy", cse=True)
    dof = degrees_of_freedom(energy)
    temporaries = 8 * (len(sp.cse(outputs, list=False)[0]) + len(outputs))

    arrays = kept_outputs(dof)

    def way(chunk: int | None) -> Way:
        def run(q: Array, values: tuple[float, ...]) -> Outputs:
            return _filled(function, arrays(q.shape[1]), q, values, chunk)

        def bytes_at(n: int) -> int:
            return n * outputs_bytes(dof) + temporaries * (chunk or n)

        how = f"{form}, {f'chunks of {chunk}' if chunk else 'whole batch'}"
        return Way(how, "packed", "component-first", run, bytes_at)

    return [way(chunk) for chunk in CHUNKS]


def _filled(function: Any, out: Outputs, q: Array, values: tuple[float, ...], chunk: int | None) -> Outputs:
    e, g, h = out
    for where in chunks(q.shape[1], chunk):
        found = function(*q[:, where], *values)
        e[where] = found[0]
        for i in range(g.shape[0]):
            g[i, where] = found[1 + i]
        for i in range(h.shape[0]):
            h[i, where] = found[1 + g.shape[0] + i]
    return e, g, h
