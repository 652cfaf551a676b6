"""A verdict on every claim of a document.

PROVED       the normal form of the difference is zero, and the second reading agrees at several exact states.
REFUTED      at an exact rational state the two sides differ, certified by balls that do not meet; or the sides have
             different shapes, or a symbol that nothing defines.
UNDECIDED    neither; the reason is given.
INCONSISTENT the two readings contradict each other: a defect of this tool, never of the document.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from fractions import Fraction
from functools import cached_property
from itertools import islice
from typing import Any

import flint

from yarnverify.source import Source
from yarnverify.symbolic.declare import Declarations, Energy, Quantity
from yarnverify.symbolic.document import (
    Claim,
    Definition,
    Document,
    Section,
    block_of,
    instantiate,
    read_document,
)
from yarnverify.symbolic.forward import Balls, Evaluation, Rationals, StateMaker, UndefinedError, entries
from yarnverify.symbolic.latex import name_latex
from yarnverify.symbolic.normal import Field, Quotient
from yarnverify.symbolic.reading import UnsupportedError, Value, map_value
from yarnverify.symbolic.tree import FORCE, ZERO, Expr, Name, is_zero

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
        positive = {p.name for p in declared.parameters if p.positive} if declared else set(section.parameters)
        self.positive = frozenset(positive)

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

    def normal(self, expr: Expr) -> Value:
        return self.field.value(expr, self.block)

    def _equal_normal(self, left: Expr, right: Expr) -> bool:
        a, b = _flat(self.normal(left)), _flat(self.normal(right))
        if is_zero(right):
            b = b * len(a)
        if is_zero(left):
            a = a * len(b)
        return all((p - q).is_zero for p, q in zip(a, b, strict=True))

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
        a, b = entries(evaluation.value(left)), entries(evaluation.value(right))
        if is_zero(right):
            b = b * len(a)
        if is_zero(left):
            a = a * len(b)
        return list(zip(a, b, strict=True))

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
            return _undefined(missing)
        kinds = [self.section.type_of(side) for side in (left, right)]
        if kinds[0] is not kinds[1] and not (is_zero(left) or is_zero(right)):
            return Finding(Verdict.REFUTED, f"a {kinds[0].value} cannot equal a {kinds[1].value}")
        equal: bool | None
        try:
            equal = self._equal_normal(left, right)
        except UnsupportedError as error:
            return Finding(Verdict.UNDECIDED, str(error))
        except ZeroDivisionError:
            equal = None  # a denominator is identically zero
        compared = self._compare(left, right)
        state = compared.differs
        if equal and state is None and compared.seen:
            return Finding(Verdict.PROVED)
        if not compared.seen and compared.lacks_value is not None:
            where, why = compared.lacks_value
            return Finding(Verdict.REFUTED, f"what is printed has no value: {why}", Witness(where, (), ()))
        if not compared.seen:
            return Finding(Verdict.UNDECIDED, "no exact state was found at which both sides have a value")
        if equal:
            return Finding(Verdict.INCONSISTENT, "equal as normal forms, different at an exact state")
        if equal is None:
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


def _undefined(missing: tuple[Name, ...]) -> Finding:
    symbols = ", ".join(name_latex(name) for name in missing)
    return Finding(Verdict.REFUTED, f"undefined symbol {symbols}", undefined=missing)


def _spread(state: dict[Name, Any]) -> Fraction:
    """Sum of squared coordinates: small states are pleasant to read and to type in."""
    return sum(
        (part * part for value in state.values() for part in (value if isinstance(value, tuple) else (value,))),
        Fraction(0),
    )


def _flat(value: Value) -> list[Quotient]:
    return [q for part in value for q in _flat(part)] if isinstance(value, list) else [value]


# -- definitions and energies against what is declared ----------------------------------------------------------------


@dataclass(frozen=True)
class Judged:
    """A claim with its finding. ``kind`` is definition, energy, force, jacobian or identity.

    ``court`` is where it may be mended: with the declared definitions where printed ones are refuted. ``because`` names
    the equations whose mistake explains this one; ``index`` is the running index of a definition and the value that it
    was judged at.
    """

    section: Section
    claim: Claim
    kind: str
    finding: Finding
    court: Court
    because: tuple[str, ...] = ()
    index: tuple[str, str] = ("", "")


@dataclass(frozen=True)
class Completeness:
    """Which non-zero forces and Jacobian blocks a section lists, and which it lacks."""

    section: Section
    court: Court
    listed: tuple[str, ...]
    zero: tuple[str, ...]
    missing: tuple[Expr, ...]


@dataclass(frozen=True)
class Trial:
    """Everything found of a document."""

    document: Document
    judged: tuple[Judged, ...]
    given: tuple[tuple[Section, Definition, str], ...]
    completeness: tuple[Completeness, ...]


def declared_meaning(section: Section, symbol: Name, declarations: Declarations) -> Quantity | None:
    """The declared quantity behind a symbol of a section; a running index may have another letter than declared."""
    for found in declarations.quantities:
        if found.section not in ("", section.title):
            continue
        if found.symbol == symbol:
            return found
        index, letter = found.symbol.sub, symbol.sub
        if found.symbol.with_sub(letter) == symbol and all(len(i) == 1 and i.isalpha() for i in (index, letter)):
            return replace(found, symbol=symbol, expression=instantiate(found.expression, index, letter))
    return None


def read_with(source: Source, declarations: Declarations) -> Document:
    """Read a document, each section tied to the declared energy of the same title."""
    by_title: dict[str, Energy] = {energy.section.casefold(): energy for energy in declarations.energies}
    return read_document(source, lambda section: by_title.get(section.title.casefold()) if section.title else None)


def try_document(
    document: Document, declarations: Declarations, advance: Callable[[str], None] = lambda what: None
) -> Trial:
    """Judge every claim of a document; ``advance`` is called as each is done.

    Definitions and energies are compared with the declared ones where there are any, and are otherwise taken as given.
    Forces and Jacobians are judged against the energy and the definitions that the document itself prints. Where one of
    these has an undefined symbol, the declared one stands in for it, so that the other verdicts are not lost.
    """
    judged: list[Judged] = []
    given: list[tuple[Section, Definition, str]] = []
    completeness: list[Completeness] = []
    broken = _stand_in(document, declarations)
    for section, definition, quantity in _definitions(document, declarations):
        missing = broken.get(definition.relation.offset, ())
        if quantity is None and not missing:
            given.append((section, definition, "definition"))
            continue
        claim, court, index = definition_claim(section, definition, quantity)
        finding = _undefined(missing) if missing else court.judge(claim.left, claim.right)
        wrong = [j for j in judged if j.finding.verdict is not Verdict.PROVED and not j.finding.undefined]
        found = _Appeal(court, wrong, declarations).judged(claim, "definition", finding)
        judged.append(replace(found, index=index))
        advance(definition.relation.equation)
    wrong = [j for j in judged if j.finding.verdict is not Verdict.PROVED]
    for section in document.sections:
        assert section.energy is not None
        truth, blamed = section.energy.expression, [j for j in wrong if j.section in (section, document.shared)]
        if section.declared is None:
            given.append((section, section.energy, "energy"))
        else:
            claim = Claim("V", Expr("energy", value=section.energy.symbol), truth, section.energy.relation, 0)
            court = Court(section, section.declared.expression, [truth])
            finding = court.judge(claim.left, claim.right)
            judged.append(_Appeal(court, blamed, declarations).judged(claim, "energy", finding))
            advance(section.energy.relation.equation)
            if finding.undefined:
                truth = section.declared.expression
            elif finding.verdict is not Verdict.PROVED:
                blamed = [*blamed, judged[-1]]
        court = Court(section, truth)
        appeal = _Appeal(court, blamed, declarations)
        for claim in section.claims:
            judged.append(appeal.judged(claim, _kind(claim), court.judge(claim.left, claim.right)))
            advance(claim.relation.equation)
        completeness.append(_completeness(section, court))
    order = {id(relation): i for i, relation in enumerate(document.relations)}
    starts = {relation.offset: i for i, relation in enumerate(document.relations)}
    judged.sort(key=lambda j: (order.get(id(j.claim.relation), starts.get(j.claim.relation.offset, 0)), j.claim.member))
    return Trial(document, tuple(judged), tuple(given), tuple(completeness))


def _definitions(
    document: Document, declarations: Declarations
) -> Iterator[tuple[Section, Definition, Quantity | None]]:
    """Every definition as printed, with what is declared of its symbol."""
    for section in (document.shared, *document.sections):
        for definition in section.definitions.values():
            yield section, definition, declared_meaning(section, definition.symbol, declarations)


def _stand_in(document: Document, declarations: Declarations) -> dict[int, tuple[Name, ...]]:
    """Let declared meanings stand in for printed definitions with undefined symbols; those symbols, by place."""
    broken: dict[int, tuple[Name, ...]] = {}
    parameters = {name for section in document.sections for name in section.parameters}
    for section, definition, quantity in _definitions(document, declarations):
        missing = [n for n in section.undefined(definition.expression, follow=False) if n not in parameters]
        if missing:
            broken[definition.relation.offset] = tuple(missing)
            section.stand_ins[definition.symbol] = quantity.expression if quantity is not None else None
    for section in (document.shared, *document.sections):
        section.forget()
    return broken


def definition_claim(
    section: Section, definition: Definition, quantity: Quantity | None
) -> tuple[Claim, Court, tuple[str, str]]:
    """The claim that a printed definition is the declared one, for one value of its running index."""
    printed, value = definition.expression, ""
    declared = quantity.expression if quantity is not None else printed
    if definition.index:
        used = {name.sub for tree in (declared, printed) for name in section.base_symbols(tree)}
        value = next(str(i) for i in range(1, 100) if str(i) not in used)
        declared, printed = (instantiate(tree, definition.index, value) for tree in (declared, printed))
    claim = Claim(str(definition.symbol), declared, printed, definition.relation, 0)
    return claim, Court(section, ZERO, [declared, printed]), (definition.index, value)


def as_declared(section: Section, declarations: Declarations) -> Section:
    """A section with every declared definition in place of its printed one."""
    copy = replace(section, definitions=dict(section.definitions), claims=[], stand_ins={}, _meanings={}, _shapes={})
    if section.shared is not None:
        copy.shared = as_declared(section.shared, declarations)
    for symbol, definition in section.definitions.items():
        quantity = declared_meaning(section, symbol, declarations)
        if quantity is not None:
            copy.definitions[symbol] = replace(definition, expression=quantity.expression)
    return copy


@dataclass
class _Appeal:
    """Judges refuted claims again, with the declared definitions and energy in place of refuted printed ones."""

    court: Court
    blamed: list[Judged]
    declarations: Declarations

    @cached_property
    def fair(self) -> Court:
        section = as_declared(self.court.section, self.declarations)
        section.claims = self.court.section.claims
        energy = section.declared.expression if section.declared is not None else self.court.energy
        return Court(section, energy, [self.court.energy])

    def judged(self, claim: Claim, kind: str, finding: Finding) -> Judged:
        section = self.court.section
        roots = self._roots(claim)
        if finding.verdict not in (Verdict.REFUTED, Verdict.UNDECIDED) or not roots:
            return Judged(section, claim, kind, finding, self.court)
        if finding.undefined:  # its own symbols, or those of a definition that it uses
            own = any(section.undefined(side, follow=False) for side in (claim.left, claim.right))
            return Judged(section, claim, kind, finding, self.court, () if own else roots)
        fair = self.fair.reaching([claim.left, claim.right])
        explained = fair.judge(claim.left, claim.right).verdict is Verdict.PROVED
        return Judged(section, claim, kind, finding, fair, roots if explained else ())

    def _roots(self, claim: Claim) -> tuple[str, ...]:
        """Equations to blame: the refuted energy, and refuted definitions that the claim or the energy uses."""
        section = self.court.section
        used = {
            name for tree in (claim.left, claim.right, self.court.energy) for name in section.definitions_used(tree)
        }
        blamed = [
            j for j in self.blamed if not j.because and (j.kind == "energy" or j.claim.relation.members[0].name in used)
        ]
        return tuple(dict.fromkeys(j.claim.relation.equation for j in blamed))


def _kind(claim: Claim) -> str:
    if not claim.block.startswith(("F_", "dF_")):
        return "identity"
    return "jacobian" if claim.block.startswith("dF_") else "force"


def _completeness(section: Section, court: Court) -> Completeness:
    """Compare the printed list of forces and Jacobians with what the energy has."""
    listed = {claim.block for claim in section.claims}
    for claim in section.claims:
        listed |= {block_of(side) for side in (claim.left, claim.right)}
    missing: list[Expr] = []
    zero: list[str] = []
    found: list[str] = []
    forces = [Expr("force", value=name) for name in section.unknowns]
    jacobians = [Expr("derivative", (force,), name) for force in forces for name in section.unknowns]
    for block in (*forces, *jacobians):
        try:
            nothing = all(q.is_zero for q in _flat(court.block(block)))
        except (UnsupportedError, ZeroDivisionError):
            continue
        name = block_of(block)
        if nothing:
            zero.append(name)
        elif name in listed:
            found.append(name)
        else:
            missing.append(block)
    return Completeness(section, court, tuple(found), tuple(zero), tuple(missing))


def hexadecimal(value: Fraction) -> str:
    """A rational as a hexadecimal float; exact for the states drawn here."""
    number = float(value)
    assert Fraction(number) == value
    return number.hex()
