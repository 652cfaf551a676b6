"""BLAS held to one thread: for fronts and vectors of this size its threads cost more than they give, a hundredfold on a busy
machine, and results would depend on their number.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy

Setters = list[tuple[Callable[[], int], Callable[[int], Any]]]


@contextmanager
def one_thread() -> Iterator[None]:
    """Run what is inside with one BLAS thread.

    Works for the OpenBLAS that wheels of NumPy and SciPy carry along, and for any other with ``threadpoolctl`` installed.
    Elsewhere it does nothing; there, set OPENBLAS_NUM_THREADS=1 or what the library at hand reads.
    """
    found = _setters()
    before = [get() for get, _ in found]
    for (_, put), number in zip(found, before, strict=True):
        if number != 1:
            put(1)
    try:
        yield
    finally:
        for (_, put), number in zip(found, before, strict=True):
            if number != 1:
                put(number)


@cache
def _setters() -> Setters:
    try:
        import threadpoolctl
    except ImportError:
        return _of_wheels()
    libraries = threadpoolctl.ThreadpoolController().select(user_api="blas").lib_controllers
    return [(library.get_num_threads, library.set_num_threads) for library in libraries]


def _of_wheels() -> Setters:
    found: Setters = []
    for package in (np, scipy):
        folder = Path(str(package.__file__)).parent
        places = [folder.parent / f"{package.__name__}.libs", folder / ".dylibs"]
        for path in sorted(file for place in places if place.is_dir() for file in place.glob("*openblas*")):
            try:
                library = ctypes.CDLL(str(path))
            except OSError:
                continue
            for prefix, suffix in (("scipy_", "64_"), ("scipy_", ""), ("", "64_"), ("", "")):
                get = getattr(library, f"{prefix}openblas_get_num_threads{suffix}", None)
                put = getattr(library, f"{prefix}openblas_set_num_threads{suffix}", None)
                if get and put:
                    found.append((get, put))
                    break
    return found
