"""Eigenvalues of an element's Hessian: at rest, and their signs over angle and stretch.

Everything is in units of the element: its rest length (or the distance d of contact) and its stiffness are one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.kernels import bending, gravity, parallel_contact, plane, shear, sphere, stretch

Array = NDArray[Any]
NOISE = 1e-10  # of the largest eigenvalue of a state; smaller ones count as zero


@dataclass(frozen=True)
class Family:
    """States of one energy, and how they are named.

    Attributes
    ----------
    state
        Angle and stretch, (n,) each, to rows (dofs, n).
    angle, stretch
        What the two coordinates are, and the values that a map has; one value where a coordinate plays no part.
    rest
        The state of rest, as angle and stretch.
    unit
        Of an eigenvalue.
    parameters
        All one; directions along z, centres at the origin.
    """

    kernel: ModuleType
    state: Callable[[Array, Array], Array]
    angle: tuple[str, Array]
    stretch: tuple[str, Array]
    rest: tuple[float, float]
    unit: str
    parameters: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return str(self.kernel.KERNEL.name)

    @property
    def sliding(self) -> Array:
        """Which rows are sliding coordinates, (dofs,)."""
        return np.array(["." not in label for label in self.kernel.DOFS])


def _stretched(angle: Array, stretch: Array) -> Array:
    q = np.zeros((8, angle.size))
    q[3], q[7] = stretch, 1
    return q


def _bent(angle: Array, stretch: Array) -> Array:
    q = np.zeros((11, angle.size))
    q[3] = stretch
    q[6], q[7] = -stretch * np.cos(angle), -stretch * np.sin(angle)
    q[9], q[10] = 1, -1
    return q


def _sheared(angle: Array, stretch: Array) -> Array:
    q = np.zeros((9, angle.size))
    q[3] = stretch
    q[6], q[7] = np.cos(angle), np.sin(angle)
    return q


def _pressed(angle: Array, stretch: Array) -> Array:
    return np.stack([np.zeros_like(stretch), stretch])


def _outside(angle: Array, stretch: Array) -> Array:
    return np.stack([np.zeros_like(stretch), np.zeros_like(stretch), stretch])


_ONE = np.zeros(1)
_UP, _ORIGIN = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
_NEAR = ("distance over R", np.linspace(0.02, 0.98, 49))
FAMILIES = (
    Family(
        stretch, _stretched, ("", _ONE), ("stretch l/(u_1 - u_0)", np.linspace(0.2, 2.0, 37)), (0.0, 1.0),
        "k_s/h", {"k_s": 1.0},
    ),
    Family(
        bending, _bent, ("turning angle, degrees", np.linspace(2.0, 178.0, 45)),
        ("stretch of both segments", np.linspace(0.2, 2.0, 37)), (0.0, 1.0), "k_b/h^3", {"k_b": 1.0},
    ),
    Family(
        shear, _sheared, ("angle of warp and weft, degrees", np.linspace(2.0, 178.0, 45)),
        ("stretch of the warp segment", np.linspace(0.2, 2.0, 37)), (np.pi / 2, 1.0), "k_x/L", {"k_x": 1.0, "L": 1.0},
    ),
    Family(
        parallel_contact, _pressed, ("", _ONE), ("distance over the distance of contact", np.linspace(0.02, 0.98, 49)),
        (0.0, 0.5), "k_c L", {"k_c": 1.0, "L": 1.0, "d": 1.0},
    ),
    Family(
        gravity, _stretched, ("", _ONE), ("stretch l/(u_1 - u_0)", np.linspace(0.2, 2.0, 37)), (0.0, 1.0),
        "rho g", {"rho": 1.0, "g": (0.0, 0.0, -1.0)},
    ),
    Family(plane, _outside, ("", _ONE), _NEAR, (0.0, 1.0), "k R", {"k": 1.0, "n": _UP, "p": _ORIGIN, "R": 1.0}),
    Family(sphere, _outside, ("", _ONE), _NEAR, (0.0, 1.0), "k R", {"k": 1.0, "c": _ORIGIN, "R": 1.0}),
)  # fmt: skip


def spectrum(kernel: ModuleType, q: ArrayLike, sliding: bool = True, **parameters: Any) -> Array:
    """Eigenvalues of the Hessian of elements, (dofs, n), in ascending order.

    Parameters
    ----------
    kernel
        A module of ``yarnverify.kernels``.
    q
        Rows (dofs, n).
    sliding
        Whether sliding coordinates are unknown; if not, only positions are.
    """
    hessian = np.moveaxis(kernel.hessian(np.asarray(q, float), **parameters), -1, 0)
    if not sliding:
        free = np.array(["." in label for label in kernel.DOFS])
        hessian = hessian[:, free][:, :, free]
    return np.linalg.eigvalsh(hessian).T


def negative(values: Array) -> Array:
    """How many eigenvalues (dofs, n) are negative beyond rounding, (n,)."""
    return (values < -NOISE * np.abs(values).max(axis=0)).sum(axis=0)


def at_rest(family: Family) -> list[tuple[float, int]]:
    """Eigenvalues at rest that are not zero, each with how often it occurs, then zero with its own count.

    A contact that is pressed stands for one at rest, where its second derivative jumps.
    """
    angle, length = (np.array([value]) for value in family.rest)
    values = spectrum(family.kernel, family.state(angle, length), True, **family.parameters)[:, 0]
    scale = float(np.abs(values).max())
    found: list[tuple[float, int]] = []
    for value in sorted(values[np.abs(values) > NOISE * scale], reverse=True):
        if found and abs(found[-1][0] - value) <= 1e-9 * scale:
            found[-1] = (found[-1][0], found[-1][1] + 1)
        else:
            found.append((float(value), 1))
    zeros = len(values) - sum(count for _, count in found)
    return [*found, (0.0, zeros)] if zeros else found


@dataclass(frozen=True)
class Map:
    """How indefinite the Hessian is, over stretch (first) and angle (second).

    Attributes
    ----------
    held, free
        Lowest eigenvalue over the largest in size, zero where none is negative, (stretches, angles): with sliding
        coordinates held, and with all unknowns free. None for an energy that is left without unknowns.
    counts
        All numbers of negative eigenvalues that occur, with all unknowns free.
    """

    held: Array | None
    free: Array
    counts: tuple[int, ...]


def sign_map(family: Family) -> Map:
    """Where the Hessian of an energy is indefinite, and how much."""
    shape = (family.stretch[1].size, family.angle[1].size)
    length, angle = (
        part.ravel() for part in np.meshgrid(family.stretch[1], np.radians(family.angle[1]), indexing="ij")
    )
    q = family.state(angle, length)
    free = spectrum(family.kernel, q, True, **family.parameters)
    held = None
    if not family.sliding.all():
        held = _lowest(spectrum(family.kernel, q, False, **family.parameters)).reshape(shape)
    counts = tuple(int(count) for count in np.unique(negative(free)))
    return Map(held, _lowest(free).reshape(shape), counts)


def _lowest(values: Array) -> Array:
    size = np.abs(values).max(axis=0)
    share = np.divide(values[0], size, out=np.zeros_like(size), where=size > 0)
    return np.where(share < -NOISE, share, 0.0)
