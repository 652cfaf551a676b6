from yarnverify.symbolic.declare import Point, Positive, Vector, energy, length


@energy(
    unit="J",
    domain=r"R > \| \mathbf{x}_0 - \mathbf{c} \|",
    elsewhere="zero",
    singular=r"\mathbf{x}_0 = \mathbf{c}",
    rest={"x0": (1, 0, 0), "c": (0, 0, 0), "R": 1},
    unchanged=("translation", "rotation"),
)
def sphere(x0: Point, *, k: Positive["N m^-2"], c: Vector["m"], R: Positive["m"]):
    """Cubed depth inside a sphere of radius R about c: force and stiffness set in smoothly."""
    return k * (R - length(x0 - c)) ** 3 / 3
