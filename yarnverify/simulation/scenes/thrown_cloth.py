"""A cloth thrown so that it flies, turns and flutters: momenta."""

import numpy as np

from yarnverify.kernels import bending, gravity, shear, stretch
from yarnverify.kernels.fast import kinetic
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.dynamics import ORDERS, Dynamics, Scheme
from yarnverify.simulation.fabric import bends, segments, shears, weave
from yarnverify.simulation.quantities import choice, positive, real, whole
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Array, Known, Moving, Outcome


@scene(
    title="a small cloth thrown into the air, turning",
    size="steps",
    sizes=(15, 30, 60),
    source="conservation: the momentum changes by the weight alone, the centre flies along a parabola, and the angular "
    "momentum about the centre stays; the midpoint rule has this to the last bit, the others at their order",
    wall="nowhere: all positions are free",
    compare="scheme",
)
def thrown_cloth(
    size: int,
    yarns: int = whole(3, "of each family", least=2),
    until: float = positive(0.02, "s"),
    speed: float = real(1.0, "m/s", "across the cloth"),
    spin: float = real(20.0, "rad/s", "about the axis (3, 1, 1): some three turns a second"),
    flutter: float = real(5.0, "1/s", "rate of an uneven motion that bends the cloth as it flies"),
    k_s: float = positive(0.05, "N", "soft, so that the time steps resolve its stretch"),
    k_b: float = positive(1e-9, "N m^2", "cotton yarn of 20 tex, fibres partly free"),
    k_x: float = positive(5e-3, "N", "cloth with a shear stiffness of 20 N/m: 4 k_x/L"),
    rho: float = positive(2e-5, "kg/m", "20 tex"),
    L: float = positive(1e-3, "m", "10 yarns a centimetre"),
    R: float = positive(0.1e-3, "m", "20 tex with a density of 600 kg/m^3"),
    g: float = positive(9.81, "m/s^2", "gravity"),
    scheme: Scheme = choice("midpoint", "bdf2", "implicit_euler"),
) -> Moving:
    cloth = weave("plain", (yarns, yarns), L, R)
    table = segments(cloth, gravity)
    terms = [
        Term(stretch, segments(cloth), {"k_s": k_s}),
        Term(bending, bends(cloth), {"k_b": k_b}),
        Term(shear, shears(cloth), {"k_x": k_x}),
        Term(gravity, table, {"rho": rho, "g": (0, 0, -g)}),
    ]
    ends = np.stack([table.rows[0], table.rows[3]]) // 3
    share = np.bincount(ends.ravel(), minlength=cloth.nodes) / ends.size  # half a segment at each of its ends
    away = cloth.points(cloth.Q) - share @ cloth.points(cloth.Q)
    V = 0 * cloth.Q
    cloth.points(V)[:] = np.cross(spin * np.array([3, 1, 1]) / np.sqrt(11), away)
    cloth.points(V)[:, 2] += speed
    cloth.points(V)[:, 2] += flutter * away[:, 0] * away[:, 1] / np.abs(away).max()
    mass = Term(kinetic, segments(cloth, kinetic), {"rho": rho})
    total = rho * L * table.count
    fallen = np.array([0, 0, speed * until - g * until**2 / 2])
    thrown = Dynamics(cloth.Q, terms, cloth.positions(), mass).start(cloth.Q, V)
    turning = np.cross(away, cloth.points(thrown.P)).sum(0)

    def angular(end: Outcome) -> Array:
        p = cloth.points(end.motion.P) if end.motion else cloth.points(cloth.Q)
        return np.cross(end.points - share @ end.points, p).sum(0)

    # nothing but rounding for the midpoint rule, and the others as far as they get with 60 steps
    order = None if scheme == "midpoint" else ORDERS[scheme]
    within = {"midpoint": 1e-12, "bdf2": 1e-3, "implicit_euler": 2e-2}[scheme]
    known = [
        Known("momentum", "kg m/s", total * np.array([0, 0, speed - g * until]),
              lambda end: cloth.points(end.motion.P).sum(0) if end.motion else 0 * fallen, within=1e-12,
              scale=total * (abs(speed) + g * until)),
        Known("way of the centre", "m", fallen, lambda end: share @ (end.points - cloth.points(cloth.Q)), order, within,
              scale=abs(speed) * until + g * until**2 / 2),
        Known("angular momentum", "kg m^2/s", turning, angular, order, within),
    ]  # fmt: skip
    return Moving(cloth, terms, cloth.positions(), mass, until, until / size, known, scheme, V=V, colour="bending")
