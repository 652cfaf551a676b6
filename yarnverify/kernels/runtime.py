"""What all generated kernels share: input checks, chunks, the unpacking of the Hessian. NumPy only.

Written by hand. The generated modules hold straight-line formulas and describe themselves to this one with a ``Kernel``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["CHUNK", "Array", "ArrayLike", "ElementError", "Errors", "Kernel", "unpack"]

Array = NDArray[Any]
Errors = Literal["raise", "mask"]
CHUNK = 8192  # elements at a time, so that temporaries stay in the cache


class ElementError(ValueError):
    """Elements at which a kernel has no value; ``elements`` holds their indices."""

    def __init__(self, message: str, elements: Array) -> None:
        super().__init__(message)
        self.elements = elements


@dataclass(frozen=True)
class Kernel:
    """A generated module as data.

    Attributes
    ----------
    name, dofs
        The energy, and the names of the rows of ``q``.
    parameters
        Name and whether it must not be negative.
    checks
        For each margin that ``margins`` gives: what needs it (``energy`` or ``derivatives``), and what a margin that is not
        positive means.
    energy, gradient, hessian, evaluate
        Straight-line code that fills ``E`` (n,), ``G`` (dof, n) and the packed upper triangle ``H`` (dof (dof+1)/2, n).
    margins
        Gives the margins, each (n,).
    active
        Gives what is positive where the energy acts; None where it always does.
    """

    name: str
    dofs: tuple[str, ...]
    parameters: tuple[tuple[str, bool], ...]
    checks: tuple[tuple[str, str], ...]
    energy: Callable[..., None]
    gradient: Callable[..., None]
    hessian: Callable[..., None]
    evaluate: Callable[..., None]
    margins: Callable[..., tuple[Array, ...]]
    active: Callable[..., Array] | None = None


def energy(kernel: Kernel, q: ArrayLike, parameters: Mapping[str, ArrayLike], errors: Errors) -> Array:
    """Energy of each element, (n,)."""
    return _run(kernel, kernel.energy, "E", q, parameters, errors)["E"]


def gradient(kernel: Kernel, q: ArrayLike, parameters: Mapping[str, ArrayLike], errors: Errors) -> Array:
    """Gradient of each element, (dof, n)."""
    return _run(kernel, kernel.gradient, "G", q, parameters, errors)["G"]


def hessian(kernel: Kernel, q: ArrayLike, parameters: Mapping[str, ArrayLike], errors: Errors) -> Array:
    """Hessian of each element, (dof, dof, n), exactly symmetric."""
    return unpack(_run(kernel, kernel.hessian, "H", q, parameters, errors)["H"], len(kernel.dofs))


def packed(
    kernel: Kernel, q: ArrayLike, parameters: Mapping[str, ArrayLike], errors: Errors
) -> tuple[Array, Array, Array]:
    """Energy (n,), gradient (dof, n) and the upper triangle of the Hessian row by row (dof (dof+1)/2, n)."""
    out = _run(kernel, kernel.evaluate, "EGH", q, parameters, errors)
    return out["E"], out["G"], out["H"]


def evaluate(
    kernel: Kernel, q: ArrayLike, parameters: Mapping[str, ArrayLike], errors: Errors
) -> tuple[Array, Array, Array]:
    """Energy (n,), gradient (dof, n) and Hessian (dof, dof, n)."""
    e, g, h = packed(kernel, q, parameters, errors)
    return e, g, unpack(h, len(kernel.dofs))


def unpack(upper: Array, dof: int) -> Array:
    """The full symmetric array (dof, dof, n) of a packed upper triangle (dof (dof+1)/2, n)."""
    full = np.empty((dof, dof, upper.shape[1]), upper.dtype)
    at = 0
    for i in range(dof):
        for j in range(i, dof):
            full[i, j] = upper[at]
            full[j, i] = upper[at]
            at += 1
    return full


def _run(
    kernel: Kernel,
    fill: Callable[..., None],
    outputs: str,
    q: ArrayLike,
    parameters: Mapping[str, ArrayLike],
    errors: Errors,
) -> dict[str, Array]:
    if errors not in ("raise", "mask"):
        raise ValueError(f"errors must be 'raise' or 'mask', not {errors!r}")
    rows = _rows(kernel, q)
    dof, n = rows.shape
    values = _parameters(kernel, parameters, n, rows.dtype)
    shapes = {"E": (n,), "G": (dof, n), "H": (dof * (dof + 1) // 2, n)}
    out = {key: np.zeros(shapes[key], rows.dtype) for key in outputs}

    with np.errstate(all="ignore"):  # whatever is not finite is found and named below
        bad, reasons = _unfit(kernel, rows, values, outputs)
        good = ~bad
        if kernel.active is not None:
            good &= kernel.active(rows, *values) > 0
        whole = bool(good.all())
        picked = None if whole else np.flatnonzero(good)
        for start in range(0, n if picked is None else picked.size, CHUNK):
            where: Any = slice(start, min(start + CHUNK, n)) if picked is None else picked[start : start + CHUNK]
            _fill(fill, outputs, out, rows, values, where)

    finite = np.ones(n, bool)
    for array in out.values():
        finite &= np.isfinite(array).all(axis=tuple(range(array.ndim - 1)))
    overflow = good & ~finite
    if overflow.any():
        for element in np.flatnonzero(overflow):
            reasons.setdefault(
                int(element),
                "the result is not finite: an intermediate value is outside the range of " + str(rows.dtype),
            )
        bad |= overflow
    if bad.any():
        if errors == "raise":
            _complain(kernel, bad, reasons)
        for array in out.values():
            array[..., bad] = np.nan
    return out


def _fill(
    fill: Callable[..., None], outputs: str, out: dict[str, Array], rows: Array, values: tuple[Any, ...], where: Any
) -> None:
    """Evaluate some elements into the output arrays; a slice is filled in place, an index array through a copy."""
    chosen = tuple(value if np.ndim(value) == 0 else value[where] for value in values)
    if isinstance(where, slice):
        fill(rows[:, where], *chosen, *(out[key][..., where] for key in outputs))
        return
    parts = {key: np.zeros((*out[key].shape[:-1], where.size), rows.dtype) for key in outputs}
    fill(rows[:, where], *chosen, *parts.values())
    for key, part in parts.items():
        out[key][..., where] = part


def _rows(kernel: Kernel, q: ArrayLike) -> Array:
    rows = np.asarray(q)
    if rows.dtype.kind in "iub":
        rows = rows.astype(np.float64)
    if rows.dtype not in (np.float32, np.float64):
        raise TypeError(f"{kernel.name}: q must be float32, float64 or integer, not {rows.dtype}")
    if rows.ndim != 2 or rows.shape[0] != len(kernel.dofs):
        raise ValueError(f"{kernel.name}: q must have shape ({len(kernel.dofs)}, n), not {rows.shape}")
    return rows


def _parameters(kernel: Kernel, given: Mapping[str, ArrayLike], n: int, dtype: Any) -> tuple[Any, ...]:
    values = []
    for name, positive in kernel.parameters:
        value = np.asarray(given[name])
        if value.dtype.kind not in "iubf":
            raise TypeError(f"{kernel.name}: {name} must be real, not {value.dtype}")
        if value.shape not in ((), (n,)):
            raise ValueError(f"{kernel.name}: {name} must be a number or have shape ({n},), not {value.shape}")
        wrong = ~np.isfinite(value) | (value < 0) if positive else ~np.isfinite(value)
        if wrong.any():
            at = f"[{int(np.flatnonzero(wrong)[0])}]" if value.ndim else ""
            worst = value[wrong][0] if value.ndim else value
            raise ValueError(
                f"{kernel.name}: {name}{at} = {worst} must be finite" + (" and not negative" if positive else "")
            )
        values.append(dtype.type(value) if value.ndim == 0 else value.astype(dtype))
    return tuple(values)


def _unfit(kernel: Kernel, rows: Array, values: tuple[Any, ...], outputs: str) -> tuple[Array, dict[int, str]]:
    """Elements that cannot be evaluated, and why the first of each kind cannot."""
    n = rows.shape[1]
    bad = np.zeros(n, bool)
    reasons: dict[int, str] = {}

    def mark(wrong: Array, reason: str) -> None:
        fresh = np.flatnonzero(wrong & ~bad)
        reasons.update((int(element), reason) for element in fresh)
        bad[fresh] = True

    for label, row in zip(kernel.dofs, rows, strict=True):
        wrong = ~np.isfinite(row)
        if wrong.any():
            for value in ("nan", "inf", "-inf"):
                mark(np.isnan(row) if value == "nan" else row == float(value), f"{label} is {value}")
    for (needed_by, reason), margin in zip(kernel.checks, kernel.margins(rows, *values), strict=True):
        if needed_by == "energy" or outputs != "E":
            wrong = ~np.broadcast_to(margin > 0, (n,))
            if wrong.any():
                mark(wrong, reason)
    return bad, reasons


def _complain(kernel: Kernel, bad: Array, reasons: Mapping[int, str]) -> None:
    elements = np.flatnonzero(bad)
    first = int(elements[0])
    more = f" (and {elements.size - 1} more)" if elements.size > 1 else ""
    raise ElementError(f"{kernel.name}: element {first}: {reasons[first]}{more}", elements)
