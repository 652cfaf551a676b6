"""The declarations of a folder: its Python files are run, and what goes wrong is told in one line with its place."""

from __future__ import annotations

import difflib
import os
import traceback
from pathlib import Path
from typing import Any

from yarnverify.errors import InputError, why
from yarnverify.symbolic.dimensions import DimensionError, check_dimensions, dimension_of_unit
from yarnverify.symbolic.energies import Declarations, Energy, Motion, Quantity
from yarnverify.symbolic.formulas import FUNCTIONS
from yarnverify.symbolic.places import part_of
from yarnverify.symbolic.tree import Expr


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
        raise InputError(f"{type(error).__name__}: {_told(error)}", place) from None
    return namespace


def _told(error: Exception) -> str:
    """What an exception says, in one line, and what to do about the usual ones."""
    text = " ".join(str(error).split())
    if isinstance(error, NameError) and error.name:
        known = {name.lower(): name for name in (*FUNCTIONS, *_ANNOTATIONS, "PI")}
        near = difflib.get_close_matches(error.name.lower(), known, 1)
        advice = f"did you mean {known[near[0]]}?" if near else f"formulas have the functions {', '.join(FUNCTIONS)}"
        return f"{text}; import it from yarnverify.symbolic.declare, or: {advice}"
    if isinstance(error, AttributeError) and error.name in ("x", "y", "z"):
        return f'{text}; a component of a point is dot(x0, e), with a parameter e: Vector["1"]'
    if "abs()" in text:
        return f"{text}; length(a) is the size of a number too"
    if Expr.__name__ in text or "ufunc" in text:
        return (
            f"{text}; a formula is no number: use the functions of yarnverify.symbolic.declare, {', '.join(FUNCTIONS)}"
        )
    return text


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
