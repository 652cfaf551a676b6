"""Saved states: whole or not at all, of this run or refused."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from yarnverify.errors import InputError, NotRunError
from yarnverify.simulation.state import identity, load, save

HANGING = identity("hanging", {"k_s": 10.0, "size": 40})
ARRAYS: dict[str, Any] = {"Q": np.random.default_rng(0).normal(size=50), "time": 0.25, "steps": 7, "kind": "midpoint"}


def test_what_was_saved_comes_back_to_the_last_bit(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    odd = np.array([0.1, -0.0, 5e-324, np.inf, -np.nan])
    save(path, identity=HANGING, odd=odd, **ARRAYS)
    found = load(path, HANGING)
    assert set(found) == {"odd", *ARRAYS}
    assert found["odd"].tobytes() == odd.tobytes() and np.array_equal(found["Q"], ARRAYS["Q"])
    assert float(found["time"]) == 0.25 and int(found["steps"]) == 7 and str(found["kind"]) == "midpoint"
    first = path.read_bytes()
    save(path, identity=HANGING, odd=odd, **ARRAYS)
    assert os.listdir(tmp_path) == ["run.npz"]
    assert path.read_bytes() == first


def test_states_of_another_run_are_refused_with_the_difference(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    save(path, identity=HANGING, **ARRAYS)
    for other, message in (
        (identity("cantilever", {"k_s": 10.0, "size": 40}), "scene hanging, not cantilever"),
        (identity("hanging", {"k_s": 10.000000000000002, "size": 40}), r"k_s = 10.0, not 10.000000000000002"),
        (identity("hanging", {"k_s": 10.0}), "size = 40, not None"),
        (identity("hanging", {"k_s": 10.0, "size": 40, "g": np.arange(3.0)}), "g = None, not"),
    ):
        with pytest.raises(InputError, match=rf"run.npz belongs to another run: .*{message}"):
            load(path, other)
    assert load(path)["steps"] == 7  # whoever does not say which run takes any
    save(path, **ARRAYS)
    with pytest.raises(InputError, match="carries no identity"):
        load(path, HANGING)


def test_identities_tell_arrays_apart() -> None:
    big = np.arange(100.0)
    one, two, three = (identity("x", {"a": a}) for a in (big, big + 0.0, big + (big == 50) * 1e-14))
    assert one == two != three
    assert identity("x", {"a": 1, "b": 2}) == identity("x", {"b": 2, "a": 1})
    assert identity("x", {"a": np.float64(0.1)}) == identity("x", {"a": 0.1})


@pytest.mark.parametrize("missing", ["nothing.npz", "folder"])
def test_a_file_that_is_not_there(tmp_path: Path, missing: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match=missing):
        load(tmp_path / missing)


def test_damaged_files_are_refused_or_right(tmp_path: Path) -> None:
    path, damaged = tmp_path / "run.npz", tmp_path / "damaged.npz"
    save(path, identity=HANGING, Q=np.arange(20.0), steps=7)
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    cases = [whole[:k] for k in (0, 1, 10, 100, len(whole) // 2, len(whole) - 1)]
    for _ in range(300):
        data, at = bytearray(whole), int(rng.integers(len(whole)))
        data[at] ^= int(rng.integers(1, 256))
        cases.append(bytes(data))
    refused = 0
    for data in cases:
        damaged.write_bytes(data)
        try:
            found = load(damaged, HANGING)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error) and "damaged.npz" in str(error)
        else:
            assert np.array_equal(found["Q"], np.arange(20.0)) and int(found["steps"]) == 7
    assert refused > len(cases) // 2


@pytest.mark.parametrize("kind", ["npy", "pickle", "text", "another npz", "newer"])
def test_files_of_another_kind_are_refused(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "run.npz"
    if kind == "npy":
        with path.open("wb") as file:
            np.save(file, np.arange(3))
    elif kind == "pickle":
        with path.open("wb") as file:
            np.save(file, np.array([{}, None], dtype=object))
    elif kind == "text":
        path.write_text("k_s = 10\n")
    elif kind == "another npz":
        np.savez(path, x=np.arange(3))
    else:
        np.savez(path, format=99, identity=HANGING)
    with pytest.raises(InputError, match=r"run.npz (is not a complete saved state|was saved in format 99)"):
        load(path)


def test_a_disk_that_is_full_leaves_the_older_state(tmp_path: Path) -> None:
    """A limit on the size of files stands for the disk: the kernel refuses to write on."""
    pytest.importorskip("resource")
    code = """if True:
        import resource, sys
        import numpy as np
        from yarnverify.errors import NotRunError
        from yarnverify.simulation.state import load, save
        save("run.npz", Q=np.arange(10.0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        try:
            save("run.npz", Q=np.arange(10000.0))
        except NotRunError as error:
            print(error)
        print(load("run.npz")["Q"].size)
    """
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    first, second = done.stdout.splitlines()
    assert first.startswith("run.npz: cannot write: ") and second == "10"
    assert os.listdir(tmp_path) == ["run.npz"]


def test_a_folder_that_is_none_and_one_in_place_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "run.npz").mkdir()
    (tmp_path / "taken").write_text("")
    for path in (tmp_path / "run.npz", tmp_path / "taken" / "run.npz"):
        with pytest.raises(NotRunError, match=f"{path}: cannot write: "):
            save(path, **ARRAYS)
    assert sorted(os.listdir(tmp_path)) == ["run.npz", "taken"]


def test_an_interruption_while_writing_leaves_the_older_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.npz"
    save(path, Q=np.arange(3.0))

    def interrupted(file: Any, **arrays: Any) -> None:
        file.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez", interrupted)
    with pytest.raises(KeyboardInterrupt):
        save(path, Q=np.arange(4.0))
    assert os.listdir(tmp_path) == ["run.npz"] and load(path)["Q"].size == 3


def test_what_is_no_array_of_numbers_cannot_be_saved(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="the state Q cannot be saved"):
        save(tmp_path / "run.npz", Q=[{}, None])
    assert os.listdir(tmp_path) == []
