"""A yarn on two pins that swings a little in one of its modes.

The frequency of the chain is told to 1e-12, or to what two things make of it. A swing is slower by the square of its
steepness, (kappa a)^2, times that of its mode, since the end that slides goes to and fro. And coordinates along the yarn
are rounded: a strain of one unit is a tension of 2e-16 k_s, at random from segment to segment and step to step, beside the
k_b kappa^2 of bending. Hence an amplitude of 1e-8 of the length, and a soft yarn; with the 50 N of cotton errors of 1e-11
are found.
"""

import numpy as np

from yarnverify.errors import InputError
from yarnverify.kernels import bending, stretch
from yarnverify.kernels.fast import kinetic
from yarnverify.simulation.answers import frequency
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import bends, segments, yarn
from yarnverify.simulation.quantities import positive, whole
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Moving, Outcome


@scene(
    title="a yarn between two pins swings in one of its modes",
    size="segments",
    sizes=(8, 16, 32),
    source="f_n = n^2 pi/(2 l^2) sqrt(k_b/rho); a chain has 4 sin^2(x)/h^2, x = n pi/(2 N), for (n pi/l)^2, and the mass "
    "1 - (2/3) sin^2(x) of rho h, consistent as declared: both errors of order 2 cancel, and -x^4/90 is left",
    wall="at both end nodes, which turn; the last one slides along the axis, so that no tension comes of swinging",
    least=2,
)
def swinging_yarn(
    size: int,
    mode: int = whole(1, "n"),
    length: float = positive(0.1, "m"),
    k_b: float = positive(1e-9, "N m^2", "cotton yarn of 20 tex, fibres partly free"),
    k_s: float = positive(
        1e-3, "N", "any: nothing is stretched; soft, so that rounding of coordinates makes little tension"
    ),
    rho: float = positive(2e-5, "kg/m", "20 tex"),
    amplitude: float = positive(1e-9, "m", "so small that its square does not count"),
    steps: int = whole(40, "of a period", least=5),
) -> Moving:
    if mode >= size:
        raise InputError(f"a chain of {size} segments has modes 1 to {size - 1}, not {mode}")
    fabric = yarn(length, size)
    terms = [Term(stretch, segments(fabric), {"k_s": k_s}), Term(bending, bends(fabric), {"k_b": k_b})]
    exact, chain = (frequency(mode, k_b=k_b, rho=rho, length=length, segments=n) for n in (None, size))
    kappa = mode * np.pi / length
    shape = np.sin(kappa * length * np.arange(size + 1) / size)
    start = fabric.Q.copy()
    fabric.points(start)[:, 2] = amplitude * shape
    h = 1 / (steps * exact)

    # the end that slides goes to and fro by about l (a kappa)^2, and its inertia pulls: this much, relative to bending
    square = (kappa * length) ** 2 * (kappa * amplitude) ** 2
    # rounding of coordinates along the yarn makes a tension in each segment and step, at random, which stiffens the swing
    told = np.finfo(float).eps * np.sqrt(size / steps) * k_s / (k_b * kappa**2)

    def found(end: Outcome) -> float:
        # the midpoint rule turns a mode by phi = 2 atan(omega h/2) a step, to the last bit: undone here
        swing = end.recorded["swing"]
        cosine = (swing[2:] + swing[:-2]) @ swing[1:-1] / (2 * swing[1:-1] @ swing[1:-1])
        return float(np.sqrt((1 - cosine) / (1 + cosine)) / (np.pi * h))

    return Moving(
        fabric,
        terms,
        np.r_[fabric.positions(range(1, size)), fabric.positions([size], "x")],
        Term(kinetic, segments(fabric, kinetic), {"rho": rho}),
        until=steps * h,
        h=h,
        known=[
            Known("frequency of the chain", "Hz", chain, found, within=max(1e-12, 4 * square + told)),
            Known(
                "frequency", "Hz", exact, found, order=4, within=(kappa * length / (2 * size)) ** 4 / 80 + 4 * square
            ),
        ],
        start=start,
        watch={"swing": lambda at: float(shape @ at.points[:, 2])},
        colour="bending",
        view="front",
    )
