"""Files that are there whole or not at all. The standard library alone."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from yarnverify.errors import NotRunError, why


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A name beside the wanted one to write to; moved there once all is written and on the disk.

    Raises
    ------
    NotRunError
        It cannot be written; what was there before is still there.
    """
    part = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")  # of this process alone
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        with part.open("rb") as written:
            os.fsync(written.fileno())
        os.replace(part, path)
        _sync(path.parent)
    except OSError as error:
        raise NotRunError(f"{path}: cannot write: {why(error)}") from error
    finally:
        with suppress(OSError):  # such as a folder that is none
            part.unlink(missing_ok=True)


def _sync(folder: Path) -> None:
    """Make the new name last as well, where folders can be synchronised."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def as_seen(path: Path) -> Path:
    """A path as one would write it here: from the working folder, where it lies in that."""
    full = path.resolve()
    return full.relative_to(Path.cwd()) if full.is_relative_to(Path.cwd()) else path


def write_bytes(data: bytes, path: Path) -> None:
    """Write data, whole or not at all."""
    with whole(path) as part:
        part.write_bytes(data)


def write_text(text: str, path: Path) -> None:
    """Write a text in UTF-8, whole or not at all."""
    write_bytes(text.encode("utf-8"), path)


def write_record(record: Mapping[str, Any], path: Path) -> None:
    """Write JSON data, whole or not at all."""
    write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n", path)
