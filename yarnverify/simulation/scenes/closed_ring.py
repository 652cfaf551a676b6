"""A closed yarn that is pressed flat and let go."""

import math

import numpy as np

from yarnverify.kernels import bending, stretch
from yarnverify.simulation.answers import ring_energy
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import bends, ring, segments
from yarnverify.simulation.quantities import positive
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Static, rounding


@scene(
    title="a closed ring, pressed flat and let go",
    size="segments",
    sizes=(6, 24, 96),
    least=3,
    source="a regular polygon of yarn length l holds 2 pi^2 k_b/l, as the circle does, whatever its number of corners",
    wall="nowhere; one node, and the height of the one across, are held against moving as a whole",
)
def closed_ring(
    size: int,
    length: float = positive(0.05, "m"),
    flat: float = positive(0.7, "", "height of the ellipse at the start, over that of the circle"),
    k_b: float = positive(
        1e-9, "N m^2", "fibres of cotton that slide freely, 6e-12 N m^2 each: a solid yarn has 500 times as much"
    ),
    k_s: float = positive(
        1e-3, "N", "any: nothing is stretched; soft, so that rounding of coordinates makes little force"
    ),
) -> Static:
    fabric = ring(length, size)
    terms = [Term(stretch, segments(fabric), {"k_s": k_s}), Term(bending, bends(fabric), {"k_b": k_b})]
    start = fabric.Q.copy()
    fabric.points(start)[:, :2] *= [1 / flat, flat]
    radius = np.full(size, length / size / (2 * math.sin(math.pi / size)))
    known = [
        Known("energy of bending", "J", ring_energy(k_b, length), lambda end: end.system.energies(end.Q)["bending"]),
        Known("distance of a node from the middle", "m", radius,
              lambda end: np.linalg.norm(end.points - end.points.mean(axis=0), axis=1), within=rounding(k_s * length**2 / k_b)),
    ]  # fmt: skip
    held = [*fabric.positions([0], "xy"), *fabric.positions([size // 2], "y")]
    active = np.setdiff1d(fabric.positions(axes="xy"), held)
    return Static(fabric, terms, active, known, start=start, colour="bending", view="top")
