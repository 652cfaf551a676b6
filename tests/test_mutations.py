"""Breaks every printed equation on purpose: what becomes wrong is refuted, what is only written otherwise is proved.

Whether a mutant is wrong is decided here, in floats, with the corrected paper itself as the reference: nothing is
differentiated, and no reading of the package takes part.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from yarnverify.errors import InputError
from yarnverify.library import shelf_for
from yarnverify.source import Source
from yarnverify.symbolic.court import Court, Verdict
from yarnverify.symbolic.declare import Declarations
from yarnverify.symbolic.document import Document, Section
from yarnverify.symbolic.latex import latex
from yarnverify.symbolic.prove import declared_meaning, definition_claim, read_with
from yarnverify.symbolic.reader import read_formula
from yarnverify.symbolic.record import prove_source
from yarnverify.symbolic.tree import Expr, Name, ShapeError, Type, is_zero, number

EQUATIONS = [str(i) for i in range(1, 45)]
CORRECTIONS = {  # as derivations/errata.toml has them, written out by hand
    r"\frac{k}{l_1} \mathbf{P}_1 - \frac{k}{\Delta u}": r"\frac{k_s}{l_1} \mathbf{P}_1 - \frac{k_s}{\Delta u}",
    r"+ \cos \theta \mathbf{P}_1 +": r"- \cos \theta \mathbf{P}_1 +",
    r"+ \cos \theta \mathbf{P}_2 +": r"- \cos \theta \mathbf{P}_2 +",
}
PER_KIND = 3  # mutants of one kind drawn from one equation


# -- the reference ----------------------------------------------------------------------------------------------------


@dataclass
class Plain:
    """Value of a tree in floats, with the paper's symbols written by hand; forces are looked up in the corrected paper."""

    truths: dict[Expr, Expr]
    seed: int
    known: dict[Expr, Any] = field(default_factory=dict)

    def point(self, sub: str) -> Any:
        draw = random.Random(f"x{sub} {self.seed}")
        return np.array([[draw.uniform(-2, 2)] for _ in range(3)])

    def scalar(self, name: Name) -> float:
        ordered = {"u0": 0.3, "u1": 1.4, "u2": -0.9, "v0": 0.2, "v3": 0.7, "d": 3.1}  # meets all assumptions
        draw = random.Random(f"{name} {self.seed}").uniform(0.5, 2.0)
        return ordered.get(name.label, draw) * (1 + 0.1 * self.seed)

    def symbol(self, name: Name) -> Any:
        edge = self.point(name.sub) - self.point("0")
        length = np.linalg.norm(edge)
        match name.base:
            case "x":
                return self.point(name.sub)
            case "l":
                return length
            case "d" if name.bold:
                return edge / length
            case "w":
                return edge / abs(self.scalar(Name("u", name.sub)) - self.scalar(Name("u", "0")))
            case "P":
                return np.eye(3) - edge @ edge.T / length**2
            case "theta" | "phi":
                other, sign = ("2", -1) if name.base == "theta" else ("3", 1)
                a, b = (self.symbol(Name("d", sub, bold=True)) for sub in ("1", other))
                return np.arccos(sign * (a.T @ b).item())
            case "Delta u":
                return self.scalar(Name("u", "1")) - self.scalar(Name("u", "0"))
        return self.scalar(name)

    def block(self, expr: Expr) -> Any:
        if expr in self.truths:
            return self(self.truths[expr])
        row, column = (expr.args[0].name, expr.name) if expr.op == "derivative" else (expr.name, Name("u"))
        shape = (3 if row.bold else 1, 3 if column.bold else 1)
        return 0.0 if shape == (1, 1) else np.zeros(shape)  # the list of the paper is complete

    def __call__(self, expr: Expr) -> Any:
        if expr not in self.known:
            self.known[expr] = self.value(expr)
        return self.known[expr]

    def value(self, expr: Expr) -> Any:
        match expr.op:
            case "number":
                return float(str(expr.value))
            case "pi":
                return np.pi
            case "identity":
                return np.eye(3)
            case "symbol":
                return self.symbol(expr.name)
            case "force" | "derivative" | "energy":
                return self.block(expr)
        args = [self(arg) for arg in expr.args]
        match expr.op:
            case "add":
                return sum(args[1:], args[0])
            case "neg":
                return -args[0]
            case "mul":
                total = args[0]
                for arg in args[1:]:
                    total = total @ arg if np.ndim(total) and np.ndim(arg) else total * arg
                    total = total.item() if np.shape(total) == (1, 1) else total
                return total
            case "cross":
                return np.cross(args[0], args[1], axis=0)
            case "frac":
                return args[0] / np.float64(args[1])
            case "pow":
                return np.float64(args[0]) ** expr.value
            case "transpose":
                return np.transpose(args[0])
            case "norm" | "abs":
                return np.linalg.norm(args[0])
            case "sqrt":
                return np.sqrt(args[0])
            case "call":
                return getattr(np, str(expr.value))(args[0])
        raise AssertionError(expr.op)


