"""The declarations of a folder: its Python files are run, and what goes wrong is told in one line with its place."""

from __future__ import annotations

import difflib
import os
import re
import traceback
from pathlib import Path
from typing import Any

from yarnverify.errors import InputError, why
from yarnverify.symbolic.dimensions import DimensionError, check_dimensions, dimension_of_unit
from yarnverify.symbolic.energies import Declarations, Energy, Motion, Quantity
from yarnverify.symbolic.formulas import FUNCTIONS
from yarnverify.symbolic.places import part_of
from yarnverify.symbolic.tree import Expr, FormulaError


def load_declarations(folder: Path) -> Declarations:
    """Run the Python files of a folder, in alphabetical order, and collect what they declare.

    Raises
    ------
    InputError
        Where a file does not run, an energy is declared twice, or its units do not go together.
    """
    energies: dict[str, Energy] = {}
    quantities: list[Quantity] = []
    motions: list[Motion] = []
    for path in sorted(path for path in folder.glob("*.py") if path.is_file()):
        for value in _run(path).values():
            if isinstance(value, Energy):
                known = energies.setdefault(value.name, value)
                if known is not value:
                    first = os.path.basename(known.place[0])
                    raise InputError(
                        f"energy {value.name!r} is declared twice, first in {first} line {known.place[1]}; rename one",
                        value.place,
                    )
            elif isinstance(value, Quantity):
                quantities.append(value)
            elif isinstance(value, Motion):
                motions.append(value)
    for energy in energies.values():
        _check_units(energy)
    return Declarations(tuple(energies.values()), tuple(quantities), tuple(motions))


def _run(path: Path) -> dict[str, Any]:
    namespace: dict[str, Any] = {"__name__": path.stem, "__file__": str(path)}
    try:
        exec(compile(path.read_bytes(), str(path), "exec"), namespace)
    except InputError:
        raise
    except SyntaxError as error:
        raise InputError(error.msg, (str(path), error.lineno or 1, error.offset or 1)) from None
    except OSError as error:
        raise InputError(f"cannot read it: {why(error)}", (str(path), 1, 1)) from None
    except Exception as error:
        frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
        line, column = (frames[-1].lineno, frames[-1].colno) if frames else (1, 0)
        place = str(path), line or 1, (column or 0) + 1
        raise InputError(_told(error), place) from None
    return namespace


_ELSEWHERE = {  # what other libraries call it
    "acos": "arccos", "asin": "arcsin", "atan": "arctan", "arctan2": "atan2", "ln": "log", "norm": "length",
    "normalize": "unit",
    "cosh": "(exp(x) + exp(-x)) / 2", "sinh": "(exp(x) - exp(-x)) / 2", "tanh": "(exp(2 * x) - 1) / (exp(2 * x) + 1)",
}  # fmt: skip


def _told(error: Exception) -> str:
    """What an exception says, in one line, and what to do about the usual ones."""
    text = " ".join(str(error).split())
    if isinstance(error, NameError) and error.name:
        if error.name in _ELSEWHERE:
            return f"{text}; here it is {_ELSEWHERE[error.name]}"
        known = {name.lower(): name for name in (*FUNCTIONS, *_ANNOTATIONS)}
        near = [known[name] for name in difflib.get_close_matches(error.name.lower(), known, 1)]
        if error.name in near:
            return f"{text}; import it from yarnverify.symbolic.declare"
        return f"{text}; did you mean {near[0]}?" if near else f"{text}; formulas have the functions {_LIST}"
    if not isinstance(error, FormulaError) and (Expr.__name__ in text or "ufunc" in text):
        return _of_formulas(error, text)
    # of these Python's own words say all; of others the name, as in KeyError: 'k'
    plain = isinstance(error, TypeError | NameError | AttributeError | ImportError | ZeroDivisionError)
    return text if plain and text else f"{type(error).__name__}: {text}"


def _of_formulas(error: Exception, text: str) -> str:
    """What Python has no operation for, since a formula is not a number."""
    component = 'a component of a point is dot(x0, e), with a parameter e: Vector["1"]'
    if isinstance(error, AttributeError):
        has = component if error.name in ("x", "y", "z") else f"use the functions {_LIST}"
        return f"a formula has no .{error.name}; {has}"
    if "ufunc" in text:
        return f"NumPy computes with numbers, and a formula is none: use the functions {_LIST}"
    if "subscriptable" in text or "iterable" in text:
        return f"a formula is not a list; {component}"
    if "callable" in text:
        return "a formula is not a function; is a * missing?"
    if "abs()" in text:
        return "abs() is of numbers; length(a) is the size of a number too"
    if operator := re.search(r"operand type\(s\) for (\S+?):? ", text):
        other = {"@": "; dot(a, b) is the scalar product", "**": "; other powers are exp(p * log(a))"}
        return f"a formula has + - * / and whole powers, no {operator[1]}{other.get(operator[1], '')}"
    return f"a formula is no number: use the functions of yarnverify.symbolic.declare, {_LIST}"


_LIST = ", ".join(FUNCTIONS)
_ANNOTATIONS = (
    "Point",
    "Positive",
    "Real",
    "Sliding",
    "SlidingSpeed",
    "Vector",
    "Velocity",
    "energy",
    "quantity",
    "PI",
)


def _check_units(energy: Energy) -> None:
    """Refuse units that are not known, and formulas whose units do not go together."""
    for part, unit in (("unit", energy.unit), *((p.label, p.unit) for p in energy.parameters)):
        try:
            dimension_of_unit(unit)
        except DimensionError as error:
            raise InputError(f"{energy.name}: {part}: {error}", part_of(energy.place, part)) from None
    try:
        check_dimensions(energy)
    except DimensionError as error:
        raise InputError(f"{energy.name}: {error}", part_of(energy.place, "return")) from None
