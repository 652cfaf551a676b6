"""The few elements of a batch that are not as tame as nearly all are: in numbers that hold them, or why they have no value."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from yarnverify.kernels.inputs import Array
from yarnverify.kernels.wide import rounded, run_wide, serves

if TYPE_CHECKING:
    from yarnverify.kernels.batch import Batch

_HAIR = 2.0**-600  # a length whose square is nothing beside any number of double precision


class Special:
    """Chosen elements of a batch, their results so far, (outputs, m), and the reasons of those that have none."""

    def __init__(self, batch: Batch, elements: Array) -> None:
        self._batch, self._elements = batch, elements
        rows = batch.rows.take(elements, axis=1) + 0.0
        self._reasons = np.full(elements.size, "", dtype=object)
        for label, row in zip(batch.kernel.dofs, rows, strict=True):
            for text, wrong in (("nan", np.isnan(row)), ("inf", row == np.inf), ("-inf", row == -np.inf)):
                self._reasons[wrong & (self._reasons == "")] = f"{label} is {text}"
        self._rows, self._values = np.where(np.isfinite(rows), rows, 0), batch.values_at(elements)
        self._found = np.empty((batch.count, elements.size), batch.dtype)
        self._met = self._parted()

    def settle(self) -> None:
        """Give the batch their results, and the reasons of those without."""
        batch, reasons = self._batch, self._reasons
        if batch.kernel.portable and batch.dtype == np.float32 and batch.kernel.numbers != "double-double":
            self._in_double()
        else:
            self._by_shapes()
        if self._met.any():  # every direction is as good as the one that they were parted in
            start = int("E" in batch.wanted)
            self._found[start : start + batch.dof * ("G" in batch.wanted), self._met] = 0
        bad = ~np.isfinite(self._found).all(axis=0) & (reasons == "")
        reasons[bad] = f"the result is not finite: it or a value on the way is outside the range of {batch.dtype}"
        batch.scatter(self._elements, self._found)
        batch.reasons.update((int(self._elements[i]), str(reasons[i])) for i in np.flatnonzero(reasons != ""))

    def _parted(self) -> Array:
        """Which elements of an even law have no length; their ends are moved apart by next to nothing."""
        even, rows = self._batch.kernel.even, self._rows
        if even is None or self._batch.dtype != np.float64:  # single precision's are evaluated in double
            return np.zeros(self._elements.size, bool)
        first, second = even
        met: Array = (rows[first : first + 3] == rows[second : second + 3]).all(axis=0) & (self._reasons == "")
        rows[first : first + 3, met] = rows[second : second + 3, met] = 0
        rows[first, met] = _HAIR
        return met

    def _in_double(self) -> None:
        """Single precision's elements in double precision, whose range holds their products."""
        kernel = self._batch.kernel
        wider = np.broadcast_arrays(*[np.asarray(value, np.float64) for value in self._values])
        given: dict[str, Any] = dict(zip((name for name, _ in kernel.parameters), wider, strict=True))
        for vector in kernel.vectors:
            given[vector] = np.array([given.pop(f"{vector}_{axis}") for axis in "xyz"])
        double = type(self._batch)(kernel, self._batch.wanted, self._rows.astype(np.float64), given, errors="mask")
        self._found[:] = np.vstack(double.results())
        for element, reason in double.reasons.items():
            if not reason.startswith("the result") and not self._reasons[element]:
                self._reasons[element] = reason

    def _by_shapes(self) -> None:
        """Elements of any size, each by the shape that is right for it."""
        size = self._elements.size
        margins, choice = self._by_shape(0, np.arange(size))
        other = ~(choice[0] > 0) if choice.size else np.zeros(size, bool)
        zero = other & (choice[0] <= 0) if choice.size and len(self._batch.kernel.shapes) == 1 else ~np.ones(size, bool)
        self._refuse(0, margins, other & ~zero, only="energy")  # derivatives are the other shape's affair
        self._refuse(0, margins, ~other)
        other &= self._reasons == ""
        if other.any() and len(self._batch.kernel.shapes) == 1:
            self._found[:, other] = 0
        elif other.any():
            second, _ = self._by_shape(1, np.flatnonzero(other))
            everywhere = np.ones((len(second), size), self._batch.dtype)
            everywhere[:, other] = second
            self._refuse(1, everywhere, other)

    def _by_shape(self, shape: int, picked: Array) -> tuple[Array, Array]:
        """Evaluate some of the elements by a shape; of margins and choice the signs are right."""
        batch, kernel = self._batch, self._batch.kernel
        checks = len(kernel.shapes[shape].checks)
        rows = self._rows[:, picked]
        values = [value if np.ndim(value) == 0 else value[picked] for value in self._values]
        double = kernel.numbers != "double-double" and batch.dtype == np.float64
        if double and serves(tape := kernel.tape(shape, batch.wanted, batch.dtype)):
            numbers = run_wide(tape, [*rows, *values])
            for row, number in zip(self._found, numbers, strict=False):
                row[picked] = rounded(number)
            rest = np.empty((len(numbers) - batch.count, rows.shape[1]))
            for row, (mantissa, _) in zip(rest, numbers[batch.count :], strict=True):
                row[:] = mantissa
            return rest[:checks], rest[checks:]
        part = np.empty((batch.count, rows.shape[1]), batch.dtype)
        margins, choice, _ = batch.evaluator(shape)(rows, values, list(part))
        self._found[:, picked] = part
        return margins, choice

    def _refuse(self, shape: int, margins: Array, mine: Array, only: str = "") -> None:
        """Give the reason of each margin that is not positive, of what is wanted or of ``only`` one kind."""
        for (needed_by, reason), margin in zip(self._batch.kernel.shapes[shape].checks, margins, strict=True):
            if needed_by == "energy" or (self._batch.wanted != "E" and not only):
                self._reasons[mine & ~(margin > 0) & (self._reasons == "")] = reason
