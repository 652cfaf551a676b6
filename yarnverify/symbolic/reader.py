"""From the text of a document to its headings and formulas, every node with its place in the file.

A display is ``$$ ... \\quad (7)$$`` (or ``\\tag{7}``), an inline formula is ``$ ... $``; a section starts at a Markdown
heading or at a numbered line of its own such as ``2 Bending``. Everything else is prose, and is passed over.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from yarnverify.source import Source
from yarnverify.symbolic.grammar import check_braces, parse, read_formula
from yarnverify.symbolic.tree import Expr

EQUATION_NUMBER = re.compile(
    r"(?:\\tag\s*\{\s*(?P<tag>[^{}\s]+)\s*\}|(?<![A-Za-z0-9}_^])\(\s*(?P<number>\d+[a-z]?)\s*\))[\s.,;]*\Z"
)
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
        check_braces(source, begin, end)
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


__all__ = ["EQUATION_NUMBER", "Heading", "Relation", "parse", "read", "read_formula"]
