"""What a document states: definitions, assumptions, one energy a section, and claims.

A chain ``A = B = -C`` is several claims: every member but the last is claimed to equal the last.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from yarnverify.source import Source
from yarnverify.symbolic.declare import Energy, assumptions
from yarnverify.symbolic.latex import latex
from yarnverify.symbolic.reader import Heading, Relation, read
from yarnverify.symbolic.sections import INDEX, Claim, Definition, Section, block_of, instantiate
from yarnverify.symbolic.tree import Expr, Name, ShapeError, Type


@dataclass(frozen=True)
class Document:
    """A document read whole: the shared preamble and its sections, in printed order."""

    source: Source
    shared: Section
    sections: tuple[Section, ...]
    relations: tuple[Relation, ...]

    @property
    def equations(self) -> tuple[str, ...]:
        """Printed numbers, in order."""
        return tuple(dict.fromkeys(r.equation for r in self.relations if not r.inline))


def _running_index(symbol: Name, expression: Expr) -> str:
    letter = symbol.sub
    if not (len(letter) == 1 and letter.isalpha()):
        return ""
    uses = any(
        node.op == "symbol" and (node.name.sub == letter or re.fullmatch(rf"{letter}[+-]\d+", node.name.sub))
        for node in expression.walk()
    )
    return letter if uses else ""


def _states_mechanics(expr: Expr) -> bool:
    """Whether the tree speaks of forces, energies or derivatives, so that it can only be a claim."""
    return any(node.op in {"force", "energy", "derivative"} for node in expr.walk())


def _has_energy(items: list[Heading | Relation], heading: Heading) -> bool:
    """Whether an energy stands between a heading and the next one."""
    for item in items[items.index(heading) + 1 :]:
        if isinstance(item, Heading):
            return False
        if item.members[0].op == "energy":
            return True
    return False


def _sections(source: Source, items: list[Heading | Relation]) -> tuple[Section, list[tuple[Section, list[Relation]]]]:
    """Group relations under headings: a lone top heading is the title, deeper headings belong to the section above."""
    headings = [item for item in items if isinstance(item, Heading)]
    titles = [h for h in headings if h.level == headings[0].level]
    deeper = [h for h in headings if h.level > titles[0].level] if titles else []
    own_energy = bool(titles) and _has_energy(items, titles[0]) and not any(_has_energy(items, h) for h in deeper)
    has_title = len(titles) == 1 and bool(deeper) and not own_energy
    rest = [h for h in headings if not (has_title and h is titles[0])]
    level = min((h.level for h in rest), default=0)
    shared = Section("", 0)
    groups: list[tuple[Section, list[Relation]]] = [(shared, [])]
    for item in items:
        if isinstance(item, Relation):
            groups[-1][1].append(item)
        elif item in rest and item.level == level:
            groups.append((Section(item.title, item.offset, shared), []))
    return shared, groups


def read_document(source: Source, declare: Callable[[Section], Energy | None] = lambda section: None) -> Document:
    """Read a document into sections with definitions, energies and claims.

    Parameters
    ----------
    source
        The document's text.
    declare
        Gives the declared energy of a section, or None.

    Raises
    ------
    InputError
        For anything that cannot be read, wrong shapes, circular definitions, and sections without an energy.
    """
    try:
        return _read_document(source, declare)
    except ShapeError as error:  # definitions that go in a circle
        source.fail(error.span[0], error.message)


def _read_document(source: Source, declare: Callable[[Section], Energy | None]) -> Document:
    items = list(read(source))
    shared, groups = _sections(source, items)
    relations = tuple(item for item in items if isinstance(item, Relation))
    if not relations:
        source.fail(0, "the document has no numbered formulas: displays are written $$ ... \\quad (7)$$")
    sections = []
    for section, own in groups:
        section.declared = declare(section)
        pending = _definitions(section, own)
        if section is shared:
            for relation in pending:
                first = relation.members[0]
                what = "an energy" if first.op == "energy" else "a claim"
                source.fail(
                    relation.offset, f"equation ({relation.equation}) states {what} before the first section heading"
                )
            continue
        only_definitions = bool(own) and not pending and section.energy is None
        if only_definitions:
            shared.definitions.update(section.definitions)
            shared.assumptions.extend(section.assumptions)
            continue
        if section.energy is None:
            source.fail(section.offset, f"section '{section.title}' has no energy: it needs a numbered display V = ...")
        for node in section.energy.expression.walk():
            if node.op in {"energy", "force", "derivative"}:
                what = "by itself" if node.op == "energy" else "by its own forces or derivatives"
                source.fail(
                    node.span[0], f"equation ({section.energy.relation.equation}): the energy is defined {what}"
                )
        _unknowns(section, own)
        for relation in pending:
            section.claims += _claims(relation)
        sections.append(section)
    if not sections:
        source.fail(0, "the document has no section with an energy: it needs a heading and a numbered display V = ...")
    document = Document(source, shared, tuple(sections), relations)
    _check_shapes(document, groups)
    return document


def _definitions(section: Section, own: Iterable[Relation]) -> list[Relation]:
    """Take definitions, assumptions and the energy out of a section's relations; what is left are claims."""
    left: list[Relation] = []
    second_energies: list[Relation] = []
    for relation in own:
        section.assumptions += assumptions(relation.members, relation.operators)
        for equal in _equalities(relation):
            first, second = equal.members[:2]
            if first.op == "energy" and section.energy is not None and not equal.inline:
                second_energies.append(equal)
            if first.op == "energy" and section.energy is None and section.title != "":
                section.energy = Definition(first.name, second, equal)
            elif (
                first.op == "symbol"
                and section.definition(first.name) is None
                and not (section.is_unknown(first.name) and first.name.sub.isdigit())
                and not any(_states_mechanics(member) for member in equal.members)
            ):
                index = _running_index(first.name, second)
                section.definitions[first.name] = Definition(first.name, second, equal, index)
                section.forget()
            else:
                left.append(equal)
                continue
            if len(equal.operators) > 1:
                rest = replace(equal, members=equal.members[1:], operators=equal.operators[1:], offset=second.span[0])
                left.append(rest)
    for relation in second_energies:
        _check_second_energy(section, relation)
    return left


