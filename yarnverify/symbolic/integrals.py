"""Integrals of declared energies along a yarn, in closed form: SymPy does them, nobody types the result in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp

from yarnverify.symbolic.measures import scalar_symbol
from yarnverify.symbolic.scalars import scalar_tree
from yarnverify.symbolic.tree import Expr, Name, rebuild

_VARIABLE = Expr("symbol", value=Name("integrated"))
_Vector = dict[Expr, Any]  # the coefficient of each vector that does not depend on the variable


def integral(integrand: Callable[[Expr], Expr], lower: Expr, upper: Expr) -> Expr:
    """The integral of a function of one variable, as a tree.

    The integrand is a polynomial in the variable whose vectors are multiplied by scalars and, in pairs, to scalars.
    Vectors that do not depend on the variable stay as they are, so that what is a difference remains one.

    Raises
    ------
    TypeError
        For an integrand of another kind.
    """
    reader = _Reader()
    value = reader.scalar(integrand(_VARIABLE))
    x = scalar_symbol(_VARIABLE.name)
    found = sp.factor(sp.integrate(value, (x, reader.scalar(lower), reader.scalar(upper))))
    products = {symbol: pair for pair, symbol in reader.products.items()}

    def change(node: Expr) -> Expr | None:
        if node.op != "symbol" or scalar_symbol(node.name) not in products:
            return None
        a, b = products[scalar_symbol(node.name)]
        return a.T * b

    return rebuild(scalar_tree(found), change)


class _Reader:
    """Trees as SymPy scalars, and as combinations of vectors; scalar products of these are symbols of their own."""

    def __init__(self) -> None:
        self.products: dict[tuple[Expr, Expr], sp.Symbol] = {}

    def scalar(self, expr: Expr) -> Any:
        op, args = expr.op, expr.args
        match op:
            case "number":
                return sp.Integer(int(str(expr.value)))
            case "symbol" if not expr.name.bold:
                return scalar_symbol(expr.name)
            case "add":
                return sp.Add(*[self.scalar(arg) for arg in args])
            case "neg":
                return -self.scalar(args[0])
            case "frac":
                return self.scalar(args[0]) / self.scalar(args[1])
            case "pow":
                return self.scalar(args[0]) ** int(str(expr.value))
            case "mul":
                return self._product(args)
        raise TypeError(f"an integrand cannot hold {op}")

    def _product(self, args: tuple[Expr, ...]) -> Any:
        scale, rows = sp.S.One, list(args)
        while rows:
            first = rows.pop(0)
            if first.op == "transpose":
                scale *= self._dot(self.vector(first.args[0]), self.vector(rows.pop(0)))
            else:
                scale *= self.scalar(first)
        return scale

    def _dot(self, left: _Vector, right: _Vector) -> Any:
        return sp.Add(*[p * q * self._symbol(a, b) for a, p in left.items() for b, q in right.items()])

    def _symbol(self, a: Expr, b: Expr) -> sp.Symbol:
        if (b, a) in self.products:
            return self.products[b, a]
        return self.products.setdefault((a, b), scalar_symbol(Name("product", str(len(self.products)))))

    def vector(self, expr: Expr) -> _Vector:
        if not any(node == _VARIABLE for node in expr.walk()):
            return {expr: sp.S.One}
        op, args = expr.op, expr.args
        match op:
            case "add":
                return _combined([(sp.S.One, self.vector(arg)) for arg in args])
            case "neg":
                return _combined([(sp.S.NegativeOne, self.vector(args[0]))])
            case "frac":
                return _combined([(1 / self.scalar(args[1]), self.vector(args[0]))])
            case "mul":
                scale, found = sp.S.One, None
                for arg in args:
                    try:
                        scale *= self.scalar(arg)
                    except TypeError:
                        found = self.vector(arg)
                if found is not None:
                    return _combined([(scale, found)])
        raise TypeError(f"an integrand cannot hold a vector made by {op}")


def _combined(parts: list[tuple[Any, _Vector]]) -> _Vector:
    found: _Vector = {}
    for scale, vector in parts:
        for base, value in vector.items():
            found[base] = found.get(base, sp.S.Zero) + scale * value
    return found
