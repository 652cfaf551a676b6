"""Verdicts: the expected ones of the paper, those of other documents, and every way in which a verdict can be withheld."""

from __future__ import annotations

import math
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from yarnverify.library import Shelf, errata, shelf_for
from yarnverify.source import Source
from yarnverify.symbolic.algebraic import UndefinedError
from yarnverify.symbolic.court import Court, Verdict
from yarnverify.symbolic.declare import Declarations
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.evidence import Comparison
from yarnverify.symbolic.forward import Evaluation
from yarnverify.symbolic.prove import read_with, try_document
from yarnverify.symbolic.reader import read_formula
from yarnverify.symbolic.reading import UnsupportedError
from yarnverify.symbolic.record import hexadecimal, prove_source
from yarnverify.symbolic.tree import Expr, Name

Record = dict[str, Any]

CLAIMS = {  # members of each chain but the last, counted in the paper by hand
    "1": 1, "2": 1, "3": 1, "4": 1, "5": 1, "6": 2, "7": 2, "8": 4, "9": 4, "10": 4, "11": 4, "12": 1, "13": 1, "14": 1,
    "15": 1, "16": 1, "17": 3, "18": 1, "19": 1, "20": 1, "21": 1, "22": 2, "23": 3, "24": 4, "25": 2, "26": 2, "27": 2,
    "28": 2, "29": 2, "30": 2, "31": 1, "32": 1, "33": 1, "34": 1, "35": 1, "36": 1, "37": 1, "38": 1, "39": 1, "40": 2,
    "41": 3, "42": 1, "43": 2, "44": 4,
}  # fmt: skip
REFUTED = {  # equation: (change, why it is wrong)
    "8": ("k should be k_s", "the energy (5) has no stiffness k"),
    "18": (r"sign of \cos \theta \mathbf{P}_1", "cos(theta) is minus the product of the directions; compare (36)"),
    "21": (r"sign of \cos \theta \mathbf{P}_2", "the mirror image of (18)"),
}


def alone(text: str) -> Record:
    """The record of a document without declarations."""
    return prove_source(Source("made.md", text), Shelf(None, "made.md", "by itself alone"))


def changed(source: Source, equation: str, old: str, new: str) -> str:
    display = next(
        d for d in re.findall(r"\$\$.*?\$\$", source.text, re.DOTALL) if d.endswith(rf"\quad ({equation})$$")
    )
    assert old in display
    return source.text.replace(display, display.replace(old, new))


def section_of(text: str, title: str) -> str:
    """The preamble and one section, as a document of its own."""
    head, *sections = re.split(r"(?m)^(?=## )", text)
    return head + next(s for s in sections if s.startswith(f"## {title}"))


def proved(text: str) -> Record:
    """The record of an edition of the paper, by the declarations of the paper."""
    return prove_source(Source("edition.md", text), shelf_for(Path("edition.md"), text))


def claims(record: Record, equation: str) -> list[Record]:
    return [claim for claim in record["claims"] if claim["equation"] == equation]


def findings(record: Record) -> set[str]:
    """Refuted equations that no other one explains."""
    return {c["equation"] for c in record["claims"] if c["verdict"] == "refuted" and not c["because"]}


# -- the paper --------------------------------------------------------------------------------------------------------


def test_every_claim_of_the_paper_is_judged(record: Record) -> None:
    assert {number: len(claims(record, number)) for number in record["equations"]} == CLAIMS
    assert len(record["claims"]) == sum(CLAIMS.values()) == 79
    assert record["tally"] == {"proved": 73, "refuted": 6, "undecided": 0, "inconsistent": 0}


@pytest.mark.parametrize("equation", CLAIMS)
def test_the_paper_has_its_known_verdicts(record: Record, equation: str) -> None:
    for claim in claims(record, equation):
        change, _ = REFUTED.get(equation, (None, ""))
        assert claim["verdict"] == ("refuted" if change else "proved")
        assert claim["change"] == change
        assert claim["because"] == []


def test_the_accepted_errata_are_the_refuted_equations(folder: Path, source: Source) -> None:
    accepted = errata(shelf_for(folder / "cirio2014.md", source.text))
    assert {e.equation: e.change for e in accepted} == {number: change for number, (change, _) in REFUTED.items()}


