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
from fractions import Fraction
from functools import cached_property
from itertools import islice
from typing import Any

import flint

from yarnverify.symbolic.algebraic import NoValueError, UndefinedError
from yarnverify.symbolic.blocks import Blocks, flat, paired
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.forward import Evaluation, entries
from yarnverify.symbolic.latex import name_latex
from yarnverify.symbolic.normal import Field
from yarnverify.symbolic.numbers import Balls, Rationals
from yarnverify.symbolic.reading import UnsupportedError
from yarnverify.symbolic.signs import Signature, in_floats, lie_of, side_of, sided
from yarnverify.symbolic.states import StateMaker
from yarnverify.symbolic.tree import Expr, Name, is_zero

EXACT_STATES = 3  # the second reading's; each is a proof of difference, or one more agreement
_TRIES = 16 * EXACT_STATES  # states drawn in search of such at which both sides have a value
_WIDE = 160  # states drawn in search of the other side of an absolute value or root
_SIDES = 24  # states at which a claim is compared that has several sides
_LOOKED_AT = 2  # states at which what is proved is enclosed by balls
_REGIONS = 12  # of signs, in each of which a claim is proved anew
_BALL_BITS = (128, 512, 2048, 8192, 32768)
_FEW_BITS = _BALL_BITS[:2]


class Verdict(StrEnum):
    PROVED = "proved"
    REFUTED = "refuted"
    UNDECIDED = "undecided"
    INCONSISTENT = "inconsistent"


@dataclass(frozen=True)
class Witness:
    """A state at which two sides differ, and their enclosed values there."""

    state: dict[Name, Any]
    left: tuple[Any, ...]
    right: tuple[Any, ...]


@dataclass(frozen=True)
class Finding:
    """What was found of one claim. One that is not ``mendable`` is wrong by more than its formula."""

    verdict: Verdict
    reason: str = ""
    witness: Witness | None = None
    undefined: tuple[Name, ...] = ()
    mendable: bool = True


