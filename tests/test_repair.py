"""Repairs: a single mistake planted into a correct equation is found and mended, and the mended equation is proved."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from yarnverify.library import Shelf, shelf_for
from yarnverify.source import Source
from yarnverify.symbolic.court import Court, Finding, Verdict
from yarnverify.symbolic.declare import Declarations
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.latex import latex
from yarnverify.symbolic.prove import read_with
from yarnverify.symbolic.reader import read_formula
from yarnverify.symbolic.record import prove_source
from yarnverify.symbolic.repair import Repair, Workshop, chain_latex, describe
from yarnverify.symbolic.tree import Expr

BLOCKS = {
    "F_x1": r"\mathbf{F}_{\mathbf{x}_1}",
    "F_u1": r"F_{u_1}",
    "F_u0": r"F_{u_0}",
    "dF_x1/dx1": r"\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_1}",
    "dF_x1/dx2": r"\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_2}",
    "dF_u0/du0": r"\frac{\partial F_{u_0}}{\partial u_0}",
    "dF_u1/du1": r"\frac{\partial F_{u_1}}{\partial u_1}",
    "dF_u1/dx1": r"\frac{\partial F_{u_1}}{\partial \mathbf{x}_1}",
}
MANY = None


@pytest.fixture(scope="module")
def courts(source: Source, declarations: Declarations) -> dict[str, Court]:
    sections = read_with(source, declarations).sections
    return {s.title: Court(s, s.energy.expression) for s in sections if s.energy is not None}


def mend(court: Court, left: str, right: str) -> Repair | None:
    members = (read_formula(left), read_formula(right))
    return Workshop(court.reaching(members), members, lambda trees: [(trees[0], trees[1])]).find()


def proved(court: Court, members: tuple[Expr, ...]) -> bool:
    return court.reaching(members).judge(members[0], members[-1]).verdict is Verdict.PROVED


BEND = r"\frac{2 k_b \theta}{l_1 (u_1 - u_2) \sin \theta}"


@pytest.mark.parametrize(
    ("title", "block", "right", "change"),
    [
        ("Stretch", "F_x1", r"k_s (\|\mathbf{w}_1\| - 1) \mathbf{d}_1", "sign"),
        ("Stretch", "F_x1", r"-k_s (\|\mathbf{w}_1\| + 1) \mathbf{d}_1", "sign"),
        ("Stretch", "F_x1", r"-k_s (\|\mathbf{w}_1\| - 1) \mathbf{d}_2", "index"),
        ("Stretch", "F_x1", r"-k_s (\|\mathbf{w}_1\| - 1) \mathbf{d}_1^T", "transpose"),
        ("Stretch", "dF_u1/dx1", r"\frac{k_s}{\Delta u} \mathbf{w}_1", "transpose"),
        ("Stretch", "F_x1", r"-\frac{1}{2} k_s (\|\mathbf{w}_1\| - 1) \mathbf{d}_1", "extra factor"),
        ("Stretch", "F_x1", r"-k_s (\|\mathbf{w}_1\| - 2) \mathbf{d}_1", "number"),
        ("Stretch", "F_u1", r"\frac{1}{2} k_s (\|\mathbf{w}_1\| - 1)", "power"),
        ("Stretch", "F_u1", r"\frac{1}{2} k_s (\|\mathbf{w}_1\|^3 - 1)", "power"),
        ("Stretch", "F_u1", r"\frac{1}{2} k_s \Delta u (\|\mathbf{w}_1\|^2 - 1)", "extra factor"),
        ("Stretch", "F_u1", r"\frac{1}{2} (\|\mathbf{w}_1\|^2 - 1)", "missing factor"),
        ("Stretch", "F_u1", r"\frac{k_s}{2} (\|\mathbf{w}_1\|^2 - 1 + l_1)", "extra term"),
        ("Stretch", "F_u1", r"\frac{2}{k_s} (\|\mathbf{w}_1\|^2 - 1)", "fraction upside down"),
        ("Stretch", "F_x1", r"-K (\|\mathbf{w}_1\| - 1) \mathbf{d}_1", "undefined symbol"),
        ("Stretch", "dF_x1/dx1", r"\frac{k_s}{\Delta u} \mathbf{P}_1 - \frac{k_s}{\Delta u} \mathbf{I}", "symbol"),
        (
            "Bending",
            "F_x1",
            r"-\frac{2 k_b \theta}{(u_1 - u_2) \sin \theta} \mathbf{P}_1 \mathbf{d}_2",
            "missing factor",
        ),
        ("Bending", "F_x1", r"-\frac{2 k_b \theta}{l_1 (u_1 - u_2) \cos \theta} \mathbf{P}_1 \mathbf{d}_2", "function"),
        ("Bending", "F_x1", r"-\frac{2 k_b \theta}{l_1 (u_1 - u_2)} \mathbf{P}_1 \mathbf{d}_2", "missing factor"),
        ("Bending", "F_x1", r"-\frac{2 k_b \theta}{l_1 (u_1 - u_2)^2 \sin \theta} \mathbf{P}_1 \mathbf{d}_2", "power"),
        ("Bending", "F_x1", rf"-{BEND} \mathbf{{d}}_2", "missing factor"),
        ("Bending", "F_x1", rf"-{BEND} \mathbf{{P}}_2 \mathbf{{d}}_1", MANY),
        ("Bending", "F_x1", rf"-\frac{{1}}{{l_2}} {BEND} \mathbf{{P}}_1 \mathbf{{d}}_2", "extra"),
        ("Shear", "F_x1", r"\frac{k_x L (\phi - \pi)}{l_1 \sin \phi} \mathbf{P}_1 \mathbf{d}_3", "missing factor"),
        ("Shear", "F_x1", r"\frac{k_x L (\phi - \frac{\pi}{2})}{l_3 \sin \phi} \mathbf{P}_1 \mathbf{d}_3", "index"),
        (
            "Shear",
            "F_x1",
            r"\frac{k_x L (\psi - \frac{\pi}{2})}{l_1 \sin \psi} \mathbf{P}_1 \mathbf{d}_3",
            "undefined symbol",
        ),
        ("Parallel Contact", "F_u0", r"k_c d (\Delta u - d)", "symbol"),
        ("Parallel Contact", "F_u0", r"k_c L (\Delta u + d)", "sign"),
        ("Parallel Contact", "F_u0", r"L (\Delta u - d)", "missing factor"),
        ("Parallel Contact", "dF_u0/du0", "-k_c", "missing factor"),
        ("Parallel Contact", "dF_u0/du0", "-L", "missing factor"),
        ("Parallel Contact", "dF_u0/du0", "L", MANY),
        ("Bending", "F_u1", r"\frac{k_b \theta^2}{u_1 - u_2}", "power"),
        ("Bending", "dF_u1/du1", r"-\frac{2 k_b \theta^2}{u_1 - u_2}", "power"),
        ("Bending", "F_u0", r"\frac{k_b \theta^2}{(u_1 - u_2)^2}", "zero"),
        ("Shear", "F_x1", r"\frac{k_x L}{l_1 \sin \phi} \mathbf{P}_1 \mathbf{d}_3", MANY),
        (
            "Bending",
            "dF_x1/dx2",
            r"-\frac{2 k_b}{l_2 l_1 (u_1 - u_2) \sin \theta} \left(\left(\mathbf{P}_1 - \frac{\cos \theta}{\sin^2 \theta}"
            r" \mathbf{P}_1 \mathbf{d}_2 \mathbf{d}_1^T \right)"
            r" + \frac{1}{\sin \theta} \mathbf{P}_1 \mathbf{d}_2 \mathbf{d}_1^T \right) \mathbf{P}_2",
            "missing factor",
        ),
    ],
)
def test_a_planted_mistake_is_mended(
    courts: dict[str, Court], title: str, block: str, right: str, change: str | None
) -> None:
    court = courts[title]
    assert not proved(court, (read_formula(BLOCKS[block]), read_formula(right)))
    repair = mend(court, BLOCKS[block], right)
    if change is MANY:  # two mistakes at once are not one small change, unless they happen to be
        assert repair is None or proved(court, repair.members)
        return
    assert repair is not None
    assert proved(court, repair.members)
    assert repair.change.startswith(change)
    assert chain_latex(repair.members[:1]) == BLOCKS[block]  # the name of the block is left alone


@pytest.mark.parametrize(
    ("title", "left", "right"),
    [
        ("Stretch", BLOCKS["F_x1"], r"-\frac{k_s}{3} (\|\mathbf{w}_1\| - 1) \mathbf{d}_1"),
        ("Stretch", BLOCKS["F_u1"], r"\frac{1}{2} k_s \left( \|\frac{\mathbf{w}_1}{3}\|^2 - 1 \right)"),
        ("Stretch", BLOCKS["dF_u1/dx1"], r"\left( \frac{k_s}{\Delta u} \mathbf{w}_1^T \right)^T"),
        ("Bending", BLOCKS["F_x1"], r"-\frac{2 k_b \theta}{(u_1 - u_2) \sin \theta} \mathbf{P}_1 \mathbf{d}_2"),
        ("Parallel Contact", BLOCKS["F_u0"], r"(-k_c) L (\Delta u - d)"),
        (
            "Bending",
            r"\frac{\mathbf{F}_{\mathbf{x}_0}}{3}",
            r"-(\mathbf{F}_{\mathbf{x}_1} + \mathbf{F}_{\mathbf{x}_2})",
        ),
        ("Bending", r"\mathbf{F}_{\mathbf{x}_0}", r"-(\mathbf{F}_{\mathbf{x}_1} + \mathbf{F}_{\mathbf{x}_2})^T"),
        (
            "Bending",
            r"\frac{\partial \mathbf{F}_{\mathbf{x}_0}}{\partial \mathbf{x}_2}",
            r"-\left( \frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_2}"
            r" + \frac{\partial \mathbf{F}_{\mathbf{x}_2}}{\partial \mathbf{x}_2} \right)^T",
        ),
    ],
)
def test_what_is_mended_reads_as_it_was_meant(courts: dict[str, Court], title: str, left: str, right: str) -> None:
    """The repair is the paper's own formula: no factor 1, no transpose of a transpose, no fraction over a fraction."""
    repair = mend(courts[title], left, right)
    assert repair is not None
    meant = {
        r"k_c L \left( \Delta u - d \right)",
        r"-k_s \left( \|\mathbf{w}_1\| - 1 \right) \mathbf{d}_1",
        r"\frac{1}{2} k_s \left( \|\mathbf{w}_1\|^2 - 1 \right)",
        r"\frac{k_s}{\Delta u} \mathbf{w}_1^T",
        r"-\frac{2 k_b \theta}{l_1 \left( u_1 - u_2 \right) \sin \theta} \mathbf{P}_1 \mathbf{d}_2",
        r"-\left( \mathbf{F}_{\mathbf{x}_1} + \mathbf{F}_{\mathbf{x}_2} \right)",
        r"-\left( \frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_2}"
        r" + \frac{\partial \mathbf{F}_{\mathbf{x}_2}}{\partial \mathbf{x}_2} \right)",
    }
    assert latex(repair.members[1]) in meant
    assert latex(repair.members[0]) == (r"\mathbf{F}_{\mathbf{x}_0}" if "{3}" in left else left)


