"""A yarn pulled out of a cloth: it slides through its crossings, so its sliding coordinates are unknown, and no others."""

import numpy as np

from yarnverify.errors import InputError
from yarnverify.kernels import bending, shear, stretch
from yarnverify.kernels.fast import kinetic
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.dynamics import Scheme
from yarnverify.simulation.fabric import bends, segments, shears, weave
from yarnverify.simulation.quantities import choice, positive
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Array, Known, Moving, rounding


@scene(
    title="a yarn pulled out of a cloth",
    size="yarns of each family",
    sizes=(20,),
    wall="at both ends of every weft, and at the upper end of one warp, which is pulled; crossings have no friction",
    least=3,
    solvers=("direct",),
)
def pulled_yarn(
    size: int,
    pull: float = positive(8e-3, "m", "how far"),
    tail: float = positive(9e-3, "m", "how far every yarn goes on beyond the cloth"),
    until: float = positive(0.1, "s"),
    h: float = positive(1e-3, "s"),
    k_s: float = positive(50.0, "N", "cotton yarn of 20 tex, 2.5 N/tex"),
    k_b: float = positive(1e-9, "N m^2", "the same, fibres partly free"),
    k_x: float = positive(5e-3, "N", "cloth with a shear stiffness of 17 N/m: 4 k_x/L"),
    rho: float = positive(2e-5, "kg/m", "20 tex"),
    L: float = positive(1.2e-3, "m", "8 yarns a centimetre"),
    R: float = positive(0.15e-3, "m", "20 tex, loosely twisted"),
    scheme: Scheme = choice("implicit_euler", "bdf2", "midpoint"),
) -> Moving:
    if not pull < tail - L / 4:
        raise InputError(f"pull = {pull:g} m draws the tail of {tail:g} m into the cloth: at most {tail - L / 4:g} m")
    cloth = weave("plain", (size, size), L, R, tails=tail)
    warp = next(k for k in cloth.select("warp") if cloth.node(size // 2, 0) in cloth.yarns[k].nodes)
    sliding, end = cloth.slides([warp]), cloth.yarns[warp].nodes[-1]
    free = np.r_[np.setdiff1d(cloth.positions(), cloth.positions([*cloth.ends("weft").ravel(), end])), sliding]
    terms = [
        Term(stretch, segments(cloth), {"k_s": k_s}),
        Term(bending, bends(cloth), {"k_b": k_b}),
        Term(shear, shears(cloth), {"k_x": k_x}),
    ]

    thread = np.ptp(cloth.points(cloth.Q)[cloth.yarns[warp].nodes, 1])
    # The yarn hangs on its end by its own inertia, which falls at 6 pull/until^2: of rho thread that is a stretch of so much of
    # the pull. The jerks at both ends make waves that may double it each.
    stretched = 3 * rho * (thread / until) ** 2 / k_s

    def held(time: float, Q: Array) -> None:
        part = min(1.0, time / until)
        Q[cloth.position(end)[0, 1]] = cloth.points(cloth.Q)[end, 1] + pull * part**2 * (
            3 - 2 * part
        )  # at rest at both ends

    return Moving(
        cloth, terms, free, Term(kinetic, segments(cloth, kinetic), {"rho": rho}), until, h, scheme=scheme, held=held,
        known=[Known("yarn that slid through each crossing", "m", np.full(size, pull),
                     lambda at: (cloth.Q - at.Q)[sliding], within=max(rounding(size), 4 * stretched))],
        frames=40, colour="sliding", view="top",
    )  # fmt: skip
