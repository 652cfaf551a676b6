"""Angles by their distance from 0, pi/2 and pi; rotations."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product
from typing import Any, Literal

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy
from numpy.typing import NDArray

from yarnverify.strategies.numbers import magnitudes

Array = NDArray[Any]
Side = Literal["0", "pi/2", "pi"]
SIDES: tuple[Side, ...] = ("pi/2", "0", "pi")
_BELOW_PI = 2.0**-51  # one unit in the last place of pi: no double below pi is nearer to it


@dataclass(frozen=True)
class Turn:
    """An angle as a distance from 0, a right angle or pi, which keeps its digits at all three.

    Attributes
    ----------
    side
        ``"0"``, ``"pi/2"`` or ``"pi"``.
    away
        Distance in rad: upwards from 0, downwards from pi, either way (signed) from pi/2.

    Examples
    --------
    >>> float(Turn("pi", 0.25)), Turn("pi", 1e-200).sine, Turn("pi/2", 1e-200).cosine
    (2.891592653589793, 1e-200, -1e-200)
    """

    side: Side
    away: float

    def __float__(self) -> float:
        return {"0": self.away, "pi/2": math.pi / 2 + self.away, "pi": math.pi - self.away}[self.side]

    @property
    def sine(self) -> float:
        return math.cos(self.away) if self.side == "pi/2" else math.sin(self.away)

    @property
    def cosine(self) -> float:
        if self.side == "pi/2":
            return -math.sin(self.away)
        return math.cos(self.away) if self.side == "0" else -math.cos(self.away)


def turns(*sides: Side, smallest: float = 1e-300, exact: bool = True) -> SearchStrategy[Turn]:
    """Angles as distances from one of the sides.

    Parameters
    ----------
    sides
        Some of ``"pi/2"``, ``"0"``, ``"pi"``, all by default; the first is what examples shrink to.
    smallest
        Smallest distance, in rad, that is not zero.
    exact
        Whether the distance zero is drawn too.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(turns(), lambda turn: True)
    Turn(side='pi/2', away=0.0)
    >>> find(turns(), lambda turn: turn.side == "pi" and 0 < turn.away < 1e-200).away < 1e-200
    True
    """

    def of(side: Side) -> SearchStrategy[Turn]:
        away = magnitudes(smallest, math.pi / 4)
        if side == "pi/2":
            away = st.one_of(away, away.map(lambda value: -value))
        return st.builds(Turn, st.just(side), st.one_of(st.just(0.0), away) if exact else away)

    return st.one_of([of(side) for side in sides or SIDES])


def angles(*sides: Side, smallest: float = 1e-300) -> SearchStrategy[float]:
    """Angles strictly between 0 and pi, in rad, near 0 and pi (and pi/2 if asked for) by the exponent of the distance.

    Parameters
    ----------
    sides
        Where to draw near: some of ``"0"``, ``"pi"``, ``"pi/2"``; the first two by default.
    smallest
        Smallest distance from 0; from pi and pi/2 a double cannot be nearer than its last digit.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(angles(), lambda angle: angle < 1e-200) < 1e-200
    True
    >>> math.pi - find(angles(), lambda angle: math.pi - angle < 1e-15)
    8.881784197001252e-16
    """

    def value(turn: Turn) -> float:
        return float(Turn("pi", max(turn.away, _BELOW_PI)) if turn.side == "pi" else turn)

    return turns(*(sides or ("0", "pi")), smallest=smallest, exact=False).map(value)


def _aligned() -> Iterator[Array]:
    """The 24 rotations that take axes to axes, the identity first."""
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            turned = np.zeros((3, 3))
            turned[list(order), range(3)] = signs
            if np.linalg.det(turned) > 0:
                turned.flags.writeable = False
                yield turned


def _rotation(a: int, b: int, c: int, d: int) -> Array:
    """Rotation (3, 3) of a quaternion of integers."""
    square = a * a + b * b + c * c + d * d
    whole = [
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]
    turned = np.array([[entry / square for entry in row] for row in whole])
    turned.flags.writeable = False
    return turned


def orientations(*, aligned: bool = True, generic: bool = True) -> SearchStrategy[Array]:
    """Rotations (3, 3): those that take axes to axes (exact), and generic ones (of unit columns but for rounding).

    Examples
    --------
    >>> from hypothesis import find
    >>> find(orientations(), lambda rotation: True).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    >>> find(orientations(aligned=False), lambda rotation: (rotation != 0).all()).shape
    (3, 3)
    """
    digit = st.integers(-1000, 1000)
    chosen = [st.sampled_from(list(_aligned()))] if aligned else []
    if generic:
        chosen.append(st.builds(_rotation, st.integers(1, 1000), digit, digit, digit))
    if not chosen:
        raise ValueError("orientations are aligned or generic; neither was asked for")
    return st.one_of(chosen)
