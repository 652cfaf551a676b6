"""A declared energy's tree, evaluated with anybody's scalars: symbols, tracers or whole arrays.

Points become three scalars, matrices three rows of three; what a library has to offer is a handful of functions. A library
that does better with small arrays gets its points as those.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add, mul
from typing import Any

import numpy as np

from yarnverify.errors import NotRunError
from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.tree import Expr, Name

Scalar = Any
Matrix = Any  # rows of scalars, or an array: three rows of one for a vector, one row of three for a covector


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
    arrays
        A module like NumPy, if points are to be arrays (3, 1) of it.
    """

    number: Callable[[int], Scalar]
    pi: Scalar
    sqrt: Callable[[Scalar], Scalar]
    abs: Callable[[Scalar], Scalar]
    named: Mapping[str, Callable[[Scalar], Scalar]]
    arrays: Any = None


FORMS = ("as declared", "divided once")


def functions_of(library: Any, number: Callable[[int], Scalar], *, short: bool, pi: Scalar = np.pi) -> Functions:
    """What a library calls the functions, which are named as NumPy names them, or ``short``, as C does."""
    names = {name: name for name in ("sin", "cos", "tan", "log", "exp")}
    inverse = {"arccos": "acos", "arcsin": "asin", "arctan": "atan", "atan2": "atan2"}
    names |= inverse if short else {name: name for name in inverse} | {"atan2": "arctan2"}
    size = next(getattr(library, name) for name in ("fabs", "Abs", "abs") if hasattr(library, name))
    return Functions(number, pi, library.sqrt, size, {name: getattr(library, own) for name, own in names.items()})


def energy_of(
    energy: Energy,
    rows: Sequence[Scalar],
    parameters: Sequence[Scalar],
    functions: Functions,
    form: str = FORMS[0],
) -> Scalar:
    """An energy's value.

    Parameters
    ----------
    energy
        The declaration.
    rows
        The degrees of freedom, three for a point and one for a sliding coordinate, in the declared order.
    parameters
        In the declared order, three for a vector.
    functions
        Of the library that the scalars belong to.
    form
        ``as declared``, or ``divided once``: a vector over a scalar waits with its division until after its products, so that
        the cosine between two directions is a.b / sqrt(a.a b.b). The second is up to four times as fast once it is
        differentiated, and which of the two people write is chance; a peer is measured with its faster one.

    Raises
    ------
    NotRunError
        For an operation or function that the library was not told about.
    """
    values = values_of(energy, rows, parameters)
    if functions.arrays is not None:
        stack = functions.arrays.stack
        values |= {n: stack([row[0] for row in value])[:, None] for n, value in values.items() if n.bold}
    return _Walk(values, functions, form).value(energy.expression)


def values_of(energy: Energy, rows: Sequence[Scalar], parameters: Sequence[Scalar]) -> dict[Name, Any]:
    """What each symbol of an energy stands for: a scalar, or a matrix of one column."""
    values: dict[Name, Any] = {}
    for names, given in ((energy.unknowns, rows), ([p.name for p in energy.parameters], parameters)):
        at = 0
        for name in names:
            values[name] = [[given[at + axis]] for axis in range(3)] if name.bold else given[at]
            at += 3 if name.bold else 1
    return values


def scalar_of(expr: Expr, values: Mapping[Name, Any], functions: Functions) -> Scalar:
    """A tree's value, of a tree that is a scalar."""
    return _Walk(values, functions).value(expr)


def vector_of(expr: Expr, values: Mapping[Name, Any], functions: Functions) -> Any:
    """A tree's value, of a tree that is a vector of arrays: (3, n)."""
    rows = _Walk(values, functions).value(expr)
    return np.array(np.broadcast_arrays(*(row[0] for row in rows)))


@dataclass(frozen=True)
class _Over:
    """A matrix that is still to be divided by some scalars, and by the square root of the product of others."""

    matrix: Matrix
    below: tuple[Scalar, ...]
    squares: tuple[Scalar, ...]

    def divided(self, sqrt: Callable[[Scalar], Scalar]) -> Any:
        below = [*self.below, *([sqrt(reduce(mul, self.squares))] if self.squares else [])]
        return _each(lambda a: a / reduce(mul, below), self.matrix)


