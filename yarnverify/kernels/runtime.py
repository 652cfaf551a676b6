"""What a generated kernel is, as data, and the public functions that all kernels share. NumPy only.

Written by hand. A generated module describes itself with a ``Kernel``: one or two straight-line functions of scalars, and
what their margins mean; ``batch`` runs it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from yarnverify.kernels.batch import CHUNK, MOST_FACTORS, Batch, upper
from yarnverify.kernels.inputs import Array, ElementError, Engine, Errors, Out, Values
from yarnverify.kernels.tape import Tape, record
from yarnverify.kernels.words import Number, number

__all__ = [
    "CHUNK", "Array", "ArrayLike", "ElementError", "Errors", "Kernel", "Options", "Out", "Shape", "Unpack", "unpack",
]  # fmt: skip


class Options(TypedDict, total=False):
    """Options of every public function.

    Attributes
    ----------
    errors
        ``raise``, or ``mask`` for NaN where an element has no value.
    out
        Arrays to write the results to, of their shapes and dtype.
    threads
        Number of threads that share a large batch. Those of the compiled engine run beside each other; those of NumPy meet at
        the interpreter's lock between any two calls and gain much less.
    engine
        ``numpy``, or ``compiled`` for one fused loop by numba, with the same bits.
    """

    errors: Errors
    out: Out
    threads: int
    engine: Engine


@dataclass(frozen=True)
class Shape:
    """One straight-line form of a kernel.

    Attributes
    ----------
    function
        ``function(q, p) -> (energy, gradient, hessian, margins, choice)`` on scalars; ``hessian`` is the upper triangle row
        by row; ``choice`` is empty, or one number that is positive where this shape is the right one.
    checks
        For each margin, what needs it (``energy`` or ``derivatives``), and what a margin that is not positive means.
    """

    function: Callable[[Sequence[Any], Sequence[Any]], tuple[Any, Any, Any, Any, Any]]
    checks: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Kernel:
    """A generated module as data.

    Attributes
    ----------
    name, dofs
        The energy, and the names of the rows of ``q``.
    parameters
        Name, and whether it must not be negative; of a vector the name of each component, such as ``g_x``.
    vectors
        Names of the parameters with three components.
    shapes
        The forms; where the first has a choice and is not the right one, the second is, or the energy is zero if there is none.
    portable
        Whether only correctly rounded operations are used, so that bits are the same everywhere.
    numbers
        ``float``; ``words`` for sums whose terms have more digits than they themselves need; or ``double-double`` for
        arithmetic in pairs that is rounded once at the end.
    factors
        The largest number of lengths, coordinates and parameters in a product: the more there are, the smaller the sizes of
        which a power might not fit.
    even
        Where the energy is smooth though its only length is zero, as a law of the square of a length is: the first rows of its
        two ends.
    rates
        Whether some rows are velocities.
    promise
        How large errors are, where the variant does not say it: a few ``units`` in the last place, no more than the
        ``condition`` of the state explains, or ``none`` for formulas that lose digits near singular states.
    """

    name: str
    dofs: tuple[str, ...]
    parameters: tuple[tuple[str, bool], ...]
    shapes: tuple[Shape, ...]
    vectors: tuple[str, ...] = ()
    portable: bool = True
    numbers: Literal["float", "words", "double-double"] = "float"
    promise: Literal["units", "condition", "none"] = "units"
    factors: int = MOST_FACTORS
    even: tuple[int, int] | None = None
    rates: bool = False
    loops: dict[Any, Any] = field(default_factory=dict, compare=False, repr=False)  # compiled ones, as they are made
    _tapes: dict[Any, Tape] = field(default_factory=dict, compare=False, repr=False)

    def outputs(self, shape: int, wanted: str) -> Callable[[Sequence[Any]], list[Any]]:
        """The function of one shape with its results in a row: what is wanted, margins, choice."""
        dof = len(self.dofs)

        def function(scalars: Sequence[Any]) -> list[Any]:
            given = [number(value) for value in scalars] if self.numbers == "words" else scalars
            energy, gradient, hessian, margins, choice = self.shapes[shape].function(given[:dof], given[dof:])
            parts = {"E": (energy,), "G": gradient, "H": hessian}
            found = [value for key in wanted for value in parts[key]] + [*margins, *choice]
            return [value.rounded if isinstance(value, Number) else value for value in found]

        return function

    def tape(self, shape: int, wanted: str, dtype: Any) -> Tape:
        """The recorded form of one shape; recorded once."""
        key = (shape, wanted, np.dtype(dtype))
        if key not in self._tapes:
            self._tapes[key] = record(self.outputs(shape, wanted), len(self.dofs) + len(self.parameters), dtype)
        return self._tapes[key]


# -- public functions of a kernel -------------------------------------------------------------------------------------


def energy(kernel: Kernel, q: ArrayLike, parameters: Values, **options: Unpack[Options]) -> Array:
    """Energy of each element, (n,)."""
    return Batch(kernel, "E", q, parameters, **options).results()[0]


def gradient(kernel: Kernel, q: ArrayLike, parameters: Values, **options: Unpack[Options]) -> Array:
    """Gradient of each element, (dof, n)."""
    return Batch(kernel, "G", q, parameters, **options).results()[0]


def hessian(kernel: Kernel, q: ArrayLike, parameters: Values, **options: Unpack[Options]) -> Array:
    """Hessian of each element, (dof, dof, n), exactly symmetric."""
    return Batch(kernel, "H", q, parameters, full=True, **options).results()[0]


def evaluate(
    kernel: Kernel, q: ArrayLike, parameters: Values, **options: Unpack[Options]
) -> tuple[Array, Array, Array]:
    """Energy (n,), gradient (dof, n) and Hessian (dof, dof, n)."""
    e, g, h = Batch(kernel, "EGH", q, parameters, full=True, **options).results()
    return e, g, h


def packed(kernel: Kernel, q: ArrayLike, parameters: Values, **options: Unpack[Options]) -> tuple[Array, Array, Array]:
    """Energy (n,), gradient (dof, n) and the upper triangle of the Hessian row by row (dof (dof+1)/2, n)."""
    e, g, h = Batch(kernel, "EGH", q, parameters, **options).results()
    return e, g, h


def unpack(packed_upper: Array, dof: int) -> Array:
    """The full symmetric array (dof, dof, n) of a packed upper triangle (dof (dof+1)/2, n)."""
    full = np.empty((dof, dof, packed_upper.shape[1]), packed_upper.dtype)
    for row, (i, j) in zip(packed_upper, upper(dof), strict=True):
        full[i, j] = row
        full[j, i] = row
    return full
