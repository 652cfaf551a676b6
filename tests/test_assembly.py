"""Sums over elements: right, symmetric, of the same bits however they are made, and only of what is unknown."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.systems import FABRICS, UNKNOWNS, moved, system, terms_of, unknowns, written_out
from yarnverify.kernels import ElementError, bending, stretch
from yarnverify.simulation import calls
from yarnverify.simulation.assembly import System
from yarnverify.simulation.fabric import bends, segments, weave, yarn
from yarnverify.simulation.pattern import Elements, Pattern
from yarnverify.simulation.terms import Term

EPS = np.finfo(float).eps


@pytest.mark.parametrize("fabric", FABRICS)
def test_sums_are_those_of_a_loop_over_elements(fabric: str) -> None:
    cloth = FABRICS[fabric]()
    Q = moved(cloth)
    made = system(cloth)
    energy, gradient, matrix, size = written_out(list(made.terms), made.loads, Q)
    assert np.count_nonzero(matrix) > 0
    found = made.evaluate(Q)
    assert abs(found.energy - energy) <= 20 * EPS * size
    assert abs(made.energy(Q) - energy) <= 20 * EPS * size
    assert abs(sum(made.energies(Q).values()) - made.loads @ Q - energy) <= 20 * EPS * size
    strong = np.abs(gradient).max()
    assert np.abs(made.slope(Q) - gradient).max() <= 20 * EPS * strong
    for name in UNKNOWNS:
        some = system(cloth, name)
        active = some.active
        found = some.evaluate(Q)
        assert some.count == active.size
        assert np.array_equal(found.gradient, made.slope(Q)[active])
        assert np.array_equal(some.gradient(Q), found.gradient)
        dense = found.matrix.toarray()
        assert np.array_equal(dense, dense.T)
        stiff = np.abs(matrix[active]).max(1)  # rows of points and of sliding coordinates differ in size
        limit = 40 * EPS * np.sqrt(stiff[:, None] * stiff)
        assert (np.abs(dense - matrix[np.ix_(active, active)]) <= limit).all()


@pytest.mark.parametrize("name", UNKNOWNS)
def test_unknowns_left_out_take_their_rows_along_and_change_no_bit(name: str) -> None:
    cloth = weave("twill 2/1", (4, 4), tails=1e-3)
    Q = moved(cloth)
    for definite in (False, True):
        every, some = system(cloth).hessian(Q, definite).toarray(), system(cloth, name).hessian(Q, definite).toarray()
        active = unknowns(cloth, name)
        place = np.searchsorted(unknowns(cloth, "all"), active)
        assert np.array_equal(some, every[np.ix_(place, place)])


def test_only_what_can_be_nonzero_is_stored() -> None:
    cloth = weave("plain", (4, 4))
    held = System(cloth.Q, terms_of(cloth), unknowns(cloth, "positions"))
    matrix = held.hessian(moved(cloth))
    assert matrix.nnz == (np.abs(matrix.toarray()) > 0).sum() + (matrix.data == 0).sum()
    couples = {(i // 3, j // 3) for i, j in zip(*matrix.nonzero(), strict=True)}
    rows = [set(t.table.rows[:9, k] // 3) for t in held.terms for k in range(t.table.count) if len(t.table.rows) >= 8]
    nodes = held.active[::3] // 3
    for i, j in couples:
        assert any({nodes[i], nodes[j]} <= row for row in rows)


def test_bits_do_not_depend_on_what_was_done_before_or_by_what() -> None:
    cloth = weave("satin 5", (6, 5))
    first, second = moved(cloth, 1), moved(cloth, 2)
    made = system(cloth)
    one = made.evaluate(first, True)
    kept = (one.energy, one.gradient.copy(), one.matrix.data.copy())
    made.evaluate(second)
    made.energy(second)
    two = made.evaluate(first, True)
    compiled = system(cloth, engine="compiled").evaluate(first, True)
    for other in (one, two, compiled, system(cloth).evaluate(first, True)):
        assert kept[0] == other.energy
        assert np.array_equal(kept[1], other.gradient)
        assert np.array_equal(kept[2], other.matrix.data)


def test_derivatives_agree_with_differences_to_second_order() -> None:
    cloth = weave("plain", (3, 3))
    made, Q = system(cloth), moved(cloth, size=0.05)
    way = np.zeros(cloth.size)
    way[made.active] = np.random.default_rng(5).normal(size=made.count) * 1e-3 * cloth.L
    errors = []
    for h in (1.0, 0.5):
        up, down = Q + h * way, Q - h * way
        by_energy = (made.energy(up) - made.energy(down)) / (2 * h) - made.gradient(Q) @ way[made.active]
        by_slope = (made.gradient(up) - made.gradient(down)) / (2 * h) - made.hessian(Q) @ way[made.active]
        errors.append((abs(by_energy), np.abs(by_slope).max()))
    for coarse, fine in zip(*errors, strict=True):
        assert 1.9 < np.log2(coarse / fine) < 2.1


def test_large_tables_go_by_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    cloth = weave("plain", (5, 5))
    Q, whole = moved(cloth), system(cloth).evaluate(moved(cloth))
    monkeypatch.setattr(calls, "CHUNK", 7)
    parts = system(cloth).evaluate(Q)
    assert np.isclose(parts.energy, whole.energy, rtol=1e-14)
    assert np.allclose(parts.matrix.data, whole.matrix.data, rtol=0, atol=1e-14 * np.abs(whole.matrix.data).max())


def test_a_bad_element_is_named_by_its_place_in_the_system(monkeypatch: pytest.MonkeyPatch) -> None:
    thread = yarn(1e-2, 20)
    made = System(thread.Q, terms_of(thread, obstacles=False), thread.positions())
    Q = thread.Q.copy()
    Q[thread.position(13)] = Q[thread.position(12)]
    monkeypatch.setattr(calls, "CHUNK", 5)
    for call in (made.energy, made.evaluate, made.slope):
        with pytest.raises(ElementError, match=r"stretch: element 12: the segment x0-x1 has length zero"):
            call(Q)
    Q = thread.Q.copy()
    Q[thread.position(17)[0, 1]] = np.nan
    with pytest.raises(ElementError, match=r"stretch: element 16: x1.y is nan"):
        made.evaluate(Q)
    assert np.isfinite(made.evaluate(thread.Q).energy)  # and it goes on from there


def test_the_worst_element_is_the_one_that_pulls() -> None:
    thread = yarn(1e-2, 10)
    made = System(thread.Q, terms_of(thread, obstacles=False), thread.positions())
    Q = thread.Q.copy()
    Q[thread.position(10)[0, 0]] += 1e-3
    worst = made.worst(Q)
    assert worst is not None and (worst.term, worst.element) == ("stretch", 9)
    assert worst.energy == stretch.energy(worst.state[:, None], k_s=made.terms[0].parameters["k_s"][9])[0]
    assert System(thread.Q, made.terms, []).worst(Q) is None


def test_nothing_unknown_and_nothing_there() -> None:
    thread = yarn(1e-2, 1)
    none = System(thread.Q, terms_of(thread), [])
    found = none.evaluate(thread.Q)
    assert found.gradient.shape == (0,) and found.matrix.shape == (0, 0)
    assert bends(thread).count == 0
    alone = System(thread.Q, [Term(bending, bends(thread), {"k_b": 1.0})], thread.positions())
    found = alone.evaluate(thread.Q)
    assert (
        found.energy == 0 and not found.gradient.any() and found.matrix.shape == (6, 6) and not found.matrix.data.any()
    )
    assert System(thread.Q, [], thread.positions()).evaluate(thread.Q).energy == 0


def test_nodes_of_unknowns_and_where_they_lie() -> None:
    cloth = weave("plain", (4, 3), tails=1e-3)
    made = system(cloth, "slides of the warp")
    assert made.coordinates is not None
    chain = cloth.chain
    for unknown, node in zip(made.active, made.nodes, strict=True):
        mine = unknown // 3 if unknown < 3 * cloth.nodes else chain.nodes[np.flatnonzero(chain.slides == unknown)[0]]
        assert np.array_equal(made.coordinates[node], cloth.points(cloth.Q)[mine])


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"active": [3, 3]}, "listed twice"),
    ({"active": [-1]}, "indices into a configuration of 33 entries"),
    ({"active": [33]}, "indices into a configuration of 33 entries"),
    ({"active": [1.5]}, "whole numbers"),
    ({"loads": np.zeros(5)}, r"loads must have shape \(33,\), not \(5,\)"),
    ({"loads": np.full(33, np.nan)}, "loads must be finite"),
    ({"Q": np.zeros(30)}, "stretch: an element reads beyond the configuration"),
    ({"engine": "fortran"}, "engine"),
    ({"definite": "never"}, "definite"),
]


@pytest.mark.parametrize(("change", "message"), WRONG)
def test_what_cannot_be_a_system_is_refused(change: dict[str, Any], message: str) -> None:
    thread = yarn(1e-2, 7)
    given = {"Q": np.append(thread.Q, 0.0), "terms": terms_of(thread), "active": thread.positions(), **change}
    with pytest.raises(ValueError, match=message):
        System(**given)


def test_what_cannot_be_a_term_is_refused() -> None:
    thread = yarn(1e-2, 7)
    for parameters, message in (
        ({}, "stretch: needs parameter k_s"),
        ({"k_s": 1.0, "k_z": 2.0}, "stretch: has no parameter k_z"),
        ({"k_s": -1.0}, "stretch: k_s"),
        ({"k_s": np.nan}, "stretch: k_s"),
        ({"k_s": np.ones(3)}, "stretch: k_s"),
        ({"k_s": "stiff"}, "stretch: k_s"),
    ):
        with pytest.raises((ValueError, TypeError), match=message):
            Term(stretch, segments(thread), parameters)
    with pytest.raises(ValueError, match=r"shape \(32,\), not \(3,\)"):
        system(thread).energy(np.zeros(3))


def test_rows_of_a_point_must_follow_each_other() -> None:
    rows = np.array([[0], [2], [1]])
    with pytest.raises(ValueError, match=r"x0.x and x0.y do not follow"):
        Pattern(3, np.arange(3), [Elements(rows, ("x0.x", "x0.y", "x0.z"))])
