"""What is wrong with a block that fails, where it is recognised: the formula, or the digits.

States of the regime "moderate" tell whether the formula is right: nothing there costs digits. What fails only elsewhere is
right, and loses digits, or has no value, where something is small.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.metrics import UNIT
from yarnverify.check.cases import Cases
from yarnverify.check.digits import Digits
from yarnverify.check.factors import Factor
from yarnverify.check.formula import Formula
from yarnverify.check.judge import Block, failing

Array = NDArray[Any]
Status = Literal["pass", "not judged", "wrong", "approximate", "loses digits", "no value"]
_APPROXIMATE = 1e3  # units: what no rounding of a right formula loses where nothing is hard


@dataclass(frozen=True)
class Diagnosis:
    """What is wrong with a block.

    Attributes
    ----------
    status
        ``wrong``: another formula. ``approximate``: a few digits everywhere. ``loses digits``, ``no value``: in some states.
    reasons
        Short sentences, the first the most telling; empty where nothing was recognised.
    factor
        What the truth is multiplied by, where that is all.
    sign
        Of the block against the truth: 1 or -1, 0 where it cannot be told.
    """

    status: Status
    reasons: tuple[str, ...]
    factor: Factor | None = None
    sign: int = 0


class Judge:
    """Says what is wrong with each block of one run."""

    def __init__(self, cases: Cases, blocks: list[Block], printed: Callable[[], dict[str, Array] | None]) -> None:
        self.cases = cases
        plain = cases.of_regime("moderate") & cases.truth.has_derivatives
        self.plain = plain if plain.any() else cases.truth.has_derivatives
        self.formula, self.digits = Formula(cases, blocks, printed, self.plain), Digits(cases)

    def diagnosis(self, block: Block) -> Diagnosis:
        """What is wrong with a block; nothing if it passes."""
        if not block.judged.any():
            return Diagnosis("not judged", ("nothing came back where there is something to be judged",))
        if block.passes:
            return Diagnosis("pass", (), None, 1)
        fails = failing(block, self.cases)
        fails[block.worst] = True
        broken = block.judged & ~np.isfinite(block.computed).all(axis=0)
        idle = self.cases.idle & fails & ~broken
        if idle.any():
            return Diagnosis("wrong", ("is not zero where the energy does not act",))
        plain = self.plain & block.judged
        finite = plain & ~broken
        relative = block.errors * UNIT[self.cases.dtype]
        lost, short = fails & ~broken, self.cases.shorter
        nothing = lost & ~block.computed.any(axis=0) & block.true.any(axis=0)
        others = (nothing & ~short) | (finite & ~nothing & (relative > 1e-3)) if short is not None else nothing
        if nothing.any() and not others.any():
            text = "is zero where the yarn is shorter than at rest: the energy acts there too"
            return Diagnosis("wrong", (text,), None, 1)
        reasons = []
        if finite.any() and (relative[finite] > 1e-3).any():
            found = self.formula.mistake(block, finite)
            return Diagnosis("wrong", (found.text,) if found.text else (), found.factor, found.sign)
        middle = float(np.median(relative[finite])) if finite.any() else 0.0
        if middle > _APPROXIMATE * UNIT[self.cases.dtype] and (fails & finite).sum() * 2 > finite.sum():
            text = (
                self.formula.rounded_right_angle(block, finite)
                or self.formula.laws.added(block, finite)
                or self.digits.precision(block, finite, middle)
            )
            return Diagnosis("approximate", (text,), None, 1)
        if not finite.any() and plain.any():
            return Diagnosis("no value", ("is NaN or infinite even where nothing is hard",))
        if broken.any():
            reasons.append(self.digits.broken(broken))
        if lost.any():
            gross = lost & (relative > 1e-3) & self.cases.of_regime("moderate", "near rest", "exact")
            if gross.any() and (text := self.formula.definite(block, block.computed[:, gross], gross)):
                return Diagnosis("wrong", (text,), None, 1)
            reasons.append(self.digits.loss(block, lost))
        return Diagnosis("loses digits" if lost.any() else "no value", tuple(reasons), None, 1)

    def sums(self, found: list[tuple[Block, Diagnosis]]) -> list[tuple[Block, Diagnosis]]:
        """What was found, with the blocks that are sums of mistaken ones, of which nothing else is known."""
        known = {(block.kind, block.name): diagnosis for block, diagnosis in found}
        left = [block for block, diagnosis in found if diagnosis.status == "wrong" and not diagnosis.reasons]
        while True:
            block = next((block for block in left if self._follows(block, known)), None)
            if block is None:
                return [(block, known[block.kind, block.name]) for block, _ in found]
            text = "is minus the sum of other blocks as they came: no mistake of its own"
            known[block.kind, block.name] = Diagnosis("wrong", (text,))
            left.remove(block)

    def _follows(self, block: Block, known: Mapping[tuple[str, str], Diagnosis]) -> bool:
        """Whether a block is minus the sum of others, of which some are wrong, and it is known how."""
        at = self.plain & block.judged & np.isfinite(block.computed).all(axis=0)
        for row in self.formula.siblings.summed(block, at):
            wrong = [known[block.kind, name] for name in row if known[block.kind, name].status == "wrong"]
            if wrong and all(other.reasons for other in wrong):
                return True
        return False
