"""Which programs each variant of an energy consists of, and the proofs that they rest on."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from yarnverify.errors import InputError, NotRunError
from yarnverify.kernels.batch import MOST_FACTORS
from yarnverify.symbolic.cancelling import cancels, is_even, reach
from yarnverify.symbolic.court import Court, Finding, Verdict
from yarnverify.symbolic.declare import Declarations, Energy
from yarnverify.symbolic.derive import Derivation, declared_section, derive_declared
from yarnverify.symbolic.document import Claim, Document, Section, block_of
from yarnverify.symbolic.emit import plain_program, program
from yarnverify.symbolic.invariants import prove_invariants
from yarnverify.symbolic.measures import NoMeasuresError
from yarnverify.symbolic.places import part_of
from yarnverify.symbolic.printing import LIBRARY, statements, text_of, used_functions
from yarnverify.symbolic.reading import UnsupportedError
from yarnverify.symbolic.repair import Workshop
from yarnverify.symbolic.safe import Safe
from yarnverify.symbolic.safe_laws import safe_shapes
from yarnverify.symbolic.safe_program import safe_program
from yarnverify.symbolic.steps import Program
from yarnverify.symbolic.sums import Stages
from yarnverify.symbolic.tree import FORCE, Expr
from yarnverify.symbolic.vanishing import KEPT, kept_by_sums

_SUMS = "no measures: of the terms of each sum a word more is computed than of itself, since a word may cancel"
_BY_STEPS = "no law of lengths and one angle of segments: differentiated step by step, which promises no digits"


@dataclass(frozen=True)
class Proved:
    """What an energy's kernels are made of, all of it proved.

    Attributes
    ----------
    derivation, shapes
        Of a law of measures: its derivation, and its safe shapes.
    stages
        Of an energy without safe shapes; proved where it is rational in its coordinates, by rules that are tested elsewhere.
    """

    derivation: Derivation | None = None
    shapes: tuple[Safe, ...] = ()
    stages: Stages | None = None

    @property
    def rational(self) -> Stages | None:
        """The stages of an energy that is rational in its coordinates."""
        return self.stages if self.stages is not None and self.stages.rational else None


def proved(energy: Energy, declarations: Declarations) -> Proved:
    """Derive an energy and prove all of it.

    Raises
    ------
    InputError
        If an invariance is declared that is not proved.
    NotRunError
        If a derived block is not proved.
    """
    for what, finding in prove_invariants(energy, declarations.motions).items():
        if finding.verdict is not Verdict.PROVED:
            reason = finding.reason or "it changes"
            raise InputError(
                f"{energy.name}: {what} is {finding.verdict}: {reason}; it is declared here",
                part_of(energy.place, "unchanged"),
            )
    derivation = derive_declared(energy, declarations.quantities)
    if derivation is None:
        stages = Stages(energy, declared_section(energy))
        if stages.rational and (wrong := stages.prove()):
            raise NotRunError(f"{energy.name}: derivatives by {', '.join(wrong)} are not those of the energy")
        return Proved(stages=stages)
    shapes: tuple[Safe, ...] = ()
    with suppress(NoMeasuresError):
        shapes = tuple(safe_shapes(derivation))
    if shapes or energy.document:
        _require_proofs(energy.name, derivation.check())
    for shape in shapes:
        _require_proofs(f"{energy.name}, {shape.shape} shape", shape.check())
    return Proved(derivation, shapes, None if shapes else Stages(energy, declared_section(energy)))


def derived_programs(energy: Energy, found: Proved, variant: str) -> tuple[list[Program], list[str]]:
    """The programs of a derived variant, and notes on what is not as wished."""
    if variant == "differentiated":
        if found.derivation is None:
            return [plain_program(energy, declared_section(energy))], []
        return [derived_program(energy, found.derivation)], []
    if found.rational:
        return [found.rational.program], [_SUMS] if variant == "accurate" else []
    if found.stages:
        return [found.stages.program], [_BY_STEPS]
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


def library_calls(programs: list[Program]) -> list[str]:
    """The functions of a mathematical library that programs call, as a person declares them."""
    code = "\n".join(line for made in programs for line in (*statements(made), *map(text_of, made.outputs)))
    declared = {"expm1": "exp", "sinh": "exp", "log_ratio": "log"}
    return sorted({declared.get(name, name) for name in LIBRARY & set(used_functions(code, "tape"))})


def promise(variant: str, found: Proved, calls: set[str]) -> str:
    """What errors a kernel promises that calls some functions of a library; see ``runtime.Kernel``."""
    if variant in ("differentiated", "printed") or not (found.shapes or found.rational):
        return "none"
    if calls:  # these carry on what their arguments lack, so more than a few units may be lost far from 0
        kept = calls <= KEPT and found.shapes and all(kept_by_sums(shape) for shape in found.shapes)
        return "condition" if kept else "none"
    if variant == "reference":
        return "units"
    if found.rational:
        return "units" if variant == "accurate" and found.rational.exact_terms() else "condition"
    less = any(_compares_angles(shape) or shape.has_pole for shape in found.shapes)
    less |= any(shape.corner is None and cancels(shape) for shape in found.shapes)
    return "units" if variant == "accurate" and found.shapes and not less else "condition"


def most_factors(found: Proved) -> int | None:
    """The largest number of factors in a product of a law without angles, where it is more than kernels reckon with."""
    most = max((reach(shape) for shape in found.shapes if shape.corner is None), default=0)
    return most if most > MOST_FACTORS else None


def even_ends(energy: Energy, found: Proved) -> tuple[int, int] | None:
    """The first rows of the two ends of an energy that is an even law of the length between them, smooth where it is zero."""
    shape = found.shapes[0] if found.shapes else None
    if shape is None or shape.corner is not None or len(shape.lengths) != 1 or len(energy.unknowns) != 2:
        return None
    segment = shape.lengths[0].a
    return (3, 0) if {segment.head, segment.tail} == set(energy.unknowns) and is_even(shape) else None


def numbers(variant: str, found: Proved) -> str:
    """What numbers a kernel computes with; see ``runtime.Kernel``."""
    if variant == "reference":
        return "double-double"
    return "words" if variant == "accurate" and found.rational else "float"


def _compares_angles(shape: Safe) -> bool:
    """Whether a law adds something to its angle, such as an angle of rest, so that digits of both cancel."""
    corner = shape.corner
    if corner is None:
        return False
    own = {name for name in shape.given if not name.bold} - {corner.a.l.name, corner.b.l.name}
    sums = (node for node in shape.law.walk() if node.op == "add")
    return any(part.op == "symbol" and part.name in own for node in sums for part in node.walk())
