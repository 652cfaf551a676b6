"""Calls of kernels, a chunk of elements at a time, in memory that is kept, and the time they take."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
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
    _needed: int = 0
    _room: Array = field(default_factory=lambda: np.empty(0))
    _memory: dict[tuple[int, int], list[Array]] = field(default_factory=dict)
    # with their terms, whose ids they keep
    _chunks: dict[int, tuple[Term, list[tuple[slice, Array, Array]]]] = field(default_factory=dict)
    _batches: dict[tuple[int, str], tuple[Term, Batch]] = field(default_factory=dict)

    def chunks(self, terms: Sequence[Term], Q: Array) -> Iterator[tuple[Term, int, slice, Array]]:
        """Term, its number, a range of its elements, and what they read of a configuration (dofs, m)."""
        for number, term in enumerate(terms):
            for part, rows, q in self._parts(term):
                before = self.clock()
                Q.take(rows, out=q, mode="clip")
                self.seconds["assembly"] += self.clock() - before
                yield term, number, part, q

    def _parts(self, term: Term) -> list[tuple[slice, Array, Array]]:
        """Each chunk of a term's elements: their range, the rows of Q that they read, and the memory to read into."""
        if id(term) not in self._chunks:
            made = []
            for start in range(0, term.table.count, CHUNK):
                part = slice(start, min(start + CHUNK, term.table.count))
                rows = term.table.rows[:, part]
                made.append((part, rows, self.memory(*rows.shape)[3]))
            self._chunks[id(term)] = term, made
        return self._chunks[id(term)][1]

    def memory(self, dof: int, n: int) -> list[Array]:
        """Memory for energy, gradient, packed Hessian and rows of a chunk: the same for all chunks, one at a time."""
        if (dof, n) not in self._memory:
            heights = np.cumsum([0, 1, dof, dof * (dof + 1) // 2, dof])
            if heights[-1] * n > self._room.size:
                self._room = aligned((max(int(heights[-1]) * n, self._needed),), float)
            energy, *others = (self._room[a * n : b * n].reshape(b - a, n) for a, b in pairwise(heights.tolist()))
            self._memory[dof, n] = [energy[0], *others]
        return self._memory[dof, n]

    def reserve(self, term: Term) -> None:
        """Have room for a term's chunks when memory is first asked for."""
        dof = len(term.kernel.DOFS)
        self._needed = max(self._needed, (1 + 2 * dof + dof * (dof + 1) // 2) * min(term.table.count, CHUNK))

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
