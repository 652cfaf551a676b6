"""A straight yarn that is pushed at its ends until it buckles, and further.

The load is found where the Hessian in doubles loses its stability, and is no better than that matrix: its entries, which
are rounded, are some 6 (n/pi)^4 times its lowest eigenvalue, 2e6 for n = 80, and coordinates, which are rounded too, make n
k_s/P units of tension, 1e6 for n = 10 and 1e7 for n = 80. Errors of 6e-12 and 4e-10 are found for these two. A softer yarn
would tell the load better, and shorten too much for the deflection to be that of a yarn that does not.
"""

import math

import numpy as np

from yarnverify.errors import InputError
from yarnverify.kernels import bending, stretch
from yarnverify.simulation import answers
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.buckling import critical
from yarnverify.simulation.fabric import bends, segments, yarn
from yarnverify.simulation.quantities import positive
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Stage, Static, rounding


@scene(
    title="Euler's strut: a straight yarn pushed at its pinned ends until it buckles, and beyond",
    size="segments",
    sizes=(10, 20, 40, 80),
    least=2,
    source="(4 k_b/h^2) sin^2(pi/2n) for a chain, exactly; beyond, the elastica of Timoshenko and Gere (2.7)",
    wall="at the first node, which is held; the last one moves along; both turn freely",
    solvers=("direct",),
)
def buckling(
    size: int,
    load: float = positive(1.2, "", "over Euler's load; from 1 on the yarn buckles"),
    length: float = positive(0.05, "m"),
    k_b: float = positive(
        1e-9, "N m^2", "fibres of cotton that slide freely, 6e-12 N m^2 each: a solid yarn has 500 times as much"
    ),
    k_s: float = positive(0.5, "N", "soft against 50 N of cotton, so that rounding of coordinates makes less force"),
) -> Static:
    if size % 2:
        raise InputError(f"the number of segments is even, so that a node lies in the middle; not {size}")
    fabric = yarn(length, size)
    terms = [Term(stretch, segments(fabric), {"k_s": k_s}), Term(bending, bends(fabric), {"k_b": k_b})]
    push = 0 * fabric.Q
    push[fabric.position(size)[0, 0]] = -1.0
    ends = [*fabric.positions([0], "xz"), *fabric.positions([size], "z")]
    active = np.setdiff1d(fabric.positions(axes="xz"), ends)
    euler = answers.buckling_load(k_b, length)
    first = answers.buckling_load(k_b, length, k_s=k_s, segments=size)
    _, span, middle = answers.buckled(load) if load > 1 else (0.0, 1.0, 0.0)
    if span <= 0:
        raise InputError(f"load = {load:g}: from 2.18 on the ends meet, and the load pulls")
    known = [
        # entries 2 k_b/h^3 (6, -4, 1) of the Hessian are rounded, and its lowest eigenvalue is (pi/n)^4 2 k_b/h^3
        Known("load at which it buckles", "N", first, lambda end: critical(end.system, fabric.Q, push, 2 * first),
              within=rounding(size * k_s / first + 6 * (size / math.pi) ** 4)),
        # near Euler's load the deflection goes with sqrt(load - 1), and so does what is left of an error in the load
        Known("deflection of the middle", "m", middle * length, lambda end: abs(end.points[size // 2, 2]), 2,
              1e-3 * max(1.0, 0.2 / abs(load - 1 or 1.0))),
    ]  # fmt: skip
    count = max(1, math.ceil((load - 1) / 0.1))
    first_stage = min(load, 1.0)
    stages = [Stage((first_stage + (load - first_stage) * k / count) * euler * push) for k in range(1, count + 1)]
    return Static(fabric, terms, active, known, stages, colour="bending", view="front")
