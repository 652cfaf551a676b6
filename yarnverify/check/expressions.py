"""What an argument of an implementation is in this energy's unknowns and parameters: ``R = d/4``, ``B = k_b/(pi*R**2)``."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.errors import InputError

Array = NDArray[Any]
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: operator.pow,
}  # fmt: skip


def norm(vector: Array) -> Array:
    """Length of vectors (3, n)."""
    return np.asarray(np.sqrt((vector * vector).sum(axis=0)))


def dot(a: Array, b: Array) -> Array:
    """Scalar product of vectors (3, n)."""
    return np.asarray((a * b).sum(axis=0))


_FUNCTIONS: dict[str, Callable[..., Any]] = {"sqrt": np.sqrt, "abs": np.abs, "norm": norm, "dot": dot}


def evaluated(text: str, values: Mapping[str, Any], option: str) -> Any:
    """The value of an expression in names, numbers, ``pi``, ``+ - * / **``, sqrt, abs, norm, dot.

    Raises
    ------
    InputError
        For anything else.
    """
    try:
        tree = ast.parse(text, mode="eval").body
    except SyntaxError:
        raise InputError(f"{option}: {text!r} is no formula such as d/4 or k_b/(pi*R**2)") from None

    def value(node: ast.expr) -> Any:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return float(node.value)
        if isinstance(node, ast.Name):
            if node.id == "pi":
                return np.pi
            if node.id in values:
                return values[node.id]
            raise InputError(f"{option}: {node.id!r} in {text!r} is not known; there are {', '.join(values)} and pi")
        if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
            return _BINARY[type(node.op)](value(node.left), value(node.right))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return -value(node.operand)
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id in _FUNCTIONS
            and not node.keywords
        ):
            try:
                return _FUNCTIONS[node.func.id](*[value(arg) for arg in node.args])
            except TypeError:
                raise InputError(f"{option}: {node.func.id} in {text!r} has the wrong number of arguments") from None
        raise InputError(f"{option}: {text!r}: only names, numbers, + - * / **, sqrt, abs, norm, dot are understood")

    with np.errstate(all="ignore"):
        return value(tree)


def assignments(given: Sequence[str], option: str) -> dict[str, str]:
    """``name=formula`` pairs.

    Raises
    ------
    InputError
        For what is no such pair, or a name given twice.
    """
    found: dict[str, str] = {}
    for text in given:
        name, equals, formula = text.partition("=")
        name = name.strip()
        if not equals or not re.fullmatch(r"[A-Za-z_]\w*", name) or not formula.strip():
            raise InputError(f"{option} {text!r}: give NAME=VALUE")
        if name in found:
            raise InputError(f"{option}: {name} is given twice")
        found[name] = formula.strip()
    return found
