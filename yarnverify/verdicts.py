"""The verdicts of a document, from the cache where they are known, settled against its errata."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from yarnverify.library import (
    MAIN_DOCUMENT,
    Erratum,
    Shelf,
    derivations,
    errata,
    known,
    shelf_for,
)
from yarnverify.source import load


def path_of(document: Path | None) -> Path:
    """The path of a document; the main one's for None."""
    return document if document is not None else derivations() / MAIN_DOCUMENT


def verdicts(
    document: Path | None = None,
    choice: str | None = None,
    cache: bool = True,
    advance: Callable[[str, int], None] = lambda label, total: None,
) -> tuple[dict[str, Any], str]:
    """The record of a document and a line on how long it took.

    Parameters
    ----------
    document
        Path of the document; the main one by default.
    choice
        Folder of derivations to judge by, ``"none"``, or None to find out.
    cache
        Whether results that are already known are used and kept.
    advance
        Called as each claim is judged.

    Raises
    ------
    InputError
        For a document, declarations or errata that cannot be read.
    """
    start = time.perf_counter()
    path = path_of(document)
    source = load(path)
    shelf = shelf_for(path, source.text, choice)
    parts: list[bytes | Path] = [
        source.name.encode(),
        source.text.encode(),
        shelf.document.encode(),
        shelf.how.encode(),
    ]
    parts += sorted(shelf.folder.glob("*.py")) if shelf.folder else []

    def make() -> dict[str, Any]:
        from yarnverify.symbolic.record import prove_source

        return prove_source(source, shelf, advance)

    record, earlier = known([b"verdicts", *parts], make, cache)
    settle(record, shelf, errata(shelf))
    seconds = time.perf_counter() - start
    return record, f"{'known from an earlier run' if earlier else 'derived and proved'} in {seconds:.2f} s"


def nothing_printed() -> dict[str, Any]:
    """The record of a folder without a document."""
    record: dict[str, Any] = {
        "schema": 1,
        "document": "",
        "judged": "by nothing, since there is no document",
        "equations": [],
        "tally": dict.fromkeys(("proved", "refuted", "undecided", "inconsistent"), 0),
        "claims": [],
        "given": [],
        "completeness": [],
    }
    settle(record, Shelf(None, "", ""), ())
    return record


def settle(record: dict[str, Any], shelf: Shelf, accepted: tuple[Erratum, ...]) -> None:
    """Mark what the errata accept; add what is new, what is stale, and whether all is as expected."""
    used: set[Erratum] = set()
    new: list[str] = []
    known = {(erratum.equation, erratum.change) for erratum in accepted}
    mended = {c["equation"] for c in record["claims"] if (c["equation"], c["change"]) in known}
    for claim in record["claims"]:
        claim["erratum"] = None
        if claim["verdict"] == "proved":
            continue
        if claim["because"] and set(claim["because"]) <= mended:
            claim["erratum"] = "follows from accepted errata"
            continue
        match = [e for e in accepted if e.equation == claim["equation"] and e.change == claim["change"]]
        if claim["verdict"] == "refuted" and match:
            claim["erratum"] = match[0].reason
            used.update(match)
        elif claim["equation"] not in new:
            new.append(claim["equation"])
    missing = [item["block"] for part in record["completeness"] for item in part["missing"]]
    whole = record["document"] == shelf.document  # an excerpt says nothing about equations that it leaves out
    stale = [e.equation for e in accepted if e not in used and (whole or e.equation in record["equations"])]
    record["errata"] = {"accepted": [e.equation for e in accepted if e in used], "new": new, "stale": stale}
    record["as_expected"] = not (new or stale or missing)
