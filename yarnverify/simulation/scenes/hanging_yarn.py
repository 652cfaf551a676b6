"""A yarn that hangs by its first node and carries itself and a weight."""

from yarnverify.errors import InputError
from yarnverify.kernels import gravity, stretch
from yarnverify.simulation.answers import hanging_chain
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import segments, yarn
from yarnverify.simulation.quantities import positive, real
from yarnverify.simulation.readings import tensions
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Stage, Static, rounding


@scene(
    title="a hanging yarn, stretched by its own weight and by a weight at its tip",
    size="segments",
    sizes=(10, 40, 160),
    source="statics: the tension of a segment is the weight below its middle; exact for every division",
    wall="at the first node",
)
def hanging_yarn(
    size: int,
    length: float = positive(0.1, "m"),
    k_s: float = positive(2e-3, "N", "soft, so that the stretch is seen: a cotton yarn has some 50 N"),
    rho: float = positive(1e-4, "kg/m", "100 tex, a cotton yarn"),
    g: float = positive(9.81, "m/s^2", "gravity"),
    tip_force: float = real(5e-5, "N", "half the weight of the yarn"),
) -> Static:
    fabric = yarn(length, size, direction=(0, 0, -1))
    table = segments(fabric)
    terms = [
        Term(stretch, table, {"k_s": k_s}),
        Term(gravity, segments(fabric, gravity), {"rho": rho, "g": (0, 0, -g)}),
    ]
    loads = 0 * fabric.Q
    loads[fabric.position(size)[0, 2]] = -tip_force
    exact = hanging_chain([length / size] * size, k_s=k_s, rho=rho, g=g, tip_force=tip_force)
    if not exact.tension.min() > 0:
        raise InputError(f"tip_force = {tip_force:g} N lifts the yarn: one that hangs is pulled in every segment")
    known = [
        Known("height of a node", "m", exact.points[:, 1], lambda end: end.points[:, 2]),
        Known("tension of a segment", "N", exact.tension, lambda end: tensions(end.Q, table, k_s),
              within=rounding(size * k_s / exact.tension.max())),
    ]  # fmt: skip
    return Static(
        fabric, terms, fabric.positions(range(1, size + 1)), known, [Stage(loads)], view="front", colour="stretch"
    )
