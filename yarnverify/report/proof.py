"""What a page says of the proof of a derivation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class Proof(NamedTuple):
    """A sentence in two parts: the verdict, emphasised where it is bad, and what it is about."""

    verdict: str
    about: str
    bad: bool


def proof_of(derivation: Mapping[str, Any]) -> Proof:
    """Of a record of ``derivations``."""
    good, count = derivation["all_proved"], len(derivation["proof"])
    if derivation["measures"]:
        return Proof("All proved" if good else "Not all proved", f": the law and {count - 1} blocks.", not good)
    if count:
        return Proof("Proved" if good else "Not proved", ", entry by entry, as rational functions.", not good)
    return Proof(
        "Plain differentiation",
        ", without a proof of its own: its errors are measured against ball arithmetic, which shares no code with it. "
        "Nothing is done for states in which these formulas lose digits or divide by zero.",
        False,
    )
