"""What a kernel accepts, checked before anything is computed, and the error that names elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.kernels.memory import aligned

if TYPE_CHECKING:
    from yarnverify.kernels.runtime import Kernel

Array = NDArray[Any]
Errors = Literal["raise", "mask"]
Engine = Literal["numpy", "compiled"]
Out: TypeAlias = Array | Sequence[Array] | None
Values = Mapping[str, ArrayLike]


class ElementError(ValueError):
    """Elements at which a kernel has no value; ``elements`` holds their indices."""

    def __init__(self, message: str, elements: Array) -> None:
        super().__init__(message)
        self.elements = elements


def check_options(errors: str, threads: int, engine: str) -> None:
    """Refuse options that mean nothing."""
    if errors not in ("raise", "mask"):
        raise ValueError(f"errors must be 'raise' or 'mask', not {errors!r}")
    if engine not in ("numpy", "compiled"):
        raise ValueError(f"engine must be 'numpy' or 'compiled', not {engine!r}")
    if not isinstance(threads, int) or threads < 1:
        raise ValueError(f"threads must be a positive integer, not {threads!r}")


def rows_of(kernel: Kernel, q: ArrayLike) -> Array:
    rows = np.asarray(q)
    if rows.dtype.kind in "iub":
        rows = rows.astype(np.float64)
    if rows.dtype.kind == "f" and not rows.dtype.isnative:
        rows = rows.astype(rows.dtype.newbyteorder("="))
    if rows.dtype not in (np.float32, np.float64):
        raise TypeError(f"{kernel.name}: q must be float32, float64 or integer, not {rows.dtype}")
    if not rows.flags.aligned:
        rows = rows.copy()
    if rows.ndim != 2 or rows.shape[0] != len(kernel.dofs):
        raise ValueError(f"{kernel.name}: q must have shape ({len(kernel.dofs)}, n), not {rows.shape}")
    return rows


def parameters_of(kernel: Kernel, given: Values, n: int, dtype: Any) -> tuple[Any, ...]:
    values = []
    for name, positive in kernel.parameters:
        vector, _, axis = name.rpartition("_")
        value = (
            _component(kernel, vector, given[vector], axis, n) if vector in kernel.vectors else np.asarray(given[name])
        )
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
        values.append(value.astype(dtype))
    return tuple(values)


def _component(kernel: Kernel, name: str, given: ArrayLike, axis: str, n: int) -> Array:
    """One component of a vector parameter, whose first axis is that of the components."""
    value = np.asarray(given)
    if value.shape not in ((3,), (3, n)):
        raise ValueError(f"{kernel.name}: {name} must have shape (3,) or (3, {n}), not {value.shape}")
    found: Array = value["xyz".index(axis)]
    return found


def complain(kernel: Kernel, elements: Array, reasons: Mapping[int, str]) -> None:
    first = int(elements[0])
    more = f" (and {elements.size - 1} more)" if elements.size > 1 else ""
    raise ElementError(f"{kernel.name}: element {first}: {reasons[first]}{more}", elements)


def outputs_of(kernel: Kernel, shapes: Sequence[tuple[int, ...]], dtype: Any, out: Out) -> list[Array]:
    """Arrays for the results: the caller's, or new ones."""
    if out is None:
        return [aligned(shape, dtype) for shape in shapes]
    given: list[Array] = [out] if isinstance(out, np.ndarray) else list(out)
    if [(a.shape, a.dtype) for a in given] != [(shape, dtype) for shape in shapes]:
        raise ValueError(f"{kernel.name}: out must be {dtype} arrays of shapes {list(shapes)}")
    if not all(a.flags.writeable and a.flags.aligned for a in given):
        raise ValueError(f"{kernel.name}: out must be aligned arrays that can be written to")
    return given
