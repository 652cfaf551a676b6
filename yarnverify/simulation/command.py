"""``yarnverify simulate``: find a scene, run it, and write what was asked for."""

from __future__ import annotations

import importlib.util
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from yarnverify.errors import InputError, NotRunError, why
from yarnverify.files import write_record
from yarnverify.simulation.runs import Reached
from yarnverify.simulation.scene import SOLVERS, Scene, suggestion
from yarnverify.simulation.setting import Setting
from yarnverify.simulation.study import Keeping, Study, Tell, study


def find(name: str) -> Scene:
    """A scene by its name, or the one in a Python file.

    Raises
    ------
    InputError
        There is none, or the file is not one of a scene.
    """
    from yarnverify.simulation.scenes import SCENES

    if name.endswith(".py"):
        return _from_file(Path(name))
    known = {scene.name: scene for scene in SCENES}
    wanted = name.replace("-", "_")
    if wanted not in known:
        raise InputError(
            f"there is no scene {name!r}{suggestion(wanted, known, 'there are')}; or give a file that ends in .py"
        )
    return known[wanted]


def _from_file(path: Path) -> Scene:
    if not path.is_file():
        raise InputError(f"there is no file {path}")
    spec = importlib.util.spec_from_file_location(f"scene_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    beside = str(path.resolve().parent)
    sys.path.insert(0, beside)  # kernels in a folder beside it are found, as where Python itself runs the file
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise InputError(error.msg, (str(path), error.lineno or 1, error.offset or 1)) from None
    except Exception as error:
        raise InputError(f"{type(error).__name__}: {error}", (str(path), _line(error, path), 1)) from None
    finally:
        sys.path.remove(beside)
    found = [
        value
        for value in vars(module).values()
        if isinstance(value, Scene) and value.build.__module__ == module.__name__
    ]
    if len(found) != 1:
        raise InputError(f"{path} must declare one scene, a function under @scene(...); it declares {len(found)}")
    return found[0]


def _line(error: BaseException, path: Path) -> int:
    """The last line of a file on the way to an error."""
    line, trace = 1, error.__traceback__
    while trace is not None:
        if Path(trace.tb_frame.f_code.co_filename).resolve() == path.resolve():
            line = trace.tb_lineno
        trace = trace.tb_next
    return line


def settings(given: Sequence[str]) -> dict[str, str]:
    """Parameters from texts ``name=value``."""
    found = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals or not name.strip():
            raise InputError(f"--set takes name=value; not {text!r}")
        if name.strip() in found:
            raise InputError(f"--set gives {name.strip()} twice")
        found[name.strip()] = value.strip()
    return found


def listing() -> list[str]:
    """A line for each scene."""
    from yarnverify.simulation.scenes import SCENES

    width = max(len(scene.name) for scene in SCENES)
    return [f"{scene.name:<{width}}  {scene.title}" for scene in SCENES]


def record_all(folder: Path, pictures: bool, tell: Tell) -> tuple[Path, list[str]]:
    """Run every scene, those for looking at last, and write the record below a folder of reports; goals that were missed.

    Parameters
    ----------
    pictures
        Whether to draw the end of each into ``pictures/``, where that can be done.
    """
    from yarnverify.simulation.record import measure, write
    from yarnverify.simulation.scenes import SCENES

    def draw(found: Study) -> None:
        from yarnverify.simulation.view import picture

        problem, path = found.problem, folder / "pictures" / f"{found.result['scene']}.png"
        look = {
            "colour": problem.colour,
            "view": problem.view,
            "solids": problem.solids,
            "title": found.result["title"],
        }
        picture(problem.fabric, found.arrays["Q"], path, size=(960, 720), **look)

    drawn = {"draw": draw} if pictures and importlib.util.find_spec("matplotlib") else {}
    validating, others = ([scene for scene in SCENES if scene.validates is known] for known in (True, False))
    record = measure(validating, tell, **drawn, shown=others)
    every = [*record["scenes"], *record["shown"]]
    return write(record, folder), [line for each in every for line in each["result"]["missed"]]


def simulate(
    name: str, sizes: Sequence[int], given: Sequence[str], solver: str | None, out: Path | None, resume: bool, every: float,
    pictures: bool, tell: Tell,
) -> tuple[Study, list[str]]:  # fmt: skip
    """Run a scene and write its files; what to say of it.

    Parameters
    ----------
    name, given
        Of the scene, or its file; parameters, ``name=value``.
    sizes
        Those of the scene if empty.
    out
        Folder for results, states, pictures; none are written without.
    resume
        Whether to go on with the run that is in the folder.
    every
        Seconds between states.

    Raises
    ------
    InputError, NotRunError
        In one line, what cannot be.
    """
    scene, values = find(name), settings(given)
    if solver is not None and solver not in SOLVERS:
        raise InputError(f"there is no solver {solver!r}{suggestion(solver, SOLVERS, 'there are')}")
    if resume and out is None:
        raise InputError("--resume needs --out, the folder that holds the run")
    if not every >= 0:
        raise InputError(f"--every takes seconds, 0 or more; not {every}")
    files = None if out is None else Files(out, scene.name, resume)
    keeping = Keeping() if files is None else Keeping(files.folder, every, resume, files.watch)
    with stopped_gently(files):
        found = study(scene, sizes or scene.sizes, values, solver, keeping, tell)
    lines = [] if files is None else files.finish(found, pictures)
    return found, lines


@contextmanager
def stopped_gently(files: Files | None) -> Iterator[None]:
    """Stop at an interrupt or at SIGTERM after the state is saved."""

    def stop(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    try:
        before = signal.signal(signal.SIGTERM, stop)
    except ValueError:  # not in the main thread
        before = None
    try:
        yield
    except KeyboardInterrupt:
        kept = (
            f"; the same command with --resume goes on from what is kept in {files.folder}"
            if files
            else "; nothing is kept without --out"
        )
        raise NotRunError(f"interrupted{kept}") from None
    finally:
        if before is not None:
            signal.signal(signal.SIGTERM, before)


@dataclass(eq=False)
class Files:
    """The folder of a run."""

    folder: Path
    name: str
    resume: bool

    def __post_init__(self) -> None:
        self.series: Any = None
        states = self.folder / "states"
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError(f"{self.folder} is not a folder")
        if self.resume and not states.is_dir():
            raise InputError(f"{self.folder} holds no run to go on with")
        try:
            states.mkdir(parents=True, exist_ok=True)
            done = [] if self.resume else [*states.glob("*.npz"), *self.folder.glob(f"{self.name}_*.vtp")]
            for old in [*states.glob(".*.npz.*"), *done]:  # halves of a process that was killed, and a run before
                old.unlink()
        except OSError as error:
            raise NotRunError(f"{self.folder}: cannot write: {why(error)}") from None

    def watch(self, problem: Setting, reached: Reached | None) -> None:
        """Write a step of the series for ParaView: at the start, after each stage, and with each frame of a motion."""
        from yarnverify.simulation.view import Series

        if reached is None:
            self.series = Series(problem.fabric, self.folder / f"{self.name}.pvd", resume=self.resume)
            if not self.series.steps:
                self.series.write(0.0, problem.fabric.Q if problem.start is None else problem.start)
        elif reached.frame:
            self.series.write(reached.time, reached.Q)

    def finish(self, found: Study, pictures: bool) -> list[str]:
        """Write records and pictures; the lines to print."""
        lines = []
        for name, record in (("result", found.result), ("timings", found.timings)):
            write_record(record, self.folder / f"{name}.json")
        lines.append(f"{self.folder}: result.json, timings.json, {self.name}.pvd, states/")
        if pictures and importlib.util.find_spec("matplotlib") is None:
            lines.append("no pictures: they need the extra view: pip install 'yarnverify[view]'")
        elif pictures:
            lines += self._pictures(found)
        return lines

    def _pictures(self, found: Study) -> list[str]:
        from yarnverify.simulation.view import movie, picture, scene

        problem, arrays = found.problem, found.arrays
        title = found.result["title"]
        look = {"colour": problem.colour, "view": problem.view, "solids": problem.solids}
        path = self.folder / self.name
        written = [picture(problem.fabric, arrays["Q"], path.with_suffix(".png"), title=title, **look)]
        frames, times = [arrays["Q"]], None
        if "frames" in arrays and len(arrays["frames"]) > 1:
            frames, times = list(arrays["frames"]), [float(t) for t in arrays["frame times"]]
            written.append(movie(problem.fabric, frames, path.with_suffix(".gif"), times=times, **look))
        page = scene(problem.fabric, frames, path.with_suffix(".html"), times=times, title=title, solids=problem.solids)
        written.append(page)
        if problem.known and len(found.result["lines"][0]["runs"]) > 1:
            from yarnverify.report.precision import write_precision

            written += write_precision(found.result, found.timings, self.folder / f"{self.name}-precision")
        return [f"{self.folder}: {', '.join(path.name for path in written)}"]
