"""Verdicts on formulas that go different ways on different sides, or that have no value on one of them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from yarnverify.errors import InputError
from yarnverify.library import Shelf, shelf_for
from yarnverify.source import Source
from yarnverify.symbolic.court import Finding, Verdict
from yarnverify.symbolic.declare import Declarations
from yarnverify.symbolic.prove import read_with, try_document
from yarnverify.symbolic.record import prove_source

Record = dict[str, Any]


def edition(source: Source, equation: str, old: str, new: str, before: str = "") -> tuple[Source, Shelf]:
    """The one section that holds an equation, with a change in it, and with displays added before it."""
    displays = re.findall(r"\$\$.*?\$\$", source.text, re.DOTALL)
    display = next(d for d in displays if d.endswith(rf"\quad ({equation})$$"))
    assert old in display
    text = source.text.replace(display, before + display.replace(old, new, 1))
    head, *sections = re.split(r"(?m)^(?=## )", text)
    text = head + next(s for s in sections if rf"\quad ({equation})$$" in s)
    return Source("edition.md", text), shelf_for(Path("edition.md"), source.text)


@pytest.fixture
def edited(source: Source, declarations: Declarations) -> Any:
    """What is found of a changed section, equation by equation; nothing is mended, which would take long."""

    def judge(equation: str, old: str, new: str, before: str = "") -> dict[str, list[Finding]]:
        document = read_with(edition(source, equation, old, new, before)[0], declarations)
        found: dict[str, list[Finding]] = {}
        for judged in try_document(document, declarations).judged:
            found.setdefault(judged.claim.relation.equation, []).append(judged.finding)
        return found

    return judge


STRAIN = r"(\|\mathbf{w}_1\| - 1)"
RIGHT_ANGLE = r"\left(\phi - \frac{\pi}{2} \right)"


@pytest.mark.parametrize(
    ("equation", "old", "new"),
    [
        ("5", STRAIN + "^2", STRAIN + r" \left| \|\mathbf{w}_1\| - 1 \right|"),
        ("6", STRAIN, r"\left| \|\mathbf{w}_1\| - 1 \right|"),
        ("6", STRAIN, r"\sqrt{(\|\mathbf{w}_1\| - 1)^2}"),
        ("6", STRAIN, r"\frac{(\|\mathbf{w}_1\| - 1)^2}{|\|\mathbf{w}_1\| - 1|}"),
        ("7", r"(\|\mathbf{w}_1\|^2 - 1)", r"\left| \|\mathbf{w}_1\|^2 - 1 \right|"),
        ("14", r"\theta}{", r"\left(\frac{\pi}{2} - \left|\theta - \frac{\pi}{2}\right|\right)}{"),
        ("14", r"\theta}{", r"\left(\frac{\pi}{2} + \left|\theta - \frac{\pi}{2}\right|\right)}{"),
        ("17", r"(u_1 - u_2)^2", r"(|u_1| - u_2)^2"),
        ("31", r"\mathbf{d}_1^T \mathbf{d}_3", r"-|\mathbf{d}_1^T \mathbf{d}_3|"),
        ("33", RIGHT_ANGLE, r"\left|\phi - \frac{\pi}{2} \right|"),
        ("36", r"- \cos \phi \mathbf{P}_1", r"+ |\cos \phi| \mathbf{P}_1"),
    ],
)
def test_what_is_wrong_on_one_side_only_is_refuted(edited: Any, equation: str, old: str, new: str) -> None:
    found = edited(equation, old, new)
    for finding in found[equation][: 2 if equation == "17" else None]:  # (17) also states F_u0 = 0
        assert finding.verdict is Verdict.REFUTED
        assert any(not a.overlaps(b) for a, b in zip(finding.witness.left, finding.witness.right, strict=True))
    assert Verdict.INCONSISTENT not in {finding.verdict for findings in found.values() for finding in findings}


@pytest.mark.parametrize(
    ("equation", "old", "new"),
    [
        ("6", STRAIN, r"(\sqrt{\|\mathbf{w}_1\| - 1})^2"),
        ("6", STRAIN, r"\sqrt{\|\mathbf{w}_1\| - 1} \sqrt{|\|\mathbf{w}_1\| - 1|}"),
        ("7", r"(\|\mathbf{w}_1\|^2 - 1)", r"\sqrt{\|\mathbf{w}_1\| - 1}^2 (\|\mathbf{w}_1\| + 1)"),
        ("33", RIGHT_ANGLE, r"\sqrt{\phi - \frac{\pi}{2}}^2"),
        ("36", r"- \cos \phi \mathbf{P}_1", r"+ (\sqrt{-\cos \phi})^2 \mathbf{P}_1"),
    ],
)
def test_what_has_no_value_on_one_side_is_refuted_there(edited: Any, equation: str, old: str, new: str) -> None:
    for finding in edited(equation, old, new)[equation]:
        assert finding.verdict is Verdict.REFUTED
        assert finding.reason == "what is printed has no value: square root of a negative number"
        assert finding.witness.state and not finding.witness.right


@pytest.mark.parametrize(
    ("equation", "old", "new"),
    [
        ("5", STRAIN + "^2", r"\left| \|\mathbf{w}_1\| - 1 \right|^2"),
        ("9", r"}{\Delta u}", r"}{\sqrt{\Delta u}^2}"),  # the section assumes it positive
        ("14", r"\sin \theta", r"\sqrt{\sin^2 \theta}"),
        ("14", r"\sin \theta", r"\sqrt{1 - \cos^2 \theta}"),
        ("33", RIGHT_ANGLE, r"\left(|\phi| - \left|\frac{\pi}{2}\right| \right)"),
        ("33", r"\sin \phi", r"\left| \sin \phi \right|"),
    ],
)
def test_absolute_values_and_roots_that_change_nothing_are_proved(
    edited: Any, equation: str, old: str, new: str
) -> None:
    assert {finding.verdict for finding in edited(equation, old, new)[equation]} == {Verdict.PROVED}


@pytest.mark.parametrize(
    ("equation", "old", "new", "before"),
    [
        ("6", STRAIN, r"|\|\mathbf{w}_1\| - 1|", r"\|\mathbf{w}_1\| - 1"),
        ("33", RIGHT_ANGLE, r"\left|\phi - \frac{\pi}{2} \right|", r"\phi - \frac{\pi}{2}"),
        ("36", r"- \cos \phi \mathbf{P}_1", r"+ |\cos \phi| \mathbf{P}_1", r"-\cos \phi"),
    ],
)
def test_a_root_somewhere_in_the_section_settles_no_sign_elsewhere(
    edited: Any, equation: str, old: str, new: str, before: str
) -> None:
    displays = rf"$$s = \sqrt{{{before}}} \quad (50)$$" + "\n\n" + rf"$$s^2 = {before} \quad (51)$$" + "\n\n"
    found = edited(equation, old, new, displays)
    assert {finding.verdict for finding in found[equation]} == {Verdict.REFUTED}
    assert Verdict.INCONSISTENT not in {finding.verdict for findings in found.values() for finding in findings}


def test_an_effect_at_rest_that_no_ball_holds_is_left_out(source: Source) -> None:
    record = prove_source(*edition(source, "36", r"- \cos \phi \mathbf{P}_1", r"- \sqrt{\cos^2 \phi} \mathbf{P}_1"))
    (claim,) = [claim for claim in record["claims"] if claim["equation"] == "36"]
    assert claim["verdict"] == "refuted"
    assert claim["effect"] is None  # the root is of 0 at rest, and beside it


def test_an_effect_at_rest_that_no_double_holds_is_left_out(source: Source) -> None:
    record = prove_source(*edition(source, "44", "-k_c L. ", "-((10^{99})^{99})^9 k_c L. "))
    found = [claim for claim in record["claims"] if claim["equation"] == "44"]
    assert {(claim["verdict"], claim["effect"]) for claim in found} == {("refuted", None)}


def alone(text: str) -> Record:
    return prove_source(Source("made.md", text), Shelf(None, "made.md", "by itself alone"))


def test_a_root_of_another_claim_settles_no_sign() -> None:
    text = r"""
