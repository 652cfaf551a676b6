"""A random search that steers towards large errors, and shrinks what it finds, within a time budget."""

from __future__ import annotations

import math
import signal
import threading
import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event
from traceback import walk_stack
from typing import Any

from hypothesis import HealthCheck, Phase, Verbosity, given, seed, settings, target

from yarnverify.accuracy.cells import kernel
from yarnverify.errors import InputError
from yarnverify.fuzzing.judge import Flaw, Judgement, Limit, declared, judge, limit_of
from yarnverify.fuzzing.labels import labels
from yarnverify.kernels import VARIANTS
from yarnverify.strategies import Element, elements
from yarnverify.symbolic.declare import Energy

ENERGIES = ("stretch", "bending", "shear", "parallel_contact")
_ROUND = 500  # elements that Hypothesis draws before it starts afresh with the next seed
_SHRINKING = 1500  # elements that are tried to make a found case plainer


@dataclass(frozen=True)
class Case:
    """A flaw and the plainest element that shows it."""

    flaw: Flaw
    element: Element

    @property
    def line(self) -> str:
        """Ready to be pasted above a test; ``element`` is ``yarnverify.strategies.element``."""
        return f"@example({self.element!r})  # {self.flaw.text}"


@dataclass(frozen=True)
class Search:
    """What a search of one kernel has tried and found.

    Attributes
    ----------
    energy, variant, seed
        What was searched, and the seed that draws the same elements again.
    limit, promise
        What errors were held to, and whether the kernel promises that: ``none`` if not.
    cases, regimes
        Number of elements, and of those in each regime; an element may be in several.
    worst, worst_element
        Largest error as a multiple of its limit, and where.
    found
        One case for each kind of flaw and output.
    interrupted
        Whether somebody ended it before its time.
    """

    energy: str
    variant: str
    seed: int
    limit: Limit
    promise: str
    cases: int
    regimes: dict[str, int]
    worst: float
    worst_element: Element | None
    found: tuple[Case, ...]
    interrupted: bool = False

    def record(self) -> dict[str, Any]:
        """The search as plain data."""
        return {
            "energy": self.energy,
            "variant": self.variant,
            "seed": self.seed,
            "cases": self.cases,
            "regimes": self.regimes,
            "worst": {"of_limit": self.worst, "element": repr(self.worst_element)} if self.worst_element else None,
            "found": [
                {"kind": c.flaw.kind, "where": c.flaw.where, "text": c.flaw.text, "line": c.line} for c in self.found
            ],
        }


class _FoundError(Exception):
    """Tells Hypothesis that an element shows the flaw that is being shrunk."""


class _Stop(BaseException):
    """The time is up. Passes through Hypothesis, which catches errors."""


class _Shrunk(BaseException):
    """An element is as plain as it will get in the number of attempts that it is worth."""


@dataclass
class _Progress:
    """What is known so far; kept when the time runs out in the middle of anything."""

    module: Any
    energy: Energy
    deadline: float
    most: float
    advance: Callable[[str, int], None]
    cases: int = 0
    regimes: Counter[str] = field(default_factory=Counter)
    worst: float = 0.0
    worst_element: Element | None = None
    best: dict[tuple[str, str], Case] = field(default_factory=dict)
    finished: set[tuple[str, str]] = field(default_factory=set)

    def judge(self, element: Element) -> Judgement:
        if time.monotonic() > self.deadline or self.cases >= self.most:
            raise _Stop
        judgement = judge(self.module, self.energy, element)
        self.cases += 1
        self.regimes.update(labels(self.module.DOFS, element))
        if math.isfinite(judgement.worst) and judgement.worst > self.worst:
            self.worst, self.worst_element = judgement.worst, element
        for flaw in judgement.flaws:
            known = self.best.get(_key(flaw))
            if known is None or _plainness(element) < _plainness(known.element):
                self.best[_key(flaw)] = Case(flaw, element)
        self.advance(f"{self.energy.name}: {self.cases} cases, {len(self.best)} found", 0)
        return judgement