def test_the_paper_lists_all_its_blocks(record: Record) -> None:
    assert {part["section"]: (len(part["listed"]), part["missing"]) for part in record["completeness"]} == {
        "Stretch": (20, []), "Bending": (30, []), "Shear": (12, []), "Parallel Contact": (6, []),
    }  # fmt: skip


def test_an_undeclared_paper_is_judged_by_itself(source: Source, record: Record) -> None:
    mine = alone(source.text)
    assert {item["equation"] for item in mine["given"]} >= {"1", "2", "3", "4", "5", "12", "13", "31", "32", "42"}
    assert [(c["equation"], c["verdict"]) for c in mine["claims"]] == [
        (c["equation"], c["verdict"]) for c in record["claims"] if c["kind"] not in ("definition", "energy")
    ]


# -- a witness is one -------------------------------------------------------------------------------------------------


def bending_by_hand(point: Record) -> tuple[Any, Any, Any, Any]:
    """Printed (18) and (21), and the true blocks by central differences of F = -dV/dx from plain text formulas."""
    x0, x1, x2 = (np.array([float(Fraction(part)) for part in point[key]]) for key in ("x0", "x1", "x2"))
    k, u1, u2 = (float(Fraction(point[key])) for key in ("k_b", "u1", "u2"))

    def unit(a: Any) -> Any:
        return a / np.linalg.norm(a)

    def force(head: Any, other: Any) -> Any:  # (14); proved, and checked against (13) in the test below
        a, b = unit(head - x0), unit(other - x0)
        t = math.acos(-(a @ b))
        return -2 * k * t / (np.linalg.norm(head - x0) * (u1 - u2) * math.sin(t)) * (b - a * (a @ b))

    def printed(head: Any, other: Any) -> Any:
        a, b, length = unit(head - x0), unit(other - x0), np.linalg.norm(head - x0)
        t, P = math.acos(-(a @ b)), np.eye(3) - np.outer(a, a)
        s, c, outer = math.sin(t), math.cos(t), np.outer(P @ b, b) @ P
        inner = np.outer(P @ b, a) + c / s**2 * outer + c * P + np.outer(a, b) @ P
        return 2 * k / (length**2 * (u1 - u2) * s) * (t * inner - outer / s)

    def true(head: Any, other: Any) -> Any:
        h = 1e-5 * np.eye(3)
        return np.stack([(force(head + e, other) - force(head - e, other)) / 2e-5 for e in h], axis=1)

    return printed(x1, x2), true(x1, x2), printed(x2, x1), true(x2, x1)


@pytest.mark.parametrize("equation", ["18", "21"])
def test_a_witness_holds_without_this_package(record: Record, equation: str) -> None:
    (claim,) = claims(record, equation)
    witness = claim["witness"]
    printed, true = bending_by_hand(witness["point"])[slice(*((0, 2) if equation == "18" else (2, 4)))]
    # the witness is printed to 17 digits; differences of a smooth force are good to about 1e-9
    assert np.array(witness["printed"], float) == pytest.approx(printed.ravel(), rel=1e-12)
    assert np.array(witness["true"], float) == pytest.approx(true.ravel(), rel=1e-7, abs=1e-8)
    assert np.abs(printed - true).max() > 0.1


def test_the_force_of_the_witness_is_that_of_the_energy(record: Record) -> None:
    (claim,) = claims(record, "18")
    point = claim["witness"]["point"]
    x0, x1, x2 = (np.array([float(Fraction(part)) for part in point[key]]) for key in ("x0", "x1", "x2"))

    def energy(x: Any) -> float:
        a, b = x - x0, x2 - x0
        theta = math.acos(-(a @ b) / np.linalg.norm(a) / np.linalg.norm(b))
        return float(Fraction(point["k_b"])) * theta**2 / float(Fraction(point["u1"]) - Fraction(point["u2"]))

    a, b = x1 - x0, x2 - x0
    theta = math.acos(-(a @ b) / np.linalg.norm(a) / np.linalg.norm(b))
    slope = [(energy(x1 + e) - energy(x1 - e)) / 2e-6 for e in 1e-6 * np.eye(3)]
    along = b / np.linalg.norm(b) - a * (a @ b) / (a @ a) / np.linalg.norm(b)
    scale = 2 * float(Fraction(point["k_b"])) * theta / float(Fraction(point["u1"]) - Fraction(point["u2"]))
    assert slope == pytest.approx(scale / np.linalg.norm(a) / math.sin(theta) * along, rel=1e-6)


