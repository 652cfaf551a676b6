"""The compiled engine gives the bits of the NumPy engine."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

from tests.test_kernels import state
from yarnverify.kernels import VARIANTS, ElementError, bending, stretch
from yarnverify.kernels.batch import Batch
from yarnverify.kernels.compiled import source_of
from yarnverify.kernels.inputs import Engine

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


@pytest.mark.parametrize("function", ["evaluate", "packed", "energy", "gradient", "hessian"])
def test_any_layout_in_memory_and_any_number_of_elements(function: str) -> None:
    """Chunks, both shapes, strided and read-only inputs, strided outputs."""
    pytest.importorskip("numba", reason="numba is not installed: the compiled engine was not run")
    q, parameters = state("stretch", n=9000)
    q[3:6, ::3] = q[0:3, ::3] + 0.1 * (q[3:6, ::3] - q[0:3, ::3])  # compressed, too
    plain = getattr(stretch, function)(q, **parameters)
    wide = np.repeat(q, 2, axis=1)[:, ::2]
    wide.setflags(write=False)
    arrays = plain if isinstance(plain, tuple) else (plain,)
    out = [np.repeat(np.zeros_like(a), 2, axis=-1)[..., ::2] for a in arrays]
    for given in ({"q": q}, {"q": wide}, {"q": q, "out": out}):
        found = getattr(stretch, function)(**given, **parameters, engine="compiled", threads=2)
        found = found if isinstance(found, list | tuple) else (found,)
        assert [a.tobytes() for a in arrays] == [a.tobytes() for a in found]


@pytest.mark.parametrize("engine", ["numpy", "compiled"])
@pytest.mark.parametrize("energy", ["stretch", "sphere"])  # whose second shape is another formula, and zero
def test_a_call_made_again_has_the_bits_of_a_new_one(energy: str, engine: Engine) -> None:
    """Whichever of its elements are in the second shape, one or many, and after one that failed."""
    if engine == "compiled":
        pytest.importorskip("numba", reason="numba is not installed: the compiled engine was not run")
    module = importlib.import_module(f"yarnverify.kernels.{energy}")
    q, parameters = state(energy, n=12)
    if energy == "sphere":
        parameters = {"k": 2.0, "c": np.zeros(3), "R": 3.0}
    away = q.copy()  # stretch: as long as at rest; the sphere: out of reach
    away[:3] = away[3:6] if energy == "stretch" else 1e3
    if energy == "stretch":
        away[0] += away[7] - away[6]
    rows = q.copy()
    kept = Batch(module.KERNEL, "EGH", rows, parameters, engine=engine)
    for second in ([], [3], [3], [5], [3, 7], range(12), range(6), []):
        rows[:] = q
        rows[:, list(second)] = away[:, list(second)]
        found = [array.tobytes() for array in kept.again()]
        assert found == [array.tobytes() for array in module.packed(rows, **parameters)]
        rows[0, 4] = np.nan
        with pytest.raises(ElementError, match=r"element 4: x0\.x is nan"):
            kept.again()


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
    text = source_of(module.KERNEL.tape(0, "EGH", np.float64), "C")
    compile(text, "loop.py", "exec")
    assert text.count("\n            v") == module.KERNEL.tape(0, "EGH", np.float64).operations + text.count(" = +")
