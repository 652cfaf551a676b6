"""SymPy scalars back to trees, written as a person would write them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import sympy as sp

from yarnverify.symbolic.functions import SAFE
from yarnverify.symbolic.measures import NoMeasuresError, scalar_name
from yarnverify.symbolic.tree import ONE, PI, ZERO, Expr, Name, number

Order = Callable[[Name], Any]  # of two symbols that differ in their index, which comes first


def by_index(name: Name) -> Any:
    """Higher indices first."""
    return tuple(-ord(letter) for letter in name.sub)


def origin_last(name: Name) -> Any:
    """Lower indices first, but 0, where segments start, last: ``u_1 - u_2`` and ``u_1 - u_0``, as papers have it."""
    return name.sub == "0", name.sub


def scalar_tree(value: Any, order: Order = by_index) -> Expr:
    """A SymPy scalar as a tree, fractions written as fractions, differences in an order of their indices."""
    if value.is_Symbol:
        return Expr("symbol", value=scalar_name(value))
    if value.is_Rational:
        return number(sp.Rational(value).p) if value.q == 1 else _fraction(number(int(value.p)), number(int(value.q)))
    if value == sp.pi:
        return PI
    if value.is_Add:
        terms = [scalar_tree(term, order) for term in sorted(value.args, key=_term_key)]
        return Expr("add", tuple(terms))
    if value.is_Mul or value.is_Pow:
        value = _upright(value, order)
        above, below = _split(value)
        if below != 1:
            return _fraction(scalar_tree(above, order), scalar_tree(below, order))
    if value.is_Mul:
        content, rest = value.as_coeff_Mul()
        if content < 0:
            return -scalar_tree(-value, order)
        factors = [number(int(content))] if content != 1 else []
        return _product([*factors, *(scalar_tree(f, order) for f in sorted(sp.Mul.make_args(rest), key=_factor_key))])
    if value.is_Pow:
        if value.exp == sp.Rational(1, 2):
            return Expr("sqrt", (scalar_tree(value.base, order),))
        if value.exp.is_Rational and value.exp.q == 2:
            whole = scalar_tree(value.base ** (value.exp - sp.Rational(1, 2)), order)
            return _product([whole, Expr("sqrt", (scalar_tree(value.base, order),))])
        if value.exp.is_Integer:
            return Expr("pow", (scalar_tree(value.base, order),), int(value.exp))
    name = type(value).__name__
    if isinstance(value, sp.sin | sp.cos | sp.tan | sp.log) or name in ("exponential", *SAFE):
        args = tuple(scalar_tree(arg, order) for arg in value.args)
        return Expr("call", args, "exp" if name == "exponential" else name)
    if isinstance(value, sp.sign):
        return scalar_tree(value.args[0], order) / Expr("abs", (scalar_tree(value.args[0], order),))
    if isinstance(value, sp.Abs):
        return Expr("abs", (scalar_tree(value.args[0], order),))
    raise NoMeasuresError


def _split(value: Any) -> tuple[Any, Any]:
    """Numerator and denominator, factors as they are."""
    above, below = [], []
    for factor in sp.Mul.make_args(value):
        if factor.is_Rational:
            above.append(sp.Integer(factor.p))
            below.append(sp.Integer(factor.q))
        elif factor.is_Pow and factor.exp.is_Rational and factor.exp < 0:
            below.append(sp.Pow(factor.base, -factor.exp))
        else:
            above.append(factor)
    return sp.Mul(*above), sp.Mul(*below, evaluate=len(below) < 2 or not any(b.is_Add for b in below))


def _upright(value: Any, order: Order) -> Any:
    """A product in which differences such as ``u_0 - u_1`` stand as ``u_1 - u_0``."""
    flipped, factors = False, []
    for factor in sp.Mul.make_args(value):
        base, exponent = factor.as_base_exp()
        signs = {term.as_coeff_Mul() for term in base.args} if base.is_Add and len(base.args) == 2 else set()
        if exponent.is_Integer and {sign for sign, _ in signs} == {1, -1} and all(s.is_Symbol for _, s in signs):
            (first,), (second,) = ([scalar_name(s) for sign, s in signs if sign == want] for want in (1, -1))
            if first.base == second.base and order(first) > order(second):
                flipped ^= bool(exponent % 2)
                factor = sp.Pow(sp.Add(*[-term for term in base.args]), exponent)
        factors.append(factor)
    return -sp.Mul(*factors) if flipped else value if factors == list(sp.Mul.make_args(value)) else sp.Mul(*factors)


def _fraction(above: Expr, below: Expr) -> Expr:
    if above.op == "neg":
        return -_fraction(above.args[0], below)
    return above / below


def _factor_key(value: Any) -> tuple[int, str]:
    """Parameters, then lengths and coordinates, then functions, then sums."""
    text = str(value)
    order = 3 if value.is_Add or (value.is_Pow and value.base.is_Add) else 2 if value.args and not value.is_Pow else 1
    return (-1 if text[0] == "k" else 0 if len(text) == 1 else order), text


def _term_key(value: Any) -> tuple[bool, str]:
    content, rest = value.as_coeff_Mul()
    return bool(content < 0) or rest.is_number, str(rest)


def _product(factors: list[Expr]) -> Expr:
    factors = [f for f in factors if f != ONE] or [ONE]
    return factors[0] if len(factors) == 1 else Expr("mul", tuple(factors))


def sum_tree(terms: Iterable[tuple[Any, tuple[Expr, ...]]], order: Order = by_index) -> Expr:
    """``sum scalar * factors``; terms with the same factors are joined, and a scalar shared by all is taken out."""
    joined: dict[tuple[Expr, ...], Any] = {}
    for value, factors in terms:
        joined[factors] = joined.get(factors, sp.S.Zero) + value
    kept = [(_upright(sp.factor_terms(value), order), factors) for factors, value in joined.items() if value != 0]
    if not kept:
        return ZERO
    trees = []
    for value, factors in kept:
        negative = value.as_coeff_Mul()[0] < 0
        body = _product([scalar_tree(-value if negative else value, order), *factors])
        trees.append(-body if negative else body)
    return trees[0] if len(trees) == 1 else Expr("add", tuple(trees))
