"""Straight-line scalar code as a tape of NumPy calls: the same text serves one element and a million.

A generated kernel is plain arithmetic on scalars. ``record`` runs it once with symbols instead of numbers and keeps what
it did as a list of ufunc calls: equal calls once, calls that no wanted output needs not at all, and intermediate values
in as few rows of scratch memory as possible, so that a chunk of elements stays in the cache (fresh arrays for every
intermediate value cost a third more time). Each operation is one correctly rounded IEEE operation, so the bits of an
element depend on nothing but its own numbers.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
_COMMUTE = {"add", "multiply", "maximum"}
_SMALLEST = {np.dtype(kind): float(np.finfo(kind).smallest_subnormal) for kind in (np.float64, np.float32)}
_SPLITTERS = {np.dtype(np.float64): 2.0**27 + 1, np.dtype(np.float32): 2.0**12 + 1}


class Traced:
    """A scalar of a kernel that is being recorded: a node, or its negative, which costs nothing."""

    __slots__ = ("negative", "number", "trace")
    __array_ufunc__ = None

    def __init__(self, trace: Trace, number: int, negative: bool = False) -> None:
        self.trace, self.number, self.negative = trace, number, negative

    def __add__(self, other: Any) -> Traced:
        return self.trace.add(self, other)

    def __radd__(self, other: Any) -> Traced:
        return self.trace.add(self.trace.lift(other), self)

    def __sub__(self, other: Any) -> Traced:
        return self.trace.add(self, -self.trace.lift(other))

    def __rsub__(self, other: Any) -> Traced:
        return self.trace.add(self.trace.lift(other), -self)

    def __mul__(self, other: Any) -> Traced:
        return self.trace.scale("multiply", self, other)

    def __rmul__(self, other: Any) -> Traced:
        return self.trace.scale("multiply", self.trace.lift(other), self)

    def __truediv__(self, other: Any) -> Traced:
        return self.trace.scale("divide", self, other)

    def __rtruediv__(self, other: Any) -> Traced:
        return self.trace.scale("divide", self.trace.lift(other), self)

    def __neg__(self) -> Traced:
        return Traced(self.trace, self.number, not self.negative)

    def __abs__(self) -> Traced:
        return self.trace.call("absolute", Traced(self.trace, self.number))


class Trace:
    """What a kernel did: nodes ``(operation, operands)``, inputs and constants first among them."""

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self.dtype = dtype
        self.nodes: list[tuple[Any, ...]] = []
        self._known: dict[tuple[Any, ...], int] = {}

    def node(self, *key: Any) -> int:
        if key not in self._known:
            self._known[key] = len(self.nodes)
            self.nodes.append(key)
        return self._known[key]

    def lift(self, value: Any) -> Traced:
        if isinstance(value, Traced):
            return value
        return Traced(self, self.node("constant", abs(float(value))), math.copysign(1.0, value) < 0)

    def plain(self, value: Any) -> int:
        """The node of a value, its sign worked in."""
        value = self.lift(value)
        return self.node("negative", value.number) if value.negative else value.number

    def call(self, operation: str, *operands: Any) -> Traced:
        numbers = [self.plain(value) for value in operands]
        if operation in _COMMUTE:
            numbers.sort()
        return Traced(self, self.node(operation, *numbers))

    def add(self, a: Traced, other: Any) -> Traced:
        """A sum or difference; the sign common to both terms stays outside, which no rounding notices."""
        b = self.lift(other)
        if a.negative == b.negative:
            return Traced(self, self.node("add", *sorted((a.number, b.number))), a.negative)
        if a.number > b.number:  # a - b and b - a are one node
            return Traced(self, self.node("subtract", b.number, a.number), b.negative)
        return Traced(self, self.node("subtract", a.number, b.number), a.negative)

    def scale(self, operation: str, a: Traced, other: Any) -> Traced:
        b = self.lift(other)
        numbers = sorted((a.number, b.number)) if operation in _COMMUTE else (a.number, b.number)
        return Traced(self, self.node(operation, *numbers), a.negative != b.negative)


# -- functions that scalars and traced scalars share ------------------------------------------------------------------


def _one_of(name: str, plain: Callable[..., Any]) -> Callable[..., Any]:
    def function(*values: Any) -> Any:
        for value in values:
            if isinstance(value, Traced):
                return value.trace.call(name, *values)
            if not isinstance(value, float | int):
                return getattr(value, f"_{name}")(*values)
        return plain(*values)

    function.__name__ = name
    return function


sqrt = _one_of("sqrt", math.sqrt)
arccos = _one_of("arccos", math.acos)
atan2 = _one_of("arctan2", math.atan2)
sin = _one_of("sin", math.sin)
cos = _one_of("cos", math.cos)
tan = _one_of("tan", math.tan)
exp = _one_of("exp", math.exp)
expm1 = _one_of("expm1", math.expm1)
sinh = _one_of("sinh", math.sinh)
log = _one_of("log", math.log)
log1p = _one_of("log1p", math.log1p)
maximum = _one_of("maximum", max)
select = _one_of("select", lambda condition, yes, no: yes if condition > 0 else no)


def log_ratio(ratio: Any, excess: Any) -> Any:
    """Logarithm of a ratio, near 1 from what it exceeds 1 by."""
    far = abs(excess) - 0.5
    return select(far, log(ratio), log1p(select(far, 0.0, excess)))


def power(value: Any, exponent: int) -> Any:
    """A whole power, as products."""
    result = value
    for _ in range(exponent - 1):
        result = result * value
    return result


def split(value: Any) -> tuple[Any, Any]:
    """Two halves of a number's digits whose products are exact; Dekker (1971)."""
    splitter = _SPLITTERS[value.trace.dtype] if isinstance(value, Traced) else _SPLITTERS[np.dtype(np.float64)]
    scaled = value * splitter
    high = scaled - (scaled - value)
    return high, value - high