def equal(left: Expr, right: Expr, truths: dict[Expr, Expr]) -> bool:
    """Whether two trees agree at three states; a side without a value agrees with nothing."""
    for seed in range(3):
        plain = Plain(truths, seed)
        with np.errstate(all="ignore"):
            a, b = np.asarray(plain(left)), np.asarray(plain(right))
        if a.shape != b.shape and not (is_zero(left) or is_zero(right)):
            return False
        size = np.maximum(np.max(np.abs(a)), np.max(np.abs(b)))
        if not np.isfinite(size) or np.max(np.abs(a - b)) > 1e-9 * size:
            return False
    return True


# -- the corrected paper ----------------------------------------------------------------------------------------------


@dataclass
class Paper:
    document: Document
    declarations: Declarations
    courts: dict[str, Court]

    def section(self, equation: str) -> Section:
        for part in (self.document.shared, *self.document.sections):
            own = [d.relation for d in part.definitions.values()] + [c.relation for c in part.claims]
            if equation in {r.equation for r in own} | ({part.energy.relation.equation} if part.energy else set()):
                return part
        raise AssertionError(equation)

    def chains(self, equation: str) -> list[tuple[Expr, ...]]:
        return [r.members for r in self.document.relations if r.equation == equation]

    def truths(self, section: Section) -> dict[Expr, Expr]:
        found = {}
        for claim in section.claims:
            left, right = claim.left, claim.right
            found[left.args[0] if left.op == "neg" else left] = -right if left.op == "neg" else right
        if section.energy is not None:
            found[Expr("energy", value=section.energy.symbol)] = section.energy.expression
        return found

    def trials(self, equation: str, members: tuple[Expr, ...]) -> list[tuple[Court, Expr, Expr]]:
        """Where and between which trees the claims of a changed chain are judged."""
        section = self.section(equation)
        for definition in section.definitions.values():
            if definition.relation.equation == equation:
                quantity = declared_meaning(section, definition.symbol, self.declarations)
                assert quantity is not None
                claim, court, _ = definition_claim(section, replace(definition, expression=members[1]), quantity)
                return [(court, claim.left, claim.right)]
        assert section.energy is not None and section.declared is not None
        if section.energy.relation.equation == equation:
            court = Court(section, section.declared.expression, [members[1]])
            return [(court, members[0], members[1])]
        court = self.courts.setdefault(section.title, Court(section, section.energy.expression))
        return [(court.reaching([left, members[-1]]), left, members[-1]) for left in members[:-1]]

    def true(self, equation: str, members: tuple[Expr, ...]) -> bool:
        """The reference's opinion on a changed chain."""
        section = self.section(equation)
        if not any(claim.relation.equation == equation for claim in section.claims):
            return equal(self.chains(equation)[0][1], members[1], {})
        return all(equal(left, members[-1], self.truths(section)) for left in members[:-1])


