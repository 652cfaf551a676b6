"""Files that are there whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from yarnverify.errors import NotRunError


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A name beside the wanted one to write to; moved there once all is written and on the disk.

    Raises
    ------
    NotRunError
        It cannot be written; what was there before is still there.
    """
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        with part.open("rb") as written:
            os.fsync(written.fileno())
        os.replace(part, path)
    except OSError as error:
        raise NotRunError(f"{path} cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
