"""Bad numbers, shapes and types, each with its message; and elements that are bad among many."""

from __future__ import annotations

import numpy as np
import pytest

from tests.cases import FAR, GENERIC, REGULAR, Case, X, Y, Z, bent, sheared, stretched, towards, turned
from tests.variants import ENERGIES, FUNCTIONS, SAFE, bits, kernel, outputs
from yarnverify.fuzzing.judge import declared, judge
from yarnverify.kernels import ElementError
from yarnverify.strategies import Element, Turn

ALL = pytest.mark.parametrize("variant", (*SAFE, "differentiated"))
EACH = pytest.mark.parametrize("energy", ENERGIES)


def replaced(element: Element, row: int, value: float) -> Element:
    q = element.q.copy()
    q[row] = value
    return Element(q, element.parameters)


@EACH
@ALL
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_coordinate_that_is_not_finite_is_named(energy: str, variant: str, value: float) -> None:
    module = kernel(energy, variant)
    for row, label in enumerate(module.DOFS):
        broken = replaced(REGULAR[energy], row, value)
        for function in FUNCTIONS:
            with pytest.raises(ElementError) as caught:
                outputs(module, broken, function)
            assert str(caught.value) == f"{energy}: element 0: {label} is {value}"
            assert all(np.isnan(array).all() for array in outputs(module, broken, function, errors="mask"))


@EACH
@ALL
def test_bad_parameters_are_named(energy: str, variant: str) -> None:
    module = kernel(energy, variant)
    q, parameters = REGULAR[energy]
    for name in module.PARAMETERS:
        for value, kind, text in [
            (-1.0, ValueError, "{} = -1.0 must be finite and not negative"),
            (np.nan, ValueError, "{} = nan must be finite and not negative"),
            (np.inf, ValueError, "{} = inf must be finite and not negative"),
            ([-2.0], ValueError, "{}[0] = -2.0 must be finite and not negative"),
            ([1.0, 2.0], ValueError, "{} must be a number or have shape (1,), not (2,)"),
            (1j, TypeError, "{} must be real, not complex128"),
        ]:
            with pytest.raises(kind) as caught:
                module.evaluate(q, **parameters | {name: value})
            assert str(caught.value) == f"{energy}: {text.format(name)}"


@EACH
@ALL
@pytest.mark.parametrize("function", FUNCTIONS)
def test_bad_arrays_are_described(energy: str, variant: str, function: str) -> None:
    module = kernel(energy, variant)
    _, parameters = REGULAR[energy]
    dof = len(module.DOFS)
    for q, kind, text in [
        (np.zeros((dof, 1), complex), TypeError, "q must be float32, float64 or integer, not complex128"),
        (np.zeros((dof, 1), object), TypeError, "q must be float32, float64 or integer, not object"),
        (np.full((dof, 1), "1"), TypeError, "q must be float32, float64 or integer, not <U1"),
        (np.zeros(dof), ValueError, f"q must have shape ({dof}, n), not ({dof},)"),
        (np.zeros((dof + 1, 4)), ValueError, f"q must have shape ({dof}, n), not ({dof + 1}, 4)"),
        (np.zeros((4, dof)), ValueError, f"q must have shape ({dof}, n), not (4, {dof})"),
    ]:
        with pytest.raises(kind) as caught:
            getattr(module, function)(q, **parameters)
        assert str(caught.value) == f"{energy}: {text}"


