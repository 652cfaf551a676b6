"""What is wrong with a block that fails, where it is recognised: the formula, or the digits.

States of the regime "moderate" tell whether the formula is right: nothing there costs digits. What fails only elsewhere is
right, and loses digits, or has no value, where something is small.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.metrics import UNIT
from yarnverify.accuracy.shape import shape_of
from yarnverify.check.cases import Cases, angles
from yarnverify.check.factors import Factor, factor, goes_on, quantities, ratio
from yarnverify.check.judge import Block, failing
from yarnverify.symbolic.declare import Energy

Array = NDArray[Any]
Status = Literal["pass", "not judged", "wrong", "approximate", "loses digits", "no value"]
_APPROXIMATE = 1e3  # units: what no rounding of a right formula loses where nothing is hard
_ROUNDED = (1.57, 1.571, 1.5708, 1.570796)  # what people write for pi/2
_NEAR = 0.1  # rad: a state that is nearer to a special angle than this is near it


@dataclass(frozen=True)
class Diagnosis:
    """What is wrong with a block.

    Attributes
    ----------
    status
        ``wrong``: another formula. ``approximate``: a few digits everywhere. ``loses digits``, ``no value``: in some states.
    reasons
        Short sentences, the first the most telling; empty where nothing was recognised.
    factor
        What the truth is multiplied by, where that is all.
    """

    status: Status
    reasons: tuple[str, ...]
    factor: Factor | None = None


class Judge:
    """What is shared by all blocks of one run: the plain states, the printed variant, the quantities of a factor."""

    def __init__(self, cases: Cases, blocks: list[Block], printed: Callable[[], dict[str, Array] | None]) -> None:
        self.cases, self.blocks, self._printed = cases, blocks, printed
        self.single = cases.dtype == "float32"
        plain = cases.of_regime("moderate") & cases.truth.has_derivatives
        self.plain = plain if plain.any() else cases.truth.has_derivatives
        self.tolerance = 1e-3 if self.single else 1e-6
        self.angle = angles(cases)
        self._quantities: dict[str, Array] | None = None

    def named(self, at: Array) -> dict[str, Array]:
        if self._quantities is None:
            self._quantities = quantities(self.cases)
        return {name: value[at] for name, value in self._quantities.items()}

    def diagnosis(self, block: Block) -> Diagnosis:
        """What is wrong with a block; nothing if it passes."""
        if not block.judged.any():
            return Diagnosis("not judged", ("nothing came back where there is something to be judged",))
        if block.passes:
            return Diagnosis("pass", ())
        fails = failing(block, self.cases)
        fails[block.worst] = True
        broken = np.isinf(block.errors)
        plain = self.plain & block.judged
        finite = plain & ~broken
        relative = block.errors * UNIT[self.cases.dtype]
        reasons = []
        if finite.any() and (relative[finite] > 1e-3).any():
            text, found = self._formula(block, finite)
            return Diagnosis("wrong", (text,) if text else (), found)
        middle = float(np.median(relative[finite])) if finite.any() else 0.0
        if middle > _APPROXIMATE * UNIT[self.cases.dtype] and (fails & finite).sum() * 2 > finite.sum():
            return Diagnosis("approximate", (self._precision(block, finite, middle),))
        if not finite.any() and plain.any():
            return Diagnosis("no value", ("is NaN or infinite even where nothing is hard",))
        if broken.any():
            reasons.append(self._broken(broken))
        lost = fails & ~broken
        if lost.any():
            gross = lost & (relative > 1e-3) & self.cases.of_regime("moderate", "near rest", "exact")
            if gross.any() and (text := self._definite(block, gross)):
                return Diagnosis("wrong", (text,))
            reasons.append(self._loss(block, lost))
        return Diagnosis("loses digits" if lost.any() else "no value", tuple(reasons))

    # -- the formula

    def _formula(self, block: Block, at: Array) -> tuple[str, Factor | None]:
        computed, true = block.computed[:, at], block.true[:, at]
        size = np.abs(true).max(axis=0)
        if not np.any(computed):
            return "is zero, as if left out", None
        live = size > 0
        if not live.any():
            return "is not zero, as it should be", None
        found = ratio(computed[:, live], true[:, live], self.tolerance)
        if found is not None:
            known = factor(found, self.named(np.flatnonzero(at)[live]), self.tolerance)
            if known is not None:
                return _factor_text(known), known
            offset = self._right_angle(found, np.flatnonzero(at)[live]) or self._rounded(
                found, np.flatnonzero(at)[live]
            )
            if offset:
                return offset, None
        for test in (self._printed_block, self._transposed, self._other_block, self._first_derivatives, self._definite):
            text = test(block, at)
            if text:
                return text, None
        if found is not None:
            return "points the right way but has another size", None
        return "", None

    def _same(self, computed: Array, other: Array) -> bool:
        with np.errstate(all="ignore"):
            gap = np.sqrt(((computed - other) ** 2).sum(axis=0))
            size = np.sqrt((other**2).sum(axis=0))
        return bool(np.isfinite(gap).all() and size.any() and np.all(gap <= self.tolerance * size.clip(min=1e-300)))

    def _printed_block(self, block: Block, at: Array) -> str:
        printed = self._printed()
        if printed is None or block.kind == "E":
            return ""
        places = dict(self.cases.labels)
        where = tuple(places[name] for name in block.name.split(","))
        values = printed[block.kind][where].reshape(block.computed.shape[0], -1)
        if self._same(values[:, at], block.true[:, at]) or not self._same(block.computed[:, at], values[:, at]):
            return ""
        return f"is what the document prints, misprint included{equation_of(self.cases.energy, block.name)}"

    def _transposed(self, block: Block, at: Array) -> str:
        if block.kind != "H" or block.computed.shape[0] != 9:
            return ""
        turned = block.true.reshape(3, 3, -1).swapaxes(0, 1).reshape(9, -1)
        for sign, text in ((1, "is transposed"), (-1, "is transposed and has the wrong sign")):
            if self._same(sign * block.computed[:, at], turned[:, at]):
                return text
        return ""

    def _other_block(self, block: Block, at: Array) -> str:
        for other in self.blocks:
            if other.kind == block.kind and other.name != block.name and other.true.shape == block.true.shape:
                for sign in (1, -1):
                    if self._same(sign * block.computed[:, at], other.true[:, at]):
                        what = "is" if sign > 0 else "is minus"
                        return f"{what} the block {other.name.replace(',', ', ')}: indices are swapped"
        return ""

    def _first_derivatives(self, block: Block, at: Array) -> str:
        """The Gauss-Newton part of a law that is quadratic in its measure: g g^T/(2 E)."""
        if block.kind != "H":
            return ""
        places = dict(self.cases.labels)
        gradient, energy = self.cases.truth.gradient, self.cases.truth.energy
        a, b = (gradient[places[name]] for name in block.name.split(","))
        with np.errstate(all="ignore"):
            outer = (a[:, None] * b[None]).reshape(-1, len(self.cases)) / (2 * energy)
        if not self._same(block.computed[:, at], outer[:, at]):
            return ""
        return (
            "holds first derivatives only (Gauss-Newton): the term with the measure's own second derivative is missing"
        )

    def _definite(self, block: Block, at: Array) -> str:
        if block.kind != "H":
            return ""
        whole = np.moveaxis(self.cases.truth.hessian[..., at], -1, 0)
        values, vectors = np.linalg.eigh(whole)
        clamped = np.moveaxis((vectors * np.maximum(values, 0)[:, None, :]) @ vectors.swapaxes(1, 2), 0, -1)
        places = dict(self.cases.labels)
        rows, columns = (places[name] for name in block.name.split(","))
        if not self._same(block.computed[:, at], clamped[rows, columns].reshape(block.computed.shape[0], -1)):
            return ""
        return "has its negative eigenvalues set to zero: a form for solvers, not the derivative"

    def _right_angle(self, found: Array, at: Array) -> str:
        deviation = self.angle[at] - np.pi / 2
        offset = (found - 1) * deviation
        middle = float(np.median(offset))
        if not np.isfinite(offset).all() or abs(middle) > 0.2 or np.abs(offset - middle).max() > 1e-3 * abs(middle):
            return ""
        return f"takes {np.pi / 2 - middle:.8g} for pi/2"

    def _rounded(self, found: Array, at: Array) -> str:
        """A factor besides a rounded right angle."""
        angle = self.angle[at]
        for value in _ROUNDED:
            known = factor(found * (angle - np.pi / 2) / (angle - value), self.named(at), self.tolerance)
            if known is not None:
                return f"takes {value} for pi/2, and {_factor_text(known)}"
        return ""

    # -- the digits

    def _precision(self, block: Block, at: Array, middle: float) -> str:
        values = block.computed[:, at]
        if not self.single and np.array_equal(values, values.astype(np.float32).astype(np.float64)) and values.any():
            return "is in single precision"
        if not self.single and 2.0**-27 < middle < 2.0**-17:
            return "is about as exact as single precision: somewhere a number is float32, or a difference quotient is taken"
        return f"has about {-np.log10(middle):.0f} digits everywhere: a difference quotient, or a constant that was rounded"

    def _special(self) -> list[tuple[str, Array]]:
        """Special angles and the distance of each state from them."""
        if not np.isfinite(self.angle).any() or not shape_of(self.cases.energy).angle:
            return []
        straight, folded = (
            ("a straight yarn", "a yarn folded back") if goes_on(self.cases) else ("parallel edges", "opposite edges")
        )
        return [(straight, self.angle), (folded, np.pi - self.angle), ("a right angle", np.abs(self.angle - np.pi / 2))]

    def _places(self, at: Array, law: Callable[[Array, Array], str]) -> str:
        """Where some states are, in words: near which angles, or in which regimes."""
        places, left = [], at.copy()
        for name, distance in self._special():
            near = at & (distance < _NEAR)
            if near.sum() >= 2 or (near.any() and near.sum() == at.sum()):
                places.append(f"near {name}{law(near, distance)}")
                left &= ~near
        if left.sum() * 4 > at.sum() or not places:
            states = np.flatnonzero(left if left.any() else at)
            places.append(f"in the hard cases {', '.join(dict.fromkeys(self.cases.regime(int(i)) for i in states))}")
        return " and ".join(places)

    def _broken(self, at: Array) -> str:
        def within(near: Array, distance: Array) -> str:
            worst = float(distance[near].max())
            return f" (within {worst:.1g} rad)" if worst > 1e-300 else ""

        return f"is NaN or infinite {self._places(at, within)}"

    def _loss(self, block: Block, lost: Array) -> str:
        text = f"loses digits {self._places(lost, lambda near, distance: self._law(block, near, distance))}"
        if "u/angle" in text:
            text += ": a cosine there holds few digits of the angle; take atan2(sine, cosine)"
        return text

    def _law(self, block: Block, at: Array, distance: Array) -> str:
        """How the error grows, where it follows a power of the distance."""
        saturated = block.errors * UNIT[self.cases.dtype] > 0.01  # nothing left to lose
        at = at & ~saturated & (block.errors > 16) & (distance > 1e-15)
        if at.sum() < 5:
            return ""
        slope = -float(np.polyfit(np.log(distance[at]), np.log(block.errors[at]), 1)[0])
        power = round(slope)
        if power not in (1, 2, 3) or abs(slope - power) > 0.35:
            return ""
        return f" (about u/angle{'^' + str(power) if power > 1 else ''})"


def _factor_text(found: Factor) -> str:
    if found.is_sign:
        return "has the wrong sign"
    missing = found.inverse
    if found.powers and abs(abs(found.number) - 1) < 1e-5:
        sign = ", and has the wrong sign" if found.number < 0 else ""
        return f"lacks a factor {Factor(abs(missing.number), missing.powers)}{sign}"
    return f"is {found} times what it should be"


def equation_of(energy: Energy, block: str) -> str:
    """Which equation prints a Jacobian that is not the true one; empty where none is found."""
    number, mistaken = _equations(energy.name, energy.document).get(block, ("", False))
    if not number:
        return ""
    return f": equation ({number})" + ("" if mistaken else ", a sum of mistaken Jacobians")


@cache
def _equations(name: str, name_of_document: str) -> dict[str, tuple[str, bool]]:
    """The number of the equation that prints each Jacobian of an energy, and whether it is a known erratum."""
    from yarnverify.library import Shelf, derivations, errata
    from yarnverify.source import load
    from yarnverify.symbolic.declare import load_declarations
    from yarnverify.symbolic.document import block_of
    from yarnverify.symbolic.prove import read_with

    path = derivations() / name_of_document
    if not path.is_file():
        return {}
    known = {erratum.equation for erratum in errata(Shelf(path.parent, path.name, ""))}
    document = read_with(load(path), load_declarations(path.parent))
    found: dict[str, tuple[str, bool]] = {}
    for section in document.sections:
        if section.declared is not None and section.declared.name == name:
            for claim in section.claims:
                row, _, column = block_of(claim.left).removeprefix("dF_").partition("/d")
                number = claim.relation.equation
                found.setdefault(f"{row},{column}", (number, number in known))
    return found
