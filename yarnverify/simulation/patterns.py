"""Weave patterns as small matrices: a row for each weft, a column for each warp, +1 where the warp lies over the weft, else -1.

A pattern is repeated over the cloth; row 0, column 0 is its first weft and first warp.
"""

from __future__ import annotations

import re
from math import gcd
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError

Sides = NDArray[np.int8]
KNOWN = (
    "plain, twill A/B [step S], satin N [counter C], or a matrix with a row for each weft and a column for each warp"
)


def plain() -> Sides:
    """Over one, under one, (2, 2)."""
    return twill(1, 1)


def twill(over: int = 2, under: int = 2, step: int = 1) -> Sides:
    """Each warp over ``over`` wefts, then under ``under``; the next warp ``step`` wefts later. Square, ``over + under``.

    Raises
    ------
    InputError
        Counts below one, or a step that gives every warp the same place, so that wefts float over all of them.
    """
    if over < 1 or under < 1:
        raise InputError(f"twill {over}/{under}: a warp goes over at least one weft and under at least one")
    n = over + under
    if step % n == 0:
        raise InputError(f"twill {over}/{under}: step {step} is a multiple of {n}, so that wefts would not interlace")
    weft, warp = np.indices((n, n))
    return np.where((weft - step * warp) % n < over, 1, -1).astype(np.int8)


def satin(n: int = 5, counter: int | None = None) -> Sides:
    """Each weft over one warp in ``n``, ``counter`` warps further on in the next weft: warp-faced, (n, n).

    Parameters
    ----------
    counter
        Between 1 and n - 1 and without a common factor with n, so that no two neighbours bind side by side. By default the
        smallest.

    Raises
    ------
    InputError
        No such counter: n below 5, n = 6, or the wrong one given.
    """
    if n < 5:
        raise InputError(f"satin {n}: a satin has a repeat of at least 5 yarns")
    possible = [c for c in range(2, n - 1) if gcd(c, n) == 1]
    if not possible:
        raise InputError(
            f"satin {n}: no counter between 1 and {n - 1} is coprime to {n}, so there is no regular satin of {n}"
        )
    chosen = possible[0] if counter is None else counter
    if chosen not in possible:
        listed = ", ".join(map(str, possible))
        raise InputError(f"satin {n}: counter {chosen} must lie between 1 and {n - 1} and be coprime to {n}: {listed}")
    weft, warp = np.indices((n, n))
    return np.where((warp - chosen * weft) % n == 0, -1, 1).astype(np.int8)


def pattern(given: str | ArrayLike) -> Sides:
    """A pattern by name or matrix: one repeat, +1 where the warp is over, else -1.

    Parameters
    ----------
    given
        ``plain``, ``twill 2/1``, ``twill 3/1 step -1``, ``satin 8 counter 3``, or a matrix whose entries are 0 or 1 (or
        False, True): 1 where the warp is over.

    Raises
    ------
    InputError
        A name that is not known, a matrix that is not one of zeros and ones, or one in which a yarn never interlaces.

    Examples
    --------
    >>> pattern("twill 2/1")
    array([[ 1, -1,  1],
           [ 1,  1, -1],
           [-1,  1,  1]], dtype=int8)
    """
    return _named(given) if isinstance(given, str) else _matrix(given)


def _named(name: str) -> Sides:
    words = " ".join(name.lower().split())
    if words == "plain":
        return plain()
    if found := re.fullmatch(r"twill(?: (\d+)/(\d+))?(?: step ([+-]?\d+))?", words):
        over, under, step = (
            int(text) if text else default for text, default in zip(found.groups(), (2, 2, 1), strict=True)
        )
        return twill(over, under, step)
    if found := re.fullmatch(r"satin(?: (\d+))?(?: counter (\d+))?", words):
        return satin(int(found[1] or 5), int(found[2]) if found[2] else None)
    raise InputError(f"weave {name!r} is not known; there are: {KNOWN}")


def _matrix(given: Any) -> Sides:
    try:
        matrix = np.asarray(given)
    except ValueError:
        matrix = np.empty(0)
    if matrix.ndim != 2 or not matrix.size or matrix.dtype.kind not in "biuf" or not np.isin(matrix, (0, 1)).all():
        raise InputError(
            f"a weave is one of: {KNOWN} (rows of equal length, entries 0 and 1: 1 where the warp is over)"
        )
    sides = np.where(matrix == 1, 1, -1).astype(np.int8)
    for name, axis in (("weft", 1), ("warp", 0)):
        idle = np.flatnonzero(np.abs(sides.sum(axis, dtype=int)) == sides.shape[axis])
        if idle.size:
            raise InputError(
                f"weave: {name} {idle[0]} lies on one side of all that it crosses, so it does not interlace"
            )
    return sides