# -- verdicts withheld ------------------------------------------------------------------------------------------------

SPRING = r"""
## Spring

$$l_1 = \|\mathbf{x}_1 - \mathbf{x}_0\| \quad (1)$$

$$\mathbf{d}_1 = \frac{\mathbf{x}_1 - \mathbf{x}_0}{l_1} \quad (2)$$

$$V = \frac{1}{2} k (l_1 - L)^2 \quad (3)$$

$$\mathbf{F}_{\mathbf{x}_1} = -\mathbf{F}_{\mathbf{x}_0} = -k (l_1 - L) \mathbf{d}_1 \quad (4)$$

$$\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_1} = \frac{\partial \mathbf{F}_{\mathbf{x}_0}}{\partial \mathbf{x}_0} = -\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_0} = -\frac{\partial \mathbf{F}_{\mathbf{x}_0}}{\partial \mathbf{x}_1} = -k \mathbf{I} + \frac{k L}{l_1} (\mathbf{I} - \mathbf{d}_1 \mathbf{d}_1^T) \quad (5)$$

$$\frac{\partial l_1}{\partial \mathbf{x}_1} = \mathbf{d}_1^T \quad (6)$$
"""  # noqa: E501


@pytest.fixture(scope="module")
def spring() -> Court:
    section = read_with(Source("spring.md", SPRING), Declarations()).sections[0]
    assert section.energy is not None
    return Court(section, section.energy.expression)


FORCE = Expr("force", value=Name("x", "1", bold=True))
TRUE, WRONG = read_formula(r"-k (l_1 - L) \mathbf{d}_1"), read_formula(r"k (l_1 - L) \mathbf{d}_1")


@pytest.mark.parametrize(
    ("route", "lie", "formula", "reason"),
    [
        ("equal", True, WRONG, "equal as normal forms, different at an exact state"),
        ("equal", False, TRUE, "different as normal forms, equal at every exact state tried"),
        ("compare", Comparison(3), WRONG, "different as normal forms, equal at every exact state tried"),
        ("compare", Comparison(3, ({},)), TRUE, "equal as normal forms, different at an exact state"),
    ],
)
def test_readings_that_contradict_each_other_are_inconsistent(
    spring: Court, monkeypatch: pytest.MonkeyPatch, route: str, lie: Any, formula: Expr, reason: str
) -> None:
    if lie == Comparison(3, ({},)):
        lie = Comparison(3, (dict(spring.evidence.exact[0].state),))  # a state at which the sides are equal in truth
    monkeypatch.setattr(spring.forms if route == "equal" else spring.evidence, route, lambda *sides: lie, raising=False)
    finding = spring.judge(FORCE, formula)
    assert (finding.verdict, finding.reason) == (Verdict.INCONSISTENT, reason)


def test_a_proof_that_balls_do_not_bear_out_is_inconsistent(spring: Court, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spring.forms, "equal", lambda *sides: True)
    monkeypatch.setattr(spring.evidence, "compare", lambda *sides: Comparison(3))
    finding = spring.judge(FORCE, WRONG)
    assert (finding.verdict, finding.reason) == (Verdict.INCONSISTENT, "equal in exact readings, apart in balls")


def _raise(error: Exception) -> Any:
    def stub(*args: Any, **keywords: Any) -> Any:
        raise error

    return stub


def test_what_the_normal_form_does_not_support_is_undecided(spring: Court, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spring.forms, "equal", _raise(UnsupportedError("too hard")))
    finding = spring.judge(FORCE, TRUE)
    assert finding.verdict is Verdict.UNDECIDED
    assert re.fullmatch(r"too hard; equal at the \d exact states tried", finding.reason)


