"""Whether a polynomial has its square root among quotients with the roots at hand: a complete decision.

Roots are independent as long as none is a quotient with the others; a quotient whose numerator is not zero then is not zero.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from sympy import factorint

from yarnverify.symbolic.polynomials import Poly, Quotient, Relations, rational_root
from yarnverify.symbolic.reading import UnsupportedError

_LONGEST = 2000  # terms of a polynomial that is still factored


def known_root(relations: Relations, poly: Poly, layers: Sequence[str]) -> Quotient | None:
    """A quotient whose square is the polynomial, of unknown sign; None if there is none.

    Parameters
    ----------
    relations
        The squares of all roots.
    poly
        Reduced by them.
    layers
        The roots, independent, earlier ones first.

    Raises
    ------
    UnsupportedError
        Where a step takes too large a polynomial.
    """
    roots = set(layers)
    upper = [label for label in layers if roots.intersection(relations.labels(relations.squares[label]))]
    return _root(Quotient(relations, poly), upper, [label for label in layers if label not in upper])


def _root(value: Quotient, upper: list[str], lower: list[str]) -> Quotient | None:
    """Root by root: ``a + b r`` is a root of ``u + v r`` if ``n^2 = u^2 - v^2 r^2``, ``a^2 = (u +- n)/2``, ``b = v / 2a``."""
    relations, top = value.relations, value.numerator
    if not top:
        return value
    below = relations.constant(1)
    for (factor, power), (place, _) in zip(value.below, value.factors, strict=True):  # an even denominator
        top = relations.times_power(top, factor, power % 2)
        below = below * Quotient(relations, relations.number(1), ((place, (power + 1) // 2),))
    present = set(relations.labels(top))
    if upper:
        *rest_upper, label = upper
        rest_lower = lower
    else:
        used = [label for label in lower if label in present]
        if not used:
            return _times(_base_root(relations, top, lower), below)
        label, rest_upper = used[0], []
        rest_lower = [other for other in lower if other != label]
    root, square = relations.make(label), Quotient(relations, relations.squares[label])
    u, v = (Quotient(relations, part) for part in relations.split(top, label))
    if v.is_zero:
        found = _root(u, rest_upper, rest_lower)
        if found is None:
            found = _times(_root(u * square, rest_upper, rest_lower), 1 / root)
        return _times(found, below)
    norm = _root(u * u - v * v * square, rest_upper, rest_lower)
    for half in () if norm is None else ((u + norm) / 2, (u - norm) / 2):
        a = _root(half, rest_upper, rest_lower)
        if a is not None and not a.is_zero:
            return (a + v / (2 * a) * root) * below
    return None


def _times(value: Quotient | None, factor: Quotient) -> Quotient | None:
    return None if value is None else value * factor


def _base_root(relations: Relations, poly: Poly, roots: Sequence[str]) -> Quotient | None:
    """The root of a polynomial without roots in it: with some of the roots it must make a square.

    Which of them is a system of linear equations modulo 2, for the multiplicities of irreducible factors.
    """
    wanted, chosen = _odd(relations, poly), frozenset[str]()
    rows: list[tuple[Any, frozenset[Any], frozenset[str]]] = []
    for label in roots:
        row, of = _odd(relations, relations.squares[label]), frozenset({label})
        for pivot, known, labels in rows:
            if pivot in row:
                row, of = row ^ known, of ^ labels
        if row:
            rows.append((min(row, key=str), row, of))
    for pivot, known, labels in rows:
        if pivot in wanted:
            wanted, chosen = wanted ^ known, chosen ^ labels
    if wanted:
        return None
    content, powers = relations.factor(poly)
    total = {relations.listing(part): power for part, power in powers}
    for label in chosen:  # poly / square, whose root times the root of the square is wanted
        other, parts = relations.factor(relations.squares[label])
        content = content / other
        for part, power in parts:
            total[relations.listing(part)] = total.get(relations.listing(part), 0) - power
    outside, _ = rational_root(content)
    root = relations.constant(outside)
    for place, power in total.items():
        root = root * Quotient(relations, relations.listed[place]) ** (power // 2)
    for label in sorted(chosen):
        root = root * relations.make(label)
    return root


def _odd(relations: Relations, poly: Poly) -> frozenset[Any]:
    """What a polynomial has to an odd power: irreducible factors, primes, and -1."""
    if len(poly) > _LONGEST:
        raise UnsupportedError(f"a square root of a polynomial with more than {_LONGEST} terms")
    content, parts = relations.factor(poly)
    odd: set[Any] = {("factor", relations.listing(part)) for part, power in parts if power % 2}
    numbers: Iterable[int] = (abs(int(content.numerator)), int(content.denominator))
    for number in numbers:
        odd ^= {prime for prime, power in factorint(number).items() if power % 2}
    return frozenset(odd | ({-1} if content < 0 else set()))
