"""States and results as files, for code in any language: JSON, NPZ or CSV, by the name's ending.

Inputs (JSON, NPZ): ``q``, one list a state in the order of ``rows``; each argument by its name, one value a state; ``tags``.
CSV: a heading, then one line a state: its rows, then the arguments.
Results (JSON, NPZ): one array for each output by its name, with one entry a state. CSV: one line a state, all outputs one after
the other, with or without a heading. Numbers are written so that they are read back exactly; hexadecimal floats are read too.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.check.conventions import ALIASES, Convention, by_component
from yarnverify.errors import InputError, NotRunError, why

Array = NDArray[Any]
KINDS = (".json", ".npz", ".csv")


def kind_of(path: Path, option: str) -> str:
    """The ending of a file, which says what it is.

    Raises
    ------
    InputError
        For another.
    """
    if path.suffix not in KINDS:
        raise InputError(f"{option} {path}: the name must end in {', '.join(KINDS[:-1])} or {KINDS[-1]}")
    return path.suffix


def key_of(q: Array, values: Mapping[str, Array]) -> str:
    """A short text that is another for other states."""
    digest = hashlib.sha256(np.ascontiguousarray(q).tobytes())
    for name in sorted(values):
        digest.update(name.encode() + np.ascontiguousarray(values[name]).tobytes())
    return digest.hexdigest()[:16]


def write_inputs(
    path: Path, energy: str, convention: Convention, q: Array, values: Mapping[str, Array], tags: Sequence[str]
) -> None:
    """Write states for somebody's code.

    Parameters
    ----------
    path
        Of the file; its ending says how.
    energy, convention, tags
        Which energy, in which order, and the name of each state.
    q, values
        (n, rows), and (n,) by name.

    Raises
    ------
    InputError, NotRunError
        For another ending; where it cannot be written.
    """
    kind = kind_of(path, "--write-inputs")
    head = {"states_of": energy, "key": key_of(q, values), "rows": list(convention.labels), "arguments": list(values)}
    try:
        if kind == ".npz":
            arrays = {"q": q, **values}
            rounded = {name: value.astype(convention.dtype) for name, value in arrays.items()}
            write_npz(path, {**rounded, "tags": np.array(tags), "key": np.array(head["key"])})
        elif kind == ".json":
            record = {
                **head,
                "tags": list(tags),
                **{name: value.tolist() for name, value in values.items()},
                "q": q.tolist(),
            }
            path.write_text(_lines(record), encoding="utf-8")
        else:
            text = io.StringIO()
            writer = csv.writer(text, lineterminator="\n")
            columns = by_component(values, axis=1)
            writer.writerow([*convention.labels, *columns])
            writer.writerows(
                [repr(float(x)) for x in (*row, *(column[at] for column in columns.values()))]
                for at, row in enumerate(q)
            )
            path.write_text(text.getvalue(), encoding="utf-8")
    except OSError as error:
        raise NotRunError(f"{path}: cannot write: {why(error)}") from None


def write_npz(path: Path, arrays: Mapping[str, Array]) -> None:
    """Write arrays, the same bytes every time: without the time of day that an archive has otherwise."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, array in arrays.items():
            text = io.BytesIO()
            np.save(text, array)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), text.getvalue())


def _lines(record: Mapping[str, Any]) -> str:
    """JSON with one state a line."""
    parts = []
    for name, value in record.items():
        if name in ("q", "tags"):
            inner = ",\n  ".join(json.dumps(item) for item in value)
            parts.append(f' "{name}": [\n  {inner}\n ]')
        else:
            parts.append(f" {json.dumps(name)}: {json.dumps(value)}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def read_results(
    path: Path, returns: Sequence[tuple[str, int]], n: int, key: str, named: bool
) -> tuple[list[str], Array]:
    """Results that somebody's code wrote.

    Parameters
    ----------
    path
        Of the file.
    returns
        Name and size of each output that may come.
    n, key
        How many states there are, and which.
    named
        Whether all of ``returns`` must be there; otherwise those that are there count.

    Returns
    -------
    names, flat
        Of the outputs that are there, and (n, total).

    Raises
    ------
    InputError
        Where the file is not there, not of that kind, or not of that shape.
    """
    kind = kind_of(path, "--outputs")
    try:
        if kind == ".csv":
            return _read_csv(path, returns, n)
        found = _read_npz(path) if kind == ".npz" else _read_json(path)
    except OSError as error:
        raise InputError(f"{path}: cannot read: {why(error)}") from None
    given = str(found.pop("key", key))
    if given != key:
        raise InputError(
            f"{path}: belongs to other states (key {given}, not {key}); write the inputs again, with the same options"
        )
    by_meaning = {ALIASES.get(name.lower(), name.lower()): name for name in found}
    names, parts = [], []
    for name, size in returns:
        there = name if name in found else by_meaning.get(name)
        if there is None:
            if named:
                raise InputError(f"{path}: has no {name}; it has {', '.join(found) or 'nothing'}")
            continue
        value = _numbers(found[there], path, name)
        if value.size != n * size:
            raise InputError(
                f"{path}: {name} has {value.size} numbers in shape {value.shape}, not {size} for each of {n} states"
            )
        names.append(name)
        parts.append(value.reshape(n, size))
    if not names:
        raise InputError(
            f"{path}: has none of {', '.join(name for name, _ in returns)}; it has {', '.join(found) or 'nothing'}"
        )
    return names, np.hstack(parts)


def _read_npz(path: Path) -> dict[str, Any]:
    try:
        with np.load(path) as stored:
            return {name: stored[name] for name in stored.files}
    except (ValueError, EOFError, KeyError) as error:
        raise InputError(f"{path}: is no NPZ file: {error}") from None
    except Exception as error:  # zipfile has its own
        raise InputError(f"{path}: is no NPZ file: {type(error).__name__}") from None


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


def _numbers(value: Any, path: Path, name: str) -> Array:
    if isinstance(value, np.ndarray):
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


def _read(text: str) -> float:
    text = text.strip()
    return float.fromhex(text) if "x" in text.lower() else float(text)


def _read_csv(path: Path, returns: Sequence[tuple[str, int]], n: int) -> tuple[list[str], Array]:
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
