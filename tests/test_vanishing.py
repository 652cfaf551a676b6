"""Exponentials and logarithms near where they cancel: kernels of one's own energies keep their digits there, by proof."""

from __future__ import annotations

import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

from yarnverify.accuracy.conditioning import condition
from yarnverify.accuracy.metrics import measure
from yarnverify.accuracy.truth import Points, truth
from yarnverify.errors import NotRunError
from yarnverify.export.command import export
from yarnverify.kernels import wide
from yarnverify.symbolic import vanishing
from yarnverify.symbolic.declare import Declarations, Energy, load_declarations
from yarnverify.symbolic.modules import module_text
from yarnverify.symbolic.programs import derived_programs, proved

DECLARED = """
from yarnverify.symbolic.declare import *


@energy
def growth(u0: Sliding, u1: Sliding, *, k: Positive["J"], L: Positive["m"]):
    return k * (exp((u1 - u0) / L) - 1)


@energy
def slow(u0: Sliding, u1: Sliding, *, k: Positive["J"], L: Positive["m"]):
    return k * log(1 + (u1 - u0) / L)


@energy
def hanging(u0: Sliding, u1: Sliding, *, k: Positive["J"], L: Positive["m"]):
    y = (u1 - u0) / L
    return k * ((exp(y) + exp(-y)) / 2 - 1)


@energy
def fibre(x0: Point, x1: Point, *, k: Positive["J"], a: Positive["1"], L: Positive["m"]):
    e = length(x1 - x0) / L - 1
    return k * (exp(a * e**2) - 1)


@energy
def hencky(x0: Point, x1: Point, *, k: Positive["N"], L: Positive["m"]):
    return k * L * log(length(x1 - x0) / L) ** 2


@energy
def morse(x0: Point, x1: Point, *, k: Positive["J"], a: Positive["m^-1"], L: Positive["m"]):
    return k * (1 - exp(-a * (length(x1 - x0) - L))) ** 2


@energy(domain=lambda x0, x1, L: length(x1 - x0) < L, elsewhere="zero")
def barrier(x0: Point, x1: Point, *, k: Positive["N m^-1"], L: Positive["m"]):
    l = length(x1 - x0)
    return -k * (l - L) ** 2 * log(l / L)


@energy
def toda(u0: Sliding, u1: Sliding, *, k: Positive["J"], L: Positive["m"]):
    y = (u1 - u0) / L
    return k * (exp(y) - 1 - y)
"""
SCALAR = {"growth": mpmath.expm1, "slow": mpmath.log1p, "hanging": lambda x: 2 * mpmath.sinh(x / 2) ** 2}
OF_LENGTHS = ("fibre", "hencky", "morse", "barrier")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("vanishing")
    (found / "laws.py").write_text(DECLARED, encoding="utf-8")
    return found


@pytest.fixture(scope="module")
def kernels(folder: Path) -> Any:
    """A function of an energy's name and a variant: the energy and its kernel's module."""
    declared = {energy.name: energy for energy in load_declarations(folder).energies}

    @cache
    def found(name: str, variant: str) -> tuple[Energy, dict[str, Any]]:
        energy = declared[name]
        proof = proved(energy, Declarations((energy,), (), ()))
        programs, notes = derived_programs(energy, proof, variant)
        module: dict[str, Any] = {}
        exec(compile(module_text(energy, variant, programs, ["laws.py"], notes, proof)[0], name, "exec"), module)
        return energy, module

    return found


def states(energy: Energy) -> Points:
    """Lengths from rest itself to tenths of it away, and once far away."""
    draw = np.random.default_rng(1)
    strain = 10.0 ** draw.uniform(-16, -0.05, 40) * np.where(draw.random(40) < 0.5, -1, 1)
    strain[:3] = 0, 1.5, -0.999
    strain = -np.abs(strain) if energy.elsewhere == "zero" else strain
    direction = draw.normal(size=(3, 40))
    q = np.vstack([np.zeros((3, 40)), direction / np.linalg.norm(direction, axis=0) * 1.3 * (1 + strain)])
    given = {"k": 2.0, "a": 1.7, "L": 1.3}
    return Points(q, {p.label: np.full(40, given[p.label]) for p in energy.parameters})


