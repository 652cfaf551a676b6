"""What was found of a document, as plain JSON data: the only thing that tables and pages are made from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from yarnverify.errors import InputError
from yarnverify.library import Shelf
from yarnverify.source import Source
from yarnverify.symbolic.court import Verdict
from yarnverify.symbolic.declare import Declarations, load_declarations
from yarnverify.symbolic.derive import derive
from yarnverify.symbolic.document import Document, Section, block_of, instantiate
from yarnverify.symbolic.effects import effect
from yarnverify.symbolic.latex import latex
from yarnverify.symbolic.places import part_of
from yarnverify.symbolic.prove import Completeness, Judged, Trial, read_with, try_document
from yarnverify.symbolic.repair import Repair, Workshop, chain_latex, describe
from yarnverify.symbolic.scalars import origin_last
from yarnverify.symbolic.tree import FORCE, Expr, rebuild

SCHEMA = 1


def prove_source(
    source: Source, shelf: Shelf, advance: Callable[[str, int], None] = lambda what, total: None
) -> dict[str, Any]:
    """Judge a document and describe what was found.

    Parameters
    ----------
    source
        The document's text.
    shelf
        Which declarations it is judged by.
    advance
        Called with a label and the total number of steps as each step is done.
    """
    declarations = load_declarations(shelf.folder) if shelf.folder else Declarations()
    declarations = Declarations(
        tuple(e for e in declarations.energies if e.document == shelf.document),
        tuple(q for q in declarations.quantities if q.document == shelf.document),
    )
    document = read_with(source, declarations)
    if Path(source.name).name == shelf.document:  # an edition under another name may leave sections out
        _require_sections(document, declarations)
    total = sum(len(section.claims) + 1 for section in document.sections) + len(document.shared.definitions)
    trial = try_document(document, declarations, lambda equation: advance(f"equation ({equation})", total))
    return describe_trial(trial, shelf)


def _require_sections(document: Document, declarations: Declarations) -> None:
    """Refuse an energy that names a section which its document does not have."""
    titles = {section.title.casefold(): section.title for section in document.sections}
    for energy in declarations.energies:
        if energy.section.casefold() not in titles:
            there = ", ".join(repr(title) for title in titles.values())
            raise InputError(
                f"{energy.name}: {document.source.name} has no section {energy.section!r}; there are {there}",
                part_of(energy.place, "section"),
            )


def describe_trial(trial: Trial, shelf: Shelf) -> dict[str, Any]:
    repairs: dict[int, Repair | None] = {}
    claims = [_claim(judged, trial, repairs) for judged in trial.judged]
    given = [
        {"equation": d.relation.equation, "block": block_of(d.relation.members[0]), "kind": kind, "section": s.title,
         "line": trial.document.source.place(d.relation.offset)[0], "printed": chain_latex(d.relation.members[:2])}
        for s, d, kind in trial.given
    ]  # fmt: skip
    tally = Counter(claim["verdict"] for claim in claims)
    return {
        "schema": SCHEMA,
        "document": Path(trial.document.source.name).name,
        "judged": shelf.how if shelf.folder is None else f"by the energies declared for {shelf.document}",
        "equations": list(trial.document.equations),
        "tally": {verdict.value: tally.get(verdict.value, 0) for verdict in Verdict},
        "claims": claims,
        "given": given,
        "completeness": [_completeness(found) for found in trial.completeness],
    }


def _claim(judged: Judged, trial: Trial, repairs: dict[int, Repair | None]) -> dict[str, Any]:
    finding, claim = judged.finding, judged.claim
    line, column = trial.document.source.place(claim.relation.offset)
    repair = None
    if finding.verdict is Verdict.REFUTED and finding.mendable and not judged.because:
        if id(claim.relation) not in repairs:
            repairs[id(claim.relation)] = _repair(judged)
        repair = repairs[id(claim.relation)]
    refuted = finding.verdict is Verdict.REFUTED
    return {
        "equation": claim.relation.equation,
        "block": claim.block,
        "section": judged.section.title,
        "kind": judged.kind,
        "verdict": finding.verdict.value,
        "reason": _reason(judged),
        "because": list(judged.because),
        "line": line,
        "column": column,
        "printed": chain_latex(claim.relation.members),
        "correction": chain_latex(repair.members)
        if repair
        else _derived(judged)
        if refuted and finding.mendable
        else None,
        "change": describe(repair) if repair else None,
        "edit": {"kind": repair.change, "before": latex(repair.before), "after": latex(repair.after)}
        if repair
        else None,
        "witness": _witness(judged),
        "effect": effect(judged) if refuted and not finding.undefined and not judged.because else None,
    }


def _reason(judged: Judged) -> str:
    finding = judged.finding
    if judged.because:
        return "follows from equation " + ", ".join(f"({number})" for number in judged.because)
    if finding.reason:
        return finding.reason
    if finding.verdict is Verdict.REFUTED:
        return (
            "differs from the declared one"
            if judged.kind in ("definition", "energy")
            else "differs from the true value"
        )
    return ""


def _repair(judged: Judged) -> Repair | None:
    members, declared = judged.claim.relation.members, judged.claim.left
    if judged.kind == "definition":
        index, value = judged.index

        def sides(trees: tuple[Expr, ...]) -> list[tuple[Expr, Expr]]:
            return [(declared, instantiate(trees[1], index, value) if index else trees[1])]

        return Workshop(judged.court, members, sides, fixed=1).find()
    if judged.kind == "energy":
        return Workshop(judged.court, members, lambda trees: [(judged.court.energy, trees[1])], fixed=1).find()
    return Workshop(judged.court, members, lambda trees: [(left, trees[-1]) for left in trees[:-1]]).find()


def _derived(judged: Judged) -> str | None:
    """What should stand there when no small change mends it: the declared or derived formula."""
    claim, section = judged.claim, judged.section
    if judged.kind == "definition":
        index, value = judged.index
        declared = instantiate(claim.left, value, index) if index else claim.left
        return f"{latex(claim.relation.members[0])} = {latex(declared)}"
    if judged.kind == "energy":
        return f"{latex(claim.left)} = {latex(judged.court.energy)}"
    block = claim.left.args[0] if claim.left.op == "neg" else claim.left
    tree = _derived_block(section, judged.court.energy, block)
    return f"{latex(block)} = {latex(tree)}" if tree is not None else None


def _derived_block(section: Section, energy: Expr, block: Expr) -> Expr | None:
    names = [node.name for node in block.walk() if node.op in ("force", "derivative")]
    derivation = derive(energy, section, tuple(dict.fromkeys([*section.unknowns, *names])))
    if derivation is None:
        return None
    derivation, tree = replace(derivation, order=origin_last), None
    if block.op == "force":
        tree = derivation.gradient(block.name, FORCE)
    elif block.op == "derivative" and block.args[0].op == "force":
        tree = derivation.hessian(block.args[0].name, block.name, FORCE)

    def spelled_out(node: Expr) -> Expr | None:
        """What a symbol stands for that the document does not define."""
        known = node.op != "symbol" or section.meaning(node.name) is not None
        meaning = None if known else derivation.section.meaning(node.name)
        return meaning and rebuild(meaning, spelled_out)

    return tree and rebuild(tree, spelled_out)


# -- witnesses --------------------------------------------------------------------------------------------------------


def _texts(values: Iterable[Any], digits: int) -> list[str]:
    return [str(value.str(digits, radius=False)) for value in values]


def _witness(judged: Judged) -> dict[str, Any] | None:
    witness = judged.finding.witness
    if witness is None:
        return None
    point: dict[str, Any] = {}
    floats: dict[str, Any] = {}
    for name, value in witness.state.items():
        parts = value if isinstance(value, tuple) else (value,)
        texts, hexes = [str(part) for part in parts], [hexadecimal(part) for part in parts]
        label = name.label if judged.section.is_unknown(name) else str(name)
        point[label] = texts if name.bold else texts[0]
        floats[label] = hexes if name.bold else hexes[0]
    if not witness.right:
        return {"point": point, "hex": floats, "printed": ["undefined"], "true": [], "residual": []}
    digits = 17
    while digits < 10**4 and _texts(witness.right, digits) == _texts(witness.left, digits):
        digits *= 2  # a difference too small to be seen yet
    return {
        "point": point,
        "hex": floats,
        "printed": _texts(witness.right, digits),
        "true": _texts(witness.left, digits),
        "residual": _texts([r - t for r, t in zip(witness.right, witness.left, strict=True)], 17),
    }


def hexadecimal(value: Fraction) -> str:
    """A rational as a hexadecimal float."""
    number = float(value)
    if Fraction(number) != value:
        raise AssertionError(f"{value} is not a double: states are drawn so that they are")
    return number.hex()


# -- completeness -----------------------------------------------------------------------------------------------------


def _completeness(found: Completeness) -> dict[str, Any]:
    return {
        "section": found.section.title,
        "verdict": "refuted" if found.missing else "undecided" if found.unknown else "proved",
        "listed": list(found.listed),
        "zero": list(found.zero),
        "unknown": list(found.unknown),
        "missing": [
            {"block": block_of(expr), "latex": latex(expr), "derived": _missing(found, expr)} for expr in found.missing
        ],
    }


def _missing(found: Completeness, expr: Expr) -> str | None:
    tree = _derived_block(found.section, found.court.energy, expr)
    return latex(tree) if tree is not None else None
