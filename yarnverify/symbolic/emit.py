"""Reading 3: a program. Trees become straight-line code on scalars, the same text on every run.

What is emitted is a matter of the formulas that are put in, not of this module: the derived blocks give the variant
``differentiated``, the document's own printed blocks ``printed``, the rearranged blocks of ``safe`` all others. What a wanted
output does not need is dropped when the code is recorded (``kernels.tape``), not here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp

from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.document import Section, block_of
from yarnverify.symbolic.functions import is_turn
from yarnverify.symbolic.plain import plain
from yarnverify.symbolic.reading import Reading, UnsupportedError, Value
from yarnverify.symbolic.steps import Check, Program, settled
from yarnverify.symbolic.tree import FORCE, Expr, Name

AXES = "xyz"
Formulas = Mapping[Expr, Expr]  # what each force and Jacobian node stands for


def identifier(name: Name) -> str:
    """A symbol as a Python name."""
    return name.identifier


def row_symbols(name: Name) -> list[sp.Symbol]:
    """The scalar unknowns of one degree of freedom: three for a point."""
    return (
        [sp.Symbol(name.label + axis, real=True) for axis in AXES] if name.bold else [sp.Symbol(name.label, real=True)]
    )


def given_symbols(name: Name) -> list[sp.Symbol]:
    """The scalars of an atom that a function of ``kernels.geometry`` provides: three for a vector."""
    return [sp.Symbol(identifier(name) + part, real=True) for part in (("_x", "_y", "_z") if name.bold else ("",))]


def dof_labels(unknowns: Iterable[Name]) -> tuple[str, ...]:
    """Names of the rows of ``q``, such as ``x0.x`` and ``u1``."""
    return tuple(label for n in unknowns for label in ([f"{n.label}.{axis}" for axis in AXES] if n.bold else [n.label]))


class Components(Reading):
    """Values of trees as SymPy scalars over the rows of ``q``; definitions and shared scalars become named steps."""

    def __init__(
        self,
        section: Section,
        formulas: Formulas,
        naming: bool = True,
        forces: bool = True,
        given: frozenset[Name] = frozenset(),
    ) -> None:
        super().__init__(section)
        self.formulas, self.naming, self.forces, self.given = formulas, naming, forces, given
        self.steps: dict[sp.Symbol, Any] = {}
        self._known: dict[Any, sp.Symbol] = {}
        self._blocks: dict[Expr, Value] = {}
        self._open: set[Expr] = set()
        self.pi = sp.pi

    def constant(self, value: Any) -> Any:
        return sp.Integer(value)

    def leaf(self, name: Name) -> Value:
        if name in self.given:
            found = given_symbols(name)
            return found if name.bold else found[0]
        if self.section.is_unknown(name):
            symbols = row_symbols(name)
            return symbols if name.bold else symbols[0]
        found = given_symbols(name)
        return found if name.bold else found[0]

    def sqrt(self, value: Any) -> Any:
        return sp.sqrt(value)

    def absolute(self, value: Any) -> Any:
        return sp.Abs(value)

    def arccos(self, cosine: Any) -> Any:
        return sp.acos(cosine)

    def log(self, value: Any) -> Any:
        return sp.log(value)

    def exp(self, value: Any) -> Any:
        return sp.exp(value)

    def safe(self, name: str, args: tuple[Expr, ...]) -> Any:
        values = [self.hold(self.value(arg)) for arg in args] if name == "atan2" else map(self.value, args)
        return (sp.atan2 if name == "atan2" else sp.Function(name))(*values)

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
            meaning = None if name in self.given else self.section.meaning(name)
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
            value = _in_shape(self.value(self.formulas[expr], self.block), expr)
            if expr.op == "derivative" and expr.args[0].name == expr.name and expr.name.bold:
                value = [[value[min(i, j)][max(i, j)] for j in range(3)] for i in range(3)]  # symmetric: one triangle
            self._blocks[expr] = self._named(value, label)
        return self._blocks[expr]


def _in_shape(value: Value, expr: Expr) -> Value:
    """A force or Jacobian whose formula is a bare 0, as a vector or matrix where it is one, so that it can be added."""
    names = [expr.args[0].name, expr.name] if expr.op == "derivative" else [expr.name]
    if not isinstance(value, list):
        for name in reversed(names):
            value = [value] * 3 if name.bold else value
    return value


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
    value, gradient, hessian = entries_of(energy, reading, tree, scale)
    checks = list(length_checks(energy, section, reading, ", or so little that its square vanishes"))
    checks += domain_checks(energy, reading)
    for angle in angles:
        sine, _ = reading.circle(reading.symbol(angle))
        text = f"{angle} is 0 or pi within rounding, where this variant divides by its sine"
        checks.append((sine, "derivatives", text))
    return settled(reading.steps, value, gradient, hessian, checks, active(energy, reading))


def entries_of(energy: Energy, reading: Components, tree: Expr, scale: int) -> tuple[Any, list[Any], list[Any]]:
    """Energy, gradient and upper triangle of the Hessian, as scalars over the steps of a reading."""
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
    return value, gradient, hessian


def plain_program(energy: Energy, section: Section) -> Program:
    """The program of an energy that is not a law of known measures, by plain differentiation."""
    reading = Components(section, {}, naming=False)
    value = reading.value(energy.expression)
    rows = [symbol for n in energy.unknowns for symbol in row_symbols(n)]
    gradient = [sp.diff(value, row) for row in rows]
    hessian = [sp.diff(gradient[i], rows[j]) for i in range(len(rows)) for j in range(i, len(rows))]
    checks = list(length_checks(energy, section, reading, ", or so little that its square vanishes"))
    checks += domain_checks(energy, reading)
    return settled({}, value, gradient, hessian, checks, active(energy, reading))


def _rows(value: Value) -> list[Any]:
    return list(value) if isinstance(value, list) else [value]


def _entry(value: Value, a: int, b: int, row: bool, column: bool) -> Any:
    if row and column:
        return value[a][b]
    if row or column:
        return value[a if row else b]
    return value


def length_checks(
    energy: Energy, section: Section, reading: Components, more: str, but: Iterable[Expr] = ()
) -> Iterable[Check]:
    """The lengths that the energy is made of, ``but`` those that may be zero."""
    tree = section.expand(energy.expression)
    for node in dict.fromkeys(n for n in tree.walk() if n.op == "norm" and n not in but):
        if section.type_of(node.args[0]).value == "vector":
            ends = [n.name for n in node.args[0].walk() if n.op == "symbol"]
            yield reading.value(node), "energy", zero_length(ends, more)


def zero_length(ends: Iterable[Name], more: str = "") -> str:
    """What is wrong with a segment without length."""
    labels = sorted({n.label for n in ends})
    what = f"segment {'-'.join(labels)}" if len(labels) == 2 else f"vector made of {', '.join(labels)}"
    return f"the {what} has length zero{more}"


def domain_checks(energy: Energy, reading: Components) -> Iterable[Check]:
    """The declared domain, where leaving it is an error; and what logarithms are taken of."""
    if energy.elsewhere != "zero":
        for assumption in energy.domain:
            margin = reading.value(assumption.left) - reading.value(assumption.right)
            yield margin, "energy", f"{_plain(assumption.left)} > {_plain(assumption.right)} does not hold"
    for node in dict.fromkeys(energy.expression.walk()):
        # lengths have checks of their own
        if node.op == "call" and node.value == "log" and not any(n.op == "norm" for n in node.walk()):
            yield (
                reading.value(node.args[0]),
                "energy",
                f"the logarithm of {plain(node.args[0])} is taken, which is not positive",
            )


def turn_checks(energy: Energy, reading: Components) -> Iterable[Check]:
    """The half line on which an angle of two arguments jumps from -pi to pi."""
    for node in dict.fromkeys(filter(is_turn, energy.expression.walk())):
        y, x = node.args
        margin = reading.value(Expr("abs", (y,)) + Expr("abs", (x,)) + x)
        yield margin, "energy", f"{plain(node)} has no value, or jumps between -pi and pi"


def active(energy: Energy, reading: Components) -> Any:
    """What must be positive for the energy to act at all; None where it always does."""
    if energy.elsewhere != "zero":
        return None
    (assumption,) = energy.domain
    return reading.value(assumption.left) - reading.value(assumption.right)


def _plain(expr: Expr) -> str:
    from yarnverify.symbolic.latex import latex

    return latex(expr).replace("_", "").replace("\\", "")
