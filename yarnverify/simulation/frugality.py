"""What a scene saves by modelling no more than it needs: the same scene with everything switched on, beside it.

With all sliding coordinates many a scene has no answer. A yarn that nothing crosses slides through its nodes: where it is
straight that costs nothing, and where it is bent two nodes that draw together share a turn, each with the long segment beside
it, for half the energy. So the energy falls to the border of the domain, where segments have no length. The record says so by
the directions in which the energy falls, or does not change, at the scene's own answer.
"""

from __future__ import annotations

import tracemalloc
from contextlib import suppress
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np

from yarnverify.kernels import bending, gravity, parallel_contact, shear, stretch
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import bends, contacts, segments, shears
from yarnverify.simulation.linear import LinearSolveError
from yarnverify.simulation.outcome import UNSOLVED
from yarnverify.simulation.runs import Run
from yarnverify.simulation.setting import Known, Outcome, Setting, Static

# what a scene does not say of its yarns is that of cotton: Y pi R^2 with Y = 0.4 GPa and R = 0.2 mm, fibres that bend freely, a
# shear modulus 4 k_x/L of 40 N/m at L = 1 mm, a contact that gives by a tenth of R under 2 mN; no weight where there was none
COTTON: dict[str, Any] = {"k_s": 50.0, "k_b": 1e-9, "k_x": 0.01, "k_c": 1e5, "rho": 1e-4, "g": (0.0, 0.0, 0.0)}
ALL = ((stretch, segments), (bending, bends), (shear, shears), (parallel_contact, contacts), (gravity, segments))
ITERATIONS = 200  # of a problem at rest, before it is given up
FLAT = 1e-12  # curvature, of a Hessian of unit diagonal, that rounding may have made: a direction that costs nothing
DENSE = 2000  # unknowns up to which directions are counted


class _Enough(Exception):
    """So many iterations were made."""


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
    return replace(setting, terms=[*setting.terms, *added], active=active)


def frugality(setting: Setting, size: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """What a scene costs, and what it would cost with everything: what is the same each time, and what was timed.

    Parameters
    ----------
    size
        Of the scene, for the record.
    """
    own, own_timed, ended = _spent(setting)
    found: dict[str, Any] = {"size": size, "own": {**own, "moved": []}}
    timed: dict[str, Any] = {"own": own_timed}
    for name, sliding in (("all energies", False), ("all energies, all sliding", True)):
        whole = everything(setting, sliding)
        other, timed[name], end = _spent(whole, ITERATIONS)
        if end is None and ended is not None:
            other |= _directions(whole, ended)
            if isinstance(whole, Static):
                end = _ended(Run(replace(whole, start=ended.Q, stages=whole.stages[-1:])), ITERATIONS)[0]
        moved = [] if ended is None or end is None else [_moved(known, ended, end) for known in setting.known]
        found[name] = {**other, "moved": moved}
    return found, timed


def _directions(setting: Setting, own: Outcome) -> dict[str, Any]:
    """Of a scene's own answer: in how many directions its energy falls with everything, and in how many it stays."""
    system = Run(setting).system
    if system.count > DENSE:
        return {}
    matrix = system.hessian(own.Q).toarray()
    size = np.sqrt(np.abs(matrix.diagonal()))
    size[size == 0] = 1.0
    value = np.linalg.eigvalsh(matrix / size[:, None] / size)
    return {"falling": int((value < -FLAT).sum()), "flat": int((np.abs(value) <= FLAT).sum())}


def _moved(known: Known, one: Outcome, other: Outcome) -> dict[str, Any]:
    """How far an answer moves, relative to its size; None where there is none any more."""
    try:
        first, second = (np.asarray(known.found(end), float) for end in (one, other))
    except ValueError:
        return {"name": known.name, "by": None}
    return {"name": known.name, "by": float(np.abs(first - second).max() / known.size)}


def _ended(run: Run, iterations: float) -> tuple[Outcome | None, str, int]:
    """The end of a run, or what kept it from there; and how many iterations or steps were made."""
    reached, made = None, 0

    def count(label: str) -> None:
        nonlocal made
        made += 1
        if made > iterations:
            raise _Enough

    run.report = count
    trouble = ""
    try:
        for at in run.go():
            reached, made = at, made + run.moving
    except _Enough:
        made, trouble = made - 1, f"no equilibrium after {iterations} iterations"
    except UNSOLVED as error:
        trouble = str(error).split(";")[0].split(": ")[0]
    return None if trouble or reached is None else run.outcome(reached.arrays()), trouble, made


def _spent(setting: Setting, iterations: float = np.inf) -> tuple[dict[str, Any], dict[str, Any], Outcome | None]:
    run, begin = Run(setting), process_time()
    end, trouble, made = _ended(run, iterations)
    seconds = process_time() - begin
    found = {
        "energies": {term.name: term.table.count for term in setting.terms},
        "unknowns": int(run.system.count),
        "entries": int(run.system.hessian(run.start).nnz),
        "iterations": made,
        "trouble": trouble,
    }
    timed = {"seconds": seconds, "seconds an iteration": seconds / made if made else None, "bytes": _memory(setting)}
    return found, timed, end


def _memory(setting: Setting) -> int:
    """Greatest memory of making the system, evaluating it and factorising its Hessian, bytes."""
    tracemalloc.start()
    try:
        run = Run(setting)
        matrix = run.system.evaluate(run.start, True).matrix
        with suppress(LinearSolveError):  # a singular one takes the same memory
            run.system.direct.factorise(matrix)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
