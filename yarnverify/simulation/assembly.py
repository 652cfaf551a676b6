"""From kernels and tables to the energy, gradient and sparse Hessian of a system.

system = System(fabric.Q, [Term(stretch, segments(fabric), {"k_s": 100.0}), ...], active)
energy, gradient, matrix = system.evaluate(Q)

Elements go through kernel and sum a chunk at a time, in memory that is kept: no element Hessian outlives its chunk.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from yarnverify.simulation.calls import Calls
from yarnverify.simulation.linear import Direct
from yarnverify.simulation.owners import owners
from yarnverify.simulation.pattern import Elements, Pattern, zeros
from yarnverify.simulation.problem import Evaluation, Worst
from yarnverify.simulation.scatter import Arrays, Loops, Scatter, engine_for
from yarnverify.simulation.semidefinite import ALONE, Form, eigenvalues, form_of
from yarnverify.simulation.terms import Term

__all__ = ["Evaluation", "System", "Term", "Worst"]

Array = NDArray[Any]


class System:
    """Energies on a configuration of which some entries are unknown.

    Parameters
    ----------
    Q
        A configuration, (size,), such as the rest. Its coordinates serve to order the unknowns for direct solvers.
    terms
        Energies.
    active
        Indices of the unknowns. What is not among them is held where a configuration has it.
    loads
        Constant forces, (size,); their energy is ``-loads . Q``.
    others
        Tables that share the matrix but are summed elsewhere: the kinetic energy.
    engine
        ``numpy`` or ``compiled``, with the same bits; ``auto`` for the faster one of those that are there.
    definite
        ``quick`` for the forms of ``semidefinite``, ``eigenvalues`` for the exact projection of every element.

    """

    def __init__(
        self,
        Q: ArrayLike,
        terms: Sequence[Term],
        active: ArrayLike,
        loads: ArrayLike | None = None,
        *,
        others: Sequence[Elements] = (),
        engine: Literal["auto", "numpy", "compiled"] = "auto",
        definite: Literal["quick", "eigenvalues"] = "quick",
    ) -> None:
        self.size = np.size(Q)
        self.terms = tuple(terms)
        self.active = _indices(active, self.size)
        if definite not in ("quick", "eigenvalues"):
            raise ValueError(f"definite must be 'quick' or 'eigenvalues', not {definite!r}")
        self.engine = engine_for(engine, sum(term.table.count for term in self.terms))
        self.loads = np.zeros(self.size) if loads is None else np.array(loads, float)
        if self.loads.shape != (self.size,):
            raise ValueError(f"loads must have shape ({self.size},), not {self.loads.shape}")
        if not np.isfinite(self.loads).all():
            raise ValueError(f"loads must be finite, but load {np.flatnonzero(~np.isfinite(self.loads))[0]} is not")
        for term in self.terms:
            rows = term.table.rows
            if rows.size and not (rows.min() >= 0 and rows.max() < self.size):
                raise ValueError(f"{term.name}: an element reads beyond the configuration")
        tables = [Elements(t.table.rows, t.kernel.DOFS, zeros(t.kernel.KERNEL)) for t in self.terms]
        self.pattern = Pattern(self.size, self.active, [*tables, *others])
        self.scatter: Scatter = Loops() if self.engine == "compiled" else Arrays()
        self._forms: list[Form] = [form_of(t.kernel) if definite == "quick" else eigenvalues for t in self.terms]
        self.calls = Calls(self.engine)
        for term in self.terms:
            self.calls.reserve(term)
        self.nodes, self.coordinates = owners(np.asarray(Q, float), self.active, tables)
        self.direct = Direct(self.nodes, self.coordinates)

    @property
    def seconds(self) -> dict[str, float]:
        """Time spent so far, by ``kernels`` and ``assembly``, as told by ``clock``."""
        return self.calls.seconds

    @property
    def clock(self) -> Callable[[], float]:
        """What tells the time."""
        return self.calls.clock

    @clock.setter
    def clock(self, clock: Callable[[], float]) -> None:
        self.calls.clock = clock

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return self.pattern.count

    # -- what a state is worth

    def energy(self, Q: Array) -> float:
        """Total energy of a configuration (size,), J.

        Raises
        ------
        ElementError
            An element has none there.
        """
        total = self._work(Q)
        for term, _, part, q in self.calls.chunks(self.terms, Q):
            total += float(np.add.reduce(self.calls.run(term, "E", q, part)[0]))
        return total

    def energies(self, Q: Array) -> dict[str, float]:
        """Energy by the name of its term."""
        found = {term.name: 0.0 for term in self.terms}
        for term, _, part, q in self.calls.chunks(self.terms, Q):
            found[term.name] += float(np.add.reduce(self.calls.run(term, "E", q, part)[0]))
        return found

    def slope(self, Q: Array) -> Array:
        """Derivative of the energy in every entry of a configuration, held ones too, (size,): there it is the reaction."""
        total = np.zeros(self.size)
        for term, _, part, q in self.calls.chunks(self.terms, Q):
            g = self.calls.run(term, "G", q, part)[0]
            self.scatter.entries(total, term.table.rows[:, part], g)
        return total - self.loads

    def gradient(self, Q: Array) -> Array:
        """Derivative of the energy in the unknowns, (active,)."""
        return self.slope(Q)[self.active]

    def hessian(self, Q: Array, definite: bool = False) -> sparse.csc_array:
        """Symmetric sparse Hessian in the unknowns; ``definite`` for the sum of semi-definite forms of the elements."""
        return self.evaluate(Q, definite).matrix

    def evaluate(self, Q: Array, definite: bool = False) -> Evaluation:
        """All at once."""
        total, force = self._work(Q), float(np.maximum.reduce(np.abs(self.loads), initial=0.0))
        slope, sums = np.zeros(self.size), self.pattern.zero()
        for term, number, part, q in self.calls.chunks(self.terms, Q):
            places = self.pattern.places[number]
            if not places.pairs.size:
                e, g = self.calls.run(term, "EG", q, part)
                packed = None
            elif definite and self._forms[number] in ALONE:
                e, g = self.calls.run(term, "EG", q, part)
                packed = self.calls.memory(len(term.kernel.DOFS), e.size)[2]
                self.calls.form(self._forms[number], term, q, part, packed, places)
            else:
                e, g, packed = self.calls.run(term, "EGH", q, part)
                if definite:
                    self.calls.form(self._forms[number], term, q, part, packed, places)
            start = self.clock()
            total += float(np.add.reduce(e))
            force = max(force, self.scatter.entries(slope, term.table.rows[:, part], g))
            if packed is not None:
                self.scatter.blocks(sums, places, part, packed, places.rows)
            self.seconds["assembly"] += self.clock() - start
        start = self.clock()
        matrix = self.pattern.matrix(sums)
        del sums
        slope -= self.loads
        self.seconds["assembly"] += self.clock() - start
        return Evaluation(total, slope[self.active], matrix, force)

    def worst(self, Q: Array) -> Worst | None:
        """The element that contributes most to the greatest entry of the gradient."""
        slope = self.slope(Q)
        if not self.active.size or not self.terms:
            return None
        entry = self.active[np.argmax(np.abs(slope[self.active]))]
        found: tuple[float, Worst] | None = None
        for term in self.terms:
            at = np.flatnonzero((term.table.rows == entry).any(axis=0))
            if not at.size:
                continue
            rows = term.table.rows[:, at]
            e, g = self.calls.run(term, "EG", Q[rows], at, fresh=True)
            size = np.where(rows == entry, np.abs(g), 0).max(axis=0)
            k = int(np.argmax(size))
            if found is None or size[k] > found[0]:
                found = float(size[k]), Worst(term.name, int(at[k]), float(e[k]), Q[rows[:, k]])
        return None if found is None else found[1]

    def softened(self, factor: float) -> System:
        """The same system, with the stiffness of stretch multiplied by a factor."""
        soft = copy(self)
        soft.terms = tuple(
            replace(t, parameters={**t.parameters, "k_s": factor * t.parameters["k_s"]}) if "k_s" in t.parameters else t
            for t in self.terms
        )
        return soft

    def softness(self, Q: Array) -> float:
        """The factor at which stretch is about as stiff as all other forces together are strong."""
        stiff = [float(np.max(t.parameters["k_s"])) for t in self.terms if "k_s" in t.parameters and t.table.count]
        if not stiff:
            return 1.0
        others = copy(self)
        others.terms = tuple(t for t in self.terms if "k_s" not in t.parameters)
        held = others.slope(Q)[self.active]
        return min(1.0, 3 * float(np.abs(held).sum()) / max(stiff))

    # -- how

    def _work(self, Q: Array) -> float:
        if Q.shape != (self.size,):
            raise ValueError(f"a configuration has shape ({self.size},), not {Q.shape}")
        return -float(np.add.reduce(self.loads * Q))


def _indices(active: ArrayLike, size: int) -> Array:
    """The unknowns in order."""
    given = np.asarray(active)
    if given.size and given.dtype.kind not in "iu":
        raise ValueError(f"unknowns are indices, whole numbers, not {given.dtype}")
    found = np.unique(given.astype(np.int64))
    if found.size != given.size:
        raise ValueError("an unknown is listed twice among the active ones")
    if found.size and not (found[0] >= 0 and found[-1] < size):
        raise ValueError(f"unknowns must be indices into a configuration of {size} entries")
    return found
