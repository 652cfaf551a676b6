"""Small-strain moduli of a weave: computed from the assembled stiffness, beside their closed forms.

The border of a patch follows a uniform strain; the inside finds its own equilibrium. Twice the energy over strain squared
and area is the modulus.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from yarnverify.analysis.cotton import Cotton
from yarnverify.analysis.steps import terms_of
from yarnverify.simulation.assembly import System
from yarnverify.simulation.fabric import weave

Array = NDArray[Any]


@dataclass(frozen=True)
class Modulus:
    """A modulus of a weave.

    Attributes
    ----------
    name, formula, unit
        What it is, its closed form as LaTeX.
    computed, closed
        Values.
    """

    name: str
    formula: str
    unit: str
    computed: float
    closed: float

    @property
    def error(self) -> float:
        """Relative; absolute where the closed form is zero."""
        return abs(self.computed - self.closed) / (abs(self.closed) or 1.0)


def stiffness(cloth: Cotton, size: int = 8, pattern: str = "plain", sliding: bool = True) -> tuple[Array, float, float]:
    """Stiffness of a patch of a weave about rest.

    Parameters
    ----------
    size
        Yarns each way.
    sliding
        Whether yarns slide through the crossings inside.

    Returns
    -------
    membrane, warp, weft
        In its plane, for strains along the weft, along the warp, and shear, (3, 3), N/m; and of a cloth that is rolled up
        along its warps, or along its wefts, N m.
    """
    fabric = weave(pattern, (size, size), cloth.L, cloth.R)
    border = fabric.crossings[~((fabric.grid > 0) & (fabric.grid < size - 1)).all(axis=1)]
    unknowns = np.concatenate([fabric.positions(), fabric.slides()]) if sliding else fabric.positions()
    terms = terms_of(fabric, cloth)
    if not sliding:
        del terms["parallel_contact"]
    system = System(fabric.Q, list(terms.values()), unknowns)
    matrix = system.hessian(fabric.Q).tocsc()
    inside = np.flatnonzero(~np.isin(system.active, fabric.positions(border)))
    factor = splu(matrix[inside][:, inside].tocsc())

    def field(*components: Any) -> Array:
        moved = np.zeros(fabric.size)
        fabric.points(moved)[:] = np.stack(np.broadcast_arrays(*components), axis=1)
        return moved[system.active]

    def relaxed(v: Array) -> Array:
        v[inside] -= factor.solve((matrix @ v)[inside])
        return v

    x, y, zero = (fabric.points(fabric.Q) - fabric.points(fabric.Q).mean(axis=0)).T
    strained = np.stack([relaxed(field(*f)) for f in ((x, zero, zero), (zero, y, zero), (y / 2, x / 2, zero))], axis=1)
    width, length = size * cloth.L, (size - 1) * cloth.L  # a yarn stands for a strip of width L
    roots = np.sqrt([width * length, width * length, length**2])
    membrane = strained.T @ (matrix @ strained) / np.outer(roots, roots)
    rolled = [field(zero, zero, t**2 / 2) for t in (y, x)]  # every crossing on the cylinder
    warp, weft = (float(v @ (matrix @ v)) / (width * (size - 2) * cloth.L) for v in rolled)
    return membrane, warp, weft


def moduli(cloth: Cotton, size: int = 8, pattern: str = "plain") -> tuple[Modulus, ...]:
    """Moduli of a weave beside their closed forms."""
    membrane, warp, weft = stiffness(cloth, size, pattern)
    (e_weft, poisson, _), (_, e_warp, _), (_, _, g) = membrane.tolist()
    k_s, k_b, k_x, L = cloth.k_s, cloth.k_b, cloth.k_x, cloth.L
    bias = float(1 / compliance(membrane, np.array([np.pi / 4]))[0])
    return (
        Modulus("along the warp", r"\frac{k_s}{L}", "N/m", e_warp, k_s / L),
        Modulus("along the weft", r"\frac{k_s}{L}", "N/m", e_weft, k_s / L),
        Modulus("warp against weft", "0", "N/m", poisson, 0.0),
        Modulus("shear", r"\frac{4 k_x}{L}", "N/m", g, 4 * k_x / L),
        Modulus("along the bias", r"\frac{16 k_s k_x}{L \left( k_s + 8 k_x \right)}", "N/m", bias,
                16 * k_s * k_x / (L * (k_s + 8 * k_x))),
        Modulus("bending of the warps", r"\frac{k_b}{L}", "N m", warp, k_b / L),
        Modulus("bending of the wefts", r"\frac{k_b}{L}", "N m", weft, k_b / L),
    )  # fmt: skip


def compliance(membrane: Array, angle: Array) -> Array:
    """Strain of a strip that a unit force a width pulls at some angle from the weft, and that is free to narrow, m/N.

    Parameters
    ----------
    membrane
        Stiffness, (3, 3), N/m.
    angle
        (n,), rad.
    """
    c, s = np.cos(angle), np.sin(angle)
    stress = np.stack([c * c, s * s, c * s])
    return np.einsum("in,in->n", stress, np.linalg.solve(membrane, stress))
