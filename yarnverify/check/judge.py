"""Each block of each output: pass or fail by one rule, the worst state, and how much of its error is the inputs' rounding."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.metrics import UNIT, norm, true_parts
from yarnverify.accuracy.rule import EXACT, allowed
from yarnverify.check.cases import Cases
from yarnverify.check.conventions import Results

Array = NDArray[Any]


@dataclass(frozen=True)
class Block:
    """One block of one output, at all states.

    Attributes
    ----------
    kind, name
        E, G or H; ``""``, ``x1``, ``x1,u1``: derivative of the gradient's x1 by u1.
    errors
        (n,) in units, normwise; infinite where what came is not finite; NaN where nothing is to be judged.
    computed, true
        (size, n), in the energy's sign; the nearest doubles of the truth.
    worst
        Number of the state that is worst by the rule.
    share
        Error there as a multiple of what the rule allows; the block passes if it is at most 1.
    error, condition
        Error there in units, and the block's condition number there.
    """

    kind: str
    name: str
    errors: Array
    computed: Array
    true: Array
    worst: int
    share: float
    error: float
    condition: float

    @property
    def passes(self) -> bool:
        return not self.share > 1 and bool(self.judged.any())

    @property
    def judged(self) -> Array:
        """(n,) bool: where there is something to be judged."""
        return ~np.isnan(self.errors)

    @property
    def title(self) -> str:
        if self.kind == "E":
            return "energy"
        return f"{'gradient' if self.kind == 'G' else 'Hessian'} {self.name.replace(',', ', ')}"


def block_places(kind: str, cases: Cases) -> list[tuple[str, tuple[slice, ...]]]:
    """Name and place of each block of an output; of the Hessian all of them, also below the diagonal."""
    if kind == "E":
        return [("", ())]
    if kind == "G":
        return [(label, (rows,)) for label, rows in cases.labels]
    return [(f"{a},{b}", (rows, columns)) for a, rows in cases.labels for b, columns in cases.labels]


def judged(results: Results, cases: Cases, ran: Array) -> list[Block]:
    """All blocks that were returned.

    Parameters
    ----------
    results, cases
        What came back, and what is true.
    ran
        (n,) where something came back; elsewhere there was a crash or an exception, or nothing was asked for.
    """
    found = []
    present = cases.valued
    for kind in "EGH":
        for name, place in block_places(kind, cases):
            if not np.all(results.given[kind][place]):
                continue
            found.append(_block(kind, name, place, results, cases, present, ran))
    return found


def _block(
    kind: str, name: str, place: tuple[slice, ...], results: Results, cases: Cases, present: Array, ran: Array
) -> Block:
    n, unit, limits = len(cases), UNIT[cases.dtype], np.finfo(cases.dtype)
    high, low = true_parts(cases.truth, kind)
    true, rest = high[place].reshape(-1, n), low[place].reshape(-1, n)
    computed = results.part(kind)[place].reshape(-1, n)
    with np.errstate(all="ignore"):
        errors = norm((computed - true) - rest) / np.maximum(norm(true), float(limits.tiny)) / unit
    errors = np.where(np.isfinite(computed).all(axis=0), np.minimum(errors, np.finfo(np.float64).max), np.inf)
    errors = np.where(present & ran, errors, np.nan)
    worst, share, condition = _worst(kind, name, errors, cases)
    error = float(errors[worst]) if errors.size and not np.isnan(errors[worst]) else 0.0
    return Block(kind, name, errors, computed, true, worst, share, error, condition)


def _worst(kind: str, name: str, errors: Array, cases: Cases) -> tuple[int, float, float]:
    """The state that is worst by the rule, its share of what is allowed, and its condition number.

    A bound from below of a Hessian's condition number gives a bound from above of the share, so that few states need the number
    itself: none whose bound is below what another state is known to have.
    """
    known = np.where(np.isnan(errors), -1.0, errors)
    if known.max(initial=-1.0) < 0:
        return 0, 0.0, 0.0
    if np.isinf(known).any():
        at = int(np.flatnonzero(np.isinf(known))[0])
        return at, math.inf, cases.condition(kind, name, at)
    over = np.flatnonzero(known > EXACT)
    if not over.size:
        at = int(known.argmax())
        condition = cases.condition(kind, name, at)
        return at, float(known[at]) / allowed(condition, cases.dtype), condition
    bounds = {
        int(at): float(known[at]) / allowed(cases.condition(kind, name, int(at), 1 if kind == "H" else 0), cases.dtype)
        for at in over
    }
    best, place, found = -1.0, int(over[0]), 0.0
    for at in sorted(bounds, key=lambda state: -bounds[state]):
        if bounds[at] <= best:
            break
        condition = cases.condition(kind, name, at)
        share = float(known[at]) / allowed(condition, cases.dtype)
        if share > best:
            best, place, found = share, at, condition
    return place, best, found


def narrowed(block: Block, cases: Cases, at: Array) -> Block:
    """The same with the worst state taken among some."""
    worst, share, condition = _worst(block.kind, block.name, np.where(at, block.errors, np.nan), cases)
    return replace(block, worst=worst, share=share, error=float(block.errors[worst]), condition=condition)


def failing(block: Block, cases: Cases) -> Array:
    """(n,) bool: states at which the rule is, or by a bound of the condition number may be, broken."""
    found = np.zeros(len(cases), bool)
    for at in np.flatnonzero(np.nan_to_num(block.errors, nan=0.0) > EXACT):
        condition = cases.condition(block.kind, block.name, int(at), 1 if block.kind == "H" else 0)
        found[at] = block.errors[at] > allowed(condition, cases.dtype)
    return found
