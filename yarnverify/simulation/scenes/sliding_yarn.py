"""A yarn that runs through eyelets without friction."""

import numpy as np

from yarnverify.kernels import stretch
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import segments, yarn
from yarnverify.simulation.quantities import positive
from yarnverify.simulation.readings import edges, rests, tensions
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Outcome, Static, rounding


@scene(
    title="a yarn that runs through eyelets without friction, pulled tight",
    size="segments",
    sizes=(4, 16, 64),
    least=2,
    source="tension is equal on both sides of every eyelet, so that rest length is shared out as length is: du_i = U l_i/l",
    wall="at both end nodes; the eyelets stand, and the yarn alone slides",
)
def sliding_yarn(
    size: int,
    length: float = positive(0.1, "m", "of the yarn at rest"),
    strain: float = positive(0.05, "", "of the whole yarn"),
    tilt: float = positive(1.0, "", "steepness of the zigzag"),
    uneven: float = positive(3.0, "", "the last segment is longer than the first by this factor"),
    k_s: float = positive(50.0, "N", "Y pi R^2 of a cotton yarn, Y = 0.4 GPa, R = 0.2 mm"),
) -> Static:
    fabric = yarn(length, size)
    table = segments(fabric)
    step = np.geomspace(1, uneven, size)
    corners = np.stack([step, 0 * step, tilt * step * (-1.0) ** np.arange(size)], axis=1)
    corners *= (1 + strain) * length / np.linalg.norm(corners, axis=1).sum()
    start = fabric.Q.copy()
    fabric.points(start)[1:] = np.cumsum(corners, axis=0)

    def moved(end: Outcome) -> float:
        """What it costs to slide the yarn as a whole, over the energy that it holds."""
        Q = end.Q.copy()
        Q[fabric.slides(ends=True)] += length
        return end.system.energy(Q) / end.system.energy(end.Q) - 1

    lengths = np.linalg.norm(edges(start, table), axis=0)
    known = [
        Known("rest length of a segment", "m", length * lengths / lengths.sum(), lambda end: rests(end.Q, table)),
        Known("tension of a segment", "N", np.full(size, k_s * strain), lambda end: tensions(end.Q, table, k_s),
              within=rounding(size * uneven * (1 + 1 / strain))),
        Known("sum of rest lengths", "m", length, lambda end: rests(end.Q, table).sum()),
        Known("cost of sliding as a whole", "", 0.0, moved),
    ]  # fmt: skip
    terms = [Term(stretch, table, {"k_s": k_s})]
    return Static(fabric, terms, fabric.slides(), known, start=start, colour="stretch", view="front")
