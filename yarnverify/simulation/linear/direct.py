"""The direct solver that suits: banded for a narrow band, such as that of a single yarn, else multifrontal."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.simulation.linear.banded import Banded
from yarnverify.simulation.linear.multifrontal import Multifrontal
from yarnverify.simulation.linear.protocol import Factor, Solver

Array = NDArray[Any]
NARROW = 24  # band up to which banded Cholesky beats fronts


class Direct:
    """A direct solver for symmetric matrices of one pattern, chosen at the first of them.

    Parameters
    ----------
    nodes, coordinates
        As for ``Multifrontal``.
    """

    def __init__(self, nodes: Array | None = None, coordinates: Array | None = None) -> None:
        self._nodes, self._coordinates = nodes, coordinates
        self._chosen: Solver | None = None

    def factorise(self, matrix: Any) -> Factor:
        """Factorise a symmetric sparse matrix."""
        if self._chosen is None:
            column = np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))
            narrow = matrix.nnz == 0 or np.abs(matrix.indices - column).max() <= NARROW
            self._chosen = Banded() if narrow else Multifrontal(self._nodes, self._coordinates)
        return self._chosen.factorise(matrix)
