"""Where a formula that is right loses digits, or has no value, and by which law."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.metrics import UNIT
from yarnverify.accuracy.shape import shape_of
from yarnverify.check.cases import Cases, angles
from yarnverify.check.factors import goes_on, ratio
from yarnverify.check.judge import Block

Array = NDArray[Any]
_NEAR = 0.1  # rad: a state that is nearer to a special angle than this is near it


class Digits:
    """Losses in words."""

    def __init__(self, cases: Cases) -> None:
        self.cases, self.angle = cases, angles(cases)
        self.single = cases.dtype == "float32"

    def precision(self, block: Block, at: Array, middle: float) -> str:
        values = block.computed[:, at]
        if not self.single and np.array_equal(values, values.astype(np.float32).astype(np.float64)) and values.any():
            return "is in single precision"
        if not self.single and 2.0**-27 < middle < 2.0**-17:
            return (
                "is about as exact as single precision: somewhere a number is float32, a difference quotient is taken, "
                "or a small number is added"
            )
        return f"has about {-np.log10(middle):.0f} digits everywhere: a difference quotient, or a constant that was rounded"

    def _special(self) -> list[tuple[str, Array]]:
        """Special angles and the distance of each state from them."""
        if not np.isfinite(self.angle).any() or not shape_of(self.cases.energy).angle:
            return []
        straight, folded = (
            ("a straight yarn", "a yarn folded back") if goes_on(self.cases) else ("parallel edges", "opposite edges")
        )
        return [(straight, self.angle), (folded, np.pi - self.angle), ("a right angle", np.abs(self.angle - np.pi / 2))]

    def _places(self, at: Array, law: Callable[[Array, Array], str]) -> str:
        """Where some states are, in words: near which angles, or in which regimes."""
        places, left = [], at.copy()
        for name, distance in self._special():
            near = at & (distance < _NEAR)
            if near.sum() >= 2 or (near.any() and near.sum() == at.sum()):
                places.append(f"near {name}{law(near, distance)}")
                left &= ~near
        if left.sum() * 4 > at.sum() or not places:
            states = np.flatnonzero(left if left.any() else at)
            places.append(f"in the hard cases {', '.join(dict.fromkeys(self.cases.regime(int(i)) for i in states))}")
        return " and ".join(places)

    def broken(self, at: Array) -> str:
        def within(near: Array, distance: Array) -> str:
            worst = float(distance[near].max())
            return f" (within {worst:.1g} rad)" if worst > 1e-300 else ""

        return f"is NaN or infinite {self._places(at, within)}"

    def loss(self, block: Block, lost: Array) -> str:
        text = f"loses digits {self._places(lost, lambda near, distance: self._law(block, near, distance))}"
        if "u/angle^" in text and block.kind != "H":
            text += ": a cosine there holds few digits of the angle; take atan2(sine, cosine)"
        elif "u/angle^" in text:
            text += ": large terms cancel there, or the angle comes from a cosine"
        elif "u/angle" in text:
            text += (
                ": what vanishes there is made of rounded directions; take the cross product of the edges themselves"
            )
        return text

    def _law(self, block: Block, at: Array, distance: Array) -> str:
        """How the error grows, where it follows a power of the distance; or where the angle stops."""
        stops = self._stops(block, at, distance)
        if stops:
            return stops
        saturated = block.errors * UNIT[self.cases.dtype] > 0.01  # nothing left to lose
        at = at & ~saturated & (block.errors > 16) & (distance > 1e-15)
        if at.sum() < 5:
            return ""
        slope = -float(np.polyfit(np.log(distance[at]), np.log(block.errors[at]), 1)[0])
        power = round(slope)
        if power not in (1, 2, 3) or abs(slope - power) > 0.35:
            return ""
        return f" (about u/angle{'^' + str(power) if power > 1 else ''})"

    def _stops(self, block: Block, at: Array, distance: Array) -> str:
        """What a threshold does: nothing comes within it, or the angle stays at it, so that the error is a power."""
        at = at & (block.errors * UNIT[self.cases.dtype] > 1e-3) & (distance > 0) & block.true.any(axis=0)
        if at.sum() < 3 or np.ptp(np.log10(distance[at])) < 1:
            return ""
        if not block.computed[:, at].any():
            return f" (is zero within {distance[at].max():.1g} rad)"
        found = ratio(block.computed[:, at], block.true[:, at], 0.05)
        if found is None or np.any(found < 0):
            return ""
        for power in (1, -1, 2, -2):
            limits = (found * distance[at] ** power) ** (1 / power)
            middle = float(np.median(limits))
            if np.all(np.abs(limits - middle) < 0.05 * middle):
                return f" (as if the angle never came nearer than {middle:.2g} rad: its cosine is clamped)"
        return ""