class _Walk:
    def __init__(self, values: Mapping[Name, Any], functions: Functions, form: str = FORMS[0]) -> None:
        self.values, self.functions, self.waits = values, functions, form == FORMS[1]
        self.known: dict[Expr, Any] = {}

    def value(self, expr: Expr) -> Any:
        """Value of a node, divided out."""
        found = self._late(expr)
        return found.divided(self.functions.sqrt) if isinstance(found, _Over) else found

    def _late(self, expr: Expr) -> Any:
        if expr not in self.known:
            self.known[expr] = self._waiting(expr) if self.waits else self._value(expr)
        return self.known[expr]

    def _waiting(self, expr: Expr) -> Any:
        """A value whose division may wait: of quotients, and of what is linear in them."""
        if expr.op not in ("frac", "transpose", "mul"):
            return self._value(expr)
        args = [self._late(arg) for arg in (expr.args[:1] if expr.op == "frac" else expr.args)]
        plain = [arg.matrix if isinstance(arg, _Over) else arg for arg in args]
        below = tuple(value for arg in args if isinstance(arg, _Over) for value in arg.below)
        squares = tuple(value for arg in args if isinstance(arg, _Over) for value in arg.squares)
        if expr.op == "frac":
            if not _is_matrix(plain[0]):
                return self._value(expr)
            under = expr.args[1]
            inner = self.value(under.args[0]) if under.op == "norm" else None
            if _is_matrix(inner):
                return _Over(plain[0], below, (*squares, _multiply(_transpose(inner), inner)))
            return _Over(plain[0], (*below, self.value(under)), squares)
        result = _transpose(plain[0]) if expr.op == "transpose" else reduce(_multiply, plain)
        if not below and not squares:
            return result
        over = _Over(result, below, squares)
        return over if _is_matrix(result) else over.divided(self.functions.sqrt)

    def _value(self, expr: Expr) -> Any:
        functions = self.functions
        if expr.op == "symbol":
            return self.values[expr.name]
        if expr.op == "number":
            assert isinstance(expr.value, int)
            return functions.number(expr.value)
        if expr.op == "pi":
            return functions.pi
        if expr.op == "identity" and functions.arrays is not None:
            return functions.arrays.eye(3)
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
            case "norm" if _is_matrix(first):
                return functions.sqrt(_multiply(_transpose(first), first))
            case "norm" | "abs":
                return functions.abs(first)
            case "sqrt":
                return functions.sqrt(first)
            case "cross" if functions.arrays is not None:
                return functions.arrays.cross(first[:, 0], args[1][:, 0])[:, None]
            case "cross":
                a, b = ([row[0] for row in arg] for arg in args)
                turned = [(1, 2), (2, 0), (0, 1)]
                return [[a[i] * b[j] - a[j] * b[i]] for i, j in turned]
            case "call" if expr.value in functions.named:
                return functions.named[str(expr.value)](*args)
        raise NotRunError(f"{expr.value or expr.op} is unknown to this peer")


def _is_matrix(value: Any) -> bool:
    return isinstance(value, list) or getattr(value, "ndim", 0) == 2


def _is_column(value: Any) -> bool:
    return _is_matrix(value) and len(value) == 3 and len(value[0]) == 1


def _each(function: Callable[[Scalar], Scalar], value: Any) -> Any:
    return [[function(a) for a in row] for row in value] if isinstance(value, list) else function(value)


def _add(a: Any, b: Any) -> Any:
    if not isinstance(a, list):
        return a + b
    return [[p + q for p, q in zip(row, other, strict=True)] for row, other in zip(a, b, strict=True)]


def _transpose(value: Any) -> Any:
    if isinstance(value, list):
        return [list(column) for column in zip(*value, strict=True)]
    return value.T if _is_matrix(value) else value


def _multiply(a: Any, b: Any) -> Any:
    if not _is_matrix(a):
        return _each(lambda x: a * x, b)
    if not _is_matrix(b):
        return _each(lambda x: x * b, a)
    if len(a) == len(b[0]) == 1:
        return reduce(add, (p * q[0] for p, q in zip(a[0], b, strict=True))) if isinstance(a, list) else a[0] @ b[:, 0]
    if not isinstance(a, list):
        return a @ b
    return [[reduce(add, (p * q for p, q in zip(row, col, strict=True))) for col in zip(*b, strict=True)] for row in a]
