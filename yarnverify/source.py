"""The text of a document, and where in it an offset lies."""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NoReturn

from yarnverify.errors import InputError, why


@dataclass(frozen=True)
class Source:
    """A document's text, and where in it an offset lies."""

    name: str
    text: str

    def place(self, offset: int) -> tuple[int, int]:
        """Line and column, both from 1, of an offset."""
        starts = _line_starts(self.text)
        line = bisect_right(starts, offset)
        return line, offset - starts[line - 1] + 1

    def fail(self, offset: int, message: str) -> NoReturn:
        raise InputError(message, (self.name, *self.place(offset)))


@cache
def _line_starts(text: str) -> tuple[int, ...]:
    return (0, *(match.end() for match in re.finditer("\n", text)))


def load(path: Path) -> Source:
    """Read a file as UTF-8 text.

    Raises
    ------
    InputError
        If there is no such file, it is empty, or it is not text.
    """
    name = str(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read the document: {why(error)}", (name, 1, 1)) from None
    data = data.removeprefix(b"\xef\xbb\xbf")  # byte order mark
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        good = _one_line_end(data[: error.start].decode("utf-8"))
        Source(name, good).fail(len(good), f"not a text file: byte 0x{data[error.start]:02x} is not UTF-8")
    source = Source(name, _one_line_end(text))
    if "\0" in text:
        source.fail(source.text.index("\0"), "not a text file: it holds a zero byte")
    if not text.strip():
        source.fail(0, "the document is empty")
    return source


def _one_line_end(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")
