"""A verdict on every claim of a document.

PROVED       the normal form of the difference is zero, and the second reading agrees at several exact states.
REFUTED      at an exact rational state the two sides differ, certified by balls that do not meet; or the sides have
             different shapes, or a symbol that nothing defines.
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

from yarnverify.symbolic.document import Section
from yarnverify.symbolic.forward import Evaluation, entries
from yarnverify.symbolic.latex import name_latex
from yarnverify.symbolic.normal import Field, Quotient
from yarnverify.symbolic.numbers import Balls, Rationals, UndefinedError
from yarnverify.symbolic.reading import UnsupportedError, Value, map_value
from yarnverify.symbolic.states import StateMaker
from yarnverify.symbolic.tree import FORCE, Expr, Name, is_zero

EXACT_STATES = 3  # the second reading's; each is a proof of difference, or one more agreement
_TRIES = 16 * EXACT_STATES  # states drawn in search of such at which both sides have a value
_BALL_BITS = (128, 512, 2048, 8192, 32768)


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
    """What was found of one claim."""

    verdict: Verdict
    reason: str = ""
    witness: Witness | None = None
    undefined: tuple[Name, ...] = ()


@dataclass(frozen=True)
class _Comparison:
    """How two sides compare at exact states.

    ``seen`` counts the states at which both had a value; ``differs`` is one at which these were not equal;
    ``lacks_value`` is one at which only the left side has a value, and why the right one has none.
    """

    seen: int
    differs: dict[Name, Any] | None
    lacks_value: tuple[dict[Name, Any], str] | None = None


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
    def field(self) -> Field:
        return Field(self.section, self.names, self.positive)

    @cached_property
    def _energy_value(self) -> Value:
        return self.field.value(self.energy)

    @cached_property
    def _blocks(self) -> dict[Expr, Value]:
        return {}

    def block(self, expr: Expr) -> Value:
        """True normal form of a force, an energy or a derivative."""
        if expr not in self._blocks:
            if expr.op == "energy":
                found = self._energy_value
            elif expr.op == "force":
                found = map_value(self.field.gradient(self._energy_value, expr.name), lambda q: q * FORCE)
            else:
                inner = expr.args[0]
                of = self.block(inner) if inner.op in {"force", "energy"} else self.field.value(inner)
                found = self.field.gradient(of, expr.name)
            self._blocks[expr] = found
        return self._blocks[expr]

    def is_zero(self, block: Expr) -> bool | None:
        """Whether a true block is zero everywhere; None if nothing could tell."""
        for evaluation in self.exact[:EXACT_STATES]:
            try:
                if any(part != 0 for part in entries(evaluation.value(block))):
                    return False  # one exact state is enough for that
            except UndefinedError:
                continue
        try:
            return all(q.is_zero for q in flat(self.block(block)))
        except (UnsupportedError, ZeroDivisionError):
            return None

    def normal(self, expr: Expr) -> Value:
        return self.field.value(expr, self.block)

    def _equal_normal(self, left: Expr, right: Expr) -> bool:
        pairs = _paired(left, right, flat(self.normal(left)), flat(self.normal(right)))
        return all((p - q).is_zero for p, q in pairs)

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
        return _paired(left, right, entries(evaluation.value(left)), entries(evaluation.value(right)))

    def _compare(self, left: Expr, right: Expr) -> _Comparison:
        """Compare two sides at exact states, until enough were seen at which both have a value."""
        seen, lacks_value = 0, None
        for evaluation in self.exact:
            try:
                pairs = self.sides(evaluation, left, right)
            except UndefinedError as error:
                if lacks_value is None and not self._undefined_at(evaluation, left):
                    lacks_value = dict(evaluation.state), str(error)
                continue
            seen += 1
            if any(a != b for a, b in pairs):
                return _Comparison(seen, dict(evaluation.state))
            if seen == EXACT_STATES:
                break
        return _Comparison(seen, None, lacks_value)

    @staticmethod
    def _undefined_at(evaluation: Evaluation, expr: Expr) -> bool:
        try:
            evaluation.value(expr)
        except UndefinedError:
            return True
        return False

    def certify(self, state: dict[Name, Any], left: Expr, right: Expr) -> Witness | None:
        """The witness at a state, if balls of some precision show that the sides differ there."""
        before = flint.ctx.prec
        try:
            for bits in _BALL_BITS:
                flint.ctx.prec = bits
                try:
                    pairs = self.sides(Evaluation(self.section, state, Balls(), self.energy), left, right)
                except UndefinedError:
                    continue
                if any(not a.overlaps(b) for a, b in pairs):
                    return Witness(state, tuple(a for a, _ in pairs), tuple(b for _, b in pairs))
        finally:
            flint.ctx.prec = before
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
            equal = self._equal_normal(left, right)
        except UnsupportedError as error:
            equal, unsupported = None, str(error)
        except ZeroDivisionError:
            equal = None  # a denominator is identically zero
        compared = self._compare(left, right)
        state = compared.differs
        if equal and state is None and compared.seen:
            return Finding(Verdict.PROVED)
        if not compared.seen and compared.lacks_value is not None:
            at, why = compared.lacks_value
            return Finding(Verdict.REFUTED, f"what is printed has no value: {why}", Witness(at, (), ()))
        if unsupported and state is None:
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
        if state is None and self.field.root_count > 1:
            return Finding(
                Verdict.UNDECIDED, "equal at every exact state tried, but the square roots could not be settled"
            )
        if state is None:
            return Finding(Verdict.INCONSISTENT, "different as normal forms, equal at every exact state tried")
        witness = self.certify(state, left, right)
        if witness is None:
            return Finding(
                Verdict.UNDECIDED, "the exact readings differ, but no ball arithmetic could tell the sides apart"
            )
        return Finding(Verdict.REFUTED, "", witness)


def undefined_symbols(missing: tuple[Name, ...]) -> Finding:
    symbols = ", ".join(name_latex(name) for name in missing)
    return Finding(Verdict.REFUTED, f"undefined symbol {symbols}", undefined=missing)


def _paired(left: Expr, right: Expr, a: list[Any], b: list[Any]) -> list[tuple[Any, Any]]:
    """Components side by side; the printed 0 stands for as many zeros as are wanted."""
    if is_zero(right):
        b = b * len(a)
    if is_zero(left):
        a = a * len(b)
    return list(zip(a, b, strict=True))


def _spread(state: dict[Name, Any]) -> Fraction:
    """Sum of squared coordinates: small states are pleasant to read and to type in."""
    return sum(
        (part * part for value in state.values() for part in (value if isinstance(value, tuple) else (value,))),
        Fraction(0),
    )


def flat(value: Value) -> list[Quotient]:
    return [q for part in value for q in flat(part)] if isinstance(value, list) else [value]
