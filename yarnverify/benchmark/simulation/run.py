"""``yarnverify benchmark simulation``: one record, all measured in one process but for memory."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from math import isfinite, log
from typing import Any

from yarnverify.benchmark.contestants import failure
from yarnverify.benchmark.run import pinned
from yarnverify.benchmark.simulation.cantilever import SEGMENTS, Solve, least, ours
from yarnverify.benchmark.simulation.cloth import PARTS, SOLVERS, Cloth, copying
from yarnverify.benchmark.simulation.memory import peak
from yarnverify.benchmark.simulation.peers import PEERS
from yarnverify.benchmark.timing import Clock, paired, spread
from yarnverify.errors import InputError, NotRunError
from yarnverify.machine import environment
from yarnverify.simulation.linear.threads import one_thread

SIZES = (100, 1_000, 10_000, 100_000)
ROUNDS = 5
ALPHA = 1.0
GOALS = {1e-3: PEERS, 1e-4: ("jax",)}
OWN = ("yarnverify, compiled", "yarnverify, NumPy")
Advance = Callable[[str, int], None]


def benchmark_simulation(
    sizes: Sequence[int] = SIZES,
    peers: Sequence[str] = PEERS,
    rounds: int = ROUNDS,
    advance: Advance = lambda label, total: None,
) -> dict[str, Any]:
    """Measure an iteration on cloth, the memory it takes, and the cantilever.

    Parameters
    ----------
    sizes
        Crossings of the cloths, each made a square of about so many; (k,).
    peers
        Whom to measure beside these simulations.
    rounds
        Repetitions.
    advance
        Called as each step is done.

    Returns
    -------
    dict
        What the tables and pictures of ``yarnverify.report`` are made from. Times in seconds of processor time.

    Raises
    ------
    InputError
        For an unknown peer, and numbers out of range.
    """
    for peer in peers:
        if peer not in PEERS:
            raise InputError(f"{peer}: no such peer of the simulation; there are {', '.join(PEERS)}")
    if not sizes or min(sizes) < 9:
        raise InputError(f"sizes are numbers of crossings, at least 9, not {', '.join(map(str, sizes)) or 'none'}")
    if rounds < 1:
        raise InputError(f"rounds must be at least 1, not {rounds}")
    sides = sorted({round(n**0.5) for n in sizes})
    steps = len(sides) * len(SOLVERS) + (len(OWN) + len(peers)) * len(GOALS)
    with pinned(1) as processors, one_thread():
        cantilever = {
            f"{goal:g}": _cantilever(
                goal, [p for p in peers if p in allowed], rounds, lambda label: advance(label, steps)
            )
            for goal, allowed in GOALS.items()
        }
        cloth = {solver: _cloths(sides, solver, rounds, lambda label: advance(label, steps)) for solver in SOLVERS}
    packages = {name for found in cantilever.values() for name in found.pop("packages")}
    return {
        "schema": 1,
        "command": _command(sizes, peers, rounds),
        "environment": environment(sorted({"scipy", *packages}), processors),
        "clock": "processor time",
        "rounds": rounds,
        "cloth": cloth,
        "growth": {solver: _growth(found) for solver, found in cloth.items()},
        "cantilever": {"alpha": ALPHA, "goals": cantilever},
    }


def _command(sizes: Sequence[int], peers: Sequence[str], rounds: int) -> str:
    parts = ["yarnverify benchmark simulation"]
    if tuple(sizes) != SIZES:
        parts.append(f"--sizes {' '.join(map(str, sizes))}")
    if tuple(peers) != PEERS:
        parts.append(f"--peers {' '.join(peers) or 'none'}")
    if rounds != ROUNDS:
        parts.append(f"--rounds {rounds}")
    return " ".join(parts)


# -- cloth


def _cloths(sides: Sequence[int], solver: str, rounds: int, advance: Callable[[str], None]) -> list[dict[str, Any]]:
    """Seconds of an iteration by part, shares of the memory floor, and memory, for cloths of some sizes.

    A round takes every size once: a machine that becomes slower does so for all of them, and growth is not made of it.
    """
    cloths = [Cloth.made(side, solver) for side in sides]
    for cloth in cloths:
        cloth.step(1)
    found = [[cloth.step(1) for cloth in cloths] for _ in range(rounds)]
    records = [_record(cloth, steps) for cloth, steps in zip(cloths, zip(*found, strict=True), strict=True)]
    del cloth, cloths
    for side, record in zip(sides, records, strict=True):
        try:
            record["bytes"] = round(peak(side, solver))
        except NotRunError as reason:
            record["bytes"], record["bytes not known"] = None, str(reason)
        advance(f"cloth of {side} x {side}, {solver}")
    return records


def _record(cloth: Cloth, steps: Sequence[dict[str, float]]) -> dict[str, Any]:
    """The least of some steps, by part."""
    best = {name: min(each[name] for each in steps) for name in (*PARTS, "iteration")}
    bandwidth = {name: min(paired({"copy": copying(size)}, 3, time.process_time)["copy"])
                 for name, size in cloth.floors().items()}  # fmt: skip
    system = cloth.dynamics.system
    return {
        "crossings": cloth.side**2,
        "unknowns": system.count,
        "elements": sum(term.table.count for term in system.terms),
        "engine": system.engine,
        "inner": round(steps[0]["inner"], 1),
        "seconds": {name: _short(value) for name, value in best.items()},
        "floor": {name: _short(value) for name, value in bandwidth.items()},
    }


def _growth(found: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Exponents of growth from each size to the next."""
    lines = []
    for one, two in pairwise(found):
        scale = log(two["crossings"] / one["crossings"])
        a = one["seconds"] | {"linear solve": one["seconds"]["factorise"] + one["seconds"]["solve"]}
        b = two["seconds"] | {"linear solve": two["seconds"]["factorise"] + two["seconds"]["solve"]}
        exponents = {name: round(log(b[name] / a[name]) / scale, 2) for name in a if a[name] > 0 and b[name] > 0}
        lines.append({"from": one["crossings"], "to": two["crossings"], "exponents": exponents})
    return lines