@pytest.mark.parametrize(
    ("right", "text"),
    [
        (r"k_s (\|\mathbf{w}_1\| - 1) \mathbf{d}_1", r"sign of k_s"),
        (r"-k (\|\mathbf{w}_1\| - 1) \mathbf{d}_1", r"k should be k_s"),
        (r"-k_s (\|\mathbf{w}_1\| - 1) \mathbf{d}_2", r"index: \mathbf{d}_2 should be \mathbf{d}_1"),
        (r"-k_s (\|\mathbf{w}_1\| - 3) \mathbf{d}_1", r"number: 3 should be 1"),
    ],
)
def test_a_change_is_described_in_the_notation_of_the_paper(courts: dict[str, Court], right: str, text: str) -> None:
    repair = mend(courts["Stretch"], BLOCKS["F_x1"], right)
    assert repair is not None
    assert describe(repair).startswith(text)


def test_a_wrong_name_of_a_block_is_mended(courts: dict[str, Court]) -> None:
    repair = mend(courts["Bending"], r"\mathbf{F}_{\mathbf{x}_2}", rf"-{BEND} \mathbf{{P}}_1 \mathbf{{d}}_2")
    assert repair is not None
    assert describe(repair) == r"index: \mathbf{F}_{\mathbf{x}_2} should be \mathbf{F}_{\mathbf{x}_1}"


