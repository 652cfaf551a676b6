"""The elastica: a clamped rod bent by a dead load at its tip, across its first direction, however far.

With lengths in units of L, theta the angle from the first direction towards the load, and alpha = P L^2/EI,

    theta'' = -alpha cos(theta),   theta(0) = 0,   theta'(1) = 0

Source: Bisshopp and Drucker, Quarterly of Applied Mathematics 3 (1945), 272, in elliptic integrals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipj, ellipkinc, ellipkm1, expit

Array = NDArray[Any]
_LARGEST = 1e5  # alpha; k' is e^-315 there, and has no double much further on
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(40)
_NODES, _WEIGHTS = (1 + _NODES) / 2, _WEIGHTS / 2
_NEARLY_STRAIGHT = 0.5  # sine of the tip's angle below which differences of elliptic integrals would lose digits
_JACOBI_UP_TO = 15.0  # alpha; beyond, the modulus is so near to 1 that Jacobi's functions lose digits


@dataclass(frozen=True)
class Tip:
    """Where the tip of a cantilever is, in units of its length.

    Attributes
    ----------
    angle
        Of the tangent from the first direction, rad.
    along, deflection
        Place along the first direction, and across it towards the load.
    """

    angle: float
    along: float
    deflection: float


def elastica(alpha: float) -> Tip:
    """Tip of a cantilever under a load at its tip, alpha = P L^2/EI.

    With psi the tip's angle, k^2 = (1 + sin psi)/2 and sin p = 1/(sqrt(2) k):

        sqrt(alpha) = K(k) - F(p, k),    deflection = 1 - 2 (E(k) - E(p, k))/sqrt(alpha),    along = sqrt(2 sin(psi)/alpha)

    The first is solved for y = log(sin psi/(1 - sin psi)), in which both ends of the range of psi keep their digits and there
    is one root; differences of nearly equal integrals are written as one. Shooting would meet other branches.

    Raises
    ------
    ValueError
        For alpha that is not positive, or above 1e5.
    """
    sine, rest = _modulus(alpha)
    return Tip(_angle(sine, rest), math.sqrt(2 * sine / alpha), _deflection(alpha, sine, rest))


def elastica_shape(alpha: float, s: ArrayLike) -> tuple[Array, Array]:
    """Angle and place of the rod at arc lengths s from 0 to 1: s.shape, and s.shape + (2,) as (along, across), in units of L.

    In Jacobi's functions of v = sqrt(alpha)(1 - s), seen from the tip: ``sin theta = sin psi - 2 k^2 k'^2 sd(v)^2``.
    """
    sine, rest = _modulus(alpha)
    s = np.asarray(s, float)
    if alpha > _JACOBI_UP_TO:
        return _integrated(alpha, 2 * math.asin(math.sqrt(rest)), s)
    theta = _theta(alpha, sine, rest, s)
    if sine < _NEARLY_STRAIGHT:
        angles = _theta(alpha, sine, rest, s[..., None] * _NODES)
        along, across = (s * (f(angles) @ _WEIGHTS) for f in (np.cos, np.sin))
        return theta, np.stack([along, across], axis=-1)
    m, start = 1 - rest, math.asin(math.sqrt(1 / (2 * (1 - rest))))
    root = math.sqrt(alpha)
    _, cn, _, phi = ellipj(ellipkinc(start, m) + root * s, m)
    along = 2 * math.sqrt(m) * (math.cos(start) - cn) / root
    across = s - 2 * (ellipeinc(phi, m) - ellipeinc(start, m)) / root
    return theta, np.stack([along, across], axis=-1)


def _modulus(alpha: float) -> tuple[float, float]:
    """sin psi, and k'^2 = (1 - sin psi)/2."""
    if not 0 < alpha <= _LARGEST:
        raise ValueError(f"alpha = P L^2/EI must be positive and at most {_LARGEST:g}, and is {alpha}")

    def gap(y: float) -> float:
        return math.log(_quarter(float(expit(y)), float(expit(-y)) / 2)) - math.log(alpha) / 2

    low, high = math.log(min(alpha, 1.0)) - 3, max(math.log(alpha), 0.0) + 2 * math.sqrt(alpha) + 8
    y = brentq(gap, low, high, xtol=1e-15, rtol=8.9e-16, maxiter=500)
    return float(expit(y)), float(expit(-y)) / 2


def _quarter(sine: float, rest: float) -> float:
    """``K(k) - F(p, k)``; for small angles as F(q, k) with tan p tan q = 1/k'."""
    m = 1 - rest
    if sine < _NEARLY_STRAIGHT:
        return float(ellipkinc(math.atan(math.sqrt(sine / rest)), m))
    return float(ellipkm1(rest) - ellipkinc(math.asin(math.sqrt(1 / (2 * m))), m))


def _angle(sine: float, rest: float) -> float:
    return math.asin(sine) if sine < _NEARLY_STRAIGHT else math.pi / 2 - 2 * math.asin(math.sqrt(rest))


def _deflection(alpha: float, sine: float, rest: float) -> float:
    if sine < _NEARLY_STRAIGHT:
        # with sin(theta) = sin(psi)(1 - t^2) the same integral has positive terms alone
        part = 1 - _NODES**2
        return float(2 * sine**1.5 / math.sqrt(2 * alpha) * ((part / np.sqrt(1 - (sine * part) ** 2)) @ _WEIGHTS))
    m = 1 - rest
    arc = ellipe(m) - ellipeinc(math.asin(math.sqrt(1 / (2 * m))), m)
    return float(1 - 2 * arc / math.sqrt(alpha))


def _theta(alpha: float, sine: float, rest: float, s: Array) -> Array:
    m = 1 - rest
    sn, cn, dn, _ = ellipj(math.sqrt(alpha) * (1 - s), m)
    # sn(K - v) = cd(v), dn(K - v) = k' nd(v), and cos(theta) = 2 k sn dn
    return np.arctan2(sine - 2 * m * rest * (sn / dn) ** 2, 2 * math.sqrt(m * rest) * cn / dn**2)


def _integrated(alpha: float, tip: float, s: Array) -> tuple[Array, Array]:
    """The same from the differential equation, backwards from the tip, for eta = pi/2 - theta that only grows there."""
    root = math.sqrt(alpha)

    def slope(v: float, state: Array) -> list[float]:
        return [state[1], math.sin(state[0]), math.sin(state[0]), math.cos(state[0])]

    ends, place = np.unique(np.append(np.minimum(root * (1 - s.ravel()), root), root), return_inverse=True)
    found = solve_ivp(slope, (0, root), [tip, 0, 0, 0], "DOP853", rtol=3e-14, atol=1e-14 * tip, t_eval=ends).y
    eta, *moved = found[[0, 2, 3]][:, place]
    along, across = ((part[-1] - part[:-1]) / root for part in moved)
    return np.pi / 2 - eta[:-1].reshape(s.shape), np.stack([along, across], axis=-1).reshape((*s.shape, 2))
