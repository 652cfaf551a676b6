"""A cloth that falls on a sphere and drapes over it, with a fold at each corner.

It is an open net of soft yarn, 16 cm wide, many times the 1 cm over which such a yarn holds itself up, (k_b/(2 rho g))^(1/3).
Crossings rest on the sphere; where folds of the cloth meet they pass through each other.
"""

import numpy as np

from yarnverify.errors import InputError
from yarnverify.kernels import bending, gravity, shear, sphere, stretch
from yarnverify.kernels.fast import kinetic
from yarnverify.simulation import scrim
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.dynamics import Scheme
from yarnverify.simulation.fabric import bends, segments, shears, table, weave
from yarnverify.simulation.quantities import choice, positive
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Moving
from yarnverify.simulation.solids import Ball


@scene(
    title="a cloth draped over a sphere",
    size="yarns of each family",
    sizes=(40,),
    wall="nowhere: the sphere carries the cloth, without friction",
    least=3,
    solvers=("direct",),
)
def draped_cloth(
    size: int,
    radius: float = positive(34e-3, "m", "of the sphere"),
    until: float = positive(0.6, "s"),
    h: float = positive(10e-3, "s", "implicit Euler damps what is faster, as air and friction of fibres do"),
    k_s: float = scrim.k_s,
    k_b: float = scrim.k_b,
    k_x: float = scrim.k_x,
    rho: float = scrim.rho,
    k: float = positive(1e4, "N/m^2", "of the sphere: a depth of 0.1 mm carries 1e-4 N, the weight of 13 crossings"),
    L: float = scrim.L,
    R: float = scrim.R,
    g: float = positive(9.81, "m/s^2", "gravity"),
    scheme: Scheme = choice("implicit_euler", "bdf2", "midpoint"),
) -> Moving:
    cloth = weave("plain", (size, size), L, R, tails=L / 2)
    if not radius > 2 * L:
        raise InputError(f"radius = {radius:g} m: crossings {L:g} m apart would miss so small a sphere")
    reach = radius + 2 * R + 1e-4  # crossings lie two radii off, and the sphere sets in 0.1 mm further out
    start = cloth.Q.copy()
    cloth.points(start)[:] += [-(size - 1) * L / 2, -(size - 1) * L / 2, reach]
    ball = table(sphere, {"x0": np.arange(cloth.nodes)})
    terms = [
        Term(stretch, segments(cloth), {"k_s": k_s}),
        Term(bending, bends(cloth), {"k_b": k_b}),
        Term(shear, shears(cloth), {"k_x": k_x}),
        Term(gravity, segments(cloth, gravity), {"rho": rho, "g": (0, 0, -g)}),
        Term(sphere, ball, {"k": k, "c": (0, 0, 0), "R": reach}),
    ]
    mass = Term(kinetic, segments(cloth, kinetic), {"rho": rho})
    return Moving(cloth, terms, cloth.positions(), mass, until, h, scheme=scheme, start=start, frames=60,
                  options={"residual": 1e-7, "step": 1e-8},
                  solids=[Ball((0.0, 0.0, 0.0), radius)])  # fmt: skip
