"""Trigonometric identities and roots that hang together: right ones are proved, wrong ones refuted, nothing is left open."""

from __future__ import annotations

from typing import Any

import pytest

from yarnverify.source import Source
from yarnverify.symbolic.court import Court, Verdict
from yarnverify.symbolic.declare import Declarations
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.prove import read_with
from yarnverify.symbolic.reader import read_formula


@pytest.fixture(scope="module")
def bending(source: Source, declarations: Declarations) -> Section:
    return next(s for s in read_with(source, declarations).sections if s.title == "Bending")


@pytest.fixture
def judged(bending: Section) -> Any:
    """A finding by a court of its own: what earlier claims have made known does not help."""
    assert bending.energy is not None
    energy = bending.energy.expression
    return lambda left, right: Court(bending, energy).judge(read_formula(left), read_formula(right))


HALF = r"\frac{\theta}{2}"
ACROSS, ALONG = r"\|\mathbf{d}_1 + \mathbf{d}_2\|", r"\|\mathbf{d}_1 - \mathbf{d}_2\|"
AREA, PRODUCT = r"\|\mathbf{d}_1 \times \mathbf{d}_2\|", r"\mathbf{d}_1^T \mathbf{d}_2"
RIGHT = [
    (r"\sin \theta", rf"2 \sin({HALF}) \cos({HALF})"),
    (r"\cos \theta", rf"\cos^2 ({HALF}) - \sin^2 ({HALF})"),
    (rf"\tan({HALF})", r"\frac{1 - \cos \theta}{\sin \theta}"),
    (rf"\tan({HALF})", r"\sqrt{\frac{1 - \cos \theta}{1 + \cos \theta}}"),
    (r"\tan(2 \theta)", r"\frac{2 \tan \theta}{1 - \tan^2 \theta}"),
    (r"\cot \theta", rf"\frac{{\cot^2 ({HALF}) - 1}}{{2 \cot({HALF})}}"),
    (r"\cos(4 \theta)", r"8 \cos^4 \theta - 8 \cos^2 \theta + 1"),
    (r"\sin(\frac{\theta}{4})", rf"\sqrt{{\frac{{1 - \cos({HALF})}}{{2}}}}"),
    (rf"\sin({HALF})", r"2 \sin(\frac{\theta}{4}) \cos(\frac{\theta}{4})"),
    (r"\sqrt{1 + \sin \theta}", rf"\sin({HALF}) + \cos({HALF})"),
    (r"\sqrt{1 - \sin \theta}", rf"|\sin({HALF}) - \cos({HALF})|"),
    (r"\sqrt{1 - \sin^2 \theta}", r"|\cos \theta|"),
    (r"\sin(\theta + \frac{\pi}{4})", r"\frac{\sin \theta + \cos \theta}{\sqrt{2}}"),
    (r"\cos(\theta - \frac{\pi}{3})", r"\frac{1}{2} \cos \theta + \frac{\sqrt{3}}{2} \sin \theta"),
    (r"\cos(\frac{\pi}{5})", r"\frac{1 + \sqrt{5}}{4}"),
    (r"\theta", r"2 \arccos(\sqrt{\frac{1 + \cos \theta}{2}})"),
    (r"\theta", rf"\arccos(1 - 2 \sin^2 ({HALF}))"),
    (r"\theta", rf"2 \arcsin(\frac{{{ACROSS}}}{{2}})"),
    (r"\theta", rf"\pi - 2 \arccos(\frac{{{ACROSS}}}{{2}})"),
    (r"\theta", rf"2 \arctan(\frac{{{ACROSS}}}{{{ALONG}}})"),
    (r"\theta", rf"2 \arctan(\tan({HALF}))"),
    (r"\theta", rf"\operatorname{{atan2}}({AREA}, -{PRODUCT})"),
    (r"|\frac{\pi}{2} - \theta|", r"\arccos(\sin \theta)"),
    (r"\arccos(\frac{1}{2})", r"\frac{\pi}{3}"),
    (rf"{ALONG} {ACROSS}", r"2 \sin \theta"),
    (rf"{ALONG} + {ACROSS}", r"2 \sqrt{1 + \sin \theta}"),
    (r"\sqrt{2 + \sqrt{2 + 2 \cos \theta}}", r"2 \cos(\frac{\theta}{4})"),
    (r"\sqrt{2} + \sqrt{3}", r"\sqrt{5 + \sqrt{24}}"),
    (r"\sqrt{u_1 - u_0} + \sqrt{u_0 - u_2}", r"\sqrt{u_1 - u_2 + 2 \sqrt{(u_1 - u_0) (u_0 - u_2)}}"),
    (r"\frac{u_1 - 2 u_0 + u_2}{\sqrt{u_1 - u_0} + \sqrt{u_0 - u_2}}", r"\sqrt{u_1 - u_0} - \sqrt{u_0 - u_2}"),
    (r"\sin(u_1 + u_0)", r"\sin u_1 \cos u_0 + \cos u_1 \sin u_0"),
    (r"\cos u_1", r"1 - 2 \sin^2 (\frac{u_1}{2})"),
    (r"\arccos(\frac{u_1}{u_1 - u_2})", r"\frac{\pi}{2} - \arcsin(\frac{u_1}{u_1 - u_2})"),
]
WRONG = [
    (r"\sqrt{1 - \sin \theta}", rf"\cos({HALF}) - \sin({HALF})"),  # above a right angle
    (r"\sqrt{1 - \sin^2 \theta}", r"\cos \theta"),
    (r"\theta", r"\frac{1}{2} \arccos(\cos(2 \theta))"),
    (r"\frac{\pi}{2} - \theta", r"\arccos(\sin \theta)"),
    (r"\theta", r"\arctan(\tan \theta)"),
    (r"\theta", rf"\arcsin({AREA})"),
    (r"\theta", rf"\operatorname{{atan2}}({AREA}, {PRODUCT})"),
    (r"\theta", rf"\arctan(\frac{{{AREA}}}{{-{PRODUCT}}})"),
    (r"\theta", rf"2 \arctan(\frac{{{ALONG}}}{{{ACROSS}}})"),
    (rf"{ALONG} {ACROSS}", r"\sin \theta"),
    (r"\sqrt{2 + \sqrt{2 + 2 \cos \theta}}", rf"2 \cos({HALF})"),
    (r"\sqrt{u_1 - u_0} + \sqrt{u_0 - u_2}", r"\sqrt{u_1 - u_2 + \sqrt{(u_1 - u_0) (u_0 - u_2)}}"),
    (r"\arccos(\frac{1}{2})", r"\frac{\pi}{4}"),
    (r"\sin(2 u_1)", r"2 \sin u_1"),
]


