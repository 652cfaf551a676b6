"""Runs somebody's code in another process, so that its crash or its endless loop is a finding and not ours."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.arrays import npz
from yarnverify.check.child import BEGUN, DONE
from yarnverify.errors import InputError, NotRunError

Array = NDArray[Any]
MOST_ENDED = 3  # states that end the process, after which the rest is left
_FIRST = 6  # times the limit: the first call may compile something
_STARTS_WITHIN = 120.0  # seconds: what a large library may take to import


@dataclass
class Ran:
    """What came of running a target.

    Attributes
    ----------
    flat
        (n, total) all outputs of each state, NaN where there are none.
    done
        (n,) bool.
    decided
        How the code was called: layout, returns, dtype; None where no call came back.
    troubles
        State to what happened there: a crash, a hang, an exception, a write outside of an array.
    left
        States that were not run, since too many ended the process.
    """

    flat: Array
    done: Array
    decided: dict[str, Any] | None
    troubles: dict[int, str] = field(default_factory=dict)
    left: int = 0


def run_target(
    task: Mapping[str, Any], q: Array, values: Mapping[str, Array], groups: Sequence[tuple[int, int]], limit: float,
    advance: Callable[[str, int], None] = lambda label, total: None,
) -> Ran:  # fmt: skip
    """Call a target at every state.

    Parameters
    ----------
    task
        What the child is told: kind, target, unknowns, parameters, arguments, returns, sizes, layout, dtype.
    q, values
        (n, rows), and (n,) or (n, 3) by name.
    groups
        Ranges of states that may be called together.
    limit
        Seconds that one call may take.

    Raises
    ------
    InputError, NotRunError
        What the child found wrong with the target before it could call it.
    """
    with tempfile.TemporaryDirectory(prefix="yarnverify-check-") as name:
        folder = Path(name)
        (folder / "inputs.npz").write_bytes(npz({"q": q, **{f"v_{key}": value for key, value in values.items()}}))
        status = np.lib.format.open_memmap(folder / "status.npy", mode="w+", dtype=np.uint8, shape=(len(q),))
        todo, troubles, ended = list(groups), {}, 0
        while todo and ended < MOST_ENDED:
            (folder / "task.json").write_text(json.dumps({**task, "todo": todo}))
            why = _watched(folder, status, limit, todo, advance)
            _complain(folder)
            if why is None:
                todo = []
                break
            begun = np.flatnonzero(np.asarray(status) == BEGUN)
            if not begun.size:
                raise NotRunError(f"{task['target']}: {why} before its first call")
            start, stop = int(begun[0]), int(begun[-1]) + 1
            todo = _after(todo, start, stop)
            if stop - start == 1:
                troubles[start] = why
                status[start] = 0
                ended += 1
            else:  # one of several in a call: look closer
                status[start:stop] = 0
                middle = (start + stop) // 2
                todo = [(start, middle), (middle, stop), *todo]
        return _collected(folder, status, troubles, sum(stop - start for start, stop in todo))


def _after(todo: list[tuple[int, int]], start: int, stop: int) -> list[tuple[int, int]]:
    """What is left behind a range."""
    left = []
    for a, b in todo:
        if b > stop:
            left.append((max(a, stop), b))
    return left


def _complain(folder: Path) -> None:
    path = folder / "error.json"
    if path.exists():
        text, exit_status = json.loads(path.read_text())
        raise (InputError if exit_status == 2 else NotRunError)(text)


def _watched(
    folder: Path, status: Array, limit: float, todo: Sequence[tuple[int, int]], advance: Callable[[str, int], None]
) -> str | None:
    """Run one child; what ended it, None if it came to its end."""
    total = len(status)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([p for p in sys.path if p]), "PYTHONFAULTHANDLER": ""}
    with (folder / "said.txt").open("wb") as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "yarnverify.check.child", str(folder)],
            stdin=subprocess.DEVNULL, stdout=said, stderr=said, env=environment, start_new_session=True,
        )  # fmt: skip
    shown, seen, since = int((np.asarray(status) >= DONE).sum()), b"", time.monotonic()
    pause = 0.002
    try:
        while process.poll() is None:
            time.sleep(pause)
            pause = min(0.05, pause * 1.3)
            now = np.asarray(status).tobytes()
            if now != seen:
                seen, since = now, time.monotonic()
            done = int((np.asarray(status) >= DONE).sum())
            for _ in range(done - shown):
                advance("calling", total)
            shown = max(shown, done)
            allowed = limit if np.any(np.asarray(status) == BEGUN) else _STARTS_WITHIN
            if not (folder / "decided.json").exists():
                allowed = max(limit * _FIRST, allowed)
            if time.monotonic() - since > allowed:
                return f"does not come back within {allowed:g} s"
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    if process.returncode == 0:
        return "ends its process" if np.any(np.asarray(status) == BEGUN) else None
    path = folder / "ended.json"
    if path.exists():
        return str(json.loads(path.read_text()))
    last = (folder / "said.txt").read_text(errors="replace").strip().splitlines()[-1:]
    return "crashes: " + ending(process.returncode) + (f" ({last[0][:160]})" if last and process.returncode > 0 else "")


def ending(code: int) -> str:
    """How a process ended that did not end well."""
    if code < 0:
        try:
            return signal.Signals(-code).name
        except ValueError:
            return f"signal {-code}"
    return f"exit status {code}"


def _collected(folder: Path, status: Array, troubles: dict[int, str], left: int) -> Ran:
    n = len(status)
    path = folder / "decided.json"
    decided = json.loads(path.read_text()) if path.exists() else None
    flat = np.array(np.load(folder / "outputs.npy")) if decided else np.full((n, 0), np.nan)
    raised = folder / "raised.jsonl"
    if raised.exists():
        for line in raised.read_text().splitlines():
            at, text = json.loads(line)
            troubles.setdefault(at, text)
    return Ran(flat, np.asarray(status) == DONE, decided, dict(sorted(troubles.items())), left)
