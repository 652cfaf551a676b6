"""Angles as points of the unit circle: sums, halves, multiples of pi, and which angles may be related to which.

A pair is (sine, cosine), of whatever numbers a reading computes with.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import combinations, product
from typing import Any

import flint

Pair = tuple[Any, Any]
Root = Callable[[Any], Any]
DRAWN_PARTS = 4  # an angle that nothing explains is drawn by its fourth part, so that its halves hang together with it
PARTS_OF_PI = 60  # multiples of pi over this are told apart
_CLOSE = flint.arb(2) ** -40  # of a multiple of pi/60, to be worth an exact comparison


def turned(a: Pair, b: Pair) -> Pair:
    """The point of the sum of two angles."""
    return a[0] * b[1] + a[1] * b[0], a[1] * b[1] - a[0] * b[0]


def multiple(pair: Pair, count: int, one: Any) -> Pair:
    """The point of a whole multiple of an angle; ``one`` is the number 1."""
    step = pair if count >= 0 else (-pair[0], pair[1])
    total: Pair = one * 0, one
    for bit in bin(abs(count))[2:]:
        total = turned(total, total)
        if bit == "1":
            total = turned(total, step)
    return total


def halved(pair: Pair, sqrt: Root) -> Pair:
    """The point of half an angle that is within [0, pi]."""
    sine = sqrt((1 - pair[1]) / 2)
    return sine, pair[0] / (2 * sine)  # a second root would not be independent


def scaled(pair: Pair, factor: Fraction, one: Any, sqrt: Root) -> Pair | None:
    """The point of a multiple of an angle within [0, pi]; None where that takes more than halving."""
    below = factor.denominator
    while below % 2 == 0:
        pair, below = halved(pair, sqrt), below // 2
    return multiple(pair, factor.numerator, one) if below == 1 else None


def of_pi(factor: Fraction, one: Any, sqrt: Root) -> Pair | None:
    """The point of a multiple of pi; None where it is not known by square roots here."""
    factor %= 2
    if factor > 1:
        pair = of_pi(2 - factor, one, sqrt)
        return pair and (-pair[0], pair[1])
    if 2 * factor > 1:
        pair = of_pi(1 - factor, one, sqrt)
        return pair and (pair[0], -pair[1])
    zero = one * 0
    known = {Fraction(0): (zero, one), Fraction(1, 2): (one, zero)}
    if factor in known:
        return known[factor]
    if factor == Fraction(1, 3):
        return sqrt(one * 3) / 2, one / 2
    if factor.denominator == 5:
        cosine = (1 + sqrt(one * 5)) / 4
        return multiple((sqrt(1 - cosine * cosine), cosine), factor.numerator, one)
    if factor.denominator % 2 == 0:
        pair = of_pi(2 * factor, one, sqrt)
        return pair and halved(pair, sqrt)
    return None


Relation = tuple[int, dict[int, int], int]  # count, {j: n_j} and m of count angle = sum n_j known_j + m pi/60


def _parts(relation: Relation, angle: Any, known: Sequence[Any]) -> Any:
    """Balls of ``count angle - sum n_j known_j`` in parts of pi."""
    count, total, _ = relation
    return (angle * count - sum((known[j] * n for j, n in total.items()), flint.arb(0))) * PARTS_OF_PI / flint.arb.pi()


def near(relation: Relation, angle: Any, known: Sequence[Any]) -> bool:
    """Whether balls of an angle and of others allow a relation between them."""
    return bool(abs(_parts(relation, angle, known) - relation[2]) < _CLOSE)


def candidates(angle: Any, known: Sequence[Any]) -> Iterator[Relation]:
    """How an angle may hang together with others, all given as balls; what is given is close, and remains to be proved."""
    many = [(j, n) for j in range(len(known)) for n in (1, -1, 2, -2, 3, -3, 4, -4)]
    sums: list[dict[int, int]] = [{}, *({j: n} for j, n in many)]
    for (i, j), (m, n) in product(combinations(range(len(known)), 2), product((1, -1, 2, -2), repeat=2)):
        sums.append({i: m, j: n})
    for total, count in product(sums, (1, 2, 4)):
        parts = _parts((count, total, 0), angle, known)
        if parts.is_finite():
            relation = count, total, int((parts.mid().fmpq() + flint.fmpq(1, 2)).floor())
            if near(relation, angle, known):
                yield relation