@dataclass(frozen=True)
class _Comparison:
    """How two sides compare at exact states.

    ``seen`` counts the states at which both had a value; ``differs`` are those at which these were not equal;
    ``lacks_value`` are those at which only the left side has a value, with the error of the right one.
    """

    seen: int
    differs: tuple[dict[Name, Any], ...] = ()
    lacks_value: tuple[tuple[dict[Name, Any], UndefinedError], ...] = ()


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

    def reaching(self, trees: Iterable[Expr]) -> Court:
        """This court, or a larger one if the trees hold symbols that it does not."""
        trees = list(trees)
        names = {name for tree in trees for name in self.section.base_symbols(tree)}
        known = {n for n in names if self.section.is_unknown(n) or n in self.section.parameters}
        return self if known <= set(self.names) else Court(self.section, self.energy, trees)

    # -- first reading

    @cached_property
    def forms(self) -> Blocks:
        """Normal forms, with signs as far as assumptions settle them."""

        def samples() -> list[dict[Name, Any]]:
            return [dict(evaluation.state) for evaluation in self.exact]

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

    @cached_property
    def _regions(self) -> dict[int, Blocks]:
        return {}

    def _equal_in_regions(self, left: Expr, right: Expr) -> bool:
        """Whether two trees are equal in every region of signs that a state lies in, each with normal forms of its own.

        They may be unequal at the border of regions, as far as normal forms go, where no sign can be taken.
        """
        states = [evaluation.state for evaluation in self._everywhere]
        left_over = [i for i, e in enumerate(self._floats) if not self._undefined_at(e, left, right)]
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
        for evaluation in self.exact[:EXACT_STATES]:
            try:
                if any(part != 0 for part in entries(evaluation.value(block))):
                    return False  # one exact state is enough for that
            except UndefinedError:
                continue
        try:
            return all(q.is_zero for q in flat(self.forms.true(block)))
        except (UnsupportedError, ZeroDivisionError):
            return None

    # -- second reading

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
    def _everywhere(self) -> list[Evaluation]:
        return [*self.exact, *self.wide]

    @cached_property
    def _floats(self) -> list[Evaluation]:
        return [in_floats(evaluation) for evaluation in self._everywhere]

    @cached_property
    def _sides(self) -> dict[Expr, list[int]]:
        return {}

    @cached_property
    def _lies(self) -> list[Signature]:
        return [lie_of(evaluation) for evaluation in self._floats]

    def _other_sides(self, left: Expr, right: Expr, hidden: bool) -> list[Evaluation]:
        """States on different sides of the absolute values and roots of two trees; none where they have one side only.

        With ``hidden``, also where nothing is seen to have sides: roots of squares have them as well.
        """
        blocks = any(node.op in {"force", "energy", "derivative"} for side in (left, right) for node in side.walk())
        nodes = sided(self.section, (left, right, self.energy) if blocks else (left, right))
        if not nodes and not hidden:
            return []
        for node in nodes:
            if node not in self._sides:
                self._sides[node] = [side_of(evaluation, node) for evaluation in self._floats]
        sides = list(zip(*(self._sides[node] for node in nodes), strict=True)) or [()] * len(self._floats)
        if not hidden and len(set(sides)) == 1 and not any(node.op == "sqrt" for node in nodes):
            return []
        chosen: dict[Any, Evaluation] = {}
        for keys in (sides, zip(sides, self._lies, strict=True)):
            for key, evaluation in zip(keys, self._everywhere, strict=True):
                chosen.setdefault(key, evaluation)
        return list({id(evaluation): evaluation for evaluation in chosen.values()}.values())[:_SIDES]

    def _compare(self, left: Expr, right: Expr, others: Iterable[Evaluation] = ()) -> _Comparison:
        """Compare two sides at exact states, until enough were seen at which both have a value, and at others."""
        seen = 0
        differs: list[dict[Name, Any]] = []
        lacks_value: list[tuple[dict[Name, Any], UndefinedError]] = []

        def look(evaluation: Evaluation) -> None:
            nonlocal seen
            try:
                pairs = self.sides(evaluation, left, right)
            except UndefinedError as error:
                if not self._undefined_at(evaluation, left):
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
        return _Comparison(seen, tuple(differs), tuple(lacks_value))

    @staticmethod
    def _undefined_at(evaluation: Evaluation, *trees: Expr) -> bool:
        try:
            for tree in trees:
                evaluation.value(tree)
        except UndefinedError:
            return True
        return False

    def certify(
        self, state: dict[Name, Any], left: Expr, right: Expr, precisions: Iterable[int] = _BALL_BITS
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
    def _balls(self) -> list[Evaluation]:
        """Where what is proved is looked at once more, with true angles and pi."""
        return [Evaluation(self.section, e.state, Balls(), self.energy) for e in self.exact[:_LOOKED_AT]]

    def _apart(self, evaluation: Evaluation, left: Expr, right: Expr) -> bool:
        with flint.ctx.workprec(_FEW_BITS[0]):
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
        compared = self._compare(left, right)
        refuted = self._refuted(compared, left, right)
        if refuted is None:
            others = self._other_sides(left, right, hidden=equal is not True)
            if others:
                compared = self._compare(left, right, others)
                refuted = self._refuted(compared, left, right)
        if refuted is None and equal is False and not compared.differs and not self.forms.field.settles:
            equal = self._equal_in_regions(left, right)
        if refuted is not None and not (equal and refuted.witness is not None and refuted.witness.right):
            return refuted
        if equal and not compared.differs and compared.seen:
            if any(self._apart(evaluation, left, right) for evaluation in self._balls):
                return Finding(Verdict.INCONSISTENT, "equal in exact readings, apart in balls")
            return Finding(Verdict.PROVED)
        if not compared.seen and compared.lacks_value:
            at, why = compared.lacks_value[0]
            return Finding(Verdict.REFUTED, f"what is printed has no value: {why}", Witness(at, (), ()))
        if unsupported and not compared.differs:
            states = f"the {compared.seen} exact states tried" if compared.seen else "no state, since none was found"
            return Finding(Verdict.UNDECIDED, f"{unsupported}; equal at {states}")
        if not compared.seen:
            what = "both sides have a value at no state tried" if self.exact else "no state satisfies the assumptions"
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

    def _refuted(self, compared: _Comparison, left: Expr, right: Expr) -> Finding | None:
        """The refutation that balls certify at one of the states at which a comparison failed."""
        trials: list[tuple[dict[Name, Any], tuple[int, ...]]] = [(state, _FEW_BITS) for state in compared.differs]
        trials += [(state, _BALL_BITS) for state in compared.differs[:1]]
        for state, precisions in trials:
            witness = self.certify(state, left, right, precisions)
            if witness is not None and witness.right:
                return Finding(Verdict.REFUTED, "", witness)
        for state, why in compared.lacks_value:
            witness = self.certify(state, left, right, _FEW_BITS) if isinstance(why, NoValueError) else None
            if witness is not None:
                reason = f"what is printed has no value: {why}" if not witness.right else ""
                return Finding(Verdict.REFUTED, reason, witness)
        return None


def undefined_symbols(missing: tuple[Name, ...]) -> Finding:
    symbols = ", ".join(name_latex(name) for name in missing)
    return Finding(Verdict.REFUTED, f"undefined symbol {symbols}", undefined=missing)


def _spread(state: dict[Name, Any]) -> Fraction:
    """Sum of squared coordinates: small states are pleasant to read and to type in."""
    return sum(
        (part * part for value in state.values() for part in (value if isinstance(value, tuple) else (value,))),
        Fraction(0),
    )
