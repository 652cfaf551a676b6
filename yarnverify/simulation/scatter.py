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

    def entries(self, sums: Array, at: Array, values: Array) -> None:
        """``sums[at[k, e]] += values[k, e]``, k outermost."""

    def blocks(self, sums: Array, places: Places, part: slice, values: Array, rows: Array) -> None:
        """Rows ``rows`` of values, one for each entry in the order of ``places``, to where they go."""


class Arrays:
    """By NumPy."""

    def entries(self, sums: Array, at: Array, values: Array) -> None:
        """Add entries."""
        for places, row in zip(at, values, strict=True):
            np.add.at(sums, places.astype(np.intp), row)  # only this kind of index takes NumPy's fast way

    def blocks(self, sums: Array, places: Places, part: slice, values: Array, rows: Array) -> None:
        """Add entries of blocks."""
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

    def entries(self, sums: Array, at: Array, values: Array) -> None:
        """Add entries."""
        self._entries(sums, at, values)

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
        for k in range(at.shape[0]):
            places, row = at[k], values[k]
            for e in range(places.size):
                sums[np.uint64(places[e])] += row[e]

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
