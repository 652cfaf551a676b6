"""The process in which somebody's code runs, state by state: ``python -m yarnverify.check.child FOLDER``.

The folder holds ``task.json`` and ``inputs.npz``; results go to a file in memory, so that what was done before a crash is kept.
"""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.check.calls import TRIED, Call, answers, flattened, guessed, joined, load, makers, manner
from yarnverify.check.conventions import LAYOUTS
from yarnverify.errors import InputError, NotRunError
from yarnverify.files import write_record

Array = NDArray[Any]
BEGUN, DONE, RAISED = 1, 2, 3


class Task:
    """What is to be done, and where results go."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.task: dict[str, Any] = json.loads((folder / "task.json").read_text())
        with np.load(folder / "inputs.npz") as stored:
            self.q = stored["q"]
            self.values = {name[2:]: stored[name] for name in stored.files if name != "q"}
        self.status = np.lib.format.open_memmap(folder / "status.npy", mode="r+")
        self.outputs: Array | None = None

    def begin(self, where: slice) -> None:
        self.status[where] = BEGUN
        self.status.flush()

    def keep(self, where: slice, values: Array) -> None:
        assert self.outputs is not None
        self.outputs[where] = values
        self.status[where] = DONE

    def raised(self, where: slice, error: BaseException) -> None:
        self.status[where] = RAISED
        text = " ".join(f"{type(error).__name__}: {error}".split())
        with (self.folder / "raised.jsonl").open("a") as file:
            file.write(json.dumps([where.start, text]) + "\n")

    def decide(self, decided: dict[str, Any], total: int) -> None:
        """Write down how the code is called, and make room for its results, unless an earlier process has."""
        path = self.folder / "outputs.npy"
        if path.exists():
            self.outputs = np.lib.format.open_memmap(path, mode="r+")
            return
        self.outputs = np.lib.format.open_memmap(path, mode="w+", dtype=np.float64, shape=(len(self.q), total))
        self.outputs[:] = np.nan
        write_record(decided, self.folder / "decided.json")


class _UnnamedError(ValueError):
    """Results came back, of sizes that do not say what they are."""


def run_python(task: Task) -> None:
    """Call a Python function."""
    target, q = task.task["target"], task.q
    rows = q.shape[1]
    functions = load(target, [label for label, _ in task.task["pieces"]])
    unknowns, parameters = task.task["unknowns"], task.task["parameters"]
    points = task.task["points"]
    calls = [
        Call(function, manner(function, unknowns, list(task.values), parameters, target, points), name)
        for name, function in functions.items()
    ]
    said = task.task["returns"]

    def parts(where: slice, layout: str) -> tuple[dict[str, Array], str]:
        found: dict[str, Array] = {}
        kind = "float64"
        for call in calls:
            for name, part in answers(call(q, task.values, where, layout, made), call.name, len(said or ())).items():
                if said and name.startswith("#") and len(said) > int(name[1:]) and said[int(name[1:])] == "_":
                    continue
                found[name] = flattened(part, layout, where.stop - where.start, name.replace("#", "answer "))
                if getattr(part, "dtype", None) is not None and str(part.dtype).endswith("float32"):
                    kind = "float32"
        return (joined(found, points, rows) if calls[0].manner.points else found), kind

    def fits(found: dict[str, Array]) -> list[str]:
        sizes = [(name, part.shape[1]) for name, part in found.items()]
        name = getattr(calls[0].function, "__name__", "")
        if said:
            names = [word for word in said if word != "_"]
            if len(names) == len(sizes):
                expected = task.task["sizes"]
                wrong = [
                    f"{n} has {size} numbers, not {expected[n]}"
                    for n, (_, size) in zip(names, sizes, strict=True)
                    if size != expected[n]
                ]
                if wrong:
                    raise ValueError("; ".join(wrong))
                return names
            raise ValueError(f"it gives {len(sizes)} results, and --returns names {len(said)}")
        names_or_none = guessed(sizes, rows, name, task.task["pieces"])
        if names_or_none is None or len(set(names_or_none)) < len(names_or_none):
            shown = ", ".join(str(size) for _, size in sizes)
            points = [label for label, size in task.task["pieces"] if size == 3]
            example = {"3": "F_{0} for the force on {0}, {0} for the gradient", "9": "dF_{0}/d{0} for a Jacobian"}.get(
                shown
            )
            such = f", such as --returns {example.format(points[-1])}" if example and points else ""
            raise _UnnamedError(
                f"results of {shown} numbers for a state of {rows}: say what they are with --returns{such}"
            )
        return names_or_none

    first = task.task["todo"][0][0]
    layouts = LAYOUTS if task.task["layout"] == "auto" else (task.task["layout"],)
    ways = makers()
    for made in ways:
        try:
            chosen, names, kind = _layout(task, layouts, first, parts, fits)
            break
        except InputError:
            if made is ways[-1]:
                raise
    found, _ = parts(_tried(chosen, first, len(q)), chosen)
    task.decide(
        {"layout": chosen, "returns": names, "dtype": kind, "by_name": calls[0].manner.by_name},
        sum(part.shape[1] for part in found.values()),
    )

    def one(where: slice) -> None:
        task.begin(where)
        try:
            task.keep(where, np.hstack(list(parts(where, chosen)[0].values())))
        except Exception as error:
            if where.stop - where.start == 1:
                task.raised(where, error)
                return
            for at in range(where.start, where.stop):
                one(slice(at, at + 1))

    for start, stop in task.task["todo"]:
        step = 1 if chosen == "single" else stop - start
        for at in range(start, stop, step):
            one(slice(at, at + step))


def _tried(layout: str, first: int, n: int) -> slice:
    return slice(first, first + 1 if layout == "single" else min(first + TRIED, n))


def _layout(
    task: Task, layouts: tuple[str, ...], first: int,
    parts: Callable[[slice, str], tuple[dict[str, Array], str]], fits: Callable[[dict[str, Array]], list[str]],
) -> tuple[str, list[str], str]:  # fmt: skip
    """The first layout in which the function can be called and gives results of a size that means something."""
    why: dict[str, list[str]] = {}
    unnamed: list[str] = []
    for layout in layouts:
        where = _tried(layout, first, len(task.q))
        task.begin(where)
        try:
            found, kind = parts(where, layout)
            return layout, fits(found), kind
        except Exception as error:
            if isinstance(error, _UnnamedError):
                unnamed.append(str(error))
            shape = {"single": "one state", "component": "(rows, states)", "element": "(states, rows)"}[layout]
            text = " ".join(str(error).split())[:200]
            why.setdefault(text if type(error) is ValueError else f"{type(error).__name__}: {text}", []).append(shape)
    size = task.q.shape[1]
    if unnamed or len(why) == 1:  # where it can be called one way, why not otherwise is of no interest
        raise InputError(f"{task.task['target']}: {(unnamed or list(why))[0]}")
    tried = "; ".join(f"with {' and '.join(shapes)}: {text}" for text, shapes in why.items())
    raise InputError(
        f"{task.task['target']}: cannot be called with states of {size} numbers (--order says others): {tried}"
    )


def main() -> None:
    """Do the task of a folder; what a person can do something about goes to ``error.json``."""
    folder = Path(sys.argv[1])
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    task = Task(folder)
    try:
        if task.task["kind"] == "c":
            from yarnverify.check.library import run_library

            run_library(task)
        else:
            run_python(task)
    except (InputError, NotRunError) as error:
        (folder / "error.json").write_text(json.dumps([str(error), 2 if isinstance(error, InputError) else 3]))
    except BaseException as error:  # a target may call exit
        where = np.flatnonzero(np.asarray(task.status) == BEGUN)
        if where.size and isinstance(error, Exception | SystemExit):
            text = "it calls exit" if isinstance(error, SystemExit) else f"{type(error).__name__}: {error}"
            (folder / "ended.json").write_text(json.dumps(" ".join(text.split())))
        raise


if __name__ == "__main__":
    main()
