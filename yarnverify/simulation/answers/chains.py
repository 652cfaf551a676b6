"""Yarns without bending stiffness: hanging straight, or between two points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, root

Array = NDArray[Any]


@dataclass(frozen=True)
class Chain:
    """Nodes and tensions of a chain of straight segments.

    Attributes
    ----------
    points
        (n + 1, 2): along the horizontal, and upwards, m, from the first node.
    tension
        (n,), N.
    """

    points: Array
    tension: Array


def hanging_chain(rest: ArrayLike, *, k_s: float, rho: float, g: float, tip_force: float = 0.0) -> Chain:
    """A yarn hung by its first node, with stretch and gravity as they are declared: exact for every division.

    Half of the weight of a segment sits at each of its nodes, so that a segment carries what hangs below its middle:

        T_i = rho g (du_i/2 + sum of du_j below) + F,    l_i = du_i (1 + T_i/k_s)

    Parameters
    ----------
    rest
        Rest lengths du of the segments from the top, (n,), m.
    k_s, rho, g, tip_force
        N; kg/m; m/s^2; N, downwards at the last node.
    """
    du = np.asarray(rest, float)
    below = np.concatenate([np.cumsum(du[::-1])[::-1][1:], [0.0]])
    tension = rho * g * (below + du / 2) + tip_force
    depth = np.concatenate([[0.0], np.cumsum(du * (1 + tension / k_s))])
    return Chain(np.stack([np.zeros_like(depth), -depth], axis=1), tension)


def hanging_elongation(
    length: float, *, k_s: float, rho: float, g: float, tip_force: float = 0.0, at: float = 1.0
) -> float:
    """How far the material point at ``at`` (0 to 1 of the length) sinks, m; of the whole yarn for 1.

    ``(rho g (l s - s^2/2) + F s)/k_s`` with s = at l, so rho g l^2/(2 k_s) for the end of a yarn that carries itself alone. A
    chain has this very elongation at its nodes, whatever its segments, since tension is linear in s.
    """
    s = at * length
    return (rho * g * (length * s - s * s / 2) + tip_force * s) / k_s


def sliding_split(first: float, second: float, rest: float) -> float:
    """Rest length on the first side of a crossing that slides without friction, when tension is equal on both sides.

    ``du_1 = U l_1/(l_1 + l_2)``: equal tension is equal strain. Parameters: lengths l_1, l_2 of the two segments now, and
    their rest length U together, m.
    """
    return rest * first / (first + second)


# -- between two points -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Catenary:
    """``y = a cosh((x - x_0)/a)``, seen from its first end.

    Attributes
    ----------
    a
        Its parameter: horizontal tension over weight per length, m.
    low
        x of its lowest point, m; may lie beyond the ends.
    length, span
        m.
    """

    a: float
    low: float
    length: float
    span: float

    def y(self, x: ArrayLike) -> Array:
        """Height over the first end at horizontal distances from it, m."""
        x = np.asarray(x, float)
        return 2 * self.a * np.sinh(x / (2 * self.a)) * np.sinh((x - 2 * self.low) / (2 * self.a))

    def at(self, s: ArrayLike) -> Array:
        """Points at arc lengths from the first end: s.shape + (2,), m."""
        x = self.low + self.a * np.arcsinh(np.asarray(s, float) / self.a - math.sinh(self.low / self.a))
        return np.stack([x, self.y(x)], axis=-1)

    @property
    def sag(self) -> float:
        """Depth of the lowest point below the first end, m."""
        return 2 * self.a * math.sinh(self.low / (2 * self.a)) ** 2


def catenary(length: float, span: float, rise: float = 0.0) -> Catenary:
    """A yarn that neither stretches nor resists bending, between two points.

    Its parameter solves ``2 a sinh(span/(2 a)) = sqrt(length^2 - rise^2)``; the root lies between bounds that hold for every
    slack, from ``exp(x^2/6) >= sinh(x)/x >= 1 + x^2/6``.

    Parameters
    ----------
    length, span, rise
        Of the yarn; horizontal distance of its ends; height of the second over the first; m.

    Raises
    ------
    ValueError
        For a yarn that is too short, or ends one above the other.
    """
    if not span > 0:
        raise ValueError(f"the ends must be apart horizontally, and span is {span}")
    short = math.hypot(span, rise)
    if not length > short:
        raise ValueError(f"a yarn of {length} m does not reach over {short} m")
    effective = math.sqrt((length - rise) * (length + rise))
    excess = (length - short) * (length + short) / (span * (effective + span))  # effective/span - 1
    if excess < 1:

        def gap(x: float) -> float:
            return _sinh_excess(x) - excess
    else:

        def gap(x: float) -> float:
            return x + math.log1p(-math.exp(-2 * x)) - math.log(2 * x * (1 + excess))

    low, high = math.sqrt(6 * math.log1p(excess)), math.sqrt(6 * excess)
    x = brentq(gap, low * (1 - 1e-9), high * (1 + 1e-9), xtol=1e-300, rtol=8.9e-16, maxiter=500)
    a = span / (2 * x)
    return Catenary(a, span / 2 - a * math.atanh(rise / length), length, span)


def _sinh_excess(x: float) -> float:
    """``sinh(x)/x - 1`` without cancellation."""
    if x > 1:
        return math.sinh(x) / x - 1
    term = total = x * x / 6
    for n in range(2, 12):
        term *= x * x / ((2 * n) * (2 * n + 1))
        total += term
    return total


def hung_chain(rest: ArrayLike, *, span: float, k_s: float, rho: float, g: float, rise: float = 0.0) -> Chain:
    """A chain between two points with stretch and gravity as they are declared: the exact discrete answer.

    Every segment carries the same horizontal force H and the vertical force at its middle; H and the vertical force at the
    first end are such that the last node comes out where it is held. As the segments get short this is the elastic catenary
    (Irvine, Cable Structures, 1981), and for stiff yarns the catenary.

    Parameters
    ----------
    rest
        Rest lengths of the segments from the first end, (n,), m.
    span, rise
        Where the second end is, from the first, m.
    k_s, rho, g
        N; kg/m; m/s^2.

    Raises
    ------
    ValueError
        Where no balance is found to rounding.
    """
    du = np.asarray(rest, float)
    weight = rho * g * du
    length, total = float(du.sum()), float(weight.sum())
    middle = np.cumsum(weight) - weight / 2
    if length > math.hypot(span, rise) * (1 + 1e-9):
        start = catenary(length, span, rise)
        guess = [rho * g * start.a, -rho * g * start.a * math.sinh(-start.low / start.a)]
    else:
        pull = max(k_s * (math.hypot(span, rise) / length - 1), total)
        guess = [pull * span / math.hypot(span, rise), total / 2 - pull * rise / math.hypot(span, rise)]

    def placed(forces: Array) -> tuple[Array, Array]:
        across, down = math.exp(forces[0]) * total, middle - forces[1] * total
        tension = np.hypot(across, down)
        stretch = du * (1 / tension + 1 / k_s)
        return np.stack([stretch * across, stretch * down], axis=1), tension

    def miss(forces: Array) -> Array:
        edges, _ = placed(forces)
        return (edges.sum(axis=0) - [span, rise]) / length

    found = root(miss, [math.log(max(guess[0], 1e-300) / total), guess[1] / total], tol=1e-15)
    if not np.abs(miss(found.x)).max() < 1e-13:
        raise ValueError(
            f"no balance found: the second end is missed by {np.abs(miss(found.x)).max():.2g} of the length"
        )
    edges, tension = placed(found.x)
    return Chain(np.concatenate([np.zeros((1, 2)), np.cumsum(edges, axis=0)]), tension)
