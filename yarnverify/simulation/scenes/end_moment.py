"""A yarn whose end is turned, with nothing but a moment: it bends to an arc."""

import math

import numpy as np

from yarnverify.errors import InputError
from yarnverify.kernels import bending, stretch
from yarnverify.simulation import answers
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import bends, segments
from yarnverify.simulation.quantities import positive, real
from yarnverify.simulation.readings import edges, slopes
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Array, Known, Outcome, Stage, Static, rounding
from yarnverify.simulation.walls import clamped


@scene(
    title="a yarn rolled up by a moment at its end",
    size="segments",
    sizes=(20, 40, 80, 160),
    least=4,
    source="constant curvature M/EI: a chain turns by M h/EI at every node, exactly, and tends to an arc",
    wall="at x = 0, in the middle of the first segment; the last segment is held where a moment alone would bring it",
)
def end_moment(
    size: int,
    turn: float = real(5.0, "rad", "M L/EI: four fifths of a circle"),
    length: float = positive(0.05, "m", "between the middles of the segments that are held"),
    push: float = real(
        0.05,
        "",
        "how far the arc is out of shape at the start, over its length; a tenth can be enough for a whole turn less",
    ),
    k_b: float = positive(
        1e-9, "N m^2", "fibres of cotton that slide freely, 6e-12 N m^2 each: a solid yarn has 500 times as much"
    ),
    k_s: float = positive(
        1e-3, "N", "any: nothing is stretched; soft, so that rounding of coordinates makes little force"
    ),
) -> Static:
    h = length / (size - 1)
    fabric = clamped(length + h / 2, size)
    table = segments(fabric)
    if not abs(turn) < math.pi * (size - 1):
        raise InputError(f"turn = {turn:g} rad folds a yarn of {size} segments onto itself")
    terms = [Term(stretch, table, {"k_s": k_s}), Term(bending, bends(fabric), {"k_b": k_b})]

    def rolled(angle: float) -> Array:
        """Every segment turned against the one before, so that the last one comes to lie at an angle."""
        Q, angles = fabric.Q.copy(), angle / (size - 1) * np.arange(size)
        steps = h * np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
        fabric.points(Q)[1:] = fabric.points(Q)[0] + np.cumsum(steps, axis=0)
        return Q

    condition = (k_s + k_b / h**2) * length**2 / (k_b * (abs(turn) or 1.0))

    def moment(end: Outcome) -> float:
        """Of the forces that hold the two last nodes, which are a couple."""
        arm, force = edges(end.Q, table)[:, -1], end.system.slope(end.Q)[fabric.position(size)[0]]
        return float(arm[0] * force[2] - arm[2] * force[0])

    along = (np.arange(1, size) - 0.5) * h  # of the nodes between the middles that are held
    known = [
        Known("direction of a segment", "rad", turn / (size - 1) * np.arange(size), lambda end: slopes(end.Q, table, 0, 2),
              within=rounding(size / (abs(turn) or 1.0))),
        Known("moment", "N m", turn * k_b / length, moment, within=rounding(condition)),
        Known("place of a node", "m", answers.arc(turn * k_b / length, k_b=k_b, length=length, s=along / length)[1],
              lambda end: end.points[1:-1, [0, 2]], 2, 1e-3),
    ]  # fmt: skip
    held = rolled(turn)
    start = held.copy()
    fabric.points(start)[:, 2] += (
        math.copysign(1.0, turn) * push * length * np.sin(2 * math.pi * np.arange(size + 1) / size)
    )
    active = fabric.positions(range(2, size - 1), "xz")
    return Static(fabric, terms, active, known, [Stage(held=held)], start, colour="bending", view="front")
