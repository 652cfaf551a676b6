"""A verdict on every claim of a document.

PROVED       the normal form of the difference is zero, and the second reading agrees at several exact states, on either
             side of every absolute value and root.
REFUTED      at an exact rational state the two sides differ, certified by balls that do not meet; or what is printed has
             no value there, and the true side has one; or the sides have different shapes, or a symbol that nothing defines.
UNDECIDED    neither; the reason is given.
INCONSISTENT the two readings contradict each other: a defect of this tool, never of the document.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any

from yarnverify.symbolic.algebraic import NoValueError, UndefinedError
from yarnverify.symbolic.blocks import Blocks, flat
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.evidence import BALL_BITS, EXACT_STATES, FEW_BITS, Comparison, Evidence, Witness
from yarnverify.symbolic.forward import Evaluation, entries
from yarnverify.symbolic.functions import is_turn
from yarnverify.symbolic.latex import name_latex
from yarnverify.symbolic.normal import Field
from yarnverify.symbolic.reading import UnsupportedError
from yarnverify.symbolic.tree import Expr, Name, is_zero

_REGIONS = 12  # of signs, in each of which a claim is proved anew


class Verdict(StrEnum):
    PROVED = "proved"
    REFUTED = "refuted"
    UNDECIDED = "undecided"
    INCONSISTENT = "inconsistent"


@dataclass(frozen=True)
class Finding:
    """What was found of one claim. One that is not ``mendable`` is wrong by more than its formula."""

    verdict: Verdict
    reason: str = ""
    witness: Witness | None = None
    undefined: tuple[Name, ...] = ()
    mendable: bool = True


class Court:
    """Judges claims of one section; holds what the claims share: the field, the states, the true derivatives.

    Parameters
    ----------
    section
        Whose definitions and assumptions hold.
    energy
        The tree that forces and Jacobians are taken from.
    also
        Trees whose symbols may appear besides those of the section.
    """

    def __init__(self, section: Section, energy: Expr, also: Iterable[Expr] = ()) -> None:
        self.section, self.energy = section, energy
        trees = [energy, *also]
        trees += [side for claim in section.claims for side in (claim.left, claim.right)]
        assumed = {n for a in section.assumptions for side in (a.left, a.right) for n in section.base_symbols(side)}
        names = {name for tree in trees for name in section.base_symbols(tree)} | set(section.unknowns)
        names = {n for n in names if section.is_unknown(n) or n in section.parameters} | assumed
        self.names = sorted(names, key=lambda n: (not n.bold, n.base, n.sub))
        declared = section.declared
        self.positive = frozenset(p.name for p in declared.parameters if p.positive) if declared else frozenset()
        self._larger: dict[frozenset[Name], Court] = {}

    @cached_property
    def evidence(self) -> Evidence:
        return Evidence(self.section, self.energy, self.names, self.positive)

    def reaching(self, trees: Iterable[Expr]) -> Court:
        """This court, or a larger one if the trees hold symbols that it does not."""
        trees = list(trees)
        names = {name for tree in trees for name in self.section.base_symbols(tree)}
        known = {n for n in names if self.section.is_unknown(n) or n in self.section.parameters}
        beyond = frozenset(known) - set(self.names)
        if not beyond:
            return self
        if beyond not in self._larger:
            self._larger[beyond] = Court(self.section, self.energy, trees)
        return self._larger[beyond]

    # -- first reading

    @cached_property
    def forms(self) -> Blocks:
        """Normal forms, with signs as far as assumptions settle them."""

        def samples() -> list[dict[Name, Any]]:
            return [dict(evaluation.state) for evaluation in self.evidence.exact]

        return Blocks(Field(self.section, self.names, self.positive, samples), self.energy)

    @property
    def without_value(self) -> bool:
        """Whether the energy divides by what is zero everywhere."""
        try:
            return self.forms.energy is None
        except ZeroDivisionError:
            return True
        except UnsupportedError:
            return False

    @property
    def without_force(self) -> bool:
        """Whether some force has a value at no state, as those of an angle that is 0 or pi everywhere."""

        def has_value(evaluation: Evaluation, name: Name) -> bool:
            try:
                evaluation.value(Expr("force", value=name))
            except UndefinedError:
                return False
            return True

        states = self.evidence.exact
        return bool(states) and not all(any(has_value(e, name) for e in states) for name in self.section.unknowns)

    def _has_turns(self, *trees: Expr) -> bool:
        return any(is_turn(node) for tree in (*trees, self.energy) for node in self.section.expand(tree).walk())

    @cached_property
    def _turns(self) -> Blocks:
        return Blocks(Field(self.section, self.names, self.positive, turns=True), self.energy)

    def _equal_by_turns(self, left: Expr, right: Expr) -> bool:
        """Whether two trees are equal with the angles of points as they are: their slopes are then free of roots."""
        try:
            return self._turns.equal(left, right)
        except (UnsupportedError, ZeroDivisionError):
            return False

    @cached_property
    def _regions(self) -> dict[int, Blocks]:
        return {}

    def _equal_in_regions(self, left: Expr, right: Expr) -> bool:
        """Whether two trees are equal in every region of signs that a state lies in, each with normal forms of its own.

        They may be unequal at the border of regions, as far as normal forms go, where no sign can be taken.
        """
        states = [evaluation.state for evaluation in self.evidence.everywhere]
        left_over = [i for i, e in enumerate(self.evidence.floats) if not self.evidence.undefined_at(e, left, right)]
        proved = False
        for _ in range(_REGIONS):
            if not left_over:
                return proved
            at = left_over[0]
            if at not in self._regions:
                field = Field(self.section, self.names, self.positive, here=states[at])
                self._regions[at] = Blocks(field, self.energy)
            if not self._regions[at].equal(left, right):
                if self._regions[at].field.settles:
                    return False
                left_over = left_over[1:]
                continue
            proved = True
            left_over = [i for i in left_over[1:] if not self._regions[at].field.holds_at(states[i])]
        return False

    def is_zero(self, block: Expr) -> bool | None:
        """Whether a true block is zero everywhere; None if nothing could tell."""
        for evaluation in self.evidence.exact[:EXACT_STATES]:
            try:
                if any(part != 0 for part in entries(evaluation.value(block))):
                    return False  # one exact state is enough for that
            except UndefinedError:
                continue
        try:
            return all(q.is_zero for q in flat(self.forms.true(block)))
        except (UnsupportedError, ZeroDivisionError):
            return None

    # -- verdict

    def judge(self, left: Expr, right: Expr) -> Finding:
        """Whether two trees are equal."""
        missing = tuple(dict.fromkeys([*self.section.undefined(left), *self.section.undefined(right)]))
        if missing:
            return undefined_symbols(missing)
        kinds = [self.section.type_of(side) for side in (left, right)]
        if kinds[0] is not kinds[1] and not (is_zero(left) or is_zero(right)):
            return Finding(Verdict.REFUTED, f"a {kinds[0].value} cannot equal a {kinds[1].value}")
        equal: bool | None
        unsupported = ""
        try:
            equal = self.forms.equal(left, right)
        except UnsupportedError as error:
            equal, unsupported = None, str(error)
        except ZeroDivisionError:
            equal = None  # a denominator is identically zero
        compared = self.evidence.compare(left, right)
        refuted = self._refuted(compared, left, right)
        if refuted is None:
            others = self.evidence.other_sides(left, right, hidden=equal is not True)
            if others:
                compared = self.evidence.compare(left, right, others)
                refuted = self._refuted(compared, left, right)
        if refuted is None and equal is not True and not compared.differs and self._has_turns(left, right):
            equal = self._equal_by_turns(left, right) or equal
        if refuted is None and equal is False and not compared.differs and not self.forms.field.settles:
            equal = self._equal_in_regions(left, right)
        if refuted is not None and not (equal and refuted.witness is not None and refuted.witness.right):
            return refuted
        if equal and not compared.differs and compared.seen:
            if any(self.evidence.apart(evaluation, left, right) for evaluation in self.evidence.balls):
                return Finding(Verdict.INCONSISTENT, "equal in exact readings, apart in balls")
            return Finding(Verdict.PROVED)
        if not compared.seen and compared.lacks_value:
            at, why = compared.lacks_value[0]
            return Finding(Verdict.REFUTED, f"what is printed has no value: {why}", Witness(at, (), ()))
        if unsupported and not compared.differs:
            states = f"the {compared.seen} exact states tried" if compared.seen else "no state, since none was found"
            return Finding(Verdict.UNDECIDED, f"{unsupported}; equal at {states}")
        if not compared.seen:
            what = (
                "both sides have a value at no state tried"
                if self.evidence.exact
                else "no state satisfies the assumptions"
            )
            return Finding(Verdict.UNDECIDED, what)
        if equal:
            return Finding(Verdict.INCONSISTENT, "equal as normal forms, different at an exact state")
        if equal is None and not unsupported:
            return Finding(
                Verdict.INCONSISTENT, "a denominator is zero as a normal form, and has a value at an exact state"
            )
        if not compared.differs and not self.forms.field.settles:
            return Finding(
                Verdict.UNDECIDED, "equal at every exact state tried, but the square roots could not be settled"
            )
        if not compared.differs:
            return Finding(Verdict.INCONSISTENT, "different as normal forms, equal at every exact state tried")
        return Finding(
            Verdict.UNDECIDED, "the exact readings differ, but no ball arithmetic could tell the sides apart"
        )

    def _refuted(self, compared: Comparison, left: Expr, right: Expr) -> Finding | None:
        """The refutation that balls certify at one of the states at which a comparison failed."""
        trials: list[tuple[dict[Name, Any], tuple[int, ...]]] = [(state, FEW_BITS) for state in compared.differs]
        trials += [(state, BALL_BITS) for state in compared.differs[:1]]
        for state, precisions in trials:
            witness = self.evidence.certify(state, left, right, precisions)
            if witness is not None and witness.right:
                return Finding(Verdict.REFUTED, "", witness)
        for state, why in compared.lacks_value:
            witness = self.evidence.certify(state, left, right, FEW_BITS) if isinstance(why, NoValueError) else None
            if witness is not None:
                reason = f"what is printed has no value: {why}" if not witness.right else ""
                return Finding(Verdict.REFUTED, reason, witness)
        return None


def undefined_symbols(missing: tuple[Name, ...]) -> Finding:
    symbols = ", ".join(name_latex(name) for name in missing)
    return Finding(Verdict.REFUTED, f"undefined symbol {symbols}", undefined=missing)
