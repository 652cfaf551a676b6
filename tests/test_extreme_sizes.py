"""Lengths, stiffnesses and sliding coordinates of sizes that do not go together: what a product on the way would not hold."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.cases import FAR, GENERIC, ORIGIN, Case, X, Y, Z, bent, made, sheared, stretched, towards
from tests.variants import bits, kernel
from yarnverify.fuzzing.judge import declared, judge
from yarnverify.kernels import ElementError, batch, special
from yarnverify.strategies import Element

ALL = ("stretch", "bending", "shear", "parallel_contact", "gravity", "kinetic", "plane", "sphere")


def with_values(element: Element, **values: Any) -> Element:
    return Element(element.q, {**element.parameters, **values})


CASES = [
    Case("a length whose square vanishes, over a moderate rest length", "stretch", stretched(1e-147 * Y, 0.25)),
    Case("a length whose square overflows", "stretch", stretched(1e152 * GENERIC, 1.0)),
    Case("a rest length of 1e71", "stretch", with_values(stretched(1e60 * GENERIC, 1e71), k_s=1e-300)),
    Case("a rest length much below coordinates", "stretch", made(ORIGIN, 1e-24 * GENERIC, -0.25, -0.25 + 2**-54, k_s=1.0)),
    Case("stiff, in a short segment", "stretch", with_values(stretched(1e-6 * GENERIC, 1e-6), k_s=1e300)),
    Case("soft, with a Hessian below all numbers", "bending", with_values(bent(1e16 * X, -1e16 * GENERIC), k_b=1e-300)),
    Case("large, slender and nearly folded", "bending", bent(1e162 * GENERIC, 1e162 * (GENERIC + 1e-8 * Y), u=(1e154, 0.0))),
    Case("sliding coordinates 1e-150 apart", "bending", with_values(bent(1e-134 * X, 1e-133 * Y, u=(1e-150, 0.0)), k_b=1e-135)),
    Case("an angle of 1e-157 times a stiffness", "bending", with_values(bent(X, towards(1e-157)), k_b=1e10)),
    Case("soft, of unequal short segments", "shear", with_values(sheared(1e-98 * GENERIC, 1e-95 * (GENERIC + Y)), L=1e-300)),
    Case("stiff, of long segments", "shear", with_values(sheared(1e93 * GENERIC, 1e104 * (GENERIC + Z)), k_x=1e300)),
    Case("a hair's overlap, stiff", "parallel_contact", made(0.0, np.nextafter(1e-245, 0), k_c=1e300, L=1.0, d=1e-245)),
    Case("far apart at a large scale", "parallel_contact", made(-1e219, 7e221, k_c=1e-159, L=2.0, d=7.1e221)),
    Case("heavy, of a large scale", "gravity", made(1e150 * X, -1e-150 * Y, 0.0, 1e-200, rho=1e60, g=(1.0, 2.0, -9.81))),
    Case("slow, of a short piece", "kinetic", made(X, X + 1e-100 * Y, 0.0, 1e-100, 1e-170 * Z, 0 * X, 1e-80, 0.0, rho=1.0)),
    Case("deep and large", "plane", made(-1e120 * X, k=1e-60, n=(1.0, 0.0, 0.0), p=(0.0, 0.0, 0.0), R=1.0)),
    Case("shallow and small", "sphere", made(1e-120 * X, k=1e100, c=(0.0, 0.0, 0.0), R=1.5e-120)),
    *(
        Case(f"single precision, {size:g}", energy, Element(element.q.astype(np.float32), element.parameters))
        for size in (1e-18, 1e12)
        for energy, element in [
            ("stretch", stretched(size * GENERIC, 11 * size)),
            ("bending", with_values(bent(size * GENERIC, size * Y), k_b=min(size, 1.0))),
            ("shear", sheared(size * GENERIC, size * (Y - Z), size * FAR)),
            ("gravity", made(size * X, size * GENERIC, 0.0, 3.0, rho=1e-3, g=(1.0, 2.0, -9.81))),
        ]
    ),
]  # fmt: skip


@pytest.mark.parametrize("variant", ["accurate", "fast", "reference"])
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.energy}-{case.name}".replace(" ", "_"))
def test_values(case: Case, variant: str) -> None:
    module = kernel(case.energy, variant)
    assert [flaw.text for flaw in judge(module, declared(case.energy), case.element).flaws] == []


def moderate(energy: str, n: int) -> tuple[Any, dict[str, Any]]:
    """Random states, of which angles are of both shapes, and parameters of each element."""
    draw = np.random.default_rng(7)
    module = kernel(energy, "accurate")
    q = draw.normal(size=(len(module.DOFS), n))
    for label, sign in (("u0", -1), ("u1", 1), ("u2", -1)):
        if label in module.DOFS and energy != "parallel_contact":
            q[module.DOFS.index(label)] = sign * draw.uniform(0.1, 2, n)
    values: dict[str, Any] = {
        name: draw.normal(size=(3, n)) if name in module.KERNEL.vectors else draw.uniform(0.5, 2, n)
        for name in module.PARAMETERS
    }
    return q, values


@pytest.mark.parametrize("energy", ALL)
@pytest.mark.parametrize("variant", ["accurate", "fast"])
def test_numbers_of_any_size_round_as_floats_do(energy: str, variant: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every element taken for an extreme one has the bits that it has otherwise."""
    module = kernel(energy, variant)
    q, values = moderate(energy, 60)
    usual = module.evaluate(q, **values)
    limits = dict.fromkeys(batch._MODERATE, 1.0 + 2.0**-30)
    monkeypatch.setattr(batch, "_MODERATE", limits)
    calls = []
    monkeypatch.setattr(special, "run_wide", lambda *a, real=special.run_wide: calls.append(a) or real(*a))
    assert bits(module.evaluate(q, **values)) == bits(usual)
    assert calls


@pytest.mark.parametrize("energy", ALL)
@pytest.mark.parametrize("variant", ["accurate", "fast", "reference"])
@pytest.mark.parametrize("n", [1, 3])
def test_every_coordinate_must_be_finite(energy: str, variant: str, n: int) -> None:
    """Also where no length or angle depends on it."""
    module = kernel(energy, variant)
    good, values = moderate(energy, n)
    for row, label in enumerate(module.DOFS):
        for value in (np.nan, -np.inf):
            q = good.copy()
            q[row, n - 1] = value
            with pytest.raises(ElementError, match=f"^{energy}: element {n - 1}: {label} is {value}$"):
                module.energy(q, **values)


@pytest.mark.parametrize("variant", ["accurate", "fast", "reference"])
def test_an_energy_that_overflows_is_refused(variant: str) -> None:
    """Whatever the energy: not infinite, NaN or zero."""
    for energy, element in {
        "gravity": made(1e308 * X, 1e308 * X, 0.0, 10.0, rho=1.0, g=(1.0, 0.0, 0.0)),
        "plane": made(-1e308 * X, k=1.0, n=(1.0, 0.0, 0.0), p=(0.0, 0.0, 0.0), R=1.0),
        "kinetic": made(X, Y, 0.0, 1.0, 1e200 * X, X, 0.0, 0.0, rho=1.0),
    }.items():
        with pytest.raises(ElementError, match=f"^{energy}: element 0: the result is not finite"):
            kernel(energy, variant).energy(element.q, **element.parameters)
