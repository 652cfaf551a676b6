"""What the sums of a law without angles may lose, and how many numbers its products are made of."""

from __future__ import annotations

import math
from collections.abc import Iterator

import sympy as sp

from yarnverify.symbolic.measures import differentiate, scalar_symbol
from yarnverify.symbolic.safe import Safe
from yarnverify.symbolic.tree import Expr, Name


def cancels(shape: Safe) -> bool:
    """Whether terms of both signs are added that are no plain numbers: digits of powers and products are lost there.

    Sums of lengths, sliding coordinates and parameters themselves are formed without loss. Second derivatives are left out:
    where one of them vanishes, the slope beside it in the same block does not.
    """
    positive = {measure.symbol for measure in shape.derivation.measures}
    declared = shape.derivation.section.declared
    positive |= {parameter.name for parameter in declared.parameters if parameter.positive} if declared else set()
    sums = [node for tree in (shape.law, *_slopes(shape)) for node in tree.walk() if node.op == "add"]
    return any(not all(map(_is_plain, node.args)) and _sign(node, positive) == 0 for node in sums)


def reach(shape: Safe) -> int:
    """The largest number of lengths, coordinates and parameters that are multiplied with each other."""
    keys = shape.derivation.measures
    bends = (shape.slopes["tree"](shape.slopes["dd"](key, other)) for key in keys for other in keys)
    return max(max(_degrees(tree)) for tree in (shape.law, *_slopes(shape), *bends))


def is_even(shape: Safe) -> bool:
    """Whether a law of one length holds of its square alone, with finite derivatives where it is zero."""
    length, law = scalar_symbol(shape.derivation.measures[0].symbol), shape.derivation.law
    if law.has(sp.Abs, sp.sign) or sp.expand(law.xreplace({length: -length}) - law) != 0:
        return False
    there = (value.subs(length, 0) for value in (law, differentiate(law, length, length)))
    return not any(value.has(sp.zoo, sp.oo, sp.nan) for value in there)


def _slopes(shape: Safe) -> Iterator[Expr]:
    """The derivatives of the law by its measures."""
    return (shape.slopes["tree"](shape.slopes["d"](key)) for key in shape.derivation.measures)


def _is_plain(term: Expr) -> bool:
    while term.op in ("neg", "mul", "frac"):
        if term.op == "frac" and term.args[1].op != "number":
            return False
        others = [arg for arg in term.args if arg.op != "number"]
        if len(others) != 1:
            return not others
        (term,) = others
    return term.op == "symbol"


def _sign(tree: Expr, positive: set[Name]) -> int:
    """1 or -1 where that is the sign whatever the numbers are, else 0; a number that is not negative counts as positive."""
    signs = [_sign(arg, positive) for arg in tree.args]
    match tree.op:
        case "number":
            return 1 if int(str(tree.value)) >= 0 else -1
        case "symbol":
            return int(tree.name in positive)
        case "pi" | "norm" | "abs" | "sqrt":
            return 1
        case "neg":
            return -signs[0]
        case "add":
            return signs[0] if len(set(signs)) == 1 else 0
        case "mul" | "frac":
            return math.prod(signs)
        case "pow":
            return 1 if int(str(tree.value)) % 2 == 0 else signs[0]
        case "call":
            return int(tree.value == "exp")
    return 0


def _degrees(tree: Expr) -> tuple[int, int]:
    """How many numbers are multiplied above and below the line."""
    parts = [_degrees(arg) for arg in tree.args]
    above, below = ([part[i] for part in parts] for i in (0, 1))
    match tree.op:
        case "symbol":
            return 1, 0
        case "mul":
            return sum(above), sum(below)
        case "frac":
            return above[0] + below[1], below[0] + above[1]
        case "pow":
            size = abs(int(str(tree.value)))
            found = above[0] * size, below[0] * size
            return found if int(str(tree.value)) > 0 else found[::-1]
        case "call":
            return 0, 0
    return max(above, default=0), max(below, default=0)
