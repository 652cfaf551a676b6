"""Which sides of its absolute values and roots a formula has been seen on, so that states can be chosen on all of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations
from typing import Any

from yarnverify.symbolic.algebraic import NoValueError, UndefinedError
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.forward import Evaluation
from yarnverify.symbolic.functions import unfolded
from yarnverify.symbolic.numbers import Floats
from yarnverify.symbolic.tree import Expr, Name, Type

Signature = tuple[int, ...]


def sided(section: Section, trees: Iterable[Expr]) -> list[Expr]:
    """Absolute values, square roots, arc cosines and logarithms in some trees, definitions followed.

    Which way these go depends on the sign of the argument, or on whether it is within [-1, 1]. Norms of vectors are no such.
    """
    found: dict[Expr, None] = {}
    seen: set[Name] = set()

    def visit(tree: Expr) -> None:
        for node in tree.walk():
            if node.op == "symbol" and node.name not in seen:
                seen.add(node.name)
                meaning = section.meaning(node.name)
                if meaning is not None:
                    visit(meaning)
            elif node.op == "call" and (plain := unfolded(node)) is not None:
                visit(plain)
            elif (
                node.op in {"abs", "sqrt"}
                or (node.op == "norm" and section.type_of(node.args[0]) is Type.SCALAR)
                or (node.op == "call" and node.value in ("arccos", "log"))
            ):
                found.setdefault(node)

    for tree in trees:
        visit(tree)
    return list(found)


def side_of(evaluation: Evaluation, node: Expr) -> int:
    """On which side the argument of an absolute value, root or arc cosine is: 1, -1, or 0 where it has no value."""
    try:
        value = evaluation.value(node.args[0])
    except NoValueError:
        return -1
    except UndefinedError:
        return 0
    if node.value == "arccos":
        value = 1 - value * value
    return _sign(value)


def lie_of(evaluation: Evaluation) -> Signature:
    """How points and scalars lie to each other, whatever the formula.

    Acute or obtuse corners at the first point, segments shorter or longer than the difference of their sliding
    coordinates, and the signs of all scalars.
    """
    return tuple(_lie(evaluation.section, evaluation.state))


def _lie(section: Section, state: Any) -> Iterator[int]:
    first, *others = [name for name in state if name.bold] or [None]
    edges = {n: [float(a - b) for a, b in zip(state[n], state[first], strict=True)] for n in others}
    for one, other in combinations(edges.values(), 2):
        yield _sign(sum(a * b for a, b in zip(one, other, strict=True)))
    scalars = {n: float(state[n]) for n in state if not n.bold}
    for name, edge in edges.items():
        length = sum(a * a for a in edge) ** 0.5
        for n, value in scalars.items():
            if section.is_unknown(n) and n.sub == name.sub:
                start = scalars.get(n.with_sub("0"), 0.0)
                yield _sign(length - abs(value - start))
    for value in scalars.values():
        yield _sign(value)


def _sign(value: Any) -> int:
    return (value > 0) - (value < 0)


def in_floats(evaluation: Evaluation) -> Evaluation:
    """The same state in double precision: enough to choose states by."""
    return Evaluation(evaluation.section, evaluation.state, Floats(), evaluation.energy)
