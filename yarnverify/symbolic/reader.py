"""From the text of a document to its headings and formulas, every node with its place in the file.

A display is ``$$ ... \\quad (7)$$`` (or ``\\tag{7}``), an inline formula is ``$ ... $``; a section starts at a Markdown
heading or at a numbered line of its own such as ``2 Bending``. Everything else is prose, and is passed over.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lark import Lark, Token, Transformer, v_args
from lark.exceptions import UnexpectedToken
from lark.tree import Meta

from yarnverify.errors import InputError
from yarnverify.source import Source
from yarnverify.symbolic.tree import IDENTITY, Expr, Name, number

EQUATION_NUMBER = re.compile(
    r"(?:\\tag\s*\{\s*(?P<tag>[^{}\s]+)\s*\}|(?<![A-Za-z0-9}_^])\(\s*(?P<number>\d+[a-z]?)\s*\))[\s.,;]*\Z"
)
_DEEPEST, _LONGEST_NUMBER, _LONGEST_EXPONENT = 60, 100, 2  # far beyond any formula, and within what Python recurses
_TRAILING = re.compile(r"(?:[\s.,;~]|\\quad|\\qquad|\\[,;:! ])*\Z")
_RELATION = re.compile(r"[=<>]|\\(?:le|leq|ge|geq|lt|gt)(?![A-Za-z])")
_PIECE = re.compile(
    r"(?P<escaped>\\\$|<!--[\s\S]*?-->|^```(?!math\b)[\s\S]*?^```)"  # no formula: escaped, comment, code
    r"|(?P<display>\$\$)"
    r"|(?P<inline>\$)"
    r"|^(?P<marks>\#{1,6})[ \t]+(?P<title>[^\n]*?)[ \t\#]*$"
    r"|(?:\A|(?<=\n\n))(?P<count>\d+(?:\.\d+)*)\.?[ \t]+(?P<numbered>[A-Z][^\n.$]{0,80})(?=\n\n|\n?\Z)"
    r"|\\\((?P<aside>[^$\n]*?)\\\)"
    r"|(?P<foreign>\\begin\s*\{\w+\*?\}|\\[\[(]|^```math\b)",
    re.MULTILINE,
)


@dataclass(frozen=True)
class Heading:
    level: int
    title: str
    offset: int


@dataclass(frozen=True)
class Relation:
    """``members[0] operators[0] members[1] ...``: one chain of equalities or inequalities.

    ``equation`` is the printed number, or ``line N`` for an inline formula; ``offset`` is where the display starts for
    its first relation, and where the relation starts for the others.
    """

    members: tuple[Expr, ...]
    operators: tuple[str, ...]
    equation: str
    offset: int
    inline: bool


def read(source: Source) -> Iterator[Heading | Relation]:
    """Headings and relations of a document, in reading order.

    Raises
    ------
    InputError
        For a formula that cannot be read, an equation number used twice, or a display without a number.
    """
    text, at = source.text, 0
    used: dict[str, int] = {}
    while match := _PIECE.search(text, at):
        at = match.end()
        start = match.start()
        if match["display"]:
            end = text.find("$$", at)
            if end < 0:
                source.fail(start, "display opened by $$ is never closed")
            yield from _display(source, start, at, end, used)
            at = end + 2
        elif match["inline"]:
            end = _closing_dollar(text, at)
            if end < 0:
                source.fail(start, "inline formula opened by $ is not closed in its paragraph")
            yield from _inline(source, start, at, end)
            at = end + 1
        elif match["title"] is not None:
            yield Heading(len(match["marks"]), match["title"], start)
        elif match["numbered"]:
            yield Heading(2 + match["count"].count("."), match["numbered"].strip(), start)
        elif match["aside"] is not None and not _RELATION.search(match["aside"]):
            continue  # \(y\) states nothing; a relation might be an assumption, which must not be lost
        elif match["aside"] is not None:
            source.fail(start, "\\( is not read here: write inline formulas as $ ... $")
        elif match["foreign"]:
            source.fail(start, f"{match['foreign']} is not read here: write displays as $$ ... \\quad (7)$$")


def _closing_dollar(text: str, at: int) -> int:
    paragraph = text.find("\n\n", at)
    return text.find("$", at, paragraph if paragraph >= 0 else len(text))


def _display(source: Source, start: int, begin: int, end: int, used: dict[str, int]) -> Iterator[Relation]:
    tag = EQUATION_NUMBER.search(source.text[begin:end])
    if tag is None:
        _check_braces(source, begin, end)
        source.fail(start, "display has no equation number: end it with \\quad (7) or \\tag{7}")
    equation = tag["tag"] or tag["number"]
    if equation in used:
        line, _ = source.place(used[equation])
        source.fail(begin + tag.start(), f"equation number ({equation}) is used twice, first in line {line}")
    used[equation] = start
    relations = parse(source, begin, begin + tag.start())
    for index, (members, operators) in enumerate(relations):
        if not operators:
            source.fail(
                members[0].span[0], f"equation ({equation}) states nothing here: a relation such as ... = ... is wanted"
            )
        yield Relation(members, operators, equation, members[0].span[0] if index else start, False)


def _inline(source: Source, start: int, begin: int, end: int) -> Iterator[Relation]:
    if not _RELATION.search(source.text[begin:end]):
        parse(source, begin, end, "mention")  # makes no statement, but must be readable
        return
    line, _ = source.place(start)
    for members, operators in parse(source, begin, end):
        yield Relation(members, operators, f"line {line}", members[0].span[0], True)


def _check_braces(source: Source, begin: int, end: int) -> None:
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


class _UnpairedError(Exception):
    def __init__(self, token: Token) -> None:
        self.token = token


class _Bars:
    """Tells an opening bar from a closing one: a bar after something complete, inside bars, closes them."""

    always_accept = ("BARS", "BAR", "UNKNOWN_COMMAND", "UNKNOWN_CHARACTER")
    _PAIRS = MappingProxyType({"BARS": "_NORM", "BAR": "_ABS"})
    _OPENERS = frozenset({"LPAR", "LSQB", "LBRACE", "LEFT_PAREN", "LEFT_BRACKET"})
    _CLOSERS = frozenset({"RPAR", "RSQB", "RBRACE", "RIGHT_PAREN", "RIGHT_BRACKET"})
    _COMPLETE = frozenset({"LETTER", "GREEK", "NUMBER", "PI", "TRANSPOSE", "SUP_DIGIT", "SUB_CHARACTER", "SHORT_FRAC"})

    def process(self, stream: Iterator[Token]) -> Iterator[Token]:
        stack: list[Token] = []  # what is open: plain bars by their own type, explicit ones by that of \left|
        previous = ""
        for token in _subscripts_first(stream):
            plain = token.type in self._PAIRS
            if plain:
                complete = previous in self._COMPLETE | self._CLOSERS or previous.endswith("_CLOSE")
                closing = complete and bool(stack) and stack[-1].type == token.type
                stack.pop() if closing else stack.append(token)
                kind = self._PAIRS[token.type] + ("_CLOSE" if closing else "_OPEN")
                token = Token.new_borrow_pos(kind, token.value, token)
            elif token.type in self._OPENERS or token.type.endswith("_OPEN"):
                stack.append(token)
            elif token.type in self._CLOSERS or token.type.endswith("_CLOSE"):
                bar = stack and (stack[-1].type in self._PAIRS or stack[-1].type.endswith("_OPEN"))
                if bar and stack[-1].type.replace("_OPEN", "_CLOSE") != token.type:
                    raise _UnpairedError(stack[-1])
                if stack:
                    stack.pop()
            previous = token.type
            yield token
        for token in stack:
            if token.type in self._PAIRS or token.type.endswith("_OPEN"):
                raise _UnpairedError(token)


def _subscripts_first(stream: Iterator[Token]) -> Iterator[Token]:
    """The tokens of ``d^T_2`` in the order of ``d_2^T``."""
    waiting = list(stream)
    at = 0
    while at < len(waiting):
        end = _end_of_subscript(waiting, at + 1) if waiting[at].type in {"TRANSPOSE", "SUP_DIGIT"} else at + 1
        yield from waiting[at + 1 : end]
        yield waiting[at]
        at = end


def _end_of_subscript(tokens: list[Token], at: int) -> int:
    """Where a subscript that starts at a token ends; the token itself where none does."""
    kinds = [token.type for token in tokens[at:]]
    if kinds[:1] == ["SUB_CHARACTER"]:
        return at + 1
    if kinds[:1] != ["_UNDERSCORE"]:
        return at
    if kinds[1:2] != ["LBRACE"]:
        return min(at + 2, len(tokens))
    depth = 0
    for end, kind in enumerate(kinds[1:], at + 2):
        depth += (kind == "LBRACE") - (kind == "RBRACE")
        if depth == 0:
            return end
    return at


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
        postlex=_Bars(),
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
    _check_braces(source, begin, end)
    formula = source.text[begin:end]
    trailing = _TRAILING.search(formula)
    assert trailing is not None
    formula = formula[: trailing.start()]
    if not formula.strip():
        source.fail(begin, "empty formula")
    try:
        tree = _parser().parse(formula, start=start)
    except _UnpairedError as error:
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
