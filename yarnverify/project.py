"""A folder of derivations, and where what is made of it lies: the one that comes with the package, or your own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from yarnverify.errors import InputError
from yarnverify.files import as_seen
from yarnverify.library import declared_documents, derivations, prints_formulas


@dataclass(frozen=True)
class Project:
    """Where everything of one folder of derivations is.

    Attributes
    ----------
    folder
        Energies (``*.py``), the document with the printed formulas, ``errata.toml``.
    document
        Name of the document in the folder; empty where there are energies alone.
    kernels
        Where kernels are generated.
    package
        Name that the kernels are imported from, or empty for a relative import.
    reports
        Where the pages go.
    name
        What a command line calls it: empty for the folder that comes with the package.
    """

    folder: Path
    document: str
    kernels: Path
    package: str
    reports: Path
    name: str

    @property
    def own(self) -> bool:
        """Whether it is the user's: its kernels are written by a report, which only compares those of the package."""
        return bool(self.name)

    @property
    def source(self) -> str:
        """The folder as seen from its reports, for links."""
        return ".." if self.own else "../derivations"

    @property
    def prefix(self) -> str:
        """What stands before an energy's name on a command line."""
        return f"{self.name}/" if self.own else ""

    def command(self, words: str) -> str:
        """A command line for this folder, for pages: ``yarnverify prove`` becomes ``yarnverify prove NAME``."""
        return f"{words} {self.name}".strip()

    def here(self, words: str) -> str:
        """The same for a person at the terminal, who may have called from anywhere."""
        return f"{words} {as_seen(self.folder)}" if self.own else words


def project(folder: Path | None = None) -> Project:
    """The project of a folder; the one that comes with the package by default.

    Raises
    ------
    InputError
        If there is no such folder, or it has neither an energy nor a document, or more than one document.
    """
    mine = derivations()
    if folder is None or (folder.is_dir() and folder.resolve() == mine.resolve()):
        kernels = Path(__file__).parent / "kernels"
        return Project(mine, _document(mine), kernels, "yarnverify.kernels", Path("reports"), "")
    if not folder.is_dir():
        if folder.exists():
            raise InputError(f"{folder}: is a file; give the folder that it is in, {folder.parent}")
        raise InputError(f"{folder}: no such folder; a new one is made by: yarnverify init {folder}")
    document = _document(folder)
    if not document and not any(folder.glob("*.py")):
        raise InputError(
            f"{folder}: has no energy (*.py) and no document; a start is made by: yarnverify init NEW_FOLDER"
        )
    return Project(folder, document, folder / "kernels", "", folder / "reports", folder.resolve().name)


def find(target: str | None) -> tuple[Project, str | None]:
    """What a command line names: nothing, an energy of the package, a folder, or ``FOLDER/ENERGY``.

    Raises
    ------
    InputError
        For a folder that is not there, or holds nothing.
    """
    if target is None:
        return project(), None
    path = Path(target)
    if path.is_dir() and ("/" in target or any(path.glob("*.py")) or any(path.glob("*.md"))):
        return project(path), None
    if path.name == target and path.suffix != ".py":
        return project(), target
    return project(path.parent), path.name.removesuffix(".py")


def document_of(path: Path | None) -> Path | None:
    """A document itself, or the one that a folder holds; None for the default.

    Raises
    ------
    InputError
        For a folder without a document, or with several.
    """
    if path is None or not path.is_dir():
        return path
    found = project(path)
    if not found.document:
        raise InputError(
            f"{path}: has no document with numbered formulas to prove; its energies: yarnverify report {path}"
        )
    return path / found.document


def _document(folder: Path) -> str:
    """The one document of a folder: that which its energies name, or else the one that prints formulas."""
    found = sorted(declared_documents(folder)) or [
        path.name for path in sorted(folder.glob("*.md")) if path.name != "README.md" and prints_formulas(path)
    ]
    if len(found) > 1:
        raise InputError(f"{folder}: has {len(found)} documents, {' and '.join(found)}; give each a folder of its own")
    if found and not (folder / found[0]).is_file():
        raise InputError(f"{folder}: its energies name the document {found[0]}, which is not there")
    return found[0] if found else ""
