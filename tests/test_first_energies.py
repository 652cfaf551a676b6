"""What people of cloth, rods and materials declare first: roots, places and speeds that are given, a hinge as it is printed."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

from tests.commands import caller
from tests.test_export import build, needs_compiler
from yarnverify.accuracy.cells import Unit, kernel, run_unit
from yarnverify.errors import InputError
from yarnverify.export.command import export
from yarnverify.generation import generate_kernels
from yarnverify.kernels.inputs import ElementError
from yarnverify.library import Shelf
from yarnverify.project import project
from yarnverify.simulation.fabric import yarn
from yarnverify.simulation.setting import Moving, Static
from yarnverify.simulation.tables import table
from yarnverify.simulation.terms import Term
from yarnverify.source import Source
from yarnverify.symbolic.court import Verdict
from yarnverify.symbolic.declare import (
    Energy,
    Expr,
    Point,
    Positive,
    Real,
    Velocity,
    atan2,
    cross,
    dot,
    energy,
    length,
    load_declarations,
)
from yarnverify.symbolic.derive import derive_declared
from yarnverify.symbolic.invariants import prove_invariants
from yarnverify.symbolic.plain import plain
from yarnverify.symbolic.record import prove_source

HEAD = "from yarnverify.symbolic.declare import *\n"
ENERGIES = """

@energy
def hertz(x0: Point, x1: Point, *, E: Positive["Pa"], R: Positive["m"]):
    delta = 2 * R - length(x1 - x0)
    return 8 * E * sqrt(R / 2) * sqrt(delta) ** 5 / 15


@energy
def thick(x0: Point, x1: Point, *, k: Positive["N m^-1"], R: Positive["m"]):
    return PI * k * (length(x1 - x0) - 3 * R / 2) ** 2


@energy
def lennard_jones(x0: Point, x1: Point, *, epsilon: Positive["J"], sigma: Positive["m"]):
    ratio = sigma / length(x1 - x0)
    return 4 * epsilon * (ratio**12 - ratio**6)


@energy(domain=lambda x0, x1, L: length(x1 - x0) > L, elsewhere="zero")
def tether(x0: Point, x1: Point, *, k: Positive["N m^-1"], L: Positive["m"]):
    return k * (length(x1 - x0) - L) ** 2 / 2


@energy
def yielding(x0: Point, x1: Point, *, Y: Positive["N"], L: Positive["m"], e_0: Positive["1"]):
    e = (length(x1 - x0) - L) / L
    return Y * L * e_0 * (sqrt(1 + (e / e_0) ** 2) - 1)


@energy
def two_roots(x0: Point, x1: Point, *, k: Positive["N"], L: Positive["m"], d: Positive["1"]):
    e = length(x1 - x0) / L - 1
    return k * L * (d**2 * (sqrt(1 + (e / d) ** 2) - 1) + sqrt(1 + e**2) - 1)


@energy
def smoothed(x0: Point, x1: Point, *, k: Positive["N"], h: Positive["m"]):
    return k * (sqrt(length(x1 - x0) ** 2 + h**2) - h)


@energy(unit="W")
def drag(v0: Velocity, *, w: Vector["m s^-1"], c: Positive["kg m^-1"]):
    return c * length(v0 - w) ** 3 / 3


@energy
def tethers(x0: Point, x1: Point, *, a: Vector["m"], k: Positive["N m^-1"], L: Positive["m"]):
    return k * ((length(x0 - a) - L) ** 2 + (length(x1 - x0) - L) ** 2) / 2
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("first") / "firsts"
    place.mkdir()
    (place / "energies.py").write_text(HEAD + ENERGIES, encoding="utf-8")
    generate_kernels(False, of=project(place))
    return place


def l(q: Any, p: Any = (0, 0, 0)) -> Any:  # noqa: E743
    return mpmath.sqrt(sum((a - b) ** 2 for a, b in zip(q, p, strict=True)))


