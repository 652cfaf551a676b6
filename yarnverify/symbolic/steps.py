"""Straight-line programs: named steps, and outputs over them; what nothing needs is dropped, what is common is shared."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import sympy as sp

Check: TypeAlias = tuple[Any, str, str]
_OUTPUT = re.compile(r"(g|h|F|dF)_")  # names of block entries; an expression shared with others is not called by them


@dataclass(frozen=True)
class Program:
    """Straight-line code for one shape of one energy: steps, and outputs over them.

    ``hessian`` holds the upper triangle, row by row. ``checks`` are scalars that must be positive where derivatives
    (or already the energy) are wanted, each with what it means when one is not. ``choice`` is positive where this shape is
    the right one; None where it always is. ``prologue`` are lines that come before the steps.
    """

    steps: Mapping[sp.Symbol, Any]
    energy: Any
    gradient: tuple[Any, ...]
    hessian: tuple[Any, ...]
    checks: tuple[tuple[Any, str, str], ...] = ()
    choice: Any = None
    prologue: tuple[str, ...] = ()
    name: str = "element"

    @property
    def outputs(self) -> list[Any]:
        """Everything that is returned, in order."""
        choice = [] if self.choice is None else [self.choice]
        return [self.energy, *self.gradient, *self.hessian, *(check[0] for check in self.checks), *choice]


def settled(
    steps: Mapping[sp.Symbol, Any],
    energy: Any,
    gradient: list[Any],
    hessian: list[Any],
    checks: list[Check],
    choice: Any,
    rewrite: Callable[[Any], Any] = lambda value: value,
) -> Program:
    """Drop steps that nothing needs, and share common subexpressions. ``rewrite`` is applied to every expression first."""
    choices = [] if choice is None else [choice]
    outputs = [energy, *gradient, *hessian, *(check[0] for check in checks), *choices]
    kept = needed(steps, outputs)
    roots = [rewrite(sp.sympify(value)) for value in (*kept.values(), *outputs)]
    shared, reduced = sp.cse(roots, symbols=(sp.Symbol(f"t{i}", real=True) for i in range(10**6)), order="canonical")
    everything, rest = _numbered(*_without_aliases(dict(shared), kept, reduced))
    g, h = 1 + len(gradient), 1 + len(gradient) + len(hessian)
    new_checks = tuple((v, c[1], c[2]) for v, c in zip(rest[h : h + len(checks)], checks, strict=True))
    return Program(everything, rest[0], tuple(rest[1:g]), tuple(rest[g:h]), new_checks, rest[-1] if choices else None)


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
    ordered = needed(steps, outputs)
    temporaries = [symbol for symbol in ordered if re.fullmatch(r"[st]\d+", str(symbol))]
    rename = {old: sp.Symbol(f"t{i}", real=True) for i, old in enumerate(temporaries)}
    clash = {symbol: sp.Dummy(str(symbol)) for symbol in rename}  # by way of dummies: old and new names overlap
    back = {clash[old]: new for old, new in rename.items()}

    def renamed(value: Any) -> Any:
        return value.xreplace(clash).xreplace(back)

    return {renamed(symbol): renamed(value) for symbol, value in ordered.items()}, [renamed(value) for value in outputs]


def needed(steps: Mapping[sp.Symbol, Any], outputs: Iterable[Any]) -> dict[sp.Symbol, Any]:
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
