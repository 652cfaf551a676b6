from yarnverify.symbolic.declare import Point, Positive, Sliding, angle, energy, quantity


@quantity(document="cirio2014.md", section="Bending", symbol=r"\theta", unit="rad")
def theta(x0: Point, x1: Point, x2: Point):
    """Turning angle at the crossing: 0 for a straight yarn."""
    return angle(x1 - x0, x0 - x2)


@energy(
    document="cirio2014.md",
    section="Bending",
    unit="J",
    domain=r"u_1 > u_2",
    removable=r"\theta = 0",
    singular=r"\theta = \pi",
    rest={"x0": (0, 0, 0), "x1": (1, 0, 0), "x2": (-1, 0, 0), "u1": 1, "u2": -1},
    unchanged=("translation", "rotation", "sliding"),
)
def bending(x0: Point, x1: Point, x2: Point, u1: Sliding, u2: Sliding, *, k_b: Positive["N m^2"]):
    """Turning angle squared over the yarn length that it is spread on."""
    return k_b * theta(x0, x1, x2) ** 2 / (u1 - u2)
