"""The text of the kernel modules: programs in a template, one module an energy and variant."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from yarnverify.errors import NotRunError
from yarnverify.source import load
from yarnverify.symbolic.angles import prove_derivatives, prove_recurrence, turning_series
from yarnverify.symbolic.court import Court, Finding, Verdict
from yarnverify.symbolic.declare import Declarations, Energy, load_declarations
from yarnverify.symbolic.derive import Derivation, declared_section, derive_declared
from yarnverify.symbolic.dimensions import DimensionError, check_dimensions
from yarnverify.symbolic.document import Claim, Document, Section, block_of
from yarnverify.symbolic.emit import (
    LIBRARY,
    Program,
    dof_labels,
    given_symbols,
    identifier,
    plain_program,
    program,
    statements,
    text_of,
    used_functions,
)
from yarnverify.symbolic.invariants import prove_invariants
from yarnverify.symbolic.measures import NoMeasuresError
from yarnverify.symbolic.prove import read_with
from yarnverify.symbolic.reading import UnsupportedError
from yarnverify.symbolic.repair import Workshop
from yarnverify.symbolic.safe import Safe, safe_shapes
from yarnverify.symbolic.safe_program import safe_program
from yarnverify.symbolic.sums import Stages, is_rational
from yarnverify.symbolic.tree import FORCE, Expr

SUMMARY = {
    "accurate": "safe forms, the rounding errors of edges, products and sums carried along",
    "fast": "safe forms in plain arithmetic, which lose what the rounding of differences explains",
    "reference": "safe forms in pairs of doubles, rounded once; slow",
    "differentiated": "the derivative by SymPy, chain rule over the measures, common subexpressions shared",
    "printed": "the document's own formulas, misprints included",
}
VARIANTS = tuple(SUMMARY)
_PLAIN_SUMS = (
    "no measures: each sum is formed once, in plain arithmetic, and loses only what the rounding of its terms explains"
)
_SERIES_TOP, _SERIES_DEGREE = Fraction(97, 500), 13  # sin(t/4)^2 is 0.1939 where cos t = -1/4


def kernel_modules(
    folder: Path, document: str, default: str, advance: Callable[[str, int], None]
) -> tuple[dict[str, str], dict[str, Any]]:
    """Relative path to text of every generated file, and the operation counts.

    Raises
    ------
    NotRunError
        If a derived block or a declared invariance is not proved, units do not come out as that of the energy, or the
        document lacks a formula that its variant needs.
    """
    declarations = load_declarations(folder)
    energies = [energy for energy in declarations.energies if energy.document in (document, "")]
    planned = [(energy, variant) for energy in energies for variant in variants_of(energy)]
    printed = read_with(load(folder / document), declarations)
    texts: dict[str, str] = {"series.py": series_module()}
    record: dict[str, Any] = {}
    for energy in energies:
        try:
            check_dimensions(energy)
        except DimensionError as error:
            raise NotRunError(f"{energy.name}: {error}") from None
        derived = proved(energy, declarations)
        for variant in variants_of(energy):
            advance(f"{energy.name}, {variant}", len(planned))
            if variant == "printed":
                made, notes = printed_program(energy, printed)
                programs = [made]
            else:
                programs, notes = derived_programs(energy, derived, variant)
            text, counts = module_text(energy, variant, programs, document, notes)
            texts[f"{variant}/{energy.name}.py"] = text
            if energy.document:
                record.setdefault(energy.name, {})[variant] = counts
        texts[f"{energy.name}.py"] = _face(energy, default)
    for variant in SUMMARY:
        texts[f"{variant}/__init__.py"] = f'"""Variant ``{variant}``: {SUMMARY[variant]}. Generated."""\n'
    return dict(sorted(texts.items())), record


def variants_of(energy: Energy) -> tuple[str, ...]:
    """The variants that an energy has: those for comparison with the document only where one prints it."""
    return VARIANTS if energy.document else ("accurate", "fast", "reference")


def series_module() -> str:
    """The polynomial that ``kernels.geometry`` uses, with its proof behind it."""
    prove_derivatives()
    prove_recurrence()
    series = turning_series(_SERIES_TOP, _SERIES_DEGREE)
    return _TEMPLATES.get_template("series.py.jinja").render(
        bound=f"{float(series.bound * 2**53):.3g}",
        top=float(series.top),
        coefficients=[repr(value) for value in series.coefficients],
    )


@dataclass(frozen=True)
class Proved:
    """What an energy's kernels are made of, all of it proved.

    Attributes
    ----------
    derivation, shapes
        Of a law of measures: its derivation, and its safe shapes.
    stages
        Of an energy that is rational in its coordinates.
    """

    derivation: Derivation | None = None
    shapes: tuple[Safe, ...] = ()
    stages: Stages | None = None


def proved(energy: Energy, declarations: Declarations) -> Proved:
    """Derive an energy and prove all of it.

    Raises
    ------
    NotRunError
        If a derived block or a declared invariance is not proved.
    """
    _require_proofs(energy.name, prove_invariants(energy, declarations.motions), "")
    derivation = derive_declared(energy, declarations.quantities)
    if derivation is None:
        section = declared_section(energy)
        if not is_rational(energy, section):
            return Proved()
        stages = Stages(energy, section)
        if wrong := stages.prove():
            raise NotRunError(f"{energy.name}: derivatives by {', '.join(wrong)} are not those of the energy")
        return Proved(stages=stages)
    _require_proofs(energy.name, derivation.check())
    shapes: tuple[Safe, ...] = ()
    with suppress(NoMeasuresError):
        shapes = tuple(safe_shapes(derivation))
    for shape in shapes:
        _require_proofs(f"{energy.name}, {shape.shape} shape", shape.check())
    return Proved(derivation, shapes)


def derived_programs(energy: Energy, found: Proved, variant: str) -> tuple[list[Program], list[str]]:
    """The programs of a derived variant, and notes on what is not as wished."""
    if found.stages is not None and variant != "differentiated":
        return [found.stages.program()], [_PLAIN_SUMS] if variant == "accurate" else []
    if found.derivation is None:
        note = "this energy is no law of known measures: plain differentiation, nothing is done for its singular states"
        return [plain_program(energy, declared_section(energy))], [note]
    if variant == "differentiated":
        return [derived_program(energy, found.derivation)], []
    if not found.shapes:
        note = "there is no safe form for this law; these are the differentiated formulas"
        return [derived_program(energy, found.derivation)], [note]
    shapes = found.shapes
    if variant == "fast" and shapes[-1].shape == "polar":
        # within rounding of a fold the plain cross product has no direction any more: there, and only there, the exact one
        first = safe_program(energy, shapes[0], "plain", shapes, guarded=len(shapes) == 1)
        return [first, safe_program(energy, shapes[-1], "exact", shapes)], []
    if variant != "accurate":
        return [safe_program(energy, shape, "plain", shapes) for shape in shapes], []
    compares = any(m.b is None for m in shapes[0].derivation.measures)  # a length with what it is at rest
    if shapes[0].corner is None and compares and energy.elsewhere != "zero":
        first = safe_program(energy, shapes[0], "exact", shapes, guarded=True)
        return [first] if first.choice is None else [first, safe_program(energy, shapes[0], "twice", shapes)], []
    return [safe_program(energy, shape, "twice" if compares else "exact", shapes) for shape in shapes], []


def _require_proofs(what: str, found: dict[str, Finding], kind: str = "derived block ") -> None:
    for block, finding in found.items():
        if finding.verdict is not Verdict.PROVED:
            raise NotRunError(f"{what}: {kind}{block} is {finding.verdict}: {finding.reason}")


def derived_program(energy: Energy, derivation: Derivation) -> Program:
    """The program of the derived blocks as they are."""
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
    return energy.section or energy.name.replace("_", " ").capitalize()


def module_text(
    energy: Energy, variant: str, programs: list[Program], document: str, notes: list[str]
) -> tuple[str, dict[str, int]]:
    """The text of one kernel module, and its operation counts."""
    dofs = dof_labels(energy.unknowns)
    names = [identifier(parameter.name) for parameter in energy.parameters]
    functions = [_function(made, len(dofs)) for made in programs]
    code = "\n".join(line for f in functions for line in (*f["lines"], *f["returned"]))
    tape = used_functions(code, "tape")
    full, upper = f"({len(dofs)}, {len(dofs)}, n)", f"({len(dofs) * (len(dofs) + 1) // 2}, n)"
    units = f"{energy.unit}, {energy.unit}/m and {energy.unit}/m^2"
    vector, three = f"({len(dofs)}, n)", "tuple[Array, Array, Array]"
    labels = [label.replace(".", "") for label in dofs]
    angles_alone = any("corner" in line for line in code.splitlines()) and "segment" not in code
    values = {
        "energy": energy,
        "title": _title(energy),
        "variant": variant,
        "summary": SUMMARY[variant],
        "notes": notes,
        "source": f"derivations/{energy.name}.py" + (f" and derivations/{document}" if variant == "printed" else ""),
        "geometry": used_functions(code, "geometry"),
        "tape": tape,
        "dofs": _tuple(dofs),
        "parameters": _tuple(names),
        "names": names,
        "scalars": [
            (str(symbol), parameter.positive, length_power(parameter.unit))
            for parameter in energy.parameters
            for symbol in given_symbols(parameter.name)
        ],
        "vectors": _tuple(identifier(p.name) for p in energy.parameters if p.name.bold),
        "velocities": _tuple(
            n.label for n, unit in zip(energy.unknowns, energy.units, strict=True) if n.bold and unit != "m"
        ),
        "row_units": row_units(energy),
        "rows": len(dofs),
        "unpack": ", ".join(labels) + ("," if len(labels) == 1 else ""),
        "functions": functions,
        "scaling": "points" if angles_alone else "lengths",
        "portable": not LIBRARY & set(tape),
        "numbers": "double-double" if variant == "reference" else "float",
        "public": (
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
    }
    template = _TEMPLATES.get_template("kernel.py.jinja")
    counts = _operations(template.render(counts="", **values), energy.name)
    shown = "\n".join(
        f"Operations per element{f', {shape} shape' if len(counts) > 1 else ''}: "
        + ", ".join(f"{key} {count}" for key, count in found.items())
        for shape, found in counts.items()
    )
    return template.render(counts=shown, **values), next(iter(counts.values()))


def _operations(text: str, name: str) -> dict[str, dict[str, int]]:
    """Operations per element of each shape and output, counted on what the kernel really does."""
    namespace: dict[str, Any] = {}
    exec(compile(text, f"<{name}>", "exec"), namespace)
    kernel = namespace["KERNEL"]
    wanted = {"energy": "E", "gradient": "G", "hessian": "H", "evaluate": "EGH"}
    return {
        shape.function.__name__[1:]: {
            key: kernel.tape(i, outputs, "float64").operations for key, outputs in wanted.items()
        }
        for i, shape in enumerate(kernel.shapes)
    }


def length_power(unit: str) -> int:
    """The power of length in a unit such as ``N m^2``; newton and second are the other base units, so that kg is N s^2 m^-1."""
    total = 0
    for factor in unit.split():
        base, _, exponent = factor.partition("^")
        total += {"m": 1, "J": 1, "kg": -1}.get(base, 0) * int(exponent or 1)
    return total


def row_units(energy: Energy) -> str:
    """The units of the rows of ``q``, as a person would say it."""
    found: dict[str, list[str]] = {}
    for name, unit in zip(energy.unknowns, energy.units, strict=True):
        found.setdefault(unit, []).append(name.label)
    (first, _), *rest = found.items()
    return ", ".join([first, *(f"of {' and '.join(labels)} in {unit}" for unit, labels in rest)])


def _tuple(names: Iterable[str]) -> str:
    inner = [f'"{name}"' for name in names]
    if not inner:
        return "()"
    return f"({inner[0]},)" if len(inner) == 1 else f"({', '.join(inner)})"


def _function(made: Program, rows: int) -> dict[str, Any]:
    """Name, body and returned values of one private function of a module."""
    choice = [] if made.choice is None else [made.choice]
    groups = (made.gradient, made.hessian, [check[0] for check in made.checks], choice)
    returned = [text_of(made.energy) + ","]
    for group in groups:
        returned += _wrapped([text_of(value) for value in group])
    return {"name": made.name, "lines": statements(made), "returned": returned, "checks": made.checks}


def _wrapped(values: list[str], width: int = 108) -> list[str]:
    """A tuple over several lines."""
    if len(values) < 2:
        return [f"({values[0]},)," if values else "(),"]
    lines, line = [], ""
    for value in values:
        if line and len(line) + len(value) > width:
            lines.append(line.rstrip())
            line = ""
        line += value + ", "
    return ["(", *(f"    {text}" for text in [*lines, line.rstrip()]), "),"]
