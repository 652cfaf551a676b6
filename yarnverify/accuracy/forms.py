"""An energy as a function of few differences of its unknowns: ``x1 - x0``, ``u1 - u2``.

Energies of cloth do not depend on where the cloth is. Differentiating by the differences that really occur, and adding up
with signs afterwards, halves the work of the truth and loses nothing, since the balls of the sums enclose the sums.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.tree import Expr, Name, rebuild


@dataclass(frozen=True)
class Form:
    """A sum of unknowns and parameters with signs: a symbol of its own, and the sign of each summand."""

    symbol: Name
    signs: tuple[tuple[Name, int], ...]


Terms = tuple[tuple[tuple[int, ...], int], ...]  # columns of a derivative by forms, and how often each is added


@dataclass(frozen=True)
class Sums:
    """Which sums of derivatives by forms the derivatives by inputs are; many are equal up to sign, and worked out once.

    Attributes
    ----------
    terms
        The sums that differ: derivatives by one form (gradient) or two (Hessian), and how often each is added.
    index, sign
        For each derivative by inputs, (m,) or (m, m): its sum, and its sign.
    """

    terms: tuple[Terms, ...]
    index: NDArray[np.intp]
    sign: NDArray[np.float64]


@dataclass(frozen=True)
class Reduced:
    """An energy over forms.

    Attributes
    ----------
    energy
        As declared.
    section, expression
        Where the symbols of the forms are unknowns, and the energy in them.
    margins
        One tree for each assumption of the domain, positive where it holds, and whether zero is allowed.
    forms
        The forms, in the order of their first appearance.
    gradient, hessian
        How derivatives by the inputs, rows of ``q`` and then parameters, are made of those by forms.
    """

    energy: Energy
    section: Section
    expression: Expr
    margins: tuple[tuple[Expr, bool], ...]
    forms: tuple[Form, ...]
    gradient: Sums
    hessian: Sums


def signs_of(expr: Expr) -> dict[Name, int] | None:
    """``{symbol: sign}`` of a sum of different symbols, else None."""
    if expr.op == "symbol":
        return {expr.name: 1}
    if expr.op == "neg":
        inner = signs_of(expr.args[0])
        return None if inner is None else {name: -sign for name, sign in inner.items()}
    if expr.op != "add":
        return None
    total: dict[Name, int] = {}
    for arg in expr.args:
        inner = signs_of(arg)
        if inner is None or set(inner) & set(total):
            return None
        total |= inner
    return total


def rows_of(energy: Energy) -> list[tuple[Name, int]]:
    """What each row of ``q``, and after them each parameter, is: a symbol and an axis."""
    names = (*energy.unknowns, *(parameter.name for parameter in energy.parameters))
    return [(name, axis) for name in names for axis in range(3 if name.bold else 1)]


def reduce(energy: Energy) -> Reduced:
    """Replace the sums of unknowns in an energy by forms."""
    found: dict[tuple[tuple[Name, int], ...], Form] = {}

    def replaced(node: Expr) -> Expr | None:
        signs = signs_of(node)
        if signs is None:
            return None
        key = tuple(sorted(signs.items()))
        bold = key[0][0].bold
        form = found.setdefault(key, Form(Name("form", str(len(found)), bold), key))
        return Expr("symbol", value=form.symbol)

    expression = rebuild(energy.expression, replaced)
    margins = tuple((rebuild(a.left - a.right, replaced), not a.strict) for a in energy.domain)
    forms = tuple(found.values())
    section = Section(energy.name, 0, unknowns=tuple(form.symbol for form in forms))
    first: dict[Name, int] = {}
    column = 0
    for form in forms:
        first[form.symbol] = column
        column += 3 if form.symbol.bold else 1
    rows = [
        [(first[form.symbol] + axis, sign) for form in forms for other, sign in form.signs if other == name]
        for name, axis in rows_of(energy)
    ]
    count = len(rows)
    gradient = _sums([[((k,), sign) for k, sign in row] for row in rows], (count,))
    pairs: list[list[tuple[tuple[int, ...], int]]] = [
        [((min(k, n), max(k, n)), sign * other) for (k, sign), (n, other) in product(rows[i], rows[j])]
        for i in range(count)
        for j in range(count)
    ]
    return Reduced(energy, section, expression, margins, forms, gradient, _sums(pairs, (count, count)))


def _sums(wanted: list[list[tuple[tuple[int, ...], int]]], shape: tuple[int, ...]) -> Sums:
    found: dict[Terms, int] = {}
    index, signs = [], []
    for parts in wanted:
        total: dict[tuple[int, ...], int] = {}
        for key, sign in parts:
            total[key] = total.get(key, 0) + sign
        items = sorted((key, times) for key, times in total.items() if times)
        sign = -1 if items and items[0][1] < 0 else 1
        index.append(found.setdefault(tuple((key, times * sign) for key, times in items), len(found)))
        signs.append(sign)
    return Sums(tuple(found), np.array(index).reshape(shape), np.array(signs, float).reshape(shape))


def state_of(reduced: Reduced, values: Mapping[Name, Any]) -> dict[Name, Any]:
    """Values of the forms, from those of the unknowns and parameters: numbers, or three of them for a point."""
    state: dict[Name, Any] = {}
    for form in reduced.forms:
        axes = []
        for axis in range(3 if form.symbol.bold else 1):
            total: Any = None
            for name, sign in form.signs:
                part = values[name][axis] if name.bold else values[name]
                total = part * sign if total is None else total + part * sign
            axes.append(total)
        state[form.symbol] = tuple(axes) if form.symbol.bold else axes[0]
    return state
