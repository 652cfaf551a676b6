"""The smallest single-term change that makes a refuted chain true.

Every node of the printed chain is changed in every way of a fixed list, cheapest first: a symbol that nothing defines, a
sign, a transpose, an index, a number, a power, a norm, a swapped function or symbol, a missing or an extra factor, the
name of the block itself. A candidate must
have the right shapes; one that is off in double precision at a random state is dropped; the first one that is PROVED, for
every claim of its chain, is the repair.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from yarnverify.symbolic.algebraic import UndefinedError
from yarnverify.symbolic.changes import Candidate, Changes, block_named
from yarnverify.symbolic.court import Court, Verdict
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.forward import Evaluation
from yarnverify.symbolic.latex import latex, name_latex
from yarnverify.symbolic.numbers import Floats
from yarnverify.symbolic.tree import Expr, ShapeError, Type, number

Sides = list[tuple[Expr, Expr]]
_FLOAT_TOLERANCE = 1e-6  # sorts out candidates; whatever passes is proved exactly, or dropped


@dataclass(frozen=True)
class Repair:
    """A change, in words and as the corrected chain."""

    members: tuple[Expr, ...]
    change: str
    before: Expr
    after: Expr


class Workshop:
    """Tries changes of one chain.

    Parameters
    ----------
    court
        Judges the candidates.
    members
        The printed chain.
    sides
        The claims that a chain makes, as pairs that must be equal.
    fixed
        How many members at its beginning are not in doubt.
    """

    def __init__(
        self, court: Court, members: tuple[Expr, ...], sides: Callable[[tuple[Expr, ...]], Sides], fixed: int = 0
    ) -> None:
        self.court, self.members, self.sides, self.fixed = court, members, sides, fixed
        self.section: Section = court.section
        self._states: dict[Court, list[Evaluation]] = {}

    def find(self) -> Repair | None:
        """The cheapest change that is proved, or None."""
        changes = Changes(self.section, self.court.names, self.members, self.fixed)
        seen: set[tuple[Expr, ...]] = {self.members}
        for candidate in sorted(changes.candidates(), key=lambda c: (c.cost, c.adds_sign)):
            if candidate.members in seen:
                continue
            seen.add(candidate.members)
            if self._hopeful(candidate) and self._proved(candidate):
                return Repair(candidate.members, candidate.change, candidate.before, candidate.after)
        return None

    def _proved(self, candidate: Candidate) -> bool:
        pairs = self.sides(candidate.members)
        court = self.court.reaching([side for pair in pairs for side in pair])
        return all(court.judge(*pair).verdict is Verdict.PROVED for pair in pairs)

    def _floats(self, court: Court) -> list[Evaluation]:
        """Two states in double precision, with every symbol that the court knows."""
        if court not in self._states:
            states = [dict(evaluation.state) for evaluation in court.evidence.exact[:2]]
            self._states[court] = [Evaluation(self.section, state, Floats(), court.energy) for state in states]
        return self._states[court]

    def _says_the_same(self, candidate: Candidate) -> bool:
        """Whether the chain still speaks of the blocks that it spoke of, and says something of them."""
        blocks = [{block_named(member) for member in members} - {""} for members in (self.members, candidate.members)]
        renamed = candidate.change in ("index", "undefined symbol")  # the name of a block may itself be the mistake
        if len(blocks[0]) != len(blocks[1]) or (blocks[0] != blocks[1] and not renamed):
            return False
        return self.fixed > 0 or all(left != right for left, right in self.sides(candidate.members))

    def _hopeful(self, candidate: Candidate) -> bool:
        if not self._says_the_same(candidate):
            return False
        try:
            for left, right in self.sides(candidate.members):
                kinds = {self.section.type_of(left), self.section.type_of(right)}
                if Type.UNKNOWN in kinds or (len(kinds) > 1 and right != number(0)):
                    return False
                if self.section.undefined(left) or self.section.undefined(right):
                    return False
                court = self.court.reaching((left, right))
                floats = self._floats(court)
                if not floats:
                    return False  # nothing is proved of what has no states
                for evaluation in floats:
                    if not self._close(court.evidence.sides(evaluation, left, right)):
                        return False
        except (ShapeError, UndefinedError):
            return False
        return True

    @staticmethod
    def _close(pairs: list[tuple[Any, Any]]) -> bool:
        size = max((max(abs(a), abs(b)) for a, b in pairs), default=0.0)
        return all(abs(a - b) <= _FLOAT_TOLERANCE * size for a, b in pairs) if math.isfinite(size) else False


def describe(repair: Repair) -> str:
    """The change in words, for instance ``sign of \\cos \\theta \\mathbf{P}_1``."""
    before, after = latex(repair.before), latex(repair.after)
    if repair.change == "sign":
        body = repair.before.args[0] if repair.before.op == "neg" else repair.before
        return f"sign of {latex(body)}"
    if repair.change == "undefined symbol":
        return f"{name_latex(repair.before.name)} should be {after}"
    if repair.change == "missing term":
        return f"missing term {latex(repair.after.args[-1])}"
    return f"{repair.change}: {before} should be {after}"


def chain_latex(members: tuple[Expr, ...]) -> str:
    return " = ".join(latex(member) for member in members)