def test_without_a_state_nothing_is_decided(spring: Court, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Evaluation, "value", _raise(UndefinedError("nowhere")))
    for formula in (TRUE, WRONG):
        assert spring.judge(FORCE, formula).verdict is Verdict.UNDECIDED


def test_without_a_certificate_nothing_is_refuted(spring: Court, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spring.evidence, "certify", lambda *args: None)
    finding = spring.judge(FORCE, WRONG)
    assert finding.verdict is Verdict.UNDECIDED
    assert "no ball arithmetic" in finding.reason


def test_balls_that_have_no_value_certify_nothing(spring: Court) -> None:
    state = {
        name: (Fraction(0),) * 3 if name.bold else Fraction(1) for name in spring.names
    }  # both points at one place
    assert spring.evidence.certify(state, FORCE, WRONG) is None


@pytest.mark.parametrize("formula", [r"\frac{k}{k - k} \mathbf{d}_1", r"(l_1^2 - l_1 l_1)^{-1} \mathbf{d}_1"])
def test_a_side_that_has_a_value_nowhere_is_refuted(spring: Court, formula: str) -> None:
    assert spring.judge(FORCE, read_formula(formula)).verdict is Verdict.REFUTED


@pytest.mark.parametrize(
    ("formula", "reason"),
    [
        (r"-k (l_1 - L)", "a vector cannot equal a scalar"),
        (r"-k (l_1 - L) \mathbf{d}_1^T", "a vector cannot equal a covector"),
        (r"-k (l_1 - M) \mathbf{d}_1", "undefined symbol M"),
        (r"-q (l_1 - M) \mathbf{d}_1", "undefined symbol q, M"),
    ],
)
def test_shapes_and_symbols_are_grounds_to_refute(spring: Court, formula: str, reason: str) -> None:
    finding = spring.judge(FORCE, read_formula(formula))
    assert (finding.verdict, finding.reason, finding.witness) == (Verdict.REFUTED, reason, None)


def test_a_block_that_is_zero_may_be_printed_as_zero(spring: Court) -> None:
    zero, by_sliding = read_formula("0"), Expr("derivative", (FORCE,), Name("u", "1"))
    court = spring.reaching([by_sliding])
    for sides in ((by_sliding, zero), (zero, by_sliding)):
        assert court.judge(*sides).verdict is Verdict.PROVED
    assert court.judge(FORCE, zero).verdict is Verdict.REFUTED


def test_a_hexadecimal_number_is_exact() -> None:
    assert float.fromhex(hexadecimal(Fraction(-39, 4))) == -9.75
    with pytest.raises(AssertionError):
        hexadecimal(Fraction(1, 3))


# -- what explains what -----------------------------------------------------------------------------------------------


def test_a_wrong_definition_explains_its_consequences(source: Source) -> None:
    record = proved(section_of(changed(source, "12", r"(-\mathbf{d}_1", r"(\mathbf{d}_1"), "Bending"))
    assert findings(record) == {"12", "18", "21"}
    (definition,) = claims(record, "12")
    assert definition["change"] == r"sign of \mathbf{d}_1^T \mathbf{d}_2"
    for number in ("18", "21"):  # mended on their own, with the declared angle
        (claim,) = claims(record, number)
        assert claim["change"] == REFUTED[number][0]
    explained = {c["equation"] for c in record["claims"] if c["because"]}
    assert {"14", "15", "19", "20", "28", "29"} <= explained
    assert all(c["because"] == ["12"] and c["change"] is None for c in record["claims"] if c["because"])
    assert claims(record, "14")[0]["reason"] == "follows from equation (12)"


@pytest.mark.parametrize("angle", [r"(-\mathbf{d}_1^T \mathbf{d}_1", r"(\mathbf{d}_1^T \mathbf{d}_1"])
def test_an_angle_that_is_the_same_everywhere_explains_its_consequences(source: Source, angle: str) -> None:
    text = changed(source, "12", r"(-\mathbf{d}_1^T \mathbf{d}_2", angle)
    record = proved(section_of(text, "Bending"))
    assert {c["verdict"] for c in record["claims"]} == {"proved", "refuted"}
    assert {c["equation"] for c in record["claims"] if c["verdict"] == "refuted" and not c["because"]} == {
        "12",
        "18",
        "21",
    }
    assert all(c["because"] == ["12"] for c in record["claims"] if c["because"])


