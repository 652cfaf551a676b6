"""Every single-term change of a printed chain, with its cost: what misprints usually are."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations

from yarnverify.symbolic.sections import Section, block_of
from yarnverify.symbolic.tree import ONE, PI, ZERO, Expr, Name, ShapeError, Type, number, rebuild

_NAME = 4  # cost of doubting a block's name, beyond any change of what it equals but a missing term


@dataclass(frozen=True)
class Candidate:
    cost: int
    change: str
    before: Expr
    after: Expr
    members: tuple[Expr, ...]

    @property
    def adds_sign(self) -> bool:
        """Whether a minus is put in, and none taken away: of two such changes the other one reads better."""
        return self.change == "sign" and self.after.op == "neg"


class Changes:
    """The changes of one chain.

    Parameters
    ----------
    section
        Whose symbols may be meant.
    names
        Unknowns and parameters that states hold.
    members
        The printed chain.
    fixed
        How many members at its beginning are not in doubt.
    """

    def __init__(self, section: Section, names: Sequence[Name], members: tuple[Expr, ...], fixed: int) -> None:
        self.section, self.names, self.members, self.fixed = section, names, members, fixed

    def candidates(self) -> Iterator[Candidate]:
        """All changes, in no order."""
        yield from self._renamings()
        for index, member in enumerate(self.members):
            if index < self.fixed:
                continue
            block = bool(block_named(member))  # what is printed of a block is doubted before the block's own name
            for cost, change, before, after, tree in self._changes(member):
                members = (*self.members[:index], tree, *self.members[index + 1 :])
                aside = (_NAME if change == "index" else 1) if block else 0
                yield Candidate(cost + aside, change, before, after, members)
            if index:
                yield Candidate(4, "zero", member, ZERO, (*self.members[:index], ZERO, *self.members[index + 1 :]))

    def _renamings(self) -> Iterator[Candidate]:
        """A symbol that nothing defines, read as one that the section knows, wherever the chain has it."""
        unknown = dict.fromkeys(name for member in self.members for name in self.section.undefined(member))
        for name in unknown:
            for other in self._vocabulary:
                before, after = (Expr("symbol", value=n) for n in (name, other))
                members = tuple(rebuild(member, partial(_renamed, name, other)) for member in self.members)
                yield Candidate(0, "undefined symbol", before, after, members)

    def _changes(self, tree: Expr) -> Iterator[tuple[int, str, Expr, Expr, Expr]]:
        for cost, change, before, after in self._here(tree):
            yield cost, change, before, after, after
        for index, arg in enumerate(tree.args):
            for cost, change, before, after, new in self._changes(arg):
                if new == ONE and (tree.op == "mul" or (tree.op == "frac" and index == 1)):
                    continue  # nobody prints a factor 1; that it is there at all is the change
                if tree.op == "transpose" and change == "transpose" and before is arg:
                    continue  # nor a transpose of a transpose
                first = tree.op == "add" and not index and change == "sign" and before is arg and arg.op != "neg"
                cost += int(first)  # a sign between two terms is lost more easily than one before them is
                args = (*tree.args[:index], new, *tree.args[index + 1 :])
                yield cost, change, before, after, replace(tree, args=args)

    def _here(self, node: Expr) -> Iterator[tuple[int, str, Expr, Expr]]:
        kind = self._type(node)
        if kind is None:
            return
        yield 1, "sign", node, _negated(node)
        yield from self._symbol_changes(node)
        if node.op == "transpose":
            yield 1, "transpose", node, node.args[0]
        elif kind is not Type.SCALAR and node.op not in {"neg", "identity"}:
            yield 1 if kind in (Type.VECTOR, Type.COVECTOR) else 3, "transpose", node, Expr("transpose", (node,))
        if node.op == "number":
            value = int(str(node.value))
            for other in sorted(
                {0, 1, 2, 3, 4, 6, 8, value - 1, value + 1} - {value}, key=lambda n: (abs(n - value), n)
            ):
                if other >= 0:
                    yield 1, "number", node, number(other)
        if node.op == "pow":
            assert isinstance(node.value, int)
            for other in (node.value - 1, node.value + 1, node.value + 2, node.value - 2, -node.value):
                after = node.args[0] if other == 1 else replace(node, value=other) if other else ONE
                yield 2, "power", node, after
        elif kind is Type.SCALAR and node.op not in {"number", "neg", "force", "energy", "derivative", "mul"}:
            for exponent in (2, 3):
                yield 2, "power", node, Expr("pow", (node,), exponent)
        if kind is Type.SCALAR and node.op == "add":
            yield 2, "missing norm", node, Expr("norm", (node,))
        if node.op == "call":
            for other_function in ("sin", "cos", "tan"):
                if other_function != node.value and node.value != "arccos":
                    yield 3, "function", node, replace(node, value=other_function)
        if node.op == "mul":
            for index in range(len(node.args)):
                rest = (*node.args[:index], *node.args[index + 1 :])
                if self._type(node.args[index]) in (Type.SCALAR, Type.MATRIX):
                    cost = 1 if _is_number(node.args[index]) else 3
                    yield cost, "extra factor", node, rest[0] if len(rest) == 1 else replace(node, args=rest)
            for index in range(len(node.args) - 1):
                swapped = (*node.args[:index], node.args[index + 1], node.args[index], *node.args[index + 2 :])
                yield 3, "order of factors", node, replace(node, args=swapped)
        if node.op == "frac":
            if kind is Type.SCALAR:
                yield 3, "fraction upside down", node, replace(node, args=node.args[::-1])
            yield 1 if _is_number(node.args[1]) else 3, "extra denominator", node, node.args[0]
        if node.op == "add":
            for index in range(len(node.args)):
                rest = (*node.args[:index], *node.args[index + 1 :])
                yield 4, "extra term", node, rest[0] if len(rest) == 1 else replace(node, args=rest)
            for term in self._terms:
                if term not in node.args and self._type(term) is kind:
                    yield 5, "missing term", node, replace(node, args=(*node.args, term))
        yield from self._factors(node, kind)

    def _symbol_changes(self, node: Expr) -> Iterator[tuple[int, str, Expr, Expr]]:
        if node.op not in {"symbol", "force", "derivative"}:
            return
        name = node.name
        if re.fullmatch(r"\d+", name.sub):
            definition = self.section.definition(name) if node.op == "symbol" else None
            for sub in self._indices:
                base = definition is not None and definition.index and sub == "0"  # l_0 and the like mean nothing
                if sub != name.sub and not base:
                    yield 1, "index", node, replace(node, value=name.with_sub(sub))
        if node.op == "symbol":
            kind = self.section.lookup(name)
            for other in self._vocabulary:
                if other != name and kind in (Type.UNKNOWN, self.section.lookup(other)) and other.bold == name.bold:
                    yield 3, "symbol", node, replace(node, value=other)

    def _factors(self, node: Expr, kind: Type) -> Iterator[tuple[int, str, Expr, Expr]]:
        """A factor too few: numbers, and the scalars and matrices that the section knows."""
        for value in (2, 3, 4) if node.op != "number" else ():
            yield 2, "missing factor", node, _times(number(value), node)
            yield 2, "missing factor", node, Expr("frac", (node, number(value)))
        if node.op in {"number", "neg", "force", "derivative", "energy"}:
            return
        for scalar in self._scalars:
            yield 4, "missing factor", node, _times(scalar, node)
            if node.op == "add":
                continue
            yield 5, "missing denominator", node, Expr("frac", (node, scalar))
        if node.op == "add":
            return
        for matrix in self._matrices if kind in (Type.VECTOR, Type.COVECTOR, Type.MATRIX) else ():
            before = _after(node, matrix) if kind is Type.COVECTOR else _times(matrix, node)
            yield 4, "missing factor", node, before
            if kind is Type.MATRIX:
                yield 4, "missing factor", node, _after(node, matrix)

    @cached_property
    def _terms(self) -> list[Expr]:
        """Terms that the section's other formulas have, also for another neighbour, with either sign."""
        found: dict[Expr, None] = {}
        for claim in self.section.claims:
            for node in claim.right.walk():
                for term in node.args if node.op == "add" else ():
                    plain = term.args[0] if term.op == "neg" else term
                    for tree in (
                        plain,
                        *(_swapped(plain, i, j) for i, j in combinations(self._indices, 2) if i != "0"),
                    ):
                        found.setdefault(tree)
                        found.setdefault(_negated(tree))
        return list(found)

    def _type(self, node: Expr) -> Type | None:
        try:
            return self.section.type_of(node)
        except ShapeError:
            return None

    @cached_property
    def _indices(self) -> list[str]:
        subs = {name.sub for name in self.names if re.fullmatch(r"\d+", name.sub)}
        return sorted(subs, key=int)

    @cached_property
    def _vocabulary(self) -> list[Name]:
        """Symbols that the section may speak of: parameters, unknowns, definitions at the section's indices."""
        names = [*self.section.parameters, *self.names]
        scopes = [self.section, self.section.shared] if self.section.shared else [self.section]
        for scope in scopes:
            for symbol, definition in scope.definitions.items():
                names += [symbol.with_sub(i) for i in self._indices if i != "0"] if definition.index else [symbol]
        return list(dict.fromkeys(names))

    @cached_property
    def _scalars(self) -> list[Expr]:
        found = [Expr("symbol", value=name) for name in self._vocabulary if self.section.lookup(name) is Type.SCALAR]
        angles = [s for s in found if self.section.meaning(s.name) is not None and _is_angle(self.section, s.name)]
        found += [Expr("call", (angle,), function) for angle in angles for function in ("sin", "cos")]
        return [*found, PI]

    @cached_property
    def _matrices(self) -> list[Expr]:
        return [Expr("symbol", value=name) for name in self._vocabulary if self.section.lookup(name) is Type.MATRIX]


