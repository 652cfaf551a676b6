"""Programs of the rearranged blocks: what ``kernels.geometry`` provides, then the named steps."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, TypeAlias

import sympy as sp

from yarnverify.symbolic.corner import Corner
from yarnverify.symbolic.declare import Energy, length
from yarnverify.symbolic.emit import (
    Components,
    active,
    domain_checks,
    entries_of,
    given_symbols,
    identifier,
    row_symbols,
    zero_length,
)
from yarnverify.symbolic.measures import Segment
from yarnverify.symbolic.safe import Safe
from yarnverify.symbolic.steps import Check, Program, settled
from yarnverify.symbolic.tree import Name

Digits: TypeAlias = Literal["plain", "exact", "twice"]

# How near to 1 the cosine between the edges may come; a yarn folded further has sines whose products may underflow.
_SMOOTH_UP_TO = 1 - sp.Rational(1, 2**20)
_LARGEST_FACTOR = 64  # of a term in a sum that is formed without loss
_PLAIN_DOWN_TO = sp.Rational(1, 2**16)  # sine; a plain cross product keeps some 37 of 53 bits there


def safe_program(
    energy: Energy, safe: Safe, digits: Digits, shapes: tuple[Safe, ...], guarded: bool = False
) -> Program:
    """The program of one shape.

    Parameters
    ----------
    energy, safe
        What is computed, and how.
    digits
        Which rounding errors of edges, products and sums are carried along: none (``plain``), all (``exact``), or all and those
        of their sums (``twice``).
    shapes
        All that the energy has.
    guarded
        Whether another program is there for what this one cannot do: small sines, or lengths within rounding of what they are
        compared with.
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
        choice = _SMOOTH_UP_TO - _symbol(safe.corner.name("C"))
    if safe.corner is not None and safe.shape == "polar":
        ends = "0 or pi" if alone else "0" if safe.corner.sign > 0 else "pi"
        what, level = ("value", "energy") if safe.has_pole and not alone else ("derivative", "derivatives")
        text = f"{safe.corner.symbol} is {ends}, where the energy has no {what}"
        checks.append((_symbol(safe.corner.name("size")), level, text))
        if guarded:
            choice = _symbol(safe.corner.name("s")) - _PLAIN_DOWN_TO
    sums = Sums(energy, safe, reading, digits)
    if choice is not None:
        plain = sp.sympify(choice)
        choice = sums.safe(plain)  # whether an energy acts is a jump: never a matter of rounding
        for s in segments if energy.elsewhere == "zero" else ():
            size = _symbol(s.l.name)
            if not _acts_at_zero(plain, size):
                choice = choice.xreplace({low: sp.Function("select")(size, low, 0) for low in _low(s)})
    elif guarded and safe.corner is None:
        choice = sums.apart([*reading.steps.values(), value, *gradient, *hessian])
    ordered = sums.ordered if digits == "plain" else sums.safe
    made = settled(reading.steps, value, gradient, hessian, checks, choice, ordered)
    code = [*made.steps.values(), *made.outputs]
    used = {str(symbol) for step in code for symbol in step.free_symbols}
    prologue = tuple(_prologue(safe, digits, used))
    name = safe.shape if digits == "plain" else f"{safe.shape}_{digits}"
    return Program(made.steps, made.energy, made.gradient, made.hessian, made.checks, made.choice, prologue, name)


def _symbol(name: Name) -> sp.Symbol:
    return given_symbols(name)[0]


def _acts_at_zero(choice: Any, length: sp.Symbol) -> bool:
    """Whether an energy acts where a length is zero, which then is an error; its digits below the last are none there."""
    there = choice.xreplace({length: sp.S.Zero})
    return bool(there.xreplace({symbol: sp.Dummy(positive=True) for symbol in there.free_symbols}).is_positive)


def _powers(factor: Any) -> list[Any]:
    """Powers of two whose sum a factor is, by which a number is multiplied without an error; none for other factors."""
    if not factor.is_Rational or factor.q & (factor.q - 1) or abs(factor.p) > _LARGEST_FACTOR:
        return []
    sign, size = sp.sign(factor), abs(factor.p)
    return [sign * sp.Rational(1 << bit, factor.q) for bit in reversed(range(size.bit_length())) if size >> bit & 1]


def _low(segment: Segment) -> tuple[sp.Symbol, sp.Symbol]:
    """The digits of a length below its last, in two numbers."""
    return sp.Symbol(f"low_{segment.sub}", real=True), sp.Symbol(f"lower_{segment.sub}", real=True)


