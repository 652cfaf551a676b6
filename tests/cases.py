"""Elements for tests, built from their edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from yarnverify.strategies import Element, Turn

ORIGIN = np.zeros(3)
X, Y, Z = np.eye(3)
GENERIC = np.array([3.0, 4.0, 12.0])  # of length 13
ACROSS = np.array([4.0, -3.0, 0.0])  # of length 5, perpendicular to it
FAR = np.array([0.5, -1.0, 0.75])


def made(*rows: Any, dtype: Any = np.float64, **parameters: float) -> Element:
    return Element(np.concatenate([np.ravel(row) for row in rows]).astype(dtype)[:, None], parameters)


def bent(a: Any, b: Any, at: Any = ORIGIN, u: tuple[float, float] = (1.0, -1.0), **options: Any) -> Element:
    """A crossing with a bent yarn, from its two edges."""
    return made(at, at + a, at + b, *u, k_b=2.0, **options)


def sheared(a: Any, b: Any, at: Any = ORIGIN, **options: Any) -> Element:
    """A crossing with a warp and a weft segment, from its two edges."""
    return made(at, at + a, at + b, k_x=2.0, L=0.5, **options)


def stretched(edge: Any, rest: float, at: Any = ORIGIN, **options: Any) -> Element:
    return made(at, at + edge, 0.0, rest, k_s=3.0, **options)


def touching(gap: float, d: float = 0.5) -> Element:
    return made(0.0, gap, k_c=2.0, L=3.0, d=d)


def turned(turn: Turn, length: float = 1.0, first: Any = X, second: Any = Y) -> Any:
    """An edge that makes an angle with ``first``."""
    return length * (turn.cosine * first + turn.sine * second)


def towards(angle: float, side: str = "0") -> Any:
    """The second edge of a yarn that turns by an angle, or by pi less that angle."""
    return turned(Turn("pi" if side == "0" else "0", angle))


def generic(turn: Turn) -> Any:
    """An edge in the generic frame, of length 1."""
    return turned(turn, 1.0, GENERIC / 13, ACROSS / 5)


@dataclass(frozen=True)
class Case:
    """An element and whether the variants with plain formulas manage it too."""

    name: str
    energy: str
    element: Element
    plain: bool = False


REGULAR = {
    "stretch": stretched(GENERIC, 10.0),
    "bending": bent(GENERIC, Y - Z),
    "shear": sheared(GENERIC, Y - Z),
    "parallel_contact": touching(0.25),
}
