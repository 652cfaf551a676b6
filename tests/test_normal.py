"""The first reading: laws of its quotients, roots, absolute values and angles, and its derivatives."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from yarnverify.source import Source
from yarnverify.symbolic.court import Court, Verdict
from yarnverify.symbolic.declare import assumptions
from yarnverify.symbolic.document import Section
from yarnverify.symbolic.normal import Field, Quotient
from yarnverify.symbolic.reader import parse, read_formula
from yarnverify.symbolic.reading import UnsupportedError
from yarnverify.symbolic.tree import ONE, ZERO, Expr, Name, number, symbol

POINTS = tuple(Name("x", i, bold=True) for i in "012")
U = tuple(Name("u", i) for i in "12")
PARAMETERS = (Name("a"), Name("b"), Name("c"))


def section(domain: str = "") -> Section:
    made = Section("made", 0, parameters=PARAMETERS, unknowns=(*POINTS, *U))
    for members, operators in parse(Source("domain", domain), 0, len(domain)) if domain else ():
        made.assumptions += assumptions(members, operators)
    return made


def field(domain: str = "", positive: tuple[Name, ...] = ()) -> Field:
    return Field(section(domain), (*POINTS, *U, *PARAMETERS), positive)


def same(left: str, right: str, domain: str = "", positive: tuple[Name, ...] = ()) -> bool:
    reading = field(domain, positive)
    with reading.claim():
        a, b = (reading.value(read_formula(side)) for side in (left, right))
    return bool((a - b).is_zero)


# -- quotients --------------------------------------------------------------------------------------------------------

FIELD = field()
GENERATORS = [
    FIELD.value(read_formula(text)) for text in ("a", "b", "u_1", r"\|\mathbf{x}_1 - \mathbf{x}_0\|", r"\cos a")
]
leaves = st.sampled_from(GENERATORS) | st.integers(-3, 3).map(FIELD.constant)
quotients = st.recursive(
    leaves, lambda inner: st.tuples(st.sampled_from("+-*"), inner, inner).map(lambda t: combine(*t)), max_leaves=5
)
nonzero = quotients.filter(lambda q: not q.is_zero)


def combine(operation: str, p: Quotient, q: Quotient) -> Quotient:
    return p + q if operation == "+" else p - q if operation == "-" else p * q


@settings(max_examples=60)
@given(quotients, quotients, quotients, nonzero)
def test_quotients_are_a_field(p: Quotient, q: Quotient, r: Quotient, d: Quotient) -> None:
    for left, right in [
        (p + q, q + p),
        (p * q, q * p),
        (p + (q + r), (p + q) + r),
        (p * (q * r), (p * q) * r),
        (p * (q + r), p * q + p * r),
        (p - q, -(q - p)),
        (p / d * d, p),
        (1 / d, d**-1),
        (p / d + q / d, (p + q) / d),
        (p / d + q, (p + q * d) / d),
        ((p / d) ** 2, p**2 / d**2),
        (2 - p, -(p - 2)),
        (p + 0, p),
        (p * 0, FIELD.constant(0)),
    ]:
        assert (left - right).is_zero


@settings(max_examples=40)
@given(quotients, nonzero, st.sampled_from([*POINTS[:2], U[0]]))
def test_derivatives_are_linear_and_obey_the_product_rule(p: Quotient, q: Quotient, unknown: Name) -> None:
    d = {v: FIELD.derivative(v, unknown) for v in (p, q)}
    assert (FIELD.derivative(p + q * 3, unknown) - d[p] - d[q] * 3).is_zero
    assert (FIELD.derivative(p * q, unknown) - d[p] * q - p * d[q]).is_zero
    assert (FIELD.derivative(p / q, unknown) - (d[p] * q - p * d[q]) / q**2).is_zero


@pytest.mark.parametrize(
    "formula", [r"\frac{1}{a - a}", r"\frac{1}{\sin^2 b + \cos^2 b - 1}", r"(u_1 - u_1)^{-1}", r"\frac{a}{0}"]
)
def test_a_denominator_that_is_zero_everywhere_is_seen(formula: str) -> None:
    with pytest.raises(ZeroDivisionError):
        field().value(read_formula(formula))


# -- roots, absolute values, angles -----------------------------------------------------------------------------------

C = "b"
T = rf"\arccos({C})"
D1, D2 = (rf"\frac{{\mathbf{{x}}_{i} - \mathbf{{x}}_0}}{{\|\mathbf{{x}}_{i} - \mathbf{{x}}_0\|}}" for i in "12")
TURN = rf"\arccos(-({D1})^T {D2})"


@pytest.mark.parametrize(
    ("left", "right"),
    [
        (r"\|\mathbf{x}_1 - \mathbf{x}_0\|^2", r"(\mathbf{x}_1 - \mathbf{x}_0)^T (\mathbf{x}_1 - \mathbf{x}_0)"),
        (r"\|\mathbf{x}_1 - \mathbf{x}_2\|", r"\|\mathbf{x}_2 - \mathbf{x}_1\|"),
        (r"\|2 a (\mathbf{x}_1 - \mathbf{x}_0)\|", r"2 |a| \|\mathbf{x}_1 - \mathbf{x}_0\|"),
        (r"\|\mathbf{x}_1 - \mathbf{x}_1\|", "0"),
        (r"\sqrt{a^2}", "|a|"),
        (r"\sqrt{a^4 b^2}", "a^2 |b|"),
        (r"\sqrt{12 a}", r"2 \sqrt{3 a}"),
        (r"\sqrt{\frac{a}{b}}", r"\frac{\sqrt{a b}}{|b|}"),
        (r"\sqrt{\frac{1}{b^3}}", r"\frac{\sqrt{b}}{b^2}"),
        (r"\sqrt{a} \sqrt{b}", r"\sqrt{a b}"),
        (r"\sqrt{2} \sqrt{3}", r"\sqrt{6}"),
        (r"\sqrt{(a + b)^2 + 1}^2", "(a + b)^2 + 1"),
        (r"|a|^2", "a^2"),
        (r"|-a b|", "|a| |b|"),
        (r"|a^2 + 2 a b + b^2|", "(a + b)^2"),
        (r"\frac{1}{|a|}", r"\frac{|a|}{a^2}"),
        (rf"\arccos(-{C})", rf"\pi - {T}"),
        (rf"\cos({T})", C),
        (rf"\sin({T})", rf"\sqrt{{1 - ({C})^2}}"),
        (rf"\sin({T} - \frac{{\pi}}{{2}})", rf"-{C}"),
        (rf"\cos(\frac{{\pi}}{{2}} - {T})", rf"\sin({T})"),
        (rf"\cos({T} + \pi)", rf"-{C}"),
        (rf"\sin(-{T})", rf"-\sin({T})"),
        (rf"\sin({T} + \frac{{3 \pi}}{{2}})", rf"-{C}"),
        (rf"\cos(2 {T})", rf"2 ({C})^2 - 1"),
        (rf"\sin(3 {T})", rf"3 \sin({T}) - 4 \sin({T})^3"),
        (rf"\tan({T}) {C}", rf"\sin({T})"),
        (rf"\cos^2(\frac{{1}}{{2}} {T})", rf"\frac{{1 + {C}}}{{2}}"),
        (rf"2 \sin(\frac{{1}}{{2}} {T}) \cos(\frac{{1}}{{2}} {T})", rf"\sin({T})"),
        (rf"\tan(\frac{{1}}{{2}} {T})", rf"\frac{{\sin({T})}}{{1 + {C}}}"),
        (rf"2 \sin(\frac{{1}}{{2}} {TURN}) \cos(\frac{{1}}{{2}} {TURN})", rf"\sin({TURN})"),
        (rf"\sin({TURN})", rf"2 \sin(\frac{{1}}{{2}} {TURN}) \cos(\frac{{1}}{{2}} {TURN})"),
        (rf"\sin({TURN})", rf"\|({D1}) \times ({D2})\|"),
        (rf"\sin(\frac{{1}}{{2}} {TURN})", rf"\sqrt{{\frac{{1 - \cos({TURN})}}{{2}}}}"),
        (rf"\sin(\frac{{3}}{{2}} {T})", rf"\sin(\frac{{1}}{{2}} {T}) (2 {C} + 1)"),
        (r"\arccos(0)", r"\frac{\pi}{2}"),
        (r"\arccos(1) + \arccos(-1)", r"\pi"),
        (r"\sin(\pi) + \cos(2 \pi)", "1"),
        (r"\cos^2(a) + \sin^2(a)", "1"),
        (r"\sin^2(\frac{a}{3}) - 1", r"-\cos^2(\frac{a}{3})"),
        (r"\tan(a b) \cos(b a)", r"\sin(a b)"),
    ],
)
def test_an_identity_is_seen(left: str, right: str) -> None:
    assert same(left, right)


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("|a|", "a"),
        (r"\sqrt{a^2}", "-a"),
        (r"|u_1 - u_2|", "u_1 - u_2"),
        (r"\sqrt{a + b}", r"\sqrt{a} + \sqrt{b}"),
        (r"\|\mathbf{x}_1 - \mathbf{x}_2\|", r"\|\mathbf{x}_1 - \mathbf{x}_0\|"),
        (rf"\sin({T})", rf"\cos({T})"),
        (r"\cos(\frac{\pi}{3})", r"\frac{1}{3}"),
        (r"\cos(a)", r"\cos(b)"),
    ],
)
def test_what_is_not_an_identity_is_not_seen(left: str, right: str) -> None:
    assert not same(left, right)


@pytest.mark.parametrize(
    ("left", "right", "domain", "positive"),
    [
        ("|u_1 - u_2|", "u_1 - u_2", "u_1 > u_2", ()),
        ("|u_1 - u_2|", "u_2 - u_1", "u_1 < u_2", ()),
        (r"\sqrt{(u_1 - u_2)^2}", "u_1 - u_2", "u_1 - u_2 > 0", ()),
        (r"|3 u_2 - 3 u_1|", "3 (u_1 - u_2)", "u_1 > u_2", ()),
        (r"\frac{1}{|u_1 - u_2|^3}", "(u_1 - u_2)^{-3}", "u_1 > u_2", ()),
        (r"|a|", "a", "", (Name("a"),)),
        (r"|-2 a b^2|", "2 a b^2", "", (Name("a"),)),
        (r"\sqrt{a^2 b^2}", "a |b|", "", (Name("a"),)),
        (r"|a (u_2 - u_1)|", "a (u_1 - u_2)", r"u_1 > u_2, \frac{1}{b} > 0", (Name("a"),)),
    ],
)
def test_an_assumption_settles_a_sign(left: str, right: str, domain: str, positive: tuple[Name, ...]) -> None:
    assert same(left, right, domain, positive)
    assert not same(left, right)


def test_more_atoms_than_there_is_room_for_are_undecided() -> None:
    many = " + ".join(rf"\sqrt{{a + {i}}} \cos({i} a + b)" for i in range(1, 9))
    with pytest.raises(UnsupportedError, match="more square roots"):
        field().value(read_formula(many))
    court = Court(section(), read_formula("a b u_1"))
    assert court.judge(read_formula(many), read_formula("a")).verdict is Verdict.REFUTED  # for that, values are enough
    finding = court.judge(read_formula(many), read_formula(f"0 + {many}"))
    assert finding.verdict is Verdict.UNDECIDED
    assert "more square roots" in finding.reason


@pytest.mark.parametrize("formula", [r"\mathbf{F}_{\mathbf{x}_1}", r"\frac{\partial u_1}{\partial u_2}", "V"])
def test_mechanics_inside_a_definition_is_unsupported(formula: str) -> None:
    with pytest.raises(UnsupportedError):
        field().value(read_formula(formula))


# -- derivatives against rules of our own, in both readings ----------------------------------------------------------

u, x0, x1, x2 = (Expr("symbol", value=name) for name in (U[0], *POINTS))
EDGES = [(x1 - x0), (x2 - x0), (x2 - x1)]


def _norm(a: Expr) -> Expr:
    return Expr("norm", (a,))


def _inner(op: str, children: Any) -> Any:
    return {
        "add": st.tuples(children, children).map(lambda p: p[0] + p[1]),
        "neg": children.map(lambda p: -p),
        "mul": st.tuples(children, children).map(lambda p: p[0] * p[1]),
        "frac": st.tuples(children, children).map(lambda p: p[0] / (1 + p[1] ** 2)),
        "pow": children.map(lambda p: p**2),
        "sqrt": children.map(lambda p: Expr("sqrt", (1 + p**2,))),
        "sin": children.map(lambda p: Expr("call", (p,), "sin")),
        "cos": children.map(lambda p: Expr("call", (p,), "cos")),
        "arccos": children.map(lambda p: Expr("call", (p / (1 + p**2),), "arccos")),
    }[op]


def trees(depth: int, operations: tuple[str, ...]) -> Any:
    children = st.sampled_from(
        [u, u, symbol("a"), symbol("u", "2"), _norm(EDGES[0]), EDGES[0].T * EDGES[1]]
    ) | st.integers(0, 3).map(number)
    for _ in range(depth):
        children = st.sampled_from(operations).flatmap(lambda op, inner=children: _inner(op, inner))  # type: ignore[misc]
    return children


def slope(tree: Expr) -> Expr:
    """Derivative by u_1, by the rules of school."""
    args, d = tree.args, [slope(arg) for arg in tree.args]
    match tree.op:
        case "symbol":
            return ONE if tree == u else ZERO
        case "add":
            return d[0] + d[1]
        case "neg":
            return -d[0]
        case "mul" if tree.args[0].op != "transpose":
            return d[0] * args[1] + args[0] * d[1]
        case "frac":
            return (d[0] * args[1] - args[0] * d[1]) / args[1] ** 2
        case "pow":
            return 2 * args[0] * d[0]
        case "sqrt":
            return d[0] / (2 * tree)
        case "call":
            sine, cosine = Expr("call", args, "sin"), Expr("call", args, "cos")
            outer = {"sin": cosine, "cos": -sine, "arccos": -1 / Expr("sqrt", (1 - args[0] ** 2,))}[str(tree.value)]
            return outer * d[0]
    return ZERO


def force(name: Name) -> Expr:
    return Expr("force", value=name)


@settings(max_examples=40)
@given(trees(1, ("add", "neg", "mul", "frac", "pow", "sin", "cos")))
def test_first_derivatives_follow_the_rules(tree: Expr) -> None:
    assert Court(section(), tree).judge(force(U[0]), -slope(tree)).verdict is Verdict.PROVED


@settings(max_examples=20)
@given(trees(1, ("add", "mul", "pow", "sin")))
def test_second_derivatives_follow_the_rules(tree: Expr) -> None:
    court = Court(section(), tree)
    assert court.judge(Expr("derivative", (force(U[0]),), U[0]), -slope(slope(tree))).verdict is Verdict.PROVED
    mixed = [Expr("derivative", (force(r),), c) for r, c in ((U[0], POINTS[1]), (POINTS[1], U[0]))]
    assert court.judge(mixed[0], mixed[1].T).verdict is Verdict.PROVED


@pytest.mark.parametrize(
    "formula",
    [
        r"\sqrt{1 + \sin^2(u_1)}",
        r"\cos(\sqrt{1 + u_1^2})",
        r"\sin(\cos(u_1) + a) u_1",
        r"\arccos(\frac{u_1}{1 + u_1^2})^2",
        r"\frac{\sin(u_1)}{1 + \cos(u_1)^2}",
        r"\sqrt{1 + \sqrt{1 + u_1^2}}",
        r"\frac{\sqrt{1 + u_1^2}}{\sqrt{1 + u_2^2}}",
        r"(u_1 - \|\mathbf{x}_1 - \mathbf{x}_0\|)^2 \sin(a u_1)",
    ],
)
def test_nested_functions_follow_the_rules(formula: str) -> None:
    tree = read_formula(formula)
    assert Court(section(), tree).judge(force(U[0]), -slope(tree)).verdict is Verdict.PROVED


@settings(max_examples=12)
@given(trees(1, ("add", "mul", "pow", "sin")), st.sampled_from(EDGES))
def test_translation_leaves_an_energy_of_differences(tree: Expr, edge: Expr) -> None:
    court = Court(section(), tree * _norm(edge))
    total = force(POINTS[0]) + force(POINTS[1]) + force(POINTS[2])
    assert court.judge(total, ZERO).verdict is Verdict.PROVED


def test_a_definition_is_differentiated_through() -> None:
    court = Court(section(), symbol("a") * _norm(EDGES[2]) ** 2 / 2)
    right = read_formula(r"-a (\mathbf{x}_2 - \mathbf{x}_1)")
    assert court.judge(force(POINTS[2]), right).verdict is Verdict.PROVED
    jacobian = Expr("derivative", (force(POINTS[2]),), POINTS[1])
    assert court.judge(jacobian, read_formula(r"a \mathbf{I}")).verdict is Verdict.PROVED


def test_a_printed_root_settles_signs_in_its_own_claim_alone() -> None:
    reading = field()

    def absolute_of_a() -> bool:
        return bool((reading.value(read_formula("|a|")) - reading.value(read_formula("a"))).is_zero)

    with reading.claim():
        reading.value(read_formula(r"\sqrt{-b}"))
        assert not (reading.value(read_formula("|b|")) - reading.value(read_formula("b"))).is_zero
        reading.value(read_formula(r"\sqrt{a}"))
        assert absolute_of_a()
        with reading.claim(printed=False):
            assert not absolute_of_a()
        assert absolute_of_a()
    assert not absolute_of_a()
    with reading.claim():
        assert not absolute_of_a()
