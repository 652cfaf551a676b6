"""Energy, gradient and upper triangle of the Hessian as SymPy expressions, for the peers that start from them."""

from __future__ import annotations

from typing import Any

import sympy as sp

from yarnverify.benchmark.peers.walk import energy_of, functions_of
from yarnverify.benchmark.ways import count_of_parameters, degrees_of_freedom
from yarnverify.symbolic.declare import Energy

_FUNCTIONS = functions_of(sp, sp.Integer, short=True, pi=sp.pi)


def expressions(energy: Energy, form: str) -> tuple[list[Any], list[Any], list[Any]]:
    """Symbols of the rows of q, symbols of the parameters, and all outputs one after the other; for ``form`` see ``walk``."""
    rows, parameters, value = energy_expression(energy, form)
    dof = len(rows)
    gradient = [sp.diff(value, row) for row in rows]
    hessian = [_regular(sp.diff(gradient[i], rows[j])) for i in range(dof) for j in range(i, dof)]
    return rows, parameters, [value, *gradient, *hessian]


def energy_expression(energy: Energy, form: str) -> tuple[list[Any], list[Any], Any]:
    """The same of the energy alone."""
    dof = degrees_of_freedom(energy)
    rows = list(sp.symbols(f"q:{dof}", real=True))
    parameters = list(sp.symbols(f"p:{count_of_parameters(energy)}", real=True))
    return rows, parameters, energy_of(energy, rows, parameters, _FUNCTIONS, form)


def _regular(value: Any) -> Any:
    """Without the impulses at kinks of absolute values, where there is no second derivative and nothing to print them."""
    return value.replace(sp.DiracDelta, lambda *args: sp.Integer(0))
