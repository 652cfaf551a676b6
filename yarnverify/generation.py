"""``yarnverify generate``: the kernels, from the derivations; files are written or compared, never edited."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from yarnverify.errors import InputError, NotRunError
from yarnverify.files import as_seen, write_text
from yarnverify.library import declared_files, known
from yarnverify.project import Project, project

DEFAULT_VARIANT = "accurate"
WRITTEN_BY_HAND = {
    "__init__.py", "arrays.py", "batch.py", "compiled.py", "doubledouble.py", "geometry.py", "inputs.py", "memory.py",
    "runtime.py", "special.py", "tape.py", "wide.py", "words.py",
}  # fmt: skip


@dataclass
class Outcome:
    """What a command that writes or compares files did; for a report, with the verdicts behind it."""

    record: dict[str, Any] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    differs: bool = False
    verdicts: dict[str, Any] = field(default_factory=dict)


def settle_files(folder: Path, texts: dict[str, str], check: bool, stale: list[str], again: str) -> Outcome:
    """Write texts below a folder, or compare them with what is there and show the difference.

    Parameters
    ----------
    folder, texts
        Where, and what: relative path to contents.
    check
        Compare instead of writing.
    stale
        Generated files that are there and should not be.
    again
        The command that writes them.
    """
    outcome = Outcome()
    for name, text in texts.items():
        path = folder / name
        seen = as_seen(path)
        old = path.read_bytes().decode("utf-8", "replace") if path.is_file() else None
        if old == text:
            continue
        if check:
            outcome.differs = True
            if old is None:
                outcome.lines.append(f"{seen}: is missing")
                continue
            shown = difflib.unified_diff(
                old.splitlines(), text.splitlines(), f"{seen} (file)", f"{seen} (generated)", lineterm=""
            )
            outcome.lines += list(shown) or [f"{seen}: line endings differ"]
            continue
        write_text(text, path)
        outcome.lines.append(f"{seen}: written")
    for name in stale:
        outcome.differs |= check
        if not check:
            (folder / name).unlink()
        outcome.lines.append(
            f"{as_seen(folder / name)}: {'belongs to nothing' if check else 'removed: belonged to nothing'}"
        )
    if check and outcome.differs:
        outcome.lines.append(f"Files differ from what the derivations give; to write them: {again}")
    elif not outcome.lines:
        outcome.lines.append(f"{len(texts)} files in {folder.name}/ are as generated.")
    return outcome


def generate_kernels(
    check: bool,
    advance: Callable[[str, int], None] = lambda label, total: None,
    cache: bool = True,
    of: Project | None = None,
) -> Outcome:
    """Generate every variant of every energy of a project.

    Parameters
    ----------
    check
        Compare instead of writing.
    advance
        Called as each module is made.
    cache
        Whether what the same derivations gave in an earlier run is used and kept.
    of
        The project; that of the package by default.

    Raises
    ------
    InputError, NotRunError
        For derivations that cannot be read or proved, and files that cannot be written.
    """

    place = of or project()

    def make() -> dict[str, Any]:
        from yarnverify.symbolic.modules import kernel_modules

        return asdict(kernel_modules(place.folder, place.document, DEFAULT_VARIANT, advance, place.package))

    what = [b"kernels", DEFAULT_VARIANT.encode(), place.package.encode(), place.document.encode()]
    made, _ = known([*what, *declared_files(place.folder)], make, cache)
    texts = made["texts"]
    there = {path.relative_to(place.kernels).as_posix() for path in place.kernels.rglob("*.py")}
    by_hand = set() if place.own else WRITTEN_BY_HAND
    stale = sorted(
        name for name in there - set(texts) - by_hand if not place.own or _is_generated(place.kernels / name)
    )
    outcome = settle_files(place.kernels, texts, check, stale, place.here("yarnverify generate"))
    outcome.record = made["operations"]
    outcome.lines += made["notes"] + made["failed"]
    outcome.differs |= bool(made["failed"])
    return outcome


def out_of_date(of: Project) -> list[str]:
    """A line that says so where kernels of one's own are not what the energies give by now."""
    try:
        differs = of.own and generate_kernels(True, of=of).differs
    except (InputError, NotRunError):
        return []
    now = of.here("yarnverify generate")
    return [f"The kernels are not what the energies give by now; to make these: {now}"] if differs else []


def _is_generated(path: Path) -> bool:
    """Whether a file says that it may be removed when nothing belongs to it any more."""
    return "Generated" in path.read_text(encoding="utf-8", errors="replace")[:2000]
