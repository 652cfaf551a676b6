"""The text of the kernel modules: programs in a template, one module an energy and variant."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from yarnverify.errors import NotRunError
from yarnverify.source import load
from yarnverify.symbolic.declare import Declarations, Energy, load_declarations
from yarnverify.symbolic.derive import derive_declared, declared_section
from yarnverify.symbolic.document import Claim, Document, Section, block_of
from yarnverify.symbolic.emit import Program, dof_labels, identifier, plain_program, program, statements, used_functions
from yarnverify.symbolic.prove import Court, Verdict, read_with
from yarnverify.symbolic.reading import UnsupportedError
from yarnverify.symbolic.repair import Workshop
from yarnverify.symbolic.tree import FORCE, Expr

SUMMARY = {
    "differentiated": "the derivative by SymPy, chain rule over the measures, common subexpressions shared",
    "printed": "the document's own formulas, misprints included",
}


def kernel_modules(
    folder: Path, document: str, default: str, advance: Callable[[str, int], None]
) -> tuple[dict[str, str], dict[str, Any]]:
    """Relative path to text of every generated file, and the operation counts.

    Raises
    ------
    NotRunError
        If a derived block is not proved, or the document lacks a formula that its variant needs.
    """
    declarations = load_declarations(folder)
    energies = [energy for energy in declarations.energies if energy.document == document]
    printed = read_with(load(folder / document), declarations)
    texts: dict[str, str] = {}
    record: dict[str, Any] = {}
    for energy in energies:
        advance(f"{energy.name}, differentiated", 2 * len(energies))
        programs = {"differentiated": derived_program(energy, declarations)}
        advance(f"{energy.name}, printed", 2 * len(energies))
        programs["printed"], notes = printed_program(energy, printed)
        for variant, made in programs.items():
            note = notes if variant == "printed" else []
            texts[f"{variant}/{energy.name}.py"] = _module(energy, variant, made, document, note)
            record.setdefault(energy.name, {})[variant] = dict(made.operations)
        texts[f"{energy.name}.py"] = _face(energy, default)
    for variant in SUMMARY:
        texts[f"{variant}/__init__.py"] = f'"""Variant ``{variant}``: {SUMMARY[variant]}. Generated."""\n'
    return dict(sorted(texts.items())), record


def derived_program(energy: Energy, declarations: Declarations) -> Program:
    """The program of the derived blocks, each of which is proved first."""
    derivation = derive_declared(energy, declarations.quantities)
    if derivation is None:
        return plain_program(energy, declared_section(energy))
    for block, finding in derivation.check().items():
        if finding.verdict is not Verdict.PROVED:
            raise NotRunError(f"{energy.name}: derived block {block} is {finding.verdict}: {finding.reason}")
    formulas = {block: tree for first, rest in derivation.blocks(1) for block, tree in (first, *rest)}
    angles = [measure.symbol for measure in derivation.measures if measure.b is not None]
    return program(energy, derivation.section, derivation.law_tree, formulas, 1, angles)


def printed_program(energy: Energy, document: Document) -> tuple[Program, list[str]]:
    """The program of the document's own formulas, and notes on what had to be read as something else."""
    section = next((s for s in document.sections if s.declared is not None and s.declared.name == energy.name), None)
    if section is None or section.energy is None:
        raise NotRunError(f"{energy.name}: {document.source.name} has no section for it")
    formulas, notes = _printed_formulas(section)
    angles = [name for name in section.definitions if _is_arccos(section, name)]
    try:
        return program(energy, section, section.energy.expression, formulas, FORCE, angles), notes
    except UnsupportedError as error:
        raise NotRunError(f"{energy.name}, variant printed: {error}") from None


def _is_arccos(section: Section, name: Any) -> bool:
    meaning = section.meaning(name)
    return meaning is not None and meaning.op == "call" and meaning.value == "arccos"


