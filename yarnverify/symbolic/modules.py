"""The text of the kernel modules: programs in a template, one module an energy and variant."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from yarnverify.errors import NotRunError
from yarnverify.source import load
from yarnverify.symbolic.court import Court, Verdict
from yarnverify.symbolic.declare import Declarations, Energy, load_declarations
from yarnverify.symbolic.derive import declared_section, derive_declared
from yarnverify.symbolic.document import Claim, Document, Section, block_of
from yarnverify.symbolic.emit import Program, dof_labels, identifier, plain_program, program, statements, used_functions
from yarnverify.symbolic.prove import read_with
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
        raise NotRunError(
            f"equation ({claim.relation.equation}) uses an undefined symbol and cannot be evaluated as printed"
        )
    return repair.members, f"equation ({claim.relation.equation}) cannot be evaluated as printed: {describe(repair)}"


# -- templates --------------------------------------------------------------------------------------------------------

_TEMPLATES = Environment(
    loader=FileSystemLoader(Path(__file__).parent / "templates"),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)
_NAMES = ("DOFS", "KERNEL", "PARAMETERS", "VARIANT", "energy", "evaluate", "gradient", "hessian", "packed")


def _face(energy: Energy, default: str) -> str:
    return _TEMPLATES.get_template("face.py.jinja").render(
        title=_title(energy), energy=energy, default=default, names=_NAMES
    )


def _title(energy: Energy) -> str:
    return energy.section or energy.name.replace("_", " ")


def _module(energy: Energy, variant: str, made: Program, document: str, notes: list[str]) -> str:
    dofs = dof_labels(energy.unknowns)
    names = [identifier(parameter.name) for parameter in energy.parameters]
    functions = _functions(made, [label.replace(".", "") for label in dofs], names)
    code = "\n".join(line for function in functions for line in function["lines"])
    full, upper = f"({len(dofs)}, {len(dofs)}, n)", f"({len(dofs) * (len(dofs) + 1) // 2}, n)"
    units = f"{energy.unit}, {energy.unit}/m and {energy.unit}/m^2"
    vector, three = f"({len(dofs)}, n)", "tuple[Array, Array, Array]"
    return _TEMPLATES.get_template("kernel.py.jinja").render(
        energy=energy,
        title=_title(energy),
        variant=variant,
        summary=SUMMARY[variant],
        notes=notes,
        source=f"derivations/{energy.name}.py" + (f" and derivations/{document}" if variant == "printed" else ""),
        counts=", ".join(f"{key} {count}" for key, count in made.operations.items()),
        imports=used_functions(code),
        dofs=_tuple(dofs),
        parameters=_tuple(names),
        names=names,
        rows=len(dofs),
        functions=functions,
        checks=made.checks,
        active=made.active is not None,
        public=(
            ("energy", "(n,)", "Energy of each element", energy.unit, "Array"),
            ("gradient", vector, "Gradient, the negative of the force", f"{energy.unit}/m", "Array"),
            ("hessian", full, "Hessian, exactly symmetric", f"{energy.unit}/m^2", "Array"),
            ("evaluate", f"(n,), {vector}, {full}", "Energy, gradient and Hessian at once", units, three),
            (
                "packed",
                f"(n,), {vector}, {upper}",
                "The same, of the Hessian the upper triangle row by row",
                units,
                three,
            ),
        ),
    )


def _tuple(names: Iterable[str]) -> str:
    inner = [f'"{name}"' for name in names]
    return f"({inner[0]},)" if len(inner) == 1 else f"({', '.join(inner)})"


def _functions(made: Program, rows: list[str], names: list[str]) -> list[dict[str, Any]]:
    """Name, arguments and body of the private functions of a module."""
    energy = {"E[:]": made.energy}
    gradient = {f"G[{i}]": value for i, value in enumerate(made.gradient)}
    hessian = {f"H[{i}]": value for i, value in enumerate(made.hessian)}
    inputs = [f"{argument}: Array" for argument in ("q", *names)]
    unpack = f"{', '.join(rows)}{',' if len(rows) == 1 else ''} = q"
    found = []
    for name, outputs, targets in (
        ("_energy", energy, "E"),
        ("_gradient", gradient, "G"),
        ("_hessian", hessian, "H"),
        ("_evaluate", {**energy, **gradient, **hessian}, "EGH"),
    ):
        arguments = ", ".join([*inputs, *(f"{target}: Array" for target in targets)])
        found.append(
            {
                "name": name,
                "arguments": arguments,
                "returns": "None",
                "lines": [unpack, *statements(made.steps, outputs)],
            }
        )
    margins = {f"margin{i}": check[0] for i, check in enumerate(made.checks)}
    lines = [unpack, *statements(made.steps, margins)] if margins else []
    lines.append(f"return ({''.join(f'{margin}, ' for margin in margins).strip()})")
    found.append({"name": "_margins", "arguments": ", ".join(inputs), "returns": "tuple[Array, ...]", "lines": lines})
    if made.active is not None:
        lines = [unpack, *statements(made.steps, {"active": made.active}), "return active"]
        found.append({"name": "_active", "arguments": ", ".join(inputs), "returns": "Array", "lines": lines})
    return found