@pytest.mark.parametrize(
    ("title", "equation", "old", "new", "change"),
    [
        ("Bending", "13", "u_1 - u_2", "u_1 - u_0", "index: u_0 should be u_2"),
        ("Bending", "13", "k_b", "2 k_b", None),
        ("Shear", "31", r"\mathbf{d}_3", r"(-\mathbf{d}_3)", None),
        ("Parallel Contact", "42", r"\frac{1}{2}", "", None),
    ],
)
def test_a_wrong_energy_or_angle_is_the_only_finding(
    source: Source, title: str, equation: str, old: str, new: str, change: str | None
) -> None:
    record = proved(section_of(changed(source, equation, old, new), title))
    assert findings(record) - {"18", "21"} == {equation}
    (claim,) = claims(record, equation)
    assert claim["correction"] is not None
    assert change in (None, claim["change"])


def test_a_wrong_shared_definition_explains_what_follows_from_it(source: Source) -> None:
    record = proved(
        section_of(
            changed(source, "1", r"\|\mathbf{x}_i - \mathbf{x}_0\|", r"2 \|\mathbf{x}_i - \mathbf{x}_0\|"), "Stretch"
        )
    )
    assert findings(record) == {"1", "8"}
    assert [c["change"] for c in claims(record, "1")] == [
        r"extra factor: 2 \|\mathbf{x}_i - \mathbf{x}_0\| should be \|\mathbf{x}_i - \mathbf{x}_0\|"
    ]


@pytest.mark.parametrize(
    ("title", "equation", "old", "new", "change"),
    [
        ("Bending", "14", "k_b", "k", "k should be k_b"),
        ("Bending", "13", "k_b", "k", "k should be k_b"),
        ("Bending", "12", r"\mathbf{d}_2", r"\mathbf{e}_2", r"\mathbf{e}_2 should be \mathbf{d}_2"),
        ("Shear", "39", r"\cos \phi", r"\cos \psi", r"\psi should be \phi"),
        ("Stretch", "1", r"\mathbf{x}_0", r"\mathbf{y}_0", None),
        ("Parallel Contact", "42", r"d)", r"D)", "D should be d"),
    ],
)
def test_an_undefined_symbol_costs_no_other_verdict(
    source: Source, title: str, equation: str, old: str, new: str, change: str | None
) -> None:
    record = proved(section_of(changed(source, equation, old, new), title))
    assert findings(record) - {"8", "18", "21"} == {equation}
    assert all("undefined symbol" in c["reason"] for c in claims(record, equation))
    assert all(c["change"] == change for c in claims(record, equation) if change)
    assert not record["tally"]["undecided"] and not record["tally"]["inconsistent"]


# -- completeness -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("title", "equation", "blocks"),
    [
        ("Stretch", "11", {"dF_u1/dx1", "dF_u0/dx0", "dF_u1/dx0", "dF_u0/dx1"}),
        ("Bending", "15", {"F_x2"}),
        ("Bending", "19", {"dF_x1/dx2"}),
        ("Shear", "35", {"F_x0"}),
        ("Shear", "41", {"dF_x0/dx1", "dF_x0/dx3", "dF_x0/dx0"}),
        ("Parallel Contact", "44", {"dF_u0/du0", "dF_u1/du1", "dF_u0/du1", "dF_u1/du0"}),
    ],
)
def test_a_block_that_the_list_lacks_is_reported_and_derived(
    source: Source, declarations: Declarations, title: str, equation: str, blocks: set[str]
) -> None:
    display = next(
        d for d in re.findall(r"\$\$.*?\$\$", source.text, re.DOTALL) if d.endswith(rf"\quad ({equation})$$")
    )
    text = section_of(source.text.replace(display, ""), title)
    (part,) = proved(text)["completeness"]
    assert part["verdict"] == "refuted"
    assert {item["block"] for item in part["missing"]} == blocks
    section = read_with(Source("edition.md", text), declarations).sections[0]
    assert section.energy is not None
    court = Court(section, section.energy.expression)
    for item in part["missing"]:
        assert court.judge(read_formula(item["latex"]), read_formula(item["derived"])).verdict is Verdict.PROVED


