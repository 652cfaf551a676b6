"""What a document states: sections, definitions, assumptions, claims, shapes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from yarnverify.errors import InputError
from yarnverify.source import Source
from yarnverify.symbolic.declare import Declarations
from yarnverify.symbolic.document import Document, Section, block_of, instantiate, read_document
from yarnverify.symbolic.latex import latex
from yarnverify.symbolic.prove import read_with
from yarnverify.symbolic.reader import read_formula
from yarnverify.symbolic.tree import Expr, Name, Type

ENERGY = r"$$V = \frac{1}{2} k u_1^2 \quad (1)$$"


def document(*lines: str) -> Document:
    return read_document(Source("d.md", "\n\n".join(lines)))


def section(*lines: str) -> Section:
    """One section: the energy stands in line 3 and ``lines`` in 5, 7, ..."""
    (only,) = document("## S", ENERGY, *lines).sections
    return only


def claims(part: Section) -> list[str]:
    return [f"({c.relation.equation}) {c.block}: {latex(c.left)} = {latex(c.right)}" for c in part.claims]


# -- definitions ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("definition", "use", "meaning"),
    [
        (r"l_i = \|\mathbf{x}_i - \mathbf{x}_0\|", r"l_3", r"\|\mathbf{x}_3 - \mathbf{x}_0\|"),
        (r"l_i = \|\mathbf{x}_i - \mathbf{x}_0\|", r"l_i", r"\|\mathbf{x}_i - \mathbf{x}_0\|"),
        (r"l_i = \|\mathbf{x}_i - \mathbf{x}_0\|", r"l_{j+1}", r"\|\mathbf{x}_{j+1} - \mathbf{x}_0\|"),
        (r"l_i = u_{i+1} - u_{i-1}", "l_3", "u_4 - u_2"),
        (r"l_i = u_{i+1} - u_{i-1}", "l_j", "u_{j+1} - u_{j-1}"),
        (r"l_i = u_{i+1} - u_{i-1}", "l_{10}", "u_{11} - u_9"),
        (r"\theta = u_1^2", r"\theta", "u_1^2"),
        (r"\Delta u = u_1 - u_0 > 0", r"\Delta u", "u_1 - u_0"),
        (r"0 < \Delta u = u_1 - u_0", r"\Delta u", "u_1 - u_0"),
    ],
)
def test_a_definition_is_read_and_its_running_index_filled_in(definition: str, use: str, meaning: str) -> None:
    found = section(f"let ${definition}$").meaning(read_formula(use).name)
    assert found == read_formula(meaning)


def test_an_index_that_the_right_side_lacks_is_not_running() -> None:
    found = section("$k_b = 3$")
    assert found.meaning(Name("k", "b")) == read_formula("3") and found.meaning(Name("k", "s")) is None


def test_a_special_definition_goes_before_its_family() -> None:
    found = section("$l_0 = 1$", "$l_i = u_i$")
    assert found.meaning(Name("l", "0")) == read_formula("1")
    assert found.meaning(Name("l", "2")) == read_formula("u_2")


def test_a_definition_may_stand_after_its_use() -> None:
    (found,) = document("## S", r"$$V = k \theta^2 \quad (1)$$", r"$$\theta = u_1 - u_0 \quad (2)$$").sections
    assert found.parameters == (Name("k"),)
    assert found.unknowns == (Name("u", "0"), Name("u", "1"))


def test_a_second_definition_is_a_claim_on_the_first() -> None:
    assert claims(section(r"$$\theta = u_1 \quad (2)$$", r"$$\theta = u_2 \quad (3)$$")) == [r"(3) theta: \theta = u_2"]


def test_a_definition_that_goes_on_is_a_claim_too() -> None:
    assert claims(section(r"$$\theta = u_1^2 = u_2 \quad (2)$$")) == [r"(2) u_2: u_1^2 = u_2"]


def test_expansion_follows_definitions_to_the_end() -> None:
    found = section(r"$l_i = u_i - u_0$", r"$\theta = l_1 l_2$")
    assert found.expand(read_formula(r"2 \theta")) == read_formula("2 ((u_1 - u_0) (u_2 - u_0))")
    assert found.base_symbols(read_formula(r"\theta + k")) == [
        Name("u", "1"),
        Name("u", "0"),
        Name("u", "2"),
        Name("k"),
    ]


def test_a_recursion_that_ends_is_no_circle() -> None:
    found = section("$l_0 = 0$", "$l_i = l_{i-1} + u_i$")
    assert found.expand(read_formula("l_2")) == read_formula("(0 + u_1) + u_2")


def test_undefined_symbols_are_found_through_definitions() -> None:
    found = section(r"$\theta = q + u_1$")
    trees = [r"\theta r", r"\frac{\partial V}{\partial w}", "F_{u_1} + k"]
    assert [[str(n) for n in found.undefined(read_formula(t))] for t in trees] == [["q", "r"], ["w"], []]


def test_instantiation_leaves_other_indices_alone() -> None:
    tree = read_formula(r"l_i + l_j + F_{u_i} + \frac{\partial V}{\partial u_{i+1}}")
    assert latex(instantiate(tree, "i", "1")) == r"l_1 + l_j + F_{u_1} + \frac{\partial V}{\partial u_2}"


# -- assumptions ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("chain", "expected"),
    [
        ("a > b", ["a > b"]),
        ("a < b", ["b > a"]),
        (r"a \ge b", ["a >= b"]),
        ("a > b > c", ["a > b", "a > c", "b > c"]),
        ("a < b < c", ["b > a", "c > a", "c > b"]),
        (r"a > b \ge c", ["a > b", "a > c", "b >= c"]),
        ("a > b < c", ["a > b", "c > b"]),
        ("a = b > c", ["a > c", "b > c"]),
        ("a > b = c", ["a > b", "a > c"]),
        ("a = b = c", []),
        ("a > b, c < d", ["a > b", "d > c"]),
    ],
)
def test_assumptions_of_a_chain(chain: str, expected: list[str]) -> None:
    found = section(f"where ${chain}$").assumptions
    assert [f"{latex(a.left)} {'>' if a.strict else '>='} {latex(a.right)}" for a in found] == expected


# -- claims -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("F_{u_1} = -k u_1", ["F_u1: F_{u_1} = -k u_1"]),
        ("F_{u_1} = -F_{u_0} = k", ["F_u1: F_{u_1} = k", "F_u0: -F_{u_0} = k"]),
        ("F_{u_1} = k, F_{u_0} = 0", ["F_u1: F_{u_1} = k", "F_u0: F_{u_0} = 0"]),
        ("k u_1 = F_{u_1}", ["F_u1: k u_1 = F_{u_1}"]),
        ("k u_1 = 2 k", ["k u_1: k u_1 = 2 k"]),
        (r"\frac{\partial V}{\partial u_1} = k", [r"dV/du1: \frac{\partial V}{\partial u_1} = k"]),
        (
            r"\frac{\partial F_{u_1}}{\partial \mathbf{x}_0} = -\frac{\partial F_{u_1}}{\partial \mathbf{x}_1} = 0",
            [
                r"dF_u1/dx0: \frac{\partial F_{u_1}}{\partial \mathbf{x}_0} = 0",
                r"dF_u1/dx1: -\frac{\partial F_{u_1}}{\partial \mathbf{x}_1} = 0",
            ],
        ),
        (r"\theta = F_{u_1}", [r"theta: \theta = F_{u_1}"]),  # forces are never part of a definition
        ("u_1 = 2 u_0", ["u_1: u_1 = 2 u_0"]),  # an unknown is not defined either
    ],
)
def test_claims_of_a_display(formula: str, expected: list[str]) -> None:
    found = section(f"$${formula} \\quad (2)$$")
    assert [text.removeprefix("(2) ") for text in claims(found)] == expected
    assert [text.removeprefix("(line 5) ") for text in claims(section(f"and ${formula}$"))] == expected


def test_blocks_are_named_after_forces_and_unknowns() -> None:
    blocks = [
        block_of(read_formula(t))
        for t in (r"-\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial u_0}", r"\theta", "2 a")
    ]
    assert blocks == ["dF_x1/du0", "theta", ""]


def test_the_main_document(folder: Path, source: Source, declarations: Declarations) -> None:
    found = read_with(source, declarations)
    assert found.equations == tuple(str(n) for n in range(1, 45))
    assert [(s.title, len(s.claims)) for s in found.sections] == [
        ("Stretch", 20), ("Bending", 31), ("Shear", 12), ("Parallel Contact", 6),
    ]  # fmt: skip
    assert list(map(str, found.shared.definitions)) == ["l_i", "d_i", "w_i", "P_i"]
    assert [[str(n) for n in s.unknowns] for s in found.sections] == [
        ["x_0", "x_1", "u_0", "u_1"], ["x_0", "x_1", "x_2", "u_1", "u_2"], ["x_0", "x_1", "x_3"], ["u_0", "u_1"],
    ]  # fmt: skip


def wrapped(text: str) -> str:
    """The document in the form of a scanned paper: numbered headings, prose with raw LaTeX, mentions between dollars."""
    count = 0

    def heading(match: re.Match[str]) -> str:
        nonlocal count
        count += 1
        return f"{count} {match[1]}\n\nEnergy of the part $[\\mathbf{{q}}_0, \\mathbf{{q}}_1]$ of \\mathbf{{q}}_0 , for $k_s$:"

    text = re.sub(r"^# (.*)", r"\n\n\1\n\nSomebody Else\n\n12 Street, Town\n", text, flags=re.MULTILINE)
    text = re.sub(r"^## (.*)", heading, text, flags=re.MULTILINE)
    text = text.replace("Assumed: ", "All of it is about \\mathbf{q}_0 (see Fig. 2), assuming ")
    return re.sub(r"^\$\$", "Forces on each \\\\mathbf{x}_i are:\n\n$$", text, flags=re.MULTILINE)


def test_the_main_document_as_prose_gives_the_same_claims(source: Source, declarations: Declarations) -> None:
    def content(found: Document) -> list[tuple[str, list[tuple[str, str, Expr, Expr]], list[str]]]:
        return [
            (s.title, [(c.relation.equation, c.block, c.left, c.right) for c in s.claims if not c.relation.inline],
             [f"{latex(a.left)} > {latex(a.right)} {a.strict}" for a in s.assumptions])
            for s in found.sections
        ]  # fmt: skip

    text = wrapped(source.text)
    assert text.count("\n\n") > 2 * source.text.count("\n\n") - 20
    for declared in (declarations, Declarations()):
        plain, prose = read_with(source, declared), read_with(Source("p.txt", text), declared)
        assert content(prose) == content(plain)
        assert prose.equations == plain.equations


# -- sections ---------------------------------------------------------------------------------------------------------

OTHER = ENERGY.replace("(1)", "(2)")


@pytest.mark.parametrize(
    ("lines", "titles"),
    [
        (["## S", ENERGY], ["S"]),
        (["# Title", "## S", ENERGY, "## R", OTHER], ["S", "R"]),
        (["# S", ENERGY, "# R", OTHER], ["S", "R"]),
        (["1 Stretch", ENERGY, "2 Bending", OTHER], ["Stretch", "Bending"]),
        (["Prose", "1. Stretch", ENERGY, "2. Bending", OTHER], ["Stretch", "Bending"]),
        (["# T", "1 Stretch", ENERGY, "1.1 Forces", "$$F_{u_1} = 0 \\quad (3)$$", "2 Bending", OTHER], ["Stretch", "Bending"]),
        (["# Title", "## S", "### Energy", ENERGY, "### Forces", "## R", OTHER], ["S", "R"]),
        (["# Title", "## Notation", r"$$l_i = u_i - u_0 \quad (3)$$", "## S", ENERGY], ["S"]),
        (["# Title", "## S", ENERGY, "## Notation", r"$$l_i = u_i - u_0 \quad (3)$$"], ["S"]),
    ],
)  # fmt: skip
def test_sections(lines: list[str], titles: list[str]) -> None:
    assert [s.title for s in document(*lines).sections] == titles


def test_claims_under_deeper_headings_belong_to_the_section() -> None:
    (found,) = document("# T", "## S", ENERGY, "### Forces", "$$F_{u_1} = -k u_1 \\quad (2)$$").sections
    assert claims(found) == ["(2) F_u1: F_{u_1} = -k u_1"]


def test_definitions_of_a_section_without_claims_hold_in_all() -> None:
    lines = ["## Notation", r"$$l_i = u_i - u_0 \quad (3)$$", "where $u_1 > u_0$", "## S", r"$$V = k l_1 \quad (1)$$"]
    found = document(*lines)
    assert found.sections[0].expand(read_formula("l_2")) == read_formula("u_2 - u_0")
    assert len(found.shared.assumptions) == 1


def test_definitions_of_one_section_do_not_reach_another() -> None:
    first, second = document("## S", ENERGY, r"$\theta = u_1$", "## R", OTHER, r"$\theta = u_2$").sections
    assert (first.meaning(Name("theta")), second.meaning(Name("theta"))) == (read_formula("u_1"), read_formula("u_2"))


def test_without_declared_energies_symbols_are_told_apart_by_the_printed_energy() -> None:
    lines = [
        "## S",
        r"$$V_{0,1} = k_s L \|\mathbf{p}_1 - \mathbf{p}_0\| (u_1 - v_0) \quad (1)$$",
        r"$$F_{w_1} = 0 \quad (2)$$",
    ]
    (found,) = document(*lines).sections
    assert found.energy is not None and found.energy.symbol == Name("V", "0,1")
    assert list(map(str, found.parameters)) == ["k_s", "L"]
    assert list(map(str, found.unknowns)) == ["p_0", "p_1", "u_1", "v_0"]
    kinds = [
        found.lookup(name) for name in (Name("p", "1", True), Name("u", "3"), Name("w", "1"), Name("L"), Name("q"))
    ]
    assert kinds == [Type.VECTOR, Type.SCALAR, Type.SCALAR, Type.SCALAR, Type.UNKNOWN]


# -- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lines", "place", "words"),
    [
        (["# T", "## S", "$$F_{u_1} = 0 \\quad (1)$$"], "3:1", "section 'S' has no energy"),
        (["## S", ENERGY, "## R", "$$F_{u_1} = 0 \\quad (2)$$"], "5:1", "section 'R' has no energy"),
        (["x", "1 Stretch", "$$F_{u_1} = 0 \\quad (1)$$"], "3:1", "section 'Stretch' has no energy"),
        (["## S", r"$$l_i = u_i \quad (1)$$"], "1:1", "no section with an energy"),
        (["## S", r"where $\theta = u_1$ and $V > 0$"], "1:1", "no section with an energy"),
        ([ENERGY], "1:1", r"equation (1) states an energy before the first section heading"),
        (["x", ENERGY, "## S", OTHER], "3:1", r"equation (1) states an energy before the first section heading"),
        (
            ["$$F_{u_1} = 0 \\quad (7)$$", "## S", ENERGY],
            "1:1",
            "equation (7) states a claim before the first section heading",
        ),
        (["# T", "words"], "1:1", "no numbered formulas"),
        (["words $a$"], "1:1", "no numbered formulas"),
    ],
)
def test_a_document_is_refused_at(lines: list[str], place: str, words: str) -> None:
    with pytest.raises(InputError, match=rf"^d\.md:{place}: .*{re.escape(words)}"):
        document(*lines)


@pytest.mark.parametrize(
    ("definitions", "place"),
    [
        ([r"\theta = \theta + 1"], "5:"),
        ([r"\theta = \phi", r"\phi = 2 \theta"], "[57]:"),
        ([r"l_i = l_i^2 + u_i"], "5:"),
        ([r"l_i = l_{i+1} + u_i"], "5:"),
    ],
)
@pytest.mark.parametrize("place_of_use", ["energy", "claim"])
def test_a_circle_of_definitions_is_refused(definitions: list[str], place: str, place_of_use: str) -> None:
    symbol = definitions[0].split(" ")[0].replace("_i", "_1")
    energy = f"$$V = k {symbol if place_of_use == 'energy' else 'u_1'} \\quad (1)$$"
    definitions = [*definitions, f"F_{{u_1}} = {symbol}"]
    lines = [f"$${text} \\quad ({n})$$" for n, text in enumerate(definitions, 2)]
    with pytest.raises(InputError, match=rf"^d\.md:{place}\d+: .*is defined by itself"):
        document("## S", energy, *lines)


def a(formula: str) -> str:
    """A vector or covector formula as a scalar claim, so that only its own shapes can be wrong."""
    return f"$$F_{{u_1}} = {formula} \\quad (2)$$"


COLUMN = len("$$F_{u_1} = ") + 1
P = r"(\mathbf{x}_1 \mathbf{x}_1^T)"


@pytest.mark.parametrize(
    ("formula", "shift", "words"),
    [
        (r"\mathbf{x}_1 + u_1", 15, "cannot add a scalar to a vector"),
        (r"u_1 - \mathbf{x}_1", 4, "cannot add a vector to a scalar"),
        (r"\mathbf{x}_1 + \mathbf{x}_1^T", 15, "cannot add a covector to a vector"),
        (r"\mathbf{I} + u_1", 13, "cannot add a scalar to a matrix"),
        (r"\mathbf{x}_1 \mathbf{x}_1", 13, "cannot multiply a vector by a vector"),
        (r"\mathbf{x}_1 \mathbf{I}", 13, "cannot multiply a vector by a matrix"),
        (r"\mathbf{I} \mathbf{x}_1^T", 11, "cannot multiply a matrix by a covector"),
        (r"\mathbf{x}_1^T \mathbf{x}_1^T", 15, "cannot multiply a covector by a covector"),
        (r"\frac{1}{\mathbf{x}_1}", 9, "cannot divide by a vector"),
        (r"\frac{1}{\mathbf{x}_1^T}", 9, "cannot divide by a covector"),
        (r"\frac{1}{\mathbf{I}}", 9, "cannot divide by a matrix"),
        (r"\sin \mathbf{x}_1", 5, "cannot take sin of a vector"),
        (r"\arccos(\mathbf{x}_1)", 8, "cannot take arccos of a vector"),
        (r"\sqrt{\mathbf{x}_1}", 6, "cannot take the square root of a vector"),
        (r"|\mathbf{x}_1|", 1, "cannot take the absolute value of a vector"),
        (r"\mathbf{x}_1^2", 0, "cannot raise a vector to a power"),
        (r"\mathbf{I}^2", 0, "cannot raise a matrix to a power"),
        (r"\|\mathbf{I}\|", 2, "cannot take the norm of a matrix"),
        (r"u_1 \times \mathbf{x}_1", 0, "cannot take the cross product of a scalar and a vector"),
        (r"\mathbf{x}_1^T \cdot \mathbf{x}_1", 0, "cannot take the dot product of a covector and a vector"),
        (r"\frac{\partial \mathbf{x}_1^T}{\partial u_1}", None, ""),
        (r"\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_1} + u_1", None, "cannot add a scalar to a matrix"),
    ],
)  # fmt: skip
def test_shapes_that_do_not_go_together(formula: str, shift: int | None, words: str) -> None:
    column = r"\d+" if shift is None else COLUMN + shift
    with pytest.raises(InputError, match=rf"^d\.md:5:{column}: .*{re.escape(words)}"):
        section(a(formula))


@pytest.mark.parametrize(
    ("formula", "kind"),
    [
        (r"\mathbf{x}_1^T \mathbf{x}_0", Type.SCALAR),
        (r"\mathbf{x}_1 \mathbf{x}_0^T", Type.MATRIX),
        (r"\mathbf{x}_1^T \mathbf{I}", Type.COVECTOR),
        (r"\mathbf{I} \mathbf{x}_1", Type.VECTOR),
        (r"\mathbf{I} \mathbf{I}^T", Type.MATRIX),
        (r"(\mathbf{x}_1^T)^T", Type.VECTOR),
        (r"2 \mathbf{x}_1 u_1", Type.VECTOR),
        (r"\frac{\mathbf{x}_1}{u_1}", Type.VECTOR),
        (r"\mathbf{x}_1 \times \mathbf{x}_0", Type.VECTOR),
        (r"\mathbf{x}_1 \cdot \mathbf{x}_0", Type.SCALAR),
        (r"u_1 \cdot \mathbf{x}_0", Type.VECTOR),
        (r"\|\mathbf{x}_1\|^2 + |u_1| + \sqrt{2} + \sin u_1 + \pi + V", Type.SCALAR),
        (r"\mathbf{F}_{\mathbf{x}_1}", Type.VECTOR),
        (r"\frac{\partial V}{\partial \mathbf{x}_1}", Type.COVECTOR),
        (r"\frac{\partial V}{\partial u_1}", Type.SCALAR),
        (r"\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_1}", Type.MATRIX),
        (r"\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial u_1}", Type.VECTOR),
        (r"q + \mathbf{x}_1", Type.UNKNOWN),
        (r"q \mathbf{x}_1", Type.UNKNOWN),
        (r"q^T", Type.UNKNOWN),
        (r"q \cdot u_1", Type.UNKNOWN),
        (r"\frac{\partial q}{\partial u_1}", Type.UNKNOWN),
    ],
)
def test_shape_of(formula: str, kind: Type) -> None:
    assert section().type_of(read_formula(formula)) is kind


@pytest.mark.parametrize(
    ("line", "column", "words"),
    [
        (r"where $\mathbf{x}_1 > 0$", 8, "cannot compare a vector by >"),
        (r"where $0 < \mathbf{x}_1$", 12, "cannot compare a vector by <"),
        (r"where $u_1 > u_0 > \mathbf{x}_1$", 20, "cannot compare a vector by >"),
        (r"where $\theta = \mathbf{x}_1 + u_1$", 32, "cannot add a scalar to a vector"),
    ],
)
def test_assumptions_and_inline_definitions_have_shapes_too(line: str, column: int, words: str) -> None:
    with pytest.raises(InputError, match=rf"^d\.md:5:{column}: .*{words}"):
        section(line)


def test_an_energy_is_a_scalar() -> None:
    with pytest.raises(InputError, match=r"^d\.md:3:7: an energy is a scalar"):
        document("## S", r"$$V = \mathbf{x}_1 \quad (1)$$")


def test_an_undefined_symbol_is_left_for_the_verdict() -> None:
    assert len(section(r"$$F_{u_1} = q \mathbf{x}_1 + r \quad (2)$$").claims) == 1


BAD_STATEMENTS = [
    ("0 < F_{u_1} = k u_1", "a claim about forces or energies must be an equation"),
    ("F_{u_1} = k u_1 > F_{u_0} = 0", "a claim about forces or energies must be an equation"),
    (r"\frac{\partial F_{u_1}}{\partial u_1} > 0", "a claim about forces or energies must be an equation"),
    ("V = k", "states a second energy in section 'A', after equation (1); is a heading missing?"),
    (r"V_b = \frac{1}{2} k u_1^2", "states a second energy in section 'A', after equation (1); is a heading missing?"),
]


@pytest.mark.parametrize(("statement", "message"), BAD_STATEMENTS)
def test_a_statement_that_cannot_be_judged_is_refused(statement: str, message: str) -> None:
    with pytest.raises(InputError, match=rf"^d\.md:5:\d+: .*{re.escape(message)}"):
        document("## A", ENERGY, rf"$${statement} \quad (2)$$")


def test_an_energy_may_be_stated_in_another_form() -> None:
    (section,) = document("## A", ENERGY, r"$$V = k \frac{u_1^2}{2} \quad (2)$$").sections
    assert [claim.block for claim in section.claims] == ["V"]


def test_points_without_an_index_are_unknowns_where_forces_name_them() -> None:
    energy = r"$$V = \frac{1}{2} k \|\mathbf{q} - \mathbf{p}\|^2 \quad (1)$$"
    (section,) = document("## A", energy, r"$$\mathbf{F}_{\mathbf{p}} = -\mathbf{F}_{\mathbf{q}} \quad (2)$$").sections
    assert [str(name) for name in section.unknowns] == ["p", "q"] and [str(n) for n in section.parameters] == ["k"]
