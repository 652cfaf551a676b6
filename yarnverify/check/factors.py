"""A factor between what came back and what is true: a sign, a number, or a product of lengths, parameters and angles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.shape import Edge, shape_of
from yarnverify.check.cases import Cases, angles
from yarnverify.symbolic.tree import Name

Array = NDArray[Any]
_POWERS = (1, -1, 2, -2)


@dataclass(frozen=True)
class Factor:
    """``number`` times a product of powers; ``powers`` holds names as a person writes them."""

    number: float
    powers: tuple[tuple[str, int], ...] = ()

    @property
    def is_sign(self) -> bool:
        return not self.powers and abs(self.number + 1) < 1e-3

    def __str__(self) -> str:
        parts = [f"{name}^{power}" if power > 1 else name for name, power in self.powers if power > 0]
        below = [f"{name}^{-power}" if power < -1 else name for name, power in self.powers if power < 0]
        number = number_text(self.number)
        if number in ("1", "-1") and parts:
            above = ("-" if number == "-1" else "") + " ".join(parts)
        else:
            above = " ".join([number, *parts])
        bottom = below[0] if len(below) == 1 else f"({' '.join(below)})"
        return f"{above}/{bottom}" if below else above

    @property
    def inverse(self) -> Factor:
        return Factor(1 / self.number, tuple((name, -power) for name, power in self.powers))


_UNITS = (
    (1.0, "", ""), (np.pi, "pi", "pi"), (1 / np.pi, "1/pi", "1/pi"), (2**0.5, "sqrt(2)", "sqrt(2)"),
    (180 / np.pi, "180/pi", "(180/pi)"), ((180 / np.pi) ** 2, "(180/pi)^2", "(180/pi)**2"),
)  # fmt: skip


def number_text(value: float, expression: bool = False) -> str:
    """A number as a small fraction, perhaps of pi, where it is one; as an ``expression`` where all its digits are needed."""
    for unit, name, code in _UNITS:
        nearest = Fraction(value / unit).limit_denominator(24)
        if (
            nearest
            and abs(float(nearest) * unit / value - 1) < (1e-12 if expression else 1e-5)
            and max(abs(nearest.numerator), nearest.denominator) <= (96 if unit < 50 else 1)
        ):
            if not name:
                return str(nearest)
            if abs(nearest) == 1:
                return f"{'-' if nearest < 0 else ''}{code if expression else name}"
            return f"{nearest}*{code}" if expression else f"{nearest} {name}"
    return repr(float(value)) if expression else f"{value:.6g}"


def quantities(cases: Cases) -> dict[str, Array]:
    """What a factor may be made of, at every state: parameters, lengths, differences of sliding coordinates, the angle."""
    shape = shape_of(cases.energy)
    rows = dict(cases.labels)
    found: dict[str, Array] = {name: value for name, value in cases.points.parameters.items() if value.ndim == 1}
    for edge in _edges(cases):
        difference = cases.points.q[rows[edge.head.label]] - cases.points.q[rows[edge.tail.label]]
        found[f"|{edge.head.label} - {edge.tail.label}|"] = np.sqrt((difference**2).sum(axis=0))
    if len(_edges(cases)) == 2:  # what stands in for the rest length in other discretisations
        first, second = (name for name in found if name.startswith("|"))
        found[f"({first} + {second})"] = found[first] + found[second]
    for a, b in combinations(shape.sliding, 2):
        found[_difference(cases, a, b)] = np.abs(
            cases.points.q[rows[a.label].start] - cases.points.q[rows[b.label].start]
        )
    if shape.angle:
        angle = angles(cases)
        found |= {
            "angle": angle,
            "(pi - angle)": np.pi - angle,
            "sin(angle)": np.sin(angle),
            "cos(angle)": np.abs(np.cos(angle)),
        }
        if not goes_on(cases):  # the right angle is the rest
            found["|angle - pi/2|"] = np.abs(angle - np.pi / 2)
        found |= {"sin(angle/2)": np.sin(angle / 2), "tan(angle/2)": np.tan(angle / 2)}
    return found


def _edges(cases: Cases) -> list[Edge]:
    """The edges between unknown points; others go to a point that is a parameter."""
    rows = dict(cases.labels)
    return [edge for edge in shape_of(cases.energy).edges if edge.head.label in rows and edge.tail.label in rows]


def curvatures(cases: Cases) -> dict[str, Array]:
    """What a factor may be made of where another measure stands for the angle, and another length for the yarn's."""
    found = quantities(cases)
    if not shape_of(cases.energy).angle:
        return {}
    angle = found["angle"]
    plain = {name: value for name, value in found.items() if "angle" not in name}
    with np.errstate(all="ignore"):
        return plain | {
            "(tan(angle/2)/angle)": np.tan(angle / 2) / angle,
            "(sin(angle/2)/angle)": np.sin(angle / 2) / angle,
            "(sin(angle)/angle)": np.sin(angle) / angle,
            "cos(angle/2)": np.cos(angle / 2),
        }


def _difference(cases: Cases, a: Name, b: Name) -> str:
    values = cases.points.q[dict(cases.labels)[a.label].start] - cases.points.q[dict(cases.labels)[b.label].start]
    return f"({a.label} - {b.label})" if np.median(values) > 0 else f"({b.label} - {a.label})"


