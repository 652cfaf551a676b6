"""The kinds of files that carry states out and results in, by the name's ending: ``FORMATS``."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify import arrays
from yarnverify.check.conventions import by_component
from yarnverify.errors import InputError

Array = NDArray[Any]


@dataclass(frozen=True)
class States:
    """States for somebody's code.

    Attributes
    ----------
    energy, key
        Which energy, and a short text that is another for other states.
    rows, tags
        Names of the entries of a state, and of each state.
    q, values
        (n, rows), and (n,) or (n, 3) of each argument by name.
    dtype
        In which all are exact.
    """

    energy: str
    key: str
    rows: tuple[str, ...]
    tags: tuple[str, ...]
    q: Array
    values: Mapping[str, Array]
    dtype: str

    def named(self) -> dict[str, Array]:
        """Everything as arrays by name."""
        numbers = {name: value.astype(self.dtype) for name, value in {"q": self.q, **self.values}.items()}
        return {**numbers, "tags": np.array(self.tags), "key": np.array(self.key)}


def _json_text(states: States) -> bytes:
    """One state a line."""
    record = {
        "states_of": states.energy,
        "key": states.key,
        "rows": list(states.rows),
        "arguments": list(states.values),
        "tags": list(states.tags),
        **{name: value.tolist() for name, value in states.values.items()},
        "q": states.q.tolist(),
    }
    parts = []
    for name, value in record.items():
        if name in ("q", "tags"):
            inner = ",\n  ".join(json.dumps(item) for item in value)
            parts.append(f' "{name}": [\n  {inner}\n ]')
        else:
            parts.append(f" {json.dumps(name)}: {json.dumps(value)}")
    return ("{\n" + ",\n".join(parts) + "\n}\n").encode()


def _csv_text(states: States) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    columns = by_component(states.values, axis=1)
    writer.writerow([*states.rows, *columns])
    writer.writerows(
        [repr(float(x)) for x in (*row, *(column[at] for column in columns.values()))]
        for at, row in enumerate(states.q)
    )
    return text.getvalue().encode()


def _read_npz(path: Path) -> dict[str, Any]:
    try:
        with np.load(path) as stored:
            return {name: stored[name] for name in stored.files}
    except (ValueError, EOFError, KeyError) as error:
        raise InputError(f"{path}: is no NPZ file: {error}") from None
    except Exception as error:  # zipfile has its own
        raise InputError(f"{path}: is no NPZ file: {type(error).__name__}") from None


def _read_mat(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        with path.open("rb") as file:
            stored = loadmat(file)
    except NotImplementedError:
        raise InputError(f"{path}: is a MATLAB 7.3 file; {_saved(path)}") from None
    except (MatReadError, ValueError, TypeError, EOFError, KeyError, IndexError):
        raise InputError(f"{path}: is no MATLAB file of version 7 or older; {_saved(path)}") from None
    return {name: value for name, value in stored.items() if not name.startswith("__")}


def _saved(path: Path) -> str:
    return f"write it with save('-v7', '{path.name}', ...)"


def _read_json(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise InputError(error.msg, (str(path), error.lineno, error.colno)) from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is no text") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: holds no object with an array for each output")
    return found


def numbers(value: Any, path: Path, name: str) -> Array:
    """An output as an array of doubles.

    Raises
    ------
    InputError
        For what is not made of real numbers.
    """
    if hasattr(value, "toarray"):
        value = value.toarray()  # sparse
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "O" and value.size:
            value = _stacked(value, path, name)
        if value.dtype.names:
            raise InputError(f"{path}: {name} is a struct; save its arrays themselves")
        if value.dtype.kind not in "fiub":
            raise InputError(f"{path}: {name} is not made of real numbers but of {value.dtype}")
        return value.astype(np.float64)

    def number(item: Any) -> Any:
        if isinstance(item, list):
            return [number(part) for part in item]
        if item is None:
            return math.nan
        if isinstance(item, str):
            return _read(item)
        if isinstance(item, bool) or not isinstance(item, int | float):
            raise ValueError(f"{item!r} is no number")
        return float(item)

    try:
        return np.array(number(value), dtype=np.float64)
    except (ValueError, OverflowError) as error:
        raise InputError(f"{path}: {name}: {error}") from None


def _stacked(cells: Array, path: Path, name: str) -> Array:
    """A cell array with a matrix for each state."""
    parts = [np.asarray(part.toarray() if hasattr(part, "toarray") else part) for part in cells.flat]
    if len({part.shape for part in parts}) > 1:
        raise InputError(f"{path}: {name} is a cell array of matrices of different sizes")
    return np.stack(parts)


def _read(text: str) -> float:
    text = text.strip()
    return float.fromhex(text) if "x" in text.lower() else float(text)


def read_csv(path: Path, returns: Sequence[tuple[str, int]], n: int) -> tuple[list[str], Array]:
    """Results of a CSV file, whose lines hold all outputs one after the other.

    Raises
    ------
    InputError
        Where it is not of that kind, or not of that shape.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError:
        raise InputError(f"{path}: is no text") from None
    rows: list[list[float]] = []
    for number, line in enumerate(lines, 1):
        words = line.replace(",", " ").replace(";", " ").split()
        if not words or words[0].startswith("#"):
            continue
        try:
            rows.append([_read(word) for word in words])
        except ValueError as error:
            if not rows and number == 1:
                continue  # a heading
            raise InputError(str(error), (str(path), number, 1)) from None
    if len(rows) != n:
        raise InputError(f"{path}: has {len(rows)} lines of numbers, not {n}, one for each state")
    total = sum(size for _, size in returns)
    for number, row in enumerate(rows, 1):
        if len(row) != total:
            shown = ", ".join(f"{name} {size}" for name, size in returns)
            raise InputError(
                f"{path}: state {number} has {len(row)} numbers, not {total} ({shown}); say what there is with --returns"
            )
    return [name for name, _ in returns], np.array(rows, dtype=np.float64)


@dataclass(frozen=True)
class Format:
    """A kind of file: what its name ends in, how states are written, and how arrays by name are read; CSV has no names."""

    ending: str
    written: Callable[[States], bytes]
    read: Callable[[Path], dict[str, Any]] | None


FORMATS = (
    Format(".json", _json_text, _read_json),
    Format(".npz", lambda states: arrays.npz(states.named()), _read_npz),
    Format(".mat", lambda states: arrays.mat(states.named(), f"states of {states.energy}"), _read_mat),
    Format(".csv", _csv_text, None),
)


def format_of(path: Path, option: str) -> Format:
    """The kind of a file, by its name's ending.

    Raises
    ------
    InputError
        For another.
    """
    found = next((known for known in FORMATS if known.ending == path.suffix.lower()), None)
    if found is None:
        endings = [known.ending for known in FORMATS]
        raise InputError(f"{option} {path}: the name must end in {', '.join(endings[:-1])} or {endings[-1]}")
    return found
