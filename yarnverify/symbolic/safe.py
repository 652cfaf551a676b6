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
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

from yarnverify.symbolic.corner import Corner
from yarnverify.symbolic.court import Court, Finding
from yarnverify.symbolic.derive import _NOWHERE, Derivation, _minus_sum
from yarnverify.symbolic.document import Definition, Section, block_of
from yarnverify.symbolic.measures import Measure
from yarnverify.symbolic.tree import FORCE, IDENTITY, ZERO, Expr, Name

Shape = Literal["smooth", "polar"]


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