@pytest.fixture(scope="module")
def paper(source: Source, declarations: Declarations) -> Paper:
    text = source.text
    for printed, meant in CORRECTIONS.items():
        assert text.count(printed) == 1
        text = text.replace(printed, meant)
    return Paper(read_with(Source("corrected.md", text), declarations), declarations, {})


# -- mutants ----------------------------------------------------------------------------------------------------------


def mutations(node: Expr, section: Section) -> Iterator[tuple[str, Expr]]:
    """Each (kind, changed node) of one node."""
    try:
        shape = section.type_of(node)
    except ShapeError:
        shape = Type.UNKNOWN
    yield "sign", node.args[0] if node.op == "neg" else -node
    yield "factor", 2 * node
    yield "factor", node / 3
    if node.op == "mul":
        for i in range(len(node.args)):
            yield "factor", replace(node, args=node.args[:i] + node.args[i + 1 :])
        for i in range(len(node.args) - 1):
            yield "transpose", replace(node, args=(*node.args[:i], node.args[i + 1], node.args[i], *node.args[i + 2 :]))
    if node.op == "pow":
        assert isinstance(node.value, int)
        yield "power", replace(node, value=node.value + 1)
        yield "power", node.args[0]
        yield "power", replace(node, value=-node.value)
    elif shape is Type.SCALAR and node.op not in ("neg", "number", "force", "derivative", "energy"):
        yield "power", node**2
        yield "power", node**-1
    if node.op in ("symbol", "force", "derivative") and node.name.sub.isdigit():
        for sub in sorted({"0", "1", "2", "3"} - {node.name.sub}):
            yield "index", replace(node, value=node.name.with_sub(sub))
    if shape in (Type.VECTOR, Type.COVECTOR, Type.MATRIX):
        yield "transpose", node.args[0] if node.op == "transpose" else node.T


def mutants(members: tuple[Expr, ...], section: Section, first: int) -> Iterator[tuple[str, tuple[Expr, ...]]]:
    """Each (kind, changed chain) of a chain; every node is a candidate."""

    def inside(tree: Expr) -> Iterator[tuple[str, Expr]]:
        yield from mutations(tree, section)
        for i, arg in enumerate(tree.args):
            for kind, new in inside(arg):
                if tree.op == "derivative" and kind != "index":
                    continue  # the reference looks derivatives up, so it knows those of forces alone
                yield kind, replace(tree, args=(*tree.args[:i], new, *tree.args[i + 1 :]))

    for i in range(first, len(members)):
        for kind, new in inside(members[i]):
            yield kind, (*members[:i], new, *members[i + 1 :])


def drawn(paper: Paper, equation: str) -> list[tuple[str, tuple[Expr, ...]]]:
    """A fixed choice of mutants of an equation, several of every kind that it has."""
    section = paper.section(equation)
    stated = any(claim.relation.equation == equation for claim in section.claims)
    by_kind: dict[str, list[tuple[Expr, ...]]] = {}
    for members in paper.chains(equation):
        for kind, mutant in mutants(members, section, 0 if stated else 1):  # a name that is defined is not doubted
            by_kind.setdefault(kind, []).append(mutant)
    draw = random.Random(f"equation {equation}")
    return [(kind, m) for kind, found in by_kind.items() for m in draw.sample(found, min(PER_KIND, len(found)))]


def printed(members: tuple[Expr, ...]) -> str:
    return " = ".join(map(latex, members))