@pytest.mark.parametrize(("left", "right"), RIGHT)
def test_what_is_only_written_otherwise_is_proved(judged: Any, left: str, right: str) -> None:
    assert judged(left, right).verdict is Verdict.PROVED


@pytest.mark.parametrize(("left", "right"), WRONG)
def test_what_is_wrong_in_places_is_refuted_there(judged: Any, left: str, right: str) -> None:
    finding = judged(left, right)
    assert finding.verdict is Verdict.REFUTED
    assert finding.witness.right and not all(
        a.overlaps(b) for a, b in zip(finding.witness.left, finding.witness.right, strict=True)
    )


FORCE, JACOBIAN = r"\mathbf{F}_{\mathbf{x}_1}", r"\frac{\partial F_{u_1}}{\partial \mathbf{x}_2}"
ACTS = r"\frac{k_b}{l_1 (u_1 - u_2)} \mathbf{P}_1 \mathbf{d}_2"  # times -2 theta / sin(theta)
BENDS = r"\frac{k_b}{l_2 (u_1 - u_2)^2} \mathbf{d}_1^T \mathbf{P}_2"  # times 2 theta / sin(theta)


@pytest.mark.parametrize(
    ("left", "factor", "right", "verdict"),
    [
        (FORCE, rf"-\frac{{\theta}}{{\sin({HALF}) \cos({HALF})}}", ACTS, "proved"),
        (FORCE, rf"-\frac{{2 \theta}}{{{AREA}}}", ACTS, "proved"),
        (FORCE, rf"-\frac{{4}}{{\sin \theta}} \arcsin(\frac{{1}}{{2}} {ACROSS})", ACTS, "proved"),
        (FORCE, rf"-\frac{{2}}{{\sin \theta}} \arcsin({AREA})", ACTS, "refuted"),
        (FORCE, rf"-\frac{{\theta}}{{\sin({HALF})}}", ACTS, "refuted"),
        (JACOBIAN, rf"2 \theta \sqrt{{\frac{{4}}{{{ALONG}^2 {ACROSS}^2}}}}", BENDS, "proved"),
        (JACOBIAN, rf"\theta \frac{{1 + \tan^2 ({HALF})}}{{\tan({HALF})}}", BENDS, "proved"),
        (JACOBIAN, rf"\theta \frac{{1 - \tan^2 ({HALF})}}{{\tan({HALF})}}", BENDS, "refuted"),
    ],
)
def test_forces_and_jacobians_in_other_functions_get_their_verdict(
    judged: Any, left: str, factor: str, right: str, verdict: str
) -> None:
    assert judged(left, f"{factor} {right}").verdict.value == verdict


@pytest.mark.parametrize(
    ("angle", "verdict"),
    [
        (rf"2 \arcsin \left( \frac{{{ACROSS}}}{{2}} \right)", "proved"),
        (rf"\operatorname{{atan2}}({AREA}, -{PRODUCT})", "proved"),
        (rf"2 \arctan \left( \frac{{{ACROSS}}}{{{ALONG}}} \right)", "proved"),
        (rf"\arcsin({AREA})", "refuted"),
    ],
)
def test_an_angle_may_be_printed_by_another_function(
    source: Source, declarations: Declarations, angle: str, verdict: str
) -> None:
    """Every force and Jacobian of bending is then judged through that function, and is as good as the angle."""
    from yarnverify.symbolic.prove import try_document

    head, rest = source.text.split("## Stretch")
    text = head + "## Bending" + rest.split("## Bending")[1].split("## Shear")[0]
    printed = r"\arccos \left(-\mathbf{d}_1^T \mathbf{d}_2 \right)"
    assert text.count(printed) == 1
    document = read_with(Source("edition.md", text.replace(printed, angle)), declarations)
    found: dict[str, set[str]] = {}
    for judged in try_document(document, declarations).judged:
        found.setdefault(judged.claim.relation.equation, set()).add(judged.finding.verdict.value)
    assert found["12"] == {verdict}
    assert found["18"] == found["21"] == {"refuted"}  # as printed
    assert "undecided" not in set.union(*found.values()) and "inconsistent" not in set.union(*found.values())
    if verdict == "proved":
        assert all(verdicts == {"proved"} for equation, verdicts in found.items() if equation not in ("18", "21"))
