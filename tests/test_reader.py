"""The reader on hand-made text: what it accepts and as what, and where and how it refuses."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from yarnverify.errors import InputError
from yarnverify.source import Source, load
from yarnverify.symbolic.latex import latex
from yarnverify.symbolic.reader import Heading, Relation, read, read_formula
from yarnverify.symbolic.tree import IDENTITY, ONE, PI, Expr, Name, number, symbol

A, B, X = symbol("a"), symbol("b"), symbol("x", "1", True)


def norm(a: Expr) -> Expr:
    return Expr("norm", (a,))


def absolute(a: Expr) -> Expr:
    return Expr("abs", (a,))


def call(function: str, a: Expr) -> Expr:
    return Expr("call", (a,), function)


GOOD = {
    r"\frac12 a": number(1) / 2 * A,
    r"\frac{1}{2} a": number(1) / 2 * A,
    r"\dfrac{a}{b}": A / B,
    r"\tfrac 1 2": number(1) / 2,
    r"1.5": number(3) / 2,
    r"a \cdot b": Expr("dot", (A, B)),
    r"\mathbf{x}_1 \times \mathbf{x}_1": Expr("cross", (X, X)),
    r"\mathbf{x}_1 \cdot \mathbf{x}_1 \times \mathbf{x}_1": Expr("cross", (Expr("dot", (X, X)), X)),
    r"a \, \; \: \! \quad \qquad \thinspace ~ \ b": A * B,
    "a\n\tb": A * B,
    r"+a": A,
    r"-a b": -(A * B),
    r"-(a + b) - a": Expr("add", (-(A + B), -A)),
    r"\left( a \right) \left[ b \right]": A * B,
    r"[a] {b}": A * B,
    r"\bar{x}_1": symbol("bar x", "1"),
    r"\hat{\theta}": symbol("hat theta"),
    r"\mathbf{\tilde{x}}_0": symbol("tilde x", "0", True),
    r"\tilde{\mathbf{x}}_0": symbol("tilde x", "0", True),
    r"\Delta u": symbol("Delta u"),
    r"\Delta\bar{u}_1": symbol("Delta bar u", "1"),
    r"\vec{x}_1": X,
    r"\boldsymbol{x}_1": X,
    r"\bm{x}_1": X,
    r"\mathbf x_1": X,
    r"x_{i+1}": symbol("x", "i+1"),
    r"x_{i - 1}": symbol("x", "i-1"),
    r"x_{12}": symbol("x", "12"),
    r"x_{1,2}": symbol("x", "1,2"),
    r"x_{i+1,j}": symbol("x", "i+1,j"),
    r"x_12": symbol("x", "1") * 2,  # as TeX sets it
    r"a^23": A**2 * 3,
    r"a^{12}": A**12,
    r"a^{-2}": A**-2,
    r"a^{+2}": A**2,
    r"\mathbf{x}_1^T": X.T,
    r"\mathbf{x}_1^{T}": X.T,
    r"\mathbf{x}_1^\top": X.T,
    r"\mathbf{x}_1^{\top}": X.T,
    r"\mathbf{I}": IDENTITY,
    r"\mathbf{0}": number(0),
    r"\frac{\pi}{2}": PI / 2,
    r"\sqrt{a}": Expr("sqrt", (A,)),
    r"\sin a": call("sin", A),
    r"\sin \pi": call("sin", PI),
    r"\cos(a + b)": call("cos", A + B),
    r"\sin^2 a": call("sin", A) ** 2,
    r"\sin^2(a)": call("sin", A) ** 2,
    r"\sin a^2": call("sin", A**2),
    r"\tan(a)^2": call("tan", A) ** 2,
    r"\sin a b": call("sin", A) * B,
    r"\|\mathbf{x}_1\|": norm(X),
    r"\|a\| \|b\|": norm(A) * norm(B),
    r"\lVert a \rVert": norm(A),
    r"\Vert a \Vert": norm(A),
    r"|a|": absolute(A),
    r"\lvert a \rvert": absolute(A),
    r"\vert a \vert": absolute(A),
    r"|a| |b|": absolute(A) * absolute(B),
    r"\|a\|^2": norm(A) ** 2,
    r"|a + |b||": absolute(A + absolute(B)),
    r"||a| + b|": absolute(absolute(A) + B),
    r"\| |a| b \|": norm(absolute(A) * B),
    r"\left\| \|a\| + b \right\|": norm(norm(A) + B),
    r"\left| a |b| \right|": absolute(A * absolute(B)),
    r"\left\| a \|b\| \right\|": norm(A * norm(B)),
    r"|a (|b| + a)|": absolute(A * (absolute(B) + A)),
    r"\frac{|a|}{|b|}": absolute(A) / absolute(B),
    r"F_{u_1}": Expr("force", value=Name("u", "1")),
    r"\mathbf{F}_{\mathbf{x}_1}": Expr("force", value=Name("x", "1", True)),
    r"V_{0,1}": Expr("energy", value=Name("V", "0,1")),
    r"\frac{\partial V}{\partial \mathbf{x}_1}": Expr(
        "derivative", (Expr("energy", value=Name("V")),), Name("x", "1", True)
    ),
}


@pytest.mark.parametrize("text", GOOD)
def test_formula_is_read_as(text: str) -> None:
    assert read_formula(text) == GOOD[text]


# what is wrong: the formula, its column, and words that the message must have
BAD = [
    ("a {b", 3, "never closed"),
    ("a b}", 4, "closes nothing"),
    (r"\frac{a}{b", 9, "never closed"),
    (r"a \} }", 6, "closes nothing"),
    (r"a \foo b", 3, r"unknown LaTeX command \foo"),
    (r"\mathrm{d} a", 1, r"unknown LaTeX command \mathrm"),
    (r"\thetas", 1, r"unknown LaTeX command \thetas"),
    (r"a \\ b", 3, "unknown LaTeX command"),
    ("a # b", 3, "unexpected character '#'"),
    ("π", 1, "unexpected character 'π'"),
    ("a b'", 4, "unexpected character"),
    ("a \\", 3, "unexpected character"),
    ("", 1, "empty formula"),
    (r" \quad ", 1, "empty formula"),
    ("a^{0.5}", 4, "exponents are integers"),
    ("a^{1/2}", 5, r"unexpected '/'; an exponent is an integer here"),
    ("/ b", 1, r"unexpected '/'"),
    ("a /", 4, "the formula ends"),
    (r"\sin \theta / 2", 1, r"\sin ... / ... may mean two things"),
    (r"\sin^2 \theta / 2", 1, r"\sin ... / ... may mean two things"),
    (r"\sin 2", 7, "the formula ends"),
    (r"a^T_", 2, "unexpected '^T'"),
    ("a^n", 3, "unexpected 'n'"),
    ("a^{n}", 4, "unexpected 'n'"),
    ("a^{1 + 1}", 6, "unexpected '+'"),
    ("F", 1, "F names no unknown"),
    ("2 F_1", 3, "F_1 names no unknown"),
    (r"\mathbf{F}_i", 1, "F_i names no unknown"),
    (r"\mathbf{1}", 1, r"zero vector \mathbf{0}"),
    (r"\frac{\partial V}{\partial V}", 28, "taken by an unknown"),
    (r"\frac{\partial V}{\partial 2}", 28, "unexpected '2'"),
    (r"x_{F_{u_1}}", 4, "cannot be a subscript"),
    ("a +", 4, "ends where something must follow"),
    (r"\Delta", 7, "ends where something must follow"),
    ("a + + b", 5, "unexpected '+'"),
    (r"\frac{}{a}", 7, "unexpected '}'"),
    ("(a]", 3, "unexpected ']'"),
    (r"\left( a )", 10, "unexpected ')'"),
    (r"\sqrt[3]{a}", 6, "unexpected '['"),
    ("a^2 + (b", 9, "ends where something must follow"),
    ("x_1_2", 4, "unexpected '_2'"),
    ("a, b", 1, "not a relation"),
    ("a = b", 1, "not a relation"),
    (r"\sin", 5, "ends where something must follow"),
]


@pytest.mark.parametrize(("text", "column", "words"), BAD)
def test_formula_is_refused_at(text: str, column: int, words: str) -> None:
    with pytest.raises(InputError, match=rf"^f:1:{column}: .*{re.escape(words)}") as error:
        read_formula(text, "f")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "column"),
    [(r"a \|b", 3), (r"b\|", 2), ("|a", 1), ("a |", 3), ("(|a) b", 2), ("|a| |b", 5), (r"\|a|", 1), (r"\left| a", 1)],
)
def test_a_bar_without_its_partner_is_named(text: str, column: int) -> None:
    with pytest.raises(InputError, match=rf"^f:1:{column}: .*not paired"):
        read_formula(text, "f")


def test_a_bar_where_no_bar_can_stand_is_not_called_unpaired() -> None:
    with pytest.raises(InputError, match=r"^f:1:6: ") as error:
        read_formula(r"\sin |a|", "f")
    assert "not paired" not in str(error.value)


@pytest.mark.parametrize("text", [r"\sin 2(a + b)", r"\sin 2 3"])
def test_a_function_of_a_number_times_more_than_a_symbol_is_refused(text: str) -> None:
    """Every reader of `sin 2 a` takes it for sin(2 a); beyond one symbol it is not clear where the argument ends."""
    with pytest.raises(InputError, match=r"^f:1:"):
        read_formula(text, "f")


@pytest.mark.parametrize(
    "text", ["(" * 2000 + "a" + ")" * 2000, "-(" * 2000 + "a" + ")" * 2000, "9" * 5000, "a^{" + "9" * 5000 + "}"]
)
def test_absurd_sizes_are_refused_in_one_line(text: str) -> None:
    with pytest.raises(InputError, match=r"^f:1:") as error:
        read_formula(text, "f")
    assert "\n" not in str(error.value) and len(str(error.value)) < 300


def test_a_long_sum_is_read() -> None:
    assert len(read_formula(" + ".join("a" * 3000)).args) == 3000


def test_every_node_knows_its_place() -> None:
    text = r"a + \frac{1}{2} \mathbf{x}_1^T \sin^2 b"
    places = {text[slice(*node.span)] for node in read_formula(text).walk()}
    assert {"a", r"\frac{1}{2}", r"\mathbf{x}_1^T", r"\mathbf{x}_1", r"\sin^2 b", "b", text} <= places


# -- whole texts ------------------------------------------------------------------------------------------------------


def items(text: str) -> list[Heading | Relation]:
    return list(read(Source("d.md", text)))


def shown(relation: Heading | Relation) -> str:
    assert isinstance(relation, Relation)
    parts = [latex(relation.members[0])]
    for operator, member in zip(relation.operators, relation.members[1:], strict=True):
        parts += [operator, latex(member)]
    return f"({relation.equation}) " + " ".join(parts)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (r"$$a = b \quad (7)$$", ["(7) a = b"]),
        (r"$$a = b. \quad (7).$$", ["(7) a = b"]),
        (r"$$a = b, \qquad (7a)$$", ["(7a) a = b"]),
        (r"$$a = b (7)$$", ["(7) a = b"]),
        (r"$$a = b \tag{7}$$", ["(7) a = b"]),
        (r"$$a = b \tag{A.2}$$", ["(A.2) a = b"]),
        ("$$\na = b\n\\quad (7)\n$$", ["(7) a = b"]),
        (r"$$a = b = -c \quad (7)$$", ["(7) a = b = -c"]),
        (r"$$a = b, \quad c = d \quad (7)$$", ["(7) a = b", "(7) c = d"]),
        (r"we assume $a > b \ge c$ here", ["(line 1) a > b >= c"]),
        (r"$a \le b$, $a \leq b$, $a \lt b$", ["(line 1) a <= b", "(line 1) a <= b", "(line 1) a < b"]),
        (r"$a \ge b$, $a \geq b$, $a \gt b$", ["(line 1) a >= b", "(line 1) a >= b", "(line 1) a > b"]),
        (r"the segment $[\mathbf{q}_0, \mathbf{q}_1]$ and $a, b$ and $a$", []),
        (r"prose with \mathbf{q}_0 and \frac outside, and \$5", []),
    ],
)  # fmt: skip
def test_relations_of_a_text(text: str, expected: list[str]) -> None:
    assert [shown(item) for item in items(text)] == expected


def test_headings_in_markdown_and_numbered() -> None:
    text = (
        "# Title #\n\n## Stretch\n\nprose\n\n2 Bending\n\n2.1 Forces\n\n3. Shear\n\n4 apples are not a heading\n\n#no\n"
    )
    found = [(item.level, item.title) for item in items(text) if isinstance(item, Heading)]
    assert found == [(1, "Title"), (2, "Stretch"), (2, "Bending"), (3, "Forces"), (2, "Shear")]


BAD_TEXTS = [
    ("x\n\n  $$a = b", "3:3", r"opened by \$\$ is never closed"),
    ("let $a = b\n\nhere", "1:5", "not closed in its paragraph"),
    ("let $a = b", "1:5", "not closed in its paragraph"),
    ("x\n$$a = b$$", "2:1", "no equation number"),
    ("$$a = b \\tag{}$$", "1:1", "no equation number"),
    ("$$a = {b$$", "1:7", "never closed"),
    ("$$$$", "1:1", "no equation number"),
    ("$$ \\quad (7)$$", "1:3", "empty formula"),
    ("a $ $", "1:4", "empty formula"),
    ("$$a = b \\quad (7)$$\n\n$$b = a \\quad (7)$$", "3:15", r"\(7\) is used twice, first in line 1"),
    ("$$a = b \\quad (7)$$\n\n$$b = a \\tag{7}$$", "3:9", r"\(7\) is used twice, first in line 1"),
    ("x\n\\begin{equation}\na = b\n\\end{equation}", "2:1", r"\\begin\{equation\} is not read here"),
    ("x\n \\begin{align*} a", "2:2", r"\\begin\{align\*\} is not read here"),
    ("\\[ a = b \\]", "1:1", r"\\\[ is not read here"),
    ("so \\(a = b\\)", "1:4", r"\\\( is not read here: write inline formulas"),
    ("so \\[a\\]", "1:4", r"\\\[ is not read here"),
    ("$$\\begin{aligned} a = b \\end{aligned} \\quad (7)$$", "1:3", r"unknown LaTeX command \\begin"),
    ("$$a = b \\\\ c = d \\quad (7)$$", "1:9", "unknown LaTeX command"),
    ("$$a &= b \\quad (7)$$", "1:5", "unexpected character '&'"),
    ("$$a = \\quad (7)$$", "1:6", "ends where something must follow"),
    ("$$a = = b \\quad (7)$$", "1:7", "unexpected '='"),
    ("$$a \\neq b \\quad (7)$$", "1:5", r"unknown LaTeX command \\neq"),
    ("x\n\n$$a =\n  b + \\foo \\quad (7)$$", "4:7", r"unknown LaTeX command \\foo"),
    ("$$F_{u_0}, F_{u_1} = 0 \\quad (7)$$", "1:3", "states nothing"),
    ("$$F_{u_0} \\quad (7)$$", "1:3", "states nothing"),
    ("see $[a, b$", "1:11", "ends where something must follow"),
]


@pytest.mark.parametrize(("text", "place", "words"), BAD_TEXTS)
def test_text_is_refused_at(text: str, place: str, words: str) -> None:
    with pytest.raises(InputError, match=rf"^d\.md:{place}.*{words}") as error:
        items(text)
    assert "\n" not in str(error.value)


def test_a_display_never_closed_does_not_hide_the_next_one() -> None:
    with pytest.raises(InputError, match=r"^d\.md:1:1: "):
        items("$$a = b \\quad (1)\n\nmore\n\n$$c = d \\quad (2)$$\n")


# -- files ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("data", "place", "words"),
    [
        (b"ab\ncd\0e", "2:3", "zero byte"),
        (b"ab\r\ncd\0e", "2:3", "zero byte"),
        (b"ab\n\xffc", "2:1", "byte 0xff is not UTF-8"),
        ("é\né".encode() + b"\xe9", "2:2", "byte 0xe9 is not UTF-8"),
        (b"ab\rcd\xff", "2:3", "byte 0xff is not UTF-8"),
        (b"\xef\xbb\xbfab\n\xffc", "2:1", "byte 0xff is not UTF-8"),
        (b"\xef\xbb\xbf\xff", "1:1", "byte 0xff is not UTF-8"),
        ("a = b".encode("utf-16"), "1:1", "byte 0xff is not UTF-8"),
        (b"", "1:1", "empty"),
        (b" \r\n\t\n", "1:1", "empty"),
        (b"\xef\xbb\xbf\n", "1:1", "empty"),
    ],
)
def test_file_is_refused(tmp_path: Path, data: bytes, place: str, words: str) -> None:
    path = tmp_path / "d.md"
    path.write_bytes(data)
    with pytest.raises(InputError, match=rf"^{re.escape(str(path))}:{place}: .*{words}"):
        load(path)


@pytest.mark.parametrize(
    ("name", "words"), [("none.md", "no such file"), ("", "is a directory"), ("x" * 300, "too long")]
)
def test_what_is_no_file_is_refused(tmp_path: Path, name: str, words: str) -> None:
    with pytest.raises(InputError, match=rf":1:1: cannot read the document: .*{words}"):
        load(tmp_path / name)


@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_line_endings_and_byte_order_mark_leave_places_alone(tmp_path: Path, mark: str, ending: str) -> None:
    path = tmp_path / "d.md"
    text = "# Té\n\n$$a = b \\quad (1)$$\n\n  $$c =\n d + \\foo \\quad (2)$$\n"
    path.write_bytes((mark + text.replace("\n", ending)).encode())
    source = load(path)
    assert source.text == text
    found = read(source)
    assert next(found) == Heading(1, "Té", 0)
    relation = next(found)
    assert isinstance(relation, Relation) and source.place(relation.offset) == (3, 1)
    with pytest.raises(InputError, match=r":6:6: unknown LaTeX command \\foo"):
        next(found)


def test_the_printed_zero_and_one_are_numbers() -> None:
    assert read_formula("1") == ONE and read_formula("0") == number(0)


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        (r"\sin 2\theta", r"\sin(2 \theta)"),
        (r"\cos^2 3 \phi \mathbf{P}_1", r"\cos^2(3 \phi) \mathbf{P}_1"),
        (r"\mathbf{d}^T_2 \mathbf{d}_1", r"\mathbf{d}_2^T \mathbf{d}_1"),
        (r"\mathbf{d}^{\top}_{2} \mathbf{d}_1", r"\mathbf{d}_2^T \mathbf{d}_1"),
        (r"l^2_1", r"l_1^2"),
        (r"\mathbf{d}_2^{\mathrm{T}}", r"\mathbf{d}_2^T"),
        (r"\mathbf{d}_2^{\mathsf{T}}", r"\mathbf{d}_2^T"),
        (r"\mathbf{d}_2^\mathsf{T}", r"\mathbf{d}_2^T"),
        (r"\mathbf{d}_2^\intercal", r"\mathbf{d}_2^T"),
        (r"\big(u_1 - u_2\big)^3", r"(u_1 - u_2)^3"),
        (r"\Bigl[u_1 - u_2\Bigr]^3", r"(u_1 - u_2)^3"),
        (r"\bigl\| \mathbf{x}_1 \bigr\|", r"\|\mathbf{x}_1\|"),
        (r"\biggl| u_1 \biggr|", r"|u_1|"),
        (r"1/2 k u_1^2", r"\frac{1}{2} k u_1^2"),
        (
            r"k (\phi - \pi/2) / (l_1 \sin \phi) \mathbf{d}_1",
            r"\frac{k (\phi - \frac{\pi}{2})}{l_1 \sin \phi} \mathbf{d}_1",
        ),
        (r"a / b / c", r"\frac{\frac{a}{b}}{c}"),
        (r"\sin(\theta) / 2", r"\frac{\sin(\theta)}{2}"),
    ],
)
def test_other_ways_of_writing_the_same(written: str, meant: str) -> None:
    assert read_formula(written) == read_formula(meant)


def test_a_symbol_between_escaped_parentheses_is_prose() -> None:
    text = "Where \\(y\\) is not used.\n\n$$a = b \\quad (1)$$"
    (relation,) = read(Source("f", text))
    assert isinstance(relation, Relation) and relation.equation == "1"
