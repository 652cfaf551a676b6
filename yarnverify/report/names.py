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
_ON_NAME, _ON_SPOT, _THROUGH_SPOT, _ON_LINE, _NEARER = 500.0, 300.0, 60.0, 40.0, 60.0


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
    found: dict[str, tuple[Point, bool]] = {}
    taken: list[Box] = []
    for name in named:
        spot, wide = spots[name], LETTER * len(name)
        others = [spots[other] for other in spots if other != name]

        def cost(shift: Point, spot: Point = spot, wide: float = wide, others: list[Point] = others) -> float:
            box = _box(spot, shift, wide)
            gap = _gap(spot, box)
            total = gap + 0.02 * abs(shift[0]) + _ON_NAME * sum(_overlap(box, other) for other in taken)
            total += _ON_SPOT * sum(_overlap(box, _around(other)) for other in (spot, *others))
            total += _ON_LINE * sum(_overlap(box, _along(*ends)) for ends in lines)
            total += _NEARER * any(_gap(other, box) < gap for other in others)
            if gap > _LED:
                end = spot[0] + shift[0], spot[1] + shift[1]
                total += _THROUGH_SPOT * sum(_meets(spot, end, _around(other)) for other in others)
            outside = max(frame[0] - box[0], frame[1] - box[1], box[2] - frame[2], box[3] - frame[3])
            return total + (1e6 + outside if outside > 0 else 0.0)

        shift = min(_shifts(wide), key=cost)
        box = _box(spot, shift, wide)
        taken.append(box)
        found[name] = shift, _gap(spot, box) > _LED
    return found


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
