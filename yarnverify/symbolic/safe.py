r"""Gradient and Hessian without 0/0: the blocks of ``derive`` rearranged, each proved like those.

For a corner, two edges from one point with lengths la, lb and directions a, b, let C = a.b, m = a x b, s = |m|. Its angle
phi enters the law either as phi or as theta = pi - phi. Two shapes of the same derivatives:

``smooth``  for laws that are analytic where theta = 0 (or phi = 0), by derivatives in C, up to where s is small:
            dC/da-end = m x a/la,  dC/db-end = b x m/lb,  dC/do = c = v x m,
            aa: (V_pp P_a - V_CC m m^T - V_C (q_a a^T + a q_a^T))/la^2,   ab: (V_CC q_a q_b^T + V_C P_a P_b)/(la lb),
            of C itself  oa: (b.v)/la I + w (dC/da)^T - (c + C v) a^T/la,   oo: (k.v) I + c w^T + w c^T + C v v^T.
``polar``   wherever s > 0, by derivatives in phi, with n = m/s, t_a = n x a, t_b = b x n, r = n x v.

Rows of the common point o directly, with the third edge, since translation cancels digits where a yarn is folded onto
itself:     v = a/la - b/lb,  w = a/la + b/lb,  k = (end_a - end_b)/(la lb).
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import sympy as sp

from yarnverify.symbolic.angles import sine_of, theta_itself, theta_over_sine, theta_squared
from yarnverify.symbolic.court import Court, Finding
from yarnverify.symbolic.declare import length
from yarnverify.symbolic.derive import _NOWHERE, Derivation, _minus_sum
from yarnverify.symbolic.document import Definition, Section, block_of
from yarnverify.symbolic.measures import Measure, NoMeasuresError, Segment, differentiate, scalar_symbol
from yarnverify.symbolic.scalars import scalar_tree
from yarnverify.symbolic.tree import FORCE, IDENTITY, PI, ZERO, Expr, Name, number

_ATOMS = ("C", "S", "s", "A", "f", "g", "versine", "vercosine", "half", "psi")  # scalars of a corner
Shape = Literal["smooth", "polar"]


@dataclass(frozen=True)
class Corner:
    """An angle between two segments that share a point. ``sign`` is that of cos(angle) = sign a.b."""

    symbol: Name
    a: Segment
    b: Segment
    sign: int

    def name(self, base: str, bold: bool = False) -> Name:
        return Name(base, str(self.symbol), bold)

    def at(self, point: Name) -> str:
        return {self.a.tail: "o", self.a.head: "a", self.b.head: "b"}.get(point, "")


def corner_of(measure: Measure) -> Corner:
    """The corner of an angle measure, both segments seen from their common point."""
    assert measure.b is not None
    a, b, sign = measure.a, measure.b, measure.sign
    shared = {a.tail, a.head} & {b.tail, b.head}
    if len(shared) != 1:
        raise NoMeasuresError
    (origin,) = shared
    if a.tail != origin:
        a, sign = Segment(a.head, a.tail), -sign
    if b.tail != origin:
        b, sign = Segment(b.head, b.tail), -sign
    return Corner(measure.symbol, a, b, sign)


@dataclass(frozen=True)
class Safe:
    """A derivation in one shape.

    Attributes
    ----------
    derivation
        Where it comes from.
    shape
        Of the corner; ``smooth`` too where there is none.
    section
        Meanings of the symbols in the blocks, for proofs.
    law
        The energy in atoms that are computed without loss.
    given
        Atoms that come from ``kernels.geometry`` instead of from their definitions.
    """

    derivation: Derivation
    shape: Shape
    corner: Corner | None
    centred: bool
    section: Section
    law: Expr
    given: frozenset[Name]
    slopes: dict[str, Any] = field(default_factory=dict)

    @property
    def lengths(self) -> tuple[Measure, ...]:
        return tuple(m for m in self.derivation.measures if m.b is None)

    def define(self, name: Name, meaning: Expr) -> Expr:
        self.section.definitions[name] = Definition(name, meaning, _NOWHERE)
        return Expr("symbol", value=name)

    # -- blocks

    def slope(self, key: Measure | Corner, point: Name) -> Expr | None:
        """Derivative of a measure by a point; for a smooth corner that of its cosine."""
        if isinstance(key, Measure):
            end = key.a.end(point)
            return None if end == 0 else key.a.d if end > 0 else -key.a.d
        at = key.at(point)
        return None if not at else self._vectors[f"slope_{at}"]

    @cached_property
    def _vectors(self) -> dict[str, Expr]:
        """The vectors of the corner, each a named definition."""
        k = self.corner
        if k is None:
            return {}
        c, d = k.a, k.b

        def vector(base: str, meaning: Expr) -> Expr:
            return self.define(k.name(base, bold=True), meaning)

        def cross(a: Expr, b: Expr) -> Expr:
            return Expr("cross", (a, b))

        v, end = (Expr("symbol", value=k.name(base, bold=True)) for base in ("v", "k"))
        found: dict[str, Expr] = {"v": v, "k": end, "w": vector("w", c.d / c.l + d.d / d.l)}
        if self.shape == "smooth":
            m = found["m"] = Expr("symbol", value=k.name("m", bold=True))
            found["q_a"], found["q_b"] = vector("q1", cross(m, c.d)), vector("q2", cross(d.d, m))
            found["slope_a"] = vector("c1", found["q_a"] / c.l)
            found["slope_b"] = vector("c2", found["q_b"] / d.l)
            found["slope_o"] = vector("c0", cross(v, m))
            return found
        n = found["n"] = Expr("symbol", value=k.name("n", bold=True))
        found["t_a"], found["t_b"] = vector("t1", cross(n, c.d)), vector("t2", cross(d.d, n))
        found["r"], found["p"] = vector("r", cross(n, v)), vector("p", cross(n, found["w"]))
        found["slope_a"], found["slope_b"] = -(found["t_a"] / c.l), -(found["t_b"] / d.l)
        found["slope_o"] = found["r"]
        return found

    def _bend(self, row: Name, column: Name) -> list[Expr]:
        """Terms of a Hessian block that a single measure contributes."""
        terms: list[Expr] = []
        for measure in self.lengths:
            ends = measure.a.end(row) * measure.a.end(column)
            if ends:
                dd, tension = self._scalar("dd", measure, measure), self._scalar("d", measure)
                block = dd * measure.a.d * measure.a.d.T + tension / measure.a.l * measure.a.P
                terms.append(block if ends > 0 else -block)
        if self.corner is not None:
            at = self.corner.at(row), self.corner.at(column)
            if all(at):
                terms.append(self._corner_block(*at))
        return terms

    def _corner_block(self, row: str, column: str) -> Expr:
        if (row, column) in {("a", "o"), ("b", "o"), ("b", "a")}:
            return Expr("transpose", (self._corner_block(column, row),))
        return self._smooth_block(row, column) if self.shape == "smooth" else self._polar_block(row, column)

    def _smooth_block(self, row: str, column: str) -> Expr:
        k, x = self.corner, self._vectors
        assert k is not None
        d1, d2, d3 = (self._scalar(what, k) for what in ("d", "dd", "turn"))
        cosine, c0, v = Expr("symbol", value=k.name("C")), x["slope_o"], x["v"]
        if row == column == "o":
            y = self.define(k.name("y0", bold=True), d1 * x["w"] + d2 / 2 * c0)
            z = self.define(k.name("z0", bold=True), d1 * cosine * v)
            return d1 * (x["k"].T * v) * IDENTITY + c0 * y.T + y * c0.T + z * v.T
        if row == "o":
            s, turned = (k.a, v) if column == "a" else (k.b, -v)
            other = k.b.d if column == "a" else k.a.d
            which = "4" if column == "a" else "5"
            y = self.define(k.name("y4", bold=True), d1 * x["w"] + d2 * c0)
            share = self.define(k.name("e" + which), d1 / s.l)
            z = self.define(k.name("z" + which, bold=True), share * (c0 + cosine * turned))
            return share * (other.T * turned) * IDENTITY + y * x[f"slope_{column}"].T - z * s.d.T
        if row == column:
            s, q = (k.a, x["q_a"]) if row == "a" else (k.b, x["q_b"])
            which = "1" if row == "a" else "2"
            # V_pp P - V_C (q d^T + d q^T) = V_pp I - (d y^T + y d^T) with y = V_C q + V_pp d / 2
            y = self.define(k.name("y" + which, bold=True), (d1 * q + d3 / 2 * s.d) / s.l**2)
            z = self.define(k.name("z" + which, bold=True), d2 / s.l**2 * x["m"])
            return d3 / s.l**2 * IDENTITY - (s.d * y.T + y * s.d.T) - z * x["m"].T
        scale = self.define(k.name("e"), d1 / (k.a.l * k.b.l))
        # P_a P_b = P_a - q_a b^T
        z = self.define(k.name("z3", bold=True), d2 / (k.a.l * k.b.l) * x["q_b"] - scale * k.b.d)
        along = self.define(k.name("y3", bold=True), scale * k.a.d)
        return scale * IDENTITY - along * k.a.d.T + x["q_a"] * z.T

    def _polar_block(self, row: str, column: str) -> Expr:
        k, x = self.corner, self._vectors
        assert k is not None
        d1, d2 = self._scalar("d", k), self._scalar("dd", k)
        n, r, sine = x["n"], x["r"], Expr("symbol", value=k.name("s"))
        cosine = Expr("symbol", value=k.name("C"))

        def lifted(which: str, coefficient: Expr) -> Expr:
            return self.define(k.name("n" + which, bold=True), coefficient * n) * n.T

        along_a = self.define(k.name("ka"), k.a.d.T * x["k"])
        along_b = self.define(k.name("kb"), k.b.d.T * x["k"])
        if (row, column) == ("a", "b"):
            return d2 / (k.a.l * k.b.l) * x["t_a"] * x["t_b"].T - lifted("3", d1 / (sine * k.a.l * k.b.l))
        if row == column and row in "ab":
            s, t = (k.a, x["t_a"]) if row == "a" else (k.b, x["t_b"])
            which = "1" if row == "a" else "2"
            y = self.define(k.name("y" + which, bold=True), (d1 * s.d + d2 / 2 * t) / s.l**2)
            return t * y.T + y * t.T + lifted(which, d1 * cosine / (sine * s.l**2))
        if row == column:
            y = self.define(k.name("y0", bold=True), d2 / 2 * r + d1 / 2 * x["w"])
            z = self.define(k.name("z0", bold=True), d1 / 2 * x["v"])
            inside = along_a * along_b / sine - sine / (k.a.l * k.b.l)
            return r * y.T + y * r.T + x["p"] * z.T + z * x["p"].T + lifted("0", d1 * inside)
        s, t, along = (k.a, x["t_a"], along_a) if column == "a" else (k.b, x["t_b"], along_b)
        which = "4" if column == "a" else "5"
        share = d1 / s.l**2
        y = self.define(k.name("y" + which, bold=True), d2 / s.l * r + share * s.d)
        z = self.define(k.name("z" + which, bold=True), share * t)
        raised = d1 * along / (sine * s.l)
        return -(y * t.T) - z * s.d.T + lifted(which, raised if column == "a" else -raised)

    def _scalar(self, what: str, *keys: Measure | Corner) -> Expr:
        """A named derivative of the law."""
        label = "".join("_" + ("angle" if isinstance(key, Corner) else key.a.sub) for key in keys)
        if what == "turn":
            label += "_turn"
        name = Name("dV" if what == "d" else "ddV", label.strip("_"))
        if name not in self.section.definitions:
            self.define(name, self.slopes["tree"](self.slopes[what](*keys)))
        return Expr("symbol", value=name)

    def gradient(self, unknown: Name, scale: int) -> Expr:
        """Gradient block, times ``scale``."""
        if not unknown.bold:
            return self._signed(self.slopes["tree"](self.slopes["u"](unknown)), scale)
        terms = []
        for key in self._keys:
            slope = self.slope(key, unknown)
            if slope is not None:
                if self._is_hub(unknown):
                    others = [n for n in self.derivation.unknowns if n.bold and n != unknown]
                    return _minus_sum([Expr("force", value=n) for n in others])
                terms.append(self._scalar("d", key) * slope)
        return self._signed(_sum(terms), scale)

    def hessian(self, row: Name, column: Name, scale: int) -> Expr:
        """Hessian block, times ``scale``; rows belong to ``row``."""
        if not row.bold and not column.bold:
            return self._signed(self.slopes["tree"](self.slopes["uu"](row, column)), scale)
        for point in (row, column):
            if self._is_hub(point):
                pairs = [
                    (o, column) if row == point else (row, o) for o in self.derivation.unknowns if o.bold and o != point
                ]
                return _minus_sum([Expr("derivative", (Expr("force", value=r),), c) for r, c in pairs])
        if not (row.bold and column.bold):
            point, sliding = (row, column) if row.bold else (column, row)
            terms = [
                self.slopes["tree"](self.slopes["du"](key, sliding)) * slope
                for key in self._keys
                if (slope := self.slope(key, point)) is not None
            ]
            found = _sum(terms)
            return self._signed(found if row.bold or found == ZERO else found.T, scale)
        terms = self._bend(row, column)
        for key in self._keys:
            for other in self._keys:
                left, right = self.slope(key, row), self.slope(other, column)
                if key != other and left is not None and right is not None:
                    terms.append(self._scalar("dd", key, other) * left * right.T)
        return self._signed(_sum(terms), scale)

    @property
    def _keys(self) -> tuple[Measure | Corner, ...]:
        return (*self.lengths, *((self.corner,) if self.corner is not None else ()))

    def _is_hub(self, point: Name) -> bool:
        """Whether translation may give the rows of a point: never at a corner, where that cancels digits."""
        return self.corner is None and self.derivation._is_hub(point)

    @staticmethod
    def _signed(block: Expr, scale: int) -> Expr:
        return block if scale > 0 or block == ZERO else -block

    def blocks(self, scale: int) -> Iterable[tuple[tuple[Expr, Expr], list[tuple[Expr, Expr]]]]:
        """For each unknown its gradient block and its Hessian blocks, each times ``scale``, as (name, tree)."""
        for row in self.derivation.unknowns:
            force = Expr("force", value=row)
            rest = [
                (Expr("derivative", (force,), column), self.hessian(row, column, scale))
                for column in self.derivation.unknowns
            ]
            yield (force, self.gradient(row, scale)), rest

    @property
    def has_pole(self) -> bool:
        """Whether the law is infinite at a fold, as the tangent of half the angle is."""
        if self.corner is None:
            return False
        half, vercosine = self.corner.name("half"), self.corner.name("vercosine")
        below = (part for node in self.law.walk() if node.op == "frac" for part in node.args[1].walk())
        return any(node.op == "symbol" and node.name == half for node in self.law.walk()) or any(
            node.op == "symbol" and node.name == vercosine for node in below
        )

    def check(self) -> dict[str, Finding]:
        """Proof of the law and of every block."""
        blocks = list(self.blocks(FORCE))
        court = Court(self.section, self.derivation.energy)
        found = {"V": court.judge(self.derivation.energy, self.law)}
        for force, jacobian in blocks:
            for block, tree in (force, *jacobian):
                found[block_of(block)] = court.judge(block, tree)
        return found


def _sum(terms: list[Expr]) -> Expr:
    return ZERO if not terms else terms[0] if len(terms) == 1 else Expr("add", tuple(terms))


# -- laws -------------------------------------------------------------------------------------------------------------


def safe_shapes(derivation: Derivation) -> list[Safe]:
    """The shapes that an energy needs, the one for the regular states first; one or two.

    Raises
    ------
    NoMeasuresError
        Where the law has more than one angle, an angle between segments without a common point, or functions of an angle
        other than powers, sine, cosine and the tangent of its half.
    """
    angles = [m for m in derivation.measures if m.b is not None]
    if len(angles) > 1:
        raise NoMeasuresError
    if not angles:
        return [_shape(derivation, None, "smooth")]
    corner = corner_of(angles[0])
    found = []
    with suppress(NoMeasuresError):
        found.append(_shape(derivation, corner, "smooth"))
    return [*found, _shape(derivation, corner, "polar")]


def _shape(derivation: Derivation, corner: Corner | None, shape: Shape) -> Safe:
    section = _section(derivation, corner)
    given = {name for m in derivation.measures if m.b is None for name in (m.a.l.name, m.a.d.name)}
    if corner is None:
        variables: dict[Any, Any] = {m: scalar_symbol(m.symbol) for m in derivation.measures}
        safe = Safe(derivation, shape, None, False, section, scalar_tree(sp.factor(derivation.law)), frozenset(given))
        _differentials(safe, derivation.law, variables, lambda value: value)
        return safe
    given |= {s.l.name for s in (corner.a, corner.b)} | {s.d.name for s in (corner.a, corner.b)}
    given |= {corner.name(base) for base in _ATOMS} | {corner.symbol}
    given |= {corner.name(base, bold=True) for base in ("m", "n", "v", "k")}
    theta = scalar_symbol(corner.symbol)
    atoms = {base: scalar_symbol(corner.name(base)) for base in _ATOMS}
    variables = {m: scalar_symbol(m.symbol) for m in derivation.measures if m.b is None}
    c = sp.Symbol("cosine", real=True)
    whole = {1 - c: atoms["versine"], c - 1: -atoms["versine"], 1 + c: atoms["vercosine"]}  # none of them cancels

    def factored(value: Any) -> Any:
        value = sp.factor(value).replace(lambda e: e in whole, lambda e: whole[e])
        return value.subs(c, corner.sign * atoms["C"])

    if shape == "smooth":
        law = _in_cosine(derivation.law, theta, c)

        def settled(value: Any) -> Any:
            value = value.subs(theta_squared(c), atoms["A"])
            value = value.subs({theta_over_sine(c): atoms["f"]})
            value = value.replace(lambda e: e.is_Function and e.func.__name__ == "sine_excess", lambda e: atoms["g"])
            return factored(value)

        second = _in_cosine(sp.diff(derivation.law, theta, 2), theta, c)
        safe = Safe(derivation, shape, corner, False, section, scalar_tree(settled(law)), frozenset(given))
        _differentials(safe, law, variables | {corner: c}, settled, corner.sign, second)
        return safe
    turned = sp.expand(derivation.law.subs(theta, atoms["psi"] + sp.pi / 2))
    centred = not turned.has(sp.pi) and not turned.has(sp.sin, sp.cos, sp.tan)
    law, variable = (turned, atoms["psi"]) if centred else (derivation.law, theta)

    def plain(value: Any) -> Any:
        value = value.subs(sp.tan(theta / 2), atoms["half"])
        value = value.subs(sp.cos(theta), c).subs(sp.sin(theta) ** 2, 1 - c**2).subs(sp.sin(theta), atoms["s"])
        if value.has(sp.sin, sp.cos, sp.tan):
            raise NoMeasuresError
        return factored(value)

    safe = Safe(derivation, shape, corner, centred, section, scalar_tree(plain(law)), frozenset(given))
    _differentials(safe, law, variables | {corner: variable}, plain, corner.sign)
    return safe


def _differentials(
    safe: Safe, law: Any, variables: dict[Any, Any], settled: Any, sign: int = 1, turn: Any = None
) -> None:
    """The derivatives of the law that blocks are made of; those by the angle of a corner are by the angle of its edges."""

    def by(value: Any, *keys: Any) -> Any:
        for key in keys:
            if isinstance(key, Name):
                value = differentiate(value, scalar_symbol(key))
            else:
                value = differentiate(value, variables[key]) * (sign if isinstance(key, Corner) else 1)
        return settled(sp.factor(value))

    safe.slopes.update(
        tree=scalar_tree,
        d=lambda key: by(law, key),
        dd=lambda key, other=None: by(law, key, other or key),
        turn=lambda key: settled(turn),
        u=lambda name: by(law, name),
        uu=lambda row, column: by(law, row, column),
        du=lambda key, name: by(law, key, name),
    )
    for key in variables:  # whatever the law has no safe form for shows here
        safe.slopes["tree"](safe.slopes["d"](key))
        safe.slopes["tree"](safe.slopes["dd"](key))


def _in_cosine(law: Any, theta: Any, c: Any) -> Any:
    """A law of an angle as an analytic function of its cosine.

    Raises
    ------
    NoMeasuresError
        Where it is none: an odd power of the angle or of its sine is left.
    """
    sine, half_sine, half_cosine = sine_of(c), sp.Symbol("half_sine"), sp.Symbol("half_cosine")
    value = law.subs(sp.tan(theta / 2), half_sine / half_cosine)
    value = value.subs({sp.sin(theta / 2): half_sine, sp.cos(theta / 2): half_cosine})
    value = value.subs({sp.tan(theta): sine / c, sp.sin(theta): sine, sp.cos(theta): c})
    value = value.replace(
        lambda e: e.is_Pow and e.base == theta and e.exp.is_Integer,
        lambda e: theta_squared(c) ** (e.exp // 2) * theta_itself(c) ** (e.exp % 2),
    ).subs(theta, theta_itself(c))
    squares = {
        sine: (1 - c) * (1 + c),
        half_sine: (1 - c) / 2,
        half_cosine: (1 + c) / 2,
        theta_itself(c): theta_squared(c),
    }
    for root, square in squares.items():
        value = value.replace(
            lambda e, root=root: e.is_Pow and e.base == root and e.exp.is_Integer,
            lambda e, root=root, square=square: square ** (e.exp // 2) * root ** (e.exp % 2),
        )
    if value.has(*squares) or value.has(sp.sin, sp.cos, sp.tan):
        raise NoMeasuresError
    return sp.factor(value)


def _section(derivation: Derivation, corner: Corner | None) -> Section:
    """A copy of the derivation's section in which the atoms of a corner have their meanings."""
    old = derivation.section
    section = Section(old.title, old.offset, parameters=old.parameters, unknowns=old.unknowns, declared=old.declared)
    section.families |= old.families
    section.assumptions = list(old.assumptions)
    section.definitions.update(old.definitions)
    if corner is None:
        return section
    for segment in (corner.a, corner.b):
        meanings = {
            segment.l: length(segment.vector),
            segment.d: segment.vector / segment.l,
            segment.P: IDENTITY - segment.d * segment.d.T,
        }
        for symbol, meaning in meanings.items():
            section.definitions.setdefault(symbol.name, Definition(symbol.name, meaning, _NOWHERE))
    a, b = corner.a, corner.b
    theta = Expr("symbol", value=corner.symbol)
    sine, cosine = Expr("call", (theta,), "sin"), Expr("call", (theta,), "cos")
    m = Expr("symbol", value=corner.name("m", bold=True))
    ends = Expr("symbol", value=a.head) - Expr("symbol", value=b.head)
    for base, meaning in {
        "C": a.d.T * b.d,
        "s": sine,
        "S": sine**2,
        "A": theta**2,
        "f": theta / sine,
        "g": (sine - theta * cosine) / sine**3,
        "versine": number(1) - cosine,
        "vercosine": number(1) + cosine,
        "half": Expr("call", (theta / 2,), "tan"),
        "psi": theta - PI / 2,
    }.items():
        section.definitions[corner.name(base)] = Definition(corner.name(base), meaning, _NOWHERE)
    for base, meaning in {
        "m": Expr("cross", (a.d, b.d)),
        "n": m / sine,
        "v": a.d / a.l - b.d / b.l,
        "k": ends / (a.l * b.l),
    }.items():
        name = corner.name(base, bold=True)
        section.definitions[name] = Definition(name, meaning, _NOWHERE)
    return section
