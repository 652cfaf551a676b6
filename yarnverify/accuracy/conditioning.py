"""Condition numbers: what any method must lose at a point, since its inputs are rounded.

The condition number of a block B of a result, with inputs x_i (coordinates and parameters), is

    sum_i |dB/dx_i| |x_i| / |B|

in the 2-norm of the block: by it the block's relative change exceeds a small relative change of every input, in the worst
case. That of the energy comes from the true gradient, that of the gradient from the true Hessian, and that of the Hessian from
differences of true Hessians over a relative step of 2^-200, in balls that show how exact the difference is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.forms import Reduced, reduce
from yarnverify.accuracy.metrics import blocks_of, norm
from yarnverify.accuracy.truth import BITS, PRECISION, Points, Truth, second_order
from yarnverify.symbolic.declare import Energy

Array = NDArray[Any]
_STEP_BITS = 200
_TINY = float(np.finfo(np.float64).tiny)


def condition(output: str, energy: Energy, points: Points, truth: Truth) -> Array:
    """Condition number of each block of the energy or of the gradient.

    Returns
    -------
    array (blocks, n)
        In the order of ``metrics.blocks_of``; 0 where nothing changes, NaN where there are no derivatives. Infinite for an
        energy of zero that any change lifts to the second order, as it is on every way there.
    """
    found = []
    with np.errstate(all="ignore"):
        for _, place in blocks_of(output, energy.unknowns):
            if output == "E":
                change = np.abs(truth.energy_moves).sum(axis=0)
                bend = np.abs(truth.gradient_moves).sum(axis=(0, 1))
                change = np.where((truth.energy == 0) & (change == 0) & (bend > 0), np.inf, change)
                size = np.abs(truth.energy)
            else:
                moves = truth.gradient_moves[place[0]]
                change = np.sum([norm(moves[:, i]) for i in range(moves.shape[1])], axis=0)
                size = norm(truth.gradient[place[0]])
            found.append(np.where(truth.has_derivatives, change / np.maximum(size, _TINY), np.nan))
    return np.array(found)


def hessian_condition(energy: Energy, points: Points, truth: Truth, at: int, draws: int = 0) -> Array:
    """Condition number of each block of the Hessian at one point.

    Parameters
    ----------
    energy, points, truth
        The truth must be that of the points.
    at
        Which point.
    draws
        0 for the number itself, which takes as many evaluations as there are inputs; otherwise a bound from below by this
        many fixed choices of the signs of all changes.

    Returns
    -------
    array (blocks,)
        NaN where there are no derivatives.
    """
    blocks = blocks_of("H", energy.unknowns)
    if not truth.has_derivatives[at]:
        return np.full(len(blocks), np.nan)
    reduced = reduce(energy)
    values = [float(value) for value in points.rows()[:, at]]
    moving = [i for i, value in enumerate(values) if value != 0]
    if draws:
        signs = np.random.default_rng(0).integers(0, 2, (draws, len(values))) * 2 - 1
        directions = [[(i, int(row[i])) for i in moving] for row in signs]
    else:
        directions = [[(i, 1)] for i in moving]
    dof = points.q.shape[0]
    here: dict[int, Any] = {}
    changes = [_change(reduced, values, direction, int(truth.bits[at]), dof, here) for direction in directions]
    found = []
    with np.errstate(all="ignore"):
        for _, place in blocks:
            sizes = [float(norm(change[place][..., None].reshape(-1, 1))[0]) for change in changes]
            change = (max(sizes) if draws else sum(sizes)) if sizes else 0.0
            found.append(change / max(float(norm(truth.hessian[place][..., at].reshape(-1, 1))[0]), _TINY))
    return np.array(found)


class Conditions:
    """Condition numbers at some points, each worked out when it is asked for."""

    def __init__(self, energy: Energy, points: Points, truth: Truth) -> None:
        self._energy, self._points, self._truth = energy, points, truth
        self._known: dict[Any, Array] = {}

    def at(self, output: str, point: int, draws: int = 0) -> Array:
        """(blocks,) of one output at one point; ``draws`` as in ``hessian_condition``, of no concern to the others."""
        if output == "H":
            if (point, draws) not in self._known:
                self._known[point, draws] = hessian_condition(self._energy, self._points, self._truth, point, draws)
            return self._known[point, draws]
        if output not in self._known:
            self._known[output] = condition(output, self._energy, self._points, self._truth)
        return self._known[output][:, point]


def _change(
    reduced: Reduced,
    values: Sequence[float],
    direction: list[tuple[int, int]],
    bits: int,
    dof: int,
    here: dict[int, Any],
) -> Array:
    """Derivative of the Hessian along relative changes of some inputs, (dof, dof); ``here`` keeps what is not moved."""
    first, sums = len(reduced.gradient.terms) + 1, reduced.hessian
    for extra in BITS:
        working = bits + 2 * _STEP_BITS + extra - BITS[0]
        with PRECISION, flint.ctx.workprec(working):
            step = flint.arb(2) ** -_STEP_BITS
            moved: list[Any] = list(values)
            for i, sign in direction:
                moved[i] = flint.arb(values[i]) * (1 + sign * step)
            if working not in here:
                here[working] = second_order(reduced, values, working)
            there = second_order(reduced, moved, working)
            if here[working] == "outside":
                return np.zeros((dof, dof))  # the energy does not act here
            if not isinstance(here[working], list) or not isinstance(there, list):
                continue
            balls = [(b - a) / step for a, b in zip(here[working][first:], there[first:], strict=True)]
            if all(_known(ball) for ball in balls):
                changes = np.array([float(ball) for ball in balls])
                found: Array = (changes[sums.index] * sums.sign)[:dof, :dof]
                return found
    return np.full((dof, dof), np.inf)


def _known(ball: Any) -> bool:
    """Whether a difference is known to several digits, or is too small to matter."""
    return bool(ball.is_finite()) and (ball.rel_accuracy_bits() > 20 or float(ball.abs_upper()) < 1e-280)