def smallest(value: Any) -> Any:
    """The smallest positive number of the kind of ``value``."""
    if hasattr(value, "least"):
        return value.least
    return _SMALLEST[value.trace.dtype if isinstance(value, Traced) else np.dtype(np.float64)]


# -- tapes ------------------------------------------------------------------------------------------------------------

_SCALAR = {
    "add": operator.add, "subtract": operator.sub, "multiply": operator.mul, "divide": operator.truediv,
    "negative": operator.neg, "positive": operator.pos, "absolute": abs, "sqrt": math.sqrt, "maximum": max,
    "select": lambda condition, yes, no: yes if condition > 0 else no,
}  # fmt: skip


@dataclass(frozen=True)
class Tape:
    """A recorded kernel, ready to run.

    Slots are numbered: inputs, outputs, scratch rows, constants.

    Attributes
    ----------
    calls
        ``(operation, slots of the operands, slot of the result)``, in order.
    constants
        Values of the last slots.
    inputs, outputs, scratch
        Numbers of slots of each kind.
    operations
        Arithmetic operations per element.
    """

    calls: tuple[tuple[str, tuple[int, ...], int], ...]
    constants: tuple[float, ...]
    inputs: int
    outputs: int
    scratch: int
    operations: int
    dtype: np.dtype[Any]

    @cached_property
    def _array_calls(self) -> list[tuple[Any, int, int, int, int]]:
        """Function, slots of three operands, -1 for what there is not, and slot of the result."""
        found = []
        for name, slots, result in self.calls:
            first, second, third = (*slots, -1, -1)[:3]
            found.append((_OWN.get(name) or getattr(np, name), first, second, third, result))
        return found

    @cached_property
    def _scalar_calls(self) -> list[tuple[Any, tuple[int, ...], int]]:
        return [(_SCALAR[name], slots, result) for name, slots, result in self.calls]

    @cached_property
    def _constants(self) -> list[Array]:
        return [np.asarray(value, self.dtype) for value in self.constants]

    def run(self, inputs: Sequence[Any], outputs: Sequence[Array], scratch: Array) -> None:
        """Evaluate a chunk: every input (m,) or 0-d, every output (m,), scratch (rows, m)."""
        slots: list[Any] = [*inputs, *outputs, *scratch, *self._constants]
        for ufunc, first, second, third, result in self._array_calls:
            if third >= 0:
                ufunc(slots[first], slots[second], slots[third], slots[result])
            elif second >= 0:
                ufunc(slots[first], slots[second], slots[result])
            else:
                ufunc(slots[first], slots[result])

    def calls_on(
        self, inputs: Sequence[Any], outputs: Sequence[Array], scratch: Array
    ) -> list[tuple[Any, tuple[Any, ...]]]:
        """The functions that ``run`` calls and their arguments, to be called again on the same arrays."""
        slots: list[Any] = [*inputs, *outputs, *scratch, *self._constants]
        return [
            (function, tuple(slots[i] for i in (*operands, result) if i >= 0))
            for function, *operands, result in self._array_calls
        ]

    def run_one(self, inputs: Sequence[float]) -> list[float]:
        """Outputs of a single element, in Python floats: the same bits at a tenth of the cost.

        Raises
        ------
        ArithmeticError, ValueError
            Where arrays would hold infinity or NaN.
        """
        slots: list[Any] = [*inputs, *[0.0] * (self.outputs + self.scratch), *self.constants]
        for function, operands, result in self._scalar_calls:
            if len(operands) == 2:
                slots[result] = function(slots[operands[0]], slots[operands[1]])
            else:
                slots[result] = function(*[slots[i] for i in operands])
        return slots[self.inputs : self.inputs + self.outputs]


