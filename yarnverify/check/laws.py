"""Other laws that people take for an energy's own, and all that follows from each: an energy of its own, differentiated.

``LAWS`` is the table. A law puts another formula in the place of a measure: of the strain, of an angle, of the length that an
energy is spread on. It explains a block that is a multiple of the same block of that energy; it is believed only where it
explains most of what it would change, so that one block that happens to fit says nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, partial
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.truth import truth
from yarnverify.check.cases import Cases
from yarnverify.check.factors import Factor, ratio
from yarnverify.check.factors import factor as factored
from yarnverify.check.judge import Block
from yarnverify.check.measures import expressions, replaced, total_length
from yarnverify.symbolic.declare import Energy
from yarnverify.symbolic.formulas import dot, length, log, sin, sqrt, tan
from yarnverify.symbolic.tree import PI, Expr, Name, as_expr, rebuild

Array = NDArray[Any]
Values = dict[tuple[str, str], Array]
_MOST = 2 / 3  # of the blocks that a law would change
_STATES = 6  # at which a law is tried
_FEW = 2  # at which a small number is tried, of which there are many


@dataclass(frozen=True)
class Law:
    """Another law: the measure that it is about, what it does, and a formula of the measure's parts in the place of it."""

    measure: str
    text: str
    formula: Callable[..., Expr]


LAWS = (
    Law("strain", "takes Green's strain (l^2/r^2 - 1)/2 for l/r - 1", lambda h, r: ((h / r) ** 2 - 1) / 2),
    Law("strain", "takes the logarithmic strain log(l/r) for l/r - 1", lambda h, r: log(h / r)),
    Law("strain", "takes 1 - r/l for l/r - 1", lambda h, r: 1 - r / h),
    Law("strain", "takes Almansi's strain (1 - r^2/l^2)/2 for l/r - 1", lambda h, r: (1 - (r / h) ** 2) / 2),
    Law("elongation", "takes Green's strain, (l^2 - r^2)/(2 r) for l - r", lambda h, r: (h**2 - r**2) / (2 * r)),
    Law("elongation", "takes the logarithmic strain, r log(l/r) for l - r", lambda h, r: r * log(h / r)),
    Law(
        "angle",
        "takes 2 sin(angle/2) for the angle, and so 2 (1 - cos(angle)) for its square",
        lambda a, p, q: 2 * sin(a / 2),
    ),
    Law(
        "angle", "takes 2 tan(angle/2), as discrete elastic rods have it, for the angle", lambda a, p, q: 2 * tan(a / 2)
    ),
    Law("angle", "takes sin(angle) for the angle", lambda a, p, q: sin(a)),
    Law("angle", "takes tan(angle) for the angle", lambda a, p, q: tan(a)),
    Law("angle", "takes |x_1 - 2 x_0 + x_2| for the angle", lambda a, p, q: length(p - q)),
    Law("squared angle", "takes the angle for its square", lambda a: a),
    Law("deviation", "takes cos(angle) for pi/2 - angle", lambda a, p, q: sin(a)),
    Law("deviation", "takes cot(angle) for pi/2 - angle", lambda a, p, q: tan(a)),
    Law(
        "deviation",
        "takes the scalar product of edges that are not made unit for pi/2 - angle",
        lambda a, p, q: dot(p, q),
    ),
    Law("deviation", "takes pi/4 for pi/2", lambda a, p, q: a + PI / 4),
    Law("deviation", "takes pi for pi/2", lambda a, p, q: a - PI / 2),
    Law("deviation", "leaves out pi/2", lambda a, p, q: a + PI / 2),
    Law("squared overlap", "takes the overlap for its square", lambda gap, r, d: -gap),
    Law("squared overlap", "takes the cube of the overlap for its square", lambda gap, r, d: -(gap**3)),
    Law(
        "squared overlap",
        "takes a barrier, -(d - r)^2 log(r/d) for (d - r)^2",
        lambda gap, r, d: -(gap**2) * log(r / d),
    ),
)
SPREAD = (
    Law("spread", "takes the present length for the rest length that it is spread on", lambda r, h: h),
    Law("spread", "leaves out the rest length that it is spread on", lambda r, h: as_expr(1)),
    Law("spread", "takes the square of the rest length that it is spread on", lambda r, h: r**2),
    Law("spread", "takes the cube of the rest length that it is spread on", lambda r, h: r**3),
)
SMALL = (
    Law("difference", "to the difference of sliding coordinates", lambda r, small: r + small),
    Law("strain", "to r in the strain l/r - 1", lambda h, r, small: h / (r + small) - 1),
    Law("length", "to the length of a segment", lambda h, small: h + small),
    Law("length", "to the squared length of a segment", lambda h, small: sqrt(dot(h.args[0], h.args[0]) + small)),
)  # where people add a small number, against a division by zero
_DECIMALS = range(4, 15)


