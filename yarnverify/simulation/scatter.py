"""Adding the values of elements to sums, in one order whatever the engine, hence with the same bits."""

from __future__ import annotations

import importlib
from functools import cache
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from yarnverify.errors import NotRunError
from yarnverify.kernels.inputs import Engine
from yarnverify.simulation.pattern import Places

Array = NDArray[Any]
FEW = 512  # elements up to which NumPy is called once for all entries
MANY = 20_000  # elements from which compiled loops are worth the seconds that making them can take


def engine_for(wanted: str, elements: int) -> Engine:
    """The engine for a number of elements, ``auto`` decided."""
    if wanted == "auto":
        return "compiled" if elements >= MANY and find_spec("numba") is not None else "numpy"
    if wanted not in ("numpy", "compiled"):
        raise ValueError(f"engine must be 'auto', 'numpy' or 'compiled', not {wanted!r}")
    return "numpy" if wanted == "numpy" else "compiled"


class Scatter(Protocol):
    """Adds the values of some elements to sums."""

    def entries(self, sums: Array, at: Array, values: Array) -> float:
        """``sums[at[k, e]] += values[k, e]``, k outermost; the greatest of the values in absolute value, 0 of none."""

    def blocks(self, sums: Array, places: Places, part: slice, values: Array, rows: Array) -> None:
        """Rows ``rows`` of values, one for each entry in the order of ``places``, to where they go."""


class Arrays:
    """By NumPy."""

    def entries(self, sums: Array, at: Array, values: Array) -> float:
        """Add entries."""
        if values.shape[1] <= FEW:
            np.add.at(
                sums, at.ravel().astype(np.intp), values.ravel()
            )  # only this kind of index takes NumPy's fast way
        else:
            for places, row in zip(at, values, strict=True):
                np.add.at(sums, places.astype(np.intp), row)
        most, least = np.maximum.reduce(values, None, initial=0.0), np.minimum.reduce(values, None, initial=0.0)
        return max(float(most), -float(least))

    def blocks(self, sums: Array, places: Places, part: slice, values: Array, rows: Array) -> None:
        """Add entries of blocks."""
        if places.base.shape[1] <= FEW and values.shape[1] == places.base.shape[1]:
            np.add.at(sums, places.every, values[rows].ravel())
            return
        turned, block = None, -1
        entries = (rows, places.block, places.straight, places.transposed)
        for row, number, straight, transposed in zip(*(a.tolist() for a in entries), strict=True):
            if number != block:
                block, base = number, places.base[number, part].astype(np.intp)
                turned = places.turned[number, part].astype(np.intp) if places.turned.size else None
            at = base + straight
            if turned is not None and transposed != straight:
                at += (transposed - straight) * turned
            np.add.at(sums, at, values[row])


class Loops:
    """By compiled loops.

    Raises
    ------
    NotRunError
        Without numba.
    """

    def __init__(self) -> None:
        self._entries, self._blocks = _loops()

    def entries(self, sums: Array, at: Array, values: Array) -> float:
        """Add entries."""
        return float(self._entries(sums, at, values))

    def blocks(self, sums: Array, places: Places, part: slice, values: Array, rows: Array) -> None:
        """Add entries of blocks."""
        turned = places.turned[:, part] if places.turned.size else places.turned
        self._blocks(
            sums, places.base[:, part], turned, values, rows, places.block, places.straight, places.transposed
        )  # fmt: skip


@cache
def _loops() -> tuple[Any, Any]:
    try:
        njit = importlib.import_module("numba").njit
    except ImportError:
        raise NotRunError("the engine 'compiled' needs numba: pip install 'yarnverify[compiled]'") from None

    @njit(cache=True, nogil=True)
    def entries(sums, at, values):  # type: ignore[no-untyped-def]
        most = 0.0
        for k in range(at.shape[0]):
            places, row = at[k], values[k]
            for e in range(places.size):
                sums[np.uint64(places[e])] += row[e]
                most = max(most, abs(row[e]))
        return most

    @njit(cache=True, nogil=True)
    def blocks(sums, base, turned, values, rows, block, straight, transposed):  # type: ignore[no-untyped-def]
        for k in range(rows.size):
            row, at, here, there = values[rows[k]], base[block[k]], straight[k], transposed[k]
            if turned.size and here != there:
                other = turned[block[k]]
                for e in range(at.size):
                    sums[np.uint64(at[e] + (there if other[e] else here))] += row[e]
            else:
                for e in range(at.size):
                    sums[np.uint64(at[e] + here)] += row[e]

    return entries, blocks
