"""The compiled engine gives the bits of the NumPy engine."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

from tests.test_kernels import state
from yarnverify.kernels import VARIANTS, ElementError, bending
from yarnverify.kernels.compiled import source_of

CASES = [  # one of each kind, since each takes seconds to compile
    ("bending", "accurate", np.float64),
    ("shear", "fast", np.float64),
    ("stretch", "accurate", np.float32),
    ("parallel_contact", "accurate", np.float64),
]


@pytest.mark.parametrize(("energy", "variant", "dtype"), CASES)
def test_same_bits(energy: str, variant: str, dtype: type) -> None:
    pytest.importorskip("numba", reason="numba is not installed: the compiled engine was not run")
    module = importlib.import_module(f"yarnverify.kernels.{variant}.{energy}")
    q, parameters = state(energy, n=300)
    given = {name: value.astype(dtype) for name, value in parameters.items()}
    plain = module.evaluate(q.astype(dtype), **given)
    compiled = module.evaluate(q.astype(dtype), **given, engine="compiled")
    assert [a.tobytes() for a in plain] == [a.tobytes() for a in compiled]


def test_bad_elements_are_named() -> None:
    pytest.importorskip("numba", reason="numba is not installed: the compiled engine was not run")
    q, parameters = state("bending")
    q[3:6, 2] = q[0:3, 2]
    with pytest.raises(ElementError, match="bending: element 2: the segment x0-x1 has length zero"):
        bending.energy(q, **parameters, engine="compiled")


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_loop_is_valid_python(variant: str) -> None:
    """Also where numba is not installed."""
    module = importlib.import_module(f"yarnverify.kernels.{variant}.shear")
    text = source_of(module.KERNEL.tape(0, "EGH", np.float64))
    compile(text, "loop.py", "exec")
    assert text.count("\n            v") == module.KERNEL.tape(0, "EGH", np.float64).operations + text.count(" = +")