@pytest.mark.parametrize("variant", ["accurate", "fast"])
@pytest.mark.parametrize("name", SCALAR)
def test_energies_keep_their_digits_down_to_the_smallest_arguments(kernels: Any, name: str, variant: str) -> None:
    x = np.concatenate([10.0 ** np.linspace(-300, 0, 301), np.random.default_rng(0).uniform(0.01, 1, 100)])
    if name == "hanging":
        x = x[x > 1e-150]  # its energy is x^2/2
    _, module = kernels(name, variant)
    found = module["energy"](np.vstack([np.zeros_like(x), x]), k=1.0, L=1.0)
    with mpmath.workdps(400):
        errors = [abs(mpmath.mpf(value) / SCALAR[name](mpmath.mpf(at)) - 1) for value, at in zip(found, x, strict=True)]
        assert max(errors) <= 4 * mpmath.mpf(2) ** -53  # the functions of a library are good to one or two


@pytest.mark.parametrize("name", [*SCALAR, *OF_LENGTHS])
def test_energy_gradient_and_hessian_near_rest_against_ball_arithmetic(kernels: Any, name: str) -> None:
    energy, module = kernels(name, "accurate")
    points = states(energy) if name in OF_LENGTHS else tiny(energy)
    exact = truth(energy, points)
    found = module["evaluate"](points.q, **points.parameters)
    for output, value in zip("EGH", found, strict=True):
        assert np.nanmax(measure(output, value, exact, energy.unknowns, "float64").worst_block) <= 16


@pytest.mark.parametrize("name", [*SCALAR, *OF_LENGTHS])
def test_plain_arithmetic_loses_what_the_rounding_of_coordinates_explains(kernels: Any, name: str) -> None:
    energy, module = kernels(name, "fast")
    points = states(energy) if name in OF_LENGTHS else tiny(energy)
    exact = truth(energy, points)
    with np.errstate(all="raise"):  # as every kernel: no warning
        found = module["evaluate"](points.q, **points.parameters)
    for output, value in zip("EG", found, strict=False):
        allowed = 16 + 8 * condition(output, energy, points, exact)
        assert (measure(output, value, exact, energy.unknowns, "float64").normwise <= allowed).all()


def tiny(energy: Energy) -> Points:
    x = 10.0 ** np.linspace(-140, 0, 57)
    return Points(np.vstack([np.zeros_like(x), x]), {p.label: np.ones_like(x) for p in energy.parameters})


def test_a_kernel_promises_what_it_keeps(kernels: Any) -> None:
    kept = {name: kernels(name, "accurate")[1]["KERNEL"].promise for name in (*SCALAR, *OF_LENGTHS, "toda")}
    assert kept == dict.fromkeys((*SCALAR, *OF_LENGTHS), "condition") | {"barrier": "none", "toda": "none"}


def test_what_is_not_promised_is_lost(kernels: Any) -> None:
    """``exp(y) - 1 - y`` is y^2/2, of which nothing is left at y = 1e-9: not explained, and so not promised."""
    energy, module = kernels("toda", "accurate")
    points = tiny(energy)
    exact = truth(energy, points)
    found = module["energy"](points.q, **points.parameters)
    error = measure("E", found, exact, energy.unknowns, "float64").normwise[0]
    assert (error > 16 + 8 * condition("E", energy, points, exact)[0]).any()


@pytest.mark.parametrize(
    "wrong",
    [
        lambda ratio: vanishing.log_ratio(ratio, ratio - 2),
        lambda ratio: vanishing.log_ratio(ratio, 1 - ratio),
        lambda ratio: vanishing.log_ratio(1 / ratio, ratio - 1),
        lambda ratio: -vanishing.log_ratio(ratio, ratio - 1),
    ],
)
def test_a_wrong_difference_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch, wrong: Any) -> None:
    energy = next(e for e in load_declarations(folder).energies if e.name == "hencky")
    monkeypatch.setattr(vanishing, "logarithm_of", wrong)
    with pytest.raises(NotRunError, match=r"hencky, smooth shape: derived block .* is refuted"):
        proved(energy, Declarations((energy,), (), ()))


def test_a_wrong_exponential_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    energy = next(e for e in load_declarations(folder).energies if e.name == "fibre")
    monkeypatch.setattr(vanishing, "sum_of", lambda value: vanishing.expm1(sp.S.One))
    with pytest.raises(NotRunError, match="fibre, smooth shape: derived block"):
        proved(energy, Declarations((energy,), (), ()))


