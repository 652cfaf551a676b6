"""A square cloth in a frame of hinged bars, pulled apart at two corners."""

import math

import numpy as np

from yarnverify.kernels import shear, stretch
from yarnverify.simulation import answers
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import segments, shears, weave
from yarnverify.simulation.quantities import positive, real
from yarnverify.simulation.readings import deviations
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Array, Known, Outcome, Stage, Static, rounding


@scene(
    title="picture frame: a square cloth sheared by hinged bars",
    size="cells each way",
    sizes=(4, 8, 16),
    least=2,
    source="trellis kinematics (Cao et al. 2008): F = 4 N k_x L gamma/(a sin(pi/4 - gamma/2)), with 4 N quadrants",
    wall="on the bars, along the outermost yarns; the cloth stays in its plane",
)
def picture_frame(
    size: int,
    side: float = positive(0.05, "m", "length of a bar"),
    delta: float = real(0.015, "m", "how far the corners are pulled apart"),
    k_x: float = positive(0.01, "N", "4 k_x/L = 40 N/m at L = 1 mm, as cotton cloth has by Kawabata's test"),
    k_s: float = positive(50.0, "N", "Y pi R^2 of a cotton yarn, Y = 0.4 GPa, R = 0.2 mm"),
    R: float = positive(0.2e-3, "m", "a cotton yarn"),
) -> Static:
    L = side / size
    fabric = weave("plain", (size + 1, size + 1), L, R)
    table = shears(fabric)
    gamma, force = answers.picture_frame(delta, side=side, crossings=table.count // 4, k_x=k_x, L=L)
    terms = [Term(stretch, segments(fabric), {"k_s": k_s}), Term(shear, table, {"k_x": k_x})]
    inside = ((fabric.grid > 0) & (fabric.grid < size)).all(axis=1)
    active = fabric.positions(fabric.crossings[inside], "xy")

    def sheared(angle: float) -> Array:
        """The cloth with its bars at pi/2 - angle."""
        Q, c, s = fabric.Q.copy(), math.cos(angle / 2), math.sin(angle / 2)
        fabric.points(Q)[:] = fabric.points(Q) @ np.array([[c, s, 0], [s, c, 0], [0, 0, 1]])
        return Q

    def pull(end: Outcome) -> float:
        """The force on the corners does the work of the reactions of the bars: F = (reaction . dx/dgamma)/(ddelta/dgamma)."""
        Q, c, s = np.zeros(fabric.size), math.cos(gamma / 2) / 2, math.sin(gamma / 2) / 2
        fabric.points(Q)[:] = fabric.points(fabric.Q) @ np.array([[-s, c, 0], [c, -s, 0], [0, 0, 0]])
        bars = fabric.positions(fabric.crossings[~inside])
        return float(end.system.slope(end.Q)[bars] @ Q[bars]) / (side * math.sin(math.pi / 4 - gamma / 2))

    count = math.ceil(abs(gamma) * size) or 1  # so that the bars move by less than a cell
    known = [
        Known("shear angle of a quadrant", "rad", np.full(table.count, abs(gamma)), lambda end: abs(deviations(end.Q, table)),
              within=rounding(size / abs(gamma or 1))),
        Known("pulling force", "N", force, pull, within=rounding(size**2 * k_s / abs(force or k_s))),
    ]  # fmt: skip
    stages = [Stage(held=sheared(gamma * k / count)) for k in range(1, count + 1)]
    return Static(fabric, terms, active, known, stages, colour="shear", view=((0, 0, 1), (1, 1, 0)))