@pytest.mark.parametrize(
    "right",
    [
        r"-k_s \|\mathbf{w}_1\|^5 \mathbf{d}_3",  # nothing like the force
        r"7 q \mathbf{d}_1",  # an undefined symbol that no symbol stands for
        r"\frac{1}{u_1 - u_1} \mathbf{d}_1 \mathbf{d}_1^T",
    ],
)
def test_what_no_small_change_mends_is_left(courts: dict[str, Court], right: str) -> None:
    assert mend(courts["Stretch"], BLOCKS["F_x1"], right) is None


def test_few_changes_of_an_equation_beyond_repair_are_left_to_the_proof(
    courts: dict[str, Court], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A change may bring in a point that no other formula has, here x_3 by d_3: doubles sort it out all the same."""
    judged: list[tuple[Expr, Expr]] = []
    judge = Court.judge

    def counted(court: Court, left: Expr, right: Expr) -> Finding:
        judged.append((left, right))
        return judge(court, left, right)

    monkeypatch.setattr(Court, "judge", counted)
    right = r"\frac{2 k_b \theta}{l_1 (u_1 - u_3) \sin \theta} \mathbf{P}_1 \mathbf{d}_2"  # its sign and its index
    assert mend(courts["Bending"], BLOCKS["F_x1"], right) is None
    assert len(judged) <= 2


def test_a_chain_is_mended_as_a_whole(courts: dict[str, Court]) -> None:
    """One change of the last member has to serve all claims; a wrong sign of one member is its own."""
    court = courts["Stretch"]
    force, other, right = (
        read_formula(t) for t in (r"F_{u_1}", r"F_{u_0}", r"\frac{1}{2} k_s (\|\mathbf{w}_1\|^2 - 1)")
    )
    members = (force, other, right)
    repair = Workshop(court, members, lambda trees: [(left, trees[-1]) for left in trees[:-1]]).find()
    assert repair is not None
    assert repair.members == (force, -other, right)


def test_an_equation_beyond_repair_gets_the_derived_block(source: Source) -> None:
    text = r"""
## Spring

$$V = \frac{1}{2} k (\|\mathbf{x}_1 - \mathbf{x}_0\| - L)^2 \quad (1)$$

$$\mathbf{F}_{\mathbf{x}_1} = -\mathbf{F}_{\mathbf{x}_0} = k^3 L \mathbf{x}_1 - 5 \mathbf{x}_0 \quad (2)$$

$$\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_1} = k^3 L \mathbf{I} \quad (3)$$

