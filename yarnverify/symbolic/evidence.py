"""The second reading's part of a trial: states, how two sides compare at them, and balls that certify a difference."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import islice
from typing import Any

import flint

from yarnverify.symbolic.algebraic import NoValueError, UndefinedError
from yarnverify.symbolic.forward import Evaluation, entries
from yarnverify.symbolic.numbers import Balls, Rationals
from yarnverify.symbolic.sections import Section
from yarnverify.symbolic.signs import Signature, in_floats, lie_of, side_of, sided
from yarnverify.symbolic.states import StateMaker
from yarnverify.symbolic.tree import Expr, Name, paired

EXACT_STATES = 3  # the second reading's; each is a proof of difference, or one more agreement
_TRIES = 16 * EXACT_STATES  # states drawn in search of such at which both sides have a value
_WIDE = 160  # states drawn in search of the other side of an absolute value or root
_SIDES = 24  # states at which a claim is compared that has several sides
_LOOKED_AT = 2  # states at which what is proved is enclosed by balls
BALL_BITS = (128, 512, 2048, 8192, 32768)
FEW_BITS = BALL_BITS[:2]


@dataclass(frozen=True)
class Witness:
    """A state at which two sides differ, and their enclosed values there."""

    state: dict[Name, Any]
    left: tuple[Any, ...]
    right: tuple[Any, ...]


@dataclass(frozen=True)
class Comparison:
    """How two sides compare at exact states.

    ``seen`` counts the states at which both had a value; ``differs`` are those at which these were not equal;
    ``lacks_value`` are those at which only the left side has a value, with the error of the right one.
    """

    seen: int
    differs: tuple[dict[Name, Any], ...] = ()
    lacks_value: tuple[tuple[dict[Name, Any], UndefinedError], ...] = ()


class Evidence:
    """States of one section, and what is seen at them.

    Parameters
    ----------
    section
        Whose definitions and assumptions hold.
    energy
        The tree that forces and Jacobians are taken from.
    names, positive
        Unknowns and parameters, and which parameters are never negative.
    """

    def __init__(self, section: Section, energy: Expr, names: Sequence[Name], positive: frozenset[Name]) -> None:
        self.section, self.energy, self.names, self.positive = section, energy, names, positive

    @cached_property
    def maker(self) -> StateMaker:
        return StateMaker(self.section, self.names, self.positive)

    @cached_property
    def exact(self) -> list[Evaluation]:
        """Evaluations over rationals at many states, those with the smallest numbers first."""
        states = sorted(islice(self.maker.states(seed=1), _TRIES), key=_spread)
        return [Evaluation(self.section, state, Rationals(seed), self.energy) for seed, state in enumerate(states)]

    @staticmethod
    def sides(evaluation: Evaluation, left: Expr, right: Expr) -> list[tuple[Any, Any]]:
        """Components of both sides at one state."""
        return paired(left, right, entries(evaluation.value(left)), entries(evaluation.value(right)))

    @cached_property
    def wide(self) -> list[Evaluation]:
        """Evaluations over rationals at states that are drawn from a wider range than those of ``exact``."""
        states = islice(self.maker.states(seed=2, wide=True), _WIDE if self.exact else 0)
        return [Evaluation(self.section, state, Rationals(seed), self.energy) for seed, state in enumerate(states)]

    @cached_property
    def everywhere(self) -> list[Evaluation]:
        return [*self.exact, *self.wide]

    @cached_property
    def floats(self) -> list[Evaluation]:
        return [in_floats(evaluation) for evaluation in self.everywhere]

    @cached_property
    def _sides(self) -> dict[Expr, list[int]]:
        return {}

    @cached_property
    def _lies(self) -> list[Signature]:
        return [lie_of(evaluation) for evaluation in self.floats]

    def other_sides(self, left: Expr, right: Expr, hidden: bool) -> list[Evaluation]:
        """States on different sides of the absolute values and roots of two trees; none where they have one side only.

        With ``hidden``, also where nothing is seen to have sides: roots of squares have them as well.
        """
        blocks = any(node.op in {"force", "energy", "derivative"} for side in (left, right) for node in side.walk())
        nodes = sided(self.section, (left, right, self.energy) if blocks else (left, right))
        if not nodes and not hidden:
            return []
        for node in nodes:
            if node not in self._sides:
                self._sides[node] = [side_of(evaluation, node) for evaluation in self.floats]
        sides = list(zip(*(self._sides[node] for node in nodes), strict=True)) or [()] * len(self.floats)
        if not hidden and len(set(sides)) == 1 and not any(node.op == "sqrt" for node in nodes):
            return []
        chosen: dict[Any, Evaluation] = {}
        for keys in (sides, zip(sides, self._lies, strict=True)):
            for key, evaluation in zip(keys, self.everywhere, strict=True):
                chosen.setdefault(key, evaluation)
        return list({id(evaluation): evaluation for evaluation in chosen.values()}.values())[:_SIDES]

    def compare(self, left: Expr, right: Expr, others: Iterable[Evaluation] = ()) -> Comparison:
        """Compare two sides at exact states, until enough were seen at which both have a value, and at others."""
        seen = 0
        differs: list[dict[Name, Any]] = []
        lacks_value: list[tuple[dict[Name, Any], UndefinedError]] = []

        def look(evaluation: Evaluation) -> None:
            nonlocal seen
            try:
                pairs = self.sides(evaluation, left, right)
            except UndefinedError as error:
                if not self.undefined_at(evaluation, left):
                    lacks_value.append((dict(evaluation.state), error))
                return
            seen += 1
            if any(a != b for a, b in pairs):
                differs.append(dict(evaluation.state))

        for evaluation in self.exact:
            look(evaluation)
            if seen == EXACT_STATES or differs:
                break
        for evaluation in others:
            look(evaluation)
        return Comparison(seen, tuple(differs), tuple(lacks_value))

    @staticmethod
    def undefined_at(evaluation: Evaluation, *trees: Expr) -> bool:
        try:
            for tree in trees:
                evaluation.value(tree)
        except UndefinedError:
            return True
        return False

    def certify(
        self, state: dict[Name, Any], left: Expr, right: Expr, precisions: Iterable[int] = BALL_BITS
    ) -> Witness | None:
        """The witness at a state, if balls of some precision show that the sides differ there.

        They also do where the left side has a value and the right one certainly has none.
        """
        before = flint.ctx.prec
        try:
            for bits in precisions:
                flint.ctx.prec = bits
                evaluation = Evaluation(self.section, state, Balls(), self.energy)
                try:
                    pairs = self.sides(evaluation, left, right)
                except UndefinedError:
                    if self._lacks_value(evaluation, left, right):
                        return Witness(state, (), ())
                    continue
                if any(not a.overlaps(b) for a, b in pairs):
                    return Witness(state, tuple(a for a, _ in pairs), tuple(b for _, b in pairs))
        finally:
            flint.ctx.prec = before
        return None

    @cached_property
    def balls(self) -> list[Evaluation]:
        """Where what is proved is looked at once more, with true angles and pi."""
        return [Evaluation(self.section, e.state, Balls(), self.energy) for e in self.exact[:_LOOKED_AT]]

    def apart(self, evaluation: Evaluation, left: Expr, right: Expr) -> bool:
        with flint.ctx.workprec(FEW_BITS[0]):
            try:
                return any(not a.overlaps(b) for a, b in self.sides(evaluation, left, right))
            except UndefinedError:
                return False

    @staticmethod
    def _lacks_value(evaluation: Evaluation, left: Expr, right: Expr) -> bool:
        try:
            if not all(part.is_finite() for part in entries(evaluation.value(left))):
                return False
        except UndefinedError:
            return False
        try:
            evaluation.value(right)
        except NoValueError:
            return True
        except UndefinedError:
            return False
        return False


def _spread(state: dict[Name, Any]) -> Fraction:
    """Sum of squared coordinates: small states are pleasant to read and to type in."""
    return sum(
        (part * part for value in state.values() for part in (value if isinstance(value, tuple) else (value,))),
        Fraction(0),
    )
