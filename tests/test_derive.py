"""Derivations: every block of every energy is proved against the exact derivatives of its definition."""

from typing import Any

import pytest

from yarnverify.symbolic.court import Court, Verdict
from yarnverify.symbolic.declare import (
    Declarations,
    Energy,
    Point,
    Positive,
    Real,
    Sliding,
    angle,
    deviation,
    energy,
    length,
    load_declarations,
    unit,
)
from yarnverify.symbolic.derive import Derivation, derive_declared
from yarnverify.symbolic.tree import FORCE, PI, ZERO, Expr


def tangent(half: Expr) -> Expr:
    return Expr("call", (half,), "tan")


@energy()
def rest_angle(x0: Point, x1: Point, x2: Point, *, k: Positive["N m"], theta_0: Real["rad"]):
    return k * (angle(x1 - x0, x0 - x2) - theta_0) ** 2


@energy()
def rod(x0: Point, x1: Point, x2: Point, *, B: Positive["N m^2"], L: Positive["m"]):
    return B * (2 * tangent(angle(x1 - x0, x0 - x2) / 2)) ** 2 / (2 * L)


@energy()
def cubic(x0: Point, x1: Point, *, k: Positive["N"]):
    return k * length(x1 - x0) ** 3


@energy()
def root(x0: Point, x1: Point, u1: Sliding, *, k: Positive["N"]):
    return k * Expr("sqrt", (length(x1 - x0) ** 2 + u1**2,))


@energy()
def two_measures(x0: Point, x1: Point, x2: Point, u1: Sliding, *, k: Positive["N"], L: Positive["m"]):
    return k * (length(x1 - x0) - L) ** 2 * (deviation(x1 - x0, x2 - x0) + u1) ** 2


@energy()
def elsewhere(x1: Point, x2: Point, *, k: Positive["N"], L: Positive["m"]):
    return k * (length(x2 - x1) - L) ** 2 / 2


@energy()
def chain(x0: Point, x1: Point, x2: Point, x3: Point, *, k: Positive["N"]):
    return k * (length(x1 - x0) ** 2 + length(x2 - x1) * length(x3 - x2))


@energy()
def kink(x1: Point, x2: Point, x3: Point, *, k: Positive["N m"]):
    return k * angle(x2 - x1, x3 - x2) ** 2


@energy()
def cosine_law(x0: Point, x1: Point, x2: Point, *, k: Positive["N m"]):
    return k * (1 - Expr("call", (angle(x1 - x0, x2 - x0),), "cos")) + k * PI


@energy(domain="u_1 > u_0")
def sliding(u0: Sliding, u1: Sliding, *, k: Positive["N m^-1"]):
    return k * Expr("abs", (u0 - u1,)) ** 3


@energy(domain="u_1 > u_0")
def rate(x0: Point, x1: Point, u0: Sliding, u1: Sliding, *, k: Positive["N"]):
    return k * (length((x1 - x0) / length(u1 - u0)) - 1) ** 2


MADE = (rest_angle, rod, cubic, root, two_measures, elsewhere, chain, cosine_law, sliding, rate)


@energy()
def inner_product(x0: Point, x1: Point, x2: Point, *, k: Positive["N"]):
    return k * Expr("dot", (x1 - x0, x2 - x0))


@energy()
def volume(x0: Point, x1: Point, x2: Point, *, k: Positive["N"]):
    return k * length(Expr("cross", (x1 - x0, x2 - x0)))


@energy()
def middle(x0: Point, x1: Point, x2: Point, *, k: Positive["N"]):
    return k * length(x0 + x1 - 2 * x2)


@energy()
def flat_angle(x0: Point, x1: Point, *, k: Positive["N"]):
    return k * angle(x1 - x0, x1 - x0) + k * Expr("call", (2 * (unit(x1 - x0).T * unit(x0 - x1)),), "arccos")


@energy()
def coordinate(x0: Point, x1: Point, *, k: Positive["N"]):
    return k * (x0.T * x1)


def derived(made: Energy, declarations: Declarations | None = None) -> Derivation:
    found = derive_declared(made, declarations.quantities if declarations else ())
    assert found is not None
    return found