def yielding(q: Any, Y: Any, L: Any, e_0: Any) -> Any:
    t = ((l(q[3:], q[:3]) - L) / L / e_0) ** 2
    return Y * L * e_0 * t / (mpmath.sqrt(1 + t) + 1)


LAWS: dict[str, Any] = {
    "hertz": lambda q, E, R: 8 * E * mpmath.sqrt(R / 2) * mpmath.sqrt(2 * R - l(q[3:], q[:3])) ** 5 / 15,
    "thick": lambda q, k, R: mpmath.pi * k * (l(q[3:], q[:3]) - 3 * R / 2) ** 2,
    "lennard_jones": lambda q, epsilon, sigma: (
        4 * epsilon * ((sigma / (r := l(q[3:], q[:3]))) ** 12 - (sigma / r) ** 6)
    ),
    "yielding": yielding,
    "smoothed": lambda q, k, h: k * (mpmath.sqrt(l(q[3:], q[:3]) ** 2 + h**2) - h),
    "drag": lambda q, w, c: c * l(q, w) ** 3 / 3,
    "tethers": lambda q, a, k, L: k * ((l(q[:3], a) - L) ** 2 + (l(q[3:], q[:3]) - L) ** 2) / 2,
}


def skew(size: float) -> list[float]:
    return [0.6 * size, 0.48 * size, 0.64 * size]


TWO = [0.25, -0.5, 1.0]
STATES: list[tuple[str, list[float], dict[str, Any]]] = [
    ("hertz", [0, 0, 0, 0.25, 0.5, 0.25], {"E": 3.0, "R": 0.75}),
    ("hertz", [0, 0, 0, 1, 0, 0], {"E": 3.0, "R": 0.5 + 2**-30}),
    ("hertz", [0, 0, 0, *skew(1 - 2.0**-30)], {"E": 3.0, "R": 0.5}),
    ("thick", [0, 0, 0, *skew(1.05 + 1e-9)], {"k": 3.0, "R": 0.7}),
    ("lennard_jones", [0, 0, 0, *skew(3e-10)], {"epsilon": 1.65e-21, "sigma": 3.4e-10}),
    *(("yielding", [0, 0, 0, 1 + e, 0, 0], {"Y": 2.0, "L": 1.0, "e_0": 0.001}) for e in (0, 1e-12, 1e-6, -1e-3, 0.5)),
    *(("smoothed", [*TWO, 0.25 + d, -0.5, 1.0 - d], {"k": 2.0, "h": 1.0}) for d in (2.0**-30, 2.0**-10, 1.0)),
    ("drag", [1.0, 2.0, 3.5], {"w": TWO, "c": 0.5}),
    ("tethers", [1.0, 2.0, 3.5, 0.5, 2.25, 3.0], {"a": TWO, "k": 3.0, "L": 0.75}),
]


@pytest.mark.parametrize(("name", "q", "values"), STATES)
def test_values_slopes_and_bends_are_those_of_long_differences(
    folder: Path, name: str, q: list[float], values: dict[str, Any]
) -> None:
    """Differences in 100 digits, with a step of 1e-30: an oracle without a line of this package."""
    columns = {key: np.reshape(value, (3, 1)) if isinstance(value, list) else value for key, value in values.items()}
    found = kernel("accurate", name, folder).evaluate(np.array(q)[:, None], **columns)
    with mpmath.workdps(100):
        step, n = mpmath.mpf(10) ** -30, len(q)

        def at(*moves: tuple[int, int]) -> Any:
            moved = [mpmath.mpf(part) for part in q]
            for row, sign in moves:
                moved[row] += sign * step
            return LAWS[name](
                moved, **{k: [*map(mpmath.mpf, v)] if isinstance(v, list) else mpmath.mpf(v) for k, v in values.items()}
            )

        slopes = [(at((i, 1)) - at((i, -1))) / (2 * step) for i in range(n)]
        bends = [
            [sum(a * b * at((i, a), (j, b)) for a in (1, -1) for b in (1, -1)) / (4 * step**2) for j in range(n)]
            for i in range(n)
        ]
        for mine, true in zip(found, ([at()], slopes, [part for row in bends for part in row]), strict=True):
            error = mpmath.norm([mpmath.mpf(float(a)) - b for a, b in zip(np.ravel(mine), true, strict=True)])
            assert error <= 16 * 2.0**-53 * mpmath.norm(true) + mpmath.mpf(10) ** -35