@pytest.mark.parametrize("name", ["hencky", "hanging"])
def test_the_compiled_engine_has_these_functions_too(kernels: Any, name: str) -> None:
    pytest.importorskip("numba", reason="numba is not installed: the compiled engine was not run")
    energy, module = kernels(name, "fast")
    points = states(energy) if name in OF_LENGTHS else tiny(energy)
    for function in ("energy", "gradient"):  # which have expm1 and sinh, or log and log1p
        plain = module[function](points.q, **points.parameters)
        compiled = module[function](points.q, **points.parameters, engine="compiled")
        np.testing.assert_allclose(compiled, plain, rtol=1e-15)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
@pytest.mark.parametrize("name", ["hencky", "hanging"])
def test_c_source_with_these_functions_is_held_to_golden_vectors(folder: Path, tmp_path: Path, name: str) -> None:
    export(name, tmp_path, folder, 1, False)
    words = ["cc", "-std=c99", "-O2", "-ffp-contract=off", f"{name}_test.c", f"{name}.c", "-o", "golden", "-lm"]
    subprocess.run(words, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "golden"], capture_output=True, text=True)
    assert done.returncode == 0 and "states: 0 wrong" in done.stdout, done.stdout


# -- any size ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "size", "given"),
    [
        ("fibre", 2.0**17, {"k": 1.0, "a": 2.0**15, "L": 1.75 * 2.0**16}),  # 1e290 times what overflows on the way
        ("fibre", 1e-190, {"k": 1e-200, "a": 2.0, "L": 1.1e-190}),
        ("hencky", 1e-190, {"k": 1e-30, "L": 1.3e-190}),
        ("hencky", 1e180, {"k": 1e100, "L": 1e-150}),  # a ratio that no float holds
        ("morse", 3e160, {"k": 1.0, "a": 1e-160, "L": 2e160}),
        ("morse", 1e-170, {"k": 1.0, "a": 1e20, "L": 1.5e-170}),  # exp(x) - 1 of 1e-150, squared
    ],
)
def test_lengths_of_any_size(kernels: Any, name: str, size: float, given: dict[str, float]) -> None:
    energy, module = kernels(name, "accurate")
    direction = np.array([0.6, 0.0, 0.8])[:, None]
    points = Points(np.vstack([np.zeros((3, 1)), size * direction]), {key: np.array([v]) for key, v in given.items()})
    exact = truth(energy, points)
    found = module["evaluate"](points.q, **points.parameters)
    for output, value in zip("EGH", found, strict=True):
        errors = measure(output, value, exact, energy.unknowns, "float64").normwise[:, 0]
        allowed = 16 + 8 * (
            condition(output, energy, points, exact) if output != "H" else condition("G", energy, points, exact)
        )
        assert (np.isnan(errors) | (errors <= allowed.max())).all(), (output, errors)  # NaN: beyond what floats hold


@np.errstate(all="ignore")  # as kernels have it
@pytest.mark.parametrize("name", ["exp", "expm1", "sinh", "log", "log1p"])
def test_functions_of_numbers_of_any_size(name: str) -> None:
    """Against mpmath, and with the very bits of NumPy where floats do."""
    exponents = np.r_[-3000:3000:37, -60:11] if name in ("log", "log1p") else np.r_[-3000:-60:37, -60:17]
    mantissas = np.random.default_rng(7).uniform(0.5, 1, exponents.size)
    signs = (1, -1) if name in ("exp", "expm1", "sinh") else (1,)
    for sign in signs:
        mantissa, exponent = wide._CALLS[name]((sign * mantissas, exponents))
        with mpmath.workdps(1000):
            for m, e, a, b in zip(mantissas, exponents, mantissa, exponent, strict=True):
                true = getattr(mpmath, name)(mpmath.ldexp(mpmath.mpf(sign * m), int(e)))
                if true != 0:
                    assert abs(mpmath.ldexp(mpmath.mpf(float(a)), int(b)) / true - 1) < 4 * 2.0**-53, (m, e)
        x = np.ldexp(sign * mantissas, exponents.clip(-90, 9).astype(np.int32))
        assert (wide.rounded(wide._CALLS[name](wide.wide(x))) == getattr(np, name)(x)).all()
