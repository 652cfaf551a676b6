"""The exact result at the exact floats, by ball arithmetic; precision is raised until every ball rounds to one double.

Shares no code with the SymPy derivation or with the kernels: the declared energy is evaluated in second-order jets of balls
(``yarnverify.symbolic.forward``), which enclose the true values whatever the precision.

Where a state has no value, no precision helps. The largest precision tried is a proof for energies of lengths and angles:
a difference of doubles that is not zero exceeds 2^-1075 and lengths stay below 2^1026, so that the squared sine of an angle
between them is zero or above 2^-8500.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.forms import Reduced, reduce, rows_of, state_of
from yarnverify.errors import InputError
from yarnverify.symbolic.algebraic import UndefinedError
from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.forward import Evaluation
from yarnverify.symbolic.jets import Jet
from yarnverify.symbolic.numbers import Balls
from yarnverify.symbolic.tree import Name

Array = NDArray[Any]
BITS = (256, 512, 1536, 4096, 16384)  # a true zero is settled by 1536, being below 2^-1200
_TIE = 1500  # bits that agree with a point halfway between two doubles
_SPARE = 70  # bits of a value that must be known, so that an error of a thousandth of a rounding is seen
_SMALLEST = 2.0**-1022
PRECISION = threading.RLock()  # FLINT's working precision is one for all threads


@dataclass(frozen=True)
class Points:
    """States of one energy, exactly as given.

    Attributes
    ----------
    q
        (dof, n), float64; float32 values are doubles too.
    parameters
        Name to (n,), or (3, n) of a vector, in the order of the declaration.
    """

    q: Array
    parameters: Mapping[str, Array]

    def __len__(self) -> int:
        return int(self.q.shape[1])

    def rows(self) -> Array:
        """``q`` and the parameters below it: (dof + parameters, n)."""
        return np.vstack([self.q, *(np.atleast_2d(value) for value in self.parameters.values())])

    def take(self, index: Any) -> Points:
        return Points(self.q[:, index], {name: value[..., index] for name, value in self.parameters.items()})


@dataclass(frozen=True)
class Truth:
    """True results, each as the nearest double and what is left of it.

    Attributes
    ----------
    energy, gradient, hessian
        (n,), (dof, n), (dof, dof, n): rounded to nearest; infinite where the double overflows, NaN where there is no value.
    energy_low, gradient_low, hessian_low
        What the true value exceeds the double by, itself rounded.
    energy_moves, gradient_moves
        Derivatives by all inputs times the inputs, rows of ``q`` and then parameters: (m, n) and (dof, m, n).
    has_energy, has_derivatives
        (n,) bool; an exact fold has an energy and no gradient.
    flushed
        (3, n) bool: something of E, G, H is not zero, and rounds to zero.
    bits
        (n,) the precision that settled each state.
    """

    energy: Array
    gradient: Array
    hessian: Array
    energy_low: Array
    gradient_low: Array
    hessian_low: Array
    energy_moves: Array
    gradient_moves: Array
    has_energy: Array
    has_derivatives: Array
    flushed: Array
    bits: Array


def truth(energy: Energy, points: Points) -> Truth:
    """True energy, gradient and Hessian at every state.

    Parameters
    ----------
    energy
        A declared energy.
    points
        States; outside the domain there is no value, or zero if the energy is declared zero elsewhere.

    Raises
    ------
    InputError
        For values that are not finite.
    """
    rows = points.rows()
    labels = [str(name) + (f".{'xyz'[axis]}" if name.bold else "") for name, axis in rows_of(energy)]
    if rows.shape[0] != len(labels):
        raise InputError(f"{energy.name}: a state has {len(labels)} values, not {rows.shape[0]}: {', '.join(labels)}")
    if not np.isfinite(rows).all():
        row, at = np.argwhere(~np.isfinite(rows))[0]
        raise InputError(f"{energy.name}: state {at}: {labels[row]} is {rows[row, at]}; give finite values")
    n = len(points)
    reduced = reduce(energy)
    raw = _Raw(reduced, points.q.shape[0], len(labels), n)
    with PRECISION:
        for at in range(n):
            _settle_state(reduced, [float(value) for value in rows[:, at]], at, raw)
    return raw.truth(points.q.shape[0])


class _Raw:
    """Results by forms, as they come: highs and lows of the energy, of the gradient's sums, of the Hessian's sums."""

    def __init__(self, reduced: Reduced, dof: int, inputs: int, n: int) -> None:
        self.sums = (reduced.gradient, reduced.hessian)
        self.counts = (1, len(reduced.gradient.terms), len(reduced.hessian.terms))
        total = sum(self.counts)
        self.high, self.low, self.flushed = (
            np.full((total, n), np.nan),
            np.zeros((total, n)),
            np.zeros((total, n), bool),
        )
        self.energy_moves, self.gradient_moves = np.zeros((inputs, n)), np.zeros((dof, inputs, n))
        self.has_energy, self.has_derivatives, self.bits = np.zeros(n, bool), np.zeros(n, bool), np.zeros(n, int)

    def keep_moves(self, balls: Sequence[Any], values: Sequence[float], at: int) -> None:
        """Products of derivatives and inputs: as balls, since a derivative may underflow where the product does not."""
        (g, h), dof = self.sums, self.gradient_moves.shape[0]
        first, second = balls[1 : 1 + self.counts[1]], balls[1 + self.counts[1] :]
        for j, value in enumerate(values):
            self.energy_moves[j, at] = float(first[g.index[j]] * value) * g.sign[j]
            for i in range(dof):
                self.gradient_moves[i, j, at] = float(second[h.index[i, j]] * value) * h.sign[i, j]

    def truth(self, dof: int) -> Truth:
        cuts = np.cumsum(self.counts)[:-1]
        highs, lows, lost = (np.split(array, cuts) for array in (self.high, self.low, self.flushed))
        g, h = self.sums
        sign = h.sign[:dof, :dof, None]
        return Truth(
            energy=highs[0][0],
            gradient=(highs[1][g.index] * g.sign[:, None])[:dof] + 0.0,  # + 0.0: no negative zeros
            hessian=highs[2][h.index[:dof, :dof]] * sign + 0.0,
            energy_low=lows[0][0],
            gradient_low=(lows[1][g.index] * g.sign[:, None])[:dof],
            hessian_low=lows[2][h.index[:dof, :dof]] * sign,
            energy_moves=self.energy_moves,
            gradient_moves=self.gradient_moves,
            has_energy=self.has_energy,
            has_derivatives=self.has_derivatives,
            flushed=np.array([lost[0][0], lost[1][g.index[:dof]].any(axis=0), lost[2][h.index[:dof]].any(axis=(0, 1))]),
            bits=self.bits,
        )


def _settle_state(reduced: Reduced, values: Sequence[float], at: int, raw: _Raw) -> None:
    for bits in BITS:
        found = second_order(reduced, values, bits)
        if found is None:
            continue
        if isinstance(found, str):
            raw.bits[at] = bits
            if reduced.energy.elsewhere == "zero":
                raw.high[:, at] = 0.0
                raw.has_energy[at] = raw.has_derivatives[at] = True
            return
        with flint.ctx.workprec(bits):
            rounded = [rounded_ball(ball) for ball in found]
        if None not in rounded:
            with flint.ctx.workprec(64):
                raw.keep_moves(found, values, at)
            raw.high[:, at], raw.low[:, at], raw.flushed[:, at] = zip(*rounded, strict=True)
            raw.has_energy[at] = raw.has_derivatives[at] = True
            raw.bits[at] = bits
            return
    for bits in BITS:  # no derivatives; perhaps an energy
        value = energy_alone(reduced, values, bits)
        with flint.ctx.workprec(bits):
            alone = None if value is None else rounded_ball(value)
        if alone is not None:
            raw.high[0, at], raw.low[0, at], raw.flushed[0, at] = alone
            raw.has_energy[at], raw.bits[at] = True, bits
            return


def _evaluation(reduced: Reduced, values: Sequence[Any]) -> Evaluation | str | None:
    """The definition at a state; "outside" the domain; None where the precision cannot tell which."""
    numbers = Balls()
    balls = iter([numbers.constant(value) for value in values])
    state: dict[Name, Any] = {}
    for name, axis in rows_of(reduced.energy):
        state[name] = (*state.get(name, ()), next(balls)) if name.bold else next(balls)
        assert not name.bold or len(state[name]) == axis + 1
    evaluation = Evaluation(reduced.section, state_of(reduced, state), numbers, reduced.expression)
    for margin, zero_too in reduced.margins:
        value = evaluation.value(margin)
        if value > 0 or (zero_too and value == 0):
            continue
        return "outside" if value < 0 or value == 0 else None
    return evaluation


def second_order(reduced: Reduced, values: Sequence[Any], bits: int) -> list[Any] | str | None:
    """Balls of the energy, of its gradient's sums and of its Hessian's sums, at a precision.

    Returns
    -------
    list, "outside" or None
        None where this precision gives no value.
    """
    with PRECISION, flint.ctx.workprec(bits):
        try:
            evaluation = _evaluation(reduced, values)
            if not isinstance(evaluation, Evaluation):
                return evaluation
            jet: Jet = evaluation.energy_jet
        except (UndefinedError, ZeroDivisionError, ValueError):
            return None
        zero = flint.arb(0)
        count = sum(3 if form.symbol.bold else 1 for form in reduced.forms)
        first = [zero] * count if jet.first is None else jet.first.tolist()
        second = [[zero] * count] * count if jet.second is None else jet.second.tolist()
        balls = [jet.value]
        for terms in reduced.gradient.terms:
            balls.append(sum((first[k] if times == 1 else first[k] * times for (k,), times in terms), zero))
        for terms in reduced.hessian.terms:
            balls.append(sum((second[k][n] if times == 1 else second[k][n] * times for (k, n), times in terms), zero))
        return balls


def energy_alone(reduced: Reduced, values: Sequence[Any], bits: int) -> Any:
    """Ball of the energy where its derivatives may not exist; None where there is none at this precision."""
    with PRECISION, flint.ctx.workprec(bits):
        try:
            evaluation = _evaluation(reduced, values)
            return evaluation.value(reduced.expression) if isinstance(evaluation, Evaluation) else None
        except UndefinedError:
            return None


def rounded_ball(ball: Any) -> tuple[float, float, bool] | None:
    """The nearest double, what is left, and whether a value that is not zero became zero; None if the ball is too wide."""
    high = float(ball.lower())
    if high != float(ball.upper()):  # also for a ball that is not finite
        if ball.rel_accuracy_bits() < _TIE:
            return None
        high = float(ball.mid())  # halfway between two doubles, for all that can be known: either will do
    if high == 0.0:
        return 0.0, 0.0, not ball.contains(0)
    if abs(high) == np.inf:
        return (high, 0.0, False) if ball.is_finite() else None
    if abs(high) > _SMALLEST and ball.rel_accuracy_bits() < _SPARE:
        return None
    return high, float(ball - high), False
