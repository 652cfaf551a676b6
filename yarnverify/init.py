"""``yarnverify init``: a small working start for energies and a document of one's own."""

from __future__ import annotations

import re
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from yarnverify.errors import InputError, NotRunError, why

_START = Path(__file__).parent / "start"


def init(folder: Path) -> list[str]:
    """Write the start into a new or empty folder; what was written, and what to do next.

    Raises
    ------
    InputError
        Where the folder holds something already, or kernels could not be imported from it.
    NotRunError
        Where it cannot be written.
    """
    name = folder.resolve().name
    if not name.isidentifier():
        better = re.sub(r"\W+", "_", name).strip("_") or "my_model"
        better = better if better.isidentifier() else f"model_{better}"
        raise InputError(f"{folder}: Python could not import kernels from a folder of this name; call it {better}")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: is there already, and nothing is overwritten; give a new folder")
    templates = Environment(loader=FileSystemLoader(_START), undefined=StrictUndefined, keep_trailing_newline=True)
    lines = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for template in sorted(templates.list_templates()):
            path = folder / template.removesuffix(".jinja").replace("document", name)
            path.write_text(templates.get_template(template).render(name=name), encoding="utf-8")
            lines.append(f"{path}: written")
    except OSError as error:
        raise NotRunError(f"{folder}: cannot write: {why(error)}") from None
    return [*lines, f"Next: yarnverify report {folder}"]
