"""What is wrong with a formula, where it is recognised: by comparison with what may have been written instead."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.shape import shape_of
from yarnverify.accuracy.truth import truth
from yarnverify.check.cases import Cases, angles
from yarnverify.check.factors import Factor, curvatures, factor, number_text, quantities, ratio, terms
from yarnverify.check.judge import Block
from yarnverify.check.laws import Laws
from yarnverify.check.siblings import Siblings
from yarnverify.symbolic.declare import Energy

Array = NDArray[Any]
_MULTIPLES = (2.0, 0.5, 4.0, 0.25, np.pi, 1 / np.pi)
_ROUNDED = (1.57, 1.571, 1.5708, 1.570796)  # what people write for pi/2


@dataclass(frozen=True)
class Mistake:
    """What a block is instead of what it should be.

    Attributes
    ----------
    text
        In words; empty where nothing was recognised.
    factor
        What the truth is multiplied by, where that is all.
    sign
        Of the block against the truth: 1 or -1, 0 where it cannot be told.
    """

    text: str = ""
    factor: Factor | None = None
    sign: int = 0


class Formula:
    """Comparisons at chosen states.

    Parameters
    ----------
    cases, blocks
        What was tried, and everything that came back.
    printed
        Gives G and H of the document's own formulas, None where there are none.
    plain
        (n,) bool: where nothing is hard.
    """

    def __init__(
        self, cases: Cases, blocks: list[Block], printed: Callable[[], dict[str, Array] | None], plain: Array
    ) -> None:
        self.cases, self.blocks, self._printed, self.plain = cases, blocks, printed, plain
        self.tolerance = 1e-3 if cases.dtype == "float32" else 1e-6
        self.angle, self.siblings = angles(cases), Siblings(cases.energy, blocks, self._same)
        self._quantities: dict[str, Array] | None = None
        self._others_known: dict[tuple[str, float], dict[tuple[str, str], Array]] = {}

    def named(self, at: Array) -> dict[str, Array]:
        if self._quantities is None:
            self._quantities = quantities(self.cases)
        return {name: value[at] for name, value in self._quantities.items()}

    @cached_property
    def laws(self) -> Laws:
        """Other laws, and what follows from the energy that came where that is the true one times something."""
        laws = Laws(self.cases, self.blocks, self.plain, self.tolerance)
        for block in self.blocks:
            at = self.plain & block.judged & np.isfinite(block.computed).all(axis=0)
            if block.kind == "E" and at.any():
                known = self._factor(
                    ratio(block.computed[:, at], block.true[:, at], self.tolerance), np.flatnonzero(at)
                )
                if known is not None:
                    laws.follow(known)
        return laws

    def _factor(self, found: Array | None, where: Array) -> Factor | None:
        """A ratio as a product of quantities."""
        if found is None:
            return None
        other = {name: value[where] for name, value in curvatures(self.cases).items()}
        return factor(found, self.named(where), self.tolerance) or factor(found, other, self.tolerance)

    def mistake(self, block: Block, at: Array) -> Mistake:
        """What a block is instead of what it should be; a wrong sign besides another mistake is seen through."""
        computed, true = block.computed[:, at], block.true[:, at]
        live = np.abs(true).max(axis=0) > 0
        where = np.flatnonzero(at)[live]
        found = ratio(computed[:, live], true[:, live], self.tolerance) if live.any() and np.any(computed) else None
        known = None if found is None else factor(found, {}, self.tolerance)
        law = self.laws.of(block) if known is None else None
        if law is not None:
            return _signed(law.text, law.sign)
        if not np.any(computed):
            return Mistake("is zero, as if left out")
        if not live.any():
            return Mistake("is not zero, as it should be")
        known = known or self._factor(found, where)
        if known is not None and known.is_sign and block.kind == "E" and (text := self.laws.exchanged):
            return Mistake(text, known, -1)
        if known is not None:
            return Mistake(_factor_text(known), known, 1 if known.number > 0 else -1)
        if text := self._spread_alone(block, computed, at):
            return Mistake(text)
        for sign in (1, -1):
            if found is not None:
                text = self._right_angle(sign * found, where) or self._rounded(sign * found, where)
                if text:
                    return _signed(text, sign)
            printed = self._printed_block(block, sign * computed, at)
            if printed is not None:
                return printed
            for test in (
                self.siblings.explained,
                self._parameter,
                self._first_derivatives,
                self.definite,
            ):
                text = test(block, sign * computed, at)
                if text:
                    return _signed(text, sign)
            if found is None and (text := self._term(block, sign * computed, at)):
                return _signed(text, sign)
        if found is not None and len(true) > 1:
            sign = 1 if np.all(found > 0) else -1 if np.all(found < 0) else 0
            return Mistake(f"points the {'opposite' if sign < 0 else 'right'} way, and has another size", None, sign)
        return Mistake()

    def _same(self, computed: Array, other: Array) -> bool:
        with np.errstate(all="ignore"):
            gap = np.sqrt(((computed - other) ** 2).sum(axis=0))
            size = np.sqrt((other**2).sum(axis=0))
        return bool(np.isfinite(gap).all() and size.any() and np.all(gap <= self.tolerance * size.clip(min=1e-300)))

    def _printed_block(self, block: Block, computed: Array, at: Array) -> Mistake | None:
        """A misprint typed in, perhaps times a number: another sign, a squared time step."""
        printed = self._printed()
        if printed is None or block.kind == "E":
            return None
        places = dict(self.cases.labels)
        where = tuple(places[name] for name in block.name.split(","))
        values = printed[block.kind][where].reshape(block.computed.shape[0], -1)[:, at]
        if self._same(values, block.true[:, at]) or not values.any(axis=0).all():
            return None
        found = ratio(computed, values, self.tolerance)
        known = None if found is None else factor(found, self.named(np.flatnonzero(at)), self.tolerance)
        if known is None or known.number < 0:
            return None
        size = "" if str(known) == "1" else f", times {known}"
        sign = 1 if np.array_equal(computed, block.computed[:, at]) else -1
        text = f"is what the document prints, misprint included{equation_of(self.cases.energy, block.name)}{size}"
        return _signed(text, sign)

    def _parameter(self, block: Block, computed: Array, at: Array) -> str:
        """A length, such as a distance of contact, that is a multiple of what it should be."""
        for name in shape_of(self.cases.energy).lengths:
            for size in _MULTIPLES:
                if self._same(computed, self._with(name, size)[block.kind, block.name][:, at]):
                    return f"is right for {number_text(size)} {name} in place of {name}"
        return ""

    def _with(self, name: str, size: float) -> dict[tuple[str, str], Array]:
        """Every block with one parameter multiplied."""
        if (name, size) not in self._others_known:
            points = self.cases.points
            changed = {**points.parameters, name: points.parameters[name] * size}
            known = truth(self.cases.energy, replace(points, parameters=changed))
            whole, n, places = (
                {"E": known.energy[None], "G": known.gradient, "H": known.hessian},
                len(points),
                dict(self.cases.labels),
            )
            self._others_known[name, size] = {
                (b.kind, b.name): whole[b.kind][
                    tuple(places[part] for part in b.name.split(",") if part) or ...
                ].reshape(-1, n)
                for b in self.blocks
            }
        return self._others_known[name, size]

    def _first_derivatives(self, block: Block, computed: Array, at: Array) -> str:
        """The Gauss-Newton part of a law that is quadratic in its measure: g g^T/(2 E)."""
        if block.kind != "H":
            return ""
        places = dict(self.cases.labels)
        gradient, energy = self.cases.truth.gradient, self.cases.truth.energy
        a, b = (gradient[places[name]] for name in block.name.split(","))
        with np.errstate(all="ignore"):
            outer = (a[:, None] * b[None]).reshape(-1, len(self.cases)) / (2 * energy)
        if not self._same(computed, outer[:, at]):
            return ""
        return (
            "holds first derivatives only (Gauss-Newton): the term with the measure's own second derivative is missing"
        )

    def _spread_alone(self, block: Block, computed: Array, at: Array) -> str:
        """The energy over the difference of sliding coordinates: as if its measure did not depend on that."""
        if block.kind != "G" or block.computed.shape[0] != 1:
            return ""
        for name, value in self.named(at).items():
            if name.startswith("(u") and self._same(np.abs(computed), np.abs(self.cases.truth.energy[at] / value)):
                return f"is the energy over {name}: what is squared depends on {name} too"
        return ""

    def definite(self, block: Block, computed: Array, at: Array) -> str:
        """Whether a Hessian's block is that of the nearest one without negative eigenvalues."""
        if block.kind != "H":
            return ""
        whole = np.moveaxis(self.cases.truth.hessian[..., at], -1, 0)
        values, vectors = np.linalg.eigh(whole)
        clamped = np.moveaxis((vectors * np.maximum(values, 0)[:, None, :]) @ vectors.swapaxes(1, 2), 0, -1)
        places = dict(self.cases.labels)
        rows, columns = (places[name] for name in block.name.split(","))
        if not self._same(computed, clamped[rows, columns].reshape(block.computed.shape[0], -1)):
            return ""
        return "has its negative eigenvalues set to zero: a form for solvers, not the derivative"

    def _term(self, block: Block, computed: Array, at: Array) -> str:
        """A difference from the truth that is a multiple of one term of the kind that formulas are made of."""
        rest = computed - block.true[:, at]
        for name, term in terms(self.cases, rest.shape[0]).items():
            if ratio(rest, term[:, at], self.tolerance) is not None:
                return f"is off by a multiple of {name}: that term is wrong, or missing"
        return ""

    def rounded_right_angle(self, block: Block, at: Array) -> str:
        """A right angle in some ten digits, which the energy holds squared."""
        found = ratio(block.computed[:, at], block.true[:, at], self.tolerance)
        if found is None or np.any(found < 0):
            return ""
        return self._right_angle(np.sqrt(found) if block.kind == "E" else found, np.flatnonzero(at))

    def _right_angle(self, found: Array, at: Array) -> str:
        deviation = self.angle[at] - np.pi / 2
        offset = (found - 1) * deviation
        middle = float(np.median(offset))
        if (
            not np.isfinite(offset).all()
            or not 1e-13 < abs(middle) < 0.2
            or np.abs(offset - middle).max() > 1e-3 * abs(middle)
        ):
            return ""
        return f"takes {np.pi / 2 - middle:.12g} for pi/2"

    def _rounded(self, found: Array, at: Array) -> str:
        """A factor besides a rounded right angle."""
        angle = self.angle[at]
        for value in _ROUNDED:
            known = factor(found * (angle - np.pi / 2) / (angle - value), self.named(at), self.tolerance)
            if known is not None:
                return f"takes {value} for pi/2, and {_factor_text(known)}"
        return ""


def _signed(text: str, sign: int) -> Mistake:
    return Mistake(text if sign > 0 else f"{text}, and has the wrong sign", None, sign)


def _factor_text(found: Factor) -> str:
    if found.is_sign:
        return "has the wrong sign"
    sign = ", and has the wrong sign" if found.number < 0 else ""
    powers = dict(found.powers)
    if set(powers) == {"angle", "(pi - angle)"} and powers["angle"] == -powers["(pi - angle)"] < 0:
        return f"takes pi minus the angle for the angle: its cosine has the wrong sign{sign}"
    if found.powers and abs(abs(found.number) - 1) < 1e-5:
        return f"lacks a factor {Factor(1.0, found.inverse.powers)}{sign}"
    degrees = ": an angle in degrees" if "180" in number_text(found.number) and not found.powers else ""
    return f"is {found} times what it should be{degrees}"


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
