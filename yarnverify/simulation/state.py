"""States on disk: written whole or not at all, and taken up again to the same bits.

save("run.npz", identity=identity("hanging", {"k_s": 10.0, "size": 40}), **motion.arrays())
motion = Motion.of(load("run.npz", identity("hanging", {"k_s": 10.0, "size": 40})))
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError
from yarnverify.files import whole

Array = NDArray[Any]
FORMAT = 1


def identity(scene: str, parameters: Mapping[str, Any]) -> str:
    """What a run is a run of: a scene and its parameters, numbers to the last bit, arrays by what they hold."""
    return json.dumps({"scene": scene, "parameters": _plain(dict(parameters))}, sort_keys=True)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray) and value.size > 16:
        return f"{value.dtype}{list(value.shape)} {hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()}"
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    return value if isinstance(value, str | int | float | bool) or value is None else repr(value)


def save(path: str | os.PathLike[str], *, identity: str = "", **arrays: ArrayLike) -> None:
    """Write arrays to an npz file, whole or not at all.

    Raises
    ------
    NotRunError
        The disk is full, or the file cannot be written; an older file stays as it was.
    """
    path = Path(path)
    named: dict[str, Any] = {"format": np.array(FORMAT), "identity": np.array(identity)}
    named |= {name: np.asarray(values) for name, values in arrays.items()}
    for name, values in named.items():
        if values.dtype.hasobject:
            raise TypeError(f"the state {name} cannot be saved: {values.dtype} is not an array of numbers")
    with whole(path) as part, part.open("wb") as file:
        np.savez(file, **named)


def load(path: str | os.PathLike[str], identity: str = "") -> dict[str, Array]:
    """The arrays of a saved state.

    Raises
    ------
    InputError
        There is no such file, it is damaged, or it belongs to another run.
    """
    try:
        with (
            Path(path).open("rb") as stream,
            np.load(stream, allow_pickle=False) as file,
        ):  # an npy file gives an array, which is no such thing
            found = {name: file[name] for name in file.files}
        version, known = int(found.pop("format")), str(found.pop("identity"))
    except FileNotFoundError:
        raise InputError(f"there is no saved state {path}") from None
    except Exception as error:  # whatever a damaged file makes its readers raise, and they are many
        reason = str(error).partition("\n")[0] or type(error).__name__
        raise InputError(f"{path} is not a complete saved state: {reason}") from None
    if version != FORMAT:
        raise InputError(f"{path} was saved in format {version}; this version reads format {FORMAT}")
    if identity and known != identity:
        raise InputError(f"{path} belongs to another run: {_difference(known, identity)}")
    return found


def _difference(known: str, wanted: str) -> str:
    """What two identities differ in, in words."""
    try:
        one, two = json.loads(known), json.loads(wanted)
    except ValueError:
        return "it carries no identity"
    if one["scene"] != two["scene"]:
        return f"scene {one['scene']}, not {two['scene']}"
    names = sorted({*one["parameters"], *two["parameters"]})
    of = [(name, one["parameters"].get(name), two["parameters"].get(name)) for name in names]
    return ", ".join(f"{name} = {a}, not {b}" for name, a, b in of if a != b)
