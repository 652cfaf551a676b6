"""Errors in units of the rounding, u = 2^-53 (2^-24 in single precision); defined for 0, infinity, NaN and underflow.

    error = |computed - true| / (u max(|true|, smallest normal number))

normwise (2-norm) over a block, three rows of a gradient that belong to a point or one that belongs to a sliding coordinate,
and likewise for the Hessian; or for each component alone, where one below u times its block is held to u times its block: further
down a sum in twice the digits has none left. Since a number below the smallest normal one is held to within half
the smallest subnormal, which is u times the smallest normal, one unit is always one unit of what the format can hold, and
a true zero asks for a zero. A result that is not finite where the truth fits the format is an infinite error. Where the truth
does not fit, the block has no error, nor has any block of an element that was refused for that: NaN here, counted as overflow or
as without a value.

Differences are taken to the true value, not to the nearest double: an error of a hundredth of a unit is seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.truth import Truth
from yarnverify.symbolic.tree import Name

Array = NDArray[Any]
UNIT = {"float64": 2.0**-53, "float32": 2.0**-24}
OUTPUTS = ("E", "G", "H")


@dataclass(frozen=True)
class Errors:
    """Errors of one output.

    Attributes
    ----------
    blocks
        Names of the blocks: ``""``, ``x1``, ``x1,u1``.
    normwise, componentwise
        (blocks, n) and (blocks, n), of the latter the worst component; NaN where the truth has no value in this format.
    nan, infinite
        (n,) bool: something computed is NaN, or infinite, where the truth fits.
    underflow, overflow
        (n,) bool: something true is not zero and below the smallest normal number; does not fit.
    """

    blocks: tuple[str, ...]
    normwise: Array
    componentwise: Array
    nan: Array
    infinite: Array
    underflow: Array
    overflow: Array

    @property
    def worst_block(self) -> Array:
        """(n,): the largest normwise error of each point; NaN where no block has one."""
        return _largest(self.normwise)

    @property
    def worst_component(self) -> Array:
        return _largest(self.componentwise)


def _largest(errors: Array) -> Array:
    known = ~np.isnan(errors)
    return np.where(known.any(axis=0), np.where(known, errors, -1.0).max(axis=0), np.nan)


def slices(unknowns: Sequence[Name]) -> list[tuple[str, slice]]:
    """Label and rows of each unknown."""
    found, at = [], 0
    for name in unknowns:
        size = 3 if name.bold else 1
        found.append((name.label, slice(at, at + size)))
        at += size
    return found


def blocks_of(output: str, unknowns: Sequence[Name]) -> list[tuple[str, tuple[slice, ...]]]:
    """Label and place of each block of an output; of the Hessian those on and above the diagonal."""
    parts = slices(unknowns)
    if output == "E":
        return [("", ())]
    if output == "G":
        return [(label, (rows,)) for label, rows in parts]
    return [(f"{a},{b}", (rows, columns)) for i, (a, rows) in enumerate(parts) for b, columns in parts[i:]]


def norm(array: Array) -> Array:
    """2-norm over all axes but the last, free of overflow: (n,)."""
    flat = np.abs(array.reshape(-1, array.shape[-1]))
    size = flat.max(axis=0)
    scale = np.where((size > 0) & np.isfinite(size), size, 1.0)
    result: Array = scale * np.sqrt(((flat / scale) ** 2).sum(axis=0))
    return result


def true_parts(truth: Truth, output: str) -> tuple[Array, Array]:
    """The nearest doubles of an output and what is left of them."""
    return {
        "E": (truth.energy, truth.energy_low),
        "G": (truth.gradient, truth.gradient_low),
        "H": (truth.hessian, truth.hessian_low),
    }[output]


def measure(output: str, computed: Array, truth: Truth, unknowns: Sequence[Name], dtype: str) -> Errors:
    """Errors of one output of a kernel.

    Parameters
    ----------
    output
        E, G or H.
    computed
        (n,), (dof, n) or (dof, dof, n), of the type ``dtype``.
    truth
        At the same points.
    unknowns
        Of the energy, for the blocks.
    dtype
        float64 or float32.
    """
    unit, limits = UNIT[dtype], np.finfo(dtype)
    tiny = float(limits.tiny)
    high, low = true_parts(truth, output)
    computed = np.asarray(computed, dtype=np.float64)
    n = computed.shape[-1]
    present = truth.has_energy if output == "E" else truth.has_derivatives
    too_large = float(limits.max) * (1 + unit / 2)  # rounds to infinity
    fits = np.abs(high) < too_large
    flat_computed = computed.reshape(-1, n)
    # an element of which something overflows may be refused as a whole
    refused = ~fits.reshape(-1, n).all(axis=0) & np.isnan(flat_computed).all(axis=0)
    every = [
        (label, high[place], low[place], computed[place], fits[place]) for label, place in blocks_of(output, unknowns)
    ]
    normwise, componentwise = np.empty((len(every), n)), np.empty((len(every), n))
    nan, infinite, overflow = np.zeros(n, bool), np.zeros(n, bool), np.zeros(n, bool)
    with np.errstate(all="ignore"):  # infinities and NaN are sorted out below
        for at, (_, true, rest, found, fit) in enumerate(every):
            flat = [part.reshape(-1, n) for part in (true, rest, found)]
            fit = np.all(fit.reshape(-1, n), axis=0)
            difference = (flat[2] - flat[0]) - flat[1]
            broken = ~np.isfinite(flat[2]).all(axis=0)
            floor = np.maximum(unit * norm(flat[0]), tiny)
            each = (np.abs(difference) / np.maximum(np.abs(flat[0]), floor) / unit).max(axis=0)
            whole = norm(difference) / np.maximum(norm(flat[0]), tiny) / unit
            known = present & fit & ~refused
            normwise[at] = np.where(known, np.where(broken, np.inf, whole), np.nan)
            componentwise[at] = np.where(known, np.where(broken, np.inf, each), np.nan)
            nan |= known & np.isnan(flat[2]).any(axis=0)
            infinite |= known & np.isinf(flat[2]).any(axis=0)
            overflow |= present & ~fit
    size = np.abs(high.reshape(-1, n))
    small = ((size > 0) & (size < tiny)).any(axis=0) | truth.flushed[OUTPUTS.index(output)]
    return Errors(
        tuple(label for label, *_ in every), normwise, componentwise, nan, infinite, present & small, overflow
    )