def goes_on(cases: Cases) -> bool:
    """Whether the angle is that by which a yarn turns at a point, rather than that between two edges of the point."""
    shape = shape_of(cases.energy)
    if not shape.angle:
        return False
    first, second = shape.edges[:2]
    return first.tail == second.head or second.tail == first.head


def terms(cases: Cases, size: int) -> dict[str, Array]:
    """Vectors or matrices that formulas are made of, (size, n): directions d_i, projections P_i, and their products."""
    shape, rows, n = shape_of(cases.energy), dict(cases.labels), len(cases)
    if size not in (3, 9):
        return {}
    common = shape.edges[0].tail if shape.edges else None
    directions: dict[str, Array] = {}
    for edge in _edges(cases):
        step = cases.points.q[rows[edge.head.label]] - cases.points.q[rows[edge.tail.label]]
        far = edge.tail if edge.head == common else edge.head
        with np.errstate(all="ignore"):
            directions[far.sub or far.label] = step / np.sqrt((step**2).sum(axis=0))
    across = {
        (a, b): directions[b] - directions[a] * (directions[a] * directions[b]).sum(axis=0)
        for a in directions
        for b in directions
        if a != b
    }
    if size == 3:
        return {f"d_{a}": d for a, d in directions.items()} | {f"P_{a} d_{b}": v for (a, b), v in across.items()}
    one = np.broadcast_to(np.eye(3)[:, :, None], (3, 3, n))
    found: dict[str, Array] = {"the unit matrix": one}
    for a, d in directions.items():
        found[f"d_{a} d_{a}^T"] = _dyad(d, d)
        found[f"P_{a}"] = one - _dyad(d, d)
    for (a, b), v in across.items():
        found[f"P_{a} d_{b} d_{b}^T P_{a}"] = _dyad(v, v)
        found[f"P_{a} d_{b} d_{a}^T"] = _dyad(v, directions[a])
        found[f"d_{a} d_{b}^T P_{a}"] = _dyad(directions[a], v)
        found[f"P_{a} d_{b} d_{a}^T + d_{a} d_{b}^T P_{a}"] = _dyad(v, directions[a]) + _dyad(directions[a], v)
        found[f"P_{a} d_{b} d_{a}^T P_{b}"] = _dyad(v, across[b, a])
        found[f"P_{a} P_{b}"] = np.einsum(
            "ijn,jkn->ikn", one - _dyad(directions[a], directions[a]), one - _dyad(directions[b], directions[b])
        )
        found[f"d_{a} d_{b}^T"] = _dyad(directions[a], directions[b])
    return {name: value.reshape(9, n) for name, value in found.items()}


def _dyad(a: Array, b: Array) -> Array:
    return np.asarray(a[:, None] * b[None])


def ratio(computed: Array, true: Array, tolerance: float) -> Array | None:
    """(n,) what the truth must be multiplied by, where that is one number a state; None where it is not."""
    with np.errstate(all="ignore"):
        square = (true * true).sum(axis=0)
        found = (computed * true).sum(axis=0) / square
        left = np.sqrt(((computed - found * true) ** 2).sum(axis=0)) / np.sqrt(square)
    if not np.isfinite(found).all() or np.any(left > tolerance * np.abs(found)) or np.any(found == 0):
        return None
    return np.asarray(found)


def factor(values: Array, named: Mapping[str, Array], tolerance: float) -> Factor | None:
    """The product that a ratio is at all states, of at most three quantities; None where it is none."""
    with np.errstate(all="ignore"):
        if _constant(values, tolerance):
            return Factor(float(np.median(values)))
        if not np.isfinite(values).all() or not (np.all(values > 0) or np.all(values < 0)):
            return None
        live = {name: value for name, value in named.items() if np.isfinite(value).all() and np.all(value > 0)}
        names = [(name, power) for name in live for power in _POWERS]
        if not names:
            return None
        logs = np.array([power * np.log(live[name].astype(float)) for name, power in names])
    target = np.log(np.abs(values))
    most = 3 if len(values) >= 4 else 2  # fewer states fit a product of three by chance
    for count in range(1, most + 1):
        for places in _products(
            names, logs - logs.mean(axis=1, keepdims=True), target - target.mean(), count, tolerance
        ):
            number = values / np.exp(logs[list(places)].sum(axis=0))
            if _constant(number, tolerance):
                return Factor(float(np.median(number)), tuple(names[place] for place in places))
    return None


def _products(
    names: list[tuple[str, int]], logs: Array, target: Array, count: int, tolerance: float
) -> Iterator[tuple[int, ...]]:
    """Places of ``count`` quantities whose logarithms add up to a target, all less their means."""
    firsts = list(combinations(range(len(names)), count - 1))
    for first in firsts:
        if len({names[place][0] for place in first}) < len(first):
            continue
        start = first[-1] + 1 if first else 0
        gap = np.abs(logs[start:] - (target - logs[list(first)].sum(axis=0))).max(axis=1, initial=0.0)
        for place in start + np.flatnonzero(gap <= 2 * tolerance):
            if names[place][0] not in {names[i][0] for i in first}:
                yield (*first, int(place))


def _constant(values: Array, tolerance: float) -> bool:
    middle = np.median(values)
    return bool(
        np.isfinite(values).all() and middle != 0 and np.all(np.abs(values - middle) <= tolerance * abs(middle))
    )
