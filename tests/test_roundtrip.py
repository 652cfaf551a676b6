"""Tree -> LaTeX -> tree, on trees and documents that nobody wrote."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from yarnverify.source import Source
from yarnverify.symbolic.functions import FUNCTIONS
from yarnverify.symbolic.latex import ACCENTS, GREEK, latex, name_latex
from yarnverify.symbolic.reader import Heading, read, read_formula
from yarnverify.symbolic.tree import IDENTITY, PI, Expr, Name, number, symbol

# F, V and bold I are read as forces, energies and the identity
letters = st.sampled_from([*"abcdhklmnpqrstuvwxyzABCDEGHKLMNPQRSTUWXYZ", *GREEK])
index = st.one_of(
    st.integers(0, 99).map(str), st.sampled_from("ijsbx"), st.sampled_from(["i+1", "j-2"]), st.sampled_from(GREEK)
)
subscripts = st.one_of(st.just(""), index, st.lists(index, min_size=2, max_size=3).map(",".join))
prefixes = st.lists(st.sampled_from(["Delta", *ACCENTS]), max_size=2)


def named(
    bases: st.SearchStrategy[str], subs: st.SearchStrategy[str], bold: st.SearchStrategy[bool]
) -> st.SearchStrategy[Name]:
    return st.builds(lambda p, b, s, f: Name(" ".join([*p, b]), s, f), prefixes, bases, subs, bold)


names = named(letters, subscripts, st.booleans())
unknowns = st.builds(Name, st.sampled_from(["x", "u", "theta", "Delta u"]), st.integers(0, 12).map(str), st.booleans())
energies = st.builds(Name, st.just("V"), subscripts)

leaves = st.one_of(
    st.integers(0, 10**12).map(number),
    names.map(lambda n: Expr("symbol", value=n)),
    unknowns.map(lambda n: Expr("force", value=n)),
    energies.map(lambda n: Expr("energy", value=n)),
    st.sampled_from([PI, IDENTITY]),
)
derivatives = st.builds(
    lambda of, by: Expr("derivative", (of,), by),
    leaves.filter(lambda e: e.op in {"symbol", "force", "energy"}),
    st.one_of(unknowns, names),
)


def grow(inner: st.SearchStrategy[Expr]) -> st.SearchStrategy[Expr]:
    several = st.lists(inner, min_size=2, max_size=4).map(tuple)
    one = inner.map(lambda e: (e,))
    two = st.tuples(inner, inner)
    return st.one_of(
        st.builds(Expr, st.sampled_from(["add", "mul"]), several),
        st.builds(Expr, st.sampled_from(["frac", "cross", "dot"]), two),
        st.builds(Expr, st.sampled_from(["neg", "transpose", "norm", "abs", "sqrt"]), one),
        st.builds(lambda a, n: Expr("pow", a, n), one, st.integers(-20, 20)),
        st.builds(lambda a, f: Expr("call", a, f), one, st.sampled_from(FUNCTIONS)),
    )


trees = st.recursive(st.one_of(leaves, derivatives), grow, max_leaves=12)


@settings(max_examples=300)
@given(trees)
def test_a_tree_is_read_back_from_its_latex(tree: Expr) -> None:
    assert read_formula(latex(tree)) == tree


@given(names)
def test_a_name_is_read_back_from_its_latex(name: Name) -> None:
    assert read_formula(name_latex(name)) == Expr("symbol", value=name)


A, B = symbol("a"), symbol("b", "1")


@pytest.mark.parametrize(
    "outer", ["neg", "transpose", "norm", "abs", "sqrt", "pow", "call", "add", "mul", "frac", "cross", "dot"]
)
@pytest.mark.parametrize(
    "inner", ["neg", "transpose", "norm", "abs", "sqrt", "pow", "call", "add", "mul", "frac", "cross", "dot"]
)
def test_every_operation_in_every_place_of_every_other(outer: str, inner: str) -> None:
    def made(op: str, first: Expr, last: Expr) -> Expr:
        value: Any = {"pow": -12, "call": "sin"}.get(op)
        return Expr(op, (first, last) if op in {"add", "mul", "frac", "cross", "dot"} else (first,), value)

    core = made(inner, A, B)
    for tree in (made(outer, core, A), made(outer, A, core), made(outer, core, core)):
        assert read_formula(latex(tree)) == tree


@pytest.mark.parametrize(
    "tree",
    [
        Expr("abs", (A * Expr("abs", (B,)),)),
        Expr("norm", (A * Expr("norm", (B,)),)),
        Expr("norm", (A + Expr("abs", (A * Expr("norm", (B,)),)),)),
        Expr("call", (A,), "sin") ** -1,
        Expr("call", (A,), "arccos") ** 12,
        (Expr("call", (A,), "sin") ** 2) ** 3,
        Expr("call", (A,), "sin") * number(2) * A,
        number(2) * number(3) ** 2,
        symbol("k", "theta"),
        Expr("neg", (-A,)) - (-B),
    ],
    ids=latex,
)
def test_a_tree_that_is_hard_to_print_is_read_back(tree: Expr) -> None:
    assert read_formula(latex(tree)) == tree


# -- documents --------------------------------------------------------------------------------------------------------

operators = st.sampled_from(["=", "<", ">", "<=", ">="])


@st.composite
def relations(draw: st.DrawFn) -> tuple[tuple[Expr, ...], tuple[str, ...]]:
    members = draw(st.lists(trees, min_size=2, max_size=3))
    return tuple(members), tuple(draw(operators) for _ in members[1:])


displays = st.lists(relations(), min_size=1, max_size=3)
words = st.text("abc \\_^{}<=\n", max_size=30).map(lambda t: "Prose " + t.replace("\n\n", "\n"))


def printed(display: list[tuple[tuple[Expr, ...], tuple[str, ...]]]) -> str:
    named = {"<=": r"\le", ">=": r"\geq"}
    chains = []
    for members, ops in display:
        text = latex(members[0])
        for op, member in zip(ops, members[1:], strict=True):
            text += f" {named.get(op, op)} {latex(member)}"
        chains.append(text)
    return ", ".join(chains)


@given(st.lists(st.tuples(words, st.booleans(), st.lists(displays, max_size=3)), min_size=1, max_size=3))
def test_a_document_is_read_back_from_its_text(sections: list[tuple[str, bool, list[Any]]]) -> None:
    parts: list[str] = []
    headings: list[str] = []
    expected: list[tuple[str, Any]] = []
    for count, (prose, markdown, contents) in enumerate(sections, 1):
        headings.append(f"Section {'ABC'[count - 1]}")
        parts += [f"## {headings[-1]}" if markdown else f"{count} {headings[-1]}", prose]
        for display in contents:
            equation = str(len(expected) + 1)
            parts.append(f"$${printed(display)}, \\quad ({equation})$$")
            expected += [(equation, relation) for relation in display]
    items = list(read(Source("d.md", "\n\n".join(parts) + "\n")))
    assert [item.title for item in items if isinstance(item, Heading)] == headings
    found = [(item.equation, (item.members, item.operators)) for item in items if not isinstance(item, Heading)]
    assert found == expected
