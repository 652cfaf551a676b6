"""Energies without measures: every sum and function is a step of its own, and derivatives go through the steps.

What can lose digits is a sum of terms that cancel. Expanded derivatives regroup sums (``u0/6 - u1/6``) and lose what the
declared form keeps (``(u1 - u0)/6``); here each declared sum is formed once from its own terms, and the chain rule over these
steps never opens it. What the chain rule itself adds and takes away again is another matter: where the energy is rational in
its coordinates, an entry is also written in lowest terms, and the shorter of the two is taken. There ``prove`` shows that the
result is the energy's derivative, entry by entry, as rational functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property, reduce
from typing import Any

import sympy as sp
from sympy.polys.fields import FracField

from yarnverify.kernels.words import CHEAP
from yarnverify.symbolic.angle_trees import VectorAngles
from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.emit import (
    Components,
    active,
    domain_checks,
    given_symbols,
    length_checks,
    row_symbols,
    turn_checks,
)
from yarnverify.symbolic.laws import exponential
from yarnverify.symbolic.measures import differentiate
from yarnverify.symbolic.reading import Value
from yarnverify.symbolic.steps import Program, settled
from yarnverify.symbolic.tree import Expr
from yarnverify.symbolic.vanishing import expm1, log_ratio, logarithm_of, sinh, sum_of
from yarnverify.symbolic.vector_angles import Rule

_RATIONAL = {"number", "symbol", "add", "neg", "mul", "frac", "pow", "transpose", "dot", "cross"}


def is_rational(energy: Energy, section: Section) -> bool:
    """Whether an energy is made of sums, products and quotients alone."""
    return all(node.op in _RATIONAL for node in section.expand(energy.expression).walk())


_STEPS = {"add", "norm", "sqrt", "call", "cross"}


class Steps(Components):
    """A reading in which every sum and every function is a named step; ``rules`` are derivatives that some steps have.

    Where the energy is rational, what is divided by stays outside of the steps: a sum is that of its terms over their common
    denominator, and so one of products, which an exact kernel can form without an error.
    """

    def __init__(self, section: Section, rational: bool) -> None:
        super().__init__(section, {})
        self.rational = rational
        self.rules: dict[sp.Symbol, Rule] = {}
        self.angles = VectorAngles(self)

    def value(self, expr: Expr, blocks: Callable[[Expr], Value] | None = None) -> Value:
        found = None if self.rational else self.angles.value(expr)
        if found is not None:
            return found
        found = super().value(expr, blocks)
        return self._steps_of(found) if expr.op in _STEPS else found

    def hold(self, value: Any) -> Any:
        if not self.rational:
            return super().hold(self._without_cancellation(value) if value.is_Add else value)
        over = sp.Mul.make_args(together(value))
        return sp.Mul(*(super(Steps, self).hold(factor) if factor.is_Add else factor for factor in over))

    def log(self, value: Any) -> Any:
        found = logarithm_of(self.steps.get(value, value))
        if isinstance(found, log_ratio):
            return log_ratio(*map(self.hold, found.args))
        return super().log(value)

    def _without_cancellation(self, total: Any) -> Any:
        """A sum in which nothing cancels of exponentials and 1, nor of cosines and 1."""
        powers = {
            symbol: exponential(value.args[0]) for symbol, value in self.steps.items() if isinstance(value, sp.exp)
        }
        sums = {
            symbol: value
            for symbol, value in self.steps.items()
            if value.is_Add and all(term.as_coeff_Mul()[1] in powers for term in value.args)
        }
        back = {power: symbol for symbol, power in powers.items()}
        opened = total.xreplace(sums).xreplace(powers)
        found = sum_of(opened)
        if found == opened:
            return self.angles.without_cancellation(total)
        calls = {call: super(Steps, self).hold(call) for call in sorted(found.atoms(expm1, sinh), key=str)}
        return found.xreplace(calls).xreplace(back)

    def absolute(self, value: Any) -> Any:
        return super().absolute(self.hold(value))  # a symbol is known to be real, and so its sign to have no slope

    def _steps_of(self, value: Value) -> Value:
        return [self._steps_of(part) for part in value] if isinstance(value, list) else self.hold(value)


def together(value: Any) -> Any:
    """A sum over the common denominator of its terms, their common factors outside; its terms are not opened."""
    return sp.gcd_terms(value) if value.is_Add else value


class Stages:
    """An energy as steps, with its derivatives by the rows of ``q`` over the same steps."""

    def __init__(self, energy: Energy, section: Section) -> None:
        self.energy = energy
        self.rows = [symbol for name in energy.unknowns for symbol in row_symbols(name)]
        self.parameters = [symbol for p in energy.parameters for symbol in given_symbols(p.name)]
        self.rational = is_rational(energy, section)
        self.reading = Steps(section, self.rational)
        self.value = self.reading.value(energy.expression)
        self._slopes: dict[tuple[Any, sp.Symbol], Any] = {}
        self.gradient = [self.slope(self.value, row) for row in self.rows]
        count = len(self.rows)
        self.hessian = [self.slope(self.gradient[i], self.rows[j]) for i in range(count) for j in range(i, count)]
        if self.rational:
            opened = Exact(self, self._differences())
            self.gradient, self.hessian = (
                [shorter(value, opened.expression(value)) for value in values]
                for values in (self.gradient, self.hessian)
            )

    def _differences(self) -> list[sp.Symbol]:
        """The steps that are sums of coordinates and parameters themselves, such as the components of an edge."""
        given = {*self.rows, *self.parameters}
        return [
            symbol
            for symbol, value in self.steps.items()
            if value.is_Add and all(part.as_coeff_Mul()[1] in given for part in value.args)
        ]

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
                rule = self.reading.rules.get(symbol)
                inner = self.slope(self.steps[symbol], row) if rule is None else rule(self.slope, row)
                if inner != 0:
                    terms.append(differentiate(value, symbol) * inner)
            found = sp.Add(*terms)
            self._slopes[key] = together(found) if self.rational else found
        return self._slopes[key]

    @cached_property
    def program(self) -> Program:
        """The program of energy, gradient and Hessian."""
        section = self.reading.section
        more, but = ", or so little that its square vanishes", self.reading.angles.sines
        checks = list(length_checks(self.energy, section, self.reading, more, but))
        checks += domain_checks(self.energy, self.reading)
        checks += turn_checks(self.energy, self.reading)
        checks += self.reading.angles.checks()
        choice = active(self.energy, self.reading)
        return settled(self.steps, self.value, self.gradient, self.hessian, checks, choice)

    def exact_terms(self) -> bool:
        """Whether ``kernels.words`` has the terms of every sum without an error, so that no cancellation can cost digits."""
        differences = set(self._differences())
        inputs = {*self.rows, *self.parameters}

        def words(value: Any) -> float:
            if value in differences:
                return 2
            if value in inputs or value.is_Integer:
                return 1
            if value.is_Pow and value.exp.is_Integer and value.exp > 0:
                return words(sp.Mul(*[value.base] * int(value.exp), evaluate=False))
            if not value.is_Mul:
                return math.inf
            return reduce(lambda a, b: 2 * a * b, [words(factor) for factor in value.args if abs(factor) != 1])

        every = [*self.steps.values(), self.value, *self.gradient, *self.hessian]
        terms = {term for value in every for each in sp.sympify(value).atoms(sp.Add) for term in each.args}
        return all(term.as_coeff_Mul()[1] in self.steps or words(term) <= CHEAP for term in terms)

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


def shorter(*equal: Any) -> Any:
    """That of equal expressions with the fewest operations, in which least is left that cancels whatever the state."""
    return min(equal, key=lambda each: int(sp.count_ops(each)))


class Exact:
    """Expressions of stages as rational functions of the rows, the parameters and some steps, in lowest terms."""

    def __init__(self, stages: Stages, kept: Sequence[sp.Symbol] = ()) -> None:
        self._stages, self._symbols = stages, [*stages.rows, *stages.parameters, *kept]
        self.field = FracField([str(symbol) for symbol in self._symbols], sp.QQ)
        self._known = dict(zip(self._symbols, self.field.gens, strict=True))
        self.rows = list(self.field.gens[: len(stages.rows)])
        for symbol, meaning in stages.steps.items():
            if symbol not in self._known:
                self._known[symbol] = self(meaning)

    @cached_property
    def energy(self) -> Any:
        """The energy itself; read apart from the steps, so that an error in these shows."""
        plain = Components(self._stages.reading.section, {}, naming=False)
        return self(plain.value(self._stages.energy.expression))

    def expression(self, value: Any) -> Any:
        """A quotient of polynomials, in factors; the value as it is where that can hardly be longer.

        A term takes some four operations. What has too many is no shorter in factors but by chance, and these take minutes.
        """
        found = self(value)
        if 3 * (len(found.numer) + len(found.denom)) > int(sp.count_ops(value)) + 9:
            return value
        return self._factored(found.numer, self._collected) / self._factored(found.denom, self._plain)

    def _plain(self, polynomial: Any) -> Any:
        return polynomial.as_expr(*self._symbols)

    def _factored(self, polynomial: Any, read: Callable[[Any], Any]) -> Any:
        factor, parts = polynomial.factor_list()
        over = [read(part) ** power for part, power in parts]
        return sp.Mul(sp.Rational(factor.numerator, factor.denominator), *over)

    def _collected(self, polynomial: Any) -> Any:
        """A polynomial by the powers of one of its variables, with factored coefficients, or plainly: what is shortest."""
        ways = [self._plain(polynomial)]
        for at, symbol in enumerate(self._symbols):
            powers: dict[int, dict[tuple[int, ...], Any]] = {}
            for monomial, coefficient in polynomial.terms():
                rest = (*monomial[:at], 0, *monomial[at + 1 :])
                powers.setdefault(monomial[at], {})[rest] = coefficient
            if 1 < len(powers) < len(polynomial):
                parts = {power: polynomial.ring.from_dict(part) for power, part in powers.items()}
                ways.append(
                    sp.Add(*(self._factored(part, self._plain) * symbol**power for power, part in parts.items()))
                )
        return shorter(*ways)

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
