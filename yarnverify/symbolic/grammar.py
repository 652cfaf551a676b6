"""One formula: from LaTeX to a tree, every node with its place in the file."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

from lark import Lark, Token, Transformer, v_args
from lark.exceptions import UnexpectedToken
from lark.tree import Meta

from yarnverify.errors import InputError
from yarnverify.source import Source
from yarnverify.symbolic.tokens import Bars, UnpairedError
from yarnverify.symbolic.tree import IDENTITY, Expr, Name, number

_DEEPEST, _LONGEST_NUMBER, _LONGEST_EXPONENT = 60, 100, 2  # far beyond any formula, and within what Python recurses
_TRAILING = re.compile(r"(?:[\s.,;~]|\\quad|\\qquad|\\[,;:! ])*\Z")


def check_braces(source: Source, begin: int, end: int) -> None:
    """Refuse braces without a partner, and formulas nested too deep."""
    open_at: list[int] = []
    depth = 0
    for match in re.finditer(r"\\.|[{}()\[\]]", source.text[begin:end], re.DOTALL):
        depth += (match[0] in "{([") - (match[0] in "})]")
        if depth > _DEEPEST:
            source.fail(begin + match.start(), f"formula is nested more than {_DEEPEST} deep")
        if match[0] == "{":
            open_at.append(begin + match.start())
        elif match[0] == "}":
            if not open_at:
                source.fail(begin + match.start(), "unbalanced braces: this } closes nothing")
            open_at.pop()
    if open_at:
        source.fail(open_at[-1], "unbalanced braces: this { is never closed")


@v_args(meta=True)
class _Build(Transformer[Token, Any]):
    """Lark's tree to ours; ``shift`` is where the formula starts in the file."""

    def __init__(self, shift: int, complain: Any) -> None:
        super().__init__()
        self.shift, self.complain = shift, complain

    def _node(self, meta: Meta, op: str, *args: Expr, value: Any = None) -> Expr:
        return Expr(op, args, value, (meta.start_pos + self.shift, meta.end_pos + self.shift))

    def relations(self, meta: Meta, items: list[Any]) -> list[Any]:
        return items

    mention = relations

    def relation(self, meta: Meta, items: list[Any]) -> tuple[tuple[Expr, ...], tuple[str, ...]]:
        named = {r"\lt": "<", r"\gt": ">", r"\le": "<=", r"\leq": "<=", r"\ge": ">=", r"\geq": ">="}
        return tuple(items[::2]), tuple(named.get(str(token), str(token)) for token in items[1::2])

    def add(self, meta: Meta, items: list[Any]) -> Expr:
        terms = []
        for sign, term in zip(items[::2], items[1::2], strict=True):
            negative = sign is not None and sign == "-"
            span = (sign.start_pos + self.shift if negative else term.span[0], term.span[1])
            terms.append(Expr("neg", (term,), None, span) if negative else term)
        return terms[0] if len(terms) == 1 else self._node(meta, "add", *terms)

    def mul(self, meta: Meta, items: list[Any]) -> Expr:
        """A product; ``a b / c d`` is read from left to right."""
        factors: list[Expr] = []
        after_slash = False
        for item in items:
            if isinstance(item, Token):
                self._check_slash(factors[-1])
                after_slash = True
                continue
            if after_slash:
                above = factors[0] if len(factors) == 1 else self._span("mul", factors)
                factors, after_slash = [self._span("frac", [above, item])], False
            else:
                factors.append(item)
        return factors[0] if len(factors) == 1 else self._node(meta, "mul", *factors)

    @staticmethod
    def _span(op: str, args: list[Expr]) -> Expr:
        return Expr(op, tuple(args), None, (args[0].span[0], args[-1].span[1]))

    def _check_slash(self, before: Expr) -> None:
        call = before.args[0] if before.op == "pow" else before
        if call.op == "call" and call.args[0].span[1] == before.span[1]:
            self.complain(
                before.span[0],
                f"\\{call.value} ... / ... may mean two things: write parentheses, or \\frac{{...}}{{...}}",
            )

    def cross(self, meta: Meta, items: list[Any]) -> Expr:
        return self._node(meta, "cross", items[0], items[2])

    def dot(self, meta: Meta, items: list[Any]) -> Expr:
        return self._node(meta, "dot", items[0], items[2])

    def exponent(self, meta: Meta, items: list[Any]) -> int:
        sign, digits = items
        if "." in digits:
            self.complain(digits.start_pos + self.shift, "exponents are integers here; write \\sqrt{...} for a root")
        if len(digits) > _LONGEST_EXPONENT:
            self.complain(digits.start_pos + self.shift, f"exponents have at most {_LONGEST_EXPONENT} digits here")
        return -int(digits) if sign == "-" else int(digits)

    def power(self, meta: Meta, items: list[Any]) -> Expr:
        return self._node(meta, "pow", items[0], value=items[1])

    def power_short(self, meta: Meta, items: list[Any]) -> Expr:
        return self._node(meta, "pow", items[0], value=int(items[1][-1]))

    def transpose(self, meta: Meta, items: list[Any]) -> Expr:
        return self._node(meta, "transpose", items[0])

    def number(self, meta: Meta, items: list[Token]) -> Expr:
        if len(items[0]) > _LONGEST_NUMBER:
            self.complain(meta.start_pos + self.shift, f"numbers have at most {_LONGEST_NUMBER} digits here")
        exact = number(Fraction(str(items[0])))
        return replace(exact, span=(meta.start_pos + self.shift, meta.end_pos + self.shift))

    def pi(self, meta: Meta, items: list[Token]) -> Expr:
        return self._node(meta, "pi")

    def grouped(self, meta: Meta, items: list[Any]) -> Expr:
        return items[1]

    def norm(self, meta: Meta, items: list[Expr]) -> Expr:
        return self._node(meta, "norm", *items)

    def abs(self, meta: Meta, items: list[Expr]) -> Expr:
        return self._node(meta, "abs", *items)

    def sqrt(self, meta: Meta, items: list[Expr]) -> Expr:
        return self._node(meta, "sqrt", *items)

    def frac(self, meta: Meta, items: list[Expr]) -> Expr:
        return self._node(meta, "frac", *items)

    def short_frac(self, meta: Meta, items: list[Token]) -> Expr:
        above, below = re.findall(r"\d", items[0])
        return self._node(meta, "frac", number(int(above)), number(int(below)))

    def derivative(self, meta: Meta, items: list[Expr]) -> Expr:
        if items[1].op != "symbol":
            self.complain(items[1].span[0], "a derivative is taken by an unknown such as u_1")
        return self._node(meta, "derivative", items[0], value=items[1].name)

    def call(self, meta: Meta, items: list[Any]) -> Expr:
        name = str(items[0])[1:]
        return self._node(meta, "call", items[1], value="log" if name == "ln" else name)

    def call_power(self, meta: Meta, items: list[Any]) -> Expr:
        return self._node(meta, "pow", self.call(meta, [items[0], items[2]]), value=int(items[1][-1]))

    def call_raised(self, meta: Meta, items: list[Any]) -> Expr:
        function, exponent, argument = items
        if exponent < 0:
            self.complain(
                meta.start_pos + self.shift,
                f"{function}^{{{exponent}}} may mean two things: write \\arc{function[1:]}, or \\frac{{1}}{{{function} ...}}",
            )
        return self._node(meta, "pow", self.call(meta, [function, argument]), value=exponent)

    def call_of_two(self, meta: Meta, items: list[Any]) -> Expr:
        return self._node(meta, "call", items[2], items[3], value="atan2")

    def symbol(self, meta: Meta, items: list[Any]) -> Expr:
        letter, sub = items
        name = replace(letter, sub=sub.label if isinstance(sub, Name) else sub or "")
        if name == Name("I", bold=True):
            return replace(IDENTITY, span=(meta.start_pos + self.shift, meta.end_pos + self.shift))
        if name == Name("0", bold=True):
            return self._node(meta, "number", value=0)
        if letter.base == "F":
            if not isinstance(sub, Name):
                what = "F" + (f"_{sub}" if sub else "")
                self.complain(
                    meta.start_pos + self.shift,
                    f"{what} names no unknown: write F_{{u_1}} or \\mathbf{{F}}_{{\\mathbf{{x}}_1}}",
                )
            return self._node(meta, "force", value=sub)
        if letter == Name("V"):
            return self._node(meta, "energy", value=name)
        return self._node(meta, "symbol", value=name)

    def letter(self, meta: Meta, items: list[Token]) -> Name:
        return Name(str(items[0]).removeprefix("\\"))

    def bold(self, meta: Meta, items: list[Name]) -> Name:
        return replace(items[0], bold=True)

    def bold_letter(self, meta: Meta, items: list[Token]) -> Name:
        return Name(str(items[0]), bold=True)

    def bold_zero(self, meta: Meta, items: list[Token]) -> Name:
        if str(items[0]) != "0":
            self.complain(meta.start_pos + self.shift, "the only bold number is the zero vector \\mathbf{0}")
        return Name("0", bold=True)

    def accented(self, meta: Meta, items: list[Any]) -> Name:
        return replace(items[1], base=f"{str(items[0])[1:]} {items[1].base}")

    def difference(self, meta: Meta, items: list[Name]) -> Name:
        return replace(items[0], base=f"Delta {items[0].base}")

    def sub(self, meta: Meta, items: list[Any]) -> Name | str:
        if len(items) == 1:
            found: Name | str = items[0]
            return found
        return ",".join(item.label if isinstance(item, Name) else item for item in items)

    def sub_text(self, meta: Meta, items: list[Token]) -> str:
        return "".join(str(item) for item in items).lstrip("_").strip()

    def sub_symbol(self, meta: Meta, items: list[Expr]) -> Name | str:
        if items[0].op not in {"symbol", "energy"}:
            self.complain(items[0].span[0], "this cannot be a subscript")
        name = items[0].name
        plain = not name.bold and not name.sub and len(name.base) == 1
        return name.base if plain else name