class Sums:
    """Sums of lengths, sliding coordinates and parameters, which may cancel, as calls of ``kernels.geometry``."""

    def __init__(self, energy: Energy, safe: Safe, reading: Components, digits: Digits) -> None:
        self.lengths = {_symbol(m.a.l.name): _low(m.a) for m in safe.lengths}
        self.inputs = {sp.Symbol(identifier(p.name), real=True) for p in energy.parameters}
        self.inputs |= {symbol for n in energy.unknowns if not n.bold for symbol in row_symbols(n)}
        self.positive = {  # coordinate differences that the domain keeps positive
            reading.value(assumption.left) - reading.value(assumption.right)
            for assumption in energy.domain
            if energy.elsewhere != "zero"
        }
        self.digits = digits

    def safe(self, value: Any) -> Any:
        """An expression with every sum that may cancel replaced."""
        value = value.replace(self._is_multiple, self._multiple)
        return value.replace(self._is_mixed, self._parted).replace(self._is_sum, self._call)

    def ordered(self, value: Any) -> Any:
        """An expression in which a coordinate difference is taken before a length is added to it."""
        return value.replace(lambda part: self._is_sum(part) and self._widened(part) is not None, self._widened)

    def apart(self, values: Iterable[Any]) -> Any:
        """What is positive where every sum with a length is more than rounding; None where there is no such sum."""
        every = {part for value in values for part in sp.sympify(value).atoms(sp.Add)}
        every |= {part.primitive()[1] for part in every}
        sums = {part for part in (*every, *map(self._linear, every)) if self._is_sum(part)}
        found = {  # either sign of a sum
            -part if part.could_extract_minus_sign() else part
            for part in sums
            if self._measured(part) and self._widened(part) is None
        }
        factors = [
            sp.Function("apart")(self._call(part), max((s for s, _ in self._measured(part)), key=str))
            for part in sorted(found, key=sp.default_sort_key)
        ]
        return sp.Mul(*factors) if factors else None

    def _is_sum(self, value: Any) -> bool:
        if not value.is_Add:
            return False
        terms = [term.as_coeff_Mul() for term in value.args]
        atoms = {symbol for _, symbol in terms}
        known = all(_powers(factor) and (symbol in self.inputs or symbol in self.lengths) for factor, symbol in terms)
        return known and (len(terms) > 2 or bool(atoms & set(self.lengths)))

    def _is_multiple(self, value: Any) -> bool:
        """Whether a sum is a multiple of one of these, as SymPy multiplies them out."""
        return bool(value.is_Add and value.primitive()[0] != 1 and self._is_sum(value.primitive()[1]))

    def _multiple(self, value: Any) -> Any:
        factor, part = value.primitive()
        return factor * self._call(part)

    def _is_mixed(self, value: Any) -> bool:
        """Whether a sum is one of these and of other terms, as where a difference is added to what is a multiple of it."""
        return bool(value.is_Add and not self._is_sum(value) and self._is_sum(self._linear(value)))

    def _linear(self, value: Any) -> Any:
        known = self.inputs | set(self.lengths)
        return sp.Add(
            *(term for term in value.args if _powers(term.as_coeff_Mul()[0]) and term.as_coeff_Mul()[1] in known)
        )

    def _parted(self, value: Any) -> Any:
        part = self._linear(value)
        return self._call(part) + (value - part)

    def _measured(self, value: Any) -> list[tuple[Any, Any]]:
        """Lengths in a sum, with their factors."""
        terms = [term.as_coeff_Mul() for term in value.args]
        return [(symbol, factor) for factor, symbol in terms if symbol in self.lengths]

    def _widened(self, value: Any) -> Any:
        """A sum of a length and of a coordinate difference of the same sign, in which nothing cancels; else None."""
        for sign in (1, -1):
            for difference in self.positive:
                rest = value - sign * difference
                if sign * rest in self.lengths:
                    return sign * sp.Function("in_order")(sign * rest, difference)
        return None

    def _call(self, value: Any) -> Any:
        widened = self._widened(value)
        if widened is not None:
            return widened
        terms = sorted(
            value.args, key=lambda term: (term.as_coeff_Mul()[1] not in self.lengths, str(term.as_coeff_Mul()[1]))
        )
        terms = [
            part * symbol for factor, symbol in (term.as_coeff_Mul() for term in terms) for part in _powers(factor)
        ]
        measured = self._measured(value)
        kept = measured if self.digits != "plain" else []
        low = sum((factor * self.lengths[symbol][0] for symbol, factor in kept), sp.S.Zero)
        if self.digits != "twice" or not measured:
            return sp.Function("total")(low, *terms)
        lower = sum((factor * self.lengths[symbol][1] for symbol, factor in measured), sp.S.Zero)
        return sp.Function("total_twice")(
            lower, *terms, *(factor * self.lengths[symbol][0] for symbol, factor in measured)
        )


