"""A table before it is Markdown, HTML or a table on a terminal."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """A title, headings, rows of as many cells, and what to say below."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


def number(value: float) -> str:
    """Two digits, or three before the point; as a power of ten from a thousand on."""
    if value < 1000:
        return f"{value:.0f}" if value >= 100 else f"{value:.2g}"
    return f"{value:.0e}".replace("e+", "e").replace("e0", "e")