def alternatives(energy: Energy) -> Iterator[tuple[str, Expr]]:
    """What other laws make of an energy: one, or one for the length that it is spread on and one for its measure."""
    total = total_length(energy.expression)
    ways: list[tuple[str, Expr]] = [("", energy.expression)]
    for law in SPREAD if total is not None else ():
        changed = replaced(energy.expression, law.measure, partial(law.formula, h=total))
        if changed is not None:
            ways.append((law.text, changed))
    for law in LAWS:
        for text, expression in ways[: 1 + len(SPREAD)]:
            changed = replaced(expression, law.measure, law.formula)
            if changed is not None:
                ways.append((f"{law.text}, and {text}" if text else law.text, changed))
    return (way for way in ways if way[0])


def exchanges(energy: Energy) -> list[tuple[tuple[str, str], Expr]]:
    """An energy with two unknowns of a kind in each other's place."""
    found = []
    for a, b in combinations(energy.unknowns, 2):
        if a.bold == b.bold:
            other = {a: b, b: a}

            def change(node: Expr, other: dict[Name, Name] = other) -> Expr | None:
                new = other.get(node.name) if node.op == "symbol" else None
                return None if new is None else Expr("symbol", value=new)

            found.append(((a.label, b.label), rebuild(energy.expression, change)))
    return found


@dataclass(frozen=True)
class Explained:
    """By which law a block is right, and its sign."""

    text: str
    sign: int


