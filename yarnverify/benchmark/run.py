"""``yarnverify benchmark``: one record of speed and accuracy, all measured in one process."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from yarnverify.accuracy.cells import has_kernel
from yarnverify.benchmark.contestants import Contestant, contestants, failure
from yarnverify.benchmark.inputs import STATES, Inputs, timed_states
from yarnverify.benchmark.peers import PEERS
from yarnverify.benchmark.timing import Clock, Spread, paired, speedups, spread, warm
from yarnverify.benchmark.ways import Way, degrees_of_freedom, outputs_bytes
from yarnverify.errors import InputError, NotRunError
from yarnverify.machine import environment
from yarnverify.project import Project, project
from yarnverify.symbolic.declare import Energy, load_declarations

SIZES = (1, 10, 100, 1000, 10_000, 100_000, 1_000_000)
ROUNDS = 7
LONG, LONG_ROUNDS = 1_000_000, 3  # a round at this size takes tens of seconds
TUNED_AT = 100_000
MOST_BYTES = 4 * 10**9
MOST_SECONDS = 5.0  # a call; what would take longer is measured at smaller sizes alone
BASELINES = ("jax as written", "jax", "lambdify")
FLOOR = "memory floor"
Advance = Callable[[str, int], None]


def benchmark(
    energy: str | None = None,
    sizes: Sequence[int] = SIZES,
    peers: Sequence[str] = PEERS,
    threads: int = 1,
    rounds: int = ROUNDS,
    advance: Advance = lambda label, total: None,
    points: int = 32,
    of: Project | None = None,
) -> dict[str, Any]:
    """Measure one declared energy or all.

    Parameters
    ----------
    energy
        Its name; None for all of a folder of your own, or those of the package's document.
    sizes
        Batch sizes, elements.
    peers
        Whom to measure beside the kernels.
    threads
        For the kernels; the process is held to so many processors.
    rounds
        Paired repetitions.
    advance
        Called as each step is done.
    points
        States of each kind on which errors are taken.
    of
        Whose energies; those of the package by default.

    Returns
    -------
    dict
        What the tables and pictures of ``yarnverify.report`` are made from.

    Raises
    ------
    InputError
        For an unknown energy or peer, and numbers out of range.
    """
    of = of or project()
    declared = load_declarations(of.folder).energies
    chosen = [each for each in declared if each.name == energy or (energy is None and (of.own or each.document))]
    if not chosen:
        raise InputError(f"{energy}: no such energy; there are {', '.join(each.name for each in declared)}")
    folder = of.folder if of.own else None
    if folder is not None and not any(has_kernel("fast", each.name, folder) for each in chosen):
        raise NotRunError(f"{of.name}: has no kernels of these; they are made by: {of.here('yarnverify generate')}")
    _check(sizes, peers, threads, rounds)
    sizes = sorted(set(sizes))
    # one thread waits for nobody, so that its processor time is its wall time less what other programs took
    clock = time.process_time if threads == 1 else time.perf_counter
    with pinned(threads) as processors:
        found = {
            each.name: _measure(each, sizes, peers, threads, rounds, points, clock, advance, len(chosen), folder)
            for each in chosen
        }
    packages = sorted({package for each in found.values() for package in each.pop("packages")})
    return {
        "schema": 1,
        "command": _command(of.prefix + energy if energy else of.name, sizes, peers, threads, rounds),
        "environment": environment(packages, processors),
        "threads": threads,
        "clock": "wall time" if clock is time.perf_counter else "processor time",
        "rounds": rounds,
        "energies": found,
    }


def _check(sizes: Sequence[int], peers: Sequence[str], threads: int, rounds: int) -> None:
    for peer in peers:
        if peer not in PEERS:
            raise InputError(f"{peer}: no such peer; there are {', '.join(PEERS)}")
    if not sizes or min(sizes) < 1:
        raise InputError(f"sizes must be at least 1, not {', '.join(map(str, sizes)) or 'none'}")
    if threads < 1:
        raise InputError(f"threads must be at least 1, not {threads}")
    if rounds < 1:
        raise InputError(f"rounds must be at least 1, not {rounds}")


def _command(energy: str, sizes: Sequence[int], peers: Sequence[str], threads: int, rounds: int) -> str:
    parts = ["yarnverify benchmark", *([energy] if energy else [])]
    if tuple(sizes) != SIZES:
        parts.append(f"--sizes {' '.join(map(str, sizes))}")
    if tuple(peers) != PEERS:
        parts.append(f"--peers {' '.join(peers) or 'none'}")
    if threads != 1:
        parts.append(f"--threads {threads}")
    if rounds != ROUNDS:
        parts.append(f"--rounds {rounds}")
    return " ".join(parts)


@contextmanager
def pinned(threads: int) -> Iterator[int | None]:
    """Hold this thread, and those it starts, to so many processors; gives their number, None where that cannot be done."""
    if not hasattr(os, "sched_setaffinity"):
        yield None
        return
    before = os.sched_getaffinity(0)
    chosen = sorted(before)[-threads:]  # the last ones: interrupts mostly go to the first
    os.sched_setaffinity(0, chosen)
    try:
        yield len(chosen)
    finally:
        os.sched_setaffinity(0, before)


def _measure(
    energy: Energy,
    sizes: Sequence[int],
    peers: Sequence[str],
    threads: int,
    rounds: int,
    points: int,
    clock: Clock,
    advance: Advance,
    energies: int,
    folder: Path | None,
) -> dict[str, Any]:
    from yarnverify.benchmark.errors import errors_of

    able, missing = contestants(energy, peers, threads, folder)
    steps = energies * (len(able) + len(missing) + len(STATES) * len(sizes) + 1)
    tuned = timed_states(energy, STATES[0], min(max(sizes), TUNED_AT))
    chosen: dict[str, Way] = {}
    for name, reason in missing.items():
        advance(f"{energy.name}: {name} not run: {reason}", steps)
    for contestant in able:
        way = _fastest(contestant, tuned, clock)
        advance(f"{energy.name}: {contestant.name} prepared", steps)
        if isinstance(way, str):
            missing[contestant.name] = way
        else:
            chosen[contestant.name] = way
    states: dict[str, list[dict[str, Any]]] = {}
    for state in STATES:
        inputs = timed_states(energy, state, max(sizes))
        states[state] = []
        pace: dict[str, float] = {}
        for n in sizes:
            few = min(rounds, LONG_ROUNDS) if n >= LONG else rounds
            slow = {name: seconds * n for name, seconds in pace.items() if seconds * n > MOST_SECONDS}
            states[state].append(_timed(chosen, inputs.first(n), few, clock, slow))
            pace |= {name: ns[0] / 1e9 for name, ns in states[state][-1]["ns"].items()}
            advance(f"{energy.name}: {n} elements, {state}", steps)
    errors = errors_of(energy, chosen, points)
    advance(f"{energy.name}: errors", steps)
    return {
        "dof": degrees_of_freedom(energy),
        "bytes": outputs_bytes(degrees_of_freedom(energy)),
        "contestants": {
            each.name: {
                "kind": each.kind,
                "how": chosen[each.name].how,
                "hessian": chosen[each.name].hessian,
                "layout": chosen[each.name].layout,
            }
            for each in able
            if each.name in chosen
        },
        "not_run": missing,
        "states": states,
        "errors": errors,
        "packages": [package for each in able if each.name in chosen for package in each.packages],
    }


def _fastest(contestant: Contestant, inputs: Inputs, clock: Clock) -> Way | str:
    """The way with the least median time, or why there is none."""
    n = inputs.q.shape[1]
    calls, reason = {}, ""
    ways = {way.how: way for way in contestant.ways}
    for how, way in ways.items():
        if way.bytes_at(n) > MOST_BYTES:
            reason = _too_large(way.bytes_at(n))
        else:
            calls[how] = _call(way, inputs)
    for how, error in warm(calls).items():
        reason = failure(error)
        del calls[how]
    if not calls:
        return reason
    if len(contestant.ways) == 1:
        return contestant.ways[0]
    times = paired(calls, 3, clock)
    best = min(times, key=lambda how: spread(times[how]).median)
    return replace(ways[best], how=f"{best}; fastest of {len(calls)} ways")


def _too_large(needed: int) -> str:
    return f"needs {needed / 1e9:.1f} GB, more than {MOST_BYTES / 1e9:.0f}"


def _call(way: Way, inputs: Inputs) -> Callable[[], object]:
    return lambda: way.run(inputs.q, inputs.parameters)


def _timed(
    ways: dict[str, Way], inputs: Inputs, rounds: int, clock: Clock, slow: Mapping[str, float] = MappingProxyType({})
) -> dict[str, Any]:
    """Times at one batch size, in nanoseconds per element, and how many times as fast as each baseline.

    ``slow`` holds the seconds that a call would take of those that are too slow for this size.
    """
    n = inputs.q.shape[1]
    left_out: dict[str, str] = {}
    calls: dict[str, Callable[[], object]] = {}
    for name, way in ways.items():
        needed = way.bytes_at(n)
        if name in slow:
            left_out[name] = f"would take {slow[name]:.0f} s a call, more than {MOST_SECONDS:.0f}"
        elif needed > MOST_BYTES:
            left_out[name] = _too_large(needed)
        else:
            calls[name] = _call(way, inputs)
    calls[FLOOR] = _floor(n * outputs_bytes(inputs.q.shape[0]))
    with np.errstate(all="ignore"):
        for name, error in warm(calls).items():
            left_out[name] = failure(error)
            del calls[name]
        times = paired(calls, rounds, clock)
    scale = 1e9 / n
    return {
        "n": n,
        "rounds": rounds,
        "ns": {name: _rounded(spread([scale * value for value in own])) for name, own in times.items()},
        "times as fast as": {
            base: {name: _rounded(value) for name, value in speedups(times, base).items() if name != FLOOR}
            for base in BASELINES
            if base in times
        },
        "times the floor": {
            name: _rounded(spread([own / floor for own, floor in zip(times[name], times[FLOOR], strict=True)]))
            for name in times
            if name != FLOOR
        },
        "not_run": left_out,
    }


def _floor(total: int) -> Callable[[], object]:
    """Moving as many bytes as must be read and written, half each: a copy between arrays that are there already."""
    source = np.zeros(total // 16)
    target = np.zeros_like(source)
    return lambda: np.copyto(target, source)


def _rounded(value: Spread) -> list[float]:
    return [float(f"{part:.4g}") for part in (value.median, value.least, value.most)]
