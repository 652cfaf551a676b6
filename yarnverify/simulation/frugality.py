"""What a scene saves by modelling no more than it needs: the same scene with everything switched on, beside it."""

from __future__ import annotations

import tracemalloc
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np

from yarnverify.kernels import ElementError, bending, gravity, parallel_contact, shear, stretch
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import bends, contacts, segments, shears
from yarnverify.simulation.linear import LinearSolveError
from yarnverify.simulation.runs import Run
from yarnverify.simulation.search import NotConverged
from yarnverify.simulation.setting import Known, Outcome, Setting, Static

# what a scene does not say of its yarns is that of cotton: Y pi R^2 and EI with Y = 0.4 GPa and E = 0.8 GPa at R = 0.2 mm, a
# shear modulus 4 k_x/L of 40 N/m at L = 1 mm, a contact that gives by a tenth of R under 2 mN; no weight where there was none
COTTON: dict[str, Any] = {"k_s": 50.0, "k_b": 1e-9, "k_x": 0.01, "k_c": 1e5, "rho": 1e-4, "g": (0.0, 0.0, 0.0)}
ALL = ((stretch, segments), (bending, bends), (shear, shears), (parallel_contact, contacts), (gravity, segments))
ITERATIONS = 150  # of a stage, before it is given up
PATIENCE = 60.0  # times as long as the scene itself takes, but LEAST seconds at least, before the rest is given up
LEAST = 2.0


class _TooSlow(Exception):
    """Patience is at its end."""


def everything(setting: Setting, sliding: bool = True) -> Setting:
    """The same with all energies of a fabric, and with all sliding coordinates within yarns unknown if asked for."""
    own = {term.kernel.KERNEL.name for term in setting.terms}
    added = []
    for kernel, table in ALL:
        name = kernel.__name__.rsplit(".", 1)[-1]
        elements = table(setting.fabric, kernel)
        if name not in own:
            wanted = set(kernel.PARAMETERS) - set(elements.parameters)
            added.append(Term(kernel, elements, {key: COTTON[key] for key in wanted}, name))
    active = np.union1d(setting.active, setting.fabric.slides()) if sliding else setting.active
    options = dict(setting.options)
    if isinstance(setting, Static):
        options["iterations"] = min(ITERATIONS, options.get("iterations", ITERATIONS))
    return replace(setting, terms=[*setting.terms, *added], active=active, options=options)


def frugality(setting: Setting, size: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """What a scene costs, and what it would cost with everything: what is the same each time, and what was timed.

    Parameters
    ----------
    size
        Of the scene, for the record.
    """
    own, own_timed, ended = _spent(setting, float("inf"))
    found: dict[str, Any] = {"size": size, "own": {**own, "moved": []}}
    timed: dict[str, Any] = {"own": own_timed}
    patience = max(LEAST, PATIENCE * own_timed["seconds"])
    for name, sliding in (("all energies", False), ("all energies, all sliding", True)):
        other, timed[name], end = _spent(everything(setting, sliding), patience)
        moved = [] if ended is None or end is None else [_moved(known, ended, end) for known in setting.known]
        found[name] = {**other, "moved": moved}
    return found, timed


def _moved(known: Known, one: Outcome, other: Outcome) -> dict[str, Any]:
    """How far an answer moves, relative to its size; None where there is none any more."""
    try:
        first, second = (np.asarray(known.found(end), float) for end in (one, other))
    except ValueError:
        return {"name": known.name, "by": None}
    return {"name": known.name, "by": float(np.abs(first - second).max()) / known.size}


def _spent(setting: Setting, patience: float) -> tuple[dict[str, Any], dict[str, Any], Outcome | None]:
    begin, reached, trouble = process_time(), None, ""

    def wait(label: str) -> None:
        if process_time() - begin > patience:
            raise _TooSlow

    run = Run(setting, report=wait)
    try:
        for reached in run.go():
            wait(f"{reached.time}")
    except _TooSlow:
        trouble = f"given up after {PATIENCE:g} times the time of the scene"
    except (NotConverged, ElementError, LinearSolveError) as error:
        trouble = str(error).split(";")[0].split(": ")[0]
    seconds = process_time() - begin
    arrays: Mapping[str, Any] = {} if reached is None else reached.arrays()
    done = int(arrays.get("iterations", 0))
    system = run.system
    found = {
        "energies": {term.name: term.table.count for term in setting.terms},
        "unknowns": int(system.count),
        "entries": int(system.hessian(run.start).nnz),
        "iterations": done,
        "trouble": trouble,
    }
    timed = {"seconds": seconds, "seconds an iteration": seconds / done if done else None, "bytes": _memory(setting)}
    return found, timed, None if trouble or reached is None else run.outcome(arrays)


def _memory(setting: Setting) -> int:
    """Greatest memory of making the system, evaluating it and factorising its Hessian, bytes."""
    from yarnverify.simulation.newton import solver_for

    tracemalloc.start()
    try:
        run = Run(setting)
        matrix = run.system.evaluate(run.start, True).matrix
        with suppress(LinearSolveError):  # a singular one takes the same memory
            solver_for(run.system, matrix).factorise(matrix)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
