"""What is done with the tokens of a formula before they are parsed: bars told apart, subscripts put first."""

from __future__ import annotations

from collections.abc import Iterator
from types import MappingProxyType

from lark import Token


class UnpairedError(Exception):
    """A bar without a partner."""

    def __init__(self, token: Token) -> None:
        self.token = token


class Bars:
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
                    raise UnpairedError(stack[-1])
                if stack:
                    stack.pop()
            previous = token.type
            yield token
        for token in stack:
            if token.type in self._PAIRS or token.type.endswith("_OPEN"):
                raise UnpairedError(token)


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
