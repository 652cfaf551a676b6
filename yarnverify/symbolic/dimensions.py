"""Physical dimensions of declared energies: the units of unknowns and parameters, carried through the expression."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any, TypeAlias

from yarnverify.symbolic.energies import Energy
from yarnverify.symbolic.latex import latex
from yarnverify.symbolic.tree import Expr, Name, is_zero

Dimension: TypeAlias = tuple[Fraction, ...]  # powers of kilogram, metre, second


class DimensionError(Exception):
    """Quantities of different kinds are added, compared, or put where a number belongs."""


def _powers(*values: int) -> Dimension:
    return tuple(map(Fraction, values))


NUMBER = _powers(0, 0, 0)
_UNITS = {
    "1": NUMBER, "rad": NUMBER, "kg": _powers(1, 0, 0), "m": _powers(0, 1, 0), "s": _powers(0, 0, 1),
    "N": _powers(1, 1, -2), "J": _powers(1, 2, -2), "Pa": _powers(1, -1, -2), "W": _powers(1, 2, -3),
    "Hz": _powers(0, 0, -1),
}  # fmt: skip
_FACTOR = re.compile(r"([A-Za-z]+|1)(?:\^(-?\d+))?\Z")


def dimension_of_unit(unit: str) -> Dimension:
    """The dimension of a unit such as ``N m^-2``.

    Raises
    ------
    DimensionError
        For a unit that is not known.
    """
    total = NUMBER
    for factor in unit.split():
        above, *below = factor.split("/")  # N/m is N m^-1
        for text, sign in ((above, 1), *((each, -1) for each in below)):
            found = _FACTOR.match(text)
            if found is None or found[1] not in _UNITS:
                raise DimensionError(
                    f"unknown unit {text!r}; known are {', '.join(_UNITS)} and whole powers, as in N m^-2"
                )
            total = _times(total, _UNITS[found[1]], sign * int(found[2] or 1))
    return total


def dimension_of(expr: Expr, lookup: Callable[[Name], Dimension]) -> Dimension:
    """The dimension of a tree, given those of its symbols.

    Raises
    ------
    DimensionError
        Where dimensions do not go together.
    """
    parts = [dimension_of(arg, lookup) for arg in expr.args]
    match expr.op:
        case "symbol":
            return lookup(expr.name)
        case "number" | "pi" | "identity":
            return NUMBER
        case "neg" | "transpose" | "norm" | "abs":
            return parts[0]
        case "add":
            return _common(expr.args, parts)
        case "mul" | "dot" | "cross":
            total = NUMBER
            for part in parts:
                total = _times(total, part)
            return total
        case "frac":
            return _times(parts[0], parts[1], -1)
        case "pow":
            return _times(NUMBER, parts[0], int(str(expr.value)))
        case "sqrt":
            return _times(NUMBER, parts[0], Fraction(1, 2))
        case "call":
            if expr.value == "atan2":
                _common(expr.args, parts)  # only their ratio counts
                return NUMBER
            if parts[0] != NUMBER:
                needed = (
                    "an angle or a plain number"
                    if expr.value in ("sin", "cos", "tan", "cot")
                    else "a plain number, such as a ratio"
                )
                raise DimensionError(f"{expr.value} of what is in {unit_text(parts[0])}; it takes {needed}")
            return NUMBER
    raise DimensionError(f"nothing is known of the dimension of {expr.op}")


def check_dimensions(energy: Energy) -> None:
    """Refuse an energy that does not come out in its unit, joules in all that are declared here.

    Raises
    ------
    DimensionError
        With the two dimensions that should be one.
    """
    known = {p.name: dimension_of_unit(p.unit) for p in energy.parameters}
    known |= {name: dimension_of_unit(unit) for name, unit in zip(energy.unknowns, energy.units, strict=True)}

    def lookup(name: Name) -> Dimension:
        if name not in known:
            raise DimensionError(f"{name} has no unit")
        return known[name]

    found, wanted = dimension_of(energy.expression, lookup), dimension_of_unit(energy.unit)
    if found != wanted:
        raise DimensionError(f"the energy comes out in {unit_text(found)}, and {energy.unit} is {unit_text(wanted)}")
    for assumption in energy.domain:
        sides = (assumption.left, assumption.right)
        _common(sides, [dimension_of(side, lookup) for side in sides])


def length_power(unit: str) -> int:
    """The power of length in a unit such as ``N m^2``; newton and second are the other base units, so that kg is N s^2 m^-1."""
    mass, length, _ = dimension_of_unit(unit)
    return int(length - mass)


def scaling_powers(energy: Energy) -> tuple[int, dict[str, int]]:
    """Powers of a factor of all lengths that an energy and its parameters get, where forces are scaled along with lengths.

    An energy is the same in every system of units. Of all factors of forces the one is taken that leaves the first parameter
    of a force alone: scaled with its lengths alone, a stiffness of N m^2 would soon be out of range.
    """
    forces = {p.label: int(dimension_of_unit(p.unit)[0]) for p in energy.parameters}
    powers = {p.label: length_power(p.unit) for p in energy.parameters}
    whole = int(dimension_of_unit(energy.unit)[0])
    first = next((name for name, force in forces.items() if abs(force) == 1), None)
    by = 0 if first is None else -powers[first] * forces[first]
    return length_power(energy.unit) + by * whole, {name: powers[name] + by * forces[name] for name in powers}


def unit_text(dimension: Dimension) -> str:
    """A dimension in base units."""
    named = [(name, power) for name, power in zip(("kg", "m", "s"), dimension, strict=True) if power]
    return " ".join(name if power == 1 else f"{name}^{power}" for name, power in named) or "1"


def _common(terms: Iterable[Expr], dimensions: list[Dimension]) -> Dimension:
    """The dimension that terms share; the number 0 has every one."""
    settled = [(term, found) for term, found in zip(terms, dimensions, strict=True) if not is_zero(term)]
    if not settled:
        return NUMBER
    (first, wanted), *rest = settled
    for term, found in rest:
        if found != wanted:
            raise DimensionError(
                f"{latex(first)} is in {unit_text(wanted)}, {latex(term)} in {unit_text(found)}: no sum of these"
            )
    return wanted


def _times(left: Dimension, right: Dimension, power: Any = 1) -> Dimension:
    return tuple(a + b * power for a, b in zip(left, right, strict=True))
