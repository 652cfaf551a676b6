"""Vibration modes: small oscillations about an equilibrium, K v = omega^2 M v, by shift and invert."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import ArpackError, eigsh

from yarnverify.errors import InputError, NotRunError
from yarnverify.kernels import bending, kinetic, stretch
from yarnverify.simulation.answers.rods import frequency
from yarnverify.simulation.assembly import System, Term
from yarnverify.simulation.cloth import Fabric
from yarnverify.simulation.fabric import bends, segments, weave, yarn
from yarnverify.simulation.inertia import Inertia, elements_of
from yarnverify.simulation.linear import LinearSolveError, Multifrontal

Array = NDArray[Any]
_ORDERS = ((1, 1), (1, 2), (2, 1), (2, 2))


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes in ascending order of omega^2.

    Attributes
    ----------
    frequencies
        Hz, (k,); negative for a mode that grows instead: minus its rate over 2 pi.
    shapes
        What each entry of the configuration does, (size, k), greatest entry 1.
    """

    frequencies: Array
    shapes: Array


def modes(fabric: Fabric, terms: Sequence[Term], active: ArrayLike, rho: float, Q: Array | None = None,
          count: int = 6) -> Modes:  # fmt: skip
    """The lowest modes of a fabric in equilibrium. Sliding coordinates are held: alone they have no mass of their own.

    Parameters
    ----------
    terms, active
        Energies, and indices of the unknowns; those of positions among them move.
    rho
        Linear density, kg/m; the mass is that of the kinetic energy as declared (consistent).
    Q
        Equilibrium, (size,), m; the rest if not given.
    count
        How many.

    Raises
    ------
    InputError
        More modes than unknowns.
    NotRunError
        Modes that are not found.
    """
    at = fabric.Q if Q is None else Q
    moving = np.asarray(active)[np.asarray(active) < 3 * fabric.nodes]
    if not 0 < count < moving.size:
        raise InputError(
            f"there are {moving.size} positions that move: ask for 1 to {moving.size - 1} modes, not {count}"
        )
    term = Term(kinetic, segments(fabric, kinetic), {"rho": rho})
    system = System(at, terms, moving, others=[elements_of(term)])
    inertia = Inertia(system, term)
    inertia.bind(at)
    stiffness, mass = system.hessian(at), inertia.active_mass
    solver = Multifrontal(system.nodes, system.coordinates)
    shift = -1e-3 * float(stiffness.diagonal().max() / mass.diagonal().max()) / moving.size**2
    start = np.cos(np.arange(1.0, moving.size + 1))
    try:
        while solver.factorise(stiffness - shift * mass).negative:  # Sylvester: modes below the shift
            shift *= 8
        values, vectors = eigsh(stiffness, k=count, M=mass, sigma=shift, v0=start)
    except (ArpackError, LinearSolveError, RuntimeError) as error:
        raise NotRunError(f"the modes were not found: {error}") from None
    order = np.argsort(values, kind="stable")
    values, vectors = values[order], vectors[:, order]
    shapes = np.zeros((fabric.size, count))
    shapes[system.active] = vectors / np.take_along_axis(vectors, np.abs(vectors).argmax(axis=0)[None], axis=0)
    return Modes(np.sign(values) * np.sqrt(np.abs(values)) / (2 * np.pi), shapes)


@dataclass(frozen=True)
class Compared:
    """Frequencies of a fabric beside those that are known, at one size.

    Attributes
    ----------
    found, discrete, limit
        Hz: as computed, of the same discrete fabric in closed form, and of the continuum.
    """

    size: int
    found: tuple[float, ...]
    discrete: tuple[float, ...]
    limit: tuple[float, ...]

    @property
    def error(self) -> float:
        """Greatest relative error against the continuum."""
        return max(abs(f / e - 1) for f, e in zip(self.found, self.limit, strict=True))

    @property
    def discrete_error(self) -> float:
        """Greatest relative error against the discrete answer."""
        return max(abs(f / e - 1) for f, e in zip(self.found, self.discrete, strict=True))


def pinned_yarn(size: int, count: int = 4, *, k_s: float, k_b: float, rho: float, length: float = 0.1) -> Compared:
    """A straight yarn with pinned ends that swings in a plane: f_n = n^2 pi/(2 l^2) sqrt(k_b/rho)."""
    fabric = yarn(length, size)
    terms = [Term(stretch, segments(fabric), {"k_s": k_s}), Term(bending, bends(fabric), {"k_b": k_b})]
    active = np.concatenate([fabric.positions(range(1, size), "x"), fabric.positions(range(1, size), "z")])
    found = modes(fabric, terms, active, rho, count=count)
    numbers = range(1, count + 1)
    discrete = tuple(frequency(n, k_b=k_b, rho=rho, length=length, segments=size) for n in numbers)
    limit = tuple(frequency(n, k_b=k_b, rho=rho, length=length) for n in numbers)
    return Compared(size, tuple(found.frequencies.tolist()), discrete, limit)


def tight_net(size: int, *, k_s: float, rho: float, L: float = 1e-3, R: float = 0.2e-3, strain: float = 0.01,
              orders: Sequence[tuple[int, int]] = _ORDERS) -> tuple[Compared, Fabric, Modes]:  # fmt: skip
    """A square net, stretched and held at its border, that swings out of its plane like a membrane.

    With w_m = 4 sin^2(m pi/(2 n)) for n cells each way, strain e and tension T = k_s e, a mode (m, k) has

        omega^2 = T (w_m + w_k)/((1 + e) rho L^2 (2 - (w_m + w_k)/6)),

    since each crossing carries two yarns whose mass is that of the declared kinetic energy; its limit is
    f = sqrt((m^2 + k^2) T/(2 rho (1 + e)))/(2 a), a = n L: waves at the speed sqrt(T (1 + e)/(2 rho)) on a side (1 + e) a.

    Returns
    -------
    compared, fabric, modes
        The frequencies; and what a picture needs.
    """
    fabric = weave("plain", (size + 1, size + 1), L, R)
    Q = fabric.Q.copy()
    fabric.points(Q)[:] *= 1 + strain
    inside = ((fabric.grid > 0) & (fabric.grid < size)).all(axis=1)
    terms = [Term(stretch, segments(fabric), {"k_s": k_s})]
    found = modes(fabric, terms, fabric.positions(fabric.crossings[inside]), rho, Q, count=len(orders))
    tension = k_s * strain

    def discrete(m: int, k: int) -> float:
        wave = sum(4 * math.sin(number * math.pi / (2 * size)) ** 2 for number in (m, k))
        return math.sqrt(tension * wave / ((1 + strain) * rho * L**2 * (2 - wave / 6))) / (2 * math.pi)

    def limit(m: int, k: int) -> float:
        return math.sqrt((m * m + k * k) * tension / (2 * rho * (1 + strain))) / (2 * size * L)

    exact = (tuple(sorted(f(m, k) for m, k in orders)) for f in (discrete, limit))
    return Compared(size, tuple(found.frequencies.tolist()), *exact), fabric, found


def observed_order(compared: Sequence[Compared]) -> float:
    """With which power of the size the error against the continuum falls, between the two finest."""
    coarse, fine = compared[-2:]
    return math.log(coarse.error / fine.error) / math.log(fine.size / coarse.size)
