"""The tapes of ``tape`` as one fused loop over elements, by numba; an optional engine (extra ``compiled``).

The same operations on the same numbers in the same order, without fused multiply-add, so the same bits as NumPy for every
variant but those that call arccos, sin and cos, whose last digits are the library's own.

Elements go through a block of local memory whose rows lie at fixed distances. That is what lets the compiler see that no
row overlaps another and turn the statements into vector instructions, which is worth a factor of three.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import threading
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.files import write_text
from yarnverify.kernels.tape import Tape

if TYPE_CHECKING:
    from yarnverify.kernels.batch import Batch

Array = NDArray[Any]
BLOCK = 256  # elements whose inputs and results stay in the cache together
STRIDE = BLOCK + 8  # from row to row: with a power of two all rows would fall into the same few lines of the cache
USUAL, MIXED, STRANGE = 0, 1, 2  # what a loop says of its elements
_MAKING = threading.Lock()  # threads that share a batch make its loop once
_INFIX = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}
_PREFIX = {"negative": "-", "positive": "+"}
_CALLS = {"absolute": "abs", "sqrt": "sqrt", "arccos": "acos", "arctan2": "atan2"} | {
    name: name for name in ("cos", "exp", "expm1", "log", "log1p", "sin", "sinh", "tan")
}


def source_of(tape: Tape, layout: str) -> str:
    """The loop over elements as text, scalar statements in the order of the tape.

    It returns STRANGE if a coordinate is neither zero nor of a size from ``small`` to ``limit``, if a margin, in the first
    ``checks`` rows of ``rest``, is not between 1/limit and limit, or if a choice, in the others, is not finite; else MIXED if a
    choice is not positive; else USUAL.

    Parameters
    ----------
    tape
        What to do.
    layout
        ``C`` if all arrays lie in memory row by row without gaps, which is the faster; else ``A``.
    """
    given, found = tape.inputs * STRIDE, tape.outputs * STRIDE
    body = "\n            ".join(_statements(tape))
    return f"""from math import acos, atan2, cos, exp, expm1, log, log1p, sin, sinh, sqrt, tan

import numpy as np
from numba import njit, types

real = types.{tape.dtype}
whole = types.int64
index = types.uint64  # without the case of negative indices, which the compiler cannot turn into vector instructions
inputs = types.Array(real, 2, "{layout}", readonly=True)
outputs = types.Array(real, 3, "{layout}")


@njit(nogil=True, error_model="numpy")
def write(found, places, out, first, at, count):
    for k in range(places.shape[0]):
        source = found[places[k, 0] * {STRIDE}:]
        if at.size:
            row = out[places[k, 1], places[k, 2]]
            for j in range(count):
                row[at[j]] = source[j]
        else:
            row = out[places[k, 1], places[k, 2], first:]
            for j in range(count):
                row[j] = source[j]


