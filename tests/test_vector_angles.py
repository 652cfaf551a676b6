"""Angles between the normals of two triangles: flat, nearly flat, at a right angle, nearly folded, and without derivatives."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from yarnverify.accuracy.conditioning import condition
from yarnverify.accuracy.metrics import measure
from yarnverify.accuracy.truth import Points, truth
from yarnverify.kernels.inputs import ElementError
from yarnverify.symbolic.declare import Declarations, load_declarations
from yarnverify.symbolic.modules import module_text
from yarnverify.symbolic.programs import derived_programs, proved

LAWS = {
    "square": "t**2",
    "even": "t * t * (1 + cos(t)) + (2 * tan(t / 2)) ** 2 + (3 * sin(t / 2) / 2) ** 2 + log(1 + cos(t)) ** 2 + sin(t) ** 2",
    "exponential": "exp(t**2) - 1",
    "hyperbolic": "(exp(t**2) + exp(-t**2)) / 2 - 1",
    "cosine": "1 - cos(t)",
    "by_sides": "atan2(length(cross(n, m)), dot(n, m)) ** 2",
    "odd": "(t - 1) ** 2 + sin(t) + tan(t / 2) + cos(t / 2) + t**3",
    "right": "deviation(n, m) ** 2",
    "supplement": "(PI - t) ** 2 + (PI - t) ** 3",
}
EVEN = ("square", "even", "exponential", "hyperbolic", "cosine", "by_sides")
FLAT = np.array([0.0, 1e-300, 1e-150, 1e-12, 1e-8, 1e-4])
OPEN = np.array([0.1, 1.0, 1.5, 1.9, 2.9])
ENDS = np.array([1e-3, np.pi - 1e-3])


def _declared(name: str) -> str:
    arguments = "x0: Point, x1: Point, x2: Point, x3: Point, *, k: Positive['J']"
    normals = "n, m = cross(x1 - x0, x2 - x0), cross(x3 - x0, x1 - x0)"
    return f"@energy\ndef {name}({arguments}):\n    {normals}\n    t = angle(n, m)\n    return k * ({LAWS[name]})\n"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A function of a law's name, and of a variant: the energy and its kernel's module."""
    folder: Path = tmp_path_factory.mktemp("angles")
    text = "\n\n".join(["from yarnverify.symbolic.declare import *", *map(_declared, LAWS)])
    (folder / "laws.py").write_text(text, encoding="utf-8")
    declared = {energy.name: energy for energy in load_declarations(folder).energies}

    @cache
    def proof(name: str) -> Any:
        return proved(declared[name], Declarations((declared[name],), (), ()))

    @cache
    def found(name: str, variant: str = "accurate") -> Any:
        energy, known = declared[name], proof(name)
        programs, notes = derived_programs(energy, known, variant)
        module: dict[str, Any] = {}
        exec(compile(module_text(energy, variant, programs, ["laws.py"], notes, known)[0], name, "exec"), module)
        return energy, module

    return found


def bent(angles: np.ndarray) -> Points:
    """Two triangles on one edge with such angles between their normals, turned and moved at random."""
    draw = np.random.default_rng(7)
    q = np.empty((12, angles.size))
    for i, t in enumerate(angles):
        axes, _ = np.linalg.qr(draw.normal(size=(3, 3)))
        if t < 1e-9:
            axes = np.eye(3)  # where a rounding of coordinates is more than the angle
        corners = [[0.0, 0, 0], [1, 0, 0], [0.25, 1, 0], [0.5, -np.cos(t), -np.sin(t)]]
        q[:, i] = np.concatenate([axes @ corner for corner in corners]) * 0.75
    return Points(q, {"k": np.full(angles.size, 2.0)})


@pytest.mark.parametrize("name", LAWS)
def test_what_is_lost_is_what_the_condition_of_the_state_explains(made: Any, name: str) -> None:
    energy, module = made(name)
    angles = {"odd": np.append(OPEN, ENDS), "right": np.append(OPEN, ENDS), "supplement": OPEN[1:]}
    points = bent(angles.get(name, np.append(FLAT, OPEN)))
    exact = truth(energy, points)
    assert exact.has_derivatives.all()
    with np.errstate(all="raise"):
        found = module["evaluate"](points.q, **points.parameters)
    for output, value in zip("EGH", found, strict=True):
        allowed = 16 + 8 * condition(output, energy, points, exact)
        assert (measure(output, value, exact, energy.unknowns, "float64").normwise <= allowed).all()


def test_towards_a_fold_what_is_even_loses_as_the_sine_of_the_angle_does(made: Any) -> None:
    energy, module = made("square")
    t = 10.0 ** np.arange(-6, 0)
    points = bent(np.pi - t)
    exact = truth(energy, points)
    errors = measure("H", module["hessian"](points.q, k=2.0), exact, energy.unknowns, "float64").normwise
    assert (errors * np.sin(t) < 64).all() and errors.max() > 1e4


@pytest.mark.parametrize("name", sorted(set(LAWS) - set(EVEN)))
def test_what_is_odd_in_an_angle_has_no_derivative_where_it_is_zero(made: Any, name: str) -> None:
    energy, module = made(name)
    points = bent(np.zeros(1))
    assert not truth(energy, points).has_derivatives[0]
    assert np.isfinite(module["energy"](points.q, k=1.0)).all()
    with pytest.raises(
        ElementError, match=rf"{name}: element 0: the angle between .* is 0 or pi, where the energy has no"
    ):
        module["gradient"](points.q, k=1.0)


def test_a_folded_hinge_has_an_energy_and_no_derivative(made: Any) -> None:
    energy, module = made("square")
    folded = np.array([[0.0, 0, 0, 1, 0, 0, 0.25, 1, 0, 0.5, 1, 0]]).T
    assert module["energy"](folded, k=1.0) == [np.pi**2]
    with pytest.raises(
        ElementError, match=r"element 0: the angle between .* is pi, where the energy has no derivative"
    ):
        module["gradient"](folded, k=1.0)
    assert not truth(energy, Points(folded, {"k": np.ones(1)})).has_derivatives[0]


@pytest.mark.parametrize("name", ["square", "odd"])
def test_with_twice_the_digits_the_rules_give_the_true_derivatives(made: Any, name: str) -> None:
    """Ball arithmetic differentiates the arc cosine of the declared formula, and knows nothing of the rules."""
    energy, module = made(name, "reference")
    points = bent(OPEN)
    exact = truth(energy, points)
    found = module["evaluate"](points.q, **points.parameters)
    for output, value in zip("EGH", found, strict=True):
        assert measure(output, value, exact, energy.unknowns, "float64").worst_block.max() <= 1
    assert (found[2] == found[2].transpose(1, 0, 2)).all()
