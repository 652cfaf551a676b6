"""Cloth whose shear is known from kinematics alone: picture frame and bias extension; and parallel contact."""

from __future__ import annotations

import math


def picture_frame(delta: float, *, side: float, crossings: int, k_x: float, L: float) -> tuple[float, float]:
    """Shear angle and pulling force of a picture frame, for constant shear stiffness.

    The diagonal of a square frame of hinged bars grows from sqrt(2) a to ``2 a cos(pi/4 - gamma/2) = sqrt(2) a + delta``; the
    four quadrants of each crossing hold the energy ``k_x L gamma^2/2``, and the force is the derivative of their sum by
    delta:

        gamma = pi/2 - 2 acos(1/sqrt(2) + delta/(2 a)),    F = 4 N k_x L gamma / (a sin(pi/4 - gamma/2))

    The angle is computed from ``sin gamma = sqrt(2) delta/a + delta^2/(2 a^2)``, the same without cancellation.

    Parameters
    ----------
    delta
        How much the diagonal is longer than at rest, m.
    side
        Length of a bar, m.
    crossings
        Number N of crossings with all four quadrants.
    k_x, L
        Shear stiffness, N, and distance of neighbouring yarns, m.

    Returns
    -------
    gamma, force
        rad, N; both negative for a diagonal that is shortened.

    Raises
    ------
    ValueError
        For a diagonal that the frame cannot have.

    Notes
    -----
    Source: trellis kinematics, e.g. Cao et al., Composites Part A 39 (2008), 1037.
    """
    gamma = _shear(delta / side * math.sqrt(2) + (delta / side) ** 2 / 2, "the frame")
    return gamma, 4 * crossings * k_x * L * gamma / (side * math.sin(math.pi / 4 - gamma / 2))


def bias_extension(delta: float, *, height: float, width: float) -> tuple[float, float]:
    """Shear angles in the central and in the four side zones of a cloth pulled along its bias.

    Yarns that hardly stretch turn the central square, whose diagonal is H - W, into a rhomb:

        gamma = pi/2 - 2 acos((H - W + delta)/(sqrt(2) (H - W))),    gamma/2 in the side zones

    computed from ``sin gamma = 2 t + t^2`` with ``t = delta/(H - W)``.

    Parameters
    ----------
    delta, height, width
        Extension, length and width of the cloth, m; the length is at least twice the width.

    Returns
    -------
    central, side
        rad; the cloth at the grips does not shear.

    Raises
    ------
    ValueError
        For other proportions, or an extension beyond what shear alone can give.

    Notes
    -----
    Source: Harrison, Clifford, Long, Composites Science and Technology 64 (2004), 1453.
    """
    if not height >= 2 * width > 0:
        raise ValueError(f"a cloth of {height} m by {width} m has no central zone: its length must be twice its width")
    t = delta / (height - width)
    gamma = _shear(2 * t + t * t, "the cloth")
    return gamma, gamma / 2


def _shear(sine: float, what: str) -> float:
    if not -1 < sine < 1:
        raise ValueError(f"{what} cannot be deformed so far: the sine of its shear angle would be {sine:.6g}")
    return math.asin(sine)


def contact_gap(force: float, *, k_c: float, L: float, d: float) -> float:
    """Distance ``u1 - u0 = d - F/(k_c L)`` of neighbouring parallel yarns that a force presses together, m.

    From the contact energy ``k_c L (u1 - u0 - d)^2/2``. Parameters: force, N, not negative; k_c, N m^-2; L and d, m.
    """
    if force < 0:
        raise ValueError(f"contact does not pull: force {force}")
    return d - force / (k_c * L)
