"""Motions that leave an energy as it is, proved: along each of them the derivative of the energy is zero.

A rotation turns the vector parameters with the points, and a translation moves those that are points, so that an energy
which knows a direction or a place is unchanged too when these go along.
"""

from __future__ import annotations

from collections.abc import Iterable

from yarnverify.errors import InputError
from yarnverify.symbolic.court import Court, Finding
from yarnverify.symbolic.declare import Energy, Motion
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.places import part_of
from yarnverify.symbolic.tree import ZERO, Expr, Name, is_zero

_MOVED = {"translation": 'Point or Vector["m"]', "rotation": "Point, Velocity or Vector", "sliding": "Sliding"}


def prove_invariants(energy: Energy, motions: Iterable[Motion] = ()) -> dict[str, Finding]:
    """A finding for each motion that the energy is declared to be unchanged by.

    Raises
    ------
    InputError
        For a motion that moves nothing which the energy has.
    """
    section = Section(energy.name, 0, declared=energy)
    section.parameters = tuple(parameter.name for parameter in energy.parameters)
    vectors = [(parameter.name, parameter.unit) for parameter in energy.parameters if parameter.name.bold]
    section.unknowns = (*energy.unknowns, *(name for name, _ in vectors))
    section.families = {(name.base, name.bold) for name in energy.unknowns}
    section.assumptions = list(energy.domain)
    court = Court(section, energy.expression)
    unknowns = list(zip(energy.unknowns, energy.units, strict=True))
    places = [name for name, unit in (*unknowns, *vectors) if name.bold and unit == "m"]
    turning = [name for name, _ in (*unknowns, *vectors) if name.bold]
    sliding = [name for name, unit in unknowns if not name.bold and unit == "m"]
    standard = {
        "translation": [_force(name) for name in places],
        "rotation": [Expr("cross", (Expr("symbol", value=name), _force(name))) for name in turning],
        "sliding": [_force(name) for name in sliding],
    }
    for kind, moved in _MOVED.items():
        if kind in energy.unchanged and not standard[kind]:
            raise InputError(
                f"{energy.name}: unchanged by {kind} says nothing here: there is no {moved} that it moves; leave it out",
                part_of(energy.place, "unchanged"),
            )
    rates = {kind: standard[kind] for kind in energy.unchanged}
    rates |= {m.name: [_power(*rate) for rate in m.rates] for m in motions if m.energy == energy.name}
    return {f"invariance under {what}": court.judge(_sum(terms), ZERO) for what, terms in rates.items()}


def _force(name: Name) -> Expr:
    return Expr("force", value=name)


def _power(name: Name, rate: Expr) -> Expr:
    """Force times rate."""
    return ZERO if is_zero(rate) else rate.T * _force(name) if name.bold else rate * _force(name)


def _sum(terms: list[Expr]) -> Expr:
    return terms[0] if len(terms) == 1 else Expr("add", tuple(terms))
