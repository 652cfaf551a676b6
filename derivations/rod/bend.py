from yarnverify.symbolic.declare import Point, Positive, angle, energy, quantity, tan


@quantity(document="rod.md", section="Bend", symbol=r"\theta", unit="rad")
def theta(x0: Point, x1: Point, x2: Point):
    """Turning angle at the vertex: 0 for a straight rod."""
    return angle(x1 - x0, x0 - x2)


@quantity(document="rod.md", section="Bend", symbol=r"\kappa")
def kappa(x0: Point, x1: Point, x2: Point):
    """Length of the curvature binormal: infinite where the rod is folded onto itself."""
    return 2 * tan(theta(x0, x1, x2) / 2)


@energy(
    document="rod.md",
    section="Bend",
    unit="J",
    singular=r"\theta = \pi",
    rest={"x0": (0, 0, 0), "x1": (1, 0, 0), "x2": (-1, 0, 0)},
    unchanged=("translation", "rotation"),
)
def bend(x0: Point, x1: Point, x2: Point, *, k_b: Positive["N m^2"], bar_l: Positive["m"]):
    """Half the bending stiffness times the squared curvature, over the rest length of the rod at the vertex."""
    return k_b * kappa(x0, x1, x2) ** 2 / (2 * bar_l)
