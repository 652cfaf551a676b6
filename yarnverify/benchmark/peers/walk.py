"""A declared energy's tree, evaluated with anybody's scalars: symbols, tracers or whole arrays.

Points become three scalars, matrices three rows of three; what a library has to offer is a handful of functions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Any

import numpy as np

from yarnverify.errors import NotRunError
from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.tree import Expr, Name

Scalar = Any
Matrix = list[list[Any]]  # rows; a vector has three rows of one, a covector one row of three


@dataclass(frozen=True)
class Functions:
    """What a library calls the functions that a tree may hold.

    Attributes
    ----------
    number
        Makes an integer a scalar that divides without rounding down.
    pi, sqrt, abs
        The constant and two functions.
    named
        Functions by the name that the tree has for them: ``arccos``, ``sin`` and so on.
    """

    number: Callable[[int], Scalar]
    pi: Scalar
    sqrt: Callable[[Scalar], Scalar]
    abs: Callable[[Scalar], Scalar]
    named: Mapping[str, Callable[[Scalar], Scalar]]


def energy_of(energy: Energy, rows: Sequence[Scalar], parameters: Sequence[Scalar], functions: Functions) -> Scalar:
    """An energy's value.

    Parameters
    ----------
    energy
        The declaration.
    rows
        The degrees of freedom, three for a point and one for a sliding coordinate, in the declared order.
    parameters
        In the declared order.
    functions
        Of the library that the scalars belong to.

    Raises
    ------
    NotRunError
        For an operation or function that the library was not told about.
    """
    return scalar_of(energy.expression, values_of(energy, rows, parameters), functions)


def values_of(energy: Energy, rows: Sequence[Scalar], parameters: Sequence[Scalar]) -> dict[Name, Any]:
    """What each symbol of an energy stands for: a scalar, or a matrix of one column."""
    values: dict[Name, Any] = {p.name: value for p, value in zip(energy.parameters, parameters, strict=True)}
    at = 0
    for name in energy.unknowns:
        values[name] = [[rows[at + axis]] for axis in range(3)] if name.bold else rows[at]
        at += 3 if name.bold else 1
    return values


def scalar_of(expr: Expr, values: Mapping[Name, Any], functions: Functions) -> Scalar:
    """A tree's value, of a tree that is a scalar."""
    return _Walk(values, functions).value(expr)


def vector_of(expr: Expr, values: Mapping[Name, Any], functions: Functions) -> Any:
    """A tree's value, of a tree that is a vector of arrays: (3, n)."""
    rows = _Walk(values, functions).value(expr)
    return np.array(np.broadcast_arrays(*(row[0] for row in rows)))


class _Walk:
    def __init__(self, values: Mapping[Name, Any], functions: Functions) -> None:
        self.values, self.functions = values, functions
        self.known: dict[Expr, Any] = {}

    def value(self, expr: Expr) -> Any:
        if expr not in self.known:
            self.known[expr] = self._value(expr)
        return self.known[expr]

    def _value(self, expr: Expr) -> Any:
        functions = self.functions
        if expr.op == "symbol":
            return self.values[expr.name]
        if expr.op == "number":
            assert isinstance(expr.value, int)
            return functions.number(expr.value)
        if expr.op == "pi":
            return functions.pi
        if expr.op == "identity":
            return [[functions.number(int(i == j)) for j in range(3)] for i in range(3)]
        args = [self.value(arg) for arg in expr.args]
        first = args[0]
        match expr.op:
            case "add":
                return reduce(_add, args)
            case "neg":
                return _each(lambda a: -a, first)
            case "mul":
                return reduce(_multiply, args)
            case "dot":
                left = _transpose(first) if len(expr.args) == 2 and _is_column(first) else first
                return _multiply(left, args[1])
            case "frac":
                return _each(lambda a: a / args[1], first)
            case "pow":
                assert isinstance(expr.value, int)
                return first**expr.value
            case "transpose":
                return _transpose(first)
            case "norm" if isinstance(first, list):
                return functions.sqrt(reduce(add, (row[0] * row[0] for row in first)))
            case "norm" | "abs":
                return functions.abs(first)
            case "sqrt":
                return functions.sqrt(first)
            case "cross":
                a, b = ([row[0] for row in arg] for arg in args)
                turned = [(1, 2), (2, 0), (0, 1)]
                return [[a[i] * b[j] - a[j] * b[i]] for i, j in turned]
            case "call" if expr.value in functions.named:
                return functions.named[str(expr.value)](first)
        raise NotRunError(f"{expr.value or expr.op} is unknown to this peer")


def _is_column(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and len(value[0]) == 1


def _each(function: Callable[[Scalar], Scalar], value: Any) -> Any:
    return [[function(a) for a in row] for row in value] if isinstance(value, list) else function(value)


def _add(a: Any, b: Any) -> Any:
    if not isinstance(a, list):
        return a + b
    return [[p + q for p, q in zip(row, other, strict=True)] for row, other in zip(a, b, strict=True)]


def _transpose(value: Any) -> Any:
    return [list(column) for column in zip(*value, strict=True)] if isinstance(value, list) else value


def _multiply(a: Any, b: Any) -> Any:
    if not isinstance(a, list):
        return _each(lambda x: a * x, b)
    if not isinstance(b, list):
        return _each(lambda x: x * b, a)
    product: Matrix = [
        [reduce(add, (p * q for p, q in zip(row, col, strict=True))) for col in zip(*b, strict=True)] for row in a
    ]
    return product[0][0] if len(product) == len(product[0]) == 1 else product