# -- cantilever


def _cantilever(goal: float, peers: Sequence[str], rounds: int, advance: Callable[[str], None]) -> dict[str, Any]:
    """The least number of segments, the time of the first run and of the others, and ratios within each round."""
    solves: dict[str, Solve] = {}
    lines: dict[str, dict[str, Any]] = {}
    missing: dict[str, str] = {}
    packages: list[str] = []
    for name in (*OWN, *peers):
        try:
            make, own, tried = _maker(name, goal)
            start = time.perf_counter()
            make(4).run()
            first = time.perf_counter() - start
            found = least(make, ALPHA, goal, tried)
        except ImportError as reason:
            missing[name] = f"{reason.name or reason} is not installed"
        except NotRunError as reason:
            missing[name] = str(reason)
        except Exception as reason:  # a peer's own failure is its result here
            missing[name] = failure(reason)
        else:
            packages += own
            if found is None:
                missing[name] = f"comes to no error of {goal:g}"
            else:
                n, solves[name], reached = found
                lines[name] = {"segments": n, "error": _short(reached), "how": solves[name].how, "first": _short(first)}
        advance(f"cantilever to {goal:g}: {name}")
    clock: Clock = time.process_time
    times = paired({name: solve.run for name, solve in solves.items()}, rounds, clock, least=0.01)
    for name, own_times in times.items():
        lines[name]["seconds"] = [_short(value) for value in _three(own_times)]
    base = next((name for name in OWN if name in times), None)
    if base is not None:
        ratios = {
            name: spread([own / fast for own, fast in zip(times[name], times[base], strict=True)]) for name in times
        }
        for name, ratio in ratios.items():
            lines[name][f"times {base}"] = [_short(value) for value in (ratio.median, ratio.least, ratio.most)]
    return {"lines": lines, "not_run": missing, "packages": packages}


def _maker(name: str, goal: float) -> tuple[Callable[[int], Solve], Sequence[str], Sequence[int]]:
    if name in OWN:
        engine = "numpy" if name.endswith("NumPy") else "compiled"
        if engine == "compiled":
            importlib.import_module("numba")
        return lambda n: ours(n, ALPHA, engine), ["numba"] if engine == "compiled" else [], SEGMENTS
    module = importlib.import_module(f"yarnverify.benchmark.simulation.peers.{name}")
    return lambda n: module.make(n, ALPHA, goal), module.PACKAGES, getattr(module, "SEGMENTS", SEGMENTS)


def _three(values: Sequence[float]) -> tuple[float, float, float]:
    found = spread(values)
    return found.median, found.least, found.most


def _short(value: float) -> float:
    return float(f"{value:.4g}") if isfinite(value) else value
