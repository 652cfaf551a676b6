"""``yarnverify export ENERGY --out DIR``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from yarnverify.check.cases import energy_named
from yarnverify.errors import InputError
from yarnverify.export.formulas import latex_text
from yarnverify.export.vectors import golden_vectors
from yarnverify.export.writing import c_header, c_test, json_text, mat, npz
from yarnverify.files import write_bytes
from yarnverify.library import derivations

_PROMISES_NOTHING = (
    "{name}.c is differentiated step by step, which promises no digits: where sums cancel, {name}_test may find it beyond "
    "what is allowed; the golden vectors are right"
)


def export(
    name: str, out: Path, folder: Path | None, count: int, extreme: bool,
    advance: Callable[[str, int], None] = lambda label, total: None,
) -> list[str]:  # fmt: skip
    """Write golden vectors, formulas and C source of an energy; one line for each file.

    Parameters
    ----------
    name, folder
        Of a declared energy, and where it is declared.
    out
        Folder for the files.
    count, extreme
        States of each hard case, and whether to take sizes that no cloth has.

    Raises
    ------
    InputError
        Where there is no such energy.
    NotRunError
        Where a file cannot be written, or a derived block is not proved.
    """
    from yarnverify.symbolic.c_source import c_texts

    if count < 1:
        raise InputError(f"--count {count}: give a positive number")
    place = folder or derivations()
    energy = energy_named(name, folder)
    vectors = golden_vectors(name, folder, count, extreme, advance)
    what = f"{len(vectors)} states"
    files = {
        f"{name}_golden.npz": (npz(vectors), f"{what} for NumPy"),
        f"{name}_golden.json": (json_text(vectors).encode(), f"{what}, hexadecimal floats"),
        f"{name}_golden.h": (c_header(vectors).encode(), f"{what} for C and C++"),
        f"{name}_golden.mat": (mat(vectors), f"{what} for MATLAB and Octave"),
        f"{name}.tex": (latex_text(energy, place).encode(), "the equations, corrected"),
    }
    source, keeps = c_texts(name, place)
    files[f"{name}.h"] = (source[f"{name}.h"].encode(), "the interface of the C source")
    files[f"{name}.c"] = (source[f"{name}.c"].encode(), "energy, gradient and Hessian in C")
    files[f"{name}_test.c"] = (
        c_test(vectors).encode(),
        "a C program that holds an implementation to the golden vectors",
    )
    lines = []
    for file, (data, meaning) in files.items():
        write_bytes(data, out / file)
        lines.append(f"{out / file}: {meaning}")
    return lines if keeps else [*lines, _PROMISES_NOTHING.format(name=name)]
