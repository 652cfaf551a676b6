"""The safe shapes of an energy: its law and the law's derivatives in scalars of the corner that lose no digits."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import sympy as sp

from yarnverify.symbolic.angles import sine_of, theta_itself, theta_over_sine, theta_squared
from yarnverify.symbolic.corner import ATOMS, Corner, corner_of, corner_section
from yarnverify.symbolic.derive import Derivation
from yarnverify.symbolic.measures import NoMeasuresError, differentiate, scalar_symbol
from yarnverify.symbolic.radicals import radicands, with_roots
from yarnverify.symbolic.safe import Safe, Shape
from yarnverify.symbolic.scalars import scalar_tree
from yarnverify.symbolic.tree import Name
from yarnverify.symbolic.vanishing import vanishes, without_cancellation


def safe_shapes(derivation: Derivation) -> list[Safe]:
    """The shapes that an energy needs, the one for the regular states first; one or two.

    Raises
    ------
    NoMeasuresError
        Where the law has more than one angle, an angle between segments without a common point, or functions of an angle
        other than powers, sine, cosine and the tangent of its half.
    """
    angles = [m for m in derivation.measures if m.b is not None]
    if len(angles) > 1:
        raise NoMeasuresError
    if not angles:
        return [_shape(derivation, None, "smooth")]
    corner = corner_of(angles[0])
    found = []
    with suppress(NoMeasuresError):
        found.append(_shape(derivation, corner, "smooth"))
    return [*found, _shape(derivation, corner, "polar")]


def _shape(derivation: Derivation, corner: Corner | None, shape: Shape) -> Safe:
    section = corner_section(derivation, corner)
    given = {name for m in derivation.measures if m.b is None for name in (m.a.l.name, m.a.d.name)}
    if corner is None:
        variables: dict[Any, Any] = {m: scalar_symbol(m.symbol) for m in derivation.measures}
        law = _factored(derivation.law, derivation)
        safe = Safe(derivation, shape, None, False, section, scalar_tree(law), frozenset(given))
        _differentials(safe, derivation.law, variables, lambda value: value)
        return safe
    given |= {s.l.name for s in (corner.a, corner.b)} | {s.d.name for s in (corner.a, corner.b)}
    given |= {corner.name(base) for base in ATOMS} | {corner.symbol}
    given |= {corner.name(base, bold=True) for base in ("m", "n", "v", "k")}
    theta = scalar_symbol(corner.symbol)
    atoms = {base: scalar_symbol(corner.name(base)) for base in ATOMS}
    variables = {m: scalar_symbol(m.symbol) for m in derivation.measures if m.b is None}
    c = sp.Symbol("cosine", real=True)
    whole = {1 - c: atoms["versine"], c - 1: -atoms["versine"], 1 + c: atoms["vercosine"]}  # none of them cancels

    def factored(value: Any) -> Any:
        value = without_cancellation(sp.factor(value)) if vanishes(value) else sp.factor(value)
        value = value.replace(lambda e: e in whole, lambda e: whole[e])
        return value.subs(c, corner.sign * atoms["C"])

    if shape == "smooth":
        law = _in_cosine(derivation.law, theta, c)

        def settled(value: Any) -> Any:
            value = value.subs(theta_squared(c), atoms["A"])
            value = value.subs({theta_over_sine(c): atoms["f"]})
            value = value.replace(lambda e: e.is_Function and e.func.__name__ == "sine_excess", lambda e: atoms["g"])
            return factored(value)

        second = _in_cosine(sp.diff(derivation.law, theta, 2), theta, c)
        safe = Safe(derivation, shape, corner, False, section, scalar_tree(settled(law)), frozenset(given))
        _differentials(safe, law, variables | {corner: c}, settled, corner.sign, second)
        return safe
    turned = sp.expand(derivation.law.subs(theta, atoms["psi"] + sp.pi / 2))
    centred = not turned.has(sp.pi) and not turned.has(sp.sin, sp.cos, sp.tan)
    law, variable = (turned, atoms["psi"]) if centred else (derivation.law, theta)

    def plain(value: Any) -> Any:
        value = value.subs(sp.tan(theta / 2), atoms["half"])
        value = value.subs(sp.cos(theta), c).subs(sp.sin(theta) ** 2, 1 - c**2).subs(sp.sin(theta), atoms["s"])
        if value.has(sp.sin, sp.cos, sp.tan):
            raise NoMeasuresError
        return factored(value)

    safe = Safe(derivation, shape, corner, centred, section, scalar_tree(plain(law)), frozenset(given))
    _differentials(safe, law, variables | {corner: variable}, plain, corner.sign)
    return safe


def _differentials(
    safe: Safe, law: Any, variables: dict[Any, Any], settled: Any, sign: int = 1, turn: Any = None
) -> None:
    """The derivatives of the law that blocks are made of; those by the angle of a corner are by the angle of its edges."""

    def by(value: Any, *keys: Any) -> Any:
        for key in keys:
            if isinstance(key, Name):
                value = differentiate(value, scalar_symbol(key))
            else:
                value = differentiate(value, variables[key]) * (sign if isinstance(key, Corner) else 1)
        return settled(_factored(value, safe.derivation))

    safe.slopes.update(
        tree=scalar_tree,
        d=lambda key: by(law, key),
        dd=lambda key, other=None: by(law, key, other or key),
        turn=lambda key: settled(turn),
        u=lambda name: by(law, name),
        uu=lambda row, column: by(law, row, column),
        du=lambda key, name: by(law, key, name),
    )
    for key in variables:  # whatever the law has no safe form for shows here
        safe.slopes["tree"](safe.slopes["d"](key))
        safe.slopes["tree"](safe.slopes["dd"](key))


def _factored(value: Any, derivation: Derivation) -> Any:
    """In factors, in which the difference of two sliding coordinates stays one: opened, its square would cancel digits."""
    if vanishes(derivation.law):  # sums beside exponentials and logarithms have no factors: they would be opened
        return without_cancellation(value)
    if radicands(derivation.law):
        return with_roots(value)
    found = sp.factor(value)
    slides = [scalar_symbol(name) for name in derivation.unknowns if not name.bold]
    products = any(not term.as_coeff_Mul()[1].is_Symbol for each in found.atoms(sp.Add) for term in each.args)
    if len(slides) == 2 and products:
        first, last = slides
        apart = sp.Symbol("apart", real=True)
        closed = sp.factor(found.subs(last, first + apart))
        if first not in closed.free_symbols:
            return closed.subs(apart, last - first)
    return found


def _in_cosine(law: Any, theta: Any, c: Any) -> Any:
    """A law of an angle as an analytic function of its cosine.

    Raises
    ------
    NoMeasuresError
        Where it is none: an odd power of the angle or of its sine is left.
    """
    sine, half_sine, half_cosine = sine_of(c), sp.Symbol("half_sine"), sp.Symbol("half_cosine")
    value = law.subs(sp.tan(theta / 2), half_sine / half_cosine)
    value = value.subs({sp.sin(theta / 2): half_sine, sp.cos(theta / 2): half_cosine})
    value = value.subs({sp.tan(theta): sine / c, sp.sin(theta): sine, sp.cos(theta): c})
    value = value.replace(
        lambda e: e.is_Pow and e.base == theta and e.exp.is_Integer,
        lambda e: theta_squared(c) ** (e.exp // 2) * theta_itself(c) ** (e.exp % 2),
    ).subs(theta, theta_itself(c))
    squares = {
        sine: (1 - c) * (1 + c),
        half_sine: (1 - c) / 2,
        half_cosine: (1 + c) / 2,
        theta_itself(c): theta_squared(c),
    }
    for root, square in squares.items():
        value = value.replace(
            lambda e, root=root: e.is_Pow and e.base == root and e.exp.is_Integer,
            lambda e, root=root, square=square: square ** (e.exp // 2) * root ** (e.exp % 2),
        )
    if value.has(*squares) or value.has(sp.sin, sp.cos, sp.tan):
        raise NoMeasuresError
    return sp.factor(value)
