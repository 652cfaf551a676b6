"""Reading 1 of an energy: normal forms of its true forces and Jacobians, and of what is printed of them."""

from __future__ import annotations

from functools import cached_property

from yarnverify.symbolic.normal import Field
from yarnverify.symbolic.polynomials import Quotient
from yarnverify.symbolic.reading import Value, map_value
from yarnverify.symbolic.tree import FORCE, Expr, paired


class Blocks:
    """Normal forms of one energy's blocks, over one field."""

    def __init__(self, field: Field, energy: Expr) -> None:
        self.field, self._tree = field, energy
        self._known: dict[Expr, Value] = {}

    @cached_property
    def energy(self) -> Value:
        return self.field.value(self._tree)

    def true(self, expr: Expr) -> Value:
        """True normal form of a force, an energy or a derivative."""
        if expr not in self._known:
            with self.field.claim(printed=False):
                self._known[expr] = self._find(expr)
        return self._known[expr]

    def _find(self, expr: Expr) -> Value:
        if expr.op == "energy":
            return self.energy
        if expr.op == "force":
            return map_value(self.field.gradient(self.energy, expr.name), lambda q: q * FORCE)
        inner = expr.args[0]
        of = self.true(inner) if inner.op in {"force", "energy"} else self.field.value(inner)
        return self.field.gradient(of, expr.name)

    def equal(self, left: Expr, right: Expr) -> bool:
        """Whether the normal forms of two trees are the same."""
        with self.field.claim():
            a, b = (flat(self.field.value(side, self.true)) for side in (left, right))
        return all((p - q).is_zero for p, q in paired(left, right, a, b))


def flat(value: Value) -> list[Quotient]:
    return [q for part in value for q in flat(part)] if isinstance(value, list) else [value]
