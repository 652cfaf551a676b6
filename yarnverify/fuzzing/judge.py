"""One element against the truth: too large an error, NaN, a warning, a refusal without reason, or none with reason."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.conditioning import Conditions
from yarnverify.accuracy.metrics import Errors, measure
from yarnverify.accuracy.rule import AMPLIFIED, EXACT, allowed
from yarnverify.accuracy.truth import Points, Truth, truth
from yarnverify.errors import InputError
from yarnverify.kernels import ElementError
from yarnverify.strategies import Element
from yarnverify.symbolic.declare import Energy

Array = NDArray[Any]
Kind = Literal["error", "not finite", "warning", "refused", "accepted"]
Output = Literal["E", "G", "H"]


@dataclass(frozen=True)
class Limit:
    """What the error of a block may be, in its norm and in units u: a number, or that and what its condition number explains.

    With ``conditioning``, units for each unit of the condition number, it is the rule of ``accuracy.rule``.
    """

    rounding: float
    conditioning: float = 0.0

    def allowed(self, condition: float, dtype: str) -> float:
        """Units that an error may have."""
        return float(allowed(min(condition, 1e150), dtype)) if self.conditioning else self.rounding


# Kernels that promise less, or nothing, are held to what plain arithmetic on safe formulas can reach.
_PLAIN = Limit(EXACT, AMPLIFIED)
LIMITS = {"accurate": Limit(EXACT), "fast": _PLAIN, "reference": Limit(1.0)}


@dataclass(frozen=True)
class Flaw:
    """Something that is wrong at one element.

    Attributes
    ----------
    kind
        ``error`` above its limit; ``not finite``, a NaN or infinity where the truth is finite; ``warning``; ``refused``, an
        ``ElementError`` where there is a value; ``accepted``, none where there is no value.
    where
        Output and block, such as ``H x1,u1``.
    text
        One line to be read.
    size
        How far off, to steer a search: the error as a multiple of its limit.
    """

    kind: Kind
    where: str
    text: str
    size: float = np.inf


@dataclass(frozen=True)
class Judgement:
    """What is wrong, and the largest error as a multiple of its limit."""

    flaws: tuple[Flaw, ...]
    worst: float


def limit_of(module: Any) -> Limit:
    """The limit of a kernel, in the range that it is made for."""
    return LIMITS.get(module.VARIANT, _PLAIN) if module.KERNEL.promise == "units" else _PLAIN


@cache
def declared(name: str, folder: Path | None = None) -> Energy:
    """The declared energy of a kernel, of the package or of a folder of your own.

    Raises
    ------
    InputError
        For a name that nothing declares.
    """
    from yarnverify.library import derivations
    from yarnverify.symbolic.declare import load_declarations

    energies = {energy.name: energy for energy in load_declarations(folder or derivations()).energies}
    if name not in energies:
        raise InputError(f"there is no energy {name!r}; one of {', '.join(sorted(energies))}")
    return energies[name]


def points_of(elements: Iterable[Element]) -> Points:
    """Elements as the points at which they are evaluated: parameters as the kernel rounds them to the type of ``q``."""
    given = list(elements)
    dtype = given[0].q.dtype
    names = given[0].parameters
    parameters = {name: np.array([one.parameters[name] for one in given]).T.astype(dtype) for name in names}
    q = np.concatenate([one.q for one in given], axis=1).astype(np.float64)
    return Points(q, {name: value.astype(np.float64) for name, value in parameters.items()})


def judge(module: Any, energy: Energy, element: Element) -> Judgement:
    """Compare a kernel with the truth at one element.

    Parameters
    ----------
    module
        A kernel, with ``VARIANT``, ``KERNEL``, ``energy`` and ``evaluate``.
    energy
        Its declaration.
    element
        float64 or float32.
    """
    points = points_of([element])
    true = truth(energy, points)
    fits = [_fits(array, element.q.dtype) for array in (true.energy, true.gradient, true.hessian)]
    flaws: list[Flaw] = []
    worst = 0.0
    calls: list[tuple[Any, str, bool, bool]] = [
        (module.energy, "E", bool(true.has_energy[0]), fits[0]),
        (module.evaluate, "EGH", bool(true.has_derivatives[0]), all(fits)),
    ]
    for function, outputs, has_value, fit in calls:
        found, flaw = _call(function, element, has_value and fit)
        if flaw is not None and (
            flaw.kind != "accepted" or not has_value
        ):  # an infinity may stand for what does not fit
            flaws.append(flaw)
        if found is None or not (has_value and fit):
            continue
        for output, computed in zip(outputs, found, strict=True):
            wrong, size = _compare(limit_of(module), energy, points, true, output, computed)
            flaws += wrong
            worst = max(worst, size)
    return Judgement(tuple(dict.fromkeys(flaws)), worst)


def _fits(array: Array, dtype: Any) -> bool:
    with np.errstate(over="ignore"):
        return bool(np.isfinite(array.astype(dtype)).all())


def _call(function: Any, element: Element, has_value: bool) -> tuple[list[Array] | None, Flaw | None]:
    q, parameters = element
    name = function.__name__
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = function(q, **parameters)
    except ElementError as error:
        return None, Flaw("refused", name, f"{name} is refused where it has a value: {error}") if has_value else None
    except Warning as warning:
        return None, Flaw("warning", name, f"{name} warns: {warning}")
    if not has_value:
        return None, Flaw("accepted", name, f"{name} gives numbers where there is no value in this format")
    return list(found) if isinstance(found, tuple) else [found], None


def _compare(
    limit: Limit, energy: Energy, points: Points, true: Truth, output: str, computed: Array
) -> tuple[list[Flaw], float]:
    """Flaws of one output, and its largest error as a multiple of its limit."""
    errors: Errors = measure(output, computed, true, energy.unknowns, str(computed.dtype))
    sizes = errors.normwise[:, 0]
    worst = float(np.nanmax(sizes, initial=0.0)) / limit.rounding
    if worst <= 1:
        return [], worst
    conditions = np.zeros(len(sizes))
    if limit.conditioning:
        conditions = np.nan_to_num(Conditions(energy, points, true).at(output, 0), nan=np.inf)
    flaws, worst = [], 0.0
    for block, size, number in zip(errors.blocks, sizes, conditions, strict=True):
        most = limit.allowed(float(number), str(computed.dtype))
        where = f"{output} {block}".strip()
        worst = max(worst, float(size / most) if size == size else 0.0)  # NaN: the truth does not fit
        if size == np.inf:
            flaws.append(Flaw("not finite", where, f"{where} is not finite where the truth is"))
        elif size > most:
            text = f"{where} is wrong by {size:.3g} u, allowed are {most:.3g} u"
            flaws.append(Flaw("error", where, text, float(size / most)))
    return flaws, worst
