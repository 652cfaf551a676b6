"""A cantilever that bends under its own weight: Peirce's test of cloth."""

from yarnverify.errors import InputError
from yarnverify.kernels import bending, gravity, stretch
from yarnverify.simulation import answers
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import bends, segments
from yarnverify.simulation.quantities import choice, positive
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Static
from yarnverify.simulation.walls import clamped, tip_answers

HEAVIEST = 1e6


@scene(
    title="a cantilever bent by its own weight",
    size="segments",
    sizes=(20, 40, 80, 160),
    least=2,
    source="EI theta'' + rho g (L - s) cos(theta) = 0 for a rod that does not stretch, by collocation to 1e-11",
    wall="at x = 0: in the middle of the first segment, whose two nodes are held, or at the first of them",
    compare="wall",
)
def heavy_cantilever(
    size: int,
    length: float = positive(0.03, "m", "rho g L^3/EI = 13: the tip hangs down"),
    k_b: float = positive(
        1e-9, "N m^2", "fibres of cotton that slide freely, 6e-12 N m^2 each: a solid yarn has 500 times as much"
    ),
    k_s: float = positive(50.0, "N", "Y pi R^2 of a cotton yarn, Y = 0.4 GPa, R = 0.2 mm"),
    rho: float = positive(5e-5, "kg/m", "50 tex, a cotton yarn"),
    g: float = positive(9.81, "m/s^2", "gravity"),
    wall: str = choice("middle", "node"),
) -> Static:
    fabric = clamped(length, size, wall)
    terms = [
        Term(stretch, segments(fabric), {"k_s": k_s}),
        Term(bending, bends(fabric), {"k_b": k_b}),
        Term(gravity, segments(fabric, gravity), {"rho": rho, "g": (0, 0, -g)}),
    ]
    beta = rho * g * length**3 / k_b
    if beta > HEAVIEST:
        raise InputError(
            f"rho g length^3/k_b = {beta:.2g}: at most {HEAVIEST:g}, or all of the bend lies in the first segment at any size"
        )
    tip = answers.cantilever(beta).tip
    known = tip_answers(tip, length, wall, within=1e-3, stretched=rho * g * length / k_s)
    active = fabric.positions(range(2, size + 1), "xz")
    return Static(fabric, terms, active, known, colour="bending", view="front")
