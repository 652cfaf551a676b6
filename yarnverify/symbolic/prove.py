"""The trial of a document: every claim judged, definitions and energies against what is declared, lists for completeness."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

from yarnverify.source import Source
from yarnverify.symbolic.court import Court, Finding, Verdict, undefined_symbols
from yarnverify.symbolic.declare import Assumption, Declarations, Energy, Quantity
from yarnverify.symbolic.document import Claim, Definition, Document, Section, block_of, instantiate, read_document
from yarnverify.symbolic.latex import latex
from yarnverify.symbolic.states import holds
from yarnverify.symbolic.tree import ZERO, Expr, Name


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
    """Which non-zero forces and Jacobian blocks a section lists, which it lacks, and which could not be examined."""

    section: Section
    court: Court
    listed: tuple[str, ...]
    zero: tuple[str, ...]
    missing: tuple[Expr, ...]
    unknown: tuple[str, ...]


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
    these has an undefined symbol, the declared one stands in for it, so that the other verdicts are not lost. The same
    holds for an energy that has no value, or no force, anywhere.

    Raises
    ------
    InputError
        For an energy without a value that nothing is declared for.
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
        finding = undefined_symbols(missing) if missing else court.judge(claim.left, claim.right)
        wrong = [j for j in judged if j.finding.verdict is not Verdict.PROVED and not j.finding.undefined]
        found = _Appeal(court, wrong, declarations).judged(claim, "definition", finding)
        judged.append(replace(found, index=index))
        advance(definition.relation.equation)
    wrong = [j for j in judged if j.finding.verdict is not Verdict.PROVED]
    for section in document.sections:
        assert section.energy is not None
        truth, blamed = section.energy.expression, [j for j in wrong if j.section in (section, document.shared)]
        court = Court(section, truth)
        if section.declared is None:
            given.append((section, section.energy, "energy"))
        else:
            claim = Claim("V", Expr("energy", value=section.energy.symbol), truth, section.energy.relation, 0)
            declared = Court(section, section.declared.expression, [truth])
            finding = declared.judge(claim.left, claim.right)
            if not finding.undefined:
                finding = _outside_domain(declared, section.declared, truth, finding)
            judged.append(_Appeal(declared, blamed, declarations).judged(claim, "energy", finding))
            advance(section.energy.relation.equation)
            if finding.undefined or court.without_value or court.without_force:
                court = Court(section, section.declared.expression)
            elif finding.verdict is not Verdict.PROVED and finding.mendable:
                blamed = [*blamed, judged[-1]]
        if court.without_value:
            number = section.energy.relation.equation
            document.source.fail(truth.span[0], f"equation ({number}): the energy has no value, it divides by zero")
        appeal = _Appeal(court, blamed, declarations)
        for claim in section.claims:
            judged.append(appeal.judged(claim, _kind(claim), court.judge(claim.left, claim.right)))
            advance(claim.relation.equation)
        completeness.append(_completeness(section, court))
    order = {id(relation): i for i, relation in enumerate(document.relations)}
    starts = {relation.offset: i for i, relation in enumerate(document.relations)}
    judged.sort(key=lambda j: (order.get(id(j.claim.relation), starts.get(j.claim.relation.offset, 0)), j.claim.member))
    return Trial(document, tuple(judged), tuple(given), tuple(completeness))


def _outside_domain(court: Court, declared: Energy, printed: Expr, finding: Finding) -> Finding:
    """What was found of an energy, or its refutation: it is assumed where the declared one is zero, or only elsewhere."""

    def text(assumptions: Iterable[Assumption]) -> str:
        return ", ".join(f"{latex(a.left)} {'>' if a.strict else chr(92) + 'ge'} {latex(a.right)}" for a in assumptions)

    outside = [e for e in court.evidence.exact if not all(holds(e, assumption) for assumption in declared.domain)]
    assumed = text(court.section.assumptions)
    if declared.elsewhere == "zero" and finding.verdict is Verdict.PROVED:
        for evaluation in outside:
            witness = court.evidence.certify(dict(evaluation.state), ZERO, printed)
            if witness is not None:
                reason = f"assumed for {assumed}, where in part the declared energy is zero"
                return Finding(Verdict.REFUTED, reason, witness, mendable=False)
    if outside and len(outside) == len(court.evidence.exact):
        reason = f"assumed for {assumed}, while the energy is declared for {text(declared.domain)}"
        return Finding(Verdict.REFUTED, reason, mendable=False)
    return finding


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
    unknown: list[str] = []
    forces = [Expr("force", value=name) for name in section.unknowns]
    jacobians = [Expr("derivative", (force,), name) for force in forces for name in section.unknowns]
    for block in (*forces, *jacobians):
        nothing = court.is_zero(block)
        name = block_of(block)
        if nothing is None:
            unknown.append(name)
        elif nothing:
            zero.append(name)
        elif name in listed:
            found.append(name)
        else:
            missing.append(block)
    return Completeness(section, court, tuple(found), tuple(zero), tuple(missing), tuple(unknown))
