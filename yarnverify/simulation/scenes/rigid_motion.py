"""A cloth that is turned and moved as a whole: no energy, no force, the same speed for all."""

import numpy as np
from scipy.spatial.transform import Rotation

from yarnverify.errors import InputError
from yarnverify.kernels import bending, parallel_contact, shear, stretch
from yarnverify.kernels.fast import kinetic
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.dynamics import Scheme
from yarnverify.simulation.fabric import bends, contacts, segments, shears, weave
from yarnverify.simulation.quantities import choice, positive, real, whole
from yarnverify.simulation.readings import energy_of_motion
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Moving


@scene(
    title="a cloth that is turned, then moved at a constant speed",
    size="yarns of each family",
    sizes=(3, 6, 12),
    source="energies depend on lengths and angles alone; without force every point goes on as it does",
    wall="nowhere: all positions are free",
    least=2,
    compare="scheme",
)
def rigid_motion(
    size: int,
    angle: float = real(0.7, "rad", "about the axis (1, 2, 3)"),
    speed: float = real(0.01, "m/s", "in the direction (1, -1, 2)/sqrt(6)"),
    k_s: float = positive(50.0, "N", "cotton yarn of 20 tex, 2.5 N/tex"),
    k_b: float = positive(1e-9, "N m^2", "the same, fibres partly free"),
    k_x: float = positive(5e-3, "N", "cloth with a shear stiffness of 20 N/m: 4 k_x/L"),
    k_c: float = positive(1e4, "N/m^2", "contact at most a tenth of stretch: k_c L^2 is 1e-2 N"),
    rho: float = positive(2e-5, "kg/m", "20 tex"),
    L: float = positive(1e-3, "m", "10 yarns a centimetre"),
    R: float = positive(0.1e-3, "m", "20 tex with a density of 600 kg/m^3"),
    steps: int = whole(10),
    h: float = positive(0.1, "s"),
    scheme: Scheme = choice("midpoint", "bdf2", "implicit_euler"),
) -> Moving:
    cloth = weave("plain", (size, size), L, R)
    turn = Rotation.from_rotvec(angle * np.array([1, 2, 3]) / np.sqrt(14))
    direction = np.array([1, -1, 2]) / np.sqrt(6)
    start, V = cloth.Q.copy(), 0 * cloth.Q
    cloth.points(start)[:] = turn.apply(cloth.points(cloth.Q))
    cloth.points(V)[:] = speed * direction
    terms = [
        Term(stretch, segments(cloth), {"k_s": k_s}),
        Term(bending, bends(cloth), {"k_b": k_b}),
        Term(shear, shears(cloth), {"k_x": k_x}),
        Term(parallel_contact, contacts(cloth), {"k_c": k_c}),
    ]
    until, extent, thread = steps * h, (size - 1) * L, 2 * size * (size - 1) * L
    way = abs(speed) * until
    if way > 1e3 * extent:
        raise InputError(f"speed = {speed:g} m/s takes the cloth {way:g} m away, where rounding would stretch it")
    moving = rho * thread * speed**2 / 2
    strain = max(1e-14, 4e-16 * extent / L)  # coordinates of this extent are rounded, over segments of L
    known = [
        Known("energy of the turned cloth, over k_s times its yarn", "", 0.0,
              lambda end: end.system.energy(start) / (k_s * thread), within=strain**2, scale=1.0),
        Known("greatest force in it", "N", 0.0, lambda end: np.abs(end.system.slope(start)).max(), within=strain, scale=k_s),
        Known("position", "m", cloth.points(start) + speed * until * direction, lambda end: end.points, within=1e-13,
              scale=max(extent, way)),
        Known("energy", "J", moving, energy_of_motion, within=1e-12,
              scale=moving or 1.0),
    ]  # fmt: skip
    mass = Term(kinetic, segments(cloth, kinetic), {"rho": rho})
    return Moving(cloth, terms, cloth.positions(), mass, until, h, known, scheme, start, V, frames=10)
