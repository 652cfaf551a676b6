"""A slack yarn between two points.

However stiff, it hangs where the chain does to 1e-12, up to the k_s at which rounding of coordinates makes 1e16 times its
weight: beyond, coordinates do not tell how it hangs, and it is refused.
"""

import math

import numpy as np

from yarnverify.errors import InputError
from yarnverify.kernels import gravity, stretch
from yarnverify.simulation import answers
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import segments, yarn
from yarnverify.simulation.quantities import positive, real
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Static


@scene(
    title="a slack yarn between two points",
    size="segments",
    sizes=(20, 40, 80, 160),
    least=2,
    source="balance of every node, exact for every division; and y = a cosh(x/a) for a yarn that does not stretch",
    wall="at both end nodes, which are held",
)
def catenary(
    size: int,
    length: float = positive(0.12, "m"),
    span: float = positive(0.08, "m"),
    rise: float = real(0.02, "m", "height of the second end over the first"),
    k_s: float = positive(50.0, "N", "Y pi R^2 of a cotton yarn, Y = 0.4 GPa, R = 0.2 mm"),
    rho: float = positive(5e-5, "kg/m", "50 tex, a cotton yarn"),
    g: float = positive(9.81, "m/s^2", "gravity"),
) -> Static:
    if not length > math.hypot(span, rise):
        raise InputError(
            f"length = {length:g} m: a slack yarn is longer than the {math.hypot(span, rise):.6g} m between its ends"
        )
    fabric = yarn(length, size)
    terms = [
        Term(stretch, segments(fabric), {"k_s": k_s}),
        Term(gravity, segments(fabric, gravity), {"rho": rho, "g": (0, 0, -g)}),
    ]
    if size * span < length:
        raise InputError(f"segments of {length / size:g} m do not hang in a span of {span:g} m: take more of them")
    chain = answers.hung_chain([length / size] * size, span=span, rise=rise, k_s=k_s, rho=rho, g=g)
    limit = answers.catenary(length, span, rise).at(np.arange(size + 1) * length / size)
    known = [
        Known("place of a node, of a chain", "m", chain.points, lambda end: end.points[:, [0, 2]]),
        Known("place of a node, of a yarn", "m", limit, lambda end: end.points[:, [0, 2]], 2, 1e-4,
              floor=chain.tension.max() / k_s),
    ]  # fmt: skip
    # let go as a V, its sides as steep as each other, in which nothing but the segment at its corner is stretched
    slope, along, start = math.acos(span / length), np.linspace(0, length, size + 1), fabric.Q.copy()
    corner = (length - rise / math.sin(slope)) / 2
    down = math.sin(slope) * np.minimum(along, 2 * corner - along)
    fabric.points(start)[:] = np.stack([math.cos(slope) * along, 0 * along, -down], axis=1)
    active = fabric.positions(range(1, size), "xz")
    return Static(fabric, terms, active, known, start=start, colour="stretch", view="front")
