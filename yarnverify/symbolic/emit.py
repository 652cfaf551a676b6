"""Reading 3: a program. Trees become straight-line NumPy code, the same text on every run.

A ``Program`` is a list of named scalar steps; every output function keeps the steps that it needs. What is emitted is a
matter of the formulas that are put in, not of this module: the derived blocks give the variant ``differentiated``, the
document's own printed blocks the variant ``printed``.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import sympy as sp
from sympy.printing.numpy import NumPyPrinter

from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.document import Section, block_of
from yarnverify.symbolic.reading import Reading, UnsupportedError, Value, map_value
from yarnverify.symbolic.tree import FORCE, Expr, Name

AXES = "xyz"
_OUTPUT = re.compile(r"(g|h|F|dF)_")  # names of block entries; an expression shared with others is not called by them
Formulas = Mapping[Expr, Expr]  # what each force and Jacobian node stands for


def identifier(name: Name) -> str:
    """A symbol as a Python name."""
    text = f"{name.base}_{name.sub}" if name.sub else name.base
    text = "".join(c if c.isalnum() else "_" for c in text)
    return text + "_" if keyword.iskeyword(text) else text


def row_symbols(name: Name) -> list[sp.Symbol]:
    """The scalar unknowns of one degree of freedom: three for a point."""
    return (
        [sp.Symbol(name.label + axis, real=True) for axis in AXES] if name.bold else [sp.Symbol(name.label, real=True)]
    )


def dof_labels(unknowns: Iterable[Name]) -> tuple[str, ...]:
    """Names of the rows of ``q``, such as ``x0.x`` and ``u1``."""
    return tuple(label for n in unknowns for label in ([f"{n.label}.{axis}" for axis in AXES] if n.bold else [n.label]))


class Components(Reading):
    """Values of trees as SymPy scalars over the rows of ``q``; definitions and shared scalars become named steps."""

    def __init__(self, section: Section, formulas: Formulas, naming: bool = True, forces: bool = True) -> None:
        super().__init__(section)
        self.formulas, self.naming, self.forces = formulas, naming, forces
        self.steps: dict[sp.Symbol, Any] = {}
        self._known: dict[Any, sp.Symbol] = {}
        self._blocks: dict[Expr, Value] = {}
        self._open: set[Expr] = set()
        self.pi = sp.pi

    def constant(self, value: Any) -> Any:
        return sp.Integer(value)

    def leaf(self, name: Name) -> Value:
        if self.section.is_unknown(name):
            symbols = row_symbols(name)
            return symbols if name.bold else symbols[0]
        return sp.Symbol(identifier(name), real=True)

    def sqrt(self, value: Any) -> Any:
        return sp.sqrt(value)

    def absolute(self, value: Any) -> Any:
        return sp.Abs(value)

    def arccos(self, cosine: Any) -> Any:
        return sp.acos(cosine)

    def circle(self, angle: Any) -> tuple[Any, Any]:
        return self.hold(sp.sin(angle)), self.hold(sp.cos(angle))

    def hold(self, value: Any) -> Any:
        if not self.naming or value.is_Symbol or value.is_number or (-value).is_Symbol:
            return value
        return self._step(value, f"s{len(self.steps)}")

    def _step(self, value: Any, label: str) -> Any:
        if value.is_Symbol or value.is_number:
            return value
        if value not in self._known:
            self._known[value] = sp.Symbol(label, real=True)
            self.steps[self._known[value]] = value
        return self._known[value]

    def _named(self, value: Value, label: str) -> Value:
        if not isinstance(value, list):
            return self._step(value, label) if self.naming else value
        return [
            self._named(part, label + ("_" if label[-1] not in AXES else "") + axis)
            for part, axis in zip(value, AXES, strict=True)
        ]

    def symbol(self, name: Name) -> Value:
        if name not in self._values:
            meaning = self.section.meaning(name)
            self._values[name] = (
                self.leaf(name) if meaning is None else self._named(self.value(meaning), identifier(name))
            )
        return self._values[name]

    def block(self, expr: Expr) -> Value:
        """Value of a force or Jacobian through its formula."""
        if expr not in self._blocks:
            if expr not in self.formulas or expr in self._open:
                raise UnsupportedError(f"there is no formula for {block_of(expr)}")
            self._open.add(expr)
            label = block_of(expr).replace("/", "_")
            if not self.forces:  # the formulas are those of the gradient and the Hessian
                label = label.replace("dF_", "h_").replace("_d", "_").replace("F_", "g_")
            self._blocks[expr] = self._named(self.value(self.formulas[expr], self.block), label)
        return self._blocks[expr]


@dataclass(frozen=True)
class Program:
    """Straight-line code for one energy: steps, and outputs over them.

    ``hessian`` holds the upper triangle, row by row. ``checks`` are scalars that must be positive where derivatives
    (or already the energy) are wanted, each with what it means when one is not.
    """

    steps: Mapping[sp.Symbol, Any]
    energy: Any
    gradient: tuple[Any, ...]
    hessian: tuple[Any, ...]
    checks: tuple[tuple[Any, str, str], ...] = ()
    active: Any = None
    operations: Mapping[str, int] = field(default_factory=dict)


def program(
    energy: Energy, section: Section, tree: Expr, formulas: Formulas, scale: int, angles: Iterable[Name] = ()
) -> Program:
    """The program of an energy from formulas of its blocks.

    Parameters
    ----------
    energy
        Gives unknowns, parameters and domain.
    section, tree, formulas
        Where symbols get their meaning; the energy's formula; a formula for every force and Jacobian block.
    scale
        What a block is to be multiplied by to give the gradient or Hessian: -1 for forces and their Jacobians.
    angles
        Symbols of angles whose sine the formulas divide by.

    Raises
    ------
    UnsupportedError
        Where a block has no formula.
    """
    reading = Components(section, formulas, forces=scale == FORCE)
    value = reading.value(tree)
    unknowns = energy.unknowns
    forces = {n: Expr("force", value=n) for n in unknowns}
    gradient = [scale * part for n in unknowns for part in _rows(reading.block(forces[n]))]
    hessian: list[Any] = []
    offsets = [(n, axis) for n in unknowns for axis in range(3 if n.bold else 1)]
    for i, (row, a) in enumerate(offsets):
        for column, b in offsets[i:]:
            entries = reading.block(Expr("derivative", (forces[row],), column))
            hessian.append(scale * _entry(entries, a, b, row.bold, column.bold))
    checks = list(_checks(energy, section, reading))
    for angle in angles:
        sine, _ = reading.circle(reading.symbol(angle))
        text = f"{angle} is 0 or pi within rounding, where this variant divides by its sine"
        checks.append((sine, "derivatives", text))
    active = _active(energy, reading)
    return _settled(reading.steps, value, gradient, hessian, checks, active)


def plain_program(energy: Energy, section: Section) -> Program:
    """The program of an energy that is not a law of known measures, by plain differentiation."""
    reading = Components(section, {}, naming=False)
    value = reading.value(energy.expression)
    rows = [symbol for n in energy.unknowns for symbol in row_symbols(n)]
    gradient = [sp.diff(value, row) for row in rows]
    hessian = [sp.diff(gradient[i], rows[j]) for i in range(len(rows)) for j in range(i, len(rows))]
    checks = list(_checks(energy, section, reading))
    return _settled({}, value, gradient, hessian, checks, _active(energy, reading))


def _rows(value: Value) -> list[Any]:
    return list(value) if isinstance(value, list) else [value]


def _entry(value: Value, a: int, b: int, row: bool, column: bool) -> Any:
    if row and column:
        return value[a][b]
    if row or column:
        return value[a if row else b]
    return value


def _checks(energy: Energy, section: Section, reading: Components) -> Iterable[tuple[Any, str, str]]:
    """Lengths and the declared domain."""
    tree = section.expand(energy.expression)
    for node in dict.fromkeys(n for n in tree.walk() if n.op == "norm"):
        if section.type_of(node.args[0]).value == "vector":
            ends = [n.name.label for n in node.args[0].walk() if n.op == "symbol"]
            yield (
                reading.value(node),
                "energy",
                f"the segment {'-'.join(sorted(ends))} has length zero, or so little that its square vanishes",
            )
    if energy.elsewhere != "zero":
        for assumption in energy.domain:
            margin = reading.value(assumption.left) - reading.value(assumption.right)
            yield margin, "energy", f"{_plain(assumption.left)} > {_plain(assumption.right)} does not hold"


def _active(energy: Energy, reading: Components) -> Any:
    """What must be positive for the energy to act at all; None where it always does."""
    if energy.elsewhere != "zero":
        return None
    (assumption,) = energy.domain
    return reading.value(assumption.left) - reading.value(assumption.right)


def _plain(expr: Expr) -> str:
    from yarnverify.symbolic.latex import latex

    return latex(expr).replace("_", "").replace("\\", "")


def _settled(
    steps: Mapping[sp.Symbol, Any],
    energy: Any,
    gradient: list[Any],
    hessian: list[Any],
    checks: list[tuple[Any, str, str]],
    active: Any,
) -> Program:
    """Drop steps that nothing needs, share common subexpressions, count operations."""
    kept = _needed(steps, [energy, *gradient, *hessian, *(c[0] for c in checks)])
    roots = [*kept.values(), energy, *gradient, *hessian, *(check[0] for check in checks)]
    shared, reduced = sp.cse(roots, symbols=(sp.Symbol(f"t{i}", real=True) for i in range(10**6)), order="canonical")
    everything, rest = _numbered(*_without_aliases(dict(shared), kept, reduced))
    g, h = len(gradient), len(hessian)
    outputs = {
        "energy": [rest[0]],
        "gradient": rest[1 : 1 + g],
        "hessian": rest[1 + g : 1 + g + h],
        "evaluate": rest[: 1 + g + h],
    }
    operations = {}
    for key, values in outputs.items():
        needed = _needed(everything, values)
        operations[key] = int(sum(sp.count_ops(value) for value in (*needed.values(), *values)))
    new_checks = tuple((v, c[1], c[2]) for v, c in zip(rest[1 + g + h :], checks, strict=True))
    return Program(
        everything, rest[0], tuple(outputs["gradient"]), tuple(outputs["hessian"]), new_checks, active, operations
    )


def _without_aliases(
    shared: dict[sp.Symbol, Any], named: Iterable[sp.Symbol], reduced: list[Any]
) -> tuple[dict[sp.Symbol, Any], list[Any]]:
    """Steps and outputs in which no step merely renames another: a shared expression takes its given name, if it has one."""
    names = list(named)
    rename: dict[sp.Symbol, sp.Symbol] = {}
    for name, value in zip(names, reduced, strict=False):
        if value in shared and value not in rename and not _OUTPUT.match(str(name)):
            rename[value] = name
        elif value.is_Symbol:
            rename[name] = rename.get(value, value)
    steps = {rename.get(symbol, symbol): value.xreplace(rename) for symbol, value in shared.items()}
    for name, value in zip(names, reduced, strict=False):
        if not value.is_Symbol:
            steps[name] = value.xreplace(rename)
    return steps, [value.xreplace(rename) for value in reduced[len(names) :]]


def _numbered(steps: dict[sp.Symbol, Any], outputs: list[Any]) -> tuple[dict[sp.Symbol, Any], list[Any]]:
    """The same with temporaries numbered as they are met."""
    ordered = _needed(steps, outputs)
    temporaries = [symbol for symbol in ordered if re.fullmatch(r"[st]\d+", str(symbol))]
    rename = {old: sp.Symbol(f"t{i}", real=True) for i, old in enumerate(temporaries)}
    clash = {symbol: sp.Dummy(str(symbol)) for symbol in rename}  # by way of dummies: old and new names overlap
    back = {clash[old]: new for old, new in rename.items()}

    def renamed(value: Any) -> Any:
        return value.xreplace(clash).xreplace(back)

    return {renamed(symbol): renamed(value) for symbol, value in ordered.items()}, [renamed(value) for value in outputs]


def _needed(steps: Mapping[sp.Symbol, Any], outputs: Iterable[Any]) -> dict[sp.Symbol, Any]:
    """The steps that outputs need, each after what it needs itself."""
    found: dict[sp.Symbol, Any] = {}

    def visit(value: Any) -> None:
        for symbol in sorted(value.free_symbols, key=str):
            if symbol in steps and symbol not in found:
                visit(steps[symbol])
                found[symbol] = steps[symbol]

    for output in outputs:
        visit(output)
    return found


# -- text -------------------------------------------------------------------------------------------------------------


class _Printer(NumPyPrinter):  # type: ignore[misc]
    """NumPy code in which small integer powers are products."""

    def _print_Pow(self, expr: Any, rational: bool = False, sqrt: str = "sqrt") -> str:
        base, exponent = expr.args
        if not exponent.is_Integer:
            return str(super()._print_Pow(expr, rational=rational))
        text = self._print(base) if base.is_Symbol or base.is_Function else f"({self._print(base)})"
        size = abs(int(exponent))
        power = "*".join([text] * size) if base.is_Symbol and size <= 4 else f"{text}**{size}"
        power = text if size == 1 else f"({power})"
        return power if exponent > 0 else f"(1/{power})"


_PRINTER = _Printer({"fully_qualified_modules": False})
_FUNCTIONS = {"arccos", "cos", "sin", "sqrt", "tan", "pi", "abs"}


def text_of(value: Any) -> str:
    return str(_PRINTER.doprint(value))


def statements(steps: Mapping[sp.Symbol, Any], outputs: Mapping[str, Any]) -> list[str]:
    """Assignments that compute outputs such as ``G[0]``; outputs that are identically zero are left out."""
    wanted = {target: value for target, value in outputs.items() if value != 0}
    lines = [f"{symbol} = {text_of(value)}" for symbol, value in _needed(steps, wanted.values()).items()]
    return lines + [f"{target} = {text_of(value)}" for target, value in wanted.items()]


def used_functions(code: str) -> list[str]:
    """The NumPy names that emitted code calls, in alphabetical order."""
    return sorted(name for name in _FUNCTIONS - {"abs"} if re.search(rf"\b{name}\b", code))


__all__ = [
    "Components", "Program", "dof_labels", "identifier", "map_value", "plain_program", "program", "row_symbols", "statements",
    "text_of", "used_functions",
]  # fmt: skip