@pytest.mark.parametrize("equation", EQUATIONS)
def test_every_wrong_mutant_is_refuted_and_every_right_one_proved(paper: Paper, equation: str) -> None:
    found = drawn(paper, equation)
    assert {"sign", "factor"} <= {kind for kind, _ in found}
    failures, wrong = [], 0
    for kind, members in found:
        try:
            for member in members:
                paper.section(equation).type_of(member)
        except ShapeError:
            continue  # refused with exit status 2 when the document is read, see the next test
        right = paper.true(equation, members)
        wrong += not right
        trials = paper.trials(equation, members)
        findings = [court.judge(left, right) for court, left, right in trials]
        verdicts = {finding.verdict for finding in findings}
        if (
            verdicts != {Verdict.PROVED}
            if right
            else not {Verdict.REFUTED} <= verdicts <= {Verdict.REFUTED, Verdict.PROVED}
        ):
            failures.append(f"{kind}, {'right' if right else 'wrong'}: {printed(members)}: {[*map(str, findings)]}")
    assert wrong >= 4
    assert not failures, "\n".join(failures)


@pytest.mark.parametrize("equation", EQUATIONS)
def test_both_readings_agree_on_every_mutant(paper: Paper, equation: str) -> None:
    for kind, members in drawn(paper, equation):
        for court, left, right in paper.trials(equation, members):
            try:
                kinds = {court.section.type_of(left), court.section.type_of(right)}
            except ShapeError:
                continue
            if court.section.undefined(left) or court.section.undefined(right):
                continue
            if len(kinds) > 1 and not is_zero(right):
                continue
            compared = court.evidence.compare(left, right)
            try:
                same = court.forms.equal(left, right)
            except ZeroDivisionError:
                assert not compared.seen, (kind, printed(members))
                continue
            if compared.seen:
                assert same == (not compared.differs), (kind, printed(members))
            else:
                assert not same and compared.lacks_value, (kind, printed(members))


def rewritten(text: str, equation: str, change: str, by: str) -> str:
    """The document with one change in one display."""
    display = next(d for d in re.findall(r"\$\$.*?\$\$", text, re.DOTALL) if d.endswith(rf"\quad ({equation})$$"))
    assert display.count(change) >= 1, (equation, change)
    return text.replace(display, display.replace(change, by, 1))


@pytest.mark.parametrize(
    ("equation", "change", "by"),
    [
        ("2", r"\mathbf{x}_i - \mathbf{x}_0", r"\mathbf{x}_i^T - \mathbf{x}_0"),
        ("4", r"\mathbf{d}_i \mathbf{d}_i^T", r"\mathbf{d}_i^T \mathbf{d}_i"),
        ("12", r"\mathbf{d}_1^T \mathbf{d}_2", r"\mathbf{d}_1 \mathbf{d}_2"),
        ("18", r"\mathbf{d}_2 \mathbf{d}_1^T", r"\mathbf{d}_2^T \mathbf{d}_1"),
        ("28", r"\mathbf{d}_2^T \mathbf{P}_1", r"\mathbf{P}_1 \mathbf{d}_2^T"),
    ],
)
def test_an_ill_shaped_equation_is_bad_input_with_its_line(
    source: Source, declarations: Declarations, equation: str, change: str, by: str
) -> None:
    text = rewritten(source.text, equation, change, by)
    line = next(i for i, row in enumerate(text.split("\n"), 1) if row.endswith(rf"\quad ({equation})$$"))
    with pytest.raises(InputError, match=rf"mutant\.md:{line}:\d+: .*(multiply|add)"):
        read_with(Source("mutant.md", text), declarations)


# -- hand-written mutants ---------------------------------------------------------------------------------------------

