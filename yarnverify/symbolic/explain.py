"""The derivation of an energy as a person can follow it: measures, their derivatives, the chain rule, the result."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from yarnverify.errors import InputError
from yarnverify.library import derivations
from yarnverify.symbolic.court import Verdict
from yarnverify.symbolic.declare import Declarations, Energy, load_declarations
from yarnverify.symbolic.derive import Derivation, declared_section, derive_declared
from yarnverify.symbolic.invariants import prove_invariants
from yarnverify.symbolic.latex import latex, name_latex
from yarnverify.symbolic.measures import Measure, Segment
from yarnverify.symbolic.plain import name_plain, plain
from yarnverify.symbolic.scalars import origin_last, scalar_tree, sum_tree
from yarnverify.symbolic.sums import Stages, is_rational
from yarnverify.symbolic.tree import FORCE, Expr, Name

Step = dict[str, Any]


def explanation(name: str, folder: Path | None = None) -> dict[str, Any]:
    """The derivation of a declared energy as data: titled steps of formulas, each in LaTeX and plain text.

    Raises
    ------
    InputError
        If there is no such energy.
    """
    place = folder if folder is not None else derivations()
    declarations = load_declarations(place)
    for energy in declarations.energies:
        if energy.name == name:
            found = explain_energy(energy, declarations)
            found["steps"].append(_invariances(energy, declarations))
            return found
    known = ", ".join(energy.name for energy in declarations.energies) or "none"
    raise InputError(f"no energy {name!r} is declared in {place}; there are: {known}")


def explain_energy(energy: Energy, declarations: Declarations) -> dict[str, Any]:
    derivation = derive_declared(energy, declarations.quantities)
    steps = [_declared(energy)]
    proved: dict[str, str]
    if derivation is not None:
        derivation = replace(derivation, order=origin_last)
    if derivation is None:
        steps += _plain_steps(energy)
        proved = _plain_proofs(energy)
    else:
        steps += [_measure(measure) for measure in derivation.measures]
        steps += [_law(derivation), _chain_rule(derivation), *_result(derivation)]
        proved = {block: finding.verdict.value for block, finding in derivation.check().items()}
    return {
        "energy": energy.name,
        "summary": energy.summary,
        "unit": energy.unit,
        "measures": derivation is not None,
        "steps": steps,
        "proof": proved,
        "all_proved": bool(proved) and all(verdict == Verdict.PROVED for verdict in proved.values()),
    }


_UNPROVED = (
    "none of plain differentiation through roots and functions; "
    "yarnverify accuracy holds the kernels to derivatives found by another method"
)


def _step(title: str, note: str, formulas: list[tuple[str, str]]) -> Step:
    return {"title": title, "note": note, "formulas": [{"latex": tex, "text": text} for tex, text in formulas]}


def _equal(left: tuple[str, str], right: Expr) -> tuple[str, str]:
    return f"{left[0]} = {latex(right)}", f"{left[1]} = {plain(right)}"


def _of(name: Name) -> tuple[str, str]:
    return name_latex(name), name_plain(name)


def _by(symbol: tuple[str, str], *names: Name) -> tuple[str, str]:
    """A first or second derivative sign."""
    square = "^2" if len(names) == 2 else ""
    tex = " ".join(f"\\partial {name_latex(name)}" for name in names)
    text = " ".join(f"∂{name_plain(name)}" for name in names)
    return f"\\frac{{\\partial{square} {symbol[0]}}}{{{tex}}}", f"∂{'²' if square else ''}{symbol[1]}/{text}"


def _declared(energy: Energy) -> Step:
    formulas = [_equal(("V", "V"), energy.expression)]
    formulas += [(f"{latex(a.left)} > {latex(a.right)}", f"{plain(a.left)} > {plain(a.right)}") for a in energy.domain]
    units = ", ".join(f"{name_plain(p.name)} in {p.unit}" for p in energy.parameters)
    return _step("Energy", f"{energy.summary} In {energy.unit}; {units}.", formulas)


def _measure(measure: Measure) -> Step:
    formulas: list[tuple[str, str]] = []
    for segment in measure.segments:
        formulas.append(_equal(_of(segment.l.name), Expr("norm", (segment.vector,))))
        formulas.append(_equal(_of(segment.d.name), segment.vector / segment.l))
        formulas.append(_equal(_of(segment.P.name), Expr("identity") - segment.d * segment.d.T))
    if measure.b is not None:
        formulas.append(_equal(_of(measure.symbol), measure.definition))
    symbol = _of(measure.symbol)
    for segment, value, factors in measure.slope:
        formulas.append(_equal(_by(symbol, segment.head), sum_tree([(value, factors)])))
    pairs: list[tuple[Segment, Segment]] = [(s, s) for s in measure.segments]
    pairs += [(measure.a, measure.b)] if measure.b is not None else []
    for first, second in pairs:
        formulas.append(_equal(_by(symbol, first.head, second.head), sum_tree(measure.bend(first, second))))
    kind = "length" if measure.b is None else "angle"
    tails = " and ".join(dict.fromkeys(name_plain(s.tail) for s in measure.segments))
    note = f"A gradient is a column here. Moving {tails} moves the segments the other way: its derivatives are minus the sums."
    return _step(f"Measure: the {kind} {symbol[1]}", note, formulas)


def _law(derivation: Derivation) -> Step:
    names = [m.symbol for m in derivation.measures] + [n for n in derivation.unknowns if not n.bold]
    formulas = [_equal(("V", "V"), derivation.law_tree)]
    for name in names:
        formulas.append(_equal(_by(("V", "V"), name), scalar_tree(derivation.law_slope(name), origin_last)))
    for i, first in enumerate(names):
        for second in names[i:]:
            formulas.append(
                _equal(_by(("V", "V"), first, second), scalar_tree(derivation.law_slope(first, second), origin_last))
            )
    return _step(
        "Law", "The energy as a function of its measures and sliding coordinates, and its derivatives.", formulas
    )


def _chain_rule(derivation: Derivation) -> Step:
    formulas = [
        (
            "\\frac{\\partial V}{\\partial q} = \\sum_m \\frac{\\partial V}{\\partial m} \\frac{\\partial m}{\\partial q}",
            "∂V/∂q = Σ_m ∂V/∂m ∂m/∂q",
        ),
        (
            "\\frac{\\partial^2 V}{\\partial q \\partial r} = \\sum_m \\frac{\\partial V}{\\partial m} \\frac{\\partial^2 m}"
            "{\\partial q \\partial r} + \\sum_{m,n} \\frac{\\partial^2 V}{\\partial m \\partial n} "
            "\\frac{\\partial m}{\\partial q} \\frac{\\partial n}{\\partial r}^T",
            "∂²V/∂q∂r = Σ_m ∂V/∂m ∂²m/∂q∂r + Σ_mn ∂²V/∂m∂n ∂m/∂q (∂n/∂r)ᵀ",
        ),
    ]
    note = (
        "m and n run over the measures and the sliding coordinates. "
        if derivation.measures
        else "There are no measures: "
    )
    return _step("Chain rule", note + "Forces are minus gradients, Jacobians minus Hessians.", formulas)


def _result(derivation: Derivation) -> list[Step]:
    forces, jacobians = [], []
    for (force, tree), rest in derivation.blocks(FORCE):
        forces.append(_equal((latex(force), plain(force)), tree))
        jacobians += [_equal((latex(block), plain(block)), formula) for block, formula in rest]
    return [_step("Forces", "", forces), _step("Jacobians", "", jacobians)]


def _plain_steps(energy: Energy) -> list[Step]:
    count = sum(3 if name.bold else 1 for name in energy.unknowns)
    note = (
        "This energy is not a law of known measures, which are lengths of segments and angles between them: it is "
        f"differentiated by each of its {count} coordinates, through every sum and function that it is made of, and through "
        "angles between other vectors by rules that hold where these are zero."
    )
    return [_step("Plain differentiation", note, [])]


def _plain_proofs(energy: Energy) -> dict[str, str]:
    """What the kernels of a rational energy hold, against its derivatives; of any other energy nothing is proved."""
    section = declared_section(energy)
    if not is_rational(energy, section):
        return {}
    wrong = Stages(energy, section).prove()
    return {"gradient and Hessian": str(Verdict.REFUTED if wrong else Verdict.PROVED)}


def _invariances(energy: Energy, declarations: Declarations) -> Step:
    found = prove_invariants(energy, declarations.motions)
    verdicts = "; ".join(
        f"{what.removeprefix('invariance under ')}: {finding.verdict}" for what, finding in found.items()
    )
    return _step("Unchanged by", f"{verdicts or 'nothing declared'}.", [])


def explain(record: dict[str, Any], form: str) -> str:
    """A derivation as text, LaTeX or Markdown."""
    lines: list[str] = []
    count = len(record["proof"])
    blocks = f"the law and {count - 1} blocks, each by normal form and by rational evaluation"
    plain_blocks = "gradient and Hessian, entry by entry, as rational functions"
    verdict = (
        f"Proved exactly: {blocks if record['measures'] else plain_blocks}."
        if record["all_proved"]
        else "Proof: " + (", ".join(f"{b} {v}" for b, v in record["proof"].items() if v != "proved") or _UNPROVED)
    )
    title = f"Derivation of {record['energy']}"
    if form == "text":
        lines += [title, "=" * len(title)]
        for step in record["steps"]:
            lines += ["", step["title"], "-" * len(step["title"]), *([step["note"]] if step["note"] else [])]
            lines += [f"    {formula['text']}" for formula in step["formulas"]]
        return "\n".join([*lines, "", verdict])
    heading, open_, close = ("## {}", "$$", "$$") if form == "markdown" else ("\\subsection*{{{}}}", "\\[", "\\]")
    lines.append(f"# {title}" if form == "markdown" else f"\\section*{{{title.replace('_', ' ')}}}")
    for step in record["steps"]:
        name = step["title"] if form == "markdown" else _tex_text(step["title"])
        lines += ["", heading.format(name), ""]
        if step["note"]:
            lines += [step["note"] if form == "markdown" else _tex_text(step["note"]), ""]
        for formula in step["formulas"]:
            lines += [f"{open_}{formula['latex']}{close}", ""]
    return "\n".join([*lines, verdict])


def _tex_text(text: str) -> str:
    for old, new in (("_", "\\_"), ("^", "\\^{}"), ("θ", "$\\theta$"), ("φ", "$\\phi$")):
        text = text.replace(old, new)
    return text


__all__ = ["explain", "explain_energy", "explanation"]