def _select(condition: Array, yes: Array, no: Array, out: Array) -> None:
    out[...] = np.where(condition > 0, yes, no)  # out may be one of the others


def _maximum(a: Array, b: Array, out: Array) -> None:
    np.maximum(a, b, out=out)


_OWN = {"select": _select, "maximum": _maximum}


def record(kernel: Callable[..., Iterable[Any]], inputs: int, dtype: Any) -> Tape:
    """The tape of ``kernel``, a function of a list of scalars that returns the wanted outputs."""
    dtype = np.dtype(dtype)
    trace = Trace(dtype)
    scalars = [Traced(trace, trace.node("input", i)) for i in range(inputs)]
    wanted = [trace.plain(value) for value in kernel(scalars)]
    nodes, order = trace.nodes, _schedule(trace.nodes, wanted)
    last = {operand: n for n in order for operand in nodes[n][1:]}
    constants = sorted({o for n in (*order, *wanted) for o in _leaves(nodes, n) if nodes[o][0] == "constant"})
    place: dict[int, tuple[str, int]] = {trace.node("input", i): ("input", i) for i in range(inputs)}
    place |= {n: ("constant", i) for i, n in enumerate(constants)}
    target: dict[int, int] = {}
    for position, number in enumerate(wanted):
        target.setdefault(number, position)
    free: list[int] = []
    rows = 0
    planned: list[tuple[str, list[tuple[str, int]], tuple[str, int]]] = []
    for n in order:
        operation, *operands = nodes[n]
        done = [place[o][1] for o in dict.fromkeys(operands) if last[o] == n and place[o][0] == "scratch"]
        sources = [place[o] for o in operands]
        free += done
        if n in target:
            place[n] = ("output", target[n])
        else:
            if not free:
                free.append(rows)
                rows += 1
            place[n] = ("scratch", free.pop())
        planned.append((operation, sources, place[n]))
    planned += [
        ("positive", [place[number]], ("output", position))
        for position, number in enumerate(wanted)
        if place[number] != ("output", position)
    ]
    start = {"input": 0, "output": inputs, "scratch": inputs + len(wanted), "constant": inputs + len(wanted) + rows}
    calls = tuple(
        (operation, tuple(start[kind] + i for kind, i in sources), start[kind_of] + at)
        for operation, sources, (kind_of, at) in planned
    )
    values = tuple(float(nodes[n][1]) for n in constants)
    return Tape(calls, values, inputs, len(wanted), rows, len(order), dtype)


def _leaves(nodes: list[tuple[Any, ...]], number: int) -> tuple[int, ...]:
    return (number,) if nodes[number][0] in ("input", "constant") else nodes[number][1:]


def _schedule(nodes: list[tuple[Any, ...]], wanted: list[int]) -> list[int]:
    """The operations that are needed, each just before the first that needs it."""
    order: list[int] = []
    seen: set[int] = set()
    for output in wanted:
        stack = [(output, False)]
        while stack:
            number, ready = stack.pop()
            if ready:
                order.append(number)
            elif number not in seen and nodes[number][0] not in ("input", "constant"):
                seen.add(number)
                stack.append((number, True))
                stack += [(operand, False) for operand in reversed(nodes[number][1:])]
    return order
