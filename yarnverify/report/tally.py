"""Verdicts of a document counted by section, and their sum."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Counted:
    """A row of the verdict table.

    Attributes
    ----------
    anchor
        Of the section's equations on the page; empty where it prints none.
    counts
        Claims by verdict.
    wrong
        Numbers of the equations that are not proved.
    listed
        What is to be said of the section's list of forces and Jacobians.
    """

    title: str
    anchor: str
    counts: Mapping[str, int]
    wrong: tuple[str, ...]
    listed: str


def anchor_of(section: str) -> str:
    """The name of a section's equations on the page."""
    return "section-" + (section.lower().replace(" ", "-") or "definitions")


def counted(found: Mapping[str, Any], derived: Mapping[str, Any]) -> list[Counted]:
    """A row for the definitions that all sections share, and one for each section: of the document, and of an energy."""
    titles = {own["section"]: own["title"] for own in derived.values() if own["section"]}
    lists = {part["section"]: part for part in found["completeness"]}
    rows = []
    for section in dict.fromkeys([*(claim["section"] for claim in found["claims"]), *titles]):
        claims = [claim for claim in found["claims"] if claim["section"] == section]
        rows.append(
            Counted(
                titles.get(section, section or "Definitions"),
                anchor_of(section) if claims else "",
                {verdict: sum(claim["verdict"] == verdict for claim in claims) for verdict in found["tally"]},
                tuple(dict.fromkeys(claim["equation"] for claim in claims if claim["verdict"] != "proved")),
                _listed(lists.get(section), section),
            )
        )
    return rows


def _listed(part: Mapping[str, Any] | None, section: str) -> str:
    if part is None:
        return "not in the document" if section else "–"
    if part["missing"]:
        return f"lacks {', '.join(item['block'] for item in part['missing'])}"
    return f"all {len(part['listed'])}"
