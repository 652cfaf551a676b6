"""Semi-definite forms of element Hessians: never negative, and the Hessian itself where nothing is wrong with it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from yarnverify.kernels import bending, gravity, parallel_contact, plane, shear, sphere, stretch
from yarnverify.kernels.batch import upper
from yarnverify.kernels.runtime import unpack
from yarnverify.simulation.semidefinite import eigenvalues, form_of

Array = np.ndarray[Any, Any]
EPS = np.finfo(float).eps
KERNELS = {k.KERNEL.name: k for k in (stretch, bending, shear, parallel_contact, gravity, plane, sphere)}
PARAMETERS: dict[str, dict[str, Any]] = {
    "stretch": {"k_s": 3.0},
    "bending": {"k_b": 0.7},
    "shear": {"k_x": 2.0, "L": 0.4},
    "parallel_contact": {"k_c": 5.0, "L": 0.4, "d": 0.3},
    "gravity": {"rho": 0.2, "g": np.array([1.0, -2.0, 9.0])},
    "plane": {"k": 2.0, "n": [0.0, 0.6, 0.8], "p": [0.1, 0.0, 0.2], "R": 0.3},
    "sphere": {"k": 2.0, "c": [0.1, 0.0, 0.2], "R": 1.2},
}
ANGLES = (0.0, 5e-324, 1e-200, 1e-12, 1e-8, 1e-4, 0.3, np.pi / 2 - 1e-9, np.pi / 2, 2.0, np.pi - 1e-3, np.pi - 1e-7)


def states(kernel: Any) -> Array:
    """Random states, and corners at every hard angle with short and long sides, turned at random; (dof, n)."""
    rng = np.random.default_rng(0)
    random = rng.normal(size=(len(kernel.DOFS), 400))
    found = [random]
    if "u0" in kernel.DOFS:
        random[-1] = random[-2] + rng.uniform(0.2, 3, 400)  # on both sides of rest
    if kernel is bending:
        random[-2] = random[-1] + rng.uniform(0.2, 3, 400)
    if kernel in (bending, shear):
        for angle in ANGLES[3:] if kernel is shear else ANGLES:
            for ratio in (1.0, 1e-5, 1e5):
                turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
                first, second = turn @ [1, 0, 0], turn @ [-np.cos(angle), np.sin(angle), 0]
                points = np.concatenate([np.zeros(3), first, ratio * second])
                slides = [1.0, -0.4] if kernel is bending else []
                found.append(np.concatenate([points + np.tile(rng.normal(size=3), 3) * 0, slides])[:, None])
    if kernel is shear:
        found.append(np.array([[0, 0, 0, 1, 0, 0, 0, 1, 0]], float).T)
    return np.concatenate(found, axis=1)


def forms(kernel: Any, q: Array, form: Any) -> tuple[Array, Array]:
    """Hessians and their forms, (n, dof, dof) each."""
    values = PARAMETERS[kernel.KERNEL.name]
    packed = kernel.packed(q, **values)[2]
    changed = packed.copy()
    with np.errstate(all="raise", under="ignore"):
        form(q, values, changed, range(len(packed)))
    return tuple(np.moveaxis(unpack(p, len(q)), -1, 0) for p in (packed, changed))  # type: ignore[return-value]


@pytest.mark.parametrize("name", KERNELS)
@pytest.mark.parametrize("way", ["quick", "eigenvalues"])
def test_no_form_is_negative(name: str, way: str) -> None:
    kernel = KERNELS[name]
    _, changed = forms(kernel, states(kernel), form_of(kernel) if way == "quick" else eigenvalues)
    scale = np.abs(changed).max(axis=(1, 2))
    changed = changed[scale > 0] / scale[scale > 0, None, None]
    assert np.isfinite(changed).all() and len(changed) > 10
    assert np.linalg.eigvalsh(changed).min() >= -40 * EPS


@pytest.mark.parametrize("name", KERNELS)
def test_the_exact_form_is_the_hessian_where_it_may_be_and_the_nearest_where_not(name: str) -> None:
    kernel = KERNELS[name]
    hessian, changed = forms(kernel, states(kernel), eigenvalues)
    value, vector = np.linalg.eigh(hessian)
    fine = value[:, 0] > 1e-12 * value[:, -1]
    assert np.array_equal(hessian[fine], changed[fine])
    nearest = (vector * np.maximum(value, 0)[:, None]) @ vector.swapaxes(1, 2)
    scale = np.abs(hessian).max(axis=(1, 2), initial=1e-300)[:, None, None]
    assert (np.abs(changed - nearest) <= 100 * EPS * scale).all()


def test_stretch_is_projected_exactly() -> None:
    q = states(stretch)
    hessian, changed = forms(stretch, q, form_of(stretch))
    tense = np.linalg.norm(q[3:6] - q[:3], axis=0) >= q[7] - q[6]
    assert 20 < tense.sum() < tense.size - 20
    assert np.array_equal(hessian[tense], changed[tense])
    _, nearest = forms(stretch, q, eigenvalues)
    scale = np.abs(hessian).max(axis=(1, 2))[:, None, None]
    assert (np.abs(changed - nearest) <= 100 * EPS * scale).all()


@pytest.mark.parametrize("name", ["bending", "shear"])
def test_at_rest_the_quick_form_is_the_hessian(name: str) -> None:
    kernel = KERNELS[name]
    q = states(kernel)
    hessian, changed = forms(kernel, q, form_of(kernel))
    energy = kernel.energy(q, **PARAMETERS[name])
    rest = energy < 1e-30
    assert rest.sum() >= 3
    scale = np.abs(hessian).max(axis=(1, 2))[:, None, None]
    assert (np.abs(changed - hessian) <= 40 * EPS * scale)[rest].all()


@pytest.mark.parametrize("name", ["bending", "shear"])
def test_out_of_the_plane_the_quick_form_leaves_one_square_out(name: str) -> None:
    kernel = KERNELS[name]
    rng = np.random.default_rng(4)
    q = np.zeros((len(kernel.DOFS), 60))
    points = rng.normal(size=(3, 3, 60))
    points[:, 2] = 0  # in the plane z = 0, so that z is out of it
    q[:9] = points.reshape(9, 60)
    if kernel is bending:
        q[9] = 1.0
    hessian, changed = forms(kernel, q, form_of(kernel))
    out = np.ix_(range(60), [2, 5, 8], [2, 5, 8])
    assert (np.linalg.eigvalsh(hessian[out])[:, 0] < 0).any()
    scale = np.abs(hessian).max(axis=(1, 2))
    value = np.linalg.eigvalsh(changed[out] - hessian[out])
    assert (value[:, :2] >= -1e-13 * scale[:, None]).all()  # nothing but squares
    assert (value[:, 1] <= 1e-13 * scale).all()  # and not more than one of them


def test_contact_is_left_as_it_is_and_obstacles_far_away_too() -> None:
    for kernel in (parallel_contact, plane, sphere):
        q = states(kernel) + (100.0 if kernel is not parallel_contact else 0)
        hessian, changed = forms(kernel, q, form_of(kernel))
        assert np.array_equal(hessian, changed)


@pytest.mark.parametrize("name", ["stretch", "bending", "shear", "gravity"])
def test_rows_that_are_not_needed_are_left_alone(name: str) -> None:
    kernel = KERNELS[name]
    q, values = states(kernel), PARAMETERS[name]
    packed = kernel.packed(q, **values)[2]
    keep = [k for k, (i, j) in enumerate(upper(len(q))) if i % 2 == 0 and j % 3]
    some, every = packed.copy(), packed.copy()
    form_of(kernel)(q, values, some, keep)
    form_of(kernel)(q, values, every, range(len(packed)))
    assert np.array_equal(some[keep], every[keep])
    others = np.setdiff1d(np.arange(len(packed)), keep)
    assert np.array_equal(some[others], packed[others])