CURVED = r"\left( \frac{2 k_b}{l_1^2 (u_1 - u_2) \sin \theta} \right)"
REWRITINGS = [  # (equation, right side); each is the printed one written otherwise
    ("1", r"\sqrt{(\mathbf{x}_i - \mathbf{x}_0)^T (\mathbf{x}_i - \mathbf{x}_0)}"),
    ("1", r"\|\mathbf{x}_0 - \mathbf{x}_i\|"),
    ("2", r"\frac{1}{l_i} \left( \mathbf{x}_i - \mathbf{x}_0 \right)"),
    ("2", r"-\frac{\mathbf{x}_0 - \mathbf{x}_i}{\|\mathbf{x}_i - \mathbf{x}_0\|}"),
    ("3", r"\frac{l_i}{|u_0 - u_i|} \mathbf{d}_i"),
    ("4", r"(\mathbf{I} - \mathbf{d}_i \mathbf{d}_i^T)^T (\mathbf{I} - \mathbf{d}_i \mathbf{d}_i^T)"),
    ("5", r"\frac{k_s}{2 \Delta u} (l_1 - \Delta u)^2"),
    ("5", r"\frac{1}{2} k_s \Delta u \left( 1 - \frac{l_1}{\Delta u} \right)^2"),
    ("6", r"k_s \left( 1 - \frac{l_1}{\Delta u} \right) \mathbf{d}_1"),
    ("7", r"\frac{1}{2} (\mathbf{w}_1^T \mathbf{w}_1 - 1) k_s"),
    ("7", r"\frac{1}{2} (\mathbf{w}_1 \cdot \mathbf{w}_1 - 1) k_s"),
    ("7", r"\frac{k_s}{2} (\|\mathbf{w}_1\| - 1) (\|\mathbf{w}_1\| + 1)"),
    (
        "8",
        r"-\frac{k_s}{l_1} \mathbf{d}_1 \mathbf{d}_1^T + k_s \left( \frac{1}{l_1} - \frac{1}{\Delta u} \right) \mathbf{I}",
    ),
    ("9", r"-\frac{k_s l_1^2}{(u_1 - u_0)^3}"),
    ("10", r"k_s (\Delta u)^{-1} \mathbf{w}_1"),
    ("11", r"\frac{k_s \|\mathbf{w}_1\|}{u_1 - u_0} \mathbf{d}_1^T"),
    ("12", r"\pi - \arccos(\mathbf{d}_2^T \mathbf{d}_1)"),
    (
        "12",
        r"\arccos \left( -\frac{(\mathbf{x}_1 - \mathbf{x}_0) \cdot (\mathbf{x}_2 - \mathbf{x}_0)}{l_1 l_2} \right)",
    ),
    ("13", r"\theta \frac{k_b}{u_1 - u_2} \theta"),
    (
        "14",
        r"-\frac{2 k_b \theta}{l_1 (u_1 - u_2) \sin \theta} (\mathbf{d}_2 - \mathbf{d}_1 \mathbf{d}_1^T \mathbf{d}_2)",
    ),
    ("14", r"-\frac{2 k_b \theta}{l_1 (u_1 - u_2) \sin \theta} (\mathbf{d}_2 + \cos \theta \mathbf{d}_1)"),
    ("14", r"\frac{2 k_b \theta}{(u_2 - u_1) \sin \theta} \frac{1}{l_1} \mathbf{P}_1 \mathbf{P}_1 \mathbf{d}_2"),
    (
        "14",
        r"-\frac{k_b \theta}{l_1 (u_1 - u_2) \sin(\frac{\theta}{2}) \cos(\frac{\theta}{2})} \mathbf{P}_1 \mathbf{d}_2",
    ),
    (
        "14",
        r"-\frac{k_b \theta}{l_1 (u_1 - u_2) \sin \frac{\theta}{2} \cos \frac{\theta}{2}} \mathbf{P}_1 \mathbf{d}_2",
    ),
    ("14", r"-\frac{2 k_b \theta}{l_1 (u_1 - u_2) \|\mathbf{d}_1 \times \mathbf{d}_2\|} \mathbf{P}_1 \mathbf{d}_2"),
    ("14", r"\frac{2 k_b \theta}{l_1 (u_1 - u_2) \sin \theta} \mathbf{d}_1 \times (\mathbf{d}_1 \times \mathbf{d}_2)"),
    ("14", r"-\frac{2 k_b \theta}{l_1 (u_1 - u_2) \tan \theta \cos \theta} \mathbf{P}_1 \mathbf{d}_2"),
    ("14", r"-\frac{2 k_b \theta}{l_1 (u_1 - u_2) \sqrt{1 - \cos^2 \theta}} \mathbf{P}_1 \mathbf{d}_2"),
    ("15", r"-\frac{2 k_b \theta \sin \theta}{l_2 (u_1 - u_2) (1 - \cos^2 \theta)} (\mathbf{d}_1^T \mathbf{P}_2)^T"),
    ("15", r"-\frac{2 k_b \theta \sin(\pi - \theta)}{l_2 (u_1 - u_2) \sin^2 \theta} \mathbf{P}_2 \mathbf{d}_1"),
    ("16", r"-\mathbf{F}_{\mathbf{x}_2} - \mathbf{F}_{\mathbf{x}_1}"),
    (
        "18",
        CURVED
        + r"\left( \theta (\mathbf{P}_1 \mathbf{d}_2 \mathbf{d}_1^T + (\mathbf{P}_1 \mathbf{d}_2 \mathbf{d}_1^T)^T"
        r" + \mathbf{d}_1^T \mathbf{d}_2 \mathbf{P}_1) + \frac{\theta \cos \theta - \sin \theta}{\sin^2 \theta}"
        r" (\mathbf{P}_1 \mathbf{d}_2) (\mathbf{P}_1 \mathbf{d}_2)^T \right)",
    ),
    (
        "22",
        r"-\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_2}"
        r" - \frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_1}",
    ),
    ("24", r"\frac{2 k_b \theta^2}{(u_2 - u_1)^3}"),
    ("28", r"\frac{2 k_b \theta}{l_1 (u_1 - u_2)^2 \sin \theta} (\mathbf{P}_1 \mathbf{d}_2)^T"),
    ("32", r"\frac{1}{8} k_x L (2 \phi - \pi)^2"),
    ("32", r"\frac{1}{2} k_x L \left( \arccos(-\mathbf{d}_1^T \mathbf{d}_3) - \frac{\pi}{2} \right)^2"),
    (
        "33",
        r"\frac{k_x L (\phi - \frac{\pi}{2})}{l_1 \cos(\phi - \frac{\pi}{2})} (\mathbf{d}_3 - \cos \phi \mathbf{d}_1)",
    ),
    ("43", r"-L k_c (d + u_0 - u_1)"),
    ("43", r"-k_c L |d - \Delta u|"),
    ("44", r"-\frac{L^2 k_c}{L}"),
]