@pytest.mark.parametrize("name", ["hertz", "thick", "lennard_jones", "yielding", "two_roots", "smoothed"])
@pytest.mark.parametrize("regime", ["moderate", "ratios", "scales", "without value"])
def test_hard_cases_cost_no_more_than_is_promised(folder: Path, name: str, regime: str) -> None:
    """Roots of numbers and pi in twice the digits; multiples of lengths in sums; high powers of large and small lengths."""
    variants = ("fast", "accurate", "reference")
    for cell in run_unit(Unit(name, "float64", regime, variants, 16, 4, False, str(folder)))["cells"]:
        for output in cell["outputs"].values():
            assert output["worst"] is None or float(output["of_target"]) <= 1, cell


def test_powers_that_cancel_promise_what_their_condition_allows(folder: Path) -> None:
    promises = {name: kernel("accurate", name, folder).KERNEL.promise for name in ("hertz", "thick", "lennard_jones")}
    assert promises == {"hertz": "units", "thick": "units", "lennard_jones": "condition"}


def test_powers_fit_in_single_precision(folder: Path) -> None:
    """The 12th power of an atom's size does not; that of a ratio of sizes does."""
    q, values = np.array([[0, 0, 0, 3.5e-10, 1e-10, 0]]).T, {"epsilon": 1.65e-21, "sigma": 3.4e-10}
    lj = kernel("accurate", "lennard_jones", folder)
    single, double = (lj.evaluate(q.astype(kind), **values) for kind in (np.float32, np.float64))
    for a, b in zip(single, double, strict=True):
        assert np.abs(a - b).max() <= 1e-5 * np.abs(b).max()


def test_what_is_slack_may_have_no_length(folder: Path) -> None:
    ends = np.array([[0.0, 0, 0, 0, 0, 0], [0, 0, 0, 2, 0, 0]]).T
    energies, forces, _ = kernel("accurate", "tether", folder).evaluate(ends, k=2.0, L=1.0)
    assert energies.tolist() == [0.0, 1.0] and forces[:, 0].tolist() == [0.0] * 6 and forces[3, 1] == 2.0
    with pytest.raises(ElementError, match="element 0: the segment x0-x1 has length zero"):
        kernel("accurate", "hertz", folder).energy(ends, E=1.0, R=2.0)


@needs_compiler
@pytest.mark.parametrize("name", ["tether", "smoothed"])
def test_the_c_source_knows_what_holds_without_length(folder: Path, tmp_path: Path, name: str) -> None:
    """Where an energy is slack, which has digits below the last of no length; and where it is smooth."""
    lines = export(name, tmp_path, folder, 6, False)
    assert "promises no digits" not in lines[-1]
    build(tmp_path, f"{name}_test.c", f"{name}.c", "-o", "held")
    assert subprocess.run([tmp_path / "held"], capture_output=True).returncode == 0


AREA = """

@energy
def area(x0: Point, x1: Point, x2: Point, *, k: Positive["N m^-1"]):
    return k * length(cross(x1 - x0, x2 - x0))
"""


def test_c_source_that_promises_no_digits_says_so(tmp_path: Path) -> None:
    (tmp_path / "areas").mkdir()
    (tmp_path / "areas" / "area.py").write_text(HEAD + AREA, encoding="utf-8")
    lines = export("area", tmp_path, tmp_path / "areas", 1, False)
    assert "area.c is differentiated step by step, which promises no digits" in lines[-1]


SLIDING = (
    HEAD
    + """

@energy(unit="W")
def sliding(v0: Velocity, v1: Velocity, *, n: {kind}, f: Positive["N"], e: Positive["m s^-1"]):
    v = v1 - v0
    return f * sqrt(square(v - dot(v, n) * n) + e**2)
"""
)
CODE = """
def sliding(v0, v1, n, f, e):
    v = v1 - v0
    across = v - (v @ n) * n
    return -f * across / (across @ across + e * e) ** 0.5
"""


