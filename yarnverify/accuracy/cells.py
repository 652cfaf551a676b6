"""One cell of a sweep: an energy, a variant of its kernel, a type of floats and a regime; and the points that were worst.

The truth of a regime is worked out once and shared by all variants: that is a *unit* of work, a pure function of its arguments,
so that any executor may run it anywhere.
"""

from __future__ import annotations

import importlib
import importlib.util
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.conditioning import Conditions
from yarnverify.accuracy.metrics import OUTPUTS, Errors, measure, slices
from yarnverify.accuracy.regimes import curve_points, points_of, regimes
from yarnverify.accuracy.rule import EXACT, allowed
from yarnverify.accuracy.shape import shape_of
from yarnverify.accuracy.truth import Points, Truth, truth
from yarnverify.errors import InputError
from yarnverify.library import derivations
from yarnverify.symbolic.declare import Energy, load_declarations

Array = NDArray[Any]


@dataclass(frozen=True)
class Unit:
    """What one worker does: all variants at one regime.

    Attributes
    ----------
    energy, dtype, regime
        By name; the regime of a curve is what is approached.
    variants
        Of the kernels; each must be there.
    count, seed
        How many states, and which; of a curve, how many orientations at each distance.
    everywhere
        Whether the condition of every Hessian is worked out, rather than where a loss must be explained.
    derivations
        Folder of declared energies; empty for those of the package, wherever the worker has it.
    kind
        "cells", or "curve": error against the distance from what is hard.
    """

    energy: str
    dtype: str
    regime: str
    variants: tuple[str, ...]
    count: int
    seed: int
    everywhere: bool
    derivations: str
    kind: str = "cells"

    @property
    def name(self) -> str:
        return f"{self.energy} {self.dtype} {'towards ' if self.kind == 'curve' else ''}{self.regime}"


def declared_energy(name: str, folder: str | Path) -> Energy:
    """A declared energy by name.

    Raises
    ------
    InputError
        Where none has that name.
    """
    energies = load_declarations(Path(folder)).energies
    found = next((energy for energy in energies if energy.name == name), None)
    if found is None:
        raise InputError(f"{name}: no such energy; there are {', '.join(energy.name for energy in energies)}")
    return found


def kernel(variant: str, energy: str, folder: str | Path = "") -> Any:
    """The generated module of a variant of an energy: of the package, or of a folder of your own.

    Raises
    ------
    InputError
        Where there is none.
    """
    missing = InputError(f"{variant} {energy}: there is no such kernel")
    if not folder or Path(folder) == derivations():
        try:
            return importlib.import_module(f"yarnverify.kernels.{variant}.{energy}")
        except ModuleNotFoundError:
            raise missing from None
    path = Path(folder) / "kernels" / variant / f"{energy}.py"
    spec = importlib.util.spec_from_file_location(f"{variant}_{energy}", path) if path.is_file() else None
    if spec is None or spec.loader is None:
        raise missing
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def has_kernel(variant: str, energy: str, folder: str | Path = "") -> bool:
    try:
        kernel(variant, energy, folder)
    except InputError:
        return False
    return True


def compute(module: Any, points: Points, exact: Truth, dtype: str) -> tuple[dict[str, Array], Array]:
    """What a kernel gives at some points, and at how many it invents a result where there is none.

    All three outputs come from one call where all of them have a value in this type. Elsewhere a kernel may refuse the element
    as a whole, so the gradient and the energy are asked for by themselves.

    Returns
    -------
    outputs
        E (n,), G (dof, n), H (dof, dof, n).
    invented
        (n,) bool: finite derivatives, or a finite energy, where none exist.
    """
    q = points.q.astype(dtype)
    parameters = {name: value.astype(dtype) for name, value in points.parameters.items()}
    e, g, h = (np.array(part) for part in module.evaluate(q, **parameters, errors="mask"))
    largest = float(np.finfo(dtype).max)
    invented = ~exact.has_derivatives & (np.isfinite(g).any(axis=0) | np.isfinite(h).any(axis=(0, 1)))

    def fits(values: Array) -> Array:
        inside: Array = np.all((np.abs(values) <= largest).reshape(-1, values.shape[-1]), axis=0)
        return inside

    whole = exact.has_derivatives & fits(exact.energy) & fits(exact.gradient) & fits(exact.hessian)
    if not whole.all():
        rest = ~whole
        few = {name: value[..., rest] for name, value in parameters.items()}
        e[rest] = module.energy(q[:, rest], **few, errors="mask")
        g[:, rest] = module.gradient(q[:, rest], **few, errors="mask")
        h[..., rest] = module.hessian(q[:, rest], **few, errors="mask")
        invented |= ~exact.has_energy & np.isfinite(e)
    return {"E": e, "G": g, "H": h}, invented


