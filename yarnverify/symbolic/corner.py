"""The corner of an angle measure, and a section in which its scalars and vectors have names and meanings."""

from __future__ import annotations

from dataclasses import dataclass

from yarnverify.symbolic.declare import length
from yarnverify.symbolic.derive import _NOWHERE, Derivation
from yarnverify.symbolic.document import Definition, Section
from yarnverify.symbolic.measures import Measure, NoMeasuresError, Segment
from yarnverify.symbolic.tree import IDENTITY, PI, Expr, Name, number

ATOMS = ("C", "S", "s", "A", "f", "g", "versine", "vercosine", "half", "psi")  # scalars of a corner


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


def corner_section(derivation: Derivation, corner: Corner | None) -> Section:
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
