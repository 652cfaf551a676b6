"""Calls of a function in a C library, in the child process.

    void NAME(const double *state, const double *parameters, double *output, ...);

One state a call, in the order of ``--order``; the parameters in the order of the declaration (or of ``--with``); one pointer
for each output, by default energy, gradient and hessian. Matrices are stored row by row. With ``--float32`` all numbers are
``float``.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.errors import InputError

Array = NDArray[Any]
GUARD = 64  # numbers on either side of an output that nobody may touch
_MARK = {"float64": np.uint64(0x7FF8_DEAD_BEEF_0001), "float32": np.uint32(0x7FC0_BEEF)}


class Buffer:
    """Room for one output, with a guard on either side; filled with a mark that no computation gives."""

    def __init__(self, name: str, size: int, dtype: str) -> None:
        self.name, self.size, self.mark = name, size, _MARK[dtype]
        self.bits = np.full(size + 2 * GUARD, self.mark)
        self.numbers = self.bits.view(dtype)[GUARD : GUARD + size]

    def pointer(self) -> int:
        return int(self.numbers.ctypes.data)

    def reset(self) -> None:
        self.bits[:] = self.mark

    def complaint(self) -> str:
        """What is wrong with what was written; empty if nothing."""
        before, after = self.bits[:GUARD] != self.mark, self.bits[GUARD + self.size :] != self.mark
        if after.any():
            return f"writes {int(np.flatnonzero(after)[-1]) + 1} numbers past the end of {self.name}, which has {self.size}"
        if before.any():
            return f"writes {GUARD - int(np.flatnonzero(before)[0])} numbers before the start of {self.name}"
        missing = np.flatnonzero(self.bits[GUARD : GUARD + self.size] == self.mark)
        if missing.size:
            which = f"number {missing[0]}" if missing.size < self.size else "anything"
            half = (
                self.bits.itemsize == 8 and missing[0] == self.size // 2 > 0 and missing.size == self.size - missing[0]
            )
            hint = ": are its numbers float? Then say --float32" if half else ""
            return f"does not write {which} of {self.name}, which has {self.size}{hint}"
        return ""


def run_library(task: Any) -> None:
    """Call the function at every state.

    Raises
    ------
    InputError
        Where the library or the function is not there.
    """
    path, _, name = task.task["target"].rpartition(":")
    try:
        function = getattr(ctypes.CDLL(path), name)
    except OSError as error:
        raise InputError(f"{path}: cannot be loaded: {error}") from None
    except AttributeError:
        raise InputError(f'{path}: has no function {name}; in C++, declare it extern "C"') from None
    function.restype = None
    dtype = task.task["dtype"]
    returns, sizes = task.task["returns"], task.task["sizes"]
    buffers = [Buffer(output, sizes[output], dtype) for output in returns]
    given = task.task["arguments"]
    parameters = np.column_stack([task.values[key] for key in given]) if given else np.zeros((len(task.q), 1))
    task.decide({"layout": "single", "returns": returns, "dtype": dtype}, sum(sizes[output] for output in returns))
    for start, stop in task.task["todo"]:
        for at in range(start, stop):
            where = slice(at, at + 1)
            state, values = (np.ascontiguousarray(part[at], dtype=dtype) for part in (task.q, parameters))
            kept = state.copy(), values.copy()
            for buffer in buffers:
                buffer.reset()
            task.begin(where)
            function(
                *[ctypes.c_void_p(int(part.ctypes.data)) for part in (state, values)],
                *[ctypes.c_void_p(b.pointer()) for b in buffers],
            )
            wrong = [text for text in (buffer.complaint() for buffer in buffers) if text]
            if any(part.tobytes() != old.tobytes() for part, old in zip((state, values), kept, strict=True)):
                wrong.append("changes its inputs")
            if wrong:
                task.raised(where, MemoryError("; ".join(wrong)))
            else:
                task.keep(where, np.concatenate([buffer.numbers for buffer in buffers])[None].astype(np.float64))