def test_a_block_that_is_zero_need_not_be_listed(source: Source) -> None:
    text = section_of(source.text, "Bending").replace(r", \quad F_{u_0} = 0. \quad (17)", r". \quad (17)")
    (part,) = proved(text)["completeness"]
    assert (part["verdict"], part["missing"]) == ("proved", [])


# -- other documents --------------------------------------------------------------------------------------------------

ROD = r"""
# Discrete rod

$$\mathbf{e} = \mathbf{x}_0 - \mathbf{x}_1 \quad (1)$$

$$\mathbf{f} = \mathbf{x}_2 - \mathbf{x}_0 \quad (2)$$

## Bend

$$\theta = \arccos \left(\frac{\mathbf{e}^T \mathbf{f}}{\|\mathbf{e}\| \|\mathbf{f}\|} \right) \quad (3)$$

$$\kappa = 2 \tan (\frac{\theta}{2}) \quad (4)$$

$$V = \frac{1}{2} B \kappa^2 \quad (5)$$

$$\kappa^2 = 4 \frac{1 - \cos \theta}{1 + \cos \theta} \quad (6)$$

$$\kappa = \frac{2 \|\mathbf{e} \times \mathbf{f}\|}{\|\mathbf{e}\| \|\mathbf{f}\| + \mathbf{e} \cdot \mathbf{f}} \quad (7)$$

$$\mathbf{F}_{\mathbf{x}_0} = -(\mathbf{F}_{\mathbf{x}_1} + \mathbf{F}_{\mathbf{x}_2}) \quad (8)$$

$$\frac{\partial \theta}{\partial \mathbf{x}_2} = \frac{1}{\|\mathbf{f}\| \sin \theta} \left( \frac{\cos \theta}{\|\mathbf{f}\|} \mathbf{f} - \frac{1}{\|\mathbf{e}\|} \mathbf{e} \right)^T \quad (9)$$

$$\mathbf{F}_{\mathbf{x}_2} = -\frac{2 B \tan (\frac{\theta}{2})}{\cos^2 (\frac{\theta}{2}) \|\mathbf{f}\| \sin \theta} \left( \frac{\cos \theta}{\|\mathbf{f}\|} \mathbf{f} - \frac{1}{\|\mathbf{e}\|} \mathbf{e} \right) \quad (10)$$
"""  # noqa: E501
WRONG_ROD = ROD
for _right, _wrong in [
    (r"1 - \cos \theta}{1 + \cos \theta}", r"1 + \cos \theta}{1 - \cos \theta}"),
    (r"{2 \|\mathbf{e} \times", r"{\|\mathbf{e} \times"),
    (r"= -(\mathbf{F}", r"= (\mathbf{F}"),
    (r"\frac{1}{\|\mathbf{f}\| \sin \theta}", r"\frac{1}{\|\mathbf{e}\| \sin \theta}"),
    (r"-\frac{2 B", r"-\frac{B"),
]:
    assert _right in WRONG_ROD
    WRONG_ROD = WRONG_ROD.replace(_right, _wrong, 1)
PRODUCTS = r"""
## Products

$$V = c (\mathbf{x}_1 - \mathbf{x}_0) \cdot (\mathbf{x}_2 - \mathbf{x}_0) + \frac{b}{2} \|(\mathbf{x}_1 - \mathbf{x}_0) \times (\mathbf{x}_2 - \mathbf{x}_0)\|^2 \quad (1)$$

$$\mathbf{F}_{\mathbf{x}_1} = -c (\mathbf{x}_2 - \mathbf{x}_0) - b (\mathbf{x}_2 - \mathbf{x}_0) \times ((\mathbf{x}_1 - \mathbf{x}_0) \times (\mathbf{x}_2 - \mathbf{x}_0)) \quad (2)$$

$$\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_1} = -b \left( \|\mathbf{x}_2 - \mathbf{x}_0\|^2 \mathbf{I} - (\mathbf{x}_2 - \mathbf{x}_0) (\mathbf{x}_2 - \mathbf{x}_0)^T \right) \quad (3)$$
"""  # noqa: E501


