"""A cloth hung by two corners: let go aslant and slack, its upper edge falls into a swag and the cloth below into folds.

It is an open net of soft yarn, 16 cm wide, many times the 1 cm over which such a yarn holds itself up, (k_b/(2 rho g))^(1/3).
"""

import numpy as np
from scipy.optimize import brentq

from yarnverify.errors import InputError
from yarnverify.kernels import bending, gravity, shear, stretch
from yarnverify.kernels.fast import kinetic
from yarnverify.simulation import scrim
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.dynamics import Scheme
from yarnverify.simulation.fabric import bends, segments, shears, weave
from yarnverify.simulation.quantities import choice, positive
from yarnverify.simulation.readings import energy_of_motion
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Moving


@scene(
    title="a cloth hung by two corners",
    size="yarns of each family",
    sizes=(40,),
    wall="at the crossings of two corners, nearer to each other than the edge between them is long",
    least=3,
    solvers=("direct",),
)
def hung_cloth(
    size: int,
    slack: float = positive(0.3, "", "how much nearer the corners are, of the edge"),
    tilt: float = positive(0.3, "rad", "of the cloth from the vertical, at the start"),
    until: float = positive(2.0, "s"),
    h: float = positive(20e-3, "s", "implicit Euler damps what is faster, as air and friction of fibres do"),
    k_s: float = scrim.k_s,
    k_b: float = scrim.k_b,
    k_x: float = scrim.k_x,
    rho: float = scrim.rho,
    L: float = scrim.L,
    R: float = scrim.R,
    g: float = positive(9.81, "m/s^2", "gravity"),
    scheme: Scheme = choice("implicit_euler", "bdf2", "midpoint"),
) -> Moving:
    if not slack < 0.9:
        raise InputError(f"slack = {slack:g} must be less than 0.9 of the edge")
    cloth = weave("plain", (size, size), L, R, tails=L / 2)
    terms = [
        Term(stretch, segments(cloth), {"k_s": k_s}),
        Term(bending, bends(cloth), {"k_b": k_b}),
        Term(shear, shears(cloth), {"k_x": k_x}),
        Term(gravity, segments(cloth, gravity), {"rho": rho, "g": (0, 0, -g)}),
    ]
    # bent to an arc that sags: no yarn is stretched at the start
    half, edge = brentq(lambda a: np.sin(a) / a - (1 - slack), 1e-3, np.pi), (size - 1) * L
    start = cloth.Q.copy()
    points = cloth.points(start)
    angle = half * (2 * points[:, 0] / edge - 1)
    points[:, 0] = edge / (2 * half) * np.sin(angle)
    down, out = edge - points[:, 1], edge / (2 * half) * (np.cos(half) - np.cos(angle))
    points[:, 1] = edge - down * np.sin(tilt) - out * np.cos(tilt)
    points[:, 2] = -down * np.cos(tilt) + out * np.sin(tilt)
    free = np.setdiff1d(cloth.positions(), cloth.positions([cloth.node(0, -1), cloth.node(-1, -1)]))
    mass = Term(kinetic, segments(cloth, kinetic), {"rho": rho})
    return Moving(
        cloth, terms, free, mass, until, h, scheme=scheme, start=start, options={"residual": 1e-7, "step": 1e-8},
        watch={"energy": energy_of_motion}, frames=60, view=((0.25, -1, 0.2), (0, 0, 1)),
    )  # fmt: skip
