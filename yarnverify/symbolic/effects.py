"""What a mistake does in practice: printed and true values at rest."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import flint
import numpy as np

from yarnverify.symbolic.algebraic import UndefinedError
from yarnverify.symbolic.forward import Evaluation, entries
from yarnverify.symbolic.numbers import Balls
from yarnverify.symbolic.prove import Judged
from yarnverify.symbolic.sections import Section
from yarnverify.symbolic.tree import Name

_ASIDE = Fraction(1, 2**20)  # how far from rest a formula is evaluated that is 0/0 at rest
_REST_BITS = 256


def _rest(section: Section, names: list[Name], aside: Fraction) -> dict[Name, Any]:
    """The declared rest state, with the second point moved aside across its segment."""
    assert section.declared is not None
    given, moved = section.declared.rest, False
    state: dict[Name, Any] = {}
    for name in names:
        value = given.get(name.label, given.get(str(name)))
        if name.bold:
            point = [Fraction(part) for part in (value or (0, 0, 0))]
            if value and name.sub != "0" and not moved:
                point[2] += aside
                moved = True
            state[name] = tuple(point)
        else:
            state[name] = Fraction(value) if value is not None else Fraction(int(not section.is_unknown(name)))
    return state


def effect(judged: Judged) -> str | None:
    """Printed and true block at rest: eigenvalues of a 3x3 Jacobian, the values of anything else."""
    claim, section = judged.claim, judged.court.section
    if section.declared is None or not section.declared.rest or judged.kind not in ("jacobian", "force"):
        return None
    court = judged.court.reaching([claim.left, claim.right])
    before = flint.ctx.prec
    flint.ctx.prec = _REST_BITS
    try:
        for aside in (Fraction(0), _ASIDE):
            state = _rest(section, court.names, aside)
            evaluation = Evaluation(section, state, Balls(), court.energy)
            try:
                true, printed = evaluation.value(claim.left), evaluation.value(claim.right)
            except UndefinedError:
                continue
            if not all(math.isfinite(float(part)) for part in (*entries(true), *entries(printed))):
                continue  # no double holds it, for instance a root of what is zero at rest, or what is huge
            flip = -1 if claim.left.op == "neg" else 1
            return _compare(claim.block, true, printed, flip, bool(aside))
    finally:
        flint.ctx.prec = before
    return None


def _compare(block: str, true: Any, printed: Any, flip: int, aside: bool) -> str:
    where = "beside rest (moved 2^-20 m aside; at rest the formula is 0/0)" if aside else "at rest"
    if getattr(true, "shape", None) == (3, 3) and getattr(printed, "shape", None) == (3, 3):
        spectra = [_eigenvalues(value, flip) for value in (printed, true)]
        text = f"eigenvalues {where}: printed {_list(spectra[0])}; true {_list(spectra[1])}"
        force, _, unknown = block.partition("/")
        unstable = [sum(value > 0 for value in spectrum) for spectrum in spectra]
        if force.removeprefix("dF_") == unknown.removeprefix("d") and unstable[0] > unstable[1]:
            text += f"; the printed stiffness is negative in {unstable[0]} directions, the true one in {unstable[1]}"
        return text
    values = [[flip * float(part) for part in entries(value)] for value in (printed, true)]
    return f"{where}: printed {_list(values[0])}; true {_list(values[1])}"


def _eigenvalues(block: Any, flip: int) -> list[float]:
    matrix = np.array([[float(part) for part in row] for row in block]) * flip
    values = np.linalg.eigvals(matrix)
    size = float(np.max(np.abs(values), initial=0.0))
    real = [float(v.real) if abs(v.real) > 1e-5 * size else 0.0 for v in values]
    return sorted(real, reverse=True)


def _list(values: list[float]) -> str:
    return ", ".join(f"{value + 0.0:.4g}" for value in values)
