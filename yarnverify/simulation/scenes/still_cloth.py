"""A flat cloth without load: nothing moves, ever."""

import numpy as np

from yarnverify.kernels import bending, parallel_contact, shear, stretch
from yarnverify.kernels.fast import kinetic
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.dynamics import Scheme
from yarnverify.simulation.fabric import bends, contacts, segments, shears, weave
from yarnverify.simulation.quantities import choice, positive, whole
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Moving


@scene(
    title="a flat cloth without load stays where it is",
    size="yarns of each family",
    sizes=(3, 6, 12),
    source="its energy is least and zero",
    wall="nowhere: all positions and all sliding coordinates within are free",
    least=2,
    compare="scheme",
)
def still_cloth(
    size: int,
    k_s: float = positive(50.0, "N", "cotton yarn of 20 tex, 2.5 N/tex"),
    k_b: float = positive(1e-9, "N m^2", "the same, fibres partly free"),
    k_x: float = positive(5e-3, "N", "cloth with a shear stiffness of 20 N/m: 4 k_x/L"),
    k_c: float = positive(1e4, "N/m^2", "contact at most a tenth of stretch: k_c L^2 is 1e-2 N"),
    rho: float = positive(2e-5, "kg/m", "20 tex"),
    L: float = positive(1e-3, "m", "10 yarns a centimetre"),
    R: float = positive(0.1e-3, "m", "20 tex with a density of 600 kg/m^3"),
    steps: int = whole(10),
    h: float = positive(0.01, "s"),
    scheme: Scheme = choice("midpoint", "bdf2", "implicit_euler"),
) -> Moving:
    cloth = weave("plain", (size, size), L, R)
    terms = [
        Term(stretch, segments(cloth), {"k_s": k_s}),
        Term(bending, bends(cloth), {"k_b": k_b}),
        Term(shear, shears(cloth), {"k_x": k_x}),
        Term(parallel_contact, contacts(cloth), {"k_c": k_c}),
    ]
    known = [
        Known("how far anything has moved", "m", 0 * cloth.Q, lambda end: end.Q - cloth.Q, within=1e-14, scale=L),
        Known("greatest force", "N", 0.0, lambda end: np.abs(end.system.slope(end.Q)).max(), within=1e-14, scale=k_s),
    ]
    free = np.r_[cloth.positions(), cloth.slides()]
    mass = Term(kinetic, segments(cloth, kinetic), {"rho": rho})
    return Moving(cloth, terms, free, mass, steps * h, h, known, scheme, frames=1, view="top")