## A

$$V = k u_1^2 \quad (1)$$

$$F_{u_1} = -2 k |u_1| \quad (2)$$

$$s = \sqrt{u_1} \quad (3)$$

$$s^2 = u_1 \quad (4)$$
"""
    verdicts = {claim["equation"]: claim["verdict"] for claim in alone(text)["claims"]}
    assert verdicts["2"] == "refuted"


@pytest.mark.parametrize(
    ("energy", "place", "message"),
    [
        (r"V = V", "4:7", "the energy is defined by itself"),
        (r"V = k u_1 + F_{u_1}", "4:15", "the energy is defined by its own forces"),
        (r"V = k u_1^2 + \frac{\partial V}{\partial u_1}", "4:17", "the energy is defined by its own forces"),
        (r"V = \frac{1}{0} k u_1^2", "4:7", "the energy has no value, it divides by zero"),
        (r"V = \frac{1}{1 - 1} k u_1^2", "4:7", "the energy has no value, it divides by zero"),
    ],
)
def test_an_energy_without_a_meaning_is_bad_input(energy: str, place: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        alone(f"## A\n\n\n$${energy} \\quad (1)$$\n\n$$F_{{u_1}} = 0 \\quad (2)$$\n")
    assert str(caught.value).startswith(f"made.md:{place}: equation (1): {message}")


def test_a_declared_energy_stands_in_for_one_that_divides_by_zero(edited: Any) -> None:
    found = edited("5", r"\frac{1}{2}", r"\frac{1}{0}")
    (energy,) = found["5"]
    assert (energy.verdict, energy.reason) == (Verdict.REFUTED, "what is printed has no value: division by zero")
    assert {finding.verdict for finding in found["6"]} == {Verdict.PROVED}


@pytest.mark.parametrize(
    ("assumed", "instead", "equation", "reason"),
    [
        ("u_1 - u_0 < d$", "u_1 - u_0 > d$", "42", "where in part the declared energy is zero"),
        ("u_1 > u_0 > u_2$", "u_1 < u_0 < u_2$", "13", "while the energy is declared for u_1 > u_2"),
        ("u_1 - u_0 > 0$", "u_1 - u_0 < 0$", "5", "while the energy is declared for u_1 > u_0"),
    ],
)
def test_an_assumption_outside_the_declared_domain_refutes_the_energy(
    source: Source, declarations: Declarations, assumed: str, instead: str, equation: str, reason: str
) -> None:
    assert source.text.count(assumed) == 1
    text = source.text.replace(assumed, instead)
    head, *sections = re.split(r"(?m)^(?=## )", text)
    text = head + next(s for s in sections if rf"\quad ({equation})$$" in s)
    record = prove_source(Source("edition.md", text), shelf_for(Path("edition.md"), source.text))
    (energy,) = [claim for claim in record["claims"] if claim["equation"] == equation]
    assert energy["verdict"] == "refuted"
    assert reason in energy["reason"]
    assert energy["correction"] is None and energy["change"] is None


def test_many_scalars_are_drawn_all_different() -> None:
    terms = " + ".join(f"k_{{{i}}} u_1^2" for i in range(40))
    text = f"## A\n\n$$V = {terms} \\quad (1)$$\n\n$$F_{{u_1}} = -2 u_1 ({terms.replace(' u_1^2', '')}) \\quad (2)$$\n"
    assert alone(text)["tally"]["proved"] == 1
