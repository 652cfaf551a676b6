"""A section of a document: what its symbols mean, which shape they have, and what it claims."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace

from yarnverify.symbolic.declare import Assumption, Energy
from yarnverify.symbolic.latex import name_latex
from yarnverify.symbolic.reader import Relation
from yarnverify.symbolic.tree import Expr, Name, ShapeError, Type, rebuild, type_of

_DEEPEST = 50  # definitions inside definitions
INDEX = re.compile(r"(?:\d+|[a-z]|[a-z][+-]\d+)\Z")


@dataclass(frozen=True)
class Definition:
    """``symbol = expression``; with a running index, ``index`` is its letter and the definition holds for every value."""

    symbol: Name
    expression: Expr
    relation: Relation
    index: str = ""


@dataclass(frozen=True)
class Claim:
    """``left = right``, to be proved or refuted; ``member`` is the place of ``left`` in its chain."""

    block: str
    left: Expr
    right: Expr
    relation: Relation
    member: int


@dataclass
class Section:
    """A section with everything that holds in it, shared definitions included."""

    title: str
    offset: int
    shared: Section | None = None
    definitions: dict[Name, Definition] = field(default_factory=dict)
    assumptions: list[Assumption] = field(default_factory=list)
    energy: Definition | None = None
    claims: list[Claim] = field(default_factory=list)
    parameters: tuple[Name, ...] = ()
    unknowns: tuple[Name, ...] = ()
    declared: Energy | None = None
    stand_ins: dict[Name, Expr | None] = field(default_factory=dict)
    _meanings: dict[Name, Expr | None] = field(default_factory=dict, repr=False, compare=False)
    _shapes: dict[Name, Type] = field(default_factory=dict, repr=False, compare=False)
    families: set[tuple[str, bool]] = field(default_factory=lambda: {("x", True), ("u", False), ("v", False)})

    def definition(self, name: Name) -> Definition | None:
        """The definition behind a symbol: its own, or that of its family with a running index."""
        found = self.definitions.get(name)
        if found is None and INDEX.match(name.sub):
            for candidate in self.definitions.values():
                symbol = candidate.symbol
                if candidate.index and (symbol.base, symbol.bold) == (name.base, name.bold):
                    return candidate
        if found is None and self.shared is not None:
            return self.shared.definition(name)
        return found

    def meaning(self, name: Name) -> Expr | None:
        """The tree that a defined symbol stands for, its running index filled in; None where nothing defines it."""
        if name not in self._meanings:
            self._meanings[name] = self._meaning(name)
        return self._meanings[name]

    def forget(self) -> None:
        """To be called when definitions, parameters or families have changed: what was looked up may be out of date."""
        self._meanings.clear()
        self._shapes.clear()

    def _meaning(self, name: Name) -> Expr | None:
        found = self.definition(name)
        if found is None:
            return None
        expression = self._expression(found)
        if not found.index or name.sub == found.index:
            return expression
        return instantiate(expression, found.index, name.sub)

    def _expression(self, definition: Definition) -> Expr:
        """What a definition says, or what stands in for it."""
        for section in (self, self.shared):
            if section is not None and section.definitions.get(definition.symbol) is definition:
                return section.stand_ins.get(definition.symbol) or definition.expression
        return definition.expression

    def is_unknown(self, name: Name) -> bool:
        """Whether a symbol is a degree of freedom: x_1, u_0, v_3 and families like them, or one that forces are printed for."""
        family = (name.base, name.bold) in self.families and bool(INDEX.match(name.sub))
        return family or name in self.unknowns

    def _enter(self, name: Name, inside: tuple[Name, ...], at: Expr) -> tuple[Name, ...]:
        """The definitions being followed, with one more; a circle, also through shifted indices, is an error."""
        if name in inside or len(inside) > _DEEPEST:
            raise ShapeError(at, f"{name_latex(name)} is defined by itself")
        return (*inside, name)

    def definitions_used(self, expr: Expr) -> set[Name]:
        """Symbols of the definitions that a tree uses, directly or through others."""
        found: set[Name] = set()
        for node in expr.walk():
            definition = self.definition(node.name) if node.op == "symbol" else None
            if definition is not None and definition.symbol not in found:
                found |= {definition.symbol} | self.definitions_used(definition.expression)
        return found

    def undefined(self, expr: Expr, follow: bool = True) -> list[Name]:
        """Symbols under a tree that nothing defines, in printed order; through definitions too, unless told not to."""
        found: dict[Name, None] = {}
        seen: set[Name] = set()

        def visit(node: Expr, inside: tuple[Name, ...] = ()) -> None:
            for part in node.walk():
                if part.op in {"derivative", "force"} and not self.is_unknown(part.name):
                    found.setdefault(part.name)
                if part.op != "symbol" or part.name in seen:
                    continue
                seen.add(part.name)
                meaning = self.meaning(part.name)
                if meaning is not None:
                    if follow:
                        visit(meaning, self._enter(part.name, inside, part))
                elif not self.is_unknown(part.name) and part.name not in self.parameters:
                    found.setdefault(part.name)

        visit(expr)
        return list(found)

    def lookup(self, name: Name, inside: tuple[Name, ...] = ()) -> Type:
        """Shape of a symbol."""
        if name not in self._shapes:
            self._shapes[name] = self._shape(name, inside)
        return self._shapes[name]

    def _shape(self, name: Name, inside: tuple[Name, ...]) -> Type:
        meaning = self.meaning(name)
        if meaning is not None:
            followed = self._enter(name, inside, meaning)
            return type_of(meaning, lambda inner: self.lookup(inner, followed))
        if self.is_unknown(name):
            return Type.VECTOR if name.bold else Type.SCALAR
        if name in self.parameters:
            return Type.VECTOR if name.bold else Type.SCALAR
        return Type.UNKNOWN

    def type_of(self, expr: Expr) -> Type:
        return type_of(expr, self.lookup)

    def expand(self, expr: Expr, inside: tuple[Name, ...] = ()) -> Expr:
        """A tree with every defined symbol replaced by what it stands for."""

        def change(node: Expr) -> Expr | None:
            meaning = self.meaning(node.name) if node.op == "symbol" else None
            return None if meaning is None else self.expand(meaning, self._enter(node.name, inside, node))

        return rebuild(expr, change)

    def base_symbols(self, expr: Expr) -> list[Name]:
        """Unknowns, parameters and undefined symbols under a tree, in order of appearance."""
        named = {"symbol", "force", "derivative"}
        return list(dict.fromkeys(node.name for node in self.expand(expr).walk() if node.op in named))


def instantiate(expr: Expr, letter: str, value: str) -> Expr:
    """A tree with the running index ``letter`` set to ``value``; ``i+1`` is counted up where the value is a number."""

    def sub(name: Name) -> Name:
        if name.sub == letter:
            return name.with_sub(value)
        if re.fullmatch(rf"{letter}[+-]\d+", name.sub):
            shift = int(name.sub[1:])
            return name.with_sub(str(int(value) + shift) if value.isdigit() else value + name.sub[1:])
        return name

    def change(node: Expr) -> Expr | None:
        if node.op in {"symbol", "force", "derivative"}:
            args = tuple(rebuild(arg, change) for arg in node.args)
            return replace(node, value=sub(node.name), args=args)
        return None

    return rebuild(expr, change)


def block_of(expr: Expr) -> str:
    """Name of the block that a member of a chain is, such as ``dF_x1/dx0``; empty where it is not one."""
    while expr.op == "neg":
        expr = expr.args[0]
    match expr.op:
        case "force":
            return f"F_{expr.name.label}"
        case "energy":
            return "V"
        case "symbol":
            return str(expr.name)
        case "derivative":
            return f"d{block_of(expr.args[0])}/d{expr.name.label}"
    return ""
