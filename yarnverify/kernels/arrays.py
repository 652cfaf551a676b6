"""The worker of a batch that calls NumPy: chunk by chunk, or, where a batch is made again, by calls that are kept."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from yarnverify.kernels.inputs import Array
from yarnverify.kernels.memory import scratch

if TYPE_CHECKING:
    from yarnverify.kernels.batch import Batch

ALONE = 4  # elements up to which Python floats cost less than arrays
FEW = 512  # elements up to which a call costs more than its arithmetic, and is prepared where it is made again

Evaluator: TypeAlias = Callable[[Array, list[Any], list[Array]], tuple[Array, Array, bool]]


class Arrays:
    """NumPy calls of a batch; a ``Worker``."""

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        self._by_first = batch.evaluator(0)

    @cached_property
    def _by_second(self) -> Evaluator:
        return self._batch.evaluator(1)

    def first(self, where: slice) -> tuple[Array, Array, bool]:
        batch = self._batch
        found = self._by_first(batch.rows[:, where], batch.values_at(where), batch.targets(where))
        batch.mirror(where)
        return found

    def second(self, at: Array) -> Array:
        batch, checks = self._batch, len(self._batch.kernel.shapes[1].checks)
        if at.size <= ALONE:
            singly = [found for found in (batch.one(1, k) for k in at.tolist()) if found is not None]
            if len(singly) == at.size:
                values = np.array(singly).T
                batch.scatter(at, values)
                return values[batch.count : batch.count + checks]
        part = scratch("results", batch.count, at.size, batch.dtype)
        margins, _, _ = self._by_second(batch.rows.take(at, axis=1), batch.values_at(at), list(part))
        batch.scatter(at, part)
        return margins

    def again(self) -> bool:
        batch = self._batch
        if batch.n > FEW or batch.kernel.numbers == "double-double":
            return False
        inputs, calls, margins, choice = self._whole
        with np.errstate(all="ignore"):
            if not batch.tame(batch.rows):
                return False
            np.add(batch.rows, 0.0, out=inputs)  # -0.0 is 0.0
            for function, arguments in calls:
                function(*arguments)
            batch.mirror(slice(None))
            if not (batch.within(margins) and np.isfinite(choice).all()):
                return False
            later = (~(choice > 0)).nonzero()[1]
            return not later.size or not batch.second([later], self)

    @cached_property
    def _whole(self) -> tuple[Array, list[tuple[Any, tuple[Any, ...]]], Array, Array]:
        """Inputs of few elements, the calls on memory of their own, margins and choice."""
        batch, targets = self._batch, self._batch.targets(slice(None))
        tape, checks = batch.kernel.tape(0, batch.wanted, batch.dtype), len(batch.kernel.shapes[0].checks)
        memory = np.empty((batch.dof + tape.scratch, batch.n), batch.dtype)
        inputs, rest = memory[: batch.dof], np.empty((tape.outputs - len(targets), batch.n), batch.dtype)
        calls = tape.calls_on([*inputs, *batch.values_at(slice(None))], [*targets, *rest], memory[batch.dof :])
        return inputs, calls, rest[:checks], rest[checks:]
