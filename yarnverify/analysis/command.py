"""``yarnverify analyse``: the analysis of the energies and of a weave as one record, or the modes of a scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from yarnverify.analysis.cotton import UNITS, Cotton, cotton
from yarnverify.analysis.moduli import compliance, moduli, stiffness
from yarnverify.analysis.spectra import FAMILIES, Family, at_rest, sign_map
from yarnverify.analysis.steps import conditions, stabilities
from yarnverify.analysis.vibrations import Compared, modes, observed_order, pinned_yarn, tight_net
from yarnverify.errors import NotRunError
from yarnverify.files import write_record

COMMAND = "yarnverify analyse --write"
YARN_SIZES, NET_SIZES, CONDITION_SIZES = (10, 20, 40, 80), (6, 12, 24, 48), (8, 16, 32)
_SIDE, _YARN, _WEAVE = 0.024, 0.1, 16  # m, m, yarns each way

Advance = Callable[[str, int], None]


def analysis(settings: Sequence[str] = (), advance: Advance = lambda label, total: None) -> dict[str, Any]:
    """The record: numbers to six digits, maps to three.

    Parameters
    ----------
    settings
        Parameters of the fabric as ``name=value``.

    Raises
    ------
    InputError
        Parameters that there are not, or that no fabric has.
    """
    cloth = cotton(list(settings))
    total = len(FAMILIES) + 4
    energies = {}
    for family in FAMILIES:
        energies[family.name] = _family(family)
        advance(family.name, total)
    parts: dict[str, Callable[[Cotton], dict[str, Any]]] = {
        "steps": _steps, "conditions": _conditions, "vibrations": _vibrations, "moduli": _moduli,
    }  # fmt: skip
    found = {}
    for name, part in parts.items():
        found[name] = part(cloth)
        advance(name, total)
    fabric = {name: {"value": value, "unit": UNITS[name]} for name, value in asdict(cloth).items()}
    command = " ".join([COMMAND, *(["--set", *settings] if settings else [])])
    return {"schema": 1, "command": command, "fabric": fabric, "energies": energies, **found}


def write(record: dict[str, Any], out: Path) -> str:
    """Write the record below a folder of reports; what to say of it."""
    path = out / "records" / "analysis.json"
    write_record(record, path)
    return f"{path}: written; its page and pictures: yarnverify report --pictures"


def _digits(values: Any, digits: int = 6) -> Any:
    if isinstance(values, float | int):
        return float(f"{values:.{digits}g}") + 0.0
    return [_digits(value, digits) for value in (values.tolist() if isinstance(values, np.ndarray) else values)]


def _family(family: Family) -> dict[str, Any]:
    found = sign_map(family)
    return {
        "unit": family.unit,
        "rest": [[_digits(value), count] for value, count in at_rest(family)],
        "angle": {"name": family.angle[0], "values": _digits(family.angle[1])},
        "stretch": {"name": family.stretch[0], "values": _digits(family.stretch[1])},
        "negative": list(found.counts),
        "indefinite": _digits(float((found.free < 0).mean()), 3),
        "free": _digits(found.free, 3),
        "held": None if found.held is None else _digits(found.held, 3),
    }


def _steps(cloth: Cotton) -> dict[str, Any]:
    rows = [
        {"energy": each.name, "omega": _digits(each.omega), "step": _digits(each.step)}
        for each in stabilities(cloth, _WEAVE)
    ]
    return {"size": _WEAVE, "rows": rows}


def _conditions(cloth: Cotton) -> dict[str, Any]:
    rows = []
    for size in CONDITION_SIZES:
        plain, scaled = conditions(cloth, size)
        rows.append({"size": size, "condition": _digits(plain, 3), "scaled": _digits(scaled, 3)})
    return {"rows": rows}


def _vibrations(cloth: Cotton) -> dict[str, Any]:
    yarns = [pinned_yarn(n, k_s=cloth.k_s, k_b=cloth.k_b, rho=cloth.rho, length=_YARN) for n in YARN_SIZES]
    nets, shapes = [], []
    for n in NET_SIZES:
        found, fabric, shown = tight_net(n, k_s=cloth.k_s, rho=cloth.rho, L=_SIDE / n, R=_SIDE / n / 8)
        nets.append(found)
        if n == NET_SIZES[1]:
            heights = shown.shapes[2 : 3 * fabric.nodes : 3].T.reshape(-1, n + 1, n + 1)
            shapes = [_digits(np.round(height, 3), 3) for height in heights]
    return {
        "yarn": {"length": _YARN, **_compared(yarns)},
        "net": {"side": _SIDE, "strain": 0.01, "shapes": shapes, **_compared(nets)},
    }


def _compared(found: Sequence[Compared]) -> dict[str, Any]:
    rows = [
        {
            "size": each.size,
            "found": _digits(each.found),
            "error": _digits(each.error, 3),
            # beside the closed form of the discrete fabric only rounding is left, whose digits mean nothing
            "exact within 1e-8": each.discrete_error < 1e-8,
        }
        for each in found
    ]
    return {"limit": _digits(found[-1].limit), "rows": rows, "order": _digits(observed_order(found), 3)}


def _moduli(cloth: Cotton) -> dict[str, Any]:
    rows = []
    for each in moduli(cloth):
        scale = cloth.k_s / cloth.L if each.closed == 0 else abs(each.closed)
        error = abs(each.computed - each.closed) / scale
        rows.append(
            {
                "name": each.name,
                "formula": each.formula,
                "unit": each.unit,
                "computed": 0.0 if abs(each.computed) < 1e-9 * scale else _digits(each.computed),
                "closed": _digits(each.closed),
                "agree within 1e-9": error < 1e-9,
            }
        )
    angles = np.linspace(0, 90, 46)
    membrane, _, _ = stiffness(cloth)
    pulled = 1 / compliance(membrane, np.radians(angles))
    return {"rows": rows, "angle": _digits(angles), "pulled": _digits(pulled, 4)}


def scene_modes(
    name: str, settings: Sequence[str], size: int | None, count: int, advance: Advance = lambda label, total: None
) -> dict[str, Any]:
    """The lowest modes of a scene about its end.

    Parameters
    ----------
    name
        Of a scene, or a Python file that declares one.
    settings
        Its parameters as ``name=value``; ``rho`` too, where it has none: kg/m, that of cotton by default.
    size
        By default the smallest of the scene.
    count
        How many modes.

    Raises
    ------
    InputError
        For scenes, sizes and parameters that there are not.
    NotRunError
        A scene or modes that cannot be solved.
    """
    from yarnverify.simulation.command import find
    from yarnverify.simulation.command import settings as named
    from yarnverify.simulation.outcome import UNSOLVED
    from yarnverify.simulation.runs import Run

    scene = find(name)
    given = named(settings)
    rho = cotton([f"rho={given.pop('rho')}"] if "rho" in given and "rho" not in scene.quantities else []).rho
    values = scene.values(given)
    chosen = scene.sizes[0] if size is None else size
    run = Run(scene.problem(chosen, given))
    state: Any = None
    try:
        for reached in run.go():
            state = reached.arrays
            advance(name, max(1, int(run.length)))
    except UNSOLVED as error:
        raise NotRunError(f"{name}: {error}") from None
    end = run.outcome(state())
    density = float(values.get("rho", rho))
    terms, active = run.problem.terms, run.problem.active
    found = modes(run.problem.fabric, terms, active, density, end.Q, count)
    return {
        "scene": scene.name,
        "size": chosen,
        "rho": density,
        "frequencies": _digits(found.frequencies),
        "grows": [bool(value < 0) for value in found.frequencies],
    }
