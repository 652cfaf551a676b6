from yarnverify.symbolic.declare import Point, Positive, Vector, energy


@energy(
    unit="J",
    domain=r"R > \mathbf{n}^T \left( \mathbf{x}_0 - \mathbf{p} \right)",
    elsewhere="zero",
    rest={"x0": (0, 0, 1), "n": (0, 0, 1), "p": (0, 0, 0), "R": 1},
    unchanged=("translation", "rotation"),
)
def plane(x0: Point, *, k: Positive["N m^-2"], n: Vector["1"], p: Vector["m"], R: Positive["m"]):
    """Cubed depth below a distance R from the plane through p with unit normal n: force and stiffness set in smoothly."""
    return k * (R - n.T * (x0 - p)) ** 3 / 3