@pytest.mark.parametrize(
    ("text", "old", "new", "wrong"),
    [
        (SPRING, "", "", set()),
        (SPRING, r"-k (l_1 - L) \mathbf{d}_1", r"-k (l_1 + L) \mathbf{d}_1", {"4"}),
        (SPRING, r"\frac{k L}{l_1} (\mathbf{I}", r"\frac{k L}{l_1^2} (\mathbf{I}", {"5"}),
        (SPRING, r"= \mathbf{d}_1^T", r"= -\mathbf{d}_1^T", {"6"}),
        (ROD, "", "", set()),
        (WRONG_ROD, "", "", {"6", "7", "8", "9", "10"}),
        (PRODUCTS, "", "", set()),
        (PRODUCTS, r"- b (\mathbf{x}_2", r"+ b (\mathbf{x}_2", {"2"}),
        (PRODUCTS, r"\|\mathbf{x}_2 - \mathbf{x}_0\|^2 \mathbf{I} -", r"\mathbf{I} -", {"3"}),
    ],
)
def test_other_models_are_judged_by_their_own_energy(text: str, old: str, new: str, wrong: set[str]) -> None:
    assert old in text
    document = read_with(Source("made.md", text.replace(old, new, 1) if old else text), Declarations())
    found: dict[str, set[str]] = {}
    for judged in try_document(document, Declarations()).judged:
        found.setdefault(judged.claim.relation.equation, set()).add(judged.finding.verdict)
    assert {number: verdict for number, verdict in found.items() if verdict != {"proved"}} == {
        n: {"refuted"} for n in wrong
    }


def test_a_wrong_line_of_another_model_is_mended(spring: Court) -> None:
    record = alone(SPRING.replace(r"\frac{k L}{l_1} (\mathbf{I}", r"\frac{k L}{l_1^2} (\mathbf{I}"))
    assert {c["change"] for c in claims(record, "5")} == {"power: l_1^2 should be l_1"}


def test_the_list_of_an_energy_without_measures_is_checked_too() -> None:
    (part,) = alone(PRODUCTS)["completeness"]
    assert part["listed"] == ["F_x1", "dF_x1/dx1"]
    assert {item["block"] for item in part["missing"]} >= {"F_x0", "F_x2", "dF_x2/dx2", "dF_x0/dx1"}


def test_progress_is_told_for_each_judged_claim(source: Source, declarations: Declarations) -> None:
    told: list[str] = []
    document = read_with(Source("part.md", section_of(source.text, "Parallel Contact")), declarations)
    trial = try_document(document, declarations, told.append)
    assert sorted(told) == sorted(judged.claim.relation.equation for judged in trial.judged)


def test_a_court_reaches_for_symbols_that_it_does_not_hold(spring: Court) -> None:
    section: Section = spring.section
    assert spring.reaching([read_formula("l_1 + k")]) is spring
    larger = spring.reaching([read_formula(r"\mathbf{x}_2")])
    assert larger is not spring and larger.section is section
    assert Name("x", "2", bold=True) in larger.names


JUDGED = [
    # a force by its definition, and a Jacobian by that of the force
    (r"$$F_{u_1} = -\frac{\partial V}{\partial u_1} = -k u_1 \quad (2)$$", r"\frac{1}{2} k u_1^2", {"proved": 2}),
    # a parameter has no sign unless one is assumed
    (r"$$F_{u_1} = -k (u_1 - c) \quad (2)$$", r"\frac{1}{2} k (u_1 - |c|)^2", {"refuted": 1}),
    (r"Assumed: $c > 0$. $$F_{u_1} = -k (u_1 - c) \quad (2)$$", r"\frac{1}{2} k (u_1 - |c|)^2", {"proved": 1}),
    # assumptions that exclude each other leave nothing to judge
    (r"Assumed: $u_1 > 1$ and $u_1 < 0$. $$F_{u_1} = -k u_1 \quad (2)$$", r"\frac{1}{2} k u_1^2", {"undecided": 1}),
]


