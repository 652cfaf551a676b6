"""Numbers of several words each, so that a sum in which terms cancel keeps its digits; for the variant ``accurate``.

For energies without measures, where nothing is known of a sum but its terms. A kernel that runs on these numbers while it is
recorded (``tape``) leaves a tape of plain operations. What each number needs is found from the outputs: an output needs one
word; a product as many words of its factors as of itself; and a sum, of each term, one word more than of itself, since a
whole word may cancel. Coordinates are exact, their differences are so in two words, and so are products of these in four.
Hence a result is good to its last digits where no sum cancels further than to the rounding of its terms, and also no other
sum does that is a term of it; a sum of exact terms may cancel as far as it likes.

Error-free transformations by Knuth and Dekker; sums distilled as by Ogita, Rump and Oishi (2005).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from yarnverify.kernels.geometry import two_product, two_sum

CHEAP = 4  # words up to which an exact product is taken as it is


class Number:
    """A scalar that is worked out when it is known how many words of it are wanted.

    Attributes
    ----------
    exact
        Number of words that hold it without an error; infinite where none do.
    parts
        Of a sum, what it is made by adding, each with a power of two or its negative as a factor; else nothing.
    uses
        How many others are made of it.
    """

    __slots__ = ("_known", "_make", "exact", "parts", "uses")

    def __init__(
        self,
        make: Callable[[int], list[Any]],
        exact: float = math.inf,
        parts: Sequence[tuple[Number, float]] = (),
        of: Sequence[Number] = (),
    ) -> None:
        self._make, self.exact, self.parts, self.uses = make, exact, tuple(parts), 0
        self._known: dict[int, list[Any]] = {}
        for each in of:
            each.uses += 1

    def words(self, count: int) -> list[Any]:
        """So many words or fewer, the first of them the number as rounded."""
        if count not in self._known:
            self._known[count] = self._make(count)
        return self._known[count]

    @property
    def rounded(self) -> Any:
        """One word."""
        return self.words(1)[0]

    def __add__(self, other: Any) -> Number:
        return _sum((self, number(other)))

    __radd__ = __add__

    def __neg__(self) -> Number:
        return _scaled(self, -1)

    def __sub__(self, other: Any) -> Number:
        return self + -number(other)

    def __rsub__(self, other: Any) -> Number:
        return number(other) + -self

    def __mul__(self, other: Any) -> Number:
        if isinstance(other, int | float) and abs(math.frexp(other)[0]) == 0.5:
            return _scaled(self, other)
        return _product(self, number(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Number:
        return _quotient(self, number(other))

    def __rtruediv__(self, other: Any) -> Number:
        return _quotient(number(other), self)


def number(value: Any) -> Number:
    """A scalar as it is."""
    return value if isinstance(value, Number) else Number(lambda count: [value], 1)


def _times(words: list[Any], power: float) -> list[Any]:
    """Words times a power of two or its negative: without an error."""
    size = abs(power)
    words = words if size == 1 else [word * size for word in words]
    return words if power > 0 else [-word for word in words]


def _scaled(value: Number, power: float) -> Number:
    return Number(lambda count: _times(value.words(count), power), value.exact, [(value, power)], of=[value])


def _sum(added: tuple[Number, ...]) -> Number:
    pair = len(added) == 2 and all(term.exact == 1 for term in added)

    def make(count: int) -> list[Any]:
        if pair:
            a, b = (term.rounded for term in added)
            return [a + b] if count == 1 else list(two_sum(a, b))
        opened = [part for term in added for part in _opened(term, 1)]
        words = [word for term, power in opened for word in _times(term.words(_wanted(term, count)), power)]
        return distilled(words, count)

    return Number(make, 2 if pair else math.inf, [(term, 1) for term in added], of=added)


def _opened(value: Number, power: float) -> list[tuple[Number, float]]:
    """The terms of a sum; one that others use too, and whose terms are exact, is as good closed."""
    if not value.parts or value.exact <= 2:
        return [(value, power)]
    terms = [term for part, factor in value.parts for term in _opened(part, power * factor)]
    shared = value.uses > 1 and all(term.exact <= CHEAP for term, _ in terms)
    return [(value, power)] if shared else terms


def _wanted(term: Number, count: int) -> int:
    """Words of a term of a sum."""
    return int(term.exact) if term.exact <= CHEAP else count + 1


def _product(a: Number, b: Number) -> Number:
    exact = 2 * a.exact * b.exact

    def make(count: int) -> list[Any]:
        if count == 1:
            return [a.rounded * b.rounded]
        whole = count >= exact
        first, second = (x.words(int(x.exact) if whole else count) for x in (a, b))
        found: list[Any] = []
        for i, p in enumerate(first):
            for j, q in enumerate(second):
                if whole or i + j < count - 1:
                    found += two_product(p, q)
                elif i + j == count - 1:
                    found.append(p * q)
        if whole:
            return found
        return [found[0], sum(found[2:], found[1])] if count == 2 else distilled(found, count)

    return Number(make, exact, of=[a, b])


def _quotient(a: Number, b: Number) -> Number:
    def make(count: int) -> list[Any]:
        words = [a.rounded / b.rounded]
        for _ in range(count - 1):  # long division
            left = _sum((a, *(_product(b, number(-word)) for word in words)))
            words.append(left.rounded / b.rounded)
        return words

    return Number(make, of=[a, b])


def distilled(words: Sequence[Any], count: int) -> list[Any]:
    """A sum of words in ``count`` words, good to these also where it is as small as the rounding of the largest.

    Each pass leaves a sum and its rounding errors, which the next one adds; then the sums are added from the last to the first,
    since the first ones may cancel.
    """
    sums, rest = [], list(words)
    for _ in range(count + 1):
        value, rest = _passed(rest)
        sums.append(value)
        if not rest:
            break
    if rest:
        sums.append(sum(rest[1:], rest[0]))
    sums.reverse()
    found: list[Any] = []
    while len(found) < count and sums:
        value, errors = _passed(sums)
        found.append(value)
        sums = errors
    return [*found[:-1], sum(sums, found[-1])] if len(found) == count else found


def _passed(words: list[Any]) -> tuple[Any, list[Any]]:
    """A sum as rounded, and its rounding errors."""
    value, errors = words[0], []
    for word in words[1:]:
        value, error = two_sum(value, word)
        errors.append(error)
    return value, errors
