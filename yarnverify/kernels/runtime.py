"""What all generated kernels share: input checks, chunks, the choice of a shape, and errors that name the element. NumPy only.

Written by hand. A generated module describes itself with a ``Kernel``: one or two straight-line functions of scalars, and
what their margins mean. Nearly all elements go through the first function a chunk at a time; the few that need something
else (another shape, a scale far from 1, an error) are taken out by looking at the margins and are done on their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import pairwise
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.kernels.tape import Tape, record

__all__ = ["CHUNK", "Array", "ArrayLike", "ElementError", "Errors", "Kernel", "Out", "Shape", "unpack"]

Array = NDArray[Any]
Errors = Literal["raise", "mask"]
Engine = Literal["numpy", "compiled"]
Out: TypeAlias = Array | Sequence[Array] | None
CHUNK = 8192  # elements at a time, so that scratch memory stays in the cache

# Lengths, sines and parameters within these powers of two can neither overflow nor underflow in any product that occurs.
_MODERATE = {np.dtype(np.float64): 2.0**100, np.dtype(np.float32): 2.0**14}


class ElementError(ValueError):
    """Elements at which a kernel has no value; ``elements`` holds their indices."""

    def __init__(self, message: str, elements: Array) -> None:
        super().__init__(message)
        self.elements = elements


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
        Name, whether it must not be negative, and its power of length (scaling all lengths scales it so).
    shapes
        The forms; where the first has a choice and is not the right one, the second is, or the energy is zero if there is none.
    scaling
        Which rows a change of scale touches: ``points`` for an energy of angles alone, else ``lengths``.
    portable
        Whether only correctly rounded operations are used, so that bits are the same everywhere.
    numbers
        ``float``, or ``double-double`` for arithmetic in pairs that is rounded once at the end.
    """

    name: str
    dofs: tuple[str, ...]
    parameters: tuple[tuple[str, bool, int], ...]
    shapes: tuple[Shape, ...]
    scaling: Literal["points", "lengths"] = "lengths"
    portable: bool = True
    numbers: Literal["float", "double-double"] = "float"
    _tapes: dict[Any, Any] = field(default_factory=dict, compare=False, repr=False)

    @cached_property
    def points(self) -> tuple[int, ...]:
        """Rows that belong to points."""
        return tuple(i for i, label in enumerate(self.dofs) if "." in label)

    def outputs(self, shape: int, wanted: str) -> Callable[[Sequence[Any]], list[Any]]:
        """The function of one shape with its results in a row: what is wanted, margins, choice."""
        dof = len(self.dofs)

        def function(scalars: Sequence[Any]) -> list[Any]:
            energy, gradient, hessian, margins, choice = self.shapes[shape].function(scalars[:dof], scalars[dof:])
            parts = {"E": (energy,), "G": gradient, "H": hessian}
            return [value for key in wanted for value in parts[key]] + [*margins, *choice]

        return function

    def tape(self, shape: int, wanted: str, dtype: Any) -> Tape:
        """The recorded form of one shape; recorded once."""
        key = (shape, wanted, np.dtype(dtype))
        if key not in self._tapes:
            self._tapes[key] = record(self.outputs(shape, wanted), len(self.dofs) + len(self.parameters), dtype)
        return self._tapes[key]


# -- public functions of a kernel -------------------------------------------------------------------------------------

Values = Mapping[str, ArrayLike]


def energy(kernel: Kernel, q: ArrayLike, parameters: Values, **options: Any) -> Array:
    """Energy of each element, (n,)."""
    return _Run(kernel, "E", q, parameters, **options).results()[0]


def gradient(kernel: Kernel, q: ArrayLike, parameters: Values, **options: Any) -> Array:
    """Gradient of each element, (dof, n)."""
    return _Run(kernel, "G", q, parameters, **options).results()[0]


def hessian(kernel: Kernel, q: ArrayLike, parameters: Values, **options: Any) -> Array:
    """Hessian of each element, (dof, dof, n), exactly symmetric."""
    return _Run(kernel, "H", q, parameters, full=True, **options).results()[0]


def evaluate(kernel: Kernel, q: ArrayLike, parameters: Values, **options: Any) -> tuple[Array, Array, Array]:
    """Energy (n,), gradient (dof, n) and Hessian (dof, dof, n)."""
    e, g, h = _Run(kernel, "EGH", q, parameters, full=True, **options).results()
    return e, g, h


