"""Calls of kernels, a chunk of elements at a time, in memory that is kept, and the time they take."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.kernels import ElementError
from yarnverify.kernels.batch import Batch
from yarnverify.kernels.inputs import Engine
from yarnverify.kernels.memory import aligned
from yarnverify.simulation.pattern import Places
from yarnverify.simulation.semidefinite import Form
from yarnverify.simulation.terms import Term

Array = NDArray[Any]
CHUNK = 8192


@dataclass(eq=False)
class Calls:
    """What calls the kernels of a system.

    Attributes
    ----------
    engine
        ``numpy`` or ``compiled``.
    clock
        What tells the time.
    seconds
        Time spent so far, by ``kernels`` and ``assembly``.
    """

    engine: Engine
    clock: Callable[[], float] = perf_counter
    seconds: dict[str, float] = field(default_factory=lambda: {"kernels": 0.0, "assembly": 0.0})
    _memory: dict[tuple[int, int], list[Array]] = field(default_factory=dict)
    _batches: dict[tuple[int, str], tuple[Term, Batch]] = field(
        default_factory=dict
    )  # with its term, whose id it keeps

    def chunks(self, terms: Sequence[Term], Q: Array) -> Iterator[tuple[Term, int, slice, Array]]:
        """Term, its number, a range of its elements, and what they read of a configuration (dofs, m)."""
        for number, term in enumerate(terms):
            n = term.table.count
            for start in range(0, n, CHUNK):
                part = slice(start, min(start + CHUNK, n))
                rows = term.table.rows[:, part]
                q = self.memory(rows.shape[0], rows.shape[1])[3]
                before = self.clock()
                np.take(Q, rows, out=q, mode="clip")
                self.seconds["assembly"] += self.clock() - before
                yield term, number, part, q

    def memory(self, dof: int, n: int) -> list[Array]:
        """Memory for energy, gradient, packed Hessian and rows of a chunk."""
        if (dof, n) not in self._memory:
            shapes = [(n,), (dof, n), (dof * (dof + 1) // 2, n), (dof, n)]
            self._memory[dof, n] = [aligned(shape, float) for shape in shapes]
        return self._memory[dof, n]

    def run(self, term: Term, wanted: str, q: Array, part: Any, fresh: bool = False) -> list[Array]:
        """Outputs (``E``, ``G``, ``H`` as wanted) of some elements, in memory of their own if fresh.

        Raises
        ------
        ElementError
            An element has none; named by its number in the table.
        """
        start = self.clock()
        try:
            found = self._batch(term, wanted, q, part, fresh).again()
        except ElementError as error:
            at = error.elements + part.start if isinstance(part, slice) else np.asarray(part)[error.elements]
            reason = str(error).partition(f"element {error.elements[0]}: ")[2]
            raise ElementError(f"{term.name}: element {at[0]}: {reason}", at) from None
        finally:
            self.seconds["kernels"] += self.clock() - start
        return found

    def form(self, form: Form, term: Term, q: Array, part: slice, packed: Array, places: Places) -> None:
        """Make a packed Hessian positive semi-definite, in the rows that matter."""
        start = self.clock()
        form(q, term.some(part), packed, places.pairs.tolist())
        self.seconds["kernels"] += self.clock() - start

    def _batch(self, term: Term, wanted: str, q: Array, part: Any, fresh: bool) -> Batch:
        """The call of a kernel; that of a table of one chunk is kept, since making it costs more than a few elements do."""
        whole = not fresh and q.shape[1] == term.table.count
        key = (id(term), wanted)
        if whole and key in self._batches:
            return self._batches[key][1]
        kept = [] if fresh else [self.memory(*q.shape)["EGH".index(letter)] for letter in wanted]
        out: Any = None if fresh else kept if len(kept) > 1 else kept[0]
        made = Batch(term.kernel.KERNEL, wanted, q, term.some(part), out=out, engine=self.engine)
        if whole:
            self._batches[key] = term, made
        return made
