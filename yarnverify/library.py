"""Where documents and declarations lie, and which declarations a document is judged by.

Reads files and text only, so that a verdict that is already known costs next to nothing.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
import tomllib
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from yarnverify.errors import InputError, NotRunError
from yarnverify.files import write_text

MAIN_DOCUMENT = "cirio2014.md"
_DISPLAY = re.compile(r"\$\$(.*?)\$\$", re.DOTALL)
_SPACE = re.compile(r"\\(?:quad|qquad|thinspace)(?![A-Za-z])|\\[,;:! ]|~|\s+")
_AT = re.compile(r" \(at line (\d+), column (\d+)\)$")
_NUMBER = re.compile(r"(?:\\tag\{[^}]*\}|\(\d+[a-z]?\))[.,;]*$")
_DECLARES = re.compile(r"""document\s*=\s*["']([^"']+)["']""")


@dataclass(frozen=True)
class Shelf:
    """A folder of derivations, as far as it concerns one document.

    ``document`` is the name that its declarations give the document; ``folder`` is None where nothing is declared.
    """

    folder: Path | None
    document: str
    how: str
    beside: Path | None = None

    @property
    def errata(self) -> Path | None:
        """Where accepted errata are recorded: with the declarations, or beside a document that is judged by itself."""
        place = self.folder or self.beside
        return None if place is None else place / "errata.toml"


@dataclass(frozen=True)
class Erratum:
    """A refuted equation that is known and accepted: its printed number, the change that mends it, and the reason."""

    equation: str
    change: str
    reason: str


def derivations() -> Path:
    """The folder of derivations that comes with the package, in a checkout or installed."""
    package = Path(__file__).parent
    installed = package / "derivations"
    return installed if installed.is_dir() else package.parent / "derivations"


def declared_files(folder: Path) -> list[Path]:
    """What all that is derived depends on: the declared energies of a folder and its documents, sorted."""
    return sorted([*folder.glob("*.py"), *folder.glob("*.md")])


def _displays(text: str) -> set[str]:
    return {_NUMBER.sub("", _SPACE.sub("", found)).rstrip(".,;") for found in _DISPLAY.findall(text)}


def shelf_for(document: Path, text: str, choice: str | None = None) -> Shelf:
    """Which declarations a document is judged by.

    Parameters
    ----------
    document, text
        The document's path and contents.
    choice
        A folder of derivations, ``"none"``, or None to find out: the document's own folder if its declarations name the
        document, else those that come with the package if the document is an edition of theirs (at least half of its
        displays are displays of it), else none.
    """
    if choice == "none":
        return Shelf(None, document.name, "by itself alone", document.parent)
    if choice is not None:
        folder = Path(choice)
        names = declared_documents(folder)
        if not names:
            what = "declares no energies of a document" if folder.is_dir() else "is no folder"
            raise InputError(f"{folder}: {what}; give a folder of derivations, or none")
        name = document.name if document.name in names else _nearest(folder, names, text)[1]
        return Shelf(folder, name, f"by the energies declared for {name} in {folder}")
    if document.name in declared_documents(document.parent):
        return Shelf(document.parent, document.name, f"by the energies declared in {document.parent}")
    common, name = _nearest(derivations(), declared_documents(derivations()), text)
    if 2 * common >= len(_displays(text)) > 0:
        return Shelf(
            derivations(), name, f"by the energies declared for {name}, with which it shares {common} displays"
        )
    return Shelf(None, document.name, "by itself alone: no declared energies belong to it", document.parent)


def _nearest(folder: Path, names: set[str], text: str) -> tuple[int, str]:
    """The document among some that shares most displays with a text, and how many."""
    mine = _displays(text)
    shared = [(len(mine & _displays(_text(folder / name))), name) for name in sorted(names)]
    return max(shared, key=lambda item: item[0])


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""


def declared_documents(folder: Path) -> set[str]:
    """The documents that the energies of a folder name."""
    return {name for path in folder.glob("*.py") for name in _DECLARES.findall(_text(path))}


def errata(shelf: Shelf) -> tuple[Erratum, ...]:
    """The accepted errata of a document.

    Raises
    ------
    InputError
        Where the file is not TOML, or an entry lacks its equation, change or reason.
    """
    path = shelf.errata
    if path is None or not path.is_file():
        return ()
    try:
        entries = tomllib.loads(path.read_text(encoding="utf-8")).get("erratum", [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            raise InputError(f"{path}: errata are tables, each under a line [[erratum]]")
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        text, at = str(error), _AT.search(str(error))
        place = (str(path), int(at[1]), int(at[2])) if at else (str(path), 1, 1)
        raise InputError(text[: at.start()] if at else text, place) from None
    found = []
    for number, entry in enumerate(entries, 1):
        for key in ("document", "equation", "change", "reason"):
            if not isinstance(entry.get(key), str) or not entry[key].strip():
                told = " as yarnverify prove proposes it" if key == "change" else ""
                raise InputError(f"erratum {number} needs a text for {key!r}{told}", _place_of(path, number))
        if entry["document"] == shelf.document:
            found.append(Erratum(entry["equation"], entry["change"], entry["reason"]))
    return tuple(found)


def _place_of(path: Path, number: int) -> tuple[str, int, int]:
    """File and line of an erratum, counted from 1."""
    lines = [i for i, line in enumerate(_text(path).splitlines(), 1) if line.strip() == "[[erratum]]"]
    return str(path), lines[number - 1] if len(lines) >= number else 1, 1


def prints_formulas(path: Path) -> bool:
    """Whether a file has numbered displays."""
    found = (_SPACE.sub("", display) for display in _DISPLAY.findall(_text(path)))
    return any(_NUMBER.search(display) for display in found)


# -- results that are already known -----------------------------------------------------------------------------------


def fingerprint(parts: Iterable[bytes | Path]) -> str:
    """Hash of contents: of bytes, of files, and of all that decides a verdict or a kernel in this package."""
    import importlib.metadata

    digest = hashlib.sha256()
    package = Path(__file__).parent
    symbolic = (path for path in (package / "symbolic").rglob("*") if path.suffix in (".py", ".lark", ".jinja"))
    own = sorted([*package.glob("*.py"), *(package / "kernels").glob("*.py"), *symbolic])
    for part in [*parts, sys.version.encode(), *own]:
        data = part.read_bytes() if isinstance(part, Path) else part
        digest.update(len(data).to_bytes(8, "big") + data)
    for name in ("sympy", "python-flint", "lark", "jinja2"):
        digest.update(importlib.metadata.version(name).encode())
    return digest.hexdigest()


def cache_folder() -> Path:
    """Where results are kept between runs."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "yarnverify"


def known(
    parts: Iterable[bytes | Path], make: Callable[[], dict[str, Any]], cache: bool = True
) -> tuple[dict[str, Any], bool]:
    """A record as JSON holds it, and whether it was there from an earlier run.

    Parameters
    ----------
    parts
        All that the record is made from, besides this package.
    make
        Makes the record.
    cache
        Whether a record that is there is used and a new one is kept.
    """
    if not cache:
        return make(), False
    key = fingerprint(parts)
    record = recall(key)
    if record is not None:
        return record, True
    record = make()
    remember(key, record)
    return record, False


def recall(key: str) -> dict[str, Any] | None:
    """A record stored under a fingerprint, or None."""
    try:
        kept = json.loads((cache_folder() / f"{key}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return kept["record"] if isinstance(kept, dict) and kept.get("key") == key else None


def remember(key: str, record: Any) -> None:
    """Store a result; where the cache cannot be written, the next run works it out again."""
    path = cache_folder() / f"{key}.json"
    with suppress(NotRunError):
        write_text(json.dumps({"key": key, "record": record}), path)
