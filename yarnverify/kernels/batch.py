"""One call of a kernel, from checked inputs to outputs and named errors.

Nearly all elements go through the first shape a chunk at a time; the few that need something else (the second shape,
numbers of any size, an error) are taken out by looking at their inputs and margins and are done on their own.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from yarnverify.kernels.arrays import Arrays, Evaluator
from yarnverify.kernels.inputs import (
    Array,
    Engine,
    Errors,
    Out,
    Values,
    check_options,
    complain,
    outputs_of,
    parameters_of,
    rows_of,
)
from yarnverify.kernels.memory import scratch
from yarnverify.kernels.special import Special

if TYPE_CHECKING:
    from yarnverify.kernels.runtime import Kernel

CHUNK = 8192  # elements at a time, so that scratch memory stays in the cache
# Threads wait for the interpreter between any two calls of NumPy, which must be long beside that.
_SHARED = 4 * CHUNK

# Lengths, sines and parameters within these powers of two, and coordinates of at most this size that are zero or at least so
# small, can neither overflow nor underflow in any product that occurs, of as many factors.
MOST_FACTORS = 10
_MODERATE = {np.dtype(np.float64): 2.0**100, np.dtype(np.float32): 2.0**14}
_SMALL = {np.dtype(np.float64): 2.0**-200, np.dtype(np.float32): 2.0**-28}

Where: TypeAlias = slice | Array


class Worker(Protocol):
    """What evaluates elements into the outputs of a batch; one a thread."""

    def first(self, where: slice) -> tuple[Array, Array, bool]:
        """Evaluate a range by the first shape; its margins (checks, m), choice (0 or 1, m), and whether all inputs are tame."""

    def second(self, at: Array) -> Array:
        """Evaluate chosen elements by the second shape; its margins."""

    def again(self) -> bool:
        """Evaluate all at the least cost; False where there are elements that need more care."""


class Batch:
    """One call of a kernel: its checked inputs, its outputs, and the elements found bad so far."""

    def __init__(
        self,
        kernel: Kernel,
        wanted: str,
        q: ArrayLike,
        parameters: Values,
        *,
        full: bool = False,
        errors: Errors = "raise",
        out: Out = None,
        threads: int = 1,
        engine: Engine = "numpy",
    ) -> None:
        check_options(errors, threads, engine)
        self.kernel, self.wanted, self.full, self.errors = kernel, wanted, full, errors
        self.rows = rows_of(kernel, q)
        self.dof, self.n = self.rows.shape
        self.dtype = self.rows.dtype
        self.values = parameters_of(kernel, parameters, self.n, self.dtype)
        self.limit, self.small = _MODERATE[self.dtype] ** (MOST_FACTORS / kernel.factors), _SMALL[self.dtype]
        self.watch = self._extreme_values()
        self.grows = not kernel.portable and self._has_exponentials()
        self.threads, self.engine = threads, engine
        dof, n = self.dof, self.n
        self._scalars = {"E": 1, "G": dof, "H": dof * (dof + 1) // 2}
        self.count = sum(self._scalars[key] for key in wanted)
        shapes = {"E": (n,), "G": (dof, n), "H": (dof, dof, n) if full else (self._scalars["H"], n)}
        self.out = outputs_of(kernel, [shapes[key] for key in wanted], self.dtype, out)
        self.reasons: dict[int, str] = {}
        self._kept: Worker | None = None

    def again(self) -> list[Array]:
        """The outputs for what the rows hold by now, which must be the caller's own array of this kind, not a copy."""
        self.reasons.clear()
        if self._kept is not None and self.n <= CHUNK and self.watch is None and not self.grows and self._kept.again():
            return self.out
        return self.results()

    def _has_exponentials(self) -> bool:
        """Whether results may overflow of moderate numbers."""
        tapes = (self.kernel.tape(i, self.wanted, self.dtype) for i in range(len(self.kernel.shapes)))
        return any(name in ("exp", "expm1", "sinh") for tape in tapes for name, _, _ in tape.calls)

    def _extreme_values(self) -> Array | None:
        """(n,) whether an element has a parameter of extreme size; None if none has."""
        found: Array | None = None
        for value in self.values:
            size = np.abs(value)
            extreme = ~((size == 0) | ((size > 1 / self.limit) & (size < self.limit)))
            if extreme.any():
                found = np.zeros(self.n, bool) if found is None else found
                found |= extreme
        return found

    def tame(self, rows: Array, memory: Array | None = None) -> bool:
        """Whether no coordinate is of extreme size, infinite or NaN; ``memory`` of their shape is written to."""
        size = np.abs(rows, out=scratch("sizes", self.dof, rows.shape[1], self.dtype) if memory is None else memory)
        if not size.max(initial=0) < self.limit:  # so it is with NaN
            return False
        if size.min(initial=self.limit) >= self.small:
            return True
        bits = size.view(f"u{size.itemsize}")  # in the order of the numbers, and less 1 zero is the largest
        bits -= bits.dtype.type(1)
        return bool(bits.min(initial=np.iinfo(bits.dtype).max) >= self.dtype.type(self.small).view(bits.dtype) - 1)

    def within(self, margins: Array) -> bool:
        low, high = np.minimum.reduce(margins, None, initial=1.0), np.maximum.reduce(margins, None, initial=1.0)
        return bool(low > 1 / self.limit and high < self.limit)

    def results(self) -> list[Array]:
        """The outputs, filled.

        Raises
        ------
        ElementError
            If an element has no value and errors are not masked.
        """
        if self.n:
            with np.errstate(all="ignore"):  # whatever is not finite is found and named below
                if self.n > 1 or not self._single():
                    self._chunks()
        if self.reasons:
            elements = np.array(sorted(self.reasons))
            if self.errors == "raise":
                complain(self.kernel, elements, self.reasons)
            for array in self.out:
                array[..., elements] = np.nan
        return self.out

    # -- where results go

    def targets(self, where: Where) -> list[Array]:
        """A row for each output scalar, of a range of elements; copies for an array of indices."""
        targets: list[Array] = []
        for key, array in zip(self.wanted, self.out, strict=True):
            if key == "E":
                targets.append(array[where])
            elif key == "H" and self.full:
                targets += [array[i, j, where] for i, j in upper(self.dof)]
            else:
                targets += list(array[:, where])
        return targets

    def scatter(self, at: Array, part: Array) -> None:
        """Write results of chosen elements, a row of ``part`` for each output scalar, (k, m) or (k, 1)."""
        done = 0
        for key, array in zip(self.wanted, self.out, strict=True):
            rows = part[done : done + self._scalars[key]]
            done += len(rows)
            if key == "E":
                array[at] = rows[0]
            elif array.ndim == 3:
                for (i, j), row in zip(upper(self.dof), rows, strict=True):
                    array[i, j, at] = row
            else:
                array[:, at] = rows
        self.mirror(at)

    def mirror(self, where: Where) -> None:
        """Copy the upper triangle of a full Hessian to the lower one."""
        if self.full:
            hessian = self.out[-1]
            for i, j in upper(self.dof):
                if i != j:
                    hessian[j, i, where] = hessian[i, j, where]

    def values_at(self, where: Where) -> list[Any]:
        """The parameters of chosen elements, each 0-d or (m,)."""
        return [value if np.ndim(value) == 0 else value[where] for value in self.values]

    # -- elements one by one

    def one(self, shape: int, element: int) -> list[float] | None:
        """Outputs, margins and choice of one element in Python floats, which cost less than arrays of few elements.

        None where that does not serve: of other numbers, and where arrays would hold infinity or NaN.
        """
        kernel = self.kernel
        if not kernel.portable or kernel.numbers == "double-double" or self.dtype != np.float64:
            return None
        values = [float(value if np.ndim(value) == 0 else value[element]) for value in self.values]
        try:
            return kernel.tape(shape, self.wanted, self.dtype).run_one(
                [v + 0.0 for v in self.rows[:, element].tolist()] + values
            )
        except (ArithmeticError, ValueError):
            return None

    def _single(self) -> bool:
        """A batch of one; False where it needs more care."""
        if self.watch is not None or self.engine != "numpy":
            return False
        if not all(self.small <= abs(v) < self.limit or v == 0 for v in self.rows[:, 0].tolist()):
            return False
        found = self.one(0, 0)
        if found is None:
            return False
        rest = found[self.count :]
        margins = rest[: len(self.kernel.shapes[0].checks)]
        if not all(1 / self.limit < m < self.limit for m in margins):
            return False
        if not all(0 < c < math.inf for c in rest[len(margins) :]):
            return False
        self.scatter(np.zeros(1, int), np.array(found)[:, None])
        return True

    # -- many

    def _chunks(self) -> None:
        threads = min(self.threads, -(-self.n // CHUNK))
        if threads == 1:
            self._kept = self._kept or self._worker()
            self._some(self._ranges(CHUNK), self._kept)
            return
        most = CHUNK if self.engine == "compiled" else _SHARED
        rounds = -(-self.n // (threads * most))
        ranges = self._ranges(-(-self.n // (threads * rounds)))
        for done in [_pool(threads).submit(self._some, ranges[i::threads]) for i in range(threads)]:
            done.result()

    def _ranges(self, size: int) -> list[slice]:
        return [slice(a, b) for a, b in pairwise([*range(0, self.n, size), self.n])]

    def _worker(self) -> Worker:
        if self.engine == "compiled" and self.kernel.numbers != "double-double":
            from yarnverify.kernels.compiled import Loops

            return Loops(self)
        return Arrays(self)

    def _some(self, ranges: list[slice], worker: Worker | None = None) -> None:
        """The chunks of one thread: all in the first shape, then those of the second, then those that need care."""
        with np.errstate(all="ignore"):  # per thread
            worker = worker or self._worker()
            later: list[Array] = []
            strange: list[Array] = []
            for where in ranges:
                margins, choice, tame = worker.first(where)
                odd = self._strange(margins, where)
                if not tame:
                    odd = self._extreme(where) if odd is None else odd | self._extreme(where)
                if choice.size and not np.isfinite(choice).all():
                    odd = ~np.isfinite(choice[0]) if odd is None else odd | ~np.isfinite(choice[0])
                if odd is not None:
                    strange.append(where.start + np.flatnonzero(odd))
                if choice.size and not choice.min() > 0:
                    other = ~(choice[0] > 0)
                    later.append(where.start + np.flatnonzero(other if odd is None else other & ~odd))
                    if sum(at.size for at in later) > CHUNK // 2:  # enough for one call, and still in the cache
                        strange += self.second(later, worker)
                        later.clear()
            strange += self.second(later, worker)
            for at in _groups(strange):
                Special(self, at).settle()

    def second(self, later: list[Array], worker: Worker) -> list[Array]:
        """Evaluate elements in the second shape, or set them to zero; those of them that need more care."""
        found = []
        for at in _groups(later):
            if len(self.kernel.shapes) == 1:
                self.scatter(at, np.zeros((self.count, 1)))
                continue
            odd = self._strange(worker.second(at), at)
            if odd is not None:
                found.append(at[odd])
        return found

    def _strange(self, margins: Array, where: Where) -> Array | None:
        """Elements that are not as tame as nearly all are; None if there are none."""
        watch = None if self.watch is None else self.watch[where]
        if self.grows:
            over = np.asarray(~np.isfinite(self.targets(where)).all(axis=0))
            watch = over if watch is None else watch | over
        if self.within(margins):
            return watch
        strange = ~((margins > 1 / self.limit) & (margins < self.limit)).all(axis=0)
        return np.asarray(strange if watch is None else strange | watch)

    def _extreme(self, where: slice) -> Array:
        """Elements with a coordinate of extreme size, infinite or NaN."""
        size = np.abs(self.rows[:, where])
        return np.asarray(~((size < self.limit) & ((size >= self.small) | (size == 0))).all(axis=0))

    def evaluator(self, shape: int) -> Evaluator:
        """A function that fills targets with the outputs of a shape by NumPy.

        It gives margins and choice as rows, and whether all coordinates are tame.
        """
        kernel, checks = self.kernel, len(self.kernel.shapes[shape].checks)
        if kernel.numbers == "double-double":
            from yarnverify.kernels.doubledouble import evaluator

            pairs = evaluator(kernel.outputs(shape, self.wanted))

            def extra(rows: Array, values: list[Any], targets: list[Array]) -> tuple[Array, bool]:
                return pairs(list(rows + 0.0), values, targets), self.tame(rows)
        else:
            tape = kernel.tape(shape, self.wanted, self.dtype)

            def extra(rows: Array, values: list[Any], targets: list[Array]) -> tuple[Array, bool]:
                memory = scratch("steps", self.dof + max(tape.scratch, self.dof), rows.shape[1], self.dtype)
                inputs = np.add(rows, 0.0, out=memory[: self.dof])  # -0.0 is 0.0
                tame = self.tame(inputs, memory[self.dof : 2 * self.dof])  # while they are in the nearest cache
                rest = np.empty((tape.outputs - len(targets), rows.shape[1]), self.dtype)
                tape.run([*inputs, *values], [*targets, *rest], memory[self.dof : self.dof + tape.scratch])
                return rest, tame

        def run(rows: Array, values: list[Any], targets: list[Array]) -> tuple[Array, Array, bool]:
            rest, tame = extra(rows, values, targets)
            return rest[:checks], rest[checks:], tame

        return run


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Threads that stay, and with them their scratch memory."""
    return ThreadPoolExecutor(threads, "yarnverify")


if hasattr(os, "register_at_fork"):  # a forked process has the pools, but none of their threads
    os.register_at_fork(after_in_child=_pool.cache_clear)


@cache
def upper(dof: int) -> list[tuple[int, int]]:
    """Row and column of each entry of a packed upper triangle."""
    return [(i, j) for i in range(dof) for j in range(i, dof)]


def _groups(found: list[Array]) -> list[Array]:
    """Indices in groups of at most a chunk."""
    every = np.concatenate(found) if found else np.empty(0, int)
    return [every[i : i + CHUNK] for i in range(0, every.size, CHUNK)]
