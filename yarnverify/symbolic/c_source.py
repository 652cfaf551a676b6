"""C source of an energy, its gradient and its Hessian: the programs of the kernels, printed by SymPy's C printer."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import sympy as sp
from sympy.printing.c import C99CodePrinter

from yarnverify.errors import InputError
from yarnverify.symbolic.c_functions import Functions, flat, rebuilt
from yarnverify.symbolic.declare import Energy, load_declarations
from yarnverify.symbolic.dimensions import scaling_powers
from yarnverify.symbolic.emit import dof_labels, given_symbols
from yarnverify.symbolic.printing import TEMPLATES, statements
from yarnverify.symbolic.programs import derived_programs, even_ends, proved
from yarnverify.symbolic.reading import UnsupportedError
from yarnverify.symbolic.steps import Program

_WORDS_OF_C = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern",
    "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed",
    "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while",
}  # fmt: skip


class _Printer(C99CodePrinter):  # type: ignore[misc]
    """C whose whole powers are products, and whose safe functions are those of the source itself."""

    def __init__(self, functions: Functions) -> None:
        super().__init__({"contract": False})
        self.functions = functions

    def _print_Pow(self, expr: Any) -> str:
        base, exponent = expr.args
        text = self._print(base)
        if exponent == sp.Rational(1, 2):
            return f"sqrt({text})"
        if exponent.is_Rational and exponent.q == 2:
            whole = abs(int(exponent - sp.sign(exponent) / 2))
            power = f"(sqrt({text})*{self._print(base**whole)})" if whole else f"sqrt({text})"
            return power if exponent > 0 else f"(1.0/{power})"
        if not exponent.is_Integer:
            raise UnsupportedError(f"the power {expr}")
        inner = text if base.is_Symbol else f"({text})"
        product = "*".join([inner] * abs(int(exponent)))
        return f"({product})" if exponent > 0 else f"(1.0/({product}))"

    def _print_Pi(self, expr: Any) -> str:
        return repr(float(sp.pi))

    def _print_sign(self, expr: Any) -> str:
        return f"({self._print(expr.args[0])} > 0 ? 1.0 : -1.0)"

    def _print_Integer(self, expr: Any) -> str:
        return f"{int(expr)}.0"

    def _print_Function(self, expr: Any) -> str:
        name = expr.func.__name__
        if name in ("expm1", "sinh"):
            return f"{name}({self._print(expr.args[0])})"
        if name in ("sqrt", "acos", "sin", "cos", "tan", "Abs", "log", "exp"):
            return str(super()._print_Function(expr))
        if name == "select":
            condition, yes, no = map(self._print, expr.args)
            return f"({condition} > 0 ? {yes} : {no})"
        c_name, _ = self.functions.named(name, ("s",) * len(expr.args))
        return f"{c_name}({', '.join(self._print(arg) for arg in expr.args)})"


class _Prologue:
    """The lines before the steps: calls of safe functions on points, whose results get names."""

    def __init__(self, functions: Functions, known: Sequence[str]) -> None:
        self.functions, self.results = functions, 0
        self.values: dict[str, Any] = {name: name for name in known}
        self.lines: list[str] = []

    def read(self, line: str) -> None:
        (statement,) = ast.parse(line).body
        assert isinstance(statement, ast.Assign)
        (target,) = statement.targets
        value = self._value(statement.value)
        if isinstance(target, ast.Tuple):
            for name, part in zip(target.elts, value, strict=True):
                assert isinstance(name, ast.Name)
                self._name(name.id, part)
        else:
            assert isinstance(target, ast.Name)
            self._name(target.id, value)

    def _name(self, name: str, value: Any) -> None:
        if isinstance(value, tuple) or name == "_":
            self.values[name] = value
        else:
            self.values[name] = name
            self.lines.append(f"const double {name} = {value};")

    def _value(self, node: ast.expr) -> Any:
        match node:
            case ast.Name(id=name):
                return self.values[name]
            case ast.Tuple(elts=parts):
                return tuple(self._value(part) for part in parts)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return f"-{self._value(inner)}"
            case ast.BinOp(left=left, op=ast.Mult(), right=right):
                return f"{self._value(left)}*{self._value(right)}"
            case ast.Call(func=ast.Name(id=name), args=args):
                return self._call(name, tuple(self._value(arg) for arg in args))
        raise UnsupportedError(f"the line {ast.unparse(node)}")

    def _call(self, name: str, arguments: tuple[Any, ...]) -> Any:
        c_name, shape = self.functions.named(name, arguments)
        given = ", ".join(flat(arguments))
        if not isinstance(shape, tuple):
            return f"{c_name}({given})"
        result = f"r{self.results}"
        self.results += 1
        size = len(flat(shape))
        self.lines += [f"double {result}[{size}];", f"{c_name}({given}, {result});"]
        return rebuilt(shape, [f"{result}[{i}]" for i in range(size)])


def _function(made: Program, rows: list[str], parameters: list[str], functions: Functions) -> dict[str, Any]:
    """Name, body and results of one shape."""
    printer = _Printer(functions)
    prologue = _Prologue(functions, [*rows, *parameters])
    for line in made.prologue:
        prologue.read(line)
    lines = [f"const double {name} = q[{i}] + 0.0;" for i, name in enumerate(rows)]
    lines += [f"const double {name} = p[{i}];" for i, name in enumerate(parameters)]
    lines += prologue.lines
    order = [line.partition(" = ")[0] for line in statements(made)[len(made.prologue) :]]
    steps = {str(symbol): value for symbol, value in made.steps.items()}
    lines += [f"const double {name} = {printer.doprint(steps[name])};" for name in order]
    results = [printer.doprint(value) for value in made.outputs]
    return {"name": made.name, "lines": _live(lines, results), "results": results, "checks": made.checks}


def _live(lines: list[str], results: list[str]) -> list[str]:
    """The lines whose names are used further down."""
    used: set[str] = set()
    for text in results:
        used |= set(re.findall(r"[A-Za-z_]\w*", text))
    kept = []
    for line in reversed(lines):
        declared = re.match(r"(?:const )?double (\w+)", line)
        called = re.match(r"\w+\(.*\b(r\d+)\);$", line)
        name = declared[1] if declared else called[1] if called else ""
        if name in used:
            kept.append(line)
            used |= set(re.findall(r"[A-Za-z_]\w*", line.partition("=")[2] if declared else line))
    return kept[::-1]


def c_texts(name: str, folder: Path) -> tuple[dict[str, str], bool]:
    """The C source and the header of an energy, file name to text, and whether it keeps its digits near singular states.

    Parameters
    ----------
    name
        Of a declared energy.
    folder
        Of derivations.

    Raises
    ------
    InputError
        Where there is no such energy, or C could not have its names.
    NotRunError
        Where a derived block is not proved.
    """
    declarations = load_declarations(folder)
    energy = next((energy for energy in declarations.energies if energy.name == name), None)
    if energy is None:
        raise InputError(f"{name}: no such energy; there are {', '.join(e.name for e in declarations.energies)}")
    for word in (name, *(parameter.label for parameter in energy.parameters)):
        if word in _WORDS_OF_C:
            raise InputError(
                f"{name}: {word!r} is a word of C, which can have no function or value of this name; rename it"
            )
    found = proved(energy, declarations)
    programs, notes = derived_programs(energy, found, "accurate")
    return _texts(energy, programs, notes, even_ends(energy, found)), bool(found.shapes or found.rational)


def _texts(
    energy: Energy, programs: list[Program], notes: list[str], even: tuple[int, int] | None = None
) -> dict[str, str]:
    labels = dof_labels(energy.unknowns)
    rows = [label.replace(".", "") for label in labels]
    whole, by_name = scaling_powers(energy)
    symbols = [(str(symbol), by_name[p.label]) for p in energy.parameters for symbol in given_symbols(p.name)]
    functions = Functions()
    shapes = [_function(made, rows, [name for name, _ in symbols], functions) for made in programs]
    code = "\n".join(line for shape in shapes for line in (*shape["lines"], *shape["results"]))
    calls = [line for made in programs for line in made.prologue]
    points = [i for i, label in enumerate(labels) if "." in label]
    angles_alone = any("corner" in line for line in calls) and not any("segment" in line for line in calls)
    values = {
        "energy": energy,
        "notes": notes,
        "rows": labels,
        "dof": len(labels),
        "parameters": [(str(symbol), p.unit) for p in energy.parameters for symbol in given_symbols(p.name)],
        "powers": [power for _, power in symbols],
        "functions": functions.used_in(code),
        "shapes": shapes,
        "chosen": programs[0].choice is not None,
        "points": points,
        "whole": whole,
        "even": even,
        "scaling": "none" if len(points) < 6 else "points" if angles_alone else "lengths",
    }
    return {
        f"{energy.name}.c": TEMPLATES.get_template("energy.c.jinja").render(**values),
        f"{energy.name}.h": TEMPLATES.get_template("energy.h.jinja").render(**values),
    }