@pytest.mark.parametrize(("text", "energy", "expected"), JUDGED)
def test_small_documents(text: str, energy: str, expected: dict[str, int]) -> None:
    record = proved(Source("d.md", f"## A\n\n$$V = {energy} \\quad (1)$$\n\n{text}\n").text)
    assert {verdict: count for verdict, count in record["tally"].items() if count} == expected


def test_a_formula_too_large_for_the_first_reading_is_refuted_by_a_state_or_left_undecided() -> None:
    """A hinge between two triangles: its normal forms grow beyond bounds, its states do not."""
    hinge = r"""## Hinge
$$\mathbf{e} = \mathbf{x}_1 - \mathbf{x}_0 \quad (1)$$
$$\mathbf{a} = (\mathbf{x}_2 - \mathbf{x}_0) \times \mathbf{e} \quad (2)$$
$$\mathbf{b} = \mathbf{e} \times (\mathbf{x}_3 - \mathbf{x}_0) \quad (3)$$
$$V = k \arccos^2 \left( \frac{\mathbf{a}^T \mathbf{b}}{\|\mathbf{a}\| \|\mathbf{b}\|} \right) \quad (4)$$
$$\mathbf{F}_{\mathbf{x}_0} = -\mathbf{F}_{\mathbf{x}_1} - \mathbf{F}_{\mathbf{x}_2} - \mathbf{F}_{\mathbf{x}_3} \quad (5)$$
$$\mathbf{F}_{\mathbf{x}_2} = \mathbf{F}_{\mathbf{x}_3} \quad (6)$$
"""
    record = proved(hinge)
    assert [c["verdict"] for c in claims(record, "6")] == ["refuted"]
    assert claims(record, "5")[0]["verdict"] in ("proved", "undecided")


def test_a_definition_with_a_point_of_its_own_is_refuted_and_what_it_does_at_rest_is_left_out(source: Source) -> None:
    """The direction of a running index that the section has no point for: its energy has none either."""
    record = proved(section_of(changed(source, "12", r"\mathbf{d}_2", r"\mathbf{d}_4"), "Bending"))
    (angle,) = claims(record, "12")
    assert (angle["verdict"], angle["reason"]) == ("refuted", "differs from the declared one")
    assert claims(record, "14")[0]["because"] == ["12"]


def test_an_angle_that_is_a_product_of_vectors_keeps_their_order(source: Source) -> None:
    """As a product of numbers its factors could be exchanged, and make a matrix."""
    angle = changed(source, "31", r"\arccos(\mathbf{d}_1^T \mathbf{d}_3)", r"2 \mathbf{d}_1^T \mathbf{d}_3")
    record = proved(section_of(angle, "Shear"))
    assert {c["equation"] for c in record["claims"] if c["verdict"] == "refuted" and not c["because"]} == {"31"}
    assert {c["verdict"] for c in record["claims"]} == {"proved", "refuted"}


@pytest.mark.parametrize(
    ("equation", "old", "new", "change"),
    [
        ("22", r"\mathbf{F}_{\mathbf{x}_1}", r"\mathbf{F}_{\mathbf{d}_1}", r"\mathbf{d}_1 should be \mathbf{x}_1"),
        ("24", r"\partial u_1", r"\partial l_1", "l_1 should be u_1"),
        ("25", r"\mathbf{F}_{\mathbf{x}_1}", r"\mathbf{F}_{\mathbf{k}_b}", None),
    ],
)
def test_a_force_of_what_is_no_unknown_costs_no_other_verdict(
    source: Source, equation: str, old: str, new: str, change: str | None
) -> None:
    """A defined symbol keeps its meaning, and no stray point becomes the one that all others are seen from."""
    display = next(d for d in source.text.split("$$") if d.endswith(rf"\quad ({equation})"))
    text = source.text.replace(display, display.replace(old, new, 1))
    record = proved(section_of(text, "Bending"))
    assert findings(record) == {"18", "21", equation}
    assert {c["change"] for c in claims(record, "18")} == {REFUTED["18"][0]}
    wrong = [c for c in claims(record, equation) if c["verdict"] == "refuted"]
    assert {c["change"] for c in wrong} == {change}
    assert not record["tally"]["undecided"] and not record["tally"]["inconsistent"]
