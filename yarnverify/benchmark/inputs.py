"""Named states of any declared energy: what contestants are timed on, and the few on which their errors are shown.

``mixed``: random states well inside the domain. ``near rest``: a random rotation of the declared rest state, disturbed by
0.001 to 0.1 of its size; for bending a nearly straight yarn. Two, as a kernel may take another branch near rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.benchmark.peers.walk import functions_of, scalar_of, values_of, vector_of
from yarnverify.benchmark.ways import count_of_parameters, degrees_of_freedom
from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.functions import sides_of
from yarnverify.symbolic.tree import Expr

Array = NDArray[Any]
FUNCTIONS = functions_of(np, float, short=False)
STATES = ("mixed", "near rest")
HARD = {"1e-4": 1e-4, "1e-8": 1e-8}  # distances, as they are written and as numbers
MARGIN = 0.05  # by which ordinary states stay inside the domain


@dataclass(frozen=True)
class Inputs:
    """States of one energy.

    Attributes
    ----------
    q
        (dof, n).
    parameters
        In the declared order, three numbers for a vector.
    """

    q: Array
    parameters: tuple[float, ...]

    def first(self, n: int) -> Inputs:
        return Inputs(self.q[:, :n].copy(), self.parameters)


def timed_states(energy: Energy, state: str, n: int, seed: int = 0) -> Inputs:
    """States to time on.

    Parameters
    ----------
    energy
        The declaration.
    state
        One of ``STATES``.
    n, seed
        How many, and where the random numbers start.
    """
    draw = np.random.default_rng(seed)
    if state == "mixed":
        return _mixed(energy, n, draw)
    return _near_rest(energy, n, draw, lambda count: 10.0 ** draw.uniform(-3, -1, count))


def error_states(energy: Energy, n: int = 32, seed: int = 0) -> dict[str, Inputs]:
    """States on which errors are shown: ordinary ones, close to rest, and folded where the energy has an angle."""
    draw = np.random.default_rng(seed)
    found = {"mixed": _mixed(energy, n, draw)}
    for name, size in HARD.items():
        found[f"{name} from rest"] = _near_rest(energy, n, draw, partial(np.full, fill_value=size))
    angle = next(filter(None, map(sides_of, energy.expression.walk())), None)
    for name, size in HARD.items():
        folded = None if angle is None else _folded(energy, angle, _mixed(energy, n, draw), size, draw)
        if folded is not None:
            found[f"{name} from a fold"] = folded
    return found


def _mixed(energy: Energy, n: int, draw: np.random.Generator) -> Inputs:
    dof = degrees_of_freedom(energy)
    parameters = tuple(float(value) for value in draw.uniform(0.5, 2, count_of_parameters(energy)))
    return _inside(energy, n, parameters, lambda count: draw.uniform(-1, 1, (dof, count)), MARGIN)


def _near_rest(energy: Energy, n: int, draw: np.random.Generator, sizes: Callable[[int], Array]) -> Inputs:
    rest = [energy.rest.get(name.label, 0) for name in energy.unknowns]
    given = (np.atleast_1d(energy.rest.get(p.label, (0, 0, 1) if p.name.bold else 1)) for p in energy.parameters)
    parameters = tuple(float(value) for values in given for value in values)

    def drawn(count: int) -> Array:
        turn, size = _rotations(count, draw), sizes(count)
        rows = []
        for name, value in zip(energy.unknowns, rest, strict=True):
            shape = (3 if name.bold else 1, count)
            moved = np.reshape(np.asarray(value, float), (-1, 1)) + size * draw.uniform(-1, 1, shape)
            rows.append(np.einsum("ijn,jn->in", turn, moved) if name.bold else moved)
        return np.vstack(rows)

    return _inside(energy, n, parameters, drawn, 0.0)


def _inside(
    energy: Energy, n: int, parameters: tuple[float, ...], drawn: Callable[[int], Array], margin: float
) -> Inputs:
    """The first n states drawn that are inside the domain."""
    parts: list[Array] = []
    count = 0
    for _ in range(64):
        q = drawn(max(n, 16))
        values = values_of(energy, list(q), parameters)
        good = np.ones(q.shape[1], bool)
        for assumption in energy.domain:
            sides = (scalar_of(side, values, FUNCTIONS) for side in (assumption.left, assumption.right))
            good &= np.subtract(*sides) > margin
        parts.append(q[:, good])
        count += int(good.sum())
        if count >= n:
            return Inputs(np.ascontiguousarray(np.hstack(parts)[:, :n]), parameters)
    raise ValueError(f"{energy.name}: found {count} of {n} states inside the domain; is it empty near the rest state?")


def _rotations(n: int, draw: np.random.Generator) -> Array:
    """Uniform rotations, (3, 3, n), from unit quaternions."""
    w, x, y, z = (part := draw.standard_normal((4, n))) / np.linalg.norm(part, axis=0)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _folded(
    energy: Energy, angle: tuple[Expr, Expr], start: Inputs, size: float, draw: np.random.Generator
) -> Inputs | None:
    """States whose angle is ``size`` from pi, made by moving a point that the second vector has and the first has not.

    None where there is no such point, or the second vector does not go with it, as a cross product does not.
    """
    first, second = angle
    own = {node.name for node in first.walk() if node.op == "symbol"}
    points = (node.name for node in second.walk() if node.op == "symbol" and node.name.bold)
    free = next((name for name in points if name not in own), None)
    if free is None:
        return None
    q = start.q.copy()
    at = 0
    for name in energy.unknowns:
        if name == free:
            break
        at += 3 if name.bold else 1
    a = vector_of(first, values_of(energy, list(q), start.parameters), FUNCTIONS)
    ends = []
    for place in np.vstack([np.zeros(3), np.eye(3)]):
        q[at : at + 3] = place[:, None]
        ends.append(
            np.broadcast_to(vector_of(second, values_of(energy, list(q), start.parameters), FUNCTIONS), a.shape)
        )
    origin, moved = ends[0], np.array(ends[1:]) - ends[0]
    sign = np.sign(moved[0, 0, 0])
    if not np.allclose(moved, sign * np.eye(3)[..., None]):
        return None
    length = np.linalg.norm(a, axis=0)
    across = np.cross(a, draw.standard_normal(a.shape), axis=0)
    across *= length / np.linalg.norm(across, axis=0)
    target = draw.uniform(0.5, 2, a.shape[1]) * (-np.cos(size) * a + np.sin(size) * across)
    q[at : at + 3] = (target - origin) / sign
    return Inputs(q, start.parameters)
