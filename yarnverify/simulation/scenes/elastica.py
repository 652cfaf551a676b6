"""A cantilever with a load at its tip, bent however far."""

from yarnverify.kernels import bending, stretch
from yarnverify.simulation import answers
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import bends, segments
from yarnverify.simulation.quantities import choice, positive
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Stage, Static
from yarnverify.simulation.walls import clamped, tip_answers


@scene(
    title="a cantilever bent by a load at its tip",
    size="segments",
    sizes=(20, 40, 80, 160),
    least=2,
    source="elliptic integrals of Bisshopp and Drucker (1945), for a rod that does not stretch",
    wall="at x = 0: in the middle of the first segment, whose two nodes are held, or at the first of them",
    compare="wall",
)
def elastica(
    size: int,
    alpha: float = positive(10.0, "", "P L^2/EI: the tip hangs far down"),
    length: float = positive(0.05, "m"),
    k_b: float = positive(
        1e-9, "N m^2", "fibres of cotton that slide freely, 6e-12 N m^2 each: a solid yarn has 500 times as much"
    ),
    k_s: float = positive(50.0, "N", "Y pi R^2 of a cotton yarn, Y = 0.4 GPa, R = 0.2 mm; stretches by 1e-7 here"),
    wall: str = choice("middle", "node"),
) -> Static:
    fabric = clamped(length, size, wall)
    terms = [Term(stretch, segments(fabric), {"k_s": k_s}), Term(bending, bends(fabric), {"k_b": k_b})]
    loads = 0 * fabric.Q
    loads[fabric.position(size)[0, 2]] = -alpha * k_b / length**2
    tip = answers.elastica(alpha)
    known = tip_answers(tip, length, wall, within=1e-4, stretched=alpha * k_b / length**2 / k_s)
    active = fabric.positions(range(2, size + 1), "xz")
    return Static(fabric, terms, active, known, [Stage(loads)], colour="bending", view="front")
