"""What ``yarnverify fuzz`` does: the energies one after another, and the lines that it prints."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable, Sequence
from typing import Any

from yarnverify.accuracy.cells import has_kernel
from yarnverify.errors import InputError, NotRunError
from yarnverify.fuzzing.search import ENERGIES, Search, search
from yarnverify.generation import out_of_date
from yarnverify.project import Project, project
from yarnverify.symbolic.declare import load_declarations


def fuzz(
    energy: str | None,
    variant: str,
    seconds: float,
    seed: int | None,
    advance: Callable[[str, int], None],
    of: Project | None = None,
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
    of
        Whose energies; those of the package by default.

    Returns
    -------
    lines, record
        What is printed, and the same as plain data, a search an entry.

    Raises
    ------
    InputError
        For a time that is not positive, or a name that is no energy or no variant.
    NotRunError
        Where no kernels of your own are generated.
    """
    if not 0 < seconds < math.inf:
        raise InputError(f"--time must be a positive number of seconds, not {seconds}")
    seed = random.SystemRandom().randrange(10**6) if seed is None else seed
    of = of or project()
    names: Sequence[str] = (energy,) if energy else _with_kernels(of, variant) if of.own else ENERGIES
    end = time.monotonic() + seconds
    searches = []
    for number, name in enumerate(names):
        share = (end - time.monotonic()) / (len(names) - number)
        searches.append(search(name, variant, share, seed, advance, folder=of.folder if of.own else None))
        if searches[-1].interrupted:
            break
    lines = [line for one in searches for line in _lines(one)]
    lines += out_of_date(of)
    skipped = names[len(searches) :]
    if skipped:
        lines.append(f"interrupted; not run: {', '.join(skipped)}")
    return lines, [one.record() for one in searches]


def _with_kernels(of: Project, variant: str) -> list[str]:
    """The energies of a folder that have a kernel."""
    names = [energy.name for energy in load_declarations(of.folder).energies]
    found = [name for name in names if has_kernel(variant, name, of.folder)]
    if not found:
        raise NotRunError(f"{of.name}: has no {variant} kernels; they are made by: {of.here('yarnverify generate')}")
    return found


def _lines(found: Search) -> list[str]:
    limit = found.limit
    allowed = f"{limit.rounding:g} u" + (f" + {limit.conditioning:g} u x condition" if limit.conditioning else "")
    count = len(found.found)
    outcome = "nothing found" if not count else f"{count} {'kind' if count == 1 else 'kinds'} of flaw found"
    if found.promise == "none":
        allowed += ", which it does not promise"
    lines = [
        f"{found.energy}, {found.variant}: {outcome} in {found.cases} elements (seed {found.seed}, limit {allowed})"
    ]
    lines += [f"  {number:>7} {name}" for name, number in found.regimes.items()]
    if found.worst_element is not None:
        lines.append(f"  largest error {found.worst:.3g} of its limit, at {found.worst_element!r}")
    return [*lines, *(case.line for case in found.found)]