def prove_all(derivation: Derivation) -> None:
    verdicts = derivation.check()
    count = len(derivation.unknowns)
    assert len(verdicts) == 1 + count + count**2  # the energy itself, its gradient, its Hessian
    assert {block: finding for block, finding in verdicts.items() if finding.verdict is not Verdict.PROVED} == {}


@pytest.mark.parametrize("name", ["stretch", "bending", "shear", "parallel_contact"])
def test_every_block_of_a_declared_energy_is_proved(declarations: Declarations, name: str) -> None:
    (made,) = (e for e in declarations.energies if e.name == name)
    prove_all(derived(made, declarations))


@pytest.mark.parametrize("made", MADE, ids=lambda made: made.name)
def test_every_block_of_another_energy_is_proved(made: Energy) -> None:
    prove_all(derived(made))


def test_an_angle_away_from_the_first_point_is_proved() -> None:
    """Its lengths are irrational at the states that are drawn, so a few blocks stand for all."""
    derivation = derived(kink)
    x1, _, x3 = kink.unknowns
    court = Court(derivation.section, derivation.energy)
    for row, column in ((x1, x3), (x3, x3)):
        force = Expr("force", value=row)
        assert court.judge(force, derivation.gradient(row, FORCE)).verdict is Verdict.PROVED
        block = Expr("derivative", (force,), column)
        assert court.judge(block, derivation.hessian(row, column, FORCE)).verdict is Verdict.PROVED


@pytest.mark.parametrize("made", [inner_product, volume, middle, flat_angle, coordinate], ids=lambda made: made.name)
def test_an_energy_without_measures_is_told(made: Energy) -> None:
    assert derive_declared(made, ()) is None


@pytest.mark.parametrize(
    ("made", "symbols"),
    [
        (rest_angle, ["theta"]), (two_measures, ["l_1", "theta"]), (elsewhere, ["l_12"]),
        (chain, ["l_1", "l_12", "l_23"]), (sliding, []), (cubic, ["l_1"]),
    ],
    ids=lambda value: getattr(value, "name", ""),
)  # fmt: skip
def test_an_energy_is_a_law_of_its_measures(made: Energy, symbols: list[str]) -> None:
    assert sorted(str(measure.symbol) for measure in derived(made).measures) == symbols


def test_the_angles_of_the_paper_keep_their_names(declarations: Declarations) -> None:
    found = {
        e.name: [str(m.symbol) for m in derived(e, declarations).measures] for e in declarations.energies if e.document
    }
    assert found == {"stretch": ["l_1"], "bending": ["theta"], "shear": ["phi"], "parallel_contact": []}


def test_an_angle_does_not_take_the_name_of_a_parameter() -> None:
    @energy()
    def named(x0: Point, x1: Point, x2: Point, *, theta: Positive["N"], theta_1: Positive["N"]):
        return theta * angle(x1 - x0, x2 - x0) ** 2 + theta_1 * angle(x1 - x0, x0 - x2)

    derivation = derived(named)
    assert {str(m.symbol) for m in derivation.measures}.isdisjoint({"theta", "theta_1"})
    prove_all(derivation)


def test_the_hub_follows_from_translation(declarations: Declarations) -> None:
    (made,) = (e for e in declarations.energies if e.name == "bending")
    derivation = derived(made, declarations)
    x0, x1, x2 = made.unknowns[:3]
    forces = [Expr("force", value=name) for name in (x1, x2)]
    assert derivation.gradient(x0) == -(forces[0] + forces[1])
    assert derivation.gradient(made.unknowns[3], FORCE) != ZERO


def test_a_block_that_is_zero_is_zero() -> None:
    x0, *_, x3 = chain.unknowns
    assert derived(chain).hessian(x0, x3) == ZERO
    assert derived(sliding).unknowns == sliding.unknowns


def test_two_folders_declare_independently(tmp_path: Any) -> None:
    (tmp_path / "one.py").write_text(
        "from yarnverify.symbolic.declare import Point, Positive, energy, length\n\n\n"
        "@energy()\ndef one(x0: Point, x1: Point, *, k: Positive['N']):\n    return k * length(x1 - x0)\n"
    )
    (made,) = load_declarations(tmp_path).energies
    prove_all(derived(made))
