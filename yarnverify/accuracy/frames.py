"""Orientations, numbers by exponent, and directions at a given angle: seeded, and the same bits on every machine.

Only additions, multiplications, divisions and square roots are used here, all of which round correctly everywhere; a sine or
a power would be another float on another machine, and the worst cases of a record other cases.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
# Rotations by integer quaternions: columns of integers, all of the same integer length
_QUATERNIONS = (
    (1, 0, 0, 0),
    (1, 1, 0, 0),
    (1, 1, 1, 1),
    (1, 2, 0, 0),
    (1, 1, 1, 0),
    (2, 1, 1, 1),
    (1, 2, 3, 1),
    (3, 1, 4, 2),
)


def by_exponent(draw: np.random.Generator, low: float, high: float, n: int) -> Array:
    """(n,) numbers in [low, high], as many in every octave."""
    (_, first), (_, last) = np.frexp(low), np.frexp(high)
    exponent = draw.integers(int(first), int(last) + 1, n)
    return np.clip(np.ldexp(draw.uniform(0.5, 1.0, n), exponent), low, high)


def signs(draw: np.random.Generator, n: int) -> Array:
    return draw.integers(0, 2, n) * 2.0 - 1.0


def _rotation(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Rotation matrices of quaternions times their squared norm, (3, 3, n)."""
    return np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    )


def random_frames(draw: np.random.Generator, n: int) -> Array:
    """(3, 3, n) rotations, orthogonal to rounding."""
    four = draw.uniform(-1, 1, (4, n)) + np.array([0.01, 0, 0, 0])[:, None]
    square = four[0] * four[0] + four[1] * four[1] + four[2] * four[2] + four[3] * four[3]
    return _rotation(*four) / square


def exact_frames(draw: np.random.Generator, n: int) -> tuple[Array, Array]:
    """(3, 3, n) integer matrices whose columns are exactly orthogonal and of one integer length, and these lengths (n,)."""
    four = np.array(_QUATERNIONS, float)[draw.integers(0, len(_QUATERNIONS), n)].T
    frames = _rotation(*four) * signs(draw, n)
    order = draw.permuted(np.tile(np.arange(3), (n, 1)), axis=1).T
    frames = np.take_along_axis(frames, order[:, None, :], axis=0)
    return frames, four[0] ** 2 + four[1] ** 2 + four[2] ** 2 + four[3] ** 2


def turned(frames: Array, half: Array, towards_pi: Array) -> tuple[Array, Array]:
    """Two directions (3, n) at the angle 2 arctan(half), or pi minus that, in the first plane of each frame.

    The floats then have that angle up to their rounding, which leaves the size of an angle of 1e-15 right.
    """
    along, across = frames[:, 0], frames[:, 1]
    square = half * half
    cosine, sine = (1 - square) / (1 + square), 2 * half / (1 + square)
    return along, along * np.where(towards_pi, -cosine, cosine) + across * sine