@njit(
    [whole(inputs, real[:, ::1], whole, whole, index[::1], whole[:, ::1], outputs, whole[:, ::1], outputs,
      whole[:, ::1], outputs, real[:, ::1], whole, real, real)],
    nogil=True, error_model="numpy", fastmath=False, cache=True,
)
def loop(q, values, first, number, at, places_e, energy, places_g, gradient, places_h, hessian, rest, checks, limit, small):
    tame = same = True
    given = np.zeros({given}, real)
    found = np.empty({found}, real)
    rows, more = q.shape[0], values.shape[0]
    for start in range(0, number, {BLOCK}):
        count = min({BLOCK}, number - start)
        now = at[start:]
        for k in range(rows):
            if at.size:
                for j in range(count):
                    given[k * {STRIDE} + j] = q[k, now[j]] + real(0)
            else:
                row = q[k, first + start:]
                for j in range(count):
                    size = abs(row[j])
                    tame &= (size < limit) & ((size >= small) | (size == 0))
                    given[k * {STRIDE} + j] = row[j] + real(0)
        for k in range(more):
            for j in range(count):
                given[(rows + k) * {STRIDE} + j] = values[k, start + j]
        for j in range(min({BLOCK}, (count + 7) // 8 * 8)):
            {body}
        write(found, places_e, energy, first + start, now, count)
        write(found, places_g, gradient, first + start, now, count)
        write(found, places_h, hessian, first + start, now, count)
        for k in range(rest.shape[0]):
            for j in range(count):
                value = found[({tape.outputs} - rest.shape[0] + k) * {STRIDE} + j]
                rest[k, start + j] = value
                if k < checks:
                    tame &= (value > 1 / limit) & (value < limit)
                else:
                    tame &= np.isfinite(value)
                    same &= value > 0
    return {USUAL} if tame and same else {MIXED} if tame else {STRANGE}
"""


def _statements(tape: Tape) -> list[str]:
    outputs, scratch = tape.inputs, tape.inputs + tape.outputs
    constants = scratch + tape.scratch
    fresh = {i: f"x{i}" for i in range(tape.inputs)}

    def name(slot: int) -> str:
        return f"real({tape.constants[slot - constants]!r})" if slot >= constants else fresh[slot]

    lines = [f"x{i} = given[{i * STRIDE} + j]" for i in range(tape.inputs)]
    for step, (operation, operands, result) in enumerate(tape.calls):
        values = [name(slot) for slot in operands]
        if operation in _INFIX:
            text = f"{values[0]} {_INFIX[operation]} {values[1]}"
        elif operation in _PREFIX:
            text = f"{_PREFIX[operation]}{values[0]}"
        elif operation == "select":
            text = f"{values[1]} if {values[0]} > 0 else {values[2]}"
        elif operation == "maximum":
            text = f"{values[0]} if {values[0]} >= {values[1]} else {values[1]}"
        else:
            text = f"{_CALLS[operation]}({', '.join(values)})"
        fresh[result] = f"v{step}"
        lines.append(f"v{step} = {text}")
    return lines + [f"found[{i * STRIDE} + j] = {fresh[outputs + i]}" for i in range(tape.outputs)]


def _load(text: str) -> Callable[..., int]:
    """The compiled loop; its source lies in the cache folder, where numba keeps the machine code beside it."""
    if importlib.util.find_spec("numba") is None:
        raise RuntimeError("the engine 'compiled' needs numba: pip install 'yarnverify[compiled]'")
    name = "loop_" + hashlib.sha256(text.encode()).hexdigest()[:16]
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "yarnverify" / "loops"
    path = folder / f"{name}.py"
    if not path.is_file():
        write_text(text, path)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    loop: Callable[..., int] = module.loop
    return loop


class Loops:
    """The loops of a batch, one a shape; a ``Worker``."""

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        self._outputs = _outputs(batch)
        self._layout = "C" if all(array.flags.c_contiguous for array in (batch.rows, *self._outputs)) else "A"
        self._by_first = self._loop(0)
        self._chosen: tuple[bytes, tuple[Any, ...]] = b"", ()  # the last ones of the second shape

    @cached_property
    def _by_second(self) -> Callable[..., int]:
        return self._loop(1)

    def _loop(self, shape: int) -> Callable[..., int]:
        kernel, wanted, dtype = self._batch.kernel, self._batch.wanted, self._batch.dtype
        key = (shape, wanted, dtype, self._layout)
        with _MAKING:
            if key not in kernel.loops:
                kernel.loops[key] = _load(source_of(kernel.tape(shape, wanted, dtype), self._layout))
            return kernel.loops[key]

    def first(self, where: slice) -> tuple[Array, Array, bool]:
        given = self._arguments(0, where, where.start, where.stop - where.start, np.empty(0, np.uint64))
        found = self._by_first(*given)
        return *self._margins(given), found != STRANGE

    def second(self, at: Array) -> Array:
        given = self._arguments(1, at, 0, at.size, at.astype(np.uint64))
        self._by_second(*given)
        return self._margins(given)[0]

    def again(self) -> bool:
        found = self._by_first(*self._whole)
        if found != MIXED:
            return found == USUAL
        at = (~(self._margins(self._whole)[1][0] > 0)).nonzero()[0]
        if len(self._batch.kernel.shapes) == 1:
            return not self._batch.second([at], self)
        if at.tobytes() != self._chosen[0]:
            self._chosen = at.tobytes(), self._arguments(1, at, 0, at.size, at.astype(np.uint64))
        return self._by_second(*self._chosen[1]) == USUAL

    @cached_property
    def _whole(self) -> tuple[Any, ...]:
        return self._arguments(0, slice(0, self._batch.n), 0, self._batch.n, np.empty(0, np.uint64))

    def _arguments(self, shape: int, where: slice | Array, first: int, number: int, at: Array) -> tuple[Any, ...]:
        batch, kernel = self._batch, self._batch.kernel
        values = np.empty((len(batch.values), number), batch.dtype)
        for row, value in zip(values, batch.values_at(where), strict=True):
            row[:] = value
        outputs = kernel.tape(shape, batch.wanted, batch.dtype).outputs
        rest = np.empty((outputs - batch.count, number), batch.dtype)
        sizes = batch.dtype.type(batch.limit), batch.dtype.type(batch.small)
        return batch.rows, values, first, number, at, *self._outputs, rest, len(kernel.shapes[shape].checks), *sizes

    def _margins(self, given: tuple[Any, ...]) -> tuple[Array, Array]:
        rest, checks, *_ = given[-4:]
        return rest[:checks], rest[checks:]


def _outputs(batch: Batch) -> list[Array]:
    """For energy, gradient and Hessian: which output goes to which places, and the array (rows, columns, n) of the places."""
    dof = batch.dof
    pairs = [(i, j) for i in range(dof) for j in range(i, dof)]
    places: dict[str, list[tuple[int, int, int]]] = {"E": [(0, 0, 0)], "G": [(k, 0, k) for k in range(dof)]}
    if batch.full:
        places["H"] = [(k, *place) for k, (i, j) in enumerate(pairs) for place in sorted({(i, j), (j, i)})]
    else:
        places["H"] = [(k, 0, k) for k in range(len(pairs))]
    found: list[Array] = []
    arrays = dict(zip(batch.wanted, batch.out, strict=True))
    before = 0
    for key in "EGH":
        if key not in arrays:
            found += [np.empty((0, 3), np.int64), np.empty((0, 0, 0), batch.dtype)]
            continue
        array = arrays[key]
        found += [
            np.array([(before + k, i, j) for k, i, j in places[key]], np.int64),
            array[np.newaxis, np.newaxis] if key == "E" else array if array.ndim == 3 else array[np.newaxis],
        ]
        before += {"E": 1, "G": dof, "H": len(pairs)}[key]
    return found
