"""Gradient and Hessian of an energy in vector form, by the chain rule over its measures.

An energy is a law ``F(m_1, m_2, ..., u_1, ...)`` of a few measures of its segments. SymPy differentiates the law; the
derivatives of a measure are known once and for all. ``Derivation.check`` proves the law and every block.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import sympy as sp

from yarnverify.symbolic.court import Court, Finding
from yarnverify.symbolic.declare import Energy, Quantity, length
from yarnverify.symbolic.document import Definition, Section, block_of
from yarnverify.symbolic.laws import Law
from yarnverify.symbolic.measures import Measure, NoMeasuresError, Segment, differentiate, scalar_symbol
from yarnverify.symbolic.reader import Relation
from yarnverify.symbolic.scalars import Order, by_index, scalar_tree, sum_tree
from yarnverify.symbolic.tree import FORCE, IDENTITY, Expr, Name

_NOWHERE = Relation((), (), "", 0, True)


@dataclass(frozen=True)
class Derivation:
    """Measures, law, and derivatives of an energy.

    ``section`` defines the symbols that the blocks are written in, ``order`` how differences of them stand.
    """

    section: Section
    energy: Expr
    law: Any
    measures: tuple[Measure, ...]
    unknowns: tuple[Name, ...]
    order: Order = by_index

    @cached_property
    def slopes(self) -> dict[Measure, Any]:
        """First derivatives of the law by its measures."""
        return {m: differentiate(self.law, scalar_symbol(m.symbol)) for m in self.measures}

    def law_slope(self, *names: Name) -> Any:
        """Derivative of the law by measures and sliding coordinates, as SymPy has it."""
        return sp.factor_terms(differentiate(self.law, *(scalar_symbol(name) for name in names)))

    def _measure_slope(self, measure: Measure, unknown: Name) -> list[tuple[Any, tuple[Expr, ...]]]:
        return [(a.end(unknown) * value, factors) for a, value, factors in measure.slope if a.end(unknown)]

    def gradient(self, unknown: Name, scale: int = 1) -> Expr:
        """Gradient block: a vector for a point, a scalar for a sliding coordinate."""
        if not unknown.bold:
            return sum_tree([(scale * differentiate(self.law, scalar_symbol(unknown)), ())], self.order)
        if self._is_hub(unknown):
            return _minus_sum([Expr("force", value=other) for other in self._others(unknown)])
        terms = []
        for measure in self.measures:
            for value, factors in self._measure_slope(measure, unknown):
                terms.append((scale * self.slopes[measure] * value, factors))
        return sum_tree(terms, self.order)

    def hessian(self, row: Name, column: Name, scale: int = 1) -> Expr:
        """Hessian block; rows belong to ``row``."""
        for unknown in (row, column):
            if self._is_hub(unknown):
                pairs = [(o, column) if unknown == row else (row, o) for o in self._others(unknown)]
                return _minus_sum([Expr("derivative", (Expr("force", value=r),), c) for r, c in pairs])
        if not row.bold and not column.bold:
            return sum_tree(
                [(scale * differentiate(self.law, scalar_symbol(row), scalar_symbol(column)), ())], self.order
            )
        if not (row.bold and column.bold):
            point, sliding = (row, column) if row.bold else (column, row)
            terms = []
            for measure in self.measures:
                mixed = differentiate(self.slopes[measure], scalar_symbol(sliding))
                for value, factors in self._measure_slope(measure, point):
                    terms.append((scale * mixed * value, factors if row.bold else _transposed(factors)))
            return sum_tree(terms, self.order)
        terms = []
        for measure in self.measures:
            for a in measure.segments:
                for b in measure.segments:
                    ends = a.end(row) * b.end(column)
                    if ends:
                        terms += [(scale * ends * self.slopes[measure] * v, f) for v, f in measure.bend(a, b)]
            for other in self.measures:
                second = differentiate(self.slopes[measure], scalar_symbol(other.symbol))
                for value, left in self._measure_slope(measure, row):
                    for value2, right in self._measure_slope(other, column):
                        terms.append((scale * second * value * value2, (*left, *_transposed(right))))
        return sum_tree(terms, self.order)

    @cached_property
    def _segments(self) -> tuple[Segment, ...]:
        return tuple(dict.fromkeys(s for measure in self.measures for s in measure.segments))

    def _is_hub(self, point: Name) -> bool:
        """Whether every segment leads from the point to another unknown: then translation gives its rows."""
        tails, heads = ({getattr(s, end) for s in self._segments} for end in ("tail", "head"))
        return point.bold and point in self.unknowns and tails == {point} and heads <= set(self.unknowns)

    def _others(self, hub: Name) -> list[Name]:
        return [name for name in self.unknowns if name.bold and name != hub]

    def check(self) -> dict[str, Finding]:
        """Proof of the law and of every block against the energy and its exact derivatives."""
        court = Court(self.section, self.energy)
        found = {"V": court.judge(self.energy, self.law_tree)}
        for force, jacobian in self.blocks(FORCE):
            for block, tree in (force, *jacobian):
                found[block_of(block)] = court.judge(block, tree)
        return found

    @property
    def law_tree(self) -> Expr:
        """The energy in terms of its measures."""
        return scalar_tree(sp.factor(self.law), self.order)

    def blocks(self, scale: int) -> Iterable[tuple[tuple[Expr, Expr], list[tuple[Expr, Expr]]]]:
        """For each unknown its gradient block and its Hessian blocks, each times ``scale``, as (name, tree)."""
        for row in self.unknowns:
            force = Expr("force", value=row)
            rest = [
                (Expr("derivative", (force,), column), self.hessian(row, column, scale)) for column in self.unknowns
            ]
            yield (force, self.gradient(row, scale)), rest


def _minus_sum(parts: list[Expr]) -> Expr:
    return -(parts[0] if len(parts) == 1 else Expr("add", tuple(parts)))


def _transposed(factors: tuple[Expr, ...]) -> tuple[Expr, ...]:
    return tuple(f.args[0] if f.op == "transpose" else f if f.name.base == "P" else f.T for f in reversed(factors))


def derive(
    energy: Expr, section: Section, unknowns: tuple[Name, ...], quantities: Iterable[Quantity] = ()
) -> Derivation | None:
    """Derive an energy's gradient and Hessian over its measures; None where it is not a law of known measures.

    Parameters
    ----------
    energy
        The energy's tree; symbols have their meaning in ``section``.
    section
        Definitions, assumptions and parameters.
    unknowns
        The degrees of freedom, in order.
    quantities
        Declared quantities, for the names of angles.
    """
    named = {q.expression: q.symbol for q in quantities}
    named |= {section.expand(d.expression): s for s, d in section.definitions.items() if not d.index}
    reader = Law(section, {tree: name for tree, name in named.items() if tree.op == "call"})
    try:
        law = reader.scalar(section.expand(energy))
        derivation = _assemble(section, energy, law, tuple(reader.measures.values()), unknowns)
        for _ in derivation.blocks(1):
            pass
    except NoMeasuresError:
        return None
    return derivation


def _assemble(
    section: Section, energy: Expr, law: Any, measures: tuple[Measure, ...], unknowns: tuple[Name, ...]
) -> Derivation:
    own = Section(
        section.title, section.offset, parameters=section.parameters, unknowns=unknowns, declared=section.declared
    )
    own.families |= section.families
    own.assumptions = [
        replace(a, left=section.expand(a.left), right=section.expand(a.right)) for a in section.assumptions
    ]
    used = tuple(m for m in measures if law.has(scalar_symbol(m.symbol)))
    for segment in dict.fromkeys(s for m in used for s in m.segments):
        meanings = {
            segment.l: length(segment.vector),
            segment.d: segment.vector / segment.l,
            segment.P: IDENTITY - segment.d * segment.d.T,
        }
        for symbol, meaning in meanings.items():
            own.definitions[symbol.name] = Definition(symbol.name, meaning, _NOWHERE)
    for measure in used:
        if measure.b is not None:
            own.definitions[measure.symbol] = Definition(measure.symbol, measure.definition, _NOWHERE)
    return Derivation(own, section.expand(energy), law, used, unknowns)


def derive_declared(energy: Energy, quantities: Iterable[Quantity]) -> Derivation | None:
    """Derive a declared energy."""
    section = declared_section(energy)
    mine = [q for q in quantities if q.document == energy.document and q.section in ("", energy.section)]
    return derive(energy.expression, section, energy.unknowns, [q for q in mine if q.section])


def declared_section(energy: Energy) -> Section:
    """The section that a declared energy lives in when no document is at hand."""
    section = Section(energy.section or energy.name, 0, declared=energy)
    section.parameters = tuple(parameter.name for parameter in energy.parameters)
    section.unknowns = energy.unknowns
    section.families |= {(name.base, name.bold) for name in energy.unknowns}
    section.assumptions = list(energy.domain)
    return section