def _printed_formulas(section: Section) -> tuple[dict[Expr, Expr], list[str]]:
    """What the document prints for each block; a chain with an undefined symbol is read as mended."""
    formulas: dict[Expr, Expr] = {}
    notes: list[str] = []
    mended: dict[int, tuple[Expr, ...]] = {}
    for claim in section.claims:
        members = claim.relation.members
        if section.undefined(claim.right):
            if id(claim.relation) not in mended:
                mended[id(claim.relation)], note = _mend(section, claim)
                notes.append(note)
            members = mended[id(claim.relation)]
        block, negative = (claim.left.args[0], True) if claim.left.op == "neg" else (claim.left, False)
        if block_of(block) and block.op in ("force", "derivative"):
            formulas.setdefault(block, -members[-1] if negative else members[-1])
    return formulas, notes


def _mend(section: Section, claim: Claim) -> tuple[tuple[Expr, ...], str]:
    from yarnverify.symbolic.repair import describe

    assert section.energy is not None
    court = Court(section, section.energy.expression)
    repair = Workshop(court, claim.relation.members, lambda trees: [(t, trees[-1]) for t in trees[:-1]]).find()
    if repair is None:
        raise NotRunError(f"equation ({claim.relation.equation}) uses an undefined symbol and cannot be evaluated as printed")
    return repair.members, f"equation ({claim.relation.equation}) cannot be evaluated as printed: {describe(repair)}"


# -- template ---------------------------------------------------------------------------------------------------------


def _face(energy: Energy, default: str) -> str:
    return (
        f'"""{_title(energy)}: {energy.summary}\n\n'
        f"The default variant, ``{default}``. Generated by ``yarnverify generate``; do not edit.\n"
        '"""\n\n'
        f"from yarnverify.kernels.{default}.{energy.name} import (\n"
        + "".join(f"    {name},\n" for name in ("DOFS", "KERNEL", "PARAMETERS", "VARIANT", "energy", "evaluate", "gradient", "hessian", "packed"))
        + ")\n\n"
        '__all__ = ["DOFS", "KERNEL", "PARAMETERS", "VARIANT", "energy", "evaluate", "gradient", "hessian", "packed"]\n'
    )


def _title(energy: Energy) -> str:
    return energy.section or energy.name.replace("_", " ")


