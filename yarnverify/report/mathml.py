"""Formulas as MathML that wraps: a piece for each term, and a mark on what differs between two formulas.

Browsers do not break lines inside ``<math>``. A formula is therefore cut at its relations, at the terms of its sums and
around large brackets, into pieces that stand side by side where there is room, and below each other on a phone.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from difflib import SequenceMatcher
from functools import cache
from xml.etree.ElementTree import Element, fromstring, tostring

from latex2mathml.converter import convert

_NAMESPACE = ' xmlns="http://www.w3.org/1998/Math/MathML"'
_RELATIONS = frozenset("=<>≤≥≠≈")
_SIGNS = frozenset("+\N{MINUS SIGN}")
_BARS = frozenset("\N{DOUBLE VERTICAL LINE}\N{PARALLEL TO}|")
_UPRIGHT = frozenset("ΓΔΘΛΞΠΣΥΦΨΩ")
_WIDE = 9  # leaves; shorter brackets stay in one piece
_LINE = 60  # leaves; longer sums fill more than a line of paper
_ROWS = ("math", "mrow", "msqrt")  # their children are a sequence


def formula(latex: str) -> str:
    r"""MathML of a formula in LaTeX.

    >>> formula("x = 1").count("<math")
    2
    """
    return _written(_tree(latex))


def compared(before: str, after: str) -> tuple[str, str]:
    """MathML of two formulas; what differs has the class ``was`` in the first and ``now`` in the second."""
    left, right = _tree(before), _tree(after)
    _mark(left, right)
    return _written(left), _written(right)


def _tree(latex: str) -> Element:
    root = fromstring(convert(latex).replace(_NAMESPACE, ""))
    _tidy(root)
    return root


def _tidy(node: Element) -> None:
    """What the converter leaves to the reader: single rows, signs in front, functions, letters that stand upright."""
    for child in node:
        _tidy(child)
    for place, child in enumerate(list(node)):
        if child.tag == "mrow" and len(child) == 1:
            node[place] = child[0]
    if node.tag == "math" and len(node) == 1 and node[0].tag == "mrow" and not _fenced(node[0]):
        node[:] = list(node[0])
    if node.tag in _ROWS:
        node[:] = _normed(list(node))
        for place, child in reversed(list(enumerate(node))):
            if _is_function(child):
                node.insert(place + 1, Element("mspace", {"width": "0.17em"}))
                if place and node[place - 1].tag != "mo":
                    node.insert(place, Element("mspace", {"width": "0.17em"}))
            if child.text in _SIGNS and (place == 0 or _opens(node[place - 1])):
                child.set("form", "prefix")
    if _fenced(node) and all(part.tag != "mfrac" for part in node.iter()):
        for bracket in (node[0], node[-1]):
            bracket.set("stretchy", "false")  # stretched ones stand further off
    if node.tag == "mi" and (node.text or "") in _UPRIGHT:
        node.set("mathvariant", "normal")


def _normed(nodes: list[Element]) -> list[Element]:
    """Bars in pairs, as the brackets that they are: not two operators with room around them, between which a line breaks."""
    found: list[Element] = []
    opened: int | None = None
    for node in nodes:
        bar = node[0] if node.tag in ("msup", "msub", "msubsup") else node
        found.append(node)
        if bar.tag != "mo" or bar.text not in _BARS or bar.get("fence") == "true":
            continue
        if opened is None:
            if bar is node:
                opened = len(found) - 1
            continue
        row = Element("mrow")
        for side, form in ((found[opened], "prefix"), (bar, "postfix")):
            side.attrib |= {"stretchy": "false", "fence": "true", "form": form}
        row.extend([*found[opened:-1], bar])
        if bar is not node:
            node[0] = row
        found[opened:] = [row if bar is node else node]
        opened = None
    return found


def _opens(node: Element) -> bool:
    """Whether a sign behind it stands in front of one operand, not between two."""
    return node.tag == "mo" and (node.text in _RELATIONS | _SIGNS or node.get("form") == "prefix")


def _is_function(node: Element) -> bool:
    if node.tag in ("msup", "msub"):
        return _is_function(node[0])
    return node.tag == "mi" and len(node.text or "") > 2  # sin, cos, ...; an accented letter has two characters


def _fenced(node: Element) -> bool:
    return node.tag == "mrow" and len(node) > 2 and node[0].get("form") == "prefix" and node[0].get("fence") == "true"


def _same(one: Element, other: Element) -> bool:
    return tostring(one) == tostring(other)


def _mark(left: Element, right: Element) -> None:
    """Mark the smallest parts that differ."""
    if _same(left, right):
        return
    if left.tag != right.tag or not len(left) or not len(right):
        left.set("class", "was")
        right.set("class", "now")
    elif left.tag in _ROWS:
        old, new = ([tostring(child) for child in node] for node in (left, right))
        for kind, a, b, c, d in SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
            if kind == "replace" and b - a == d - c:
                for one, other in zip(left[a:b], right[c:d], strict=True):
                    _mark(one, other)
            elif kind != "equal":
                for child in left[a:b]:
                    child.set("class", "was")
                for child in right[c:d]:
                    child.set("class", "now")
    else:
        for one, other in zip(left, right, strict=True):
            _mark(one, other)


@cache
def widest(latex: str) -> int:
    r"""How many letters stand side by side in the widest part of a formula that no line can break.

    >>> widest(r"a = \frac{b + c}{2}")
    4
    """
    return max(sum(map(_letters, nodes)) for nodes in _pieces(_tree(latex)))


def _letters(node: Element) -> int:
    if node.tag in ("mfrac", "mover", "munder"):
        return max(map(_letters, node))
    return sum(map(_letters, node)) if len(node) else len(node.text or "")


def _pieces(root: Element) -> list[list[Element]]:
    pieces: list[list[Element]] = [[]]
    _cut(_breakable(list(root)), pieces)
    return [nodes for nodes in pieces if nodes]


def _written(root: Element) -> str:
    return "<wbr>".join(map(_piece, _pieces(root)))


def _piece(nodes: Sequence[Element]) -> str:
    math = Element("math", {"displaystyle": "true"})
    math.extend(nodes)
    return tostring(math, encoding="unicode", short_empty_elements=False)


def _cut(nodes: Sequence[Element], pieces: list[list[Element]]) -> None:
    """Add nodes to the last piece, opening a new one wherever a line may break."""
    started = False
    for node in nodes:
        text = node.text if node.tag == "mo" else None
        if text in _RELATIONS or (text in _SIGNS and started):
            node.set("form", "infix")  # it opens a piece, but stands between two operands
            pieces.append([])
        if _fenced(node) and sum(1 for _ in node.iter()) > 2 * _WIDE and _has_terms(node):
            opening, *inner, closing = node
            for bracket in (opening, closing):
                if bracket.get("stretchy") == "true":
                    bracket.set("minsize", "2.5em")  # as high as fractions are
                if "class" in node.attrib:
                    bracket.set("class", node.get("class", ""))
            if started:
                pieces.append([])
            pieces[-1].append(opening)
            _cut(inner, pieces)
            pieces[-1].append(closing)
        else:
            pieces[-1].append(deepcopy(node))
        started = text not in _RELATIONS


def _breakable(nodes: Sequence[Element]) -> list[Element]:
    """Fractions with sums too long for a line above the bar: ``a (b + ...) / c`` becomes ``a / c (b + ...)``."""
    found: list[Element] = []
    for node in nodes:
        above = list(node[0]) if node.tag == "mfrac" and node[0].tag == "mrow" and not _fenced(node[0]) else []
        long = [part for part in above if _fenced(part) and _leaves(part) > _LINE and _has_terms(part)]
        if long:
            fraction = Element("mfrac", node.attrib)
            rest = Element("mrow")
            rest.extend(part for part in above if part not in long)
            if not len(rest):
                rest.append(fromstring("<mn>1</mn>"))
            fraction.extend([rest, node[1]])
            found += [fraction, *long]
        else:
            found.append(node)
    return found


def _leaves(node: Element) -> int:
    return sum(1 for part in node.iter() if not len(part))


def _has_terms(node: Element) -> bool:
    return any(child.tag == "mo" and child.text in _SIGNS for child in list(node)[2:])
