"""The most memory that a time step holds, per crossing: the difference of two peaks of a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys

from yarnverify.errors import NotRunError


def peak(side: int, solver: str, engine: str = "auto") -> float:
    """Bytes per crossing, from making the cloth to the end of two steps; what packages and small cloth take is not counted.

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
    import resource

    from yarnverify.benchmark.simulation.cloth import Cloth
    from yarnverify.simulation.scatter import engine_for

    def most() -> int:
        unit = 1 if sys.platform == "darwin" else 1024
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit

    engine = engine_for(engine, 10 * side * side)
    Cloth.made(8, solver, engine).step()
    before = most()
    cloth = Cloth.made(side, solver, engine)
    cloth.step()
    cloth.step()
    print(json.dumps((most() - before) / (side * side)))
