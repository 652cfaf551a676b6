"""Systems of every kind to assemble and to solve, away from rest, and their sums written out element by element."""

from __future__ import annotations

from typing import Any

import numpy as np

from yarnverify.kernels import bending, gravity, parallel_contact, plane, shear, sphere, stretch
from yarnverify.simulation.assembly import System
from yarnverify.simulation.fabric import Fabric, bends, contacts, ring, segments, shears, table, weave, yarn
from yarnverify.simulation.terms import Term

Array = np.ndarray[Any, Any]
G = np.array([0.3, -1.0, -9.81])


def terms_of(fabric: Fabric, obstacles: bool = True) -> list[Term]:
    """All energies that a fabric can have; stiffness differs from element to element."""
    vary = np.random.default_rng(1).uniform(0.5, 2.0, 10_000)
    found = [
        Term(stretch, segments(fabric), {"k_s": 50 * vary[: segments(fabric).count]}),
        Term(bending, bends(fabric), {"k_b": 2e-9 * vary[: bends(fabric).count]}),
        Term(gravity, segments(fabric, gravity), {"rho": 1e-4, "g": G}),
    ]
    if fabric.crossings.size:
        found += [
            Term(shear, shears(fabric), {"k_x": 1e-3 * vary[: shears(fabric).count]}),
            Term(parallel_contact, contacts(fabric), {"k_c": 1e4}),
        ]
    if obstacles:
        nodes = {"x0": np.arange(fabric.nodes)}
        found += [
            Term(plane, table(plane, nodes), {"k": 1e3, "n": [0.0, 0.6, 0.8], "p": [0.0, 0.0, -1e-4], "R": fabric.R}),
            Term(sphere, table(sphere, nodes), {"k": 1e3, "c": [2e-3, 1e-3, -3e-3], "R": 3.1e-3}),
        ]
    return found


FABRICS = {
    "yarn": lambda: yarn(6e-3, 6),
    "ring": lambda: ring(8e-3, 8),
    "plain": lambda: weave("plain", (4, 3)),
    "satin with tails": lambda: weave("satin 5", (5, 6), tails=2e-3),
    "twill in two parts": lambda: weave(
        "twill 2/1", (5, 5), L=0.9e-3, keep=lambda x, y: (abs(x - 1.8e-3) > 1e-4) | (y < 2e-3)
    ),
}
UNKNOWNS = ("all", "positions", "slides of the warp", "a few")


def unknowns(fabric: Fabric, name: str) -> Array:
    every = np.sort(np.concatenate([fabric.positions(), fabric.slides("all", ends=True)]))
    if name == "all":
        return every
    if name == "positions":
        return fabric.positions(np.arange(2, fabric.nodes))
    if name == "slides of the warp":
        family = "warp" if fabric.crossings.size else "yarn"
        return np.sort(np.concatenate([fabric.positions(axes="xz"), fabric.slides(family)]))
    return np.sort(np.random.default_rng(2).choice(every, every.size // 2, replace=False))


def moved(fabric: Fabric, seed: int = 0, size: float = 0.15) -> Array:
    """A state away from rest: yarns longer here and shorter there, bent, sheared, slid, in contact with what is there."""
    rng = np.random.default_rng(seed)
    return fabric.Q + size * fabric.L * rng.uniform(-1, 1, fabric.size)


def system(fabric: Fabric, name: str = "all", **options: Any) -> System:
    active = unknowns(fabric, name)
    loads = 1e-3 * np.random.default_rng(3).normal(size=fabric.size)
    return System(fabric.Q, terms_of(fabric), active, loads, **options)


def written_out(terms: list[Term], loads: Array, Q: Array) -> tuple[float, Array, Array, float]:
    """Energy, gradient and Hessian of all entries by a loop over single elements, and the sum of absolute energies."""
    energy, size = -float(loads @ Q), float(np.abs(loads) @ np.abs(Q))
    gradient, matrix = -loads.copy(), np.zeros((Q.size, Q.size))
    for term in terms:
        for k in range(term.table.count):
            rows = term.table.rows[:, k]
            e, g, h = term.kernel.evaluate(Q[rows][:, None], **term.some(slice(k, k + 1)))
            energy += float(e[0])
            size += abs(float(e[0]))
            for i, row in enumerate(rows):
                gradient[row] += g[i, 0]
                for j, column in enumerate(rows):
                    matrix[row, column] += h[i, j, 0]
    return energy, gradient, matrix, size
