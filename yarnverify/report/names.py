"""Where the names of some spots in a plot go: near their spot, clear of spots, lines and other names. Lengths in points."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

Point = tuple[float, float]
Box = tuple[float, float, float, float]  # left, bottom, right, top

LETTER, HIGH = 5.4, 8.0  # the width of a bold letter and the height of a name, at the size of names
_SPOT = 4.5  # half the size of a spot
_LED = 9.0  # a name farther away than this from its spot has a leader
# what a place costs beside its distance: whatever hides something counts most
_ON_NAME, _ON_SPOT, _THROUGH_NAME, _THROUGH_SPOT, _CROSSING, _ON_LINE, _NEARER = (
    500.0,
    300.0,
    150.0,
    60.0,
    60.0,
    40.0,
    60.0,
)
_ROUNDS = 5


def places(
    named: Iterable[str], spots: Mapping[str, Point], lines: Sequence[tuple[Point, Point]], frame: Box
) -> dict[str, tuple[Point, bool]]:
    """The middle of each name as seen from its spot, and whether a leader goes there.

    Parameters
    ----------
    named
        Whose names are wanted; the first have the first choice.
    spots
        Name to where its spot is, of those without a name too.
    lines
        Ends of lines that run straight up or across; a name covers none, if it can be helped.
    frame
        What names stay within.
    """
    named, found = list(named), dict[str, Point]()
    for _ in range(_ROUNDS):  # the first have the first choice; then each moves to where it is best among the others
        before = dict(found)
        for name in named:
            taken = {other: shift for other, shift in found.items() if other != name}
            found[name] = min(_shifts(_width(name)), key=lambda shift: _cost(name, shift, spots, lines, frame, taken))
        if found == before:
            break
    return {name: (shift, _led(name, spots[name], shift)) for name, shift in found.items()}


def _cost(
    name: str,
    shift: Point,
    spots: Mapping[str, Point],
    lines: Sequence[tuple[Point, Point]],
    frame: Box,
    taken: Mapping[str, Point],
) -> float:
    """How bad a place is, with other names where they are."""
    spot, others = spots[name], [spots[other] for other in spots if other != name]
    box = _box(spot, shift, _width(name))
    outside = max(frame[0] - box[0], frame[1] - box[1], box[2] - frame[2], box[3] - frame[3])
    if outside > 0:
        return 1e6 + outside
    gap, end = _gap(spot, box), _end(spot, shift)
    total = gap + 0.02 * abs(shift[0])
    total += _ON_SPOT * sum(_overlap(box, _around(other)) for other in (spot, *others))
    total += _ON_LINE * sum(_overlap(box, _along(*ends)) for ends in lines)
    total += _NEARER * any(_gap(other, box) < gap for other in others)
    led = gap > _LED
    if led:
        total += _THROUGH_SPOT * sum(_meets(spot, end, _around(other)) for other in others)
    for other, there in taken.items():
        place, from_there = _box(spots[other], there, _width(other)), _end(spots[other], there)
        total += _ON_NAME * _overlap(box, place)
        total += _THROUGH_NAME * (led and _meets(spot, end, place))
        if _led(other, spots[other], there):
            total += _THROUGH_NAME * _meets(spots[other], from_there, box)
            total += _CROSSING * (led and _cross(spot, end, spots[other], from_there))
    return total


def _width(name: str) -> float:
    return LETTER * len(name)


def _end(spot: Point, shift: Point) -> Point:
    return spot[0] + shift[0], spot[1] + shift[1]


def _led(name: str, spot: Point, shift: Point) -> bool:
    return _gap(spot, _box(spot, shift, _width(name))) > _LED


def _cross(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether two lines between points cross."""

    def left(p: Point, q: Point, r: Point) -> bool:
        return (q[0] - p[0]) * (r[1] - p[1]) > (q[1] - p[1]) * (r[0] - p[0])

    return left(a, b, c) != left(a, b, d) and left(c, d, a) != left(c, d, b)


def _shifts(wide: float) -> list[Point]:
    beside = [(side * (7 + wide / 2), dy) for side in (1, -1) for dy in (0.0, 3.0, -3.0)]
    return beside + [(8.0 * i, 4.5 * j) for j in range(-20, 21) for i in range(-15, 16)]


def _box(spot: Point, shift: Point, wide: float) -> Box:
    x, y = spot[0] + shift[0], spot[1] + shift[1]
    return x - wide / 2, y - HIGH / 2, x + wide / 2, y + HIGH / 2


def _gap(spot: Point, box: Box) -> float:
    return math.hypot(max(box[0] - spot[0], spot[0] - box[2], 0.0), max(box[1] - spot[1], spot[1] - box[3], 0.0))


def _around(spot: Point) -> Box:
    return spot[0] - _SPOT, spot[1] - _SPOT, spot[0] + _SPOT, spot[1] + _SPOT


def _along(a: Point, b: Point) -> Box:
    return min(a[0], b[0]) - 0.5, min(a[1], b[1]) - 0.5, max(a[0], b[0]) + 0.5, max(a[1], b[1]) + 0.5


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _meets(start: Point, end: Point, box: Box) -> bool:
    """Whether a straight line meets a box; Liang and Barsky (1984)."""
    first, last = 0.0, 1.0
    for axis in (0, 1):
        step = end[axis] - start[axis]
        low, high = box[axis] - start[axis], box[axis + 2] - start[axis]
        if step == 0:
            if low > 0 or high < 0:
                return False
            continue
        enter, leave = sorted((low / step, high / step))
        first, last = max(first, enter), min(last, leave)
    return first < last
