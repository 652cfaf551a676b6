"""Neighbouring parallel yarns, pushed together along a yarn that crosses them."""

import numpy as np

from yarnverify.errors import InputError
from yarnverify.kernels import parallel_contact
from yarnverify.simulation.answers import contact_gap
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import contacts, weave
from yarnverify.simulation.quantities import positive
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Stage, Static, rounding


@scene(
    title="parallel yarns pushed together along the yarn across them",
    size="parallel yarns",
    sizes=(4, 16, 64),
    least=2,
    source="every gap carries the force: u_1 - u_0 = d - F/(k_c L); d = 4R where the yarn across changes sides, 2R on a float",
    wall="at the first crossing, whose sliding coordinate is held",
)
def pressed_yarns(
    size: int,
    force: float = positive(0.01, "N", "presses the last crossing towards the first"),
    k_c: float = positive(1e5, "N/m^2", "overlaps by a quarter of 2R at this force"),
    L: float = positive(0.9e-3, "m", "a dense cloth"),
    R: float = positive(0.2e-3, "m", "a cotton yarn"),
) -> Static:
    fabric = weave("twill 2/2", (1, size), L, R, tails=2 * L, pressed=True)
    table = contacts(fabric)
    along = fabric.yarns[0].slides[1:-1]  # at the crossings
    d = table.parameters["d"]
    exact = np.array([contact_gap(force, k_c=k_c, L=L, d=float(each)) for each in d])
    if not exact.min() > 0:
        raise InputError(f"force = {force:g} N pushes yarns through each other: a gap would be {exact.min():.3g} m")
    loads = 0 * fabric.Q
    loads[along[-1]] = -force
    start = fabric.Q.copy()
    start[along[1:]] = start[along[0]] + np.cumsum(0.95 * d)  # in touch, so that there is a stiffness to begin with
    extent = float(np.abs(start[along]).max())
    known = [Known("gap between neighbours", "m", exact, lambda end: np.diff(end.Q[along]),
                   within=rounding(extent / exact.max()))]  # fmt: skip
    terms = [Term(parallel_contact, table, {"k_c": k_c})]
    return Static(fabric, terms, along[1:], known, [Stage(loads)], start=start, colour="contact", view="top")
