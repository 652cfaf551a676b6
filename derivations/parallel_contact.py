from yarnverify.symbolic.declare import Positive, Sliding, energy


@energy(
    document="cirio2014.md",
    section="Parallel Contact",
    unit="J",
    domain=r"u_1 - u_0 < d",
    elsewhere="zero",
    rest={"u0": 0, "u1": 1, "d": 1},
    unchanged=("sliding",),
)
def parallel_contact(u0: Sliding, u1: Sliding, *, k_c: Positive["N m^-2"], L: Positive["m"], d: Positive["m"]):
    """Half the contact stiffness times the squared overlap of two neighbouring yarns; none where they are apart."""
    return k_c * L * (u1 - u0 - d) ** 2 / 2
