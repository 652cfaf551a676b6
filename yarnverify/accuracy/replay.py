"""One state again: what a kernel gives there, what is true, the error, and what the inputs' rounding explains of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from yarnverify.accuracy.cells import compute, declared_energy, kernel, label, significant
from yarnverify.accuracy.conditioning import Conditions
from yarnverify.accuracy.forms import rows_of
from yarnverify.accuracy.metrics import OUTPUTS, UNIT, blocks_of, measure, true_parts
from yarnverify.accuracy.truth import Points, truth
from yarnverify.errors import InputError


def parse_replay(text: str, folder: Path) -> tuple[Any, str, str, Points]:
    """Energy, variant, type and state of a text such as a record holds.

    Raises
    ------
    InputError
        Which says what is wrong with it.
    """
    words = text.split()
    if len(words) < 4 or any("=" not in word for word in words[4:]):
        raise InputError(
            f"--replay {text!r}: give ENERGY VARIANT TYPE q0,q1,... name=value ..., and name=x,y,z for a vector"
        )
    energy, variant, dtype = declared_energy(words[0], folder), words[1], words[2]
    if dtype not in UNIT:
        raise InputError(f"--replay: {dtype}: no such type; there are {', '.join(UNIT)}")
    try:
        coordinates = _numbers(words[3])
        given = {name: _numbers(value) for name, _, value in (word.partition("=") for word in words[4:])}
    except ValueError as error:
        raise InputError(f"--replay: {error}") from None
    sizes = {parameter.label: 3 if parameter.name.bold else 1 for parameter in energy.parameters}
    names = list(sizes)
    dof = len(rows_of(energy)) - sum(sizes.values())
    if len(coordinates) != dof:
        raise InputError(f"--replay: {energy.name} has {dof} coordinates, not {len(coordinates)}")
    if set(given) != set(names):
        raise InputError(
            f"--replay: {energy.name} has the parameters {', '.join(names)}, not {', '.join(given) or 'none'}"
        )
    for name, size in sizes.items():
        if len(given[name]) != size:
            raise InputError(f"--replay: {name} is {'a vector, x,y,z' if size == 3 else 'one number'}")
    q = np.array(coordinates)[:, None].astype(dtype).astype(float)
    values = {
        name: np.array(given[name])[:, None] if size == 3 else np.array(given[name]) for name, size in sizes.items()
    }
    return energy, variant, dtype, Points(q, values)


def _numbers(text: str) -> list[float]:
    return [float.fromhex(part) if "x" in part else float(part) for part in text.split(",")]


def replay(text: str, folder: Path, kernels: str = "") -> dict[str, Any]:
    """The state, and for each output its blocks: computed, true, error in units, condition number, and what the loss is."""
    energy, variant, dtype, points = parse_replay(text, folder)
    exact = truth(energy, points)
    computed, _ = compute(kernel(variant, energy.name, kernels), points, exact, dtype)
    rows = []
    conditions = Conditions(energy, points, exact)
    for output in OUTPUTS:
        errors = measure(output, computed[output], exact, energy.unknowns, dtype)
        high, _ = true_parts(exact, output)
        for at, (name, place) in enumerate(blocks_of(output, energy.unknowns)):
            error, amplification = float(errors.normwise[at, 0]), float(conditions.at(output, 0)[at])
            rows.append(
                {
                    "output": output,
                    "block": name,
                    "computed": np.ravel(computed[output][place][..., 0]).astype(float).tolist(),
                    "true": np.ravel(high[place][..., 0]).tolist(),
                    "error": significant(error),
                    "componentwise": significant(float(errors.componentwise[at, 0])),
                    "condition": significant(amplification),
                    "label": "no value"
                    if np.isnan(error)
                    else label(error, float(np.nan_to_num(amplification, nan=0.0))),
                }
            )
    names = [f"{name.label}.{'xyz'[axis]}" if name.bold else str(name) for name, axis in rows_of(energy)]
    state = {name: value.hex() for name, value in zip(names, points.rows()[:, 0].tolist(), strict=True)}
    return {
        "energy": energy.name,
        "variant": variant,
        "dtype": dtype,
        "state": state,
        "bits": int(exact.bits[0]),
        "blocks": rows,
    }


def replay_lines(found: dict[str, Any]) -> list[str]:
    """What ``replay`` found, for a terminal; of a block its component that is furthest off."""
    lines = [
        f"{found['energy']}, {found['variant']}, {found['dtype']}; true to the last digit at {found['bits']} bits",
        "",
    ]
    lines += [f"  {name:<6}{float.fromhex(value):< 25.17g}{value}" for name, value in found["state"].items()]
    lines += [
        "",
        f"  {'block':<10}{'computed':<26}{'true':<26}{'error / u':<12}{'by component':<14}{'condition':<12}loss",
    ]
    for row in found["blocks"]:
        off = [abs(a - b) if a == a and b == b else np.inf for a, b in zip(row["computed"], row["true"], strict=True)]
        at = off.index(max(off))
        lines.append(
            f"  {row['output'] + ' ' + row['block']:<10}{row['computed'][at]:< 26.17g}{row['true'][at]:< 26.17g}"
            f"{float(row['error']):<12.3g}{float(row['componentwise']):<14.3g}{float(row['condition']):<12.3g}{row['label']}"
        )
    return lines
