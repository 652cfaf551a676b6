"""``yarnverify simulate``: files, runs that are interrupted and go on, and one clear error for what cannot be."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.commands import caller
from yarnverify.errors import InputError, NotRunError
from yarnverify.simulation import command
from yarnverify.simulation.study import Keeping, study

STAGED = """
import os, signal, time
from yarnverify.kernels import gravity, kinetic, stretch
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import segments, yarn
from yarnverify.simulation.quantities import choice, positive, whole
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Moving, Static, ramp


signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests may have it ignored


@scene(title="a swing", size="segments", sizes=(3,), solvers=("direct",))
def swing(size: int, until: float = positive(0.2, "s"), steps: int = whole(40), pause: float = positive(1e-9, "s"),
          rest: str = choice("no", "yes")) -> Moving | Static:
    fabric = yarn(0.1, size)
    terms = [Term(stretch, segments(fabric), {"k_s": 1.0}),
             Term(gravity, segments(fabric, gravity), {"rho": 1e-3, "g": (0, 0, -9.81)})]
    mass = Term(kinetic, segments(fabric, kinetic), {"rho": 1e-3})
    seen = []

    def waited(at):
        time.sleep(pause if pause > 1e-6 else 0)
        seen.append(1)
        if len(seen) == int(os.environ.get("STOP_AT", 0)):
            os.kill(os.getpid(), int(os.environ["STOP_BY"]))
        return at.system.energy(at.Q)

    common = dict(watch={"energy": waited})
    free = fabric.positions(range(1, size + 1))
    if rest == "yes":
        loads = 0 * fabric.Q
        loads[fabric.position(size)[0]] = [1e-3, 0, 5e-3]
        return Static(fabric, terms, free, stages=ramp(loads, steps), **common)
    return Moving(fabric, terms, free, mass, until, until / steps, frames=5, **common)
"""


@pytest.fixture
def swing(tmp_path: Path) -> Path:
    path = tmp_path / "swing.py"
    path.write_text(STAGED, encoding="utf-8")
    return path


def run(scene: str, out: Path | None = None, **more: Any) -> Any:
    options: dict[str, Any] = {"sizes": (), "given": (), "solver": None, "resume": False, "every": 10.0, "pictures": False,
                               "tell": lambda label, done: None}  # fmt: skip
    return command.simulate(scene, out=out, **{**options, **more})


def shell(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "yarnverify", "simulate", *arguments], capture_output=True, text=True,
                          env={**os.environ, **environment}, timeout=120)  # fmt: skip


def states(folder: Path) -> dict[str, dict[str, Any]]:
    """Every saved array of a run but the seconds that it took."""
    found = {}
    for path in sorted((folder / "states").glob("*.npz")):
        with np.load(path) as file:
            found[path.name] = {name: file[name].tobytes() for name in file.files if name != "seconds"}
    return found


def frames(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted([*folder.glob("*.vtp"), *folder.glob("*.pvd")])}


# -- what is written --------------------------------------------------------------------------------------------------


def test_files_of_a_study_are_the_same_bytes_twice(tmp_path: Path) -> None:
    for name in ("one", "two"):
        run("hanging_yarn", tmp_path / name, sizes=(4, 8))
    one, two = tmp_path / "one", tmp_path / "two"
    assert (one / "result.json").read_bytes() == (two / "result.json").read_bytes()
    assert frames(one) == frames(two) and len(frames(one)) == 3
    record = json.loads((one / "result.json").read_text(encoding="utf-8"))
    assert record["lines"][0]["runs"][1]["energies"] == {"stretch": 8, "gravity": 8}
    assert record["parameters"]["k_s"]["unit"] == "N" and "seconds" not in (one / "result.json").read_text(
        encoding="utf-8"
    )
    timings = json.loads((one / "timings.json").read_text(encoding="utf-8"))
    assert [line["name"] for line in timings["lines"]] == ["direct", "superlu"]


def test_a_new_run_in_the_same_folder_leaves_nothing_of_the_old_one(tmp_path: Path, swing: Path) -> None:
    run(str(swing), tmp_path / "out", given=("steps=10",))
    half = tmp_path / "out" / "states" / ".direct-3.npz.abc"  # as a process that is killed leaves one
    half.touch()
    run(str(swing), tmp_path / "out", given=("steps=4", "rest=yes"), sizes=(5,))
    assert list(states(tmp_path / "out")) == ["direct-5.npz"] and not half.exists()
    assert len(frames(tmp_path / "out")) == 6  # start, four stages, and their list


def test_nothing_is_written_without_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run("pressed_yarns", sizes=(3,))
    assert list(tmp_path.iterdir()) == []


def test_pictures(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    _, lines = run("closed_ring", tmp_path, sizes=(3, 6), solver="direct", pictures=True)
    for name in ("closed_ring.png", "closed_ring.html", "closed_ring-precision.svg", "closed_ring-precision.png"):
        assert (tmp_path / name).stat().st_size > 1000 and name in lines[-1]


SCENE = """
from yarnverify.kernels import stretch
from yarnverify.simulation.assembly import Term
from yarnverify.simulation.fabric import segments, yarn
from yarnverify.simulation.quantities import positive
from yarnverify.simulation.scene import scene
from yarnverify.simulation.setting import Known, Stage, Static


