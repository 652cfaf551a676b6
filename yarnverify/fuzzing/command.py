"""What ``yarnverify fuzz`` does: the energies one after another, and the lines that it prints."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable
from typing import Any

from yarnverify.errors import InputError
from yarnverify.fuzzing.judge import limit_of
from yarnverify.fuzzing.search import ENERGIES, Search, search


def fuzz(
    energy: str | None, variant: str, seconds: float, seed: int | None, advance: Callable[[str, int], None]
) -> tuple[list[str], list[dict[str, Any]]]:
    """Search one energy or all of them.

    Parameters
    ----------
    energy
        None for all, each with an equal share of the time that is left.
    variant
        Of the kernels.
    seconds
        For all of it.
    seed
        None for one that is drawn, and told.
    advance
        Told after each element.

    Returns
    -------
    lines, record
        What is printed, and the same as plain data, a search an entry.

    Raises
    ------
    InputError
        For a time that is not positive, or a name that is no energy or no variant.
    """
    if not 0 < seconds < math.inf:
        raise InputError(f"--time must be a positive number of seconds, not {seconds}")
    seed = random.SystemRandom().randrange(10**6) if seed is None else seed
    names = ENERGIES if energy is None else (energy,)
    end = time.monotonic() + seconds
    searches = []
    for number, name in enumerate(names):
        share = (end - time.monotonic()) / (len(names) - number)
        searches.append(search(name, variant, share, seed, advance))
        if searches[-1].interrupted:
            break
    lines = [line for one in searches for line in _lines(one)]
    skipped = names[len(searches) :]
    if skipped:
        lines.append(f"interrupted; not run: {', '.join(skipped)}")
    return lines, [one.record() for one in searches]


def _lines(found: Search) -> list[str]:
    limit = limit_of(found.variant)
    allowed = f"{limit.rounding:g} u" + (f" + {limit.conditioning:g} u x condition" if limit.conditioning else "")
    count = len(found.found)
    outcome = "nothing found" if not count else f"{count} {'kind' if count == 1 else 'kinds'} of flaw found"
    lines = [
        f"{found.energy}, {found.variant}: {outcome} in {found.cases} elements (seed {found.seed}, limit {allowed})"
    ]
    lines += [f"  {number:>7} {name}" for name, number in found.regimes.items()]
    if found.worst_element is not None:
        lines.append(f"  largest error {found.worst:.3g} of its limit, at {found.worst_element!r}")
    return [*lines, *(case.line for case in found.found)]
