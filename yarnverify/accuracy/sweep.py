"""All cells: planned, run by any executor, each kept as soon as it is done, and put together in the plan's order."""

from __future__ import annotations

import importlib.metadata
import json
import multiprocessing
import re
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from yarnverify.accuracy.cells import Unit, declared_energy, has_kernel, run_unit
from yarnverify.accuracy.regimes import curves, not_drawn, regimes
from yarnverify.errors import InputError, NotRunError
from yarnverify.files import write_text
from yarnverify.library import cache_folder, derivations, fingerprint
from yarnverify.symbolic.declare import load_declarations

VARIANTS = ("printed", "differentiated", "fast", "accurate", "reference")
COMPARED = ("printed", "differentiated")  # there only where a document prints the energy
DTYPES = ("float64", "float32")
SEED = 20140


@dataclass(frozen=True)
class Profile:
    """How much is tried: states in a cell, orientations on a curve, and whether every condition is worked out."""

    name: str
    count: int
    orientations: int
    everywhere: bool


PROFILES = {"quick": Profile("quick", 100, 6, False), "full": Profile("full", 2000, 24, True)}


def plan(
    profile: Profile,
    energies: Sequence[str] = (),
    variants: Sequence[str] = (),
    folder: Path | None = None,
    seed: int = SEED,
) -> tuple[list[Unit], list[str]]:
    """The units of a sweep, and what cannot be run.

    Parameters
    ----------
    profile
        How much.
    energies, variants
        Names; all that have kernels by default.
    folder
        Of derivations; those of the package by default.
    seed
        Of all states.

    Raises
    ------
    InputError
        For a name that is not there.
    """
    where = "" if folder is None else str(folder)
    folder = folder or derivations()
    names = [energy.name for energy in load_declarations(folder).energies if not not_drawn(energy)]
    for name in energies:
        declared_energy(name, folder)
    for variant in variants:
        if variant not in VARIANTS:
            raise InputError(f"{variant}: no such variant; there are {', '.join(VARIANTS)}")
    units, missing = [], []
    for name in energies or names:
        energy = declared_energy(name, folder)
        reason = not_drawn(energy)
        if reason:
            missing.append(f"{name}: {reason}")
            continue
        there = [variant for variant in variants or VARIANTS if has_kernel(variant, name, where)]
        wanted = variants or [variant for variant in VARIANTS if energy.document or variant not in COMPARED]
        missing += [f"{variant} {name}: there is no such kernel" for variant in wanted if variant not in there]
        if not there:
            continue
        for dtype in DTYPES:
            # the reference carries pairs of doubles; it has no other type
            able = tuple(variant for variant in there if dtype == "float64" or variant != "reference")
            if not able:
                continue
            for regime in regimes(energy):
                units.append(Unit(name, dtype, regime.name, able, profile.count, seed, profile.everywhere, where))
        for towards in curves(energy):
            units.append(
                Unit(name, "float64", towards, tuple(there), profile.orientations, seed, False, where, "curve")
            )
    return units, missing


@contextmanager
def executor_named(text: str, jobs: int | None = None) -> Iterator[Executor | None]:
    """An executor by name: ``serial`` (None), ``processes``, or ``dask:ADDRESS``.

    Raises
    ------
    InputError
        For a name of none of these forms.
    NotRunError
        Where dask.distributed is not installed, or nothing answers at the address.
    """
    if text == "serial":
        yield None
    elif text == "processes":
        # started afresh, not forked: a fork copies the threads of a progress bar half-way
        fresh = multiprocessing.get_context("spawn")
        ignored = (signal.SIGINT, signal.SIG_IGN)  # an interruption is the parent's to handle
        with ProcessPoolExecutor(jobs, fresh, signal.signal, ignored) as pool:
            yield pool
    elif text.startswith("dask:") and len(text) > len("dask:"):
        try:
            from distributed import Client
        except ImportError:
            raise NotRunError(f'--executor {text}: needs dask.distributed: pip install "yarnverify[cluster]"') from None
        try:
            client = Client(text.removeprefix("dask:"), timeout=10)
        except (OSError, ValueError, TimeoutError) as error:
            raise NotRunError(f"--executor {text}: {error or 'nothing answers there'}") from None
        with client, client.get_executor() as pool:
            yield pool
    else:
        raise InputError(f"--executor {text}: give serial, processes, or dask:ADDRESS")


def run(
    units: Sequence[Unit],
    executor: Executor | None = None,
    state: Path | None = None,
    advance: Callable[[str, int], None] = lambda label, total: None,
    work: Callable[[Unit], dict[str, Any]] = run_unit,
) -> list[dict[str, Any]]:
    """Results of all units, in their order; those that an interrupted run left behind are not worked out again.

    Parameters
    ----------
    units
        What to do.
    executor
        Where; here and one by one if None.
    state
        Folder in which each result is kept as soon as there is one; removed by ``finish``.
    advance
        Called as each unit is done.
    work
        What is done with a unit.
    """
    results: dict[int, dict[str, Any]] = {}
    left = []
    for at, unit in enumerate(units):
        known = None if state is None else _recall(state, unit)
        if known is None:
            left.append(at)
        else:
            results[at] = known
            advance(unit.name, len(units))

    def done(at: int, result: dict[str, Any]) -> None:
        if state is not None:
            _remember(state, units[at], result)
        results[at] = result
        advance(units[at].name, len(units))

    if executor is None:
        for at in left:
            done(at, work(units[at]))
    else:
        futures = {executor.submit(work, units[at]): at for at in left}
        try:
            for future in as_completed(futures):
                done(futures[future], future.result())
        except BaseException:
            for future in futures:
                future.cancel()
            raise
    return [results[at] for at in range(len(units))]


def state_folder(units: Sequence[Unit]) -> Path:
    """Where a sweep keeps what is done: another place for another plan, other kernels, other code or other libraries."""
    package = Path(__file__).parent.parent
    code = sorted([*(package / "kernels").rglob("*.py"), *(package / "accuracy").glob("*.py")])
    folder = Path(units[0].derivations or derivations())
    declared = sorted([*folder.glob("*.py"), *(folder / "kernels").rglob("*.py")])
    plan_text = json.dumps([asdict(unit) for unit in units]) + importlib.metadata.version("numpy")
    return cache_folder() / f"accuracy-{fingerprint([plan_text.encode(), *code, *declared])[:24]}"


def finish(state: Path) -> None:
    """Remove what an interrupted run would have gone on from."""
    for path in state.glob("*.json"):
        path.unlink(missing_ok=True)
    if state.is_dir() and not any(state.iterdir()):
        state.rmdir()


def _place(state: Path, unit: Unit) -> Path:
    return state / (re.sub(r"[^a-z0-9]+", "-", f"{unit.kind} {unit.name}".lower()) + ".json")


def _recall(state: Path, unit: Unit) -> dict[str, Any] | None:
    try:
        kept = json.loads(_place(state, unit).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    same = isinstance(kept, dict) and kept.get("unit") == json.loads(json.dumps(asdict(unit)))
    return kept["result"] if same else None


def _remember(state: Path, unit: Unit, result: dict[str, Any]) -> None:
    path = _place(state, unit)
    write_text(json.dumps({"unit": asdict(unit), "result": result}), path)