def limits(variant: str, dtype: str, promise: str = "units") -> str | None:
    """Which target a variant has: "accurate", "fast", "reference", or none; one that promises less is held to less."""
    if dtype != "float64" or variant not in ("accurate", "fast", "reference") or promise == "none":
        return None
    return "fast" if promise == "condition" else variant


def _share(target: str, output: str, errors: Errors, conditions: Conditions) -> tuple[float, int]:
    """The largest error as a share of what the target allows, and where; above 1 the target is missed."""
    each = errors.componentwise if target == "reference" else errors.normwise
    known = np.where(np.isnan(each), -1.0, each)
    per_point = known.max(axis=0)
    if target != "fast":
        at = int(per_point.argmax())
        return max(0.0, float(per_point[at])) / (1.0 if target == "reference" else EXACT), at
    worst, place = 0.0, int(per_point.argmax())
    for point in np.argsort(-per_point, kind="stable"):
        column = known[:, point]
        if column.max() <= EXACT * max(worst, 1.0):
            worst, place = (
                (worst, place) if worst * EXACT >= column.max() else (float(column.max()) / EXACT, int(point))
            )
            break
        share = math.inf
        for draws in (1, 0):  # a bound from below is cheaper, and often enough
            amplification = np.nan_to_num(conditions.at(output, int(point), draws if output == "H" else 0), nan=0.0)
            share = float(np.where(np.isinf(column), np.inf, column / allowed(amplification)).max())
            if share <= 1 or output != "H":
                break
        if share > worst:
            worst, place = share, int(point)
    return worst, place


def run_unit(unit: Unit) -> dict[str, Any]:
    """The cells of a unit, one for each variant, or its curve; ready for JSON.

    Raises
    ------
    InputError
        For an energy, a regime or a kernel that is not there.
    """
    energy = declared_energy(unit.energy, unit.derivations or derivations())
    if unit.kind == "curve":
        return {"curve": _curve(energy, unit)}
    regime = next((regime for regime in regimes(energy) if regime.name == unit.regime), None)
    if regime is None:
        raise InputError(f"{unit.energy}: no regime {unit.regime!r}")
    points = points_of(energy, regime, unit.dtype, unit.count, unit.seed)
    return {"cells": cells(energy, points, unit)}


def _curve(energy: Energy, unit: Unit) -> dict[str, Any]:
    distances, points = curve_points(energy, unit.regime, unit.count, unit.seed)
    exact = truth(energy, points)
    conditions = Conditions(energy, points, exact)
    shape = (len(distances), unit.count)

    def worst(values: Array) -> list[float | str | None]:
        """The largest of all orientations at each distance."""
        rows = np.where(np.isnan(values), -1.0, values).reshape(shape).max(axis=1)
        return [None if value < 0 else significant(float(value)) for value in rows]

    amplification = {
        output: worst(np.array([conditions.at(output, at).max() for at in range(len(points))])) for output in ("E", "G")
    }
    # one orientation is enough of a line for the Hessian, whose condition number is dear
    amplification["H"] = [significant(float(conditions.at("H", at).max())) for at in range(0, len(points), unit.count)]
    lines = {}
    for variant in unit.variants:
        computed, _ = compute(kernel(variant, energy.name, unit.derivations), points, exact, unit.dtype)
        lines[variant] = {
            output: worst(measure(output, computed[output], exact, energy.unknowns, unit.dtype).worst_block)
            for output in OUTPUTS
        }
    return {
        "energy": energy.name,
        "dtype": unit.dtype,
        "towards": unit.regime,
        "distance": [float(f"{distance:.6g}") for distance in distances],
        "condition": amplification,
        "variants": lines,
    }