def packed(kernel: Kernel, q: ArrayLike, parameters: Values, **options: Any) -> tuple[Array, Array, Array]:
    """Energy (n,), gradient (dof, n) and the upper triangle of the Hessian row by row (dof (dof+1)/2, n)."""
    e, g, h = _Run(kernel, "EGH", q, parameters, **options).results()
    return e, g, h


def unpack(upper: Array, dof: int) -> Array:
    """The full symmetric array (dof, dof, n) of a packed upper triangle (dof (dof+1)/2, n)."""
    full = np.empty((dof, dof, upper.shape[1]), upper.dtype)
    for row, (i, j) in zip(upper, _upper(dof), strict=True):
        full[i, j] = row
        full[j, i] = row
    return full


@cache
def _square(dof: int) -> Array:
    """Where each entry of a symmetric matrix stands in its packed upper triangle, (dof, dof)."""
    places = np.zeros((dof, dof), int)
    for at, (i, j) in enumerate(_upper(dof)):
        places[i, j] = places[j, i] = at
    return places


@cache
def _upper(dof: int) -> list[tuple[int, int]]:
    return [(i, j) for i in range(dof) for j in range(i, dof)]


_Evaluator: TypeAlias = Callable[[list[Array], list[Any], list[Array]], tuple[Array, Array]]


# -- one call ---------------------------------------------------------------------------------------------------------


