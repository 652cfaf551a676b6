"""Energies of one's own in states that cloth is in or that floats allow: flat hinges, large triangles, sizes of any power."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from yarnverify.accuracy.cells import Unit, kernel, run_unit
from yarnverify.accuracy.truth import Points, truth
from yarnverify.generation import generate_kernels
from yarnverify.kernels.inputs import ElementError
from yarnverify.project import project
from yarnverify.symbolic.loading import load_declarations

ENERGIES = '''from yarnverify.symbolic.declare import *


@energy
def hinge(x0: Point, x1: Point, x2: Point, x3: Point, *, k: Positive["J"], theta_0: Real["rad"]):
    """Angle between two triangles that share an edge, from a rest angle."""
    e = x1 - x0
    n1, n2 = cross(e, x2 - x0), cross(x3 - x0, e)
    return k * (atan2(dot(cross(n1, n2), unit(e)), dot(n1, n2)) - theta_0) ** 2


@energy
def triangle(
    x0: Point, x1: Point, x2: Point,
    *, mu: Positive["N/m"], nu: Positive["N/m"], a: Positive["m"], c: Positive["m"],
):
    """St. Venant and Kirchhoff's, of the rest shape (0, 0), (a, 0), (0, c)."""
    f = (x1 - x0) / a
    g = (x2 - x0) / c
    p, q = (dot(f, f) - 1) / 2, (dot(g, g) - 1) / 2
    return a * c / 2 * (mu * (p**2 + q**2 + dot(f, g) ** 2 / 2) + nu / 2 * (p + q) ** 2)


@energy
def rod(x0: Point, x1: Point, x2: Point, *, B: Positive["N m^2"], L: Positive["m"]):
    """Squared curvature binormal of a discrete rod."""
    e, f = x1 - x0, x2 - x1
    return 2 * B / L * square(cross(e, f)) / (length(e) * length(f) + dot(e, f)) ** 2


@energy
def lines(x0: Point, x1: Point, y0: Point, y1: Point, *, k: Positive["J m^-4"], h: Positive["m"]):
    """A barrier between the lines of two yarns, whose unit has more metres than floats bear at a size of 1e200."""
    n = cross(x1 - x0, y1 - y0)
    d = dot(y0 - x0, n) ** 2 / square(n)
    return -k * (d - h**2) ** 2 * log(d / h**2)


@energy(unit="1")
def strain(x0: Point, x1: Point, *, k: Positive["1"], L: Positive["m"]):
    """A number, which does not grow with the size."""
    return k * ((length(x1 - x0) - L) / L) ** 2


@energy(unit="1")
def bare(x0: Point, x1: Point, *, L: Positive["m"]):
    """A law whose slope is twice a difference, which SymPy multiplies out."""
    return (length(x1 - x0) / L - 1) ** 2
'''


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("extremes") / "mine"
    place.mkdir()
    (place / "energies.py").write_text(ENERGIES, encoding="utf-8")
    generate_kernels(False, of=project(place))  # a triangle's derivatives have hundreds of terms: seconds, once minutes
    return place


def declared(folder: Path, name: str) -> Any:
    return next(energy for energy in load_declarations(folder).energies if energy.name == name)


def test_a_flat_hinge_has_all_its_derivatives(folder: Path) -> None:
    angles = np.array([0.0, 1e-300, 1e-12, -1e-8, 1e-3, 1.0, np.pi - 1e-9])
    flat = np.repeat(np.array([[0.0, 0, 0, 1, 0, 0, 0.25, 1, 0, 0.5, 0, 0]]).T, angles.size, axis=1)
    flat[10], flat[11] = -np.cos(angles), np.sin(angles)
    values = {"k": np.full(angles.size, 2.0), "theta_0": np.where(np.arange(angles.size) % 2, 0.25, 0.0)}
    exact = truth(declared(folder, "hinge"), Points(flat, values))
    found = kernel("accurate", "hinge", folder).evaluate(flat, **values)
    assert exact.has_derivatives.all()
    for mine, true in zip(found, (exact.energy, exact.gradient, exact.hessian), strict=True):
        size = np.abs(true).reshape(-1, angles.size).max(axis=0)
        assert (np.abs(mine - true).reshape(-1, angles.size).max(axis=0) <= 1e-14 * size).all()


def test_a_folded_hinge_is_refused_by_name(folder: Path) -> None:
    folded = np.array([[0.0, 0, 0, 1, 0, 0, 0.25, 1, 0, 0.5, 1, 0]]).T
    with pytest.raises(ElementError, match=r"element 0: atan2.* jumps between -pi and pi"):
        kernel("accurate", "hinge", folder).energy(folded, k=1.0, theta_0=0.0)
    assert not truth(declared(folder, "hinge"), Points(folded, {"k": np.ones(1), "theta_0": np.zeros(1)})).has_energy[0]


@pytest.mark.parametrize("engine", ["numpy", "compiled"])
def test_both_engines_have_an_angle_of_two_arguments(folder: Path, engine: Any) -> None:
    q = np.random.default_rng(5).uniform(-1, 1, (12, 300))
    module = kernel("accurate", "hinge", folder)
    if engine == "compiled":
        pytest.importorskip("numba")
    plain, found = module.energy(q, k=1.0, theta_0=0.0), module.energy(q, k=1.0, theta_0=0.0, engine=engine)
    assert np.allclose(found, plain, rtol=1e-12, atol=1e-12 * np.abs(plain).max())


@pytest.mark.parametrize("name", ["triangle", "rod", "lines", "bare"])
@pytest.mark.parametrize("regime", ["scales", "out of range"])
def test_no_size_costs_what_an_energy_promises(folder: Path, name: str, regime: str) -> None:
    variants = ("fast", "accurate") if name == "lines" else ("fast", "accurate", "reference")
    cells = run_unit(Unit(name, "float64", regime, variants, 12, 4, False, str(folder)))["cells"]
    for cell in cells:
        for output in cell["outputs"].values():
            assert output["worst"] is None or output["of_target"] is None or float(output["of_target"]) <= 1


@pytest.mark.parametrize("power", [-900, -60, 0, 60, 900])
def test_a_result_without_metres_does_not_grow_with_the_size(folder: Path, power: int) -> None:
    size = 2.0**power
    q = np.array([[0.0, 0, 0, 2, 0, 0]]).T * size
    assert kernel("accurate", "strain", folder).energy(q, k=3.0, L=1.5 * size) == [3.0 * (0.5 / 1.5) ** 2]


def test_a_stiffness_is_not_scaled_out_of_range(folder: Path) -> None:
    """B of N m^2 would be taken by 2^-1586 with its lengths; the result is in range."""
    bent = np.array([[0.0, 0, 0, 1, 0, 0, 1, 1, 0]]).T
    size = 2.0**-793
    rod = kernel("reference", "rod", folder)
    assert rod.energy(bent * size, B=0.5, L=size) == rod.energy(bent, B=0.5, L=1.0) / size
