from yarnverify.symbolic.declare import Point, Positive, Sliding, energy, length


@energy(
    document="cirio2014.md",
    section="Stretch",
    unit="J",
    domain=r"u_1 > u_0",
    singular=r"l_1 = 0",
    rest={"x0": (0, 0, 0), "x1": (1, 0, 0), "u0": 0, "u1": 1},
    unchanged=("translation", "rotation", "sliding"),
)
def stretch(x0: Point, x1: Point, u0: Sliding, u1: Sliding, *, k_s: Positive["N"]):
    """Half the stretch stiffness times the squared strain, over the rest length that carries it."""
    strain = length(x1 - x0) / (u1 - u0) - 1
    return k_s * (u1 - u0) * strain**2 / 2
