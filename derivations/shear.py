from yarnverify.symbolic.declare import Point, Positive, angle, deviation, energy, quantity


@quantity(document="cirio2014.md", section="Shear", symbol=r"\phi", unit="rad")
def phi(x0: Point, x1: Point, x3: Point):
    """Angle between the warp and the weft segment."""
    return angle(x1 - x0, x3 - x0)


@energy(
    document="cirio2014.md",
    section="Shear",
    unit="J",
    singular=r"\phi = 0, \phi = \pi",
    rest={"x0": (0, 0, 0), "x1": (1, 0, 0), "x3": (0, 1, 0)},
    unchanged=("translation", "rotation"),
)
def shear(x0: Point, x1: Point, x3: Point, *, k_x: Positive["N"], L: Positive["m"]):
    """Half the shear stiffness times the squared deviation from the right angle."""
    return k_x * L * deviation(x1 - x0, x3 - x0) ** 2 / 2
