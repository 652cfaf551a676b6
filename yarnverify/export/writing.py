"""Golden vectors as files for any language; the same bytes every time."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from numpy.typing import NDArray

from yarnverify import arrays as files
from yarnverify.accuracy.rule import AMPLIFIED, EXACT
from yarnverify.export.vectors import Vectors

Array = NDArray[Any]
_TEMPLATES = Environment(
    loader=FileSystemLoader(Path(__file__).parent / "templates"),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)


def arrays(vectors: Vectors) -> dict[str, Array]:
    """Everything by name, as in the NPZ and MATLAB files."""
    return {
        "rows": np.array(vectors.rows),
        "parameters": np.array(vectors.parameters),
        "blocks": np.array([name for name, _, _ in vectors.blocks]),
        "tags": np.array(vectors.tags),
        "q": vectors.q,
        **vectors.values,
        "energy": vectors.energies,
        "gradient": vectors.gradients,
        "hessian": vectors.hessians,
        **{f"condition_{name}": value for name, value in vectors.conditions.items()},
    }


def npz(vectors: Vectors) -> bytes:
    """For NumPy."""
    return files.npz(arrays(vectors))


def mat(vectors: Vectors) -> bytes:
    """For MATLAB and Octave."""
    return files.mat(arrays(vectors), f"golden vectors of {vectors.energy}")


def hexadecimal(value: float) -> str:
    """A float that ``strtod``, ``float.fromhex`` and most languages read exactly."""
    if math.isnan(value):
        return "nan"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return float(value).hex()


def json_text(vectors: Vectors) -> str:
    """JSON with hexadecimal floats, one state a line."""

    def texts(values: Array) -> Any:
        return [texts(part) for part in values] if np.ndim(values) else hexadecimal(float(values))

    head = {
        "schema": 1,
        "energy": vectors.energy,
        "summary": vectors.summary,
        "unit": vectors.unit,
        "rows": list(vectors.rows),
        "parameters": dict(zip(vectors.parameters, vectors.units, strict=True)),
        "blocks": {name: [start, size] for name, start, size in vectors.blocks},
        "rule": f"norm of the error of each block <= ({EXACT:g} + {AMPLIFIED:g} condition) 2^-53 times norm of the block",
    }
    lines = []
    for at, tag in enumerate(vectors.tags):
        state = {
            "tag": tag,
            "q": texts(vectors.q[at]),
            "parameters": {name: hexadecimal(float(value[at])) for name, value in vectors.values.items()},
            "energy": hexadecimal(float(vectors.energies[at])),
            "gradient": texts(vectors.gradients[at]),
            "hessian": texts(vectors.hessians[at]),
            "condition": {name: _rounded(value[at]) for name, value in vectors.conditions.items()},
        }
        lines.append(json.dumps(state))
    shown = "".join(f" {json.dumps(key)}: {json.dumps(value)},\n" for key, value in head.items())
    return "{\n" + shown + ' "states": [\n  ' + ",\n  ".join(lines) + "\n ]\n}\n"


def _rounded(values: Any) -> Any:
    """Condition numbers to six digits; null where there is none, a text where it is infinite."""
    if np.ndim(values):
        return [_rounded(part) for part in values]
    value = float(values)
    return None if math.isnan(value) else float(f"{value:.6g}") if math.isfinite(value) else "inf"


def c_header(vectors: Vectors) -> str:
    """Arrays for C and C++."""

    def number(value: float) -> str:
        if math.isnan(value):
            return "NAN"
        return ("-INFINITY" if value < 0 else "INFINITY") if math.isinf(value) else float(value).hex()

    def initializer(values: Array) -> str:
        if np.ndim(values) == 0:
            return number(float(values))
        return "{" + ", ".join(initializer(part) for part in values) + "}"

    def table(values: Array) -> list[str]:
        return [initializer(part) for part in values]

    given = [vectors.values[name] for name in vectors.parameters]
    return _TEMPLATES.get_template("golden.h.jinja").render(
        vectors=vectors,
        tags=[json.dumps(tag) for tag in vectors.tags],
        names=[json.dumps(name) for name, _, _ in vectors.blocks],
        q=table(vectors.q),
        parameters=table(np.column_stack(given)),
        energies=table(vectors.energies),
        gradients=table(vectors.gradients),
        hessians=table(vectors.hessians.reshape(len(vectors), -1)),
        conditions={name: table(value.reshape(len(vectors), -1)) for name, value in vectors.conditions.items()},
    )


def c_test(vectors: Vectors) -> str:
    """A C program that holds a function to the golden vectors by the rule of ``yarnverify check``."""
    return _TEMPLATES.get_template("golden_test.c.jinja").render(vectors=vectors, exact=EXACT, amplified=AMPLIFIED)
