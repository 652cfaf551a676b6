"""What a block is in terms of the other blocks: one of them, transposed, or a sum from which one was left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.check.judge import Block
from yarnverify.symbolic.declare import Energy

Array = NDArray[Any]
Same = Callable[[Array, Array], bool]


class Siblings:
    """Comparisons with the other blocks of the same output.

    Parameters
    ----------
    energy, blocks
        Which energy, and everything that came back.
    same
        Whether two arrays, (size, n), are the same.
    """

    def __init__(self, energy: Energy, blocks: Sequence[Block], same: Same) -> None:
        self.blocks, self._same = {(block.kind, block.name): block for block in blocks}, same
        self.points = [name.label for name in energy.unknowns if name.bold] if "translation" in energy.unchanged else []

    def explained(self, block: Block, computed: Array, at: Array) -> str:
        """In words; empty where nothing fits."""
        for test in (self._transposed, self._summand, self._other_block):
            text = test(block, computed, at)
            if text:
                return text
        return ""

    def _others(self, block: Block) -> list[Block]:
        return [
            other
            for other in self.blocks.values()
            if other.kind == block.kind and other.name != block.name and other.true.shape == block.true.shape
        ]

    def _transposed(self, block: Block, computed: Array, at: Array) -> str:
        if block.kind != "H" or block.computed.shape[0] != 9:
            return ""
        return "is transposed" if self._same(computed, _turned(block.true)[:, at]) else ""

    def _summand(self, block: Block, computed: Array, at: Array) -> str:
        """The blocks of a row add up to zero where a translation changes nothing: a sum from which one was left out."""
        rest = computed - block.true[:, at]
        for other in self._others(block):
            true = other.true[:, at]
            if self._same(rest, true):
                return f"lacks minus {spelled(other.name)}: it is left out of a sum"
            if self._same(rest, -2 * true) or self._same(rest, 2 * true):
                return f"holds {spelled(other.name)} with the wrong sign"
            if block.kind == "H" and true.shape[0] == 9 and self._same(-rest, true + _turned(other.true)[:, at]):
                mirrored = ", ".join(reversed(other.name.split(",")))
                return f"lacks {spelled(other.name)} and {mirrored}: they are left out of a sum"
        return ""

    def _other_block(self, block: Block, computed: Array, at: Array) -> str:
        for other in self._others(block):
            if self._same(computed, other.true[:, at]):
                return f"is the block {spelled(other.name)}: indices are swapped"
        return ""

    def summed(self, block: Block, at: Array) -> list[list[str]]:
        """The other blocks of its row, and of its column, where it is minus the sum of these as they came."""
        found = []
        parts = block.name.split(",")
        for place, name in enumerate(parts):
            if name not in self.points:
                continue
            row = [",".join([*parts[:place], other, *parts[place + 1 :]]) for other in self.points if other != name]
            others = [self.blocks[block.kind, other] for other in row if (block.kind, other) in self.blocks]
            values = [other.computed[:, at] for other in others if other.judged[at].all()]
            if len(values) == len(row) and self._same(block.computed[:, at], -np.sum(values, axis=0)):
                found.append(row)
        return found


def _turned(values: Array) -> Array:
    return values.reshape(3, 3, -1).swapaxes(0, 1).reshape(9, -1)


def spelled(name: str) -> str:
    """A block's name in a sentence."""
    return name.replace(",", ", ")


def triangle(computed: Array, true: Array, tolerance: float) -> str:
    """What was done to a whole Hessian, (m, m, n) in somebody's own order: one triangle of it, or a sum with its transpose.

    Parameters
    ----------
    computed, true
        What came, and what is true, in states where nothing is hard.
    tolerance
        Relative to the largest entry of a state.

    Returns
    -------
    text
        Empty where nothing of that kind was done.
    """
    rows = np.arange(len(true))
    above = np.broadcast_to((rows[:, None] < rows)[..., None], true.shape)
    scale = np.abs(true).max(axis=(0, 1), keepdims=True)

    def same(part: Array, factor: float) -> bool:
        return bool((np.abs(computed - factor * true) <= tolerance * scale)[part].all())

    on = np.broadcast_to((rows[:, None] == rows)[..., None], true.shape)
    if not np.isfinite(computed).all() or not same(on, 1.0) or (same(above, 1.0) and same(~above & ~on, 1.0)):
        return ""
    below = ~above & ~on
    for size, (name, given, left) in product((1.0, 2.0), (("upper", above, below), ("lower", below, above))):
        if same(given, size) and same(left, 0.0):
            doubled = " and is doubled off the diagonal" if size == 2 else ""
            return f"only the {name} triangle of the Hessian came{doubled}: fill in the other one"
    for size, words in ((2.0, "doubled, as of a sum with its transpose"), (0.5, "halved")):
        if same(above | below, size):
            return f"the Hessian is {words}, but for its diagonal"
    return ""
