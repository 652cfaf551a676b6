"""The hard cases of an energy, from the measures that it is made of; seeded, vectorised, the same on every machine.

Names say what is hard. Where an energy has an angle: small angles, angles near pi and as near as floats come, deviations from
the right angle, segments of equal length at a fold. For all: states near rest, length ratios, coordinates with an offset,
scales, sliding coordinates that nearly meet, states that floats hit exactly, results out of range, and states without a value.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.frames import by_exponent, exact_frames, random_frames, signs, turned
from yarnverify.accuracy.shape import Shape, shape_of
from yarnverify.accuracy.truth import Points
from yarnverify.symbolic.declare import Energy

Array = NDArray[Any]
Draw = np.random.Generator


@dataclass(frozen=True)
class Limits:
    """How far the regimes go, for one type of floats."""

    angle: float
    fold: float
    offset: float
    ratio: float
    scale: float
    beyond: tuple[float, float]


LIMITS = {
    "float64": Limits(1e-15, 1e-12, 1e12, 1e8, 1e200, (1e155, 1e250)),
    "float32": Limits(1e-7, 1e-5, 1e4, 1e4, 1e18, (1e19, 1e30)),
}


@dataclass(frozen=True)
class Regime:
    """A family of states.

    Attributes
    ----------
    name, meaning
        For tables.
    values
        Makes arrays by label from the shape, the limits, a generator and a count.
    applies
        Whether an energy has such states.
    """

    name: str
    meaning: str
    values: Callable[[Shape, Limits, Draw, int], dict[str, Array]]
    applies: Callable[[Shape], bool] = lambda shape: True


def regimes(energy: Energy) -> tuple[Regime, ...]:
    """The regimes of an energy, in reading order; moderate states alone where a parameter is a vector."""
    if vector_parameters(energy):  # what is hard about a vector is not known
        return tuple(regime for regime in REGIMES if regime.values is _moderate)
    shape = shape_of(energy)
    return tuple(regime for regime in REGIMES if regime.applies(shape))


def vector_parameters(energy: Energy) -> list[str]:
    """Names of the parameters that are vectors."""
    return [parameter.label for parameter in energy.parameters if parameter.name.bold]


def not_drawn(energy: Energy) -> str:
    """Why no hard cases are drawn for an energy; empty where they are."""
    moving = [name.label for name, unit in zip(energy.unknowns, energy.units, strict=True) if unit != "m"]
    return f"no hard cases are drawn for velocities ({', '.join(moving)})" if moving else ""


def points_of(energy: Energy, regime: Regime, dtype: str, n: int, seed: int) -> Points:
    """States of a regime: the same for the same arguments, on every machine."""
    shape = shape_of(energy)
    words = zlib.crc32(f"{energy.name}|{regime.name}|{dtype}".encode())
    draw = np.random.default_rng([seed, words])
    return shape.pack(regime.values(shape, LIMITS[dtype], draw, n), dtype)


# -- building blocks --------------------------------------------------------------------------------------------------


def placed(
    shape: Shape,
    draw: Draw,
    n: int,
    *,
    half: Array | None = None,
    towards_pi: Array | None = None,
    lengths: Array | None = None,
    slide: Array | float = 1.0,
    base: Array | float = 0.5,
    frames: Array | None = None,
) -> dict[str, Array]:
    """States by edges: random frames, with a given angle and given lengths.

    Parameters
    ----------
    half
        (n,) tangent of half the angle between the first two edges; random by default.
    towards_pi
        (n,) whether to take pi minus that angle.
    lengths
        (edges, n); between 0.5 and 2 by default.
    slide
        Factor of the sliding coordinates' distances.
    base
        Size of the first point's coordinates.
    """
    frames = random_frames(draw, n) if frames is None else frames
    half = draw.uniform(0.05, 1.0, n) if half is None else half
    towards_pi = draw.integers(0, 2, n) == 1 if towards_pi is None else towards_pi
    lengths = draw.uniform(0.5, 2.0, (len(shape.edges), n)) if lengths is None else lengths
    directions = [*turned(frames, half, towards_pi)] if shape.angle else []
    while len(directions) < len(shape.edges):
        directions.append(frames[:, 0] if not directions else random_frames(draw, n)[:, 0])
    found: dict[str, Array] = {}
    for edge, direction, length in zip(shape.edges, directions, lengths, strict=True):
        step = direction * length
        head, tail = edge.head.label, edge.tail.label
        if tail not in found and head not in found:
            found[tail] = draw.uniform(-1, 1, (3, n)) * base
        if tail not in found:
            found[tail] = found[head] - step
        elif head not in found:
            found[head] = found[tail] + step
    for name in shape.points:
        found.setdefault(name.label, draw.uniform(-1, 1, (3, n)))
    return _scalars(shape, draw, n, slide) | found


def _scalars(shape: Shape, draw: Draw, n: int, slide: Array | float = 1.0) -> dict[str, Array]:
    """Sliding coordinates inside the domain, in the order that the state of rest has them, and parameters."""
    rest = shape.rest() or {}
    factor, base = draw.uniform(0.2, 0.9, n) * slide, draw.uniform(-1, 1, n) * slide
    found = {
        name.label: base + factor * rest.get(name.label, np.array(float(at))) for at, name in enumerate(shape.sliding)
    }
    for parameter in shape.energy.parameters:
        name = parameter.label
        if parameter.name.bold:
            found[name] = draw.uniform(-1, 1, (3, n))
            if parameter.direction:
                found[name] = found[name] / np.linalg.norm(found[name], axis=0)
            continue
        found[name] = draw.uniform(0.5, 2.0, n)
        if name in shape.lengths:
            found[name] = found[name] * 0.2 + 0.9  # not below the distances that rest compares them with
    return found


def at_rest(shape: Shape, draw: Draw, n: int, frames: Array, size: Array, base: Array) -> dict[str, Array]:
    """The declared state of rest, turned by frames whose columns have the lengths ``size``, and moved by ``base``."""
    rest = shape.rest()
    assert rest is not None
    found = {}
    for name in shape.energy.unknowns:
        value = rest[name.label]
        if name.bold:
            turned_rest = frames[:, 0] * value[0] + frames[:, 1] * value[1] + frames[:, 2] * value[2]
            found[name.label] = turned_rest + base
        else:
            found[name.label] = value * size
    for parameter in shape.energy.parameters:
        name_ = parameter.label
        found[name_] = rest[name_] * size if name_ in shape.lengths else draw.uniform(0.5, 2.0, n)
    return found


def _geometric(shape: Shape) -> list[tuple[str, tuple[Any, ...]]]:
    """Every geometric number of a state: coordinates, sliding coordinates, lengths among the parameters."""
    found: list[tuple[str, tuple[Any, ...]]] = []
    for name in shape.energy.unknowns:
        found += [(name.label, (axis,)) for axis in range(3)] if name.bold else [(name.label, ())]
    return [*found, *((name, ()) for name in shape.lengths)]


def _scaled(shape: Shape, values: dict[str, Array], scale: Array, compensate: bool) -> dict[str, Array]:
    """A state of another size; the stiffness makes up for it, so that an energy of order one becomes one of order scale."""
    found = dict(values)
    for name in shape.points:
        found[name.label] = values[name.label] * scale
    if not shape.only_angles:
        for label in (*(name.label for name in shape.sliding), *shape.lengths):
            found[label] = values[label] * scale
    for label, power in _made_up_for(shape).items() if compensate else ():
        for _ in range(abs(power)):
            found[label] = found[label] * scale if power > 0 else found[label] / scale
    return found


def _made_up_for(shape: Shape) -> dict[str, int]:
    """Powers of the size that parameters get, so that an energy of order one becomes one of that order."""
    return dict.fromkeys([*shape.others][:1], 1) if shape.only_angles else dict(shape.others)


_SMALLEST_RATIO = 1e-4  # of a parameter without a unit


# -- regimes ----------------------------------------------------------------------------------------------------------


def _moderate(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    return placed(shape, draw, n)


def _small(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    return placed(shape, draw, n, half=by_exponent(draw, limits.angle, 1.0, n) / 2, towards_pi=np.zeros(n, bool))


def _near_pi(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    return placed(shape, draw, n, half=by_exponent(draw, limits.fold, 1.0, n) / 2, towards_pi=np.ones(n, bool))


def _at_pi(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    half = by_exponent(draw, limits.angle, limits.fold, n) / 2
    return placed(shape, draw, n, half=half, towards_pi=np.ones(n, bool))


def _right(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    off = by_exponent(draw, limits.angle, 1.0, n) / 2
    half = (1 - off) / (1 + off)  # tan(pi/4 - x) for off = tan(x)
    return placed(shape, draw, n, half=half)


def _mixed_half(limits: Limits, draw: Draw, n: int) -> Array:
    return np.where(draw.integers(0, 2, n) == 1, by_exponent(draw, limits.fold, 1.0, n) / 2, draw.uniform(0.05, 1, n))


def _equal(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    lengths = np.repeat(draw.uniform(0.5, 2.0, (1, n)), len(shape.edges), axis=0)
    return placed(shape, draw, n, half=by_exponent(draw, limits.fold, 1.0, n) / 2, lengths=lengths)


def _ratios(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    lengths = draw.uniform(0.5, 2.0, (len(shape.edges), n))
    ratio = by_exponent(draw, 1.0, limits.ratio, n)
    which = draw.integers(0, 2, n) == 1
    slide: Array | float = 1.0
    if len(shape.edges) > 1:
        lengths[0], lengths[1] = (
            np.where(which, lengths[0] / ratio, lengths[0]),
            np.where(which, lengths[1], lengths[1] / ratio),
        )
    else:
        slide = np.where(which, ratio, 1 / ratio)
    values = placed(shape, draw, n, half=_mixed_half(limits, draw, n), lengths=lengths, slide=slide)
    for parameter in shape.energy.parameters:  # such as a strain at which something yields: a ratio that is declared
        if parameter.unit == "1" and not parameter.name.bold:
            values[parameter.label] = values[parameter.label] * by_exponent(draw, _SMALLEST_RATIO, 1.0, n)
    return values


def _offsets(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    values = placed(shape, draw, n, half=_mixed_half(limits, draw, n))
    by = by_exponent(draw, 1.0, limits.offset, n)
    direction = draw.uniform(-1, 1, (3, n))
    for name in shape.points:
        values[name.label] = values[name.label] + direction * by
    for name in shape.sliding if not shape.points else ():
        values[name.label] = values[name.label] + direction[0] * by
    return values


def _sliding(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    values = placed(shape, draw, n, slide=by_exponent(draw, 1 / limits.ratio, 1.0, n))
    shift = by_exponent(draw, 1e-3, 10.0, n) * signs(draw, n)
    for name in shape.sliding:
        values[name.label] = values[name.label] + shift
    return values


def _scales(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    power = max(map(abs, _made_up_for(shape).values()), default=0)
    largest = limits.scale if power < 2 else np.sqrt(limits.scale) * np.sqrt(np.sqrt(limits.scale))
    if power > 2:  # else the parameter itself is out of range
        largest = largest ** (2 / power)
    values = placed(shape, draw, n, half=_mixed_half(limits, draw, n))
    return _scaled(shape, values, by_exponent(draw, 1 / largest, largest, n), compensate=True)


def _beyond(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    values = placed(shape, draw, n, half=_mixed_half(limits, draw, n))
    scale = by_exponent(draw, *limits.beyond, n)
    return _scaled(shape, values, np.where(draw.integers(0, 2, n) == 1, scale, 1 / scale), compensate=False)


def _near_rest(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    return _off_rest(shape, draw, by_exponent(draw, limits.angle / 10, 0.2, n))


def _off_rest(shape: Shape, draw: Draw, by: Array) -> dict[str, Array]:
    """The state of rest with every number off by so much of its size, at most."""
    n = by.size
    size = draw.uniform(0.5, 2.0, n)
    values = at_rest(shape, draw, n, random_frames(draw, n) * size, size, draw.uniform(-1, 1, (3, n)))
    for label, axis in _geometric(shape):
        moved = values[label].copy()
        moved[axis or ...] += by * size * draw.uniform(-1, 1, n)
        values[label] = moved
    return values


def _exact(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    """Integer frames: at rest exactly, a unit in the last place off, and edges at exactly 0, a right angle, and pi."""
    frames, size = exact_frames(draw, n)
    lengths = np.ldexp(1.0, draw.integers(-3, 4, (len(shape.edges), n)))
    angles = draw.integers(0, 3, n)
    base = draw.integers(-2, 3, (3, n)).astype(float)
    half = np.where(angles == 1, 1.0, 0.0)
    values = placed(shape, draw, n, half=half, towards_pi=angles == 2, lengths=lengths, base=0.0, frames=frames)
    for name in shape.points:
        values[name.label] = values[name.label] + base
    if shape.rest() is None:
        return values
    rest = at_rest(shape, draw, n, frames, size, base)
    kind = draw.integers(0, 3, n)
    rows = _geometric(shape)
    nudged = draw.integers(0, len(rows), n)
    side = signs(draw, n) * np.inf
    for at, (label, axis) in enumerate(rows):
        moved = rest[label].copy()
        wide = np.float32 if limits is LIMITS["float32"] else np.float64
        ulp = np.nextafter(moved[axis or ...].astype(wide), side.astype(wide)).astype(float)
        moved[axis or ...] = np.where((kind == 1) & (nudged == at), ulp, moved[axis or ...])
        rest[label] = moved
    return {label: np.where(kind == 2, values[label], rest[label]) for label in values}


def _deviations(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    """Along an axis through the origin, where floats hold deviations as small as any number."""
    frames = np.repeat(np.eye(3)[:, :, None], n, axis=2)
    lengths = np.ldexp(1.0, draw.integers(-1, 2, (len(shape.edges), n)))
    values = placed(shape, draw, n, half=np.zeros(n), lengths=lengths, base=0.0, frames=frames)
    # where the cosine is 1, where theta's square is 0, and far below; not the last numbers before 0, which have few digits left
    # to measure (tests/test_hard_cases.py has them)
    some = np.array([1e-4, 1e-8, 1e-30] if limits is LIMITS["float32"] else [1e-8, 1e-12, 1e-200])
    by = some[draw.integers(0, len(some), n)] * signs(draw, n)
    first, second = shape.edges[:2]
    free = second.tail if second.head in (first.head, first.tail) else second.head
    label = free.label
    moved = values[label].copy()
    moved[1] += by
    return values | {label: moved}


def _without_value(shape: Shape, limits: Limits, draw: Draw, n: int) -> dict[str, Array]:
    """Exact folds and coinciding segments, segments of length zero, sliding coordinates out of order."""
    frames, _ = exact_frames(draw, n)
    lengths = np.ldexp(1.0, draw.integers(-3, 4, (max(1, len(shape.edges)), n)))[: len(shape.edges)]
    kind = draw.integers(0, 3, n)
    if lengths.size:
        lengths[0] = np.where(kind == 0, 0.0, lengths[0])
    slide = np.where(kind == 1, -draw.integers(0, 2, n).astype(float), 1.0)
    values = placed(
        shape, draw, n, half=np.zeros(n), towards_pi=np.ones(n, bool), lengths=lengths, base=0.0, frames=frames, slide=slide
    )  # fmt: skip
    return values


def _has_angle(shape: Shape) -> bool:
    return shape.angle


REGIMES = (
    Regime("moderate", "nothing is hard", _moderate),
    Regime("small angle", "angle from 1e-15 to 1", _small, _has_angle),
    Regime("near pi", "pi minus the angle from 1e-12 to 1", _near_pi, _has_angle),
    Regime("at pi", "pi minus the angle from 1e-15 to 1e-12", _at_pi, _has_angle),
    Regime("right angle", "deviation from the right angle from 1e-15 to 1", _right, _has_angle),
    Regime("equal lengths", "equal segments, angle near 0 or pi", _equal, _has_angle),
    Regime("near rest", "state of rest, each number off by 1e-16 to 0.2", _near_rest, lambda s: s.rest() is not None),
    Regime("ratios", "lengths that differ by up to 1e8", _ratios, lambda s: bool(s.edges)),
    Regime("offsets", "coordinates moved by 1 to 1e12", _offsets),
    Regime("sliding", "sliding coordinates 1e-8 to 1 apart", _sliding, lambda s: bool(s.sliding)),
    Regime("scales", "sizes from 1e-200 to 1e200, results in range", _scales),
    Regime("exact", "at rest, straight and square exactly, and a last place off", _exact),
    Regime("deviations", "straight or folded along an axis but for 1e-8 to 1e-200", _deviations, _has_angle),
    Regime("out of range", "sizes beyond 1e155, where results overflow or vanish", _beyond),
    Regime("without value", "folded exactly, of length zero, out of order", _without_value, lambda s: bool(s.edges)),
)


# -- curves -----------------------------------------------------------------------------------------------------------

_OCTAVES = 50  # 2^-50 is about 1e-15


def curves(energy: Energy) -> tuple[str, ...]:
    """What the error of an energy is followed towards: an angle of 0, of pi, a right angle, or the state of rest."""
    shape = shape_of(energy)
    if vector_parameters(energy):
        return ()
    if shape.angle:
        return ("0", "pi", "right angle")
    return ("rest",) if shape.rest() is not None else ()


def curve_points(energy: Energy, towards: str, orientations: int, seed: int) -> tuple[list[float], Points]:
    """States that approach what is hard, octave by octave, in float64.

    Returns
    -------
    distances
        From what is approached: radians, or shares of the size.
    points
        As many orientations for the first distance, then for the next.
    """
    shape = shape_of(energy)
    draw = np.random.default_rng([seed, zlib.crc32(f"{energy.name}|curve|{towards}".encode())])
    distance = np.ldexp(1.0, -np.arange(_OCTAVES + 1))
    each = np.repeat(distance, orientations)
    if towards == "rest":
        return distance.tolist(), shape.pack(_off_rest(shape, draw, each / 4), "float64")
    half = each / 2
    if towards == "right angle":
        half = (1 - half) / (1 + half)
    side = np.full(each.size, towards == "pi")
    return distance.tolist(), shape.pack(placed(shape, draw, each.size, half=half, towards_pi=side), "float64")
