"""Elements of extreme size are evaluated at a scale near 1: powers of two come off their lengths and go back on the results."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from yarnverify.kernels.inputs import Array

if TYPE_CHECKING:
    from yarnverify.kernels.runtime import Kernel


def exponents(kernel: Kernel, rows: Array, limit: float) -> Array:
    """For each element the power of two to divide lengths by; 0 where they are moderate as they are.

    Where only angles count, edges are made so long that their products with the smallest number do not underflow.

    Parameters
    ----------
    kernel, rows
        The kernel, and finite inputs (dof, n).
    limit
        Lengths between its inverse and itself are moderate.
    """
    if not kernel.points or kernel.scaling == "none":
        return np.zeros(rows.shape[1], int)
    points = rows[list(kernel.points)].reshape(-1, 3, rows.shape[1])
    if len(points) < 2:  # no edge that could give the scale
        return np.zeros(rows.shape[1], int)
    spans = np.abs(points[1:] - points[:1]).max(axis=1)
    span = spans.max(axis=0)
    if kernel.scaling == "points":
        span = np.where(spans > 0, spans, np.inf).min(axis=0)
    exponent = np.where(np.isfinite(span) & (span > 0), np.frexp(span)[1], 0)
    if kernel.scaling == "points":
        return exponent - 2
    return np.where(np.abs(exponent) > int(math.log2(limit)) // 2, exponent, 0)


def scaled(kernel: Kernel, rows: Array, values: list[Any], exponent: Array) -> tuple[Array, list[Any]]:
    """Rows and parameters with all lengths divided by 2^exponent."""
    if not exponent.any():
        return rows, values
    touched = _touched(kernel)
    rows = rows.copy()
    rows[touched] = np.ldexp(rows[touched], -exponent)
    if kernel.scaling == "lengths":
        powers = [power for _, _, power in kernel.parameters]
        values = [np.ldexp(v, -p * exponent) if p else v for v, p in zip(values, powers, strict=True)]
    return rows, values


def unscale(kernel: Kernel, wanted: str, found: Array, exponent: Array) -> None:
    """Energies scale by their power of length where all lengths were scaled, and not at all where only points were."""
    if not exponent.any():
        return
    dof, touched = len(kernel.dofs), set(_touched(kernel))
    whole = kernel.power if kernel.scaling == "lengths" else 0
    powers = {
        "E": [whole],
        "G": [whole - (i in touched) for i in range(dof)],
        "H": [whole - (i in touched) - (j in touched) for i in range(dof) for j in range(i, dof)],
    }
    for row, power in zip(found, [power for key in wanted for power in powers[key]], strict=True):
        if power:
            row[:] = np.ldexp(row, power * exponent)


def _touched(kernel: Kernel) -> list[int]:
    """Rows that a change of scale touches."""
    return list(range(len(kernel.dofs))) if kernel.scaling == "lengths" else list(kernel.points)