class Laws:
    """Looks for a law that explains what came back.

    Parameters
    ----------
    cases, blocks
        What was tried, and everything that came back.
    plain
        (n,) bool: where nothing is hard.
    tolerance
        Relative, within which two values are the same.
    """

    def __init__(self, cases: Cases, blocks: Sequence[Block], plain: Array, tolerance: float) -> None:
        self.cases, self.blocks, self.tolerance = cases, blocks, tolerance
        self.plain = np.flatnonzero(plain)[:_STATES]
        self._follows: dict[tuple[str, str], Explained] = {}

    def of(self, block: Block) -> Explained | None:
        """The law by which a block is right; None where none is believed."""
        place = (block.kind, block.name)
        found = self._table.get(place) or self._follows.get(place)
        if found is None or not (self._slack(block, block.computed) & block.true.any(axis=0)).any():
            return found
        return replace(found, text=f"{found.text}, and is zero where the yarn is shorter than at rest")

    def _slack(self, block: Block, source: Array) -> Array:
        """(n,) bool: where the yarn is shorter than at rest, if a block is zero there, as of people who want no compression."""
        shorter = self.cases.shorter
        where = np.zeros(len(self.cases), bool) if shorter is None else block.judged & shorter & block.true.any(axis=0)
        zero = np.logical_not(source.any(axis=0))
        most = bool(where.any() and zero[where].mean() > _MOST)
        return np.asarray(where & zero & most)

    @cached_property
    def exchanged(self) -> str:
        """Which two unknowns give the energy the other sign if they change places, in words."""
        points = self.cases.points.take(self.plain)
        for names, expression in exchanges(self.cases.energy):
            known = truth(replace(self.cases.energy, expression=expression, domain=()), points).energy
            if np.array_equal(known, -self.cases.truth.energy[self.plain]):
                return f"has the wrong sign, as with {' and '.join(names)} exchanged"
        return ""

    def follow(self, factor: Factor) -> None:
        """Say that the energy that came is the true one times a factor: what follows from it is no mistake of its own."""
        named, parameters = expressions(self.cases), self.cases.points.parameters
        if all(name in parameters for name, _ in factor.powers) or any(name not in named for name, _ in factor.powers):
            return
        product = self.cases.energy.expression
        for name, power in factor.powers:
            product = product * named[name] ** power if power > 0 else product / named[name] ** -power
        found = self._explained("follows from the energy as it came", self._values(product), factor.number)
        self._follows = {place: explained for place, explained in found.items() if place[0] != "E"}

    def added(self, block: Block, at: Array) -> str:
        """A small number that is added to a length, against a division by zero; empty where none explains the error."""
        few = self.plain[:_FEW]
        here = at[few]
        computed, true = block.computed[:, few[here]], block.true[:, few[here]]
        gap = np.sqrt(((computed - true) ** 2).sum(axis=0))
        for text, values in self._small:
            left = np.sqrt(((computed - values[block.kind, block.name][:, here]) ** 2).sum(axis=0))
            if here.any() and np.all(left <= 0.05 * gap):
                return text
        return ""

    def _values(self, expression: Expr, most: int = _STATES) -> Values:
        """Every block of an energy at the plain states, or some of them."""
        points, places = self.cases.points.take(self.plain[:most]), dict(self.cases.labels)
        known = truth(replace(self.cases.energy, expression=expression), points)
        whole = {"E": known.energy[None], "G": known.gradient, "H": known.hessian}
        return {
            (b.kind, b.name): whole[b.kind][tuple(places[part] for part in b.name.split(",") if part) or ...].reshape(
                -1, len(points)
            )
            for b in self.blocks
        }

    def _factor(self, block: Block, values: Array, source: Array) -> Factor | None:
        """What a block is times ``values``: a number and parameters; 0 if both are zero, None if it is no multiple."""
        source, slack = source[:, self.plain], self._slack(block, source)[self.plain]
        here = block.judged[self.plain] & ~slack & np.isfinite(source).all(axis=0) & np.isfinite(values).all(axis=0)
        mine, other = source[:, here], values[:, here]
        live = other.any(axis=0)
        if not mine.size or mine[:, ~live].any():
            return None
        if not live.any():
            return Factor(0.0)
        found = ratio(mine[:, live], other[:, live], self.tolerance)
        where = self.plain[np.flatnonzero(here)[live]]
        named = {name: value[where] for name, value in self.cases.points.parameters.items() if value.ndim == 1}
        return None if found is None else factored(found, named, self.tolerance)

    def _explained(self, text: str, values: Values, unit: float = 1.0) -> dict[tuple[str, str], Explained]:
        """The blocks that an energy, times a number, explains, of the outputs of which it explains most of what it changes."""
        found: dict[tuple[str, str], Factor] = {}
        for kind in "EGH":
            factors: dict[tuple[str, str], Factor | None] = {}
            for block in (b for b in self.blocks if b.kind == kind and b.judged.any()):
                other = values[kind, block.name]
                if self._factor(block, other, block.true) is None:
                    factors[kind, block.name] = self._factor(block, other, block.computed)
            known = {place: replace(f, number=f.number / unit) for place, f in factors.items() if f is not None}
            if len(known) >= _MOST * len(factors):
                found |= known
        whole = next((factor for factor in found.values() if factor.number), None)
        if whole is None:
            return {}
        return {
            place: Explained(_times(text, factor if factor.number else whole), -1 if factor.number < 0 else 1)
            for place, factor in found.items()
        }

    def _worth_trying(self) -> bool:
        """Whether half of the blocks of some output are wrong: another law changes most of them."""
        for kind in "EGH":
            wrong = []
            for block in (b for b in self.blocks if b.kind == kind and b.judged[self.plain].any()):
                here = self.plain[block.judged[self.plain]]
                gap, size = block.computed[:, here] - block.true[:, here], np.abs(block.true[:, here]).max()
                wrong.append(not np.abs(gap).max() <= 1e-4 * size)
            if 2 * sum(wrong) >= len(wrong) > 0:
                return True
        return False

    def _tried(self) -> Iterator[tuple[str, Values]]:
        """Other laws, and other places of the unknowns: in all, or in what is read and not in what is given."""
        for text, expression in alternatives(self.cases.energy):
            yield text, self._values(expression)
        for (a, b), expression in exchanges(self.cases.energy):
            values, other = self._values(expression), {a: b, b: a}
            yield f"has {a} and {b} exchanged", values
            places = {(kind, name): (kind, ",".join(other.get(x, x) for x in name.split(","))) for kind, name in values}
            given = {place: values[source] for place, source in places.items() if source in values}
            same = all(np.array_equal(values[b.kind, b.name], b.true[:, self.plain]) for b in self.blocks)
            if len(given) == len(values) and not same:  # an energy that is the same then has but its blocks swapped
                yield f"has {a} and {b} exchanged in what it reads, and not in what it gives", given

    @cached_property
    def _table(self) -> dict[tuple[str, str], Explained]:
        best: dict[tuple[str, str], Explained] = {}
        for text, values in self._tried() if self._worth_trying() else ():
            found = self._explained(text, values)
            turned = "exchanged" in text and any(explained.sign < 0 for explained in found.values())
            best = found if len(found) > len(best) and not turned else best
        return best

    @cached_property
    def _small(self) -> list[tuple[str, Values]]:
        found = []
        for decimals in _DECIMALS:
            small = as_expr(Fraction(1, 10**decimals))
            for law in SMALL:
                changed = replaced(self.cases.energy.expression, law.measure, partial(law.formula, small=small))
                if changed is not None:
                    found.append((f"adds {10.0**-decimals:g} {law.text}", self._values(changed, _FEW)))
        return found


def _times(text: str, factor: Factor) -> str:
    size = str(factor).removeprefix("-")
    return text if size == "1" else f"{text}; {size} times that"
