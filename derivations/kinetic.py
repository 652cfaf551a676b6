from yarnverify.symbolic.declare import Point, Positive, Sliding, SlidingSpeed, Velocity, energy, square, unchanged_by
from yarnverify.symbolic.integrals import integral


@energy(
    unit="J",
    domain=r"u_1 > u_0",
    rest={"x0": (0, 0, 0), "x1": (1, 0, 0), "u0": 0, "u1": 1, "v0": (0, 0, 0), "v1": (0, 0, 0), "w0": 0, "w1": 0},
    unchanged=("translation", "rotation", "sliding"),
)
def kinetic(
    x0: Point, x1: Point, u0: Sliding, u1: Sliding,
    v0: Velocity, v1: Velocity, w0: SlidingSpeed, w1: SlidingSpeed, *, rho: Positive["kg m^-1"],
):  # fmt: skip
    """Half the linear density times the squared velocity of the material, integrated along the segment.

    A material point moves with its place on the segment (v), less the yarn that slides through (w) times dx/du.
    """
    dx_du = (x1 - x0) / (u1 - u0)
    first, last = v0 - w0 * dx_du, v1 - w1 * dx_du  # the material at the ends; linear between them

    def material(u):
        return ((u1 - u) * first + (u - u0) * last) / (u1 - u0)

    return integral(lambda u: rho / 2 * square(material(u)), u0, u1)


@unchanged_by(kinetic)
def sliding_along_at_the_first_end(x0: Point, x1: Point, u0: Sliding, u1: Sliding):
    """The node moves along the yarn, which slides back through it: no material moves."""
    return {"v0": (x1 - x0) / (u1 - u0), "w0": 1}


@unchanged_by(kinetic)
def sliding_along_at_the_last_end(x0: Point, x1: Point, u0: Sliding, u1: Sliding):
    return {"v1": (x1 - x0) / (u1 - u0), "w1": 1}
