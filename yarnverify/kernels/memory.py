"""Memory that begins at a cache line, so that no vector instruction straddles two: a sixth of a kernel's time."""

from __future__ import annotations

import math
import threading
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

Array = NDArray[Any]
LINE = 64  # bytes of a cache line, and of the longest vector registers
_KEPT = threading.local()


def aligned(shape: tuple[int, ...], dtype: DTypeLike) -> Array:
    """An uninitialised array, contiguous, whose first element begins a cache line."""
    size = math.prod(shape)
    item = np.dtype(dtype).itemsize
    memory = np.empty(size + LINE // item, dtype)
    start = -memory.ctypes.data % LINE // item
    return memory[start : start + size].reshape(shape)


def scratch(purpose: str, rows: int, most: int, dtype: DTypeLike) -> Array:
    """Uninitialised rows (rows, most), each beginning a cache line, that are the caller's until the thread asks again.

    Every thread keeps its own for each purpose, a few megabytes: fresh memory can cost more than the arithmetic on it.
    """
    line = LINE // np.dtype(dtype).itemsize
    length = -(-most // line) * line
    needed = rows * length * np.dtype(dtype).itemsize
    if getattr(_KEPT, purpose, np.empty(0)).size < needed:
        setattr(_KEPT, purpose, aligned((needed,), np.uint8))
    found: Array = getattr(_KEPT, purpose)[:needed].view(dtype).reshape(rows, length)[:, :most]
    return found
