"""How pictures mark who is who: by marker, line and name, with colour on top; and where names are put."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

NONE_LEFT = 2.0**53  # an error of so many units leaves no correct digit


@dataclass(frozen=True)
class Mark:
    """Marker, dash pattern and colour of one contestant."""

    marker: str
    line: Any
    colour: str


# colours of Okabe and Ito, which the colour-blind can tell apart; markers and lines do without them
_MARKS = {
    "accurate": Mark("o", "-", "#0072B2"),
    "fast": Mark("s", (0, (5, 1.5)), "#E69F00"),
    "reference": Mark("D", (0, (7, 1.5, 1.5, 1.5)), "#009E73"),
    "differentiated": Mark("^", (0, (1, 1.2)), "#D55E00"),
    "printed": Mark("v", (0, (3, 1, 1, 1, 1, 1)), "#CC79A7"),
    "accurate compiled": Mark("*", "-", "#0072B2"),
    "fast compiled": Mark("d", (0, (5, 1.5)), "#E69F00"),
    "lambdify": Mark("<", (0, (4, 3)), "#7F6000"),
    "jax": Mark("P", (0, (2, 2)), "#56B4E9"),
    "jax as written": Mark(">", (0, (2, 4)), "#56B4E9"),
    "casadi": Mark("X", (0, (6, 3)), "#882255"),
    "numba": Mark("p", (0, (1, 2)), "#117733"),
    "differences": Mark("h", (0, (3, 3)), "#666666"),
}
_OTHERS = (Mark(">", "-", "#000000"), Mark("1", "--", "#444444"), Mark("8", ":", "#222222"), Mark("H", "-.", "#333333"))


def mark(name: str, names: Sequence[str]) -> Mark:
    """The mark of a contestant; one that is not known gets a spare mark by its place among the unknown."""
    if name in _MARKS:
        return _MARKS[name]
    unknown = [each for each in names if each not in _MARKS]
    return _OTHERS[unknown.index(name) % len(_OTHERS)]


def spaced(wanted: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Places near the wanted ones, at least a gap apart and in the same order, within limits if they fit.

    Neighbours that are too close form a group, which is centred on the mean of what its members want.
    """
    order = sorted(range(len(wanted)), key=lambda i: wanted[i])
    groups: list[list[int]] = []
    centres: list[float] = []

    def centre(group: list[int]) -> float:
        half = gap * (len(group) - 1) / 2
        mean = sum(wanted[i] for i in group) / len(group)
        return max(low + half, min(high - half, mean))

    for i in order:
        groups.append([i])
        centres.append(centre([i]))
        while len(groups) > 1 and (
            centres[-1] - centres[-2] < gap * (len(groups[-1]) + len(groups[-2])) / 2 - 1e-9 * gap
        ):
            last = groups.pop()
            groups[-1] += last
            centres.pop()
            centres[-1] = centre(groups[-1])
    places = [0.0] * len(wanted)
    for group, middle in zip(groups, centres, strict=True):
        for k, i in enumerate(group):
            places[i] = middle + gap * (k - (len(group) - 1) / 2)
    return places


def front(points: dict[str, tuple[float, float]]) -> list[str]:
    """The Pareto front: those that nobody beats in one respect without losing in the other; from left to right.

    Parameters
    ----------
    points
        Name to (cost, error), both better when smaller.
    """

    def beaten(name: str) -> bool:
        x, y = points[name]
        return any(a <= x and b <= y and (a, b) != (x, y) for a, b in points.values())

    return sorted((name for name in points if not beaten(name)), key=lambda name: (points[name], name))
