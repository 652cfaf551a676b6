"""The public functions and classes as data, read from the sources: what the reference page is made from."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path
from typing import Any

MODULES = {  # in reading order, with what each is for
    "symbolic/declare.py": "Declaring energies",
    "symbolic/formulas.py": "What formulas are made of",
    "symbolic/energies.py": "Declared energies as data",
    "kernels/accurate/bending.py": "Kernels; those of every other energy have the same functions",
    "kernels/runtime.py": "What all kernels share",
    "notebook.py": "In a notebook",
    "project.py": "Folders of one's own",
    "simulation/scene.py": "Scenes",
    "simulation/quantities.py": "Their parameters",
    "simulation/setting.py": "What is solved, and its known answers",
    "simulation/fabric.py": "Yarns, rings and weaves",
    "simulation/cloth.py": "What these hold",
    "simulation/tables.py": "Which coordinates an element of an energy reads",
    "simulation/terms.py": "Energies in a scene",
    "accuracy/truth.py": "True results by ball arithmetic",
    "accuracy/regimes.py": "Hard cases",
    "strategies/build.py": "Strategies for Hypothesis",
}


def reference() -> dict[str, Any]:
    """For each module what it holds: names, signatures and docstrings, in the order in which they stand."""
    return {"modules": [_module(path, title) for path, title in MODULES.items()]}


def _module(path: str, title: str) -> dict[str, Any]:
    tree = ast.parse((Path(__file__).parent / path).read_text(encoding="utf-8"))
    entries: dict[str, dict[str, Any]] = {}
    for node in tree.body:
        entry = _entry(node)
        if entry is not None and entry["doc"] and not entry["name"].startswith("_"):
            entries[entry["name"]] = entry
    name = "yarnverify." + path.removesuffix(".py").replace("/", ".")
    public = name.replace(".accurate.", ".").replace(".build", "")  # as a person imports it
    return {"name": public, "title": title, "entries": list(entries.values())}


def _entry(node: ast.stmt) -> dict[str, Any] | None:
    if isinstance(node, ast.FunctionDef):
        returns = f" -> {ast.unparse(node.returns)}" if node.returns is not None else ""
        signature = f"({ast.unparse(node.args)}){returns}"
        return {"name": node.name, "kind": "function", "signature": signature, "doc": ast.get_docstring(node) or ""}
    if isinstance(node, ast.ClassDef):
        return {"name": node.name, "kind": "class", "signature": "", "doc": ast.get_docstring(node) or ""}
    match node:  # sin = _function("sin", "Sine of ...")
        case ast.Assign(
            targets=[ast.Name(id=name)],
            value=ast.Call(func=ast.Name(id="_function"), args=[_, ast.Constant(value=str(doc))]),
        ):
            return {
                "name": name,
                "kind": "function",
                "signature": "(value: Scalar) -> Expr",
                "doc": inspect.cleandoc(doc),
            }
    return None
