"""The pass rule: what an error may be at a condition number. One for the sweep, ``check``, ``fuzz`` and export."""

from __future__ import annotations

from typing import Any

import numpy as np

from yarnverify.accuracy.metrics import UNIT

EXACT = 16.0  # units: what an accurate kernel may lose, whatever the condition
AMPLIFIED = 8.0  # units per condition number: what one without compensation may lose on top


def allowed(condition: Any, dtype: str = "float64") -> Any:
    """Units that the error of a block may have, relative to the norm of the true block.

    ``16 + 8 K + (8 K)^2 u / 4`` for a condition number K. The first term is for the operations themselves. The second is for
    the rounding of inputs and of differences of inputs: what a relative change of h = 8 u of every input makes of the
    result, to first order K h. The third is the same to second order, for a result that is a square, as an energy near rest
    is: such a change makes K h + (K h)^2 / 4 of it. It exceeds the second only where K h is above 4, so where no digit of the
    result is determined by its inputs, and is left out where the rule is told in short. There is no absolute tolerance; an
    infinite condition number allows any finite error.

    Parameters
    ----------
    condition
        Condition number, or an array of these; see ``conditioning``.
    dtype
        float64 or float32, whose unit u is.
    """
    with np.errstate(over="ignore"):
        first = AMPLIFIED * np.asarray(condition, dtype=float)
        found = EXACT + first + first * first * (UNIT[dtype] / 4)
    return found if found.ndim else float(found)
