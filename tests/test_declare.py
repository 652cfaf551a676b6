"""Declared energies: what they become, and the one line that a bad one gets."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from yarnverify.errors import InputError
from yarnverify.symbolic.declare import Declarations, load_declarations, name_of
from yarnverify.symbolic.latex import latex
from yarnverify.symbolic.reader import read_formula
from yarnverify.symbolic.tree import Expr, Name, as_expr

HEAD = "from yarnverify.symbolic.declare import *\n"


def load(folder: Path, text: str, name: str = "spring.py", head: str = HEAD) -> Declarations:
    (folder / name).write_text(head + text, encoding="utf-8")
    return load_declarations(folder)


SPRING = """
@energy(document="d.md", section="Spring", unit="J", domain=r"u_1 > u_0 > 0")
def spring(x_1: Point, u0: Sliding, u1: Sliding, *, k_s: Positive["N m^-1"], a: Real["J"]):
    '''Half the stiffness
    times the square.'''
    return k_s * (u1 - u0) ** 2 / 2 + a
"""


def test_a_declared_energy(tmp_path: Path) -> None:
    (found,) = load(tmp_path, SPRING).energies
    assert (found.name, found.document, found.section, found.unit) == ("spring", "d.md", "Spring", "J")
    assert found.summary == "Half the stiffness\ntimes the square."
    assert found.unknowns == (Name("x", "1", True), Name("u", "0"), Name("u", "1"))
    assert [(str(p.name), p.unit, p.positive) for p in found.parameters] == [("k_s", "N m^-1", True), ("a", "J", False)]
    assert found.expression == read_formula(r"\frac{k_s (u_1 - u_0)^2}{2} + a")
    assert len(found.domain) == 3


def test_a_declared_quantity_is_also_a_function(tmp_path: Path) -> None:
    text = '@quantity(document="d.md", symbol=r"l_i")\ndef l_i(x_i: Point, x_0: Point):\n    return length(x_i - x_0)\n'
    use = "@energy(unit='m')\ndef e(x1: Point, x2: Point):\n    return -2 * l_i(x1, x2) / 3\n"
    found = load(tmp_path, text + use)
    assert found.quantities[0].symbol == Name("l", "i")
    assert found.quantities[0].expression == read_formula(r"\|\mathbf{x}_i - \mathbf{x}_0\|")
    assert latex(found.energies[0].expression) == r"\frac{\left( -2 \right) \|\mathbf{x}_1 - \mathbf{x}_2\|}{3}"


def test_an_energy_under_two_names_is_declared_once(tmp_path: Path) -> None:
    assert len(load(tmp_path, SPRING + "also = spring\n").energies) == 1


def test_the_declarations_of_the_main_document(declarations: Declarations) -> None:
    printed = [e.name for e in declarations.energies if e.document]
    assert printed == ["bending", "parallel_contact", "shear", "stretch"]
    assert [e.name for e in declarations.energies if not e.document] == ["gravity", "kinetic", "plane", "sphere"]
    assert sorted(str(q.symbol) for q in declarations.quantities) == ["P_i", "d_i", "l_i", "phi", "theta", "w_i"]


def test_a_folder_without_python_files_declares_nothing(tmp_path: Path) -> None:
    assert load_declarations(tmp_path) == Declarations()


# file text after the import in line 1, line of the error, words of the message
BAD = {
    "unknown without annotation": ("@energy()\ndef e(x1):\n    return x1\n", 3, "'x1' of e must be annotated Point"),
    "parameter without annotation": ("@energy()\ndef e(u1: Sliding, *, k):\n    return k\n", 3, "'k' of e must be annotated"),
    "vector without unit": ("@energy()\ndef e(u1: Sliding, *, g: Vector):\n    return g\n", 3, "'g' of e must be annotated"),
    "no such rate": (
        "@energy()\ndef e(u1: Sliding):\n    return u1\n@unchanged_by(e)\ndef m():\n    return {'u7': 1}\n", 7, "no unknown u7",
    ),
    "unit left out": ("@energy()\ndef e(u1: Sliding, *, k: Positive):\n    return k\n", 3, "'k' of e must be annotated"),
    "syntax error": ("def e(:\n", 2, "invalid syntax"),
    "wrong indentation": ("def e():\nreturn 1\n", 3, "expected an indented block"),
    "float factor": ("@energy()\ndef e(u1: Sliding):\n    return 0.5 * u1\n", 4, "0.5 cannot stand in a formula"),
    "float term": ("@energy()\ndef e(u1: Sliding):\n    return u1 + 0.5\n", 4, "0.5 cannot stand in a formula"),
    "boolean": ("@energy()\ndef e(u1: Sliding):\n    return u1 * True\n", 4, "True cannot stand in a formula"),
    "float power": ("@energy()\ndef e(u1: Sliding):\n    return u1 ** 0.5\n", 4, "exponent must be an integer"),
    "symbolic power": ("@energy()\ndef e(u1: Sliding):\n    return u1 ** u1\n", 4, "exponent must be an integer"),
    "unknown name": ("@energy()\ndef e(u1: Sliding):\n    return u2\n", 4, "name 'u2' is not defined"),
    "unknown option": ('@energy(units="J")\ndef e(u1: Sliding):\n    return u1\n', 2, "unexpected keyword argument 'units'"),
    "missing module": ("import no_such_module\n", 2, "no_such_module"),
    "nothing returned": ("@energy()\ndef e(u1: Sliding):\n    u1 ** 2\n", 3, "e"),
    "text returned": ("@energy()\ndef e(u1: Sliding):\n    return 'u1'\n", 4, "e"),
    "bad domain": ('@energy(domain=r"u_1 > \\foo")\ndef e(u1: Sliding):\n    return u1\n', 2, r"unknown LaTeX command \foo"),
    "bad symbol": ('@quantity(symbol=r"\\foo")\ndef e(u1: Sliding):\n    return u1\n', 2, r"unknown LaTeX command \foo"),
    "symbol that is a sum": ('@quantity(symbol=r"a + b")\ndef e(u1: Sliding):\n    return u1\n', 2, "symbol"),
    "two symbols": ('@quantity(symbol=r"a, b")\ndef e(u1: Sliding):\n    return u1\n', 2, "symbol"),
    "shapes": ("@energy()\ndef e(x1: Point, u1: Sliding):\n    return x1 + u1\n", 4, "cannot add"),
    "vector energy": ("@energy()\ndef e(x1: Point):\n    return x1\n", 4, "scalar"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_a_bad_declaration_is_one_line_with_its_place(tmp_path: Path, case: str) -> None:
    text, line, words = BAD[case]
    place = re.escape(str(tmp_path / "spring.py")) + rf":{line}:\d+"
    with pytest.raises(InputError, match=rf"^{place}: .*{re.escape(words)}") as error:
        load(tmp_path, text)
    assert "\n" not in str(error.value)


def test_an_energy_declared_in_two_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "again.py").write_text(HEAD + SPRING, encoding="utf-8")
    with pytest.raises(InputError, match=r"spring\.py:\d+:1: energy 'spring' is declared twice"):
        load(tmp_path, SPRING)


@pytest.mark.parametrize("data", [b"a = 1\n\xff", b"a = 1\n\0"])
def test_a_declaration_that_is_not_text_is_refused(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "spring.py").write_bytes(data)
    with pytest.raises(InputError, match=r"spring\.py:\d+:\d+: ") as error:
        load_declarations(tmp_path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("identifier", "expected"),
    [
        ("x1", Name("x", "1")),
        ("x_i", Name("x", "i")),
        ("x_12", Name("x", "12")),
        ("u", Name("u")),
        ("theta_0", Name("theta", "0")),
    ],
)
def test_the_symbol_of_an_unknown(identifier: str, expected: Name) -> None:
    assert name_of(identifier, indexed=True) == expected


@pytest.mark.parametrize(
    ("identifier", "expected"),
    [("k_b", Name("k", "b")), ("L", Name("L")), ("theta_0", Name("theta", "0")), ("k_12", Name("k", "12"))],
)
def test_the_symbol_of_a_parameter(identifier: str, expected: Name) -> None:
    assert name_of(identifier) == expected


@pytest.mark.parametrize("value", [0.5, True, "a", None])
def test_only_exact_values_stand_in_a_formula(value: Any) -> None:
    with pytest.raises(TypeError, match="exact"):
        as_expr(value)


def test_arithmetic_of_declared_formulas_is_the_printed_one() -> None:
    a: Expr = read_formula("a")
    made = [1 + a, 1 - a, a - 1, 2 * a, 1 / a, a / 2, -a, a**-2, a.T]
    printed = ["1 + a", "1 - a", "a - 1", "2 a", r"\frac{1}{a}", r"\frac{a}{2}", "-a", "a^{-2}", "a^T"]
    assert made == [read_formula(text) for text in printed]
