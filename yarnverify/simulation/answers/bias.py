"""Bias extension of a net of yarns that do not stretch, whatever its proportions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

Numbers = NDArray[np.float64]


def bias_net(delta: float, *, across: int, along: int, L: float) -> Numbers:
    """Angles by which yarns turn in a net that is cut on the bias, does not stretch and is pulled, (along - across,), rad.

    Crossings (i, j) lie at ``|i - j| <= across``, ``0 <= i + j <= 2 along``; the first and the last row are held. Where
    yarns do not stretch, a yarn keeps its direction across a gap between two yarns of the other family, so that a shape is
    told by one angle for each gap, the same for warp and weft: that of gap ``across/2 + k`` is alpha_k, and the gaps at both
    ends are held by the grips. Equilibrium is least shear energy, half the sum of ``(alpha_i + alpha_j)^2`` over all quadrants,
    under ``2 L sum cos(pi/4 - alpha_k) = sqrt(2) L (along - across) + delta``.

    For ``along = 2 across`` all alpha are equal, and the shear angles are those of ``bias_extension``; a longer cloth shears
    more towards its grips, and only the mean is nearly the same.

    Parameters
    ----------
    delta
        Extension, m.
    across, along
        Half of the number of cells across, even; number of cells along, at least twice as many.
    L
        Side of a cell, m.

    Raises
    ------
    ValueError
        For an extension beyond what shear can give.
    """
    gaps = along - across
    target = gaps * math.sqrt(2) + delta / L
    if not 0 < target < 2 * gaps:
        raise ValueError(f"the cloth cannot be deformed so far: {gaps} cells of {L} m by {delta} m")
    meetings = _quadrants(across, along)
    stiffness = meetings + meetings.T
    stiffness += np.diag(stiffness.sum(axis=1))
    stiffness = stiffness[:gaps, :gaps]

    def balance(state: Numbers) -> Numbers:
        alpha, pull = state[:-1], state[-1]
        missing = target - 2 * np.cos(math.pi / 4 - alpha).sum()
        return np.append((stiffness @ alpha) / stiffness[0, 0] - pull * np.sin(math.pi / 4 - alpha), missing)

    even = np.full(gaps, math.pi / 4 - math.acos(target / (2 * gaps)))
    found = root(balance, np.append(even, 0.0), tol=1e-14)
    if not np.abs(balance(found.x)).max() < 1e-11 * gaps:
        raise ValueError(f"no balance of the net was found: {found.message}")
    return np.asarray(found.x[:-1], float)


def _quadrants(across: int, along: int) -> Numbers:
    """How many quadrants lie between a gap of warp and one of weft; the last row and column stand for all that is held."""
    gaps = along - across
    i, j = (part.ravel() - across // 2 for part in np.indices((along + across + 1,) * 2))

    def there(i: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.bool_]:
        return (abs(i - j) <= across) & (i + j >= 0) & (i + j <= 2 * along)

    count = np.zeros((gaps + 1, gaps + 1))
    for one in (0, 1):
        for other in (0, 1):
            full = there(i, j) & there(i + 2 * one - 1, j) & there(i, j + 2 * other - 1)
            places = [part[full] - 1 + side - across // 2 for part, side in ((i, one), (j, other))]
            inside = [np.where((place >= 0) & (place < gaps), place, gaps) for place in places]
            np.add.at(count, tuple(inside), 1)
    return count
