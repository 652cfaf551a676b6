"""A cloth cut at 45 degrees to its yarns and pulled along its length."""

import math

import numpy as np

from yarnverify.errors import InputError
from yarnverify.kernels import shear, stretch
from yarnverify.simulation import answers
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import segments, shears, weave
from yarnverify.simulation.quantities import positive, whole
from yarnverify.simulation.readings import deviations, edges
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Array, Known, Outcome, Stage, Static


@scene(
    title="bias extension: a cloth cut at 45 degrees and pulled along its length",
    size="half cells across",
    sizes=(4, 8, 16),
    least=2,
    source="kinematics of yarns that do not stretch (Harrison et al. 2004); each angle from the balance of a net of such yarns",
    wall="in the first and the last row of crossings, which are held; the cloth stays in its plane",
)
def bias_extension(
    size: int,
    width: float = positive(0.02, "m"),
    ratio: int = whole(2, "length over width; the zones are uniform at 2, and on the average beyond", least=2),
    strain: float = positive(0.15, "", "extension over length less width"),
    k_x: float = positive(0.01, "N", "4 k_x/L = 40 N/m at L = 1 mm, as cotton cloth has by Kawabata's test"),
    k_s: float = positive(1e5, "N", "so that yarns hardly stretch; cotton yarn has some 50 N"),
    R: float = positive(0.1e-3, "m", "a fine cotton yarn"),
) -> Static:
    if size % 2:
        raise InputError(f"the number of half cells across is even, so that the grips end at crossings; not {size}")
    along, L = ratio * size, width / size / math.sqrt(2)
    i, j = np.indices((along + size + 1,) * 2) - size // 2
    fabric = weave("plain", i.shape, L, R, keep=(abs(i - j) <= size) & (i + j >= 0) & (i + j <= 2 * along))
    table = shears(fabric)
    row = fabric.grid.sum(axis=1) - size
    delta = strain * (ratio - 1) * width
    gamma, _ = answers.bias_extension(delta, height=ratio * width, width=width)
    turned = np.zeros(along + size + 1)  # of the yarns across each gap; those of the grips stay
    turned[size:along] = answers.bias_net(delta, across=size, along=along, L=L)
    # grid numbers of the crossing, of its neighbour along the warp and of that along the weft
    crossing, warp, weft = (fabric.grid[table.rows[k] // 3] for k in (0, 3, 6))
    of_warp, of_weft = turned[np.minimum(crossing, warp)[:, 1]], turned[np.minimum(crossing, weft)[:, 0]]
    pieces = segments(fabric)
    terms = [Term(stretch, pieces, {"k_s": k_s}), Term(shear, table, {"k_x": k_x})]
    first, last = (fabric.grid[pieces.rows[k] // 3] for k in (0, 3))
    gap = np.where(last[:, 0] > first[:, 0], first[:, 0], -1)  # that a piece of weft crosses
    gap[(gap < size) | (gap >= along)] = -1

    def pulled(part: float) -> Array:
        Q = fabric.Q.copy()
        fabric.points(Q)[row == 2 * along, :2] += part * delta / math.sqrt(2)
        return Q

    def mean(end: Outcome) -> float:
        """Twice the angle by which wefts turn, where they do: the mean over gaps between warps."""
        edge, there = edges(end.Q, pieces), gap >= 0
        turns = np.bincount(gap[there], np.arctan2(edge[1], edge[0])[there]) / np.maximum(np.bincount(gap[there]), 1)
        return float(2 * turns[size:].mean())

    # yarns stretch by about size k_x/(k_s cos^2 gamma), which adds up over as many cells
    stretched = min(0.01, 32 * size**2 * k_x / k_s / math.cos(gamma) ** 2)
    uneven = 2 * turned[size:along].mean() / gamma - 1
    known = [
        Known("shear angle of a quadrant", "rad", of_warp + of_weft, lambda end: abs(deviations(end.Q, table)),
              within=stretched, scale=gamma),
        Known("shear angle, mean of the central zone", "rad", gamma, mean, within=stretched + abs(uneven)),
    ]  # fmt: skip
    active = fabric.positions(np.flatnonzero((row > 0) & (row < 2 * along)), "xy")
    count = math.ceil(delta / L)  # so that the grip moves by no more than a cell
    stages = [Stage(held=pulled(k / count)) for k in range(1, count + 1)]
    return Static(fabric, terms, active, known, stages, colour="shear", view=((0, 0, 1), (1, 1, 0)))