@EACH
@ALL
def test_an_empty_batch(energy: str, variant: str) -> None:
    module = kernel(energy, variant)
    dof = len(module.DOFS)
    for q in (np.empty((dof, 0)), np.empty((dof, 0), np.float32)):
        found = module.evaluate(q, **REGULAR[energy].parameters)
        assert [array.shape for array in found] == [(0,), (dof, 0), (dof, dof, 0)]
        assert {array.dtype for array in found} == {q.dtype}
    assert module.packed(np.empty((dof, 0)), **REGULAR[energy].parameters)[2].shape == (dof * (dof + 1) // 2, 0)


@EACH
@ALL
def test_integers_are_promoted(energy: str, variant: str) -> None:
    module = kernel(energy, variant)
    whole = {
        "stretch": [0, 0, 0, 3, 4, 12, 0, 10],
        "bending": [0, 0, 0, 3, 4, 12, 0, 1, -1, 1, -1],
        "shear": [0, 0, 0, 3, 4, 12, 0, 1, -1],
        "parallel_contact": [0, 0],
    }[energy]
    q = np.array(whole)[:, None]
    parameters = REGULAR[energy].parameters
    as_float = bits(module.evaluate(q.astype(float), **parameters))
    for kind in (np.int64, np.int32, np.int8):
        assert bits(module.evaluate(q.astype(kind), **parameters)) == as_float


@pytest.mark.parametrize("variant", SAFE)
@pytest.mark.parametrize(
    "case",
    [
        Case("straight", "bending", bent(X, -X, dtype=np.float32)),
        Case("deviation 1e-6", "bending", bent(X, towards(1e-6), dtype=np.float32)),
        Case("bent", "bending", bent(GENERIC, Y - Z, dtype=np.float32)),
        Case("pi less 1e-4", "bending", bent(X, towards(1e-4, "pi"), dtype=np.float32)),
        Case("offset 1e4", "bending", bent(X, towards(0.5), 1e4 * FAR, dtype=np.float32)),
        Case("right angle and 1e-6", "shear", sheared(X, turned(Turn("pi/2", 1e-6)), dtype=np.float32)),
        Case("near 0 by 1e-4", "shear", sheared(X, turned(Turn("0", 1e-4)), dtype=np.float32)),
        Case("strain 1e-6", "stretch", stretched(GENERIC, 13 * (1 - 1e-6), dtype=np.float32)),
    ],
    ids=lambda case: f"{case.energy}-{case.name}".replace(" ", "_"),
)
def test_single_precision(case: Case, variant: str) -> None:
    """The same limits, in units of single precision, against the truth at the exact single-precision inputs."""
    module = kernel(case.energy, variant)
    assert {array.dtype for array in outputs(module, case.element)} == {np.dtype(np.float32)}
    assert judge(module, declared(case.energy), case.element).flaws == ()


# -- one bad element among many ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", (*SAFE, "differentiated"))
@pytest.mark.parametrize("function", ["energy", "gradient"])
def test_one_bad_element_among_a_million(variant: str, function: str) -> None:
    module = kernel("stretch", variant)
    n, bad = 10**6, 654_321
    q = np.repeat(REGULAR["stretch"].q, n, axis=1)
    q[3] += np.linspace(0, 1, n)
    (good,) = (getattr(module, function)(q, k_s=1.0),)
    q[4, bad] = np.nan
    with pytest.raises(ElementError) as caught:
        getattr(module, function)(q, k_s=1.0)
    assert str(caught.value) == f"stretch: element {bad}: x1.y is nan"
    assert caught.value.elements.tolist() == [bad]
    masked = getattr(module, function)(q, k_s=1.0, errors="mask")
    assert np.isnan(masked[..., bad]).all()
    others = np.arange(n) != bad
    assert masked[..., others].tobytes() == good[..., others].tobytes()


@EACH
@ALL
def test_several_bad_elements_each_for_its_reason(energy: str, variant: str) -> None:
    """The first is named with its reason, all are listed, and the others keep their bits."""
    module = kernel(energy, variant)
    n = 20_000  # more than two chunks
    q = np.repeat(REGULAR[energy].q, n, axis=1)
    q[0] += np.linspace(0, 1e-2, n)
    good = module.packed(q, **REGULAR[energy].parameters)
    q[1, [19_999, 8_192]] = np.inf
    q[0, 8_191] = -np.inf
    with pytest.raises(ElementError) as caught:
        module.packed(q, **REGULAR[energy].parameters)
    assert str(caught.value) == f"{energy}: element 8191: {module.DOFS[0]} is -inf (and 2 more)"
    assert caught.value.elements.tolist() == [8_191, 8_192, 19_999]
    masked = module.packed(q, **REGULAR[energy].parameters, errors="mask")
    others = np.delete(np.arange(n), [8_191, 8_192, 19_999])
    for before, after in zip(good, masked, strict=True):
        assert np.isnan(after[..., [8_191, 8_192, 19_999]]).all()
        assert after[..., others].tobytes() == before[..., others].tobytes()
