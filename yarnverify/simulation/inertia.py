"""Kinetic energy of a system: momenta, forces of inertia, and their derivatives, all from the kinetic kernel.

Scenes take the kernel's variant ``fast``: a step rounds its unknowns and their rates, and that variant loses no more than
these roundings do to the result. What ``accurate`` keeps beyond, and takes several times as long for, no step could use.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from yarnverify.kernels.batch import upper
from yarnverify.simulation.assembly import System, Term
from yarnverify.simulation.calls import CHUNK
from yarnverify.simulation.pattern import TAKEN, Elements, zeros

Array = NDArray[Any]


class Kinetic(NamedTuple):
    """Kinetic energy T(q, v): its value, momenta dT/dv and dT/dq (size,) each."""

    energy: float
    momentum: Array
    slope: Array


def elements_of(term: Term) -> Elements:
    """The unknowns of a kinetic table without their rates, for the pattern of a system."""
    half = _half(term)
    return Elements(term.table.rows[:half], term.kernel.DOFS[:half])


def _half(term: Term) -> int:
    """Number of rows that are coordinates; their rates follow in the same order."""
    half = len(term.kernel.DOFS) // 2
    if not np.array_equal(term.table.rows[:half], term.table.rows[half:]):
        raise ValueError(f"{term.name}: the second half of the rows must be rates of the first")
    return half


class Inertia:
    """The kinetic energy of a system made with ``others=[elements_of(term)]``.

    Parameters
    ----------
    system
        Whose pattern and unknowns it shares.
    term
        Kinetic kernel and table: coordinates, then their rates.
    """

    def __init__(self, system: System, term: Term) -> None:
        self.system, self.term, self.half = system, term, _half(term)
        self._places = system.pattern.places[len(system.terms)]
        rows = term.table.rows[: self.half]
        slides = [k for k, label in enumerate(term.kernel.DOFS[: self.half]) if "." not in label]
        self._slides = rows[slides]
        self._sliding = bool((system.pattern.local[self._slides] >= 0).any())
        self._key = b""
        system.calls.reserve(term)

    @cached_property
    def _number(self) -> dict[tuple[int, int], int]:
        """Row of the packed Hessian of each pair of coordinates and rates."""
        return {pair: k for k, pair in enumerate(upper(2 * self.half))}

    @cached_property
    def _packed(self) -> list[Array]:
        """Rows of the packed Hessian by qq, qv, vq and vv, of each pair (i, j) of coordinates that matters, (k,) each."""
        half, number = self.half, self._number
        pairs = [upper(half)[k] for k in self._places.pairs]
        found = ([number[i, j], number[i, half + j], number[j, half + i], number[half + i, half + j]] for i, j in pairs)
        return list(np.array(list(found), int).reshape(-1, 4).T)

    def _run(self, wanted: str, q: Array, part: slice) -> list[Array]:
        return self.system.calls.run(self.term, wanted, q, part)

    def _parts(self, Q: Array, V: Array) -> Any:
        rows = self.term.table.rows[: self.half]
        for start in range(0, rows.shape[1], CHUNK):
            part = slice(start, min(start + CHUNK, rows.shape[1]))
            q = self.system.calls.memory(2 * self.half, part.stop - part.start)[3]
            q[: self.half], q[self.half :] = Q[rows[:, part]], V[rows[:, part]]
            yield part, rows[:, part], q

    def kinetic(self, Q: Array, V: Array) -> Kinetic:
        """Energy, momenta and slope for coordinates and velocities (size,) each."""
        energy, momentum, slope = 0.0, np.zeros(self.system.size), np.zeros(self.system.size)
        for part, rows, q in self._parts(Q, V):
            e, g = self._run("EG", q, part)
            energy += float(np.add.reduce(e))
            self.system.scatter.entries(slope, rows, g[: self.half])
            self.system.scatter.entries(momentum, rows, g[self.half :])
        return Kinetic(energy, momentum, slope)

    def jacobian(self, Q: Array, V: Array, rate: float, weight: float, share: float) -> tuple[Any, Any]:
        """``rate T_vv - share T_qq`` (symmetric) and ``weight (T_vq - T_qv)`` (skew), sparse, in the unknowns."""
        pattern = self.system.pattern
        qq, qv, vq, vv = self._packed
        even, odd = pattern.zero(), pattern.zero()
        rows = self._places.which
        for part, _, q in self._parts(Q, V):
            (packed,) = self._run("H", q, part)
            self.system.scatter.blocks(even, self._places, part, rate * packed[vv] - share * packed[qq], rows)
            # a pair stands for the entry (i, j) of the element, which may lie below the diagonal of the system
            values = weight * (packed[vq] - packed[qv])
            self._places.turn(values, part)
            self.system.scatter.blocks(odd, self._places, part, values, rows)
        return pattern.matrix(even), pattern.skew(odd)

    @cached_property
    def mass(self) -> sparse.csr_array:
        """The constant mass matrix of all entries of a configuration (size, size), where no sliding coordinate moves."""
        half, size = self.half, self.system.size
        axes = [k for k, label in enumerate(self.term.kernel.DOFS[:half]) if "." in label]
        none = zeros(self.term.kernel.KERNEL)
        pairs = [(i, j, self._number[half + min(i, j), half + max(i, j)]) for i in axes for j in axes]
        pairs = [pair for pair in pairs if pair[2] not in none]
        first, second, which = np.array(pairs, int).reshape(-1, 3).T
        total = sparse.csr_array((size, size))
        for part, rows, q in self._parts(self._rest, np.zeros(size)):
            (packed,) = self._run("H", q, part)
            places = rows[first].ravel(), rows[second].ravel()
            total = total + sparse.coo_array((packed[which].ravel(), places), shape=(size, size)).tocsr()
        return total

    def bind(self, Q: Array, *others: Array) -> bool:
        """Whether the mass matrix is constant: no sliding coordinate is unknown, or differs between configurations.

        If so, ``mass`` and ``active_mass`` are those of Q from here on.
        """
        rest = Q[self._slides]
        if self._sliding or any((other[self._slides] != rest).any() for other in others):
            return False
        key = rest.tobytes()
        if key != self._key:
            self._key, self._rest = key, Q.copy()
            self.__dict__.pop("mass", None)
            self.__dict__.pop("_active_mass", None)
        return True

    @property
    def active_mass(self) -> sparse.csc_array:
        """The constant mass matrix of the unknowns, in the pattern of the system."""
        found = self.system.pattern.matrix(self.system.pattern.zero())
        self.add_mass(found, 1.0)
        return found

    def add_mass(self, matrix: sparse.csc_array, factor: float) -> None:
        """Add the constant mass matrix to one of the system's pattern, in place."""
        at, values = self._active_mass
        for start in range(0, at.size, TAKEN):  # all at once, NumPy would take twice their memory
            part = slice(start, start + TAKEN)
            matrix.data[at[part]] += factor * values[part]

    @cached_property
    def _active_mass(self) -> tuple[Array, Array]:
        """Places and values of the entries that are not zero."""
        _, _, _, vv = self._packed
        sums = self.system.pattern.zero()
        for part, _, q in self._parts(self._rest, np.zeros(self.system.size)):
            (packed,) = self._run("H", q, part)
            self.system.scatter.blocks(sums, self._places, part, packed[vv], self._places.which)
        return self.system.pattern.nonzero(sums)