def _check_second_energy(section: Section, relation: Relation) -> None:
    """A section has one energy; another formula for it must be one of the same unknowns."""
    assert section.energy is not None
    name, first = relation.members[0].name, section.energy
    unknowns = [
        {n for n in section.base_symbols(tree) if section.is_unknown(n)}
        for tree in (first.expression, relation.members[1])
    ]
    if name != first.symbol or unknowns[0] != unknowns[1]:
        message = (
            f"equation ({relation.equation}) states a second energy in section '{section.title}', after equation "
            f"({first.relation.equation}); is a heading missing?"
        )
        raise ShapeError(relation.members[0], message)


def _equalities(relation: Relation) -> Iterator[Relation]:
    """The longest pieces of a chain that are joined by equality signs alone."""
    start = 0
    for end, operator in enumerate((*relation.operators, ">")):
        if operator != "=":
            if end > start:
                members, operators = relation.members[start : end + 1], relation.operators[start:end]
                offset = members[0].span[0] if start else relation.offset
                yield replace(relation, members=members, operators=operators, offset=offset)
            start = end + 1


def _unknowns(section: Section, own: Iterable[Relation]) -> None:
    """Settle what the section's unknowns and parameters are: as declared, or as its printed energy has them."""
    assert section.energy is not None
    section.forget()
    named = {node.name for r in own for m in r.members for node in m.walk() if node.op in {"force", "derivative"}}
    named = {name for name in named if section.definition(name) is None}  # a misprint; d_1 still means what it says
    section.families |= {(name.base, name.bold) for name in named if INDEX.match(name.sub)}
    base = section.base_symbols(section.energy.expression)
    if section.declared is not None:
        section.parameters = _declared_parameters(section, section.declared, base, own)
        section.unknowns = section.declared.unknowns
        section.families |= {(name.base, name.bold) for name in section.unknowns}
        if not section.assumptions:
            section.assumptions = list(section.declared.domain)
        return
    section.families |= {(n.base, n.bold) for n in base if n.bold and INDEX.match(n.sub)}
    unknown = [n for n in base if n in named or section.is_unknown(n)]
    section.parameters = tuple(name for name in base if name not in unknown)
    section.unknowns = tuple(sorted(unknown, key=lambda n: (not n.bold, n.base, n.sub)))


def _declared_parameters(
    section: Section, declared: Energy, base: list[Name], own: Iterable[Relation]
) -> tuple[Name, ...]:
    """Declared parameters, and symbols of the printed energy that the section uses in their place throughout."""
    names = tuple(parameter.name for parameter in declared.parameters)
    uses = [n.name for r in own for m in r.members for n in m.walk() if n.op == "symbol"]
    strange = [n for n in base if n not in names and n not in declared.unknowns and not section.is_unknown(n)]
    unused = [n for n in names if n not in base]
    renamed = sum(map(uses.count, strange)) > sum(map(uses.count, unused)) + len(strange)
    return (*names, *strange) if renamed else names


def _claims(relation: Relation) -> list[Claim]:
    *members, last = relation.members
    return [
        Claim(block_of(member) or block_of(last) or latex(member), member, last, relation, index)
        for index, member in enumerate(members)
    ]


def _check_shapes(document: Document, groups: list[tuple[Section, list[Relation]]]) -> None:
    """Every member of every relation has a shape, and those of an inequality are scalars."""
    for section, own in groups:
        for relation in own:
            try:
                kinds = [section.type_of(member) for member in relation.members]
            except ShapeError as error:
                document.source.fail(
                    error.span[0],
                    f"equation ({relation.equation}): {error.message}" if not relation.inline else error.message,
                )
            if any(op != "=" for op in relation.operators) and any(map(_states_mechanics, relation.members)):
                what = "" if relation.inline else f"equation ({relation.equation}): "
                document.source.fail(relation.offset, what + "a claim about forces or energies must be an equation")
            for index, operator in enumerate(relation.operators):
                for member, kind in zip(relation.members[index : index + 2], kinds[index : index + 2], strict=True):
                    if operator != "=" and kind not in (Type.SCALAR, Type.UNKNOWN):
                        document.source.fail(member.span[0], f"cannot compare a {kind.value} by {operator}")
        energy = section.energy
        if energy is not None and section.type_of(energy.expression) not in (Type.SCALAR, Type.UNKNOWN):
            document.source.fail(energy.expression.span[0], "an energy is a scalar")


__all__ = ["Claim", "Definition", "Document", "Section", "block_of", "instantiate", "read_document"]
