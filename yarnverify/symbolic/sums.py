"""Energies without measures: every sum and function is a step of its own, and derivatives go through the steps.

What can lose digits is a sum of terms that cancel. Expanded derivatives regroup sums (``u0/6 - u1/6``) and lose what the
declared form keeps (``(u1 - u0)/6``); here each declared sum is formed once from its own terms, and the chain rule over these
steps never opens it. Where the energy is rational in its coordinates, ``prove`` shows that the result is its derivative, entry
by entry, as rational functions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp
from sympy.polys.fields import FracField

from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.emit import (
    Components,
    active,
    domain_checks,
    given_symbols,
    length_checks,
    row_symbols,
)
from yarnverify.symbolic.measures import differentiate
from yarnverify.symbolic.reading import Value
from yarnverify.symbolic.steps import Program, settled
from yarnverify.symbolic.tree import Expr

_RATIONAL = {"number", "symbol", "add", "neg", "mul", "frac", "pow", "transpose", "dot", "cross"}


def is_rational(energy: Energy, section: Section) -> bool:
    """Whether an energy is made of sums, products and quotients alone."""
    return all(node.op in _RATIONAL for node in section.expand(energy.expression).walk())


_STEPS = {"add", "norm", "sqrt", "call", "cross"}


class _Sums(Components):
    """A reading in which every sum and every function is a named step."""

    def value(self, expr: Expr, blocks: Callable[[Expr], Value] | None = None) -> Value:
        found = super().value(expr, blocks)
        return self._steps_of(found) if expr.op in _STEPS else found

    def absolute(self, value: Any) -> Any:
        return super().absolute(self.hold(value))  # a symbol is known to be real, and so its sign to have no slope

    def _steps_of(self, value: Value) -> Value:
        return [self._steps_of(part) for part in value] if isinstance(value, list) else self.hold(value)


class Stages:
    """An energy as steps, with its derivatives by the rows of ``q`` over the same steps."""

    def __init__(self, energy: Energy, section: Section) -> None:
        self.energy = energy
        self.rows = [symbol for name in energy.unknowns for symbol in row_symbols(name)]
        self.reading = _Sums(section, {})
        self.value = self.reading.value(energy.expression)
        self._slopes: dict[tuple[Any, sp.Symbol], Any] = {}
        self.gradient = [self.slope(self.value, row) for row in self.rows]
        count = len(self.rows)
        self.hessian = [self.slope(self.gradient[i], self.rows[j]) for i in range(count) for j in range(i, count)]

    @property
    def steps(self) -> dict[sp.Symbol, Any]:
        """What each step is, over rows, parameters and earlier steps."""
        return self.reading.steps

    def slope(self, value: Any, row: sp.Symbol) -> Any:
        """Derivative of an expression by a row, through the steps that it uses."""
        key = value, row
        if key not in self._slopes:
            terms = [differentiate(value, row)]
            for symbol in sorted(value.free_symbols & set(self.steps), key=str):
                inner = self.slope(self.steps[symbol], row)
                if inner != 0:
                    terms.append(differentiate(value, symbol) * inner)
            self._slopes[key] = sp.Add(*terms)
        return self._slopes[key]

    def program(self) -> Program:
        """The program of energy, gradient and Hessian."""
        section = self.reading.section
        checks = list(length_checks(self.energy, section, self.reading, ", or so little that its square vanishes"))
        checks += domain_checks(self.energy, self.reading)
        choice = active(self.energy, self.reading)
        return settled(self.steps, self.value, self.gradient, self.hessian, checks, choice)

    # -- proofs

    def prove(self) -> list[str]:
        """The entries of gradient and Hessian that are not the derivatives of the declared energy: none."""
        exact = Exact(self)
        wrong = []
        slopes = [exact.energy.diff(generator) for generator in exact.rows]
        count = len(self.rows)
        for i, found in enumerate(self.gradient):
            if exact(found) != slopes[i]:
                wrong.append(str(self.rows[i]))
        pairs = [(i, j) for i in range(count) for j in range(i, count)]
        for (i, j), found in zip(pairs, self.hessian, strict=True):
            if exact(found) != slopes[i].diff(exact.rows[j]):
                wrong.append(f"{self.rows[i]},{self.rows[j]}")
        return wrong


class Exact:
    """Expressions of stages as rational functions of the rows and parameters, in lowest terms."""

    def __init__(self, stages: Stages) -> None:
        parameters = [symbol for p in stages.energy.parameters for symbol in given_symbols(p.name)]
        symbols = [*stages.rows, *parameters]
        self.field = FracField([str(symbol) for symbol in symbols], sp.QQ)
        self._known = dict(zip(symbols, self.field.gens, strict=True))
        self.rows = list(self.field.gens[: len(stages.rows)])
        for symbol, meaning in stages.steps.items():
            self._known[symbol] = self(meaning)
        # the energy itself is read apart from the steps, so that an error in these shows
        plain = Components(stages.reading.section, {}, naming=False)
        self.energy = self(plain.value(stages.energy.expression))

    def __call__(self, value: Any) -> Any:
        if value in self._known:
            return self._known[value]
        if value.is_Rational:
            return self.field(sp.QQ(value.p, value.q))
        if value.is_Pow and value.exp.is_Integer:
            return self(value.base) ** int(value.exp)
        parts = [self(arg) for arg in value.args]
        found = parts[0]
        for part in parts[1:]:
            found = found + part if value.is_Add else found * part
        return found