@pytest.mark.parametrize(("equation", "formula"), REWRITINGS)
def test_an_equivalent_rewriting_is_proved(paper: Paper, equation: str, formula: str) -> None:
    members = (*paper.chains(equation)[0][:-1], read_formula(formula))
    for court, left, right in paper.trials(equation, members):
        assert court.judge(left, right).verdict is Verdict.PROVED


WRONG = [  # (equation, right side): slips of the pen that no change of a single node makes
    ("3", r"\frac{\mathbf{x}_i - \mathbf{x}_0}{u_i - u_0}"),  # right only where u_i > u_0
    ("6", r"-k_s (\|\mathbf{w}_1\| - 1) \mathbf{w}_1"),
    ("7", r"\frac{1}{2} k_s (\|\mathbf{w}_1\| - 1)^2"),
    ("8", r"-\frac{k_s}{l_1} \mathbf{d}_1 \mathbf{d}_1^T"),
    ("12", r"\arccos(\mathbf{d}_1^T \mathbf{d}_2)"),
    ("12", r"\pi - \arccos(-\mathbf{d}_1^T \mathbf{d}_2)"),
    ("13", r"4 k_b \frac{\tan^2 (\frac{\theta}{2})}{u_1 - u_2}"),  # right to second order in the angle
    ("14", r"-\frac{2 k_b \theta}{l_1 (u_1 - u_2) \sin \theta} (\mathbf{d}_2 - \cos \theta \mathbf{d}_1)"),
    ("14", r"-\frac{2 k_b \theta}{l_1 (u_1 - u_2) \sin \theta} \mathbf{d}_1 \times \mathbf{d}_2"),
    ("32", r"\frac{1}{2} k_x L \cos^2 \phi"),
    ("33", r"\frac{k_x L (\phi - \frac{\pi}{2})}{l_1 \tan \phi} \mathbf{P}_1 \mathbf{d}_3"),
    ("43", r"k_c L |\Delta u - d|"),
]