@scene(title="a yarn that is pulled", size="segments", sizes=(2, 4, 8), source="Hooke's law", wall="at the first node")
def pulled(size: int, k_s: float = positive(50.0, "N", "a cotton yarn"), force: float = positive(1.0, "N")) -> Static:
    fabric = yarn(0.1, size)
    loads = 0 * fabric.Q
    loads[fabric.position(size)[0, 0]] = force
    longer = Known("length", "m", 0.1 * (1 + force / k_s), lambda end: end.points[-1, 0])
    unknown = fabric.positions(range(1, size + 1))
    return Static(fabric, [Term(stretch, segments(fabric), {"k_s": k_s})], unknown, [longer], [Stage(loads)])
"""


def test_a_scene_in_a_file_comes_out_as_known(tmp_path: Path) -> None:
    path = tmp_path / "my_scene.py"
    path.write_text(SCENE, encoding="utf-8")
    found, _ = run(str(path), given=("force=2.5 N",))
    assert found.missed == [] and found.result["lines"][0]["runs"][0]["answers"][0]["exact"] == pytest.approx(0.105)


def test_a_scene_finds_what_lies_beside_it(tmp_path: Path) -> None:
    """From whatever folder it is called: the kernels of an energy of one's own are in a folder beside the scene."""
    (tmp_path / "beside").mkdir()
    (tmp_path / "beside" / "lengths.py").write_text("LENGTH = 0.1\n", encoding="utf-8")
    path = tmp_path / "importing.py"
    path.write_text("from beside.lengths import LENGTH\n" + SCENE.replace("yarn(0.1", "yarn(LENGTH"), encoding="utf-8")
    done = shell(str(path), "--size", "2")
    assert done.returncode == 0, done.stderr


# -- runs that are interrupted ----------------------------------------------------------------------------------------


HOW = [(signal.SIGINT, "no"), (signal.SIGTERM, "yes"), (signal.SIGKILL, "no")]


@pytest.mark.parametrize(("how", "rest"), HOW)
def test_an_interrupted_run_goes_on_to_the_same_bits(
    tmp_path: Path, swing: Path, how: signal.Signals, rest: str
) -> None:
    arguments = [str(swing), "--set", f"rest={rest}", "--size", "2", "3", "--no-pictures", "--out"]
    whole, parted = tmp_path / "whole", tmp_path / "parted"
    assert shell(*arguments, str(whole)).returncode == 0
    # within the second size, after some of its steps; kept after each step, so that SIGKILL finds something
    stopped = shell(*arguments, str(parted), "--every", "0", STOP_AT="25", STOP_BY=str(int(how)))
    if how is signal.SIGKILL:
        assert stopped.returncode == -signal.SIGKILL
    else:
        assert stopped.returncode == 3 and "--resume goes on" in stopped.stderr and stopped.stderr.count("\n") == 1
    done = [len(np.load(path)["recorded time"]) for path in sorted((parted / "states").glob("*.npz"))]
    assert 20 < done[-1] < 30
    again = shell(*arguments, str(parted), "--resume")
    assert again.returncode == 0, again.stderr
    assert states(parted) == states(whole) and frames(parted) == frames(whole)
    assert (parted / "result.json").read_bytes() == (whole / "result.json").read_bytes()


