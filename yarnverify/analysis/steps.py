"""The largest step of an explicit integrator that is stable, for mass lumped at the nodes.

Central differences (leapfrog, symplectic Euler) are stable up to h = 2/omega, omega the greatest frequency of the fabric:
omega^2 is the greatest eigenvalue of M^-1 K. Sliding coordinates are held: moving a node along a straight yarn that slides
back through it moves no material, so that no step would be small enough for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import eigsh

from yarnverify.analysis.cotton import Cotton
from yarnverify.kernels import bending, parallel_contact, shear, stretch
from yarnverify.simulation.assembly import System, Term
from yarnverify.simulation.cloth import Fabric
from yarnverify.simulation.fabric import bends, contacts, segments, shears, weave

Array = NDArray[Any]


@dataclass(frozen=True)
class Stability:
    """How stiff one energy, or all of them together, make a fabric.

    Attributes
    ----------
    omega
        Greatest frequency, rad/s.
    step
        Largest stable explicit step, s.
    """

    name: str
    omega: float

    @property
    def step(self) -> float:
        return 2 / self.omega


def terms_of(fabric: Fabric, cloth: Cotton) -> dict[str, Term]:
    """The paper's energies on a fabric, by name."""
    return {
        "stretch": Term(stretch, segments(fabric), {"k_s": cloth.k_s}),
        "bending": Term(bending, bends(fabric), {"k_b": cloth.k_b}),
        "shear": Term(shear, shears(fabric), {"k_x": cloth.k_x}),
        "parallel_contact": Term(parallel_contact, contacts(fabric), {"k_c": cloth.k_c}),
    }


def lumped(fabric: Fabric, rho: float, Q: Array | None = None) -> Array:
    """Mass of each entry of a configuration, (size,), kg: half of each segment at either end, none at sliding coordinates."""
    mass = np.zeros(fabric.size)
    table = segments(fabric)
    at = fabric.Q if Q is None else Q
    half = rho * (at[table.rows[7]] - at[table.rows[6]]) / 2
    for row in range(6):
        np.add.at(mass, table.rows[row], half)
    return mass


def greatest_frequency(matrix: Any, mass: Array) -> float:
    """The square root of the greatest eigenvalue of M^-1 K, rad/s.

    Parameters
    ----------
    matrix
        Sparse symmetric K.
    mass
        Diagonal of M, (n,), positive.
    """
    scale = sparse.diags_array(1 / np.sqrt(mass))
    scaled = (scale @ matrix @ scale).tocsr()
    if scaled.shape[0] < 32:
        return float(np.sqrt(np.linalg.eigvalsh(scaled.toarray())[-1]))
    start = np.cos(np.arange(1.0, len(mass) + 1))  # the same every time, along no mode
    (value,) = eigsh(scaled, k=1, which="LA", v0=start, return_eigenvectors=False)
    return float(np.sqrt(value))


def stabilities(cloth: Cotton, size: int = 16) -> list[Stability]:
    """Of each energy alone, then of all together, on a plain weave of so many yarns each way, at rest, all nodes free.

    Parallel contact acts on sliding coordinates alone and sets no bound here.
    """
    fabric = weave("plain", (size, size), cloth.L, cloth.R)
    mass = lumped(fabric, cloth.rho)
    active = fabric.positions()
    terms = {name: term for name, term in terms_of(fabric, cloth).items() if name != "parallel_contact"}
    groups = {**{name: [term] for name, term in terms.items()}, "together": list(terms.values())}
    found = []
    for name, chosen in groups.items():
        matrix = System(fabric.Q, chosen, active).hessian(fabric.Q)
        found.append(Stability(name, greatest_frequency(matrix, mass[active])))
    return found


def conditions(cloth: Cotton, size: int) -> tuple[float, float]:
    """Condition number of the stiffness of a plain weave with its border held, as it is and with a unit diagonal.

    Parameters
    ----------
    size
        Yarns each way.
    """
    fabric = weave("plain", (size, size), cloth.L, cloth.R)
    inside = ((fabric.grid > 0) & (fabric.grid < size - 1)).all(axis=1)
    active = fabric.positions(fabric.crossings[inside])
    terms = [term for name, term in terms_of(fabric, cloth).items() if name != "parallel_contact"]
    matrix = System(fabric.Q, terms, active).hessian(fabric.Q)
    scale = sparse.diags_array(1 / np.sqrt(matrix.diagonal()))
    return _condition(matrix), _condition(scale @ matrix @ scale)


def _condition(matrix: Any) -> float:
    start = np.cos(np.arange(1.0, matrix.shape[0] + 1))
    (high,) = eigsh(matrix, k=1, which="LA", v0=start, return_eigenvectors=False)
    (low,) = eigsh(matrix.tocsc(), k=1, sigma=0.0, v0=start, return_eigenvectors=False)
    return float(high / low)
