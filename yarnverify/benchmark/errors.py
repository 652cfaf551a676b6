"""Errors of contestants on fixed states, in units of the rounding, against the exact result at the exact floats."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from yarnverify.accuracy.metrics import measure
from yarnverify.accuracy.truth import Points, Truth, truth
from yarnverify.benchmark.inputs import Inputs, error_states
from yarnverify.benchmark.ways import Way, named, unified
from yarnverify.symbolic.declare import Energy


def exact(energy: Energy, inputs: Inputs) -> Truth:
    """The exact result at given states."""
    values = named(energy, inputs.parameters)
    n = inputs.q.shape[1]
    return truth(energy, Points(inputs.q, {name: np.repeat(value[..., None], n, -1) for name, value in values.items()}))


def errors_of(energy: Energy, ways: Mapping[str, Way], points: int) -> dict[str, dict[str, Any]]:
    """Worst errors by state and contestant.

    Returns
    -------
    dict
        ``{state: {contestant: {"E": ..., "G": ..., "H": ...}}}`` in units of 2^-53, normwise by blocks; None where a
        contestant gives NaN or infinity at one of the states.
    """
    found: dict[str, dict[str, Any]] = {}
    for state, inputs in error_states(energy, points).items():
        true = exact(energy, inputs)
        found[state] = {}
        for name, way in ways.items():
            with np.errstate(all="ignore"):  # a peer's NaN is reported, not warned about
                outputs = unified(way, way.run(inputs.q, inputs.parameters))
            found[state][name] = {
                label: _worst(measure(label, computed, true, energy.unknowns, "float64").worst_block)
                for label, computed in zip("EGH", outputs, strict=True)
            }
    return found


def _worst(errors: Any) -> float | None:
    known = errors[~np.isnan(errors)]  # NaN here: there is no true value to compare with
    worst = float(known.max(initial=0.0))
    return float(f"{worst:.3g}") if np.isfinite(worst) else None