def _module(energy: Energy, variant: str, made: Program, document: str, notes: list[str]) -> str:
    dofs = dof_labels(energy.unknowns)
    names = [identifier(parameter.name) for parameter in energy.parameters]
    rows = [label.replace(".", "") for label in dofs]
    body = _functions(made, rows, names)
    imports = used_functions(body)
    counts = ", ".join(f"{key} {count}" for key, count in made.operations.items())
    source = f"derivations/{energy.name}.py" + (f" and derivations/{document}" if variant == "printed" else "")
    head = [
        f'"""{_title(energy)}: {energy.summary}',
        "",
        f"Variant ``{variant}``: {SUMMARY[variant]}.",
        *(f"Note: {note}." for note in notes),
        f"Generated by ``yarnverify generate`` from {source}; do not edit.",
        f"Total operations per element: {counts}.",
        '"""',
        "",
        *([f"from numpy import {', '.join(imports)}", ""] if imports else []),
        "from yarnverify.kernels import runtime",
        "from yarnverify.kernels.runtime import Array, ArrayLike, Errors",
        "",
        f'VARIANT = "{variant}"',
        f"DOFS = {_tuple(dofs)}",
        f"PARAMETERS = {_tuple(names)}",
        "",
        "",
    ]
    text = "\n".join(head) + body + _kernel(energy, made, dofs, names)
    for name, shape, what in _PUBLIC:
        text += _public(energy, name, shape.format(dof=len(dofs), packed=len(dofs) * (len(dofs) + 1) // 2), what, names)
    return text


_PUBLIC = (
    ("energy", "(n,)", "Energy of each element"),
    ("gradient", "({dof}, n)", "Gradient of each element; the force is its negative"),
    ("hessian", "({dof}, {dof}, n)", "Hessian of each element, exactly symmetric"),
    ("evaluate", "(n,), ({dof}, n) and ({dof}, {dof}, n)", "Energy, gradient and Hessian, sharing what they share"),
    ("packed", "(n,), ({dof}, n) and ({packed}, n)", "Energy, gradient and the Hessian's upper triangle, row by row"),
)


def _tuple(names: Any) -> str:
    inner = ", ".join(f'"{name}"' for name in names)
    return f"({inner},)" if len(names) == 1 else f"({inner})"


def _functions(made: Program, rows: list[str], names: list[str]) -> str:
    energy = {"E[:]": made.energy}
    gradient = {f"G[{i}]": value for i, value in enumerate(made.gradient)}
    hessian = {f"H[{i}]": value for i, value in enumerate(made.hessian)}
    unpack = f"    {', '.join(rows)}, = q\n" if len(rows) == 1 else f"    {', '.join(rows)} = q\n"
    typed = ", ".join(f"{argument}: Array" for argument in ["q", *names])
    text = ""
    for name, outputs, targets in (
        ("_energy", energy, "E"),
        ("_gradient", gradient, "G"),
        ("_hessian", hessian, "H"),
        ("_evaluate", {**energy, **gradient, **hessian}, "EGH"),
    ):
        lines = statements(made.steps, outputs)
        filled = ", ".join(f"{target}: Array" for target in targets)
        text += f"def {name}({typed}, {filled}) -> None:\n{unpack}" + "".join(f"    {line}\n" for line in lines) + "\n\n"
    margins = {f"margin{i}": check[0] for i, check in enumerate(made.checks)}
    lines = statements(made.steps, margins)
    inner = "".join(f"{target}, " for target in margins)
    returned = f"({inner.strip()})" if margins else "()"
    text += f"def _margins({typed}) -> tuple[Array, ...]:\n" + (unpack if margins else "") + "".join(f"    {line}\n" for line in lines)
    text += f"    return {returned}\n\n\n"
    if made.active is not None:
        lines = statements(made.steps, {"active": made.active})
        text += f"def _active({typed}) -> Array:\n{unpack}" + "".join(f"    {line}\n" for line in lines) + "    return active\n\n\n"
    return text


def _kernel(energy: Energy, made: Program, dofs: tuple[str, ...], names: list[str]) -> str:
    parameters = "".join(
        f'        ("{name}", {parameter.positive}),\n' for name, parameter in zip(names, energy.parameters, strict=True)
    )
    checks = "".join(f'        ("{needed}", "{reason}"),\n' for _, needed, reason in made.checks)
    return (
        "KERNEL = runtime.Kernel(\n"
        f'    name="{energy.name}",\n'
        "    dofs=DOFS,\n"
        f"    parameters=(\n{parameters}    ),\n"
        f"    checks=(\n{checks}    ),\n"
        "    energy=_energy,\n    gradient=_gradient,\n    hessian=_hessian,\n    evaluate=_evaluate,\n    margins=_margins,\n"
        + ("    active=_active,\n" if made.active is not None else "")
        + ")\n"
    )


def _public(energy: Energy, name: str, shape: str, what: str, names: list[str]) -> str:
    given = ", ".join(f'"{n}": {n}' for n in names)
    units = "\n".join(
        f"    {n} : float or (n,) array, in {p.unit}" + (", not negative" if p.positive else "")
        for n, p in zip(names, energy.parameters, strict=True)
    )
    rows = len(dof_labels(energy.unknowns))
    result = "Array" if name in ("energy", "gradient", "hessian") else "tuple[Array, Array, Array]"
    typed = ", ".join(f"{n}: ArrayLike" for n in names)
    return (
        f"\n\ndef {name}(q: ArrayLike, *, {typed}, errors: Errors = \"raise\") -> {result}:\n"
        f'    """{what}.\n\n'
        "    Parameters\n    ----------\n"
        f"    q : ({rows}, n) array, in m; rows as in DOFS\n{units}\n"
        '    errors : "raise", or "mask" for NaN where an element has no value\n\n'
        "    Returns\n    -------\n"
        f"    {shape}, in {energy.unit} and {energy.unit} per unit of q\n\n"
        "    Raises\n    ------\n"
        "    TypeError, ValueError\n        For arrays of the wrong kind or shape, and parameters out of range.\n"
        "    ElementError\n        Naming the first element without a value, and the reason.\n"
        '    """\n'
        f"    return runtime.{name}(KERNEL, q, {{{given}}}, errors)\n"
    )


