"""One energy on the elements of a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from yarnverify.kernels.inputs import parameters_of
from yarnverify.simulation.tables import Table


@dataclass(frozen=True, eq=False)
class Term:
    """One energy on all elements of a table.

    Attributes
    ----------
    kernel
        A module of ``yarnverify.kernels`` or one like it (``DOFS``, ``PARAMETERS``, ``KERNEL``, ``packed``).
    table
        The elements.
    parameters
        Values of the kernel's parameters that the table does not know, each a number or (n,).
    name
        The kernel's, unless given.

    Raises
    ------
    ValueError, TypeError
        A parameter is missing, not known, or not what the kernel takes.
    """

    kernel: Any
    table: Table
    parameters: Mapping[str, Any] = field(default_factory=dict)
    name: str = ""

    def __post_init__(self) -> None:
        if not self.name:
            object.__setattr__(self, "name", self.kernel.KERNEL.name)
        values = {**self.table.parameters, **self.parameters}
        missing, unknown = set(self.kernel.PARAMETERS) - set(values), set(self.parameters) - set(self.kernel.PARAMETERS)
        if missing or unknown:
            wrong = ", ".join(sorted(missing or unknown))
            raise ValueError(f"{self.name}: {'needs' if missing else 'has no'} parameter {wrong}")
        given = {name: np.asarray(values[name]) for name in self.kernel.PARAMETERS}
        try:
            parameters_of(self.kernel.KERNEL, given, self.table.count, float)
        except (TypeError, ValueError) as error:
            raise type(error)(str(error).replace(self.kernel.KERNEL.name, self.name, 1)) from None
        object.__setattr__(self, "parameters", {name: value.astype(float) for name, value in given.items()})

    def some(self, part: Any) -> dict[str, Any]:
        """Parameters of some elements."""
        vectors = self.kernel.KERNEL.vectors
        return {k: v if np.ndim(v) == (k in vectors) else v[..., part] for k, v in self.parameters.items()}
