"""Numba: SymPy's expressions with shared subexpressions, as one compiled loop over the elements."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from yarnverify.benchmark.peers.symbols import expressions
from yarnverify.benchmark.peers.walk import FORMS
from yarnverify.benchmark.ways import Array, Outputs, Way, degrees_of_freedom, kept_outputs, outputs_bytes, sizes
from yarnverify.symbolic.declare import Energy

PACKAGES = ("numba",)


def ways(energy: Energy) -> tuple[Way, ...]:
    """The compiled loop of each form of the energy; element-first outputs are the faster ones for it."""
    return tuple(_way(energy, form) for form in FORMS)


def _way(energy: Energy, form: str) -> Way:
    dof = degrees_of_freedom(energy)
    namespace: dict[str, Any] = {"math": math}
    exec(_source(energy, form), namespace)
    loop = numba.njit(namespace["loop"], error_model="numpy")

    arrays = kept_outputs(dof, "element-first")

    def run(q: Array, values: tuple[float, ...]) -> Outputs:
        n = q.shape[1]
        out = arrays(n)
        loop(q, np.array(values), *out)
        return out

    how = f"njit of SymPy's cse, loop over elements, {form}"
    return Way(how, "packed", "element-first", run, lambda n: n * outputs_bytes(dof))


def _source(energy: Energy, form: str) -> str:
    rows, parameters, outputs = expressions(energy, form)
    dof = len(rows)
    shared, reduced = sp.cse(outputs, list=False)
    printer = PythonCodePrinter({"fully_qualified_modules": True})
    places = ["E[i]", *(f"G[i, {k}]" for k in range(dof)), *(f"H[i, {k}]" for k in range(sizes(dof)))]
    lines = ["def loop(q, p, E, G, H):"]
    lines += [f"    {parameter} = p[{k}]" for k, parameter in enumerate(parameters)]
    lines += ["    for i in range(q.shape[1]):"]
    lines += [f"        {row} = q[{k}, i]" for k, row in enumerate(rows)]
    lines += [f"        {symbol} = {printer.doprint(value)}" for symbol, value in shared]
    lines += [f"        {place} = {printer.doprint(value)}" for place, value in zip(places, reduced, strict=True)]
    return "\n".join(lines) + "\n"
