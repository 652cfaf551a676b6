"""Adding the values of elements to sums, in one order whatever the engine, hence with the same bits."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.errors import NotRunError

Array = NDArray[Any]
Add = Callable[[Array, Array, Array, Array], None]


def add(sums: Array, at: Array, values: Array, rows: Array) -> None:
    """``sums[at[k, e]] += values[rows[k], e]``, k outermost."""
    for places, row in zip(at, rows, strict=True):
        np.add.at(sums, places.astype(np.intp), values[row])  # only this kind of index takes NumPy's fast way


@cache
def compiled() -> Add:
    """The same as a compiled loop.

    Raises
    ------
    NotRunError
        Without numba.
    """
    try:
        njit = importlib.import_module("numba").njit
    except ImportError:
        raise NotRunError("the engine 'compiled' needs numba: pip install 'yarnverify[compiled]'") from None

    @njit(cache=True, nogil=True)
    def loop(sums, at, values, rows):  # type: ignore[no-untyped-def]
        for k in range(at.shape[0]):
            places, row = at[k], values[rows[k]]
            for e in range(places.size):
                sums[np.uint64(places[e])] += row[e]

    return loop
