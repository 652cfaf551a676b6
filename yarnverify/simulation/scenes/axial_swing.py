"""A yarn that swings along itself: every scheme against the exact motion.

The energy of the midpoint rule is kept to 1e-12, or to what rounding leaves of the displacements: each step tells positions to
4 units of the length, and the energy goes with the square of the amplitude.
"""

import numpy as np

from yarnverify.errors import InputError
from yarnverify.kernels import stretch
from yarnverify.kernels.fast import kinetic
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.dynamics import ORDERS, Scheme
from yarnverify.simulation.fabric import segments, yarn
from yarnverify.simulation.quantities import choice, positive, whole
from yarnverify.simulation.readings import energy_of_motion
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Moving


@scene(
    title="a yarn held at one end swings along itself, without damping",
    size="steps of a period",
    sizes=(80, 160, 320),
    source="a chain along a line is linear: x_i = X_i + A sin(kappa X_i) cos(omega t), kappa = (2 n - 1) pi/(2 l), "
    "omega^2 = 6 k_s/(rho h^2) (1 - cos(kappa h))/(2 + cos(kappa h)) for the consistent mass as declared",
    wall="at the first node",
    least=5,
    compare="scheme",
)
def axial_swing(
    size: int,
    segments_: int = whole(4, "of the chain"),
    mode: int = whole(1, "n"),
    length: float = positive(0.1, "m"),
    k_s: float = positive(50.0, "N", "cotton yarn of 20 tex, 2.5 N/tex"),
    rho: float = positive(2e-5, "kg/m", "20 tex"),
    amplitude: float = positive(1e-2, "m", "10 % of the length: along a line, a chain is linear however far it swings"),
    periods: float = positive(0.55, "", "how long"),
    scheme: Scheme = choice("midpoint", "bdf2", "implicit_euler"),
) -> Moving:
    if mode > segments_:
        raise InputError(f"a chain of {segments_} segments has modes 1 to {segments_}, not {mode}")
    fabric = yarn(length, segments_)
    h, kappa = length / segments_, (2 * mode - 1) * np.pi / (2 * length)
    cosine = np.cos(kappa * h)
    omega = np.sqrt(6 * k_s / (rho * h * h) * (1 - cosine) / (2 + cosine))
    shape = amplitude * np.sin(kappa * fabric.points(fabric.Q)[:, 0])
    if not (np.diff(fabric.points(fabric.Q)[:, 0]) > 2 * np.abs(np.diff(shape))).all():
        raise InputError(f"amplitude = {amplitude:g} m would press a segment to half its length and less")
    start = fabric.Q.copy()
    fabric.points(start)[:, 0] += shape
    until = periods * 2 * np.pi / omega
    count = max(1, round(periods * size))
    # read in the middle of each step, where a mode is smaller by cos(phi/2), tan(phi/2) = omega h/2, but constant
    energy = k_s / 2 * float((np.diff(shape) ** 2).sum()) / h / (1 + (omega * until / count / 2) ** 2)
    # leading errors a radian of the motion: the two first turn it back, the last makes it smaller
    turn = omega * until / count
    wrong = {"midpoint": turn**2 / 12, "bdf2": turn**2 / 3, "implicit_euler": turn / 2}[scheme]
    told = 4 * np.finfo(float).eps * length / amplitude * np.sqrt(count)
    return Moving(
        fabric,
        [Term(stretch, segments(fabric), {"k_s": k_s})],
        fabric.positions(range(1, segments_ + 1), "x"),
        Term(kinetic, segments(fabric, kinetic), {"rho": rho}),
        until,
        until / count,
        [
            # at all times: at a whole number of periods alone, an error of the phase would count by its square
            Known("displacement of the free end", "m", shape[-1] * np.cos(omega * until * np.arange(count + 1) / count),
                  lambda end: end.recorded["displacement"], ORDERS[scheme], within=wrong * omega * until, scale=amplitude),
            *([Known("energy", "J", np.full(count, energy), lambda end: end.recorded["energy"][1:], within=max(1e-12, told))]
              if scheme == "midpoint" else []),
        ],
        scheme,
        start,
        watch={"energy": energy_of_motion, "displacement": lambda at: float(at.points[-1, 0] - length)},
        colour="stretch",
        view="front",
    )  # fmt: skip
