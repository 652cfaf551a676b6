"""States at which formulas are tried: exact, generic, inside the assumptions, and kind to square roots."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from yarnverify.symbolic.algebraic import UndefinedError
from yarnverify.symbolic.declare import Assumption
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.forward import Evaluation
from yarnverify.symbolic.numbers import Rationals
from yarnverify.symbolic.tree import Name

_QUATERNIONS = [
    (1, 1, 1, 0),
    (1, 1, 0, 1),
    (2, 1, 0, 1),
    (1, 2, 1, 1),
    (2, 1, 1, 1),
    (1, -2, 2, 0),
    (3, 1, 1, 0),
    (2, 3, 1, 1),
]
_TRIPLES = [(4, 3), (-3, 4), (12, 5), (5, -12), (-15, 8), (-7, 24), (21, 20), (-4, 3)]
_REDRAWN = 20  # times that a state is drawn anew because two of its scalars are alike
_QUADRUPLES = [(1, 2, 2), (2, 3, 6), (1, 4, 8), (4, 4, 7), (2, 6, 9), (6, 6, 7), (3, 4, 12)]


@dataclass(frozen=True)
class StateMaker:
    """Draws states at which lengths and sines of the segments at the first point are rational.

    Coordinates are integers and scalars are multiples of 1/4, so that every state is exact in double precision too.
    """

    section: Section
    names: Sequence[Name]
    positive: frozenset[Name] = frozenset()

    def states(self, seed: int = 0, tries: int = 20000, wide: bool = False) -> Iterator[dict[Name, Any]]:
        """States that satisfy the section's assumptions, without end; ends when none is found any more.

        Those called wide have segments short and long against the scalars, at any angle, and scalars of any size.
        """
        draw = random.Random(seed)
        since = 0
        while since < tries:
            state = self._draw(draw, since, wide)
            if self._admissible(state):
                since = 0
                yield state
            since += 1

    def _draw(self, draw: random.Random, attempt: int, wide: bool) -> dict[Name, Any]:
        scalars: list[Fraction] = []
        for _ in range(_REDRAWN):
            state = self._points(draw, wide)
            scalars = [self._scalar(draw, name, attempt, wide) for name in self.names if not name.bold]
            if len(set(scalars)) == len(scalars):
                break
        used: set[Fraction] = set()
        for name, value in zip((n for n in self.names if not n.bold), scalars, strict=True):
            while value in used:  # many scalars are never all different by chance
                value += Fraction(1, 4)
            used.add(value)
            state[name] = value
        return state

    def _points(self, draw: random.Random, wide: bool) -> dict[Name, Any]:
        state: dict[Name, Any] = {}
        a, b, c, d = draw.choice(_QUATERNIONS)
        frame = np.array(
            [
                [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
                [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
                [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
            ],
            dtype=object,
        )
        for index, name in enumerate(n for n in self.names if n.bold):
            if index == 0:
                base = np.array([draw.randrange(-3, 4) for _ in range(3)], dtype=object)
                state[name] = tuple(Fraction(int(v)) for v in base)
                continue
            if index == 1:
                local = [1, 0, 0]
            elif index == 2 and wide:
                m, n = draw.randrange(1, 30), draw.randrange(1, 30)
                local = [m * m - n * n, 2 * m * n, 0]
            elif index == 2:
                local = [*draw.choice(_TRIPLES), 0]
            else:
                local = list(draw.choice(_QUADRUPLES))
                draw.shuffle(local)
                local = [v * draw.choice((-1, 1)) for v in local]
            edge = frame @ np.array(local, dtype=object) * draw.choice((1, 2, 3) if index == 1 else (1, 2))
            size = Fraction(2) ** draw.randrange(-12, 3) if wide else Fraction(1)
            state[name] = tuple(Fraction(int(v)) + int(e) * size for v, e in zip(base, edge, strict=True))
        return state

    def _scalar(self, draw: random.Random, name: Name, attempt: int, wide: bool) -> Fraction:
        if wide:
            size = draw.randrange(1, 128) * Fraction(2) ** draw.randrange(-12, 3)
            return size if name in self.positive else size * draw.choice((-1, 1))
        low = 1 if name in self.positive else -20
        width = 20 + attempt // 50  # widened when the assumptions are hard to meet
        return Fraction(draw.randrange(low, low + width + 20) or 1, 4)

    def _admissible(self, state: dict[Name, Any]) -> bool:
        try:
            evaluation = Evaluation(self.section, state, Rationals(0))
            return all(holds(evaluation, assumption) for assumption in self.section.assumptions)
        except UndefinedError:
            return False


def holds(evaluation: Evaluation, assumption: Assumption) -> bool:
    """Whether an assumption is met at a state."""
    difference = evaluation.value(assumption.left) - evaluation.value(assumption.right)
    return evaluation.numbers.positive(difference) or (not assumption.strict and difference == 0)