@pytest.mark.parametrize(("kind", "status"), [("Direction", 0), ('Vector["1"]', 1)])
def test_code_that_takes_a_normal_for_one_is_tried_on_normals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], kind: str, status: int
) -> None:
    """The slope of this energy has ``n n^T n n^T``, which code shortens to ``n n^T``: right where n has length 1."""
    (tmp_path / f"contact{status}").mkdir()
    (tmp_path / f"contact{status}" / "sliding.py").write_text(SLIDING.replace("{kind}", kind), encoding="utf-8")
    (tmp_path / "mine.py").write_text(CODE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    arguments = ("mine.py", "--energy", f"contact{status}/sliding", "--returns", "v1", "--force")
    assert caller(monkeypatch, capsys)("check", *arguments)[0] == status


@pytest.mark.parametrize(
    ("variant", "dtype"),
    [
        ("fast", np.float64),
        ("accurate", np.float64),
        ("reference", np.float64),
        ("fast", np.float32),
        ("accurate", np.float32),
    ],
)
def test_laws_of_a_squared_length_are_smooth_where_it_is_zero(folder: Path, variant: str, dtype: Any) -> None:
    """``k (sqrt(l^2 + h^2) - h)`` has no slope there, and ``k/h`` for a bend in every direction."""
    ends = np.array([[0.5, -1, 2, 0.5, -1, 2], [0.5, -1, 2, 0.5, 2, 6]], dtype).T
    smoothed = kernel(variant, "smoothed", folder)
    energies, slopes, bends = smoothed.evaluate(ends, k=3.0, h=0.5)
    part = 6 * np.eye(3)
    assert energies[0] == 0 and not slopes[:, 0].any() and np.abs(slopes[:, 1]).max() > 2
    assert np.abs(bends[:, :, 0] - np.block([[part, -part], [-part, part]])).max() <= 1e-6
    assert not smoothed.gradient(ends, k=3.0, h=0.5)[:, 0].any()
    assert smoothed.hessian(ends, k=3.0, h=0.5)[:, :, 0].tolist() == bends[:, :, 0].tolist()
    for name, values in (("yielding", {"Y": 1, "L": 1, "e_0": 1}), ("lennard_jones", {"epsilon": 1, "sigma": 1})):
        with pytest.raises(ElementError, match="element 0: the segment x0-x1 has length zero"):
            kernel("accurate", name, folder).energy(ends, **values)


def test_whatever_is_measured_from_a_given_place_or_speed_is_proved(folder: Path) -> None:
    """No translation gives the rows of a point then: what is given does not move with it."""
    for declared in load_declarations(folder).energies:
        derivation = derive_declared(declared, ())
        assert derivation is not None
        assert {finding.verdict for finding in derivation.check().values()} == {Verdict.PROVED}


@energy(unit="W", unchanged=("translation",))
def friction(v0: Velocity, v1: Velocity, *, c: Positive["N s m^-1"]) -> Expr:
    return c * length(v1 - v0) ** 2 / 2


@energy(unchanged=("sliding",))
def bar(x0: Point, x1: Point, *, k: Positive["N m^-1"]) -> Expr:
    return k * length(x1 - x0) ** 2 / 2


@pytest.mark.parametrize(("declared", "lacking"), [(friction, 'Point or Vector\\["m"\\]'), (bar, "Sliding")])
def test_a_motion_that_moves_nothing_is_told(declared: Energy, lacking: str) -> None:
    with pytest.raises(
        InputError, match=rf"{declared.name}: unchanged by \w+ says nothing here: there is no {lacking}"
    ):
        prove_invariants(declared)


@energy
def hinge(x0: Point, x1: Point, x2: Point, x3: Point, *, k: Positive["J"], bar_theta: Real["rad"]) -> Expr:
    e = x1 - x0
    n1, n2 = cross(e, x2 - x0), cross(x3 - x0, e)
    return k * (atan2(dot(cross(n1, n2), e) / length(e), dot(n1, n2)) - bar_theta) ** 2


def test_products_keep_their_parentheses_in_plain_text() -> None:
    text = plain(hinge.expression)
    assert "(((x1 - x0) × (x2 - x0)) × ((x3 - x0) × (x1 - x0)))ᵀ (x1 - x0)" in text and "bar_θ" in text


HINGE = r"""## Hinge
$$\mathbf{e} = \mathbf{x}_1 - \mathbf{x}_0, \quad \mathbf{n}_1 = \mathbf{e} \times (\mathbf{x}_2 - \mathbf{x}_0),
  \quad \mathbf{n}_2 = (\mathbf{x}_3 - \mathbf{x}_0) \times \mathbf{e} \quad (1)$$
$$\theta = \operatorname{atan2}\left(
  \frac{(\mathbf{n}_1 \times \mathbf{n}_2)^T \mathbf{e}}{\|\mathbf{e}\|}, \mathbf{n}_1^T \mathbf{n}_2\right) \quad (2)$$
$$V = \frac{1}{2} k (\theta - \theta_0)^2 \quad (3)$$
$$\mathbf{F}_{\mathbf{x}_2} = k (\theta - \theta_0) \frac{\|\mathbf{e}\|}{\mathbf{n}_1^T \mathbf{n}_1} \mathbf{n}_1 \quad (4)$$
$$\mathbf{F}_{\mathbf{x}_3} = k (\theta - \theta_0) \frac{\|\mathbf{e}\|}{\mathbf{n}_2^T \mathbf{n}_2} \mathbf{n}_1 \quad (5)$$
$$\mathbf{F}_{\mathbf{x}_0} = -\mathbf{F}_{\mathbf{x}_1} - \mathbf{F}_{\mathbf{x}_2} - \mathbf{F}_{\mathbf{x}_3} \quad (6)$$
"""


def test_the_forces_of_a_hinge_are_proved_and_their_misprint_is_mended() -> None:
    """By the slope of an angle of two arguments, which is free of roots; an arc cosine has one that hides what is equal."""
    record = prove_source(Source("hinge.md", HINGE), Shelf(None, "hinge.md", "by itself alone"))
    found = {claim["equation"]: claim for claim in record["claims"]}
    assert [found[n]["verdict"] for n in "456"] == ["proved", "refuted", "proved"]
    assert found["5"]["change"] == r"index: \mathbf{n}_1 should be \mathbf{n}_2"


def test_kernels_of_an_older_energy_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "edited"
    place.mkdir()
    (place / "area.py").write_text(HEAD + AREA, encoding="utf-8")
    generate_kernels(False, of=project(place))
    monkeypatch.chdir(tmp_path)
    run = caller(monkeypatch, capsys)
    assert run("accuracy", "edited/area", "--executor", "serial")[0] == 0
    (place / "area.py").write_text(HEAD + AREA.replace("k *", "2 * k *"), encoding="utf-8")
    for command in (("accuracy", "edited/area", "--executor", "serial"), ("fuzz", "edited/area", "--time", "2")):
        status, out, _ = run(*command)
        assert status == 1 and "The kernels are not what the energies give by now" in out
        assert out.count("yarnverify generate edited") == 1


def test_a_scene_does_not_take_positions_for_velocities(folder: Path) -> None:
    fabric = yarn(0.1, 2)
    wind = kernel("accurate", "drag", folder)
    term = Term(wind, table(wind, {"v0": [0, 1, 2]}), {"w": (0.0, 0.0, 0.0), "c": 1.0})
    with pytest.raises(InputError, match="drag is of velocities: a scene has energies of positions"):
        Static(fabric, [term], fabric.positions([1]))
    mass: Any = [1e-3]
    with pytest.raises(InputError, match="kinetic is a Term, such as"):
        Moving(fabric, [], fabric.positions([1]), mass, 1.0, 0.1)
