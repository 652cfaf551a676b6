"""A yarn that swings from a pin without damping: what each scheme makes of its energy."""

import numpy as np

from yarnverify.kernels import bending, gravity, stretch
from yarnverify.kernels.fast import kinetic
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.dynamics import ORDERS, Scheme
from yarnverify.simulation.fabric import bends, segments, yarn
from yarnverify.simulation.quantities import choice, positive, real, whole
from yarnverify.simulation.readings import energy_of_motion
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Array, Known, Moving, Outcome


@scene(
    title="an undamped yarn swings from a pin: its energy over time",
    size="steps of a swing",
    sizes=(160, 320, 640),
    source="conservation: the energy stays what it was; a symmetric scheme errs by h^2 without a trend, whatever the time",
    wall="at the first node, which turns",
    least=10,
    compare="scheme",
)
def energy_over_time(
    size: int,
    segments_: int = whole(1, "of the chain"),
    swings: float = positive(0.5, "", "how long, in swings of a stiff pendulum; 100 of 100 steps are 10^4 steps"),
    angle: float = real(1.2, "rad", "from hanging down, at the start"),
    length: float = positive(0.1, "m"),
    k_s: float = positive(1e-3, "N", "elastic thread, 50 times its weight: the steps resolve its stretch"),
    k_b: float = positive(1e-9, "N m^2", "cotton yarn of 20 tex, fibres partly free"),
    rho: float = positive(2e-5, "kg/m", "20 tex"),
    g: float = positive(9.81, "m/s^2", "gravity"),
    scheme: Scheme = choice("midpoint", "bdf2", "implicit_euler"),
) -> Moving:
    fabric = yarn(length, segments_, direction=(np.sin(angle), 0, -np.cos(angle)))
    terms = [
        Term(stretch, segments(fabric), {"k_s": k_s}),
        Term(bending, bends(fabric), {"k_b": k_b}),
        Term(gravity, segments(fabric, gravity), {"rho": rho, "g": (0, 0, -g)}),
    ]
    until = swings * 2 * np.pi * np.sqrt(2 * length / (3 * g))
    count = max(2, round(swings * size))
    most = rho * length * g * length / 2 * (1 - np.cos(angle))  # what gravity can give
    before = -rho * length * g * length / 2 * np.cos(angle)

    def worst(end: Outcome) -> Array:
        energy = end.recorded["energy"][1:]
        return energy[np.argmax(np.abs(energy - before))]

    def trend(end: Outcome) -> float:
        energy = end.recorded["energy"][1:]
        slope = np.polyfit(np.linspace(-0.5, 0.5, count), energy, 1)[0]
        return float(slope / np.ptp(energy))

    within = {"midpoint": 1e-3, "bdf2": 3e-3, "implicit_euler": 0.1}[scheme]
    known = [Known("energy where it is farthest off", "J", before, worst, ORDERS[scheme], within, scale=most)]
    if scheme == "midpoint" and swings >= 3:  # a part of one swing has a trend of its own
        known.append(Known("trend over the whole time, of its spread", "", 0.0, trend, within=0.1, scale=1.0))
    return Moving(
        fabric,
        terms,
        fabric.positions(range(1, segments_ + 1)),
        Term(kinetic, segments(fabric, kinetic), {"rho": rho}),
        until,
        until / count,
        known,
        scheme,
        watch={"energy": energy_of_motion},
        colour="stretch",
        view="front",
    )
