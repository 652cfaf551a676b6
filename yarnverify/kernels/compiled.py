"""The tapes of ``tape`` as one fused loop over elements, by numba; an optional engine (extra ``compiled``).

The same operations on the same numbers in the same order, without fused multiply-add, so the same bits as NumPy for every
variant but those that call arccos, sin and cos, whose last digits are the library's own.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.kernels.tape import Tape

if TYPE_CHECKING:
    from yarnverify.kernels.runtime import Kernel

Array = NDArray[Any]
_BLOCK = 256  # elements whose inputs and results stay in the cache together
_INFIX = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}
_PREFIX = {"negative": "-", "positive": "+"}
_CALLS = {"absolute": "abs", "sqrt": "sqrt", "arccos": "acos", "sin": "sin", "cos": "cos", "tan": "tan"}


def source_of(tape: Tape) -> str:
    """The loop over elements as text, scalar statements in the order of the tape."""
    outputs, scratch = tape.inputs, tape.inputs + tape.outputs
    constants = scratch + tape.scratch
    fresh = {i: f"x{i}" for i in range(tape.inputs)}
    kind = "float32" if tape.dtype == np.float32 else ""

    def name(slot: int) -> str:
        if slot >= constants:
            value = repr(tape.constants[slot - constants])
            return f"{kind}({value})" if kind else value
        return fresh[slot]

    lines = [f"x{i} = given[{i}, j]" for i in range(tape.inputs)]
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
            text = f"{_CALLS[operation]}({values[0]})"
        fresh[result] = f"v{step}"
        lines.append(f"v{step} = {text}")
    lines += [f"found[{i}, j] = {fresh[outputs + i]}" for i in range(tape.outputs)]
    body = "\n            ".join(lines)
    return f"""from math import acos, cos, sin, sqrt, tan

import numpy as np
from numba import float32, njit


@njit(nogil=True, error_model="numpy", fastmath=False, cache=True)
def loop(q, moves, out):
    given = np.zeros(({tape.inputs}, {_BLOCK}), out.dtype)
    found = np.empty(({tape.outputs}, {_BLOCK}), out.dtype)
    for start in range(0, out.shape[1], {_BLOCK}):
        count = min({_BLOCK}, out.shape[1] - start)
        for k in range({tape.inputs}):
            for j in range(count):
                given[k, j] = q[k, (start + j) * moves[k]]
        for j in range({_BLOCK}):
            {body}
        for k in range({tape.outputs}):
            for j in range(count):
                out[k, start + j] = found[k, j]
"""


def _load(text: str) -> Callable[..., None]:
    """The compiled loop; its source lies in the cache folder, where numba keeps the machine code beside it."""
    if importlib.util.find_spec("numba") is None:
        raise RuntimeError("the engine 'compiled' needs numba: pip install 'yarnverify[compiled]'")
    name = "loop_" + hashlib.sha256(text.encode()).hexdigest()[:16]
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "yarnverify" / "loops"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.py"
    if not path.is_file():
        draft = path.with_suffix(f".{os.getpid()}.tmp")
        draft.write_text(text, encoding="utf-8")
        draft.replace(path)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    loop: Callable[..., None] = module.loop
    return loop


def evaluator(
    kernel: Kernel, shape: int, wanted: str, dtype: Any, most: int
) -> Callable[[list[Array], list[Any], list[Array]], Array]:
    """A function that fills targets with the outputs of a shape, and gives what is left over as rows."""
    tape = kernel.tape(shape, wanted, dtype)
    key = ("compiled", shape, wanted, np.dtype(dtype))
    if key not in kernel._tapes:
        kernel._tapes[key] = _load(source_of(tape))
    loop = kernel._tapes[key]
    inputs, results = np.empty((tape.inputs, most), dtype), np.empty((tape.outputs, most), dtype)

    def run(rows: list[Array], values: list[Any], targets: list[Array]) -> Array:
        m = rows[0].size
        given, out = inputs[:, :m], results[:, :m]
        moves = np.ones(tape.inputs, np.int64)
        for i, value in enumerate((*rows, *values)):
            if np.ndim(value) == 0:
                given[i, :1], moves[i] = value, 0
            else:
                given[i] = value
        loop(given, moves, out)
        for target, row in zip(targets, out, strict=False):
            target[:] = row
        return out[len(targets) :]

    return run
