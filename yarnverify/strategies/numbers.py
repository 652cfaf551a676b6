"""Numbers by exponent and mantissa: lengths, ratios, strains, offsets."""

from __future__ import annotations

import math

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

_TIERS = (3, 52, 1100)  # one draw in three has a moderate exponent, one in three is within the digits of a double


def magnitudes(smallest: float, largest: float) -> SearchStrategy[float]:
    """Positive numbers, drawn by exponent and mantissa.

    Parameters
    ----------
    smallest, largest
        Bounds, both inclusive; positive and finite.

    Raises
    ------
    ValueError
        For bounds that are not positive, finite and in order.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(magnitudes(1e-300, 1e300), lambda value: value < 1e-200) < 1e-200
    True
    >>> find(magnitudes(1e-300, 1e300), lambda value: value > 1000)
    1024.0
    """
    if not 0 < smallest <= largest < math.inf:
        raise ValueError(f"magnitudes lie between two positive numbers, not {smallest} and {largest}")
    low, high = (math.frexp(bound)[1] - 1 for bound in (smallest, largest))
    tiers = [(max(low, -tier), min(high, tier)) for tier in _TIERS]
    exponents = st.one_of([st.integers(*tier) for tier in dict.fromkeys(tiers) if tier[0] <= tier[1]])
    mantissas = st.one_of(st.just(0), st.integers(0, 15).map(lambda digit: digit << 48), st.integers(0, 2**52 - 1))

    def number(exponent: int, mantissa: int) -> float:
        return min(max(math.ldexp(1 + mantissa * 2.0**-52, exponent), smallest), largest)

    return st.builds(number, exponents, mantissas)


def length_ratios(smallest: float = 1e-8, largest: float = 1e8) -> SearchStrategy[float]:
    """Ratios of two segments' lengths.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(length_ratios(), lambda ratio: ratio > 1e6)
    1048576.0
    """
    return magnitudes(smallest, largest)


def scales(smallest: float = 1e-30, largest: float = 1e30) -> SearchStrategy[float]:
    """Sizes of an element, in m; by default such that no derivative of a yarn's energy overflows.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(scales(), lambda size: size < 1e-3)
    0.0009765625
    """
    return magnitudes(smallest, largest)


def strains(smallest: float = 1e-17, largest: float = 8.0) -> SearchStrategy[float]:
    """Relative changes of a length: none, extension up to ``largest``, or compression down to a tenth.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(strains(), lambda strain: True)
    0.0
    >>> find(strains(), lambda strain: strain < 0)
    -0.5
    """
    compression = magnitudes(smallest, 0.9).map(lambda strain: -strain)
    return st.one_of(st.just(0.0), magnitudes(smallest, largest), compression)


def offsets(largest: float = 1e12) -> SearchStrategy[tuple[float, float, float]]:
    """Where an element is, in units of its own size: at the origin, on an axis or anywhere, up to ``largest`` away.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(offsets(), lambda offset: offset[1] < -1e6)
    (0.0, -1048576.0, 0.0)
    """
    one = st.one_of(st.just(0.0), magnitudes(2.0**-8, largest), magnitudes(2.0**-8, largest).map(lambda value: -value))
    return st.one_of(st.just((0.0, 0.0, 0.0)), st.tuples(one, one, one))
