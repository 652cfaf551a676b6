"""Paired repetitions: every round times every contestant once, so that a busy moment of the machine hits all of them.

A ratio is taken within each round and then summarised; the quotient of two medians would pair times of different moments.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from time import perf_counter

LEAST_SECONDS = 0.002  # shorter measurements are repeated and averaged, so that the clock's own cost is below 0.1 %

Clock = Callable[[], float]
Call = Callable[[], object]


@dataclass(frozen=True)
class Spread:
    """Median, least and most of some numbers."""

    median: float
    least: float
    most: float


def spread(values: Sequence[float]) -> Spread:
    """Summary of at least one number."""
    return Spread(median(values), min(values), max(values))


def warm(calls: Mapping[str, Call]) -> dict[str, Exception]:
    """Call everybody once, so that compilers and caches are done; gives those that fail, and how."""
    failed = {}
    for name, call in calls.items():
        try:
            call()
        except Exception as error:  # a contestant's own failure is its result
            failed[name] = error
    return failed


def paired(
    calls: Mapping[str, Call], rounds: int, clock: Clock = perf_counter, least: float = LEAST_SECONDS
) -> dict[str, list[float]]:
    """Seconds per call of each contestant, one number a round.

    Parameters
    ----------
    calls
        Contestants, warm already (see ``warm``); each is called once more to find out how often to repeat.
    rounds
        How often all are measured; who goes first changes from round to round.
    clock
        Gives seconds.
    least
        A measurement repeats its call until it lasts about so long.
    """
    names = list(calls)
    repeats = {}
    for name in names:
        once = _timed(calls[name], 1, clock)
        repeats[name] = max(1, math.ceil(least / max(once, least / 1000)))
    times: dict[str, list[float]] = {name: [] for name in names}
    collecting = gc.isenabled()
    gc.disable()
    try:
        for number in range(rounds):
            first = number % max(len(names), 1)
            for name in names[first:] + names[:first]:
                times[name].append(_timed(calls[name], repeats[name], clock))
    finally:
        if collecting:
            gc.enable()
    return times


def _timed(call: Call, repeats: int, clock: Clock) -> float:
    start = clock()
    for _ in range(repeats):
        call()
    return (clock() - start) / repeats


def speedups(times: Mapping[str, Sequence[float]], baseline: str) -> dict[str, Spread]:
    """How many times as fast as a baseline each contestant is, from the ratios within each round."""
    slow = times[baseline]
    return {
        name: spread([base / own for base, own in zip(slow, own_times, strict=True)])
        for name, own_times in times.items()
    }
