"""Where in its file a part of a declared function stands, for the one line of an error."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

Place = tuple[str, int, int]


def place_of(function: Callable[..., Any]) -> Place:
    """File, line and column of a function's ``def``."""
    code = function.__code__
    for node in _functions(code.co_filename):
        if code.co_firstlineno == min([node.lineno, *(each.lineno for each in node.decorator_list)]):
            return code.co_filename, node.lineno, node.col_offset + 1
    return code.co_filename, code.co_firstlineno, 1


def part_of(place: Place, part: str) -> Place:
    """File, line and column of a part of the function at a place: an argument, an option of its decorator, or ``return``.

    The place itself where there is no such part.
    """
    function = next((node for node in _functions(place[0]) if node.lineno == place[1]), None)
    if function is None:
        return place
    arguments = (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)
    found: list[Any] = [each for each in arguments if each.arg == part]
    for call in function.decorator_list:
        if isinstance(call, ast.Call):
            found += [keyword for keyword in call.keywords if keyword.arg == part]
    if part == "return":
        found = [node.value for node in ast.walk(function) if isinstance(node, ast.Return) and node.value is not None]
    return (place[0], found[-1].lineno, found[-1].col_offset + 1) if found else place


def _functions(file: str) -> Iterator[ast.FunctionDef]:
    try:
        tree = ast.parse(Path(file).read_bytes())
    except (OSError, SyntaxError, ValueError):  # typed at a prompt, say
        return
    yield from (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))
