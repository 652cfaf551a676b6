"""Programs of the rearranged blocks: what ``kernels.geometry`` provides, then the named steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp

from yarnverify.symbolic.declare import Energy, length
from yarnverify.symbolic.emit import (
    Check,
    Components,
    Program,
    active,
    domain_checks,
    entries_of,
    given_symbols,
    identifier,
    row_symbols,
    settled,
    zero_length,
)
from yarnverify.symbolic.measures import Segment
from yarnverify.symbolic.safe import Corner, Safe
from yarnverify.symbolic.tree import Name

# Cosines between the edges beyond which the rows of the common point cancel: by more than targets allow, or by more than
# the condition of the problem explains.
_SMOOTH_UP_TO = {"exact": sp.Rational(5, 8), "plain": sp.Rational(13, 16)}
_PLAIN_DOWN_TO = sp.Rational(1, 2**16)  # sine; a plain cross product keeps some 37 of 53 bits there


def safe_program(energy: Energy, safe: Safe, exact: bool, shapes: tuple[Safe, ...], guarded: bool = False) -> Program:
    """The program of one shape.

    Parameters
    ----------
    energy, safe
        What is computed, and how.
    exact
        Whether rounding errors of edges, products and sums are carried along.
    shapes
        All that the energy has.
    guarded
        Whether small sines are left to another program.
    """
    alone = len(shapes) == 1
    formulas = {block: tree for first, rest in safe.blocks(1) for block, tree in (first, *rest)}
    reading = Components(safe.section, formulas, forces=False, given=safe.given)
    value, gradient, hessian = entries_of(energy, reading, safe.law, 1)
    checks: list[Check] = []
    segments = dict.fromkeys([m.a for m in safe.lengths] + ([safe.corner.a, safe.corner.b] if safe.corner else []))
    for segment in segments:
        checks.append((_symbol(segment.l.name), "energy", zero_length((segment.tail, segment.head))))
    checks += domain_checks(energy, reading)
    choice = active(energy, reading)
    if choice is not None:
        choice = choice.xreplace({reading.value(length(s.vector)): _symbol(s.l.name) for s in segments})
    if safe.corner is not None and safe.shape == "smooth" and not alone:
        choice = _SMOOTH_UP_TO["exact" if exact else "plain"] - _symbol(safe.corner.name("C"))
    if safe.corner is not None and safe.shape == "polar":
        ends = "0 or pi" if alone else "0" if safe.corner.sign > 0 else "pi"
        text = f"{safe.corner.symbol} is {ends}, where the energy has no derivative"
        checks.append((_symbol(safe.corner.name("size")), "derivatives", text))
        if guarded:
            choice = _symbol(safe.corner.name("s")) - _PLAIN_DOWN_TO
    lengths = {_symbol(m.a.l.name): _low(m.a) for m in safe.lengths}
    totals = _totals(energy, lengths)
    if choice is not None:
        choice = totals(sp.sympify(choice))  # whether an energy acts is a jump: never a matter of rounding
    made = settled(reading.steps, value, gradient, hessian, checks, choice, totals if exact else lambda v: v)
    code = [*made.steps.values(), *made.outputs]
    used = {str(symbol) for step in code for symbol in step.free_symbols}
    prologue = tuple(_prologue(safe, exact, used))
    name = f"{safe.shape}_exact" if exact else safe.shape
    return Program(made.steps, made.energy, made.gradient, made.hessian, made.checks, made.choice, prologue, name)


def _symbol(name: Name) -> sp.Symbol:
    return given_symbols(name)[0]


def _low(segment: Segment) -> tuple[sp.Symbol, sp.Symbol]:
    """The digits of a length below its last, in two numbers."""
    return sp.Symbol(f"low_{segment.sub}", real=True), sp.Symbol(f"lower_{segment.sub}", real=True)


def _totals(energy: Energy, lengths: dict[sp.Symbol, tuple[sp.Symbol, sp.Symbol]]) -> Callable[[Any], Any]:
    """Sums of lengths, sliding coordinates and parameters, which may cancel, become calls of ``geometry.total``."""
    inputs = {sp.Symbol(identifier(p.name), real=True) for p in energy.parameters}
    inputs |= {symbol for n in energy.unknowns if not n.bold for symbol in row_symbols(n)}
    total = sp.Function("total")

    def is_sum(value: Any) -> bool:
        if not value.is_Add:
            return False
        terms = [term.as_coeff_Mul() for term in value.args]
        atoms = {symbol for _, symbol in terms}
        known = all(abs(factor) == 1 and (symbol in inputs or symbol in lengths) for factor, symbol in terms)
        return known and (len(terms) > 2 or bool(atoms & set(lengths)))

    def call(value: Any) -> Any:
        terms = sorted(
            value.args, key=lambda term: (term.as_coeff_Mul()[1] not in lengths, str(term.as_coeff_Mul()[1]))
        )
        measured = [(factor, lengths[s]) for factor, s in (term.as_coeff_Mul() for term in terms) if s in lengths]
        digits = [factor * low for factor, (low, _) in measured]
        return total(sum((factor * lower for factor, (_, lower) in measured), sp.S.Zero), *terms, *digits)

    return lambda value: value.replace(is_sum, call)


def _prologue(safe: Safe, exact: bool, used: set[str]) -> list[str]:
    lines = []
    corner = safe.corner
    points = dict.fromkeys(p for m in safe.lengths for p in (m.a.tail, m.a.head))
    points |= dict.fromkeys((corner.a.tail, corner.a.head, corner.b.head) if corner else ())
    unknowns = safe.derivation.unknowns
    for point in sorted(points, key=(*unknowns, *safe.section.parameters).index):
        components = row_symbols(point) if point in unknowns else given_symbols(point)
        lines.append(f"{point.label} = {', '.join(map(str, components))}")
    suffix = "_exact" if exact else ""
    for measure in safe.lengths:
        s = measure.a
        low, lower = (str(symbol) if str(symbol) in used else "_" for symbol in _low(s))
        made = f"segment{suffix}({s.tail.label}, {s.head.label})"
        lines.append(f"{_symbol(s.l.name)}, {low}, {lower}, {identifier(s.d.name)} = {made}")
        lines.append(_unpacked(s.d.name))
    return [*lines, *(_corner_lines(safe, corner, exact, used) if corner else [])]


def _unpacked(name: Name) -> str:
    return f"{', '.join(map(str, given_symbols(name)))} = {identifier(name)}"


def _corner_lines(safe: Safe, corner: Corner, exact: bool, used: set[str]) -> list[str]:
    a, b = corner.a, corner.b

    def atom(base: str) -> str:
        return str(_symbol(corner.name(base)))

    def vector(base: str) -> str:
        return identifier(corner.name(base, bold=True))

    kind = ("right_corner" if safe.centred else "corner") + ("_exact" if exact else "")
    l_a, l_b, d_a, d_b = (identifier(symbol.name) for symbol in (a.l, b.l, a.d, b.d))
    ends = f"{a.head.label}, {b.head.label}"
    targets = f"{l_a}, {l_b}, {d_a}, {d_b}, {vector('normal')}, {atom('scale')}, {atom('C')}"
    lines = [f"{targets} = {kind}({a.tail.label}, {ends})"]
    lines += [_unpacked(name) for name in (a.d.name, b.d.name)]
    cosine = atom("C") if corner.sign > 0 else f"-{atom('C')}"
    if safe.shape == "smooth":
        lines.append(f"{vector('m')} = scaled({vector('normal')}, {atom('scale')})")
        lines.append(_unpacked(corner.name("m", bold=True)))
        lines.append(f"{atom('S')} = dot({vector('m')}, {vector('m')})")
        lines.append(f"{atom('A')}, {atom('f')}, {atom('g')} = turning({atom('S')}, {cosine})")
        if atom("versine") in used:
            lines.append(f"{atom('versine')} = versine({atom('S')}, {cosine})")
        return lines
    lines.append(f"{vector('n')}, {atom('size')} = normal_of({vector('normal')})")
    lines.append(f"{atom('s')} = {atom('size')}*{atom('scale')}")
    lines.append(_unpacked(corner.name("n", bold=True)))
    theta = str(_symbol(corner.symbol))
    functions = {theta: "angle", atom("psi"): "deviation", atom("half"): "half_tangent"}
    lines += [f"{name} = {function}({atom('s')}, {cosine})" for name, function in functions.items() if name in used]
    lines.append(f"{vector('v')}, {vector('k')} = closing({a.tail.label}, {ends})")
    return [*lines, *(_unpacked(corner.name(base, bold=True)) for base in ("v", "k"))]