def _prologue(safe: Safe, digits: Digits, used: set[str]) -> list[str]:
    lines = []
    corner = safe.corner
    points = dict.fromkeys(p for m in safe.lengths for p in (m.a.tail, m.a.head))
    points |= dict.fromkeys((corner.a.tail, corner.a.head, corner.b.head) if corner else ())
    unknowns = safe.derivation.unknowns
    for point in sorted(points, key=(*unknowns, *safe.section.parameters).index):
        components = row_symbols(point) if point in unknowns else given_symbols(point)
        lines.append(f"{point.label} = {', '.join(map(str, components))}")
    suffix, kept = {"plain": ("", 0), "exact": ("_exact", 1), "twice": ("_twice", 2)}[digits]
    for measure in safe.lengths:
        s = measure.a
        lows = [str(symbol) if str(symbol) in used else "_" for symbol in _low(s)[:kept]]
        targets = ", ".join([str(_symbol(s.l.name)), *lows, identifier(s.d.name)])
        lines.append(f"{targets} = segment{suffix}({s.tail.label}, {s.head.label})")
        lines.append(_unpacked(s.d.name))
    return [*lines, *(_corner_lines(safe, corner, digits, used) if corner else [])]


def _unpacked(name: Name) -> str:
    return f"{', '.join(map(str, given_symbols(name)))} = {identifier(name)}"


def _corner_lines(safe: Safe, corner: Corner, digits: Digits, used: set[str]) -> list[str]:
    a, b = corner.a, corner.b

    def atom(base: str) -> str:
        return str(_symbol(corner.name(base)))

    def vector(base: str) -> str:
        return identifier(corner.name(base, bold=True))

    kind = ("right_corner" if safe.centred else "corner") + ("" if digits == "plain" else "_exact")
    l_a, l_b, d_a, d_b = (identifier(symbol.name) for symbol in (a.l, b.l, a.d, b.d))
    ends = f"{a.head.label}, {b.head.label}"
    targets = f"{l_a}, {l_b}, {d_a}, {d_b}, {vector('normal')}, {atom('scale')}, {atom('C')}"
    lines = [f"{targets} = {kind}({a.tail.label}, {ends})"]
    lines += [_unpacked(name) for name in (a.d.name, b.d.name)]
    lines.append(f"{vector('v')}, {vector('k')} = closing({a.tail.label}, {ends})")
    lines += [_unpacked(corner.name(base, bold=True)) for base in ("v", "k")]
    cosine, opposite = atom("C"), f"-{atom('C')}"
    if corner.sign < 0:
        cosine, opposite = opposite, cosine

    def versines(sine_squared: str) -> list[str]:
        sides = {"versine": cosine, "vercosine": opposite}
        return [f"{atom(x)} = versine({sine_squared}, {side})" for x, side in sides.items() if atom(x) in used]

    if safe.shape == "smooth":
        lines.append(f"{vector('m')} = scaled({vector('normal')}, {atom('scale')})")
        lines.append(_unpacked(corner.name("m", bold=True)))
        lines.append(f"{atom('S')} = dot({vector('m')}, {vector('m')})")
        lines.append(f"{atom('A')}, {atom('f')}, {atom('g')} = turning({atom('S')}, {cosine})")
        return lines + versines(atom("S"))
    lines.append(f"{vector('n')}, {atom('size')} = normal_of({vector('normal')})")
    lines.append(f"{atom('s')} = {atom('size')}*{atom('scale')}")
    lines.append(_unpacked(corner.name("n", bold=True)))
    theta = str(_symbol(corner.symbol))
    functions = {theta: "angle", atom("psi"): "deviation", atom("half"): "half_tangent"}
    lines += [f"{name} = {function}({atom('s')}, {cosine})" for name, function in functions.items() if name in used]
    return lines + versines(f"{atom('s')}*{atom('s')}")