class _Run:
    """One call of a kernel: its checked inputs, its outputs, and the elements found bad so far."""

    def __init__(
        self,
        kernel: Kernel,
        wanted: str,
        q: ArrayLike,
        parameters: Values,
        *,
        full: bool = False,
        errors: Errors = "raise",
        out: Out = None,
        threads: int = 1,
        engine: Engine = "numpy",
    ) -> None:
        if errors not in ("raise", "mask"):
            raise ValueError(f"errors must be 'raise' or 'mask', not {errors!r}")
        if engine not in ("numpy", "compiled"):
            raise ValueError(f"engine must be 'numpy' or 'compiled', not {engine!r}")
        if not isinstance(threads, int) or threads < 1:
            raise ValueError(f"threads must be a positive integer, not {threads!r}")
        self.kernel, self.wanted, self.full, self.errors = kernel, wanted, full, errors
        self.rows = _rows(kernel, q)
        self.dof, self.n = self.rows.shape
        self.dtype = self.rows.dtype
        self.values = _parameters(kernel, parameters, self.n, self.dtype)
        self.limit = _MODERATE[self.dtype]
        self.watch = any(not _moderate(value, self.limit) for value in self.values)
        self.threads, self.engine = threads, engine
        self.out = self._allocate(out)
        self.reasons: dict[int, str] = {}

    def _allocate(self, out: Out) -> list[Array]:
        dof, n = self.dof, self.n
        shapes = {"E": (n,), "G": (dof, n), "H": (dof, dof, n) if self.full else (dof * (dof + 1) // 2, n)}
        wanted = [shapes[key] for key in self.wanted]
        if out is None:
            return [np.empty(shape, self.dtype) for shape in wanted]
        given: list[Array] = [out] if isinstance(out, np.ndarray) else list(out)
        if [(a.shape, a.dtype) for a in given] != [(shape, self.dtype) for shape in wanted]:
            raise ValueError(f"{self.kernel.name}: out must be {self.dtype} arrays of shapes {wanted}")
        return given

    def results(self) -> list[Array]:
        if self.n:
            with np.errstate(all="ignore"):  # whatever is not finite is found and named below
                if self.n > 1 or not self._single():
                    self._chunks()
        if self.reasons:
            elements = np.array(sorted(self.reasons))
            if self.errors == "raise":
                _complain(self.kernel, elements, self.reasons)
            for array in self.out:
                array[..., elements] = np.nan
        return self.out

    # -- where results go

    def _targets(self, where: slice) -> list[Array]:
        """A row for each output scalar of a range of elements."""
        targets: list[Array] = []
        for key, array in zip(self.wanted, self.out, strict=True):
            if key == "E":
                targets.append(array[where])
            elif key == "H" and self.full:
                targets += [array[i, j, where] for i, j in _upper(self.dof)]
            else:
                targets += list(array[:, where])
        return targets

    def _mirror(self, where: Any) -> None:
        if self.full:
            hessian = self.out[-1]
            for i, j in _upper(self.dof):
                if i != j:
                    hessian[j, i, where] = hessian[i, j, where]

    # -- the three ways

    def _single(self) -> bool:
        """A batch of one in Python floats, which cost less than arrays of one element; False where it needs more care."""
        kernel = self.kernel
        if (
            not kernel.portable
            or kernel.numbers != "float"
            or self.dtype != np.float64
            or self.watch
            or self.engine != "numpy"
        ):
            return False
        inputs = [float(v) + 0.0 for v in self.rows[:, 0]] + [float(np.reshape(v, -1)[0]) for v in self.values]
        try:
            found = kernel.tape(0, self.wanted, self.dtype).run_one(inputs)
        except (ArithmeticError, ValueError):
            return False
        sizes = {"E": 1, "G": self.dof, "H": self.dof * (self.dof + 1) // 2}
        rest = found[sum(sizes[key] for key in self.wanted) :]
        margins = rest[: len(kernel.shapes[0].checks)]
        if not all(1 / self.limit < m < self.limit for m in margins):
            return False
        if not all(0 < c < math.inf for c in rest[len(margins) :]):
            return False
        at = 0
        for key, array in zip(self.wanted, self.out, strict=True):
            part = found[at : at + sizes[key]]
            at += sizes[key]
            array[..., 0] = part[0] if key == "E" else np.array(part)[_square(self.dof)] if array.ndim == 3 else part
        return True

    def _chunks(self) -> None:
        starts = [*range(0, self.n, CHUNK), self.n]
        ranges = [slice(a, b) for a, b in pairwise(starts)]
        if self.threads == 1 or len(ranges) == 1:
            self._some(ranges)
            return
        with ThreadPoolExecutor(self.threads) as pool:
            shares = [ranges[i :: self.threads] for i in range(self.threads)]
            for done in [pool.submit(self._some, share) for share in shares]:
                done.result()

    def _some(self, ranges: list[slice]) -> None:
        """The chunks of one thread: all in the first shape, then those of the second, then those that need care."""
        with np.errstate(all="ignore"):  # per thread
            work = _Workspace(self, min(CHUNK, self.n))
            later: list[Array] = []
            strange: list[Array] = []
            for where in ranges:
                values = [value if np.ndim(value) == 0 else value[where] for value in self.values]
                targets = self._targets(where)
                rows = np.add(self.rows[:, where], 0.0, out=work.inputs[:, : where.stop - where.start])  # -0.0 is 0.0
                margins, choice = work.first(list(rows), values, targets)
                self._mirror(where)
                odd = self._strange(margins, targets)
                if choice.size and not np.isfinite(choice).all():
                    odd = ~np.isfinite(choice[0]) if odd is None else odd | ~np.isfinite(choice[0])
                if odd is not None:
                    strange.append(where.start + np.flatnonzero(odd))
                if choice.size and not choice.min() > 0:
                    other = ~(choice[0] > 0)
                    later.append(where.start + np.flatnonzero(other if odd is None else other & ~odd))
                    if (
                        sum(at.size for at in later) > CHUNK // 2
                    ):  # enough for one call, and its results still in the cache
                        strange += self._second_all(later, work)
                        later.clear()
            strange += self._second_all(later, work)
            for at in _groups(strange):
                self._special(at)

    def _second_all(self, later: list[Array], work: _Workspace) -> list[Array]:
        """Evaluate elements in the second shape; those of them that need more care."""
        odd = [(at, self._second(at, work)) for at in _groups(later)]
        return [at[strange] for at, strange in odd if strange is not None]

    def _strange(self, margins: Array, targets: list[Array]) -> Array | None:
        """Elements that are not as tame as nearly all are; None if there are none."""
        low = 1 / self.limit
        if self.watch or not margins.size:
            strange = ~_finite(targets)
            strange |= ~((margins > low) & (margins < self.limit)).all(axis=0)
            return np.asarray(strange) if strange.any() else None
        if margins.min() > low and margins.max() < self.limit:
            return None
        return np.asarray(~((margins > low) & (margins < self.limit)).all(axis=0))

    def _second(self, at: Array, work: _Workspace) -> Array | None:
        """Evaluate elements in the second shape, or set them to zero; which of them are strange."""
        part = work.part[:, : at.size]
        if len(self.kernel.shapes) == 1:
            part[:] = 0
            self._scatter(at, part)
            return None
        values = [value if np.ndim(value) == 0 else value[at] for value in self.values]
        margins, _ = work.second(list(self.rows.take(at, axis=1) + 0.0), values, list(part))
        self._scatter(at, part)
        return self._strange(margins, list(part))

    def _scatter(self, at: Array, part: Array) -> None:
        """Write results of chosen elements, a row of ``part`` for each output scalar."""
        for target, row in zip(self._targets(slice(None)), part, strict=True):
            target[at] = row
        if self.full:
            hessian, rows = self.out[-1], part[-len(_upper(self.dof)) :]
            for (i, j), row in zip(_upper(self.dof), rows, strict=True):
                hessian[j, i, at] = row

    def evaluator(self, shape: int, most: int) -> _Evaluator:
        """A function that fills targets with the outputs of a shape, and gives margins and choice as rows."""
        kernel, checks = self.kernel, len(self.kernel.shapes[shape].checks)
        if kernel.numbers == "double-double":
            from yarnverify.kernels.doubledouble import evaluator

            extra = evaluator(kernel.outputs(shape, self.wanted))
        elif self.engine == "compiled":
            from yarnverify.kernels.compiled import evaluator as compiled

            extra = compiled(kernel, shape, self.wanted, self.dtype, most)
        else:
            tape = kernel.tape(shape, self.wanted, self.dtype)
            scratch = np.empty((tape.scratch, most), self.dtype)
            spare = np.empty((tape.outputs, most), self.dtype)

            def extra(rows: list[Array], values: list[Any], targets: list[Array]) -> Array:
                m = rows[0].size
                rest = spare[len(targets) :, :m]
                tape.run([*rows, *values], [*targets, *rest], scratch[:, :m])
                return rest

        def run(rows: list[Array], values: list[Any], targets: list[Array]) -> tuple[Array, Array]:
            rest = extra(rows, values, targets)
            return rest[:checks], rest[checks:]

        return run

    # -- elements that need care

    def _special(self, elements: Array) -> None:
        """Evaluate a few elements again, at a scale near 1, or find out why they have no value."""
        kernel = self.kernel
        rows = self.rows.take(elements, axis=1) + 0.0
        values = [value if np.ndim(value) == 0 else value[elements] for value in self.values]
        reasons = np.full(elements.size, "", dtype=object)
        for label, row in zip(kernel.dofs, rows, strict=True):
            for text, wrong in (("nan", np.isnan(row)), ("inf", row == np.inf), ("-inf", row == -np.inf)):
                reasons[wrong & (reasons == "")] = f"{label} is {text}"
        rows = np.where(np.isfinite(rows), rows, 0)
        exponent = self._exponents(rows)
        rows, values = self._scaled(rows, values, exponent)
        found = np.empty((len(self._targets(slice(0, 0))), elements.size), self.dtype)
        margins, choice = self._again(0, np.arange(elements.size), rows, values, found)
        other = ~(choice[0] > 0) if choice.size else np.zeros(elements.size, bool)
        self._refuse(0, margins, other, reasons, only="energy")  # derivatives are the other shape's affair
        self._refuse(0, margins, ~other, reasons)
        other &= reasons == ""
        if other.any() and len(kernel.shapes) == 1:
            found[:, other] = 0
        elif other.any():
            second, _ = self._again(1, np.flatnonzero(other), rows, values, found)
            everywhere = np.ones((len(second), elements.size), self.dtype)
            everywhere[:, other] = second
            self._refuse(1, everywhere, other, reasons)
        self._unscale(found, exponent)
        bad = ~np.isfinite(found).all(axis=0) & (reasons == "")
        reasons[bad] = f"the result is not finite: an intermediate value is outside the range of {self.dtype}"
        self._scatter(elements, found)
        self.reasons.update((int(elements[i]), str(reasons[i])) for i in np.flatnonzero(reasons != ""))

    def _again(self, shape: int, picked: Any, rows: Array, values: list[Any], found: Array) -> tuple[Array, Array]:
        """Evaluate chosen columns by a shape into ``found``."""
        rows = rows[:, picked]
        values = [value if np.ndim(value) == 0 else value[picked] for value in values]
        part = np.empty((found.shape[0], rows.shape[1]), self.dtype)
        run = self.evaluator(shape, rows.shape[1])
        margins, choice = run(list(rows), values, list(part))
        found[:, picked] = part
        return margins, choice

    def _refuse(self, shape: int, margins: Array, mine: Array, reasons: Array, only: str = "") -> None:
        """Give the reason of each margin that is not positive, of what is wanted or of ``only`` one kind."""
        for (needed_by, reason), margin in zip(self.kernel.shapes[shape].checks, margins, strict=True):
            if needed_by == "energy" or (self.wanted != "E" and not only):
                reasons[mine & ~(margin > 0) & (reasons == "")] = reason

    # -- scale

    def _exponents(self, rows: Array) -> Array:
        """For each element the power of two to divide lengths by; 0 where they are moderate as they are.

        Where only angles count, edges are made so long that their products with the smallest number do not underflow.
        """
        kernel = self.kernel
        if not kernel.points or not kernel.portable:
            return np.zeros(rows.shape[1], int)
        points = rows[list(kernel.points)].reshape(-1, 3, rows.shape[1])
        spans = np.abs(points[1:] - points[:1]).max(axis=1)
        span = spans.max(axis=0)
        most = int(math.log2(self.limit))
        if kernel.scaling == "points":
            span = np.where(spans > 0, spans, np.inf).min(axis=0)
        exponent = np.where(np.isfinite(span) & (span > 0), np.frexp(span)[1], 0)
        if kernel.scaling == "points":
            return exponent - 2
        return np.where(np.abs(exponent) > most // 2, exponent, 0)

    def _scaled(self, rows: Array, values: list[Any], exponent: Array) -> tuple[Array, list[Any]]:
        if not exponent.any():
            return rows, values
        every = list(range(self.dof)) if self.kernel.scaling == "lengths" else list(self.kernel.points)
        rows = rows.copy()
        rows[every] = np.ldexp(rows[every], -exponent)
        if self.kernel.scaling == "lengths":
            powers = [power for _, _, power in self.kernel.parameters]
            values = [np.ldexp(v, -p * exponent) if p else v for v, p in zip(values, powers, strict=True)]
        return rows, values

    def _unscale(self, found: Array, exponent: Array) -> None:
        """Energies scale like a length where all lengths were scaled, and not at all where only points were."""
        if not exponent.any():
            return
        touched = set(range(self.dof)) if self.kernel.scaling == "lengths" else set(self.kernel.points)
        whole = int(self.kernel.scaling == "lengths")
        at = 0
        for key in self.wanted:
            if key == "E":
                powers = [whole]
            elif key == "G":
                powers = [whole - (i in touched) for i in range(self.dof)]
            else:
                powers = [whole - (i in touched) - (j in touched) for i, j in _upper(self.dof)]
            for power in powers:
                if power:
                    found[at] = np.ldexp(found[at], power * exponent)
                at += 1


class _Workspace:
    """Scratch memory of one thread, kept from chunk to chunk: fresh memory costs more than the arithmetic on it."""

    def __init__(self, run: _Run, most: int) -> None:
        self._run, self._most = run, most

    @cached_property
    def inputs(self) -> Array:
        """A chunk of the rows of ``q``."""
        return np.empty((self._run.dof, self._most), self._run.dtype)

    @cached_property
    def first(self) -> _Evaluator:
        return self._run.evaluator(0, self._most)

    @cached_property
    def second(self) -> _Evaluator:
        return self._run.evaluator(1, self._most)

    @cached_property
    def part(self) -> Array:
        """Results of the second shape, before they go where they belong."""
        return np.empty((len(self._run._targets(slice(0, 0))), self._most), self._run.dtype)


def _groups(found: list[Array]) -> list[Array]:
    """Indices in groups of at most a chunk."""
    every = np.concatenate(found) if found else np.empty(0, int)
    return [every[i : i + CHUNK] for i in range(0, every.size, CHUNK)]


def _finite(targets: list[Array]) -> Array:
    finite = np.isfinite(targets[0])
    for target in targets[1:]:
        finite &= np.isfinite(target)
    return finite


def _moderate(value: Any, limit: float) -> bool:
    size = np.abs(value)
    return bool(((size == 0) | ((size > 1 / limit) & (size < limit))).all())


# -- inputs -----------------------------------------------------------------------------------------------------------


def _rows(kernel: Kernel, q: ArrayLike) -> Array:
    rows = np.asarray(q)
    if rows.dtype.kind in "iub":
        rows = rows.astype(np.float64)
    if rows.dtype.kind == "f" and not rows.dtype.isnative:
        rows = rows.astype(rows.dtype.newbyteorder("="))
    if rows.dtype not in (np.float32, np.float64):
        raise TypeError(f"{kernel.name}: q must be float32, float64 or integer, not {rows.dtype}")
    if rows.ndim != 2 or rows.shape[0] != len(kernel.dofs):
        raise ValueError(f"{kernel.name}: q must have shape ({len(kernel.dofs)}, n), not {rows.shape}")
    return rows


def _parameters(kernel: Kernel, given: Values, n: int, dtype: Any) -> tuple[Any, ...]:
    values = []
    for name, positive, _ in kernel.parameters:
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
        values.append(value.astype(dtype))
    return tuple(values)


def _complain(kernel: Kernel, elements: Array, reasons: Mapping[int, str]) -> None:
    first = int(elements[0])
    more = f" (and {elements.size - 1} more)" if elements.size > 1 else ""
    raise ElementError(f"{kernel.name}: element {first}: {reasons[first]}{more}", elements)
