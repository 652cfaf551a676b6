"""The load at which an equilibrium loses its stability."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.simulation.assembly import System
from yarnverify.simulation.linear import LinearSolveError
from yarnverify.simulation.newton import minimise

Array = NDArray[Any]


def critical(system: System, Q: Array, load: Array, most: float) -> float:
    """The factor of a load at which the Hessian gets its first negative eigenvalue, on the path of equilibria from a state.

    Found by bisection on the number of negative pivots, to neighbouring floats where rounding lets it.

    Parameters
    ----------
    Q
        A stable equilibrium without load, (size,).
    load
        (size,), N.
    most
        A factor at which it is unstable.

    Raises
    ------
    ValueError
        It is stable there.
    """
    pushed = copy(system)
    low, high = 0.0, most

    def unstable(factor: float) -> bool:
        pushed.loads = factor * load
        matrix = pushed.hessian(minimise(pushed, Q, stable=False, residual=1e-15).Q)
        try:
            return bool(pushed.direct.factorise(matrix).negative)
        except LinearSolveError as error:
            return error.direction is not None

    if not unstable(high):
        raise ValueError(f"still stable under {most:g} times the load")
    while high - low > 2 * np.spacing(high):
        middle = (low + high) / 2
        low, high = (low, middle) if unstable(middle) else (middle, high)
    return (low + high) / 2