@cache
def _parser() -> Lark:
    return Lark(
        (Path(__file__).parent / "grammar.lark").read_text(encoding="utf-8"),
        parser="lalr",
        lexer="basic",
        postlex=Bars(),
        start=["relations", "mention"],
        propagate_positions=True,
        maybe_placeholders=True,
    )


def parse(source: Source, begin: int, end: int, start: str = "relations") -> Any:
    """Read the formula at ``source.text[begin:end]``: a list of (members, operators).

    Raises
    ------
    InputError
        At the first place that cannot be read.
    """
    check_braces(source, begin, end)
    formula = source.text[begin:end]
    trailing = _TRAILING.search(formula)
    assert trailing is not None
    formula = formula[: trailing.start()]
    if not formula.strip():
        source.fail(begin, "empty formula")
    try:
        tree = _parser().parse(formula, start=start)
    except UnpairedError as error:
        source.fail(begin + (error.token.start_pos or 0), f"{error.token} is not paired with a closing one")
    except UnexpectedToken as error:
        token = error.token
        offset = begin + (len(formula) if token.type == "$END" else (token.start_pos or 0))
        source.fail(offset, _explain(token))
    builder = _Build(begin, source.fail)
    try:
        return builder.transform(tree)
    except Exception as error:
        # Lark wraps what a callback raises
        inner = getattr(error, "orig_exc", None)
        raise inner if isinstance(inner, InputError) else error from None


def _explain(token: Token) -> str:
    if token.type == "$END":
        return "the formula ends where something must follow"
    if token.type == "UNKNOWN_COMMAND":
        return f"unknown LaTeX command {token}"
    if token.type == "UNKNOWN_CHARACTER":
        return f"unexpected character {str(token)!r}"
    if token.type == "SLASH":
        return "unexpected '/'; an exponent is an integer here, and a root is \\sqrt{...}"
    return f"unexpected {str(token)!r}"


def read_formula(text: str, name: str = "formula") -> Expr:
    """One expression from LaTeX text.

    >>> read_formula(r"\\frac{1}{2} k_s").op
    'mul'
    """
    source = Source(name, text)
    (members, operators), *others = parse(source, 0, len(text))
    if operators or others:
        source.fail(0, "an expression is wanted here, not a relation")
    result: Expr = members[0]
    return result
