"""PyElastica: the dynamics of a Cosserat rod under a steady load, damped until it stays within the goal.

Its rod has a radius: 1/50 of its length, as thick as the goal allows (the shear of a thicker one shows), since thinner ones
take shorter steps. Step and damping are the fastest of some that reach the goal.
"""

from __future__ import annotations

from functools import cache
from math import inf, pi, sqrt
from time import process_time
from typing import Any

import elastica as ea
import numpy as np

from yarnverify.benchmark.simulation.cantilever import Solve, error

PACKAGES = ("pyelastica", "numba")
SEGMENTS = (8, 10, 12, 14, 16, 20, 24)
RADIUS, MODULUS, DENSITY = 0.02, 1e6, 1000.0
COURANT = (0.15, 0.25, 0.35)  # step, in units of the time that a wave takes along an element
DAMPING = (1.2, 2.0)  # in units of the first frequency
LONGEST = 14.0  # in units of one over it
FREQUENCY = 3.516 * sqrt(MODULUS * RADIUS**2 / (4 * DENSITY))  # of a clamped rod of length 1, rad/s


class _Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):  # type: ignore[misc]
    pass


def make(n: int, alpha: float, goal: float) -> Solve:
    """A cantilever of n elements."""
    best, ends = min((_settled(n, alpha, goal, c, d) for c in COURANT for d in DAMPING), key=lambda each: each[0])
    courant, damping, steps = ends

    def run() -> float:
        if not np.isfinite(best):
            return inf
        simulator, rod, dt = _simulator(n, alpha, courant, damping)
        _advance(simulator, dt, 0.0, steps)
        return -float(rod.position_collection[1, -1])

    return Solve(f"PositionVerlet, {steps} steps, damping {damping:g} times the first frequency", run)


def _simulator(n: int, alpha: float, courant: float, damping: float) -> tuple[Any, Any, float]:
    length = n / (n - 0.5)
    simulator = _Simulator()
    rod = ea.CosseratRod.straight_rod(
        n, np.zeros(3), np.array([1.0, 0, 0]), np.array([0.0, 0, 1]), length, RADIUS, DENSITY,
        youngs_modulus=MODULUS, shear_modulus=MODULUS / 2.6,
    )  # fmt: skip
    simulator.append(rod)
    simulator.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    force = np.array([0.0, -alpha * MODULUS * pi * RADIUS**4 / 4, 0.0])
    simulator.add_forcing_to(rod).using(ea.EndpointForces, 0 * force, force, ramp_up_time=1e-9)
    dt = courant * (length / n) / sqrt(MODULUS / DENSITY)
    simulator.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=damping * FREQUENCY, time_step=dt)
    simulator.finalize()
    return simulator, rod, dt


def _advance(simulator: Any, dt: float, time: float, steps: int) -> float:
    stepper = _stepper()
    for _ in range(steps):
        time = stepper.step(simulator, time, dt)
    return time


@cache
def _stepper() -> Any:
    return ea.PositionVerlet()


def _settled(
    n: int, alpha: float, goal: float, courant: float, damping: float
) -> tuple[float, tuple[float, float, int]]:
    """Seconds and steps until the error stays within the goal; infinite where it does not."""
    simulator, rod, dt = _simulator(n, alpha, courant, damping)
    time, done, start, since = 0.0, 0, process_time(), None
    while time < LONGEST / FREQUENCY:
        time = _advance(simulator, dt, time, 50)
        done += 50
        found = error(-float(rod.position_collection[1, -1]), alpha)
        if not np.isfinite(found):
            return inf, (courant, damping, done)
        if found > goal:
            since = None
        elif since is None:
            since = process_time() - start, done
    return (inf, (courant, damping, done)) if since is None else (since[0], (courant, damping, since[1]))
