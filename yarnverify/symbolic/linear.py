"""Scalar trees as sums of products: what an angle is made of, before its sine and cosine are taken."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from yarnverify.symbolic.functions import unfolded
from yarnverify.symbolic.tree import ONE, Expr, Name

Monomial = frozenset[tuple[Expr, int]]  # (atom, power); the empty one is 1
Sum = dict[Monomial, Fraction]
_MOST_TERMS = 64  # what is longer is one atom


def linear_form(expr: Expr, meaning: Callable[[Name], Expr | None]) -> Sum:
    """A scalar tree as ``sum coefficient * monomial``, definitions followed.

    Functions, products of vectors and other denominators are atoms.
    """
    op, args = expr.op, expr.args[:1] if expr.op == "pow" else expr.args
    if op == "number":
        return _kept({frozenset(): Fraction(int(str(expr.value)))})
    if op == "symbol":
        defined = meaning(expr.name)
        return _atom(expr) if defined is None else linear_form(defined, meaning)
    if op == "call" and (plain := unfolded(expr)) is not None:
        return linear_form(plain, meaning)
    if op not in {"add", "neg", "mul", "frac", "pow"}:
        return _atom(expr)
    if op == "mul":
        at = next((i for i, arg in enumerate(args) if _is_array(arg)), len(args))
        if at == 0:
            return _atom(expr)
        args = (*args[:at], Expr("mul", args[at:])) if at < len(args) else args
    parts = [linear_form(arg, meaning) for arg in args]
    if op == "add":
        total: Sum = {}
        for part in parts:
            for monomial, factor in part.items():
                total[monomial] = total.get(monomial, Fraction(0)) + factor
        return _kept(total)
    if op == "neg":
        return {monomial: -factor for monomial, factor in parts[0].items()}
    if op == "frac":
        below = _inverse(parts[1])
        return _product(parts[0], {frozenset({(args[1], -1)}): Fraction(1)} if below is None else below)
    if op == "pow":
        power = int(str(expr.value))
        base = parts[0] if power >= 0 else _inverse(parts[0])
        if base is None:
            return _atom(expr)
        parts = [base] * abs(power)
    found: Sum = {frozenset(): Fraction(1)}
    for part in parts:
        found = _product(found, part)
        if len(found) > _MOST_TERMS:
            return _atom(expr)
    return found


def tree_of(monomial: Monomial) -> Expr:
    """A product of atoms as a tree."""
    factors = [atom if power == 1 else Expr("pow", (atom,), power) for atom, power in monomial]
    if not factors:
        return ONE
    factors.sort(key=repr)
    return factors[0] if len(factors) == 1 else Expr("mul", tuple(factors))


def _is_array(factor: Expr) -> bool:
    """Whether a scalar product begins here: its factors keep their order, so it is one atom."""
    return factor.op == "transpose" or (factor.op == "symbol" and factor.name.bold)


def _atom(expr: Expr) -> Sum:
    return {frozenset({(expr, 1)}): Fraction(1)}


def _kept(total: Sum) -> Sum:
    return {monomial: factor for monomial, factor in total.items() if factor}


def _product(a: Sum, b: Sum) -> Sum:
    total: Sum = {}
    for m, p in a.items():
        for n, q in b.items():
            powers = dict(m)
            for atom, power in n:
                powers[atom] = powers.get(atom, 0) + power
            joined = frozenset((atom, power) for atom, power in powers.items() if power)
            total[joined] = total.get(joined, Fraction(0)) + p * q
    return _kept(total)


def _inverse(value: Sum) -> Sum | None:
    """The inverse of a single product; None of anything else."""
    if len(value) != 1:
        return None
    ((monomial, factor),) = value.items()
    return {frozenset((atom, -power) for atom, power in monomial): 1 / factor}