@pytest.mark.parametrize(("equation", "formula"), WRONG)
def test_a_slip_of_the_pen_is_refuted(paper: Paper, equation: str, formula: str) -> None:
    members = (*paper.chains(equation)[0][:-1], read_formula(formula))
    for court, left, right in paper.trials(equation, members):
        finding = court.judge(left, right)
        assert finding.verdict is Verdict.REFUTED
        assert finding.witness is not None


@pytest.mark.parametrize("digits", [30, 300, 1000])
@pytest.mark.parametrize("equation", ["6", "7", "9", "14", "17", "24", "28", "33", "36", "43", "44"])
def test_an_error_of_any_size_is_refuted(paper: Paper, equation: str, digits: int) -> None:
    tiny = 1 + 1 / number(10**digits)
    members = paper.chains(equation)[0]
    for court, left, right in paper.trials(equation, (*members[:-1], tiny * members[-1])):
        assert court.judge(left, right).verdict is Verdict.REFUTED


@pytest.mark.parametrize("equation", ["5", "13", "32", "42"])
def test_an_error_of_any_size_in_an_energy_is_refuted(paper: Paper, equation: str) -> None:
    (name, printed_energy), section = paper.chains(equation)[0], paper.section(equation)
    stiffness = Expr("symbol", value=section.parameters[0])
    changed = printed_energy + stiffness / number(10**40)
    for court, left, right in paper.trials(equation, (name, changed)):
        assert court.judge(left, right).verdict is Verdict.REFUTED


# -- from text to record ----------------------------------------------------------------------------------------------


def part_of(text: str, title: str) -> str:
    """The preamble and one section, as a document of its own."""
    head, *sections = re.split(r"(?m)^(?=## )", text)
    return head + next(s for s in sections if s.startswith(f"## {title}"))


@pytest.mark.parametrize(
    ("title", "equation", "change", "by", "verdict"),
    [
        ("Stretch", "6", "-k_s", "k_s", "refuted"),
        ("Stretch", "9", r"\Delta u}, \quad", r"\Delta u^2}, \quad", "refuted"),
        ("Stretch", "11", r"\mathbf{w}_1^T", r"\mathbf{w}_1", "refuted"),
        ("Stretch", "5", r"\frac{1}{2} k_s", r"k_s \frac{1}{2}", "proved"),
        ("Bending", "14", "l_1", "l_2", "refuted"),
        ("Bending", "13", "k_b", r"10^{-30} k_b", "refuted"),
        ("Parallel Contact", "43", "(", r"0.99999999999999999999999999999999 (", "refuted"),
        ("Parallel Contact", "44", r"= -k_c L", r"= -L k_c", "proved"),
    ],
)
def test_a_changed_copy_of_the_document_gets_its_verdict(
    source: Source, title: str, equation: str, change: str, by: str, verdict: str
) -> None:
    mutant = Source("copy.md", rewritten(part_of(source.text, title), equation, change, by))
    record = prove_source(mutant, shelf_for(Path("copy.md"), mutant.text))
    assert {c["verdict"] for c in record["claims"] if c["equation"] == equation} == {verdict}
    assert not {"undecided", "inconsistent"} & {c["verdict"] for c in record["claims"]}
    blamed = {c["equation"] for c in record["claims"] if c["verdict"] == "refuted" and not c["because"]}
    assert blamed - {"8", "18", "21"} == ({equation} if verdict == "refuted" else set())
