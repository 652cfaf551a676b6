"""What the auxiliary symbols of the document mean, for every neighbour i of the crossing q_0."""

from yarnverify.symbolic.declare import Point, Sliding, length, quantity, unit
from yarnverify.symbolic.tree import IDENTITY


@quantity(document="cirio2014.md", symbol=r"l_i", unit="m")
def l_i(x_i: Point, x_0: Point):
    """Length of the segment."""
    return length(x_i - x_0)


@quantity(document="cirio2014.md", symbol=r"\mathbf{d}_i", unit="1")
def d_i(x_i: Point, x_0: Point):
    """Direction of the segment."""
    return unit(x_i - x_0)


@quantity(document="cirio2014.md", symbol=r"\mathbf{w}_i", unit="1")
def w_i(x_i: Point, x_0: Point, u_i: Sliding, u_0: Sliding):
    """Stretch vector: current segment over its rest length."""
    return (x_i - x_0) / length(u_i - u_0)


@quantity(document="cirio2014.md", symbol=r"\mathbf{P}_i", unit="1")
def P_i(x_i: Point, x_0: Point):
    """Projection onto the normal plane of the segment."""
    return IDENTITY - d_i(x_i, x_0) * d_i(x_i, x_0).T