def _key(flaw: Flaw) -> tuple[str, str]:
    """Flaws of one kind in one output are taken for one."""
    return flaw.kind, flaw.where.split()[0]


def _plainness(element: Element) -> tuple[int, str]:
    text = repr(element)
    return len(text), text


def search(
    energy: str,
    variant: str,
    seconds: float,
    seed_: int,
    advance: Callable[[str, int], None] = lambda label, total: None,
    most: float = math.inf,
    folder: Path | None = None,
) -> Search:
    """Look for elements at which a kernel breaks its promises.

    Parameters
    ----------
    energy, variant
        Which kernel.
    seconds
        Time for all of it, shrinking included; what was found until then is kept, as it is on an interrupt.
    seed_
        Of the elements; the same seed draws the same ones, as far as the time allows.
    advance
        Told after each element.
    most
        Largest number of elements.
    folder
        Of your own derivations, with the kernels that were generated for them.

    Raises
    ------
    InputError
        For a name that is no energy or no variant, or has no kernel.
    """
    declaration, module = declared(energy, folder), _kernel(energy, variant, folder)
    progress = _Progress(module, declaration, time.monotonic() + seconds, most, advance)
    interrupted, rung = False, Event()
    try:
        with _alarm(seconds + 1, rung):
            for number in range(2**31):
                _round(progress, seed_ + number)
    except _Stop:
        pass
    except Exception:
        if not rung.is_set():  # stopped in the middle of something of its own, Hypothesis may say something else
            raise
    except KeyboardInterrupt:
        interrupted = True
    return Search(
        energy,
        variant,
        seed_,
        limit_of(module),
        module.KERNEL.promise,
        progress.cases,
        dict(progress.regimes.most_common()),
        progress.worst,
        progress.worst_element,
        tuple(progress.best[key] for key in sorted(progress.best)),
        interrupted,
    )


@contextmanager
def _alarm(seconds: float, rung: Event) -> Iterator[None]:
    """Stop even where Hypothesis has been busy with itself, and has drawn no element, for long; where there are alarms."""
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def ring(number: int, frame: Any) -> None:
        rung.set()
        # of an error within the callback by which Hypothesis times the collector, Python prints a trace
        if all(caller.f_code.co_name != "gc_callback" for caller, _ in walk_stack(frame)):
            raise _Stop

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds, 1.0)  # again: a stop within a callback is lost
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _kernel(energy: str, variant: str, folder: Path | None = None) -> Any:
    if variant not in VARIANTS:
        raise InputError(f"there is no variant {variant!r}; one of {', '.join(VARIANTS)}")
    return kernel(variant, energy, folder or "")


def _round(progress: _Progress, number: int) -> None:
    """Draw elements until a new flaw is found and shrunk, or there is none among them."""
    wanted: set[tuple[str, str]] = set()
    tried = 0

    @seed(number)
    @settings(
        max_examples=_ROUND,
        database=None,
        derandomize=False,
        deadline=None,
        phases=(Phase.generate, Phase.target, Phase.shrink),
        suppress_health_check=list(HealthCheck),
        report_multiple_bugs=False,
        verbosity=Verbosity.quiet,
    )
    @given(elements(progress.module, units={p.label: p.unit for p in progress.energy.parameters}))
    def law(element: Element) -> None:
        nonlocal tried
        judgement = progress.judge(element)
        if wanted:
            tried += 1
            if tried > _SHRINKING:
                raise _Shrunk
        else:
            if 0 < judgement.worst < math.inf:
                # Hypothesis moves among equal scores without end, and errors are equal under changes of scale.
                target(math.log2(judgement.worst) + zlib.crc32(repr(element).encode()) * 2.0**-52)
            wanted.update({_key(flaw) for flaw in judgement.flaws} - progress.finished)
        if wanted & {_key(flaw) for flaw in judgement.flaws}:
            raise _FoundError

    try:
        law()
    except (_FoundError, _Shrunk):
        progress.finished |= wanted