def test_a_state_is_kept_only_with_its_picture(tmp_path: Path) -> None:
    """An interrupt while a step of the series is written leaves the state before it, from which both are made again."""
    seen: list[Any] = []

    def watch(problem: Any, reached: Any) -> None:
        seen.append(reached)
        if len(seen) == 4:  # the start, two steps, and this one
            raise KeyboardInterrupt

    (tmp_path / "states").mkdir()
    with pytest.raises(KeyboardInterrupt):
        study(command.find("thrown_cloth"), [5], {"scheme": "midpoint"}, keeping=Keeping(tmp_path, watch=watch))
    (path,) = (tmp_path / "states").glob("*.npz")
    with np.load(path) as state:
        assert int(state["steps"]) == 2 and float(state["time"]) == seen[2].time


def test_going_on_with_a_run_that_is_done_changes_nothing(tmp_path: Path, swing: Path) -> None:
    run(str(swing), tmp_path / "out", given=("steps=6",))
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir() if path.is_file()}
    run(str(swing), tmp_path / "out", given=("steps=6",), resume=True)
    assert before == {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir() if path.is_file()}


# -- what cannot be ---------------------------------------------------------------------------------------------------


def test_another_run_is_not_gone_on_with(tmp_path: Path, swing: Path) -> None:
    run(str(swing), tmp_path / "out", given=("steps=6",))
    with pytest.raises(InputError, match=r"belongs to another run: until = 0.2, not 0.1"):
        run(str(swing), tmp_path / "out", given=("steps=6", "until=0.1"), resume=True)
    swing.write_text(STAGED + "\n# changed", encoding="utf-8")
    with pytest.raises(InputError, match="belongs to another run: scene = "):
        run(str(swing), tmp_path / "out", given=("steps=6",), resume=True)


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (["hangingyarn"], 2, "there is no scene 'hangingyarn'; did you mean hanging_yarn?"),
        (["zebra"], 2, "there is no scene 'zebra'; there are hanging_yarn"),
        (["hanging_yarn", "--size", "0"], 2, "hanging_yarn: the size, segments, must be a whole number, at least 1; not 0"),
        (["hanging_yarn", "--size", "x"], 2, 'unable to convert "x" into int'),
        (["hanging_yarn", "--set", "k_s=-2"], 2, "hanging_yarn: k_s must be positive, in N; not '-2'"),
        (["hanging_yarn", "--set", "k_s"], 2, "--set takes name=value; not 'k_s'"),
        (["hanging_yarn", "--set", "g=1", "g=2"], 2, "--set gives g twice"),
        (["hanging_yarn", "--set", "tip_force=-1"], 2, "tip_force = -1 N lifts the yarn"),
        (["hanging_yarn", "--solver", "magic"], 2, "there is no solver 'magic'; there are direct, superlu"),
        (["hanging_yarn", "--resume"], 2, "--resume needs --out"),
        (["hanging_yarn", "--resume", "--out", "nowhere"], 2, "nowhere holds no run to go on with"),
        (["hanging_yarn", "--out", "file.txt"], 2, "file.txt is not a folder"),
        (["hanging_yarn", "--out", "out", "--every", "nan"], 2, "--every takes seconds, 0 or more"),
        (["none.py"], 2, "there is no file none.py"),
        (["bad.py"], 2, "bad.py:2:"),
        (["raising.py"], 2, "raising.py:2:1: ZeroDivisionError: division by zero"),
        (["empty.py"], 2, "empty.py must declare one scene, a function under @scene(...); it declares 0"),
        (["unnamed.py"], 2, "unnamed.py:5:1: t: NameError: name 'missing' is not defined"),
        (["nothing.py"], 2, "t must return Static(...) or Moving(...); it returns NoneType"),
        (["still_cloth", "--set", "steps=1e300"], 2, "still_cloth: steps must be at most 1e+09; not '1e300'"),
        (["heavy_cantilever", "--set", "length=1e3"], 2, "rho g length^3/k_b = 4.9e+14: at most 1e+06"),
        (["elastica", "--set", "alpha=1e9"], 2, "alpha = P L^2/EI must be positive and at most 100000"),
        (["elastica", "--size", "999999999999999"], 3, "yarnverify: this needs more memory than there is: Unable to allocate"),
        (["bias_extension", "--set", "strain=2"], 2, "the cloth cannot be deformed so far"),
    ],
)  # fmt: skip
def test_one_clear_error(
    arguments: list[str], status: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    head = "from yarnverify.simulation.scene import scene\n\n@scene(title='', size='', sizes=(1, 2, 3))\ndef t(size: int):\n"
    scenes = [("unnamed", head + "    return missing"), ("nothing", head + "    return None")]
    for name, text in (("bad", "x = 1\ndef"), ("raising", "x = 1\n1 / 0"), ("empty", ""), ("file", ""), *scenes):
        Path(f"{name}.{'txt' if name == 'file' else 'py'}").write_text(text, encoding="utf-8")
    ended, out, err = caller(monkeypatch, capsys)("simulate", *arguments)
    assert ended == status and message in err, err
    assert err.count("\n") == 1 and not out


def test_yarns_too_stiff_for_their_coordinates_are_refused() -> None:
    with pytest.raises(
        InputError, match=r"k_s = 1e\+15 N is 2e\+19 times the weight of 0.12 m of it: .* hangs; at most 5.9e\+11 N"
    ):
        run("catenary", sizes=(20,), given=("k_s=1e15",))
    with pytest.raises(InputError, match=r"k_s = 1e\+12 N is 3e\+18 times k_b .*; at most 4.*e\+09 N"):
        run("elastica", sizes=(160,), given=("k_s=1e12",))


def test_missed_goals_are_exit_status_1(
    swing: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    swing.write_text(STAGED.replace("common = dict(", "common = dict(known=[Known('x', 'm', 1.0, lambda end: 2.0)], "))
    status, out, _ = caller(monkeypatch, capsys)("simulate", str(swing), "--set", "steps=2", "rest=yes")
    assert status == 1
    assert "swing, direct, size 3: x has the error 1.0e+00, and 1e-12 is allowed" in out


def test_scenes_are_listed(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    from yarnverify.simulation.scenes import SCENES

    status, out, _ = caller(monkeypatch, capsys)("simulate")
    assert status == 0
    assert [line.split()[0] for line in out.splitlines()] == [scene.name for scene in SCENES]


@pytest.mark.skipif(sys.platform == "win32", reason="limits of processes")
def test_a_full_disk_is_one_error(tmp_path: Path, swing: Path) -> None:
    limited = ["sh", "-c", "trap '' XFSZ; ulimit -f 6; exec \"$@\"", "sh"]  # blocks of 512 bytes
    command = [
        sys.executable,
        "-m",
        "yarnverify",
        "simulate",
        str(swing),
        "--no-pictures",
        "--out",
        str(tmp_path / "out"),
    ]
    ended = subprocess.run([*limited, *command], capture_output=True, text=True, timeout=60)
    assert ended.returncode == 3 and ended.stderr.count("\n") == 1
    assert "file too large" in ended.stderr and not list((tmp_path / "out").rglob("*.part*"))


def test_a_run_without_solution_tells_where_its_last_good_state_is(tmp_path: Path, swing: Path) -> None:
    text = STAGED.replace('rest == "yes":', 'rest == "yes":\n        common["options"] = {"iterations": 1}')
    swing.write_text(text, encoding="utf-8")
    with pytest.raises(
        NotRunError, match=r"swing at size 3, direct, after 0 stages: no equilibrium after 1 iterations"
    ):
        run(str(swing), tmp_path / "out", given=("rest=yes",))
