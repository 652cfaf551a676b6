from yarnverify.symbolic.declare import Point, Positive, energy, length


@energy(
    document="rod.md",
    section="Spring",
    unit="J",
    singular=r"l_1 = 0",
    rest={"x0": (0, 0, 0), "x1": (1, 0, 0), "L": 1},
    unchanged=("translation", "rotation"),
)
def spring(x0: Point, x1: Point, *, k: Positive["N m^-1"], L: Positive["m"]):
    """Half the stiffness times the squared elongation."""
    return k * (length(x1 - x0) - L) ** 2 / 2
