"""The most memory that a time step holds, per crossing: the difference of two peaks of a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from yarnverify.errors import NotRunError


def peak(side: int, solver: str, engine: str = "auto") -> float:
    """Bytes per crossing, from making the cloth to the end of an iteration or two, without what packages take.

    Raises
    ------
    NotRunError
        The process came to no end, for want of memory for one.
    """
    code = f"from yarnverify.benchmark.simulation.memory import measure; measure({side}, {solver!r}, {engine!r})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    try:
        return float(json.loads(done.stdout.splitlines()[-1]))
    except (IndexError, ValueError):
        reason = (done.stderr.splitlines() or [f"exit status {done.returncode}"])[-1]
        raise NotRunError(f"memory of {side} x {side} crossings could not be measured: {reason}") from None


def measure(side: int, solver: str, engine: str) -> None:
    """What the child does: print the number."""
    from yarnverify.benchmark.simulation.cloth import Cloth
    from yarnverify.simulation.scatter import engine_for

    engine = engine_for(engine, 10 * side * side)
    Cloth.made(8, solver, engine).step(1)
    before = _held(start=True)
    Cloth.made(side, solver, engine).step(2 if solver == "direct" else 1)
    print(json.dumps((_held() - before) / (side * side)))


def _held(start: bool = False) -> int:
    """The most bytes held so far; to start with those that are held now, and the most is counted anew (Linux)."""
    import resource

    try:
        if start:
            Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return 1024 * int(next(line for line in lines if line.startswith("VmHWM")).split()[1])
    except (OSError, StopIteration):
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