$$\|\mathbf{x}_1 - \mathbf{x}_0\|^2 = k^3 L \quad (4)$$
"""
    record = prove_source(Source("spring.md", text), Shelf(None, "spring.md", "by itself"))
    document = read_with(Source("spring.md", text), Declarations())
    section: Section = document.sections[0]
    assert section.energy is not None
    court = Court(section, section.energy.expression)
    for claim in record["claims"]:
        assert (claim["verdict"], claim["change"]) == ("refuted", None)
        if claim["equation"] == "4":
            assert claim["correction"] is None  # not a block of the energy; there is nothing to derive
            continue
        block, derived = map(read_formula, claim["correction"].split(" = "))
        expanded = [s for s in section.undefined(derived) if s.base not in "ldP"]
        assert not expanded  # written with the length, direction and projection of the segment
        assert court.judge(block, block).verdict is Verdict.PROVED


@pytest.mark.parametrize(
    ("equation", "old", "new", "change"),
    [
        ("3", r"\|u_i - u_0\|", "(u_i - u_0)", r"missing norm: u_i - u_0 should be \|u_i - u_0\|"),
        (
            "32",
            r"\right)^2",
            r"\right)",
            r"power: \phi - \frac{\pi}{2} should be \left( \phi - \frac{\pi}{2} \right)^2",
        ),
        ("42", r"- d)^2", r"+ d)^2", "sign of d"),
        ("44", "-k_c L", "-k_c", "missing factor: k_c should be L k_c"),
        ("17", "F_{u_0} = 0", r"F_{u_0} = \frac{k_b \theta^2}{(u_1 - u_2)^2}", "zero: "),
    ],
)
def test_a_misprint_of_the_paper_is_mended_where_it_is(
    source: Source, equation: str, old: str, new: str, change: str
) -> None:
    display = next(d for d in re.findall(r"\$\$.*?\$\$", source.text, re.DOTALL) if rf"\quad ({equation})$$" in d)
    assert old in display
    text = source.text.replace(display, display.replace(old, new, 1))
    head, *sections = re.split(r"(?m)^(?=## )", text)
    if int(equation) > 4:
        text = head + next(s for s in sections if rf"\quad ({equation})$$" in s)
    record = prove_source(Source("edition.md", text), shelf_for(Path("edition.md"), source.text))
    changes = {c["change"] for c in record["claims"] if c["equation"] == equation and c["verdict"] == "refuted"}
    assert len(changes) == 1
    assert changes.pop().startswith(change)
