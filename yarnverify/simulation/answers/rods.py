"""Rods with bending stiffness: under their own weight, bent to arcs and rings, buckling, swinging."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_bvp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipkm1

from yarnverify.simulation.answers.elastica import Tip

Array = NDArray[Any]


@dataclass(frozen=True)
class Cantilever:
    """A cantilever under its own weight and a load at its tip.

    Attributes
    ----------
    tip
        In units of the length.
    residual
        Largest relative residual of the differential equation, as ``solve_bvp`` estimates it.
    solution
        pi/2 less the angle, its derivative, and place along and across, at arc lengths from 0 to 1.
    """

    tip: Tip
    residual: float
    solution: Any

    def at(self, s: ArrayLike) -> tuple[Array, Array]:
        """Angle and place (along, across) at arc lengths from 0 to 1: s.shape, s.shape + (2,)."""
        angle, _, along, across = self.solution(np.asarray(s, float))
        return np.pi / 2 - angle, np.stack([along, across], axis=-1)


@lru_cache(maxsize=16)
def cantilever(beta: float, alpha: float = 0.0, tolerance: float = 1e-11) -> Cantilever:
    """A clamped rod under its own weight, beta = rho g L^3/EI, and a load at its tip, alpha = P L^2/EI, both downwards.

    In units of its length, theta measured downwards from the first, level direction,

        theta'' + (alpha + beta (1 - s)) cos(theta) = 0,    theta(0) = 0,    theta'(1) = 0

    solved by collocation for pi/2 - theta, whose sine keeps its digits where the rod hangs down. Heavy rods are reached from
    lighter ones, so that the branch is the one that starts level.

    Raises
    ------
    ValueError
        Where the solution does not reach the tolerance.
    """
    s = np.linspace(0, 1, 101)
    state = np.zeros((4, s.size))
    state[0], state[2] = np.pi / 2, s
    steps = max(1, math.ceil(math.log2(1 + (alpha + beta) / 2)))
    found: Any = None
    for part in np.geomspace(2.0 ** (1 - steps), 1, steps):

        def slope(s: Array, y: Array, share: float = part) -> Array:
            return np.stack([y[1], share * (alpha + beta * (1 - s)) * np.sin(y[0]), np.sin(y[0]), np.cos(y[0])])

        def jacobian(s: Array, y: Array, share: float = part) -> Array:
            entries = np.zeros((4, 4, s.size))
            entries[0, 1] = 1
            entries[1, 0] = share * (alpha + beta * (1 - s)) * np.cos(y[0])
            entries[2, 0], entries[3, 0] = np.cos(y[0]), -np.sin(y[0])
            return entries

        for tol in (1e-4, 1e-7, tolerance) if part == 1 else (1e-3,):  # the mesh grows where it is needed
            found = solve_bvp(slope, _clamped, s, state, fun_jac=jacobian, bc_jac=_clamping, tol=tol, max_nodes=100_000)
            s, state = found.x, found.y
    residual = float(found.rms_residuals.max())
    if not found.success:
        raise ValueError(
            f"the cantilever with beta = {beta}, alpha = {alpha} is not solved: {found.message} ({residual:.2g})"
        )
    angle, _, along, across = found.y[:, -1]
    return Cantilever(Tip(math.pi / 2 - float(angle), float(along), float(across)), residual, found.sol)


def _clamped(first: Array, last: Array) -> Array:
    return np.array([first[0] - np.pi / 2, last[1], first[2], first[3]])


def _clamping(first: Array, last: Array) -> tuple[Array, Array]:
    """Derivatives of what is clamped, by the states at both ends."""
    start, end = np.zeros((4, 4)), np.zeros((4, 4))
    start[0, 0] = start[2, 2] = start[3, 3] = end[1, 1] = 1
    return start, end


# -- arcs and rings ---------------------------------------------------------------------------------------------------


def arc(moment: float, *, k_b: float, length: float, s: ArrayLike = 1.0) -> tuple[Array, Array]:
    """Angle and place (along, across) of a rod that an end moment bends, at fractions s of its length.

    A circle of curvature M/k_b. A chain has the same angle at every node, k_b/h times which is the moment; its nodes lie on a
    polygon with that angle instead.
    """
    s = np.asarray(s, float)
    angle = moment * length / k_b * s
    half = angle / 2
    chord = length * s * np.sinc(half / np.pi)
    return angle, np.stack([chord * np.cos(half), chord * np.sin(half)], axis=-1)


def ring_energy(k_b: float, length: float) -> float:
    """Bending energy of a closed ring, ``2 pi^2 k_b/l``, J: of the circle, and of every regular polygon of yarn length l.

    N corners with theta = 2 pi/N and u_1 - u_2 = 2 l/N hold k_b theta^2/(2 l/N) each.
    """
    return 2 * math.pi**2 * k_b / length


# -- buckling ---------------------------------------------------------------------------------------------------------

Ends = Literal["pinned", "clamped", "clamped-free", "clamped-pinned"]


def buckling_load(
    k_b: float, length: float, *, ends: Ends = "pinned", k_s: float = math.inf, segments: int | None = None
) -> float:
    """Euler's load at which a straight strut buckles, N.

    ``pi^2 k_b/l^2`` for pinned ends; times 1/4, 4 and (4.4934/pi)^2 for the others, where tan x = x at 4.4934. A strut that
    shortens has the load P with ``P (1 - P/k_s)`` of this size, since its shorter length takes the load while its bending stays
    with the rest length.

    Parameters
    ----------
    k_b, length
        N m^2, m.
    ends
        How the strut is held; ``clamped`` on both ends.
    k_s
        Stretch stiffness, N.
    segments
        The exact load of a chain of that many equal segments with pinned ends: ``(4 k_b/h^2) sin^2(pi/(2 n))``.

    Raises
    ------
    ValueError
        For a strut so soft that it shortens without buckling, and segments with ends that are not pinned.
    """
    if segments is not None:
        if ends != "pinned":
            raise ValueError("the load of a chain is known for pinned ends")
        euler = 4 * k_b * (segments / length) ** 2 * math.sin(math.pi / (2 * segments)) ** 2
    else:
        x = brentq(lambda x: math.sin(x) - x * math.cos(x), 4.4, 4.6, xtol=1e-15)
        factor = {"pinned": 1.0, "clamped": 4.0, "clamped-free": 0.25, "clamped-pinned": (x / math.pi) ** 2}[ends]
        euler = factor * math.pi**2 * k_b / length**2
    if not 4 * euler < k_s:
        raise ValueError(f"a strut with k_s = {k_s} N shortens without buckling: Euler's load would be {euler:.6g} N")
    return 2 * euler / (1 + math.sqrt(1 - 4 * euler / k_s))


def buckled(load: float) -> tuple[float, float, float]:
    """A pinned strut beyond its Euler load: angle at its ends (rad), span and deflection in its middle (both over its length).

    ``load`` is P over Euler's load, above 1. With k = sin(angle/2): ``sqrt(load) = 2 K(k)/pi``, span ``2 E(k)/K(k) - 1``,
    deflection ``k/K(k)``. Negative spans are struts whose ends have passed each other.

    Notes
    -----
    Source: Timoshenko and Gere, Theory of Elastic Stability, 2.7.
    """
    if not load > 1:
        raise ValueError(f"below its Euler load a strut is straight: load {load}")
    wanted = math.pi / 2 * math.sqrt(load)
    # found in k' = exp(-y), since K(k) is y + log 4 where the strut is bent far
    y = brentq(lambda y: float(ellipkm1(math.exp(-2 * y))) - wanted, 0, wanted, xtol=1e-16, rtol=8.9e-16)
    m = -math.expm1(-2 * y)
    whole = float(ellipkm1(math.exp(-2 * y)))
    return 2 * math.atan2(math.sqrt(m), math.exp(-y)), 2 * float(ellipe(m)) / whole - 1, math.sqrt(m) / whole


# -- vibrations -------------------------------------------------------------------------------------------------------


def frequency(
    mode: int, *, k_b: float, rho: float, length: float, tension: float = 0.0, segments: int | None = None,
    mass: Literal["consistent", "lumped"] = "consistent",
) -> float:  # fmt: skip
    """Frequency of a pinned yarn that swings a little, Hz; ``n^2 pi/(2 l^2) sqrt(k_b/rho)`` without tension.

    A standing wave sin(kappa s), kappa = n pi/l, has ``rho omega^2 = k_b kappa^4 + T kappa^2``.

    Parameters
    ----------
    mode
        1, 2, ...
    k_b, rho, length, tension
        N m^2; kg/m; m; N, as small against the stretch stiffness.
    segments
        The exact frequency of a chain of that many equal segments: ``kappa^2`` is ``4 sin^2(n pi/(2 N))/h^2``, and the mass
        that moves is rho h times 1 - kappa^2 h^2/6 for the kinetic energy as declared, which makes it swing too fast, or
        rho h for mass lumped at the nodes, too slow; both at order h^2.
    mass
        Of a chain.
    """
    share = 1.0
    if segments is None:
        square = (mode * math.pi / length) ** 2
    else:
        if not 0 < mode < segments:
            raise ValueError(f"a chain of {segments} segments has modes 1 to {segments - 1}, not {mode}")
        wave = 4 * math.sin(mode * math.pi / (2 * segments)) ** 2
        square = wave * (segments / length) ** 2
        share = 1 - wave / 6 if mass == "consistent" else 1.0
    return math.sqrt((k_b * square**2 + tension * square) / (rho * share)) / (2 * math.pi)
