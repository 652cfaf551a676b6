"""A cantilever bent by a load at its tip: the time until the tip is right to some error, whoever computes it.

Length 1, EI 1, load alpha = P L^2/EI. Everybody starts from the straight rod, with packages imported and code compiled; the
number of segments is the least that reaches the error, found out beforehand. The first segment is held and has the wall in its
middle, which makes everybody second order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from yarnverify.kernels import bending, stretch
from yarnverify.simulation.answers import elastica
from yarnverify.simulation.assembly import System
from yarnverify.simulation.fabric import bends, segments, yarn
from yarnverify.simulation.newton import minimise
from yarnverify.simulation.terms import Term

SEGMENTS = (4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 20, 24, 28, 32, 36, 40, 48, 64)
STRETCH = 1e6  # k_s L^2/EI: hardly extensible
STOP = 1e-8  # step at which Newton's method stops, relative to the length; everybody's the same


@dataclass(frozen=True)
class Solve:
    """A prepared cantilever: ``run`` solves it and gives the deflection of its tip."""

    how: str
    run: Callable[[], float]


def ours(n: int, alpha: float, engine: Any) -> Solve:
    """By these simulations."""
    thread = yarn(n / (n - 0.5), n)
    terms = [Term(stretch, segments(thread), {"k_s": STRETCH}), Term(bending, bends(thread), {"k_b": 1.0})]
    loads = np.zeros(thread.size)
    tip = int(thread.position(n)[0, 1])
    loads[tip] = -alpha
    system = System(thread.Q, terms, thread.positions(np.arange(2, n + 1)), loads, engine=engine)

    def run() -> float:
        return -float(minimise(system, thread.Q, step=STOP).Q[tip])

    return Solve(f"Newton's method, {'NumPy' if engine == 'numpy' else 'kernels compiled by numba'}", run)


def error(deflection: float, alpha: float) -> float:
    """Of the deflection, relative to the length; infinite where there is none."""
    found = abs(deflection - elastica(alpha).deflection)
    return found if np.isfinite(found) else np.inf


def least(
    make: Callable[[int], Solve], alpha: float, goal: float, tried: Sequence[int] = SEGMENTS
) -> tuple[int, Solve, float] | None:
    """The least number of segments whose error is within the goal, the solve and the error; None if none is."""
    for n in tried:
        solve = make(n)
        found = error(solve.run(), alpha)
        if found <= goal:
            return n, solve, found
    return None
