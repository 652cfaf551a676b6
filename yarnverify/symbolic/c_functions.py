"""The safe functions of ``kernels.geometry`` as C: each is run once on symbols, and what it did is written down.

So the C code and the NumPy kernels share their functions, and every operation is one IEEE operation in both.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, TypeAlias

import numpy as np

from yarnverify.kernels import geometry
from yarnverify.kernels import tape as tape_module
from yarnverify.kernels.tape import Trace, Traced
from yarnverify.symbolic.reading import UnsupportedError

Shape: TypeAlias = Any  # "s" for a scalar, or a tuple of shapes
_BINARY = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}
_UNARY = {"negative": "-{}", "positive": "{}", "absolute": "fabs({})", "sqrt": "sqrt({})"}
_LIBRARY = {"arccos": "acos", "sin": "sin", "cos": "cos", "tan": "tan", "log": "log", "log1p": "log1p"}


def flat(value: Any) -> list[Any]:
    """The scalars of a nested tuple, in order."""
    return [part for item in value for part in flat(item)] if isinstance(value, tuple) else [value]


def shape_of(value: Any) -> Shape:
    return tuple(shape_of(item) for item in value) if isinstance(value, tuple) else "s"


def rebuilt(shape: Shape, scalars: Iterable[Any]) -> Any:
    """A nested tuple of a shape from its scalars."""
    source = iter(scalars)

    def build(part: Shape) -> Any:
        return tuple(build(item) for item in part) if isinstance(part, tuple) else next(source)

    return build(shape)


class Functions:
    """The C functions that a source needs, each written once for each shape of its arguments."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, Shape], tuple[str, Shape]] = {}
        self._texts: dict[str, str] = {}

    def used_in(self, code: str) -> list[str]:
        """The texts of the functions that some code calls."""
        return [text for name, text in self._texts.items() if re.search(rf"\b{name}\(", code)]

    def named(self, name: str, arguments: tuple[Any, ...]) -> tuple[str, Shape]:
        """The C name of a function for arguments of these shapes, and the shape of its result."""
        key = (name, shape_of(arguments))
        if key not in self._known:
            number = sum(other == name for other, _ in self._known) + 1
            self._known[key] = self._written(name, f"safe_{name}{number if number > 1 else ''}", key[1])
        return self._known[key]

    def _written(self, name: str, c_name: str, shape: Shape) -> tuple[str, Shape]:
        function = getattr(geometry, name, None) or getattr(tape_module, name, None)
        if function is None:
            raise UnsupportedError(f"{name}: there is no such function to write in C")
        trace = Trace(np.dtype(np.float64))
        inputs = [Traced(trace, trace.node("input", i)) for i in range(len(flat(shape)))]
        result = function(*rebuilt(shape, inputs))
        scalars = [trace.lift(value) for value in flat(result)]
        lines = _statements(trace, [value.number for value in scalars])
        given = ", ".join(f"double a{i}" for i in range(len(inputs)))
        returned = [("-" if value.negative else "") + _operand(trace, value.number) for value in scalars]
        if not isinstance(result, tuple):
            head, last = f"static double {c_name}({given})", [f"    return {returned[0]};"]
        else:
            head = f"static void {c_name}({given}, double *r)"
            last = [f"    r[{i}] = {text};" for i, text in enumerate(returned)]
        summary = (function.__doc__ or "").strip().splitlines()[0].replace("``", "").replace("*/", "")
        self._texts[c_name] = "\n".join([f"/* {summary} */", head, "{", *lines, *last, "}"])
        return c_name, shape_of(result)


def _operand(trace: Trace, number: int) -> str:
    operation, *operands = trace.nodes[number]
    if operation == "input":
        return f"a{operands[0]}"
    return repr(float(operands[0])) if operation == "constant" else f"v{number}"


def _statements(trace: Trace, wanted: list[int]) -> list[str]:
    """An assignment for each operation that is needed, each after those that it needs."""
    lines: list[str] = []
    seen: set[int] = set()

    def visit(number: int) -> None:
        operation, *operands = trace.nodes[number]
        if number in seen or operation in ("input", "constant"):
            return
        seen.add(number)
        for operand in operands:
            visit(operand)
        texts = [_operand(trace, operand) for operand in operands]
        if operation in _BINARY:
            text = f"{texts[0]} {_BINARY[operation]} {texts[1]}"
        elif operation in _UNARY:
            text = _UNARY[operation].format(*texts)
        elif operation == "maximum":
            text = f"{texts[0]} > {texts[1]} ? {texts[0]} : {texts[1]}"
        elif operation == "select":
            text = f"{texts[0]} > 0 ? {texts[1]} : {texts[2]}"
        else:
            text = f"{_LIBRARY[operation]}({texts[0]})"
        lines.append(f"    const double v{number} = {text};")

    for number in wanted:
        visit(number)
    return lines
