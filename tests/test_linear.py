"""Every linear solver on every kind of system: right, or an error."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import sparse

from tests.systems import moved, system, unknowns
from yarnverify.errors import NotRunError
from yarnverify.simulation.fabric import ring, weave, yarn
from yarnverify.simulation.linear import (
    Banded,
    ConjugateGradients,
    LinearSolveError,
    Multifrontal,
    PyAMG,
    Qdldl,
    Solver,
    SuperLU,
    lines_of,
)

Array = np.ndarray[Any, Any]
EPS = np.finfo(float).eps


def symmetric(name: str) -> tuple[Any, Any, Any]:
    """A matrix, its system and its fabric."""
    kind, _, unknown = name.partition(", ")
    fabric = {"yarn": lambda: yarn(3e-2, 30), "ring": lambda: ring(3e-2, 30), "cloth": lambda: weave("plain", (9, 7)),
              "tails": lambda: weave("satin 5", (6, 8), tails=1e-3)}[kind]()  # fmt: skip
    made = system(fabric, unknown)
    matrix = made.hessian(moved(fabric, size=0.1), definite=True)
    if unknown == "all":  # some mass, without which it may all slide along
        matrix = matrix + sparse.diags_array(1e-3 * matrix.diagonal() + 1e-9 * matrix.diagonal().max())
    return sparse.csc_array(matrix), made, fabric


DEFINITE = (
    "yarn, positions",
    "ring, positions",
    "cloth, positions",
    "cloth, all",
    "tails, slides of the warp",
    "tails, all",
)
DIRECT: dict[str, Callable[[Any], Solver]] = {
    "banded": lambda made: Banded(),
    "multifrontal": lambda made: Multifrontal(made.nodes, made.coordinates),
    "multifrontal, small groups": lambda made: Multifrontal(made.nodes, made.coordinates, leaf=2),
    "multifrontal, no coordinates": lambda made: Multifrontal(made.nodes),
    "multifrontal, no nodes": lambda made: Multifrontal(),
    "superlu": lambda made: SuperLU(made.nodes, made.coordinates),
    "superlu, its own order": lambda made: SuperLU(),
}


def backward(matrix: Any, x: Array, b: Array) -> float:
    """Residual relative to what rounding a solution makes of it, component by component."""
    return float((np.abs(b - matrix @ x) / (abs(matrix) @ np.abs(x) + np.abs(b))).max())


@pytest.mark.parametrize("name", DEFINITE)
@pytest.mark.parametrize("solver", DIRECT)
def test_direct_solvers_solve(solver: str, name: str) -> None:
    matrix, made, _ = symmetric(name)
    b = np.random.default_rng(1).normal(size=made.count)
    for copy in (b.copy(), -b):
        factor = DIRECT[solver](made).factorise(matrix)
        x = factor.solve(b)
        assert factor.negative == 0
        size = np.abs(matrix).sum(1).max() * np.abs(x).max() + np.abs(b).max()
        assert np.abs(b - matrix @ x).max() <= 200 * EPS * size
        assert np.array_equal(b, -copy) or np.array_equal(b, copy)  # the right-hand side is left alone


@pytest.mark.parametrize("name", ["yarn, positions", "cloth, positions", "tails, all"])
@pytest.mark.parametrize("solver", DIRECT)
def test_direct_solvers_count_negative_eigenvalues(solver: str, name: str) -> None:
    matrix, made, _ = symmetric(name)
    scale = float(np.median(matrix.diagonal()))
    rng = np.random.default_rng(2)
    for depth in (0.1, 1.0, 3.0):
        shifted = sparse.csc_array(matrix - sparse.diags_array(depth * scale * rng.uniform(0, 1, made.count)))
        value = np.linalg.eigvalsh(shifted.toarray())
        assert np.abs(value).min() > 1e-13 * np.abs(value).max()
        negative = int((value < 0).sum())
        factor = DIRECT[solver](made).factorise(shifted)
        if factor.negative is not None or "multifrontal" in solver:
            assert factor.negative == negative
        b = rng.normal(size=made.count)
        assert (
            np.abs(shifted @ factor.solve(b) - b).max() <= 1e-8 * np.abs(matrix).max() * np.abs(factor.solve(b)).max()
        )


@pytest.mark.parametrize("name", ["cloth, positions", "tails, positions", "cloth, all", "tails, all"])
def test_conjugate_gradients_solve_to_their_tolerance(name: str) -> None:
    matrix, made, fabric = symmetric(name)
    matrix = sparse.csc_array(matrix + sparse.diags_array(np.full(made.count, 1e-4 * matrix.diagonal().max())))
    b = np.random.default_rng(1).normal(size=made.count)
    lines = lines_of(fabric, made)
    assert np.array_equal(
        np.unique(np.concatenate([yarn for family in lines for yarn in family])), np.arange(made.count)
    )
    factor = ConjugateGradients(lines, tolerance=1e-12).factorise(matrix)
    assert factor.negative is None
    x = factor.solve(b)
    assert np.linalg.norm(matrix @ x - b) <= 2e-12 * np.linalg.norm(b)
    assert np.abs(x - np.linalg.solve(matrix.toarray(), b)).max() <= 1e-9 * np.abs(x).max()
    assert np.array_equal(factor.solve(b), x)
    assert not factor.solve(np.zeros(made.count)).any()


def test_a_yarn_line_is_all_that_a_single_yarn_needs() -> None:
    matrix, made, fabric = symmetric("yarn, positions")
    factor = ConjugateGradients(lines_of(fabric, made)).factorise(matrix)
    factor.solve(np.ones(made.count))
    assert factor.steps <= 2


@pytest.mark.parametrize("package", [("qdldl", Qdldl), ("pyamg", PyAMG)])
def test_solvers_of_other_packages(package: tuple[str, Any]) -> None:
    pytest.importorskip(package[0])
    matrix, made, _ = symmetric("cloth, positions")
    b = np.random.default_rng(1).normal(size=made.count)
    factor = package[1]().factorise(matrix)
    x = factor.solve(b)
    assert np.abs(matrix @ x - b).max() <= 1e-8 * (np.abs(matrix).max() * np.abs(x).max())


@pytest.mark.parametrize("package", [("qdldl", Qdldl), ("pyamg", PyAMG)])
def test_a_package_that_is_missing_is_named(package: tuple[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, package[0], None)
    with pytest.raises(NotRunError, match=f"pip install {package[0]}"):
        package[1]()


@pytest.mark.parametrize("solver", DIRECT)
def test_singular_systems_are_noticed(solver: str) -> None:
    thread = yarn(1e-2, 12)
    free = system(thread, "all")
    matrix = free.hessian(thread.Q)
    load = np.zeros(free.count)
    load[0] = 1.0  # pulls at a yarn that nothing holds
    for bad in (matrix, sparse.csc_array((12, 12)), sparse.csc_array(np.ones((12, 12)))):
        with pytest.raises(LinearSolveError):
            DIRECT[solver](free if bad is matrix else _plain(12)).factorise(bad).solve(load[: bad.shape[0]])


class _plain:
    coordinates = None

    def __init__(self, n: int) -> None:
        self.nodes = np.arange(n)


@pytest.mark.parametrize("solver", DIRECT)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_is_noticed(solver: str, value: float) -> None:
    matrix, made, _ = symmetric("cloth, positions")
    matrix.data[7] = value
    with pytest.raises(LinearSolveError):
        DIRECT[solver](made).factorise(matrix).solve(np.ones(made.count))


@pytest.mark.parametrize("solver", DIRECT)
def test_a_right_hand_side_that_is_not_finite_is_noticed(solver: str) -> None:
    matrix, made, _ = symmetric("cloth, positions")
    with pytest.raises(LinearSolveError):
        DIRECT[solver](made).factorise(matrix).solve(np.where(np.arange(made.count) == 3, np.nan, 1.0))


def test_conjugate_gradients_notice_what_they_cannot_do() -> None:
    matrix, made, fabric = symmetric("cloth, positions")
    lines = lines_of(fabric, made)
    shift = sparse.diags_array(np.full(made.count, float(np.median(matrix.diagonal()))))
    with pytest.raises(LinearSolveError, match="not positive definite"):
        ConjugateGradients(lines).factorise(sparse.csc_array(matrix - 3 * shift)).solve(np.ones(made.count))
    with pytest.raises(LinearSolveError, match="after 4 iterations"):
        ConjugateGradients(lines, iterations=3).factorise(matrix).solve(np.ones(made.count))
    with pytest.raises(LinearSolveError, match="residual nan"):
        ConjugateGradients(lines).factorise(matrix).solve(np.where(np.arange(made.count) == 3, np.nan, 1.0))
    matrix.data[5] = np.nan
    with pytest.raises(LinearSolveError):
        ConjugateGradients(lines).factorise(matrix).solve(np.ones(made.count))


def test_a_direction_of_negative_curvature_is_handed_on() -> None:
    matrix = sparse.csc_array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.1], [0.0, 0.1, 1.0]])
    factor = ConjugateGradients([[np.array([0]), np.array([1]), np.array([2])]]).factorise(matrix)
    with pytest.raises(LinearSolveError) as caught:
        factor.solve(np.array([1.0, -1.0, 0.2]))
    v = caught.value.direction
    assert v is not None and v @ (matrix @ v) < 0
    with pytest.raises(ValueError, match="lies on no line"):
        ConjugateGradients([[np.array([0, 2])]]).factorise(matrix)


RAW = {"banded": "BandFactor", "multifrontal": "MultifrontalFactor", "superlu": "SuperFactor"}


@pytest.mark.parametrize("solver", RAW)
@pytest.mark.parametrize("wrong", [lambda x: 1.001 * x, lambda x: x[::-1].copy(), lambda x: np.zeros_like(x)])
def test_a_wrong_solution_is_not_passed_on(
    solver: str, wrong: Callable[[Array], Array], monkeypatch: pytest.MonkeyPatch
) -> None:
    matrix, made, _ = symmetric("yarn, positions")
    factor = DIRECT[solver](made).factorise(matrix)
    assert type(factor).__name__ == RAW[solver]
    right = type(factor)._raw
    monkeypatch.setattr(type(factor), "_raw", lambda self, b: wrong(right(self, b)))
    b = matrix @ np.ones(made.count)
    try:
        x = factor.solve(b)
    except LinearSolveError as error:
        assert "residual" in str(error)
    else:  # refined once, which mends an error of a thousandth
        assert np.abs(x - 1).max() < 2e-6


@pytest.mark.parametrize("solver", ["banded", "multifrontal", "superlu", "gradients"])
def test_a_solver_given_another_pattern_of_the_same_size_starts_afresh(solver: str) -> None:
    one = sparse.csc_array(np.diag([4.0, 5, 6, 7]) + np.diag([1.0, 0, 0], 1) + np.diag([1.0, 0, 0], -1))
    other = sparse.csc_array(np.diag([4.0, 5, 6, 7]) + np.diag([0.0, 0], 2) + np.eye(4)[[3, 1, 2, 0]] * [1, 0, 0, 1])
    one.eliminate_zeros()
    other.eliminate_zeros()
    assert one.nnz == other.nnz
    made = DIRECT[solver](_plain(4)) if solver != "gradients" else ConjugateGradients([[np.arange(4)]])
    for matrix in (one, other, one):
        assert np.allclose(made.factorise(matrix).solve(np.ones(4)), np.linalg.solve(matrix.toarray(), np.ones(4)))


@pytest.mark.parametrize("solver", DIRECT)
def test_the_smallest_systems(solver: str) -> None:
    assert DIRECT[solver](_plain(1)).factorise(sparse.csc_array([[4.0]])).solve(np.array([2.0])) == [0.5]
    assert DIRECT[solver](_plain(0)).factorise(sparse.csc_array((0, 0))).solve(np.empty(0)).shape == (0,)


def test_matrices_that_are_not_symmetric() -> None:
    matrix, made, _ = symmetric("tails, all")
    skew = sparse.random_array(matrix.shape, density=0.02, rng=np.random.default_rng(0)) * matrix.diagonal().min()
    matrix = sparse.csc_array(matrix + skew - skew.T)
    factor = SuperLU(made.nodes, made.coordinates).factorise(matrix)
    x = factor.solve(np.ones(made.count))
    assert backward(matrix, x, np.ones(made.count)) < 1e-9


def test_bits_do_not_depend_on_what_a_solver_did_before() -> None:
    matrix, made, _ = symmetric("tails, all")
    b = np.random.default_rng(0).normal(size=made.count)
    for name in DIRECT:
        solver = DIRECT[name](made)
        first = solver.factorise(matrix).solve(b)
        solver.factorise(2.5 * matrix + sparse.diags_array(matrix.diagonal())).solve(b)
        assert np.array_equal(solver.factorise(matrix).solve(b), first)


@pytest.mark.parametrize("name", ["cloth, all", "ring, positions"])
def test_unknowns_of_all_sizes_do_not_hide_an_error(name: str) -> None:
    """Stiff along yarns, soft across: what a solver gets wrong in the soft part must not pass as small."""
    matrix, made, fabric = symmetric(name)
    unknown = unknowns(fabric, name.partition(", ")[2])
    assert unknown.size == made.count
    x = np.random.default_rng(3).normal(size=made.count)
    found = Multifrontal(made.nodes, made.coordinates).factorise(matrix).solve(matrix @ x)
    condition = np.linalg.cond(matrix.toarray())
    assert np.abs(found - x).max() <= 100 * EPS * condition


@pytest.mark.parametrize("name", ["cloth", "ring", "short yarns"])
def test_the_preconditioner_is_definite_wherever_the_matrix_is(name: str) -> None:
    """Near its limit: the matrix less almost its lowest eigenvalue, with all that couples neighbouring yarns."""
    fabric = {"cloth": lambda: weave("plain", (5, 5)), "ring": lambda: ring(8e-3, 8),
              "short yarns": lambda: weave("plain", (2, 9))}[name]()  # fmt: skip
    made = system(fabric, "positions")
    for seed in range(8):
        matrix = made.hessian(moved(fabric, seed, size=0.3), definite=True)
        value = np.linalg.eigvalsh(matrix.toarray())
        shift = value[0] - 1e-6 * value[-1]
        matrix = sparse.csc_array(matrix - sparse.diags_array(np.full(made.count, shift)))
        factor = ConjugateGradients(lines_of(fabric, made)).factorise(matrix)
        assert np.linalg.norm(matrix @ factor.solve(np.ones(made.count)) - 1) <= 1e-9 * made.count**0.5
