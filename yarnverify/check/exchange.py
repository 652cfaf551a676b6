"""States and results as files, for code in any language: JSON, NPZ, MATLAB or CSV, by the name's ending.

Inputs: ``q``, one list a state in the order of ``rows``; each argument by its name, one value a state; ``tags``.
CSV: a heading, then one line a state: its rows, then the arguments.
Results: one array for each output by its name, with one entry a state, the states first or last. CSV: one line a state, all
outputs one after the other, with or without a heading. Numbers are written so that they are read back exactly; hexadecimal
floats are read too.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.check.conventions import ALIASES, Convention
from yarnverify.check.formats import States, format_of, numbers, read_csv
from yarnverify.errors import InputError, why
from yarnverify.files import write_bytes

Array = NDArray[Any]


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
    kind = format_of(path, "--write-inputs")
    states = States(energy, key_of(q, values), convention.labels, tuple(tags), q, values, convention.dtype)
    write_bytes(kind.written(states), path)


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
    kind = format_of(path, "--outputs")
    try:
        if kind.read is None:
            return read_csv(path, returns, n)
        found = kind.read(path)
    except OSError as error:
        raise InputError(f"{path}: cannot read: {why(error)}") from None
    given = str(np.ravel(found.pop("key", key))[0])
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
        names.append(name)
        parts.append(_by_state(numbers(found[there], path, name), n, size, f"{path}: {name}"))
    if not names:
        raise InputError(
            f"{path}: has none of {', '.join(name for name, _ in returns)}; it has {', '.join(found) or 'nothing'}"
        )
    return names, np.hstack(parts)


def _by_state(value: Array, n: int, size: int, where: str) -> Array:
    """(n, size) of an array with the states first, or last, or of one long row of numbers."""
    if value.size != n * size:
        raise InputError(f"{where} has {value.size} numbers in shape {value.shape}, not {size} for each of {n} states")
    if value.ndim > 1 and value.shape[0] != n and value.shape[-1] == n:
        value = np.moveaxis(value, -1, 0)
    elif value.ndim > 1 and n not in (value.shape[0], value.shape[-1]) and 1 not in value.shape:
        raise InputError(f"{where} has the shape {value.shape}; give the {n} states first, or last")
    return value.reshape(n, size)