def cells(energy: Energy, points: Points, unit: Unit) -> list[dict[str, Any]]:
    """The cells of a unit at given points."""
    exact = truth(energy, points)
    conditions = Conditions(energy, points, exact)
    gone = _zero_length(energy, points)
    found = []
    for variant in unit.variants:
        module = kernel(variant, energy.name, unit.derivations)
        computed, invented = compute(module, points, exact, unit.dtype)
        target = limits(variant, unit.dtype, module.KERNEL.promise)
        outputs = {}
        for output in OUTPUTS:
            errors = measure(output, computed[output], exact, energy.unknowns, unit.dtype)
            if output == "E":  # a segment of length zero may be refused
                refused = gone & ~np.isfinite(computed["E"])
                errors.normwise[:, refused] = errors.componentwise[:, refused] = np.nan
                errors = replace(errors, nan=errors.nan & ~refused)
            outputs[output] = _summary(output, errors, conditions, target, (energy.name, variant, unit.dtype), points)
        found.append(
            {
                "energy": energy.name,
                "variant": variant,
                "dtype": unit.dtype,
                "regime": unit.regime,
                "points": len(points),
                "without_value": int((~exact.has_derivatives).sum()),
                "invented": int(invented.sum()),
                "target": target,
                "outputs": outputs,
            }
        )
    if unit.everywhere:
        spread = _spread(conditions, exact)
        for cell in found:
            cell["conditions"] = spread
    return found


def _zero_length(energy: Energy, points: Points) -> Array:
    """(n,) whether a segment has length zero."""
    rows = dict(slices(energy.unknowns))
    found = np.zeros(len(points), bool)
    for edge in shape_of(energy).edges:
        found |= (points.q[rows[edge.head.label]] == points.q[rows[edge.tail.label]]).all(axis=0)
    return found


def _summary(
    output: str, errors: Errors, conditions: Conditions, target: str | None, key: tuple[str, str, str], points: Points
) -> dict[str, Any]:
    worst = errors.worst_block
    known = worst[~np.isnan(worst)]
    counts = {
        "nan": int(errors.nan.sum()),
        "infinite": int(errors.infinite.sum()),
        "underflow": int(errors.underflow.sum()),
        "overflow": int(errors.overflow.sum()),
    }
    if not known.size:
        return {"worst": None, **counts}
    at = int(np.where(np.isnan(worst), -1.0, worst).argmax())
    column = np.where(np.isnan(errors.normwise[:, at]), -1.0, errors.normwise[:, at])
    block = int(column.argmax())
    amplification = None
    if column[block] > EXACT:
        amplification = float(np.nan_to_num(conditions.at(output, at)[block], nan=0.0))
    share, place = _share(target, output, errors, conditions) if target else (None, at)
    ordered = np.sort(known)
    found = {
        "worst": significant(float(worst[at])),
        "p99": significant(float(ordered[math.ceil(0.99 * ordered.size) - 1])),
        "median": significant(float(ordered[(ordered.size - 1) // 2])),
        "componentwise": significant(float(np.nanmax(errors.worst_component))),
        **counts,
        "block": errors.blocks[block],
        "condition": None if amplification is None else significant(amplification),
        "label": label(float(worst[at]), amplification),
        "of_target": None if share is None else significant(share),
        "replay": replay_text(*key, points, at),
    }
    if place != at:
        found["replay_target"] = replay_text(*key, points, place)
    return found


def label(error: float, amplification: float | None) -> str:
    """What a loss is: none, the inputs' (conditioning) or the method's own (computation)."""
    if not math.isfinite(error):
        return "not finite"
    if error <= EXACT or amplification is None:
        return "exact"
    return "conditioning" if error <= allowed(amplification) else "computation"


def _spread(conditions: Conditions, exact: Truth) -> dict[str, Any]:
    """Median and largest condition number of each output, over all points."""
    found = {}
    for output in OUTPUTS:
        each = [float(np.max(conditions.at(output, int(at)))) for at in np.flatnonzero(exact.has_derivatives)]
        found[output] = (
            {"median": significant(float(np.median(each))), "largest": significant(max(each))} if each else None
        )
    return found


def significant(value: float) -> float | str:
    """Three digits; infinity as a text, which JSON has."""
    if math.isnan(value):
        return "nan"
    return float(f"{value:.3g}") if math.isfinite(value) else ("inf" if value > 0 else "-inf")


def short_hex(value: float) -> str:
    """A hexadecimal float without trailing zeros; ``float.fromhex`` reads it."""
    mantissa, exponent = float(value).hex().split("p")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{mantissa}p{exponent}"


def replay_text(energy: str, variant: str, dtype: str, points: Points, at: int) -> str:
    """One state as text: what ``yarnverify accuracy --replay`` reads."""

    def numbers(values: Array) -> str:
        return ",".join(map(short_hex, np.atleast_1d(values)))

    parameters = " ".join(f"{name}={numbers(value[..., at])}" for name, value in points.parameters.items())
    return f"{energy} {variant} {dtype} {numbers(points.q[:, at])} {parameters}"
