"""What in an energy's formula another law may stand in place of: a strain, an angle, a length; found in its tree."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from yarnverify.accuracy.shape import shape_of
from yarnverify.check.cases import Cases
from yarnverify.symbolic.formulas import cos, sin, tan
from yarnverify.symbolic.functions import sides_of
from yarnverify.symbolic.tree import PI, Expr, rebuild

Parts = tuple[Expr, ...]


def _strain(node: Expr) -> Parts | None:
    """``l/r - 1``: l and r."""
    if node.op != "add" or len(node.args) != 2 or node.args[0].op != "frac":
        return None
    above, below = node.args[0].args
    return (above, below) if above.op == "norm" and node.args[1] == -_number(1) else None


def _elongation(node: Expr) -> Parts | None:
    """``l - r``: l and r."""
    if node.op != "add" or len(node.args) != 2 or node.args[0].op != "norm" or node.args[1].op != "neg":
        return None
    return node.args[0], node.args[1].args[0]


def _angle(node: Expr) -> Parts | None:
    """The angle between two edges: itself and these."""
    sides = sides_of(node)
    return None if sides is None else (node, *sides)


def _deviation(node: Expr) -> Parts | None:
    """An angle less pi/2: itself and the edges."""
    if node.op != "add" or len(node.args) != 2 or node.args[1] != -(PI / 2):
        return None
    found = _angle(node.args[0])
    return None if found is None else (node, *found[1:])


def _squared_angle(node: Expr) -> Parts | None:
    inner = _angle(node.args[0]) if node.op == "pow" and node.value == 2 else None
    return None if inner is None else inner[:1]


def _squared_overlap(node: Expr) -> Parts | None:
    """``(u_1 - u_0 - d)^2``: what is squared, the difference, d."""
    if node.op != "pow" or node.value != 2 or node.args[0].op != "add" or len(node.args[0].args) != 3:
        return None
    gap = node.args[0]
    if any((arg.args[0] if arg.op == "neg" else arg).op != "symbol" for arg in gap.args) or gap.args[2].op != "neg":
        return None
    return gap, Expr("add", gap.args[:2]), gap.args[2].args[0]


def _difference(node: Expr) -> Parts | None:
    """``u_1 - u_0``."""
    if node.op != "add" or len(node.args) != 2 or node.args[0].op != "symbol" or node.args[1].op != "neg":
        return None
    inner = node.args[1].args[0]
    return (node,) if inner.op == "symbol" and not (inner.name.bold or node.args[0].name.bold) else None


def _length(node: Expr) -> Parts | None:
    return (node,) if node.op == "norm" else None


_PARTS: dict[str, Callable[[Expr], Parts | None]] = {
    "strain": _strain,
    "elongation": _elongation,
    "angle": _angle,
    "squared angle": _squared_angle,
    "deviation": _deviation,
    "squared overlap": _squared_overlap,
    "spread": _difference,
    "difference": _difference,
    "length": _length,
}
_WHOLE = {"angle": ("deviation",), "spread": ("strain",)}  # measures that another one is part of, and left as they are


def replaced(expr: Expr, measure: str, formula: Callable[..., Expr]) -> Expr | None:
    """A tree with a formula of its parts for each occurrence of a measure; None where there is none."""
    whole = [_PARTS[name] for name in _WHOLE.get(measure, ())]

    def change(node: Expr) -> Expr | None:
        if any(parts(node) is not None for parts in whole):
            return node
        found = _PARTS[measure](node)
        return None if found is None else formula(*found)

    changed = rebuild(expr, change)
    return None if changed == expr else changed


def total_length(expr: Expr) -> Expr | None:
    """The sum of all lengths that occur; None where there are none."""
    found = list(dict.fromkeys(node for node in expr.walk() if node.op == "norm"))
    total: Any = None
    for length in found:
        total = length if total is None else total + length
    return total


def expressions(cases: Cases) -> dict[str, Expr]:
    """Trees of what a factor may be made of, by the names that ``factors.quantities`` gives them."""
    energy, shape = cases.energy, shape_of(cases.energy)
    found = {p.label: Expr("symbol", value=p.name) for p in energy.parameters if not p.name.bold}
    nodes = list(energy.expression.walk())
    edges = [
        (f"|{edge.head.label} - {edge.tail.label}|", Expr("symbol", value=edge.head) - Expr("symbol", value=edge.tail))
        for edge in shape.edges
    ]
    found |= {name: Expr("norm", (step,)) for name, step in edges}
    if len(edges) == 2:
        (one, _), (other, _) = edges
        found[f"({one} + {other})"] = found[one] + found[other]
    for a in shape.sliding:
        for b in shape.sliding:
            found[f"({a.label} - {b.label})"] = Expr("symbol", value=a) - Expr("symbol", value=b)
    angle = next((node for node in nodes if _angle(node)), None)
    if angle is not None:
        found |= {
            "angle": angle,
            "(pi - angle)": PI - angle,
            "sin(angle)": sin(angle),
            "cos(angle)": Expr("abs", (cos(angle),)),
            "|angle - pi/2|": Expr("abs", (angle - PI / 2,)),
            "sin(angle/2)": sin(angle / 2),
            "tan(angle/2)": tan(angle / 2),
            "cos(angle/2)": cos(angle / 2),
        }
        found |= {f"({name}/angle)": found[name] / angle for name in ("tan(angle/2)", "sin(angle/2)", "sin(angle)")}
    return found


def _number(value: int) -> Expr:
    return Expr("number", value=value)