def block_named(member: Expr) -> str:
    """Name of the block that a member is, up to sign, transpose and numbers; a symbol is none, it may itself be wrong."""
    inner = member
    while True:
        others = [arg for arg in inner.args if not _is_number(arg)]
        plain = inner.op in {"neg", "transpose", "mul"} or (inner.op == "frac" and _is_number(inner.args[1]))
        if not plain or len(others) != 1:
            break
        inner = others[0]
    return block_of(inner) if inner.op in {"force", "energy", "derivative"} else ""


def _is_angle(section: Section, name: Name) -> bool:
    meaning = section.meaning(name)
    return meaning is not None and any(node.op == "call" and node.value == "arccos" for node in meaning.walk())


def _renamed(old: Name, new: Name, node: Expr) -> Expr | None:
    """The node under another name, if it has the old one, as a symbol or as the unknown of a force or derivative."""
    if node.op in {"symbol", "force", "derivative"} and node.name == old and old.bold == new.bold:
        return replace(node, value=new, args=tuple(rebuild(arg, partial(_renamed, old, new)) for arg in node.args))
    return None


def _swapped(tree: Expr, i: str, j: str) -> Expr:
    """A tree with two indices exchanged."""
    other = {i: j, j: i}

    def change(node: Expr) -> Expr | None:
        if node.op == "symbol" and node.name.sub in other:
            return replace(node, value=node.name.with_sub(other[node.name.sub]))
        return None

    return rebuild(tree, change)


def _is_number(node: Expr) -> bool:
    return all(part.op in {"number", "frac"} for part in node.walk())


def _negated(node: Expr) -> Expr:
    return node.args[0] if node.op == "neg" else Expr("neg", (node,))


def _times(factor: Expr, node: Expr) -> Expr:
    return replace(node, args=(factor, *node.args)) if node.op == "mul" else Expr("mul", (factor, node))


def _after(node: Expr, factor: Expr) -> Expr:
    return replace(node, args=(*node.args, factor)) if node.op == "mul" else Expr("mul", (node, factor))
