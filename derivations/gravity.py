from yarnverify.symbolic.declare import Point, Positive, Sliding, Vector, energy


@energy(
    unit="J",
    domain=r"u_1 > u_0",
    rest={"x0": (0, 0, 0), "x1": (1, 0, 0), "u0": 0, "u1": 1, "g": (0, 0, -1)},
    unchanged=("rotation", "sliding"),
)
def gravity(x0: Point, x1: Point, u0: Sliding, u1: Sliding, *, rho: Positive["kg m^-1"], g: Vector["m s^-2"]):
    """Weight of the yarn that lies in a segment, at its middle; linear density rho, gravitational acceleration g."""
    return -(rho * (u1 - u0) * (g.T * (x0 + x1)) / 2)
