"""A scene at several sizes and in several ways: errors, observed orders, seconds; and the record of it.

The record is in two parts: ``result``, the same wherever and however often it is made on a machine, and ``timings``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, process_time
from typing import Any

from yarnverify.errors import InputError, NotRunError
from yarnverify.simulation.goals import add_orders, answer, missed
from yarnverify.simulation.outcome import UNSOLVED
from yarnverify.simulation.runs import Reached, Run
from yarnverify.simulation.scene import Line, Scene
from yarnverify.simulation.setting import Setting
from yarnverify.simulation.state import identity, load, save

Tell = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Study:
    """What was run.

    Attributes
    ----------
    result, timings
        Records, JSON data.
    problem, arrays
        The largest size, solved in the first way: to be drawn.
    """

    result: dict[str, Any]
    timings: dict[str, Any]
    problem: Setting
    arrays: Mapping[str, Any]

    @property
    def missed(self) -> list[str]:
        """Goals that were missed, a line each."""
        return list(self.result["missed"])


@dataclass(frozen=True, eq=False)
class Keeping:
    """Where states are kept, and how often.

    Attributes
    ----------
    folder
        Nothing is kept without one.
    seconds
        Between states.
    resume
        Whether to go on from what is there.
    watch
        Called with each state that is reached of the run that is drawn.
    """

    folder: Path | None = None
    seconds: float = 10.0
    resume: bool = False
    watch: Callable[[Setting, Reached | None], None] = lambda problem, reached: None


def study(
    scene: Scene, sizes: Sequence[int], values: Mapping[str, Any], solver: str | None = None, keeping: Keeping | None = None,
    tell: Tell = lambda label, done: None,
) -> Study:  # fmt: skip
    """Run a scene.

    Parameters
    ----------
    sizes
        All of them, the smallest first.
    values
        Parameters that are not the defaults.
    tell
        Called with what goes on and the share of all that is done.

    Raises
    ------
    InputError
        A size or a parameter that the scene cannot have.
    NotRunError
        A run that finds no solution, or a disk that is full.
    """
    keeping = keeping or Keeping()
    sizes = sorted(set(sizes))
    lines = scene.lines(values, solver)
    problems = {
        (line.name, size): scene.problem(size, line.values) for line in lines for size in sizes
    }  # refuse before running
    total = sum(size for _, size in problems)
    shown = (lines[0].name, sizes[-1])
    drawn: Mapping[str, Any] = {}
    before, kept, timed = 0.0, [], []
    for line in lines:
        runs, seconds = [], []
        for size in sizes:
            key = (line.name, size)
            share = size / total

            def told(label: str, done: float, at: float = before, share: float = share, key: Any = key) -> None:
                tell(f"{key[0]}, {key[1]}: {label}", at + share * done)

            run = Run(problems[key], line.solver, lambda label, told=told: told(label, 0.0))  # type: ignore[misc]
            arrays = _finished(scene, line, size, run, keeping, key == shown, told)
            runs.append(_described(run, size, arrays, size >= scene.sizes[-1]))
            seconds.append({"size": size, "seconds": float(arrays["seconds"])})
            before += share
            if key == shown:
                drawn = arrays
        kept.append({"name": line.name, "solver": line.solver, "runs": add_orders(runs)})
        timed.append({"name": line.name, "runs": seconds})
    result = {
        "schema": 1,
        "scene": scene.name,
        "title": scene.title,
        "source": scene.source,
        "wall": scene.wall,
        "size": scene.size,
        "parameters": {name: {"value": v, "unit": scene.quantities[name].unit, "reason": scene.quantities[name].reason}
                       for name, v in scene.values(values).items()},
        "compared": scene.compare or "solver",
        "lines": kept,
    }  # fmt: skip
    result["missed"] = missed(result)
    return Study(result, {"schema": 1, "scene": scene.name, "lines": timed}, problems[shown], drawn)


def _finished(
    scene: Scene, line: Line, size: int, run: Run, keeping: Keeping, shown: bool, told: Callable[[str, float], None]
) -> Mapping[str, Any]:
    """The state at the end of a run, from the start or from where it was left."""
    path, known = None, None
    who = identity(scene.name, {**line.values, "size": size, "solver": line.solver, "scene": scene.code})
    if keeping.folder is not None:
        path = keeping.folder / "states" / f"{line.name.replace(' ', '-')}-{size}.npz"
        if keeping.resume and path.exists():
            known = load(path, who)
    spent = float(known["seconds"]) if known else 0.0
    if shown:
        keeping.watch(run.problem, None)
    saved, reached = monotonic(), None

    def keep(at: Reached) -> None:
        if path is not None:
            save(path, identity=who, **at.arrays(), seconds=spent)

    steps = iter(run.go(known))
    try:
        while True:
            begin = process_time()
            step = next(steps, None)
            spent += process_time() - begin  # processor time, of the solution alone
            if step is None:
                break
            told("", step.time / run.length)
            if shown:
                keeping.watch(run.problem, step)
            reached = step  # only now: a state that is kept has its picture
            if monotonic() > saved + keeping.seconds:
                keep(reached)
                saved = monotonic()
    except UNSOLVED as error:
        last = f"; the last good state is in {path}" if path is not None and reached is not None else ""
        if reached is not None:
            keep(reached)
        at = 0.0 if reached is None else reached.time
        where = f"after {at:g} {'s' if run.moving else 'stages'}"
        raise NotRunError(f"{scene.name} at size {size}, {line.name}, {where}: {error}{last}") from None
    except KeyboardInterrupt:
        if reached is not None:
            keep(reached)
        raise
    if reached is None:
        if known is None:
            raise InputError(f"{scene.name}: there is nothing to run: no stages, or no time")
        return known
    keep(reached)
    return {**reached.arrays(), "seconds": spent}


def _described(run: Run, size: int, arrays: Mapping[str, Any], large: bool) -> dict[str, Any]:
    outcome = run.outcome(arrays)
    return {
        "size": size,
        "unknowns": int(run.system.count),
        "energies": {term.name: term.table.count for term in run.problem.terms},
        "iterations": int(arrays["iterations"]),
        "answers": [answer(known, outcome, large) for known in run.problem.known],
    }
