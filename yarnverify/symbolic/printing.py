"""The text of programs: what is printed is what ``kernels.tape`` can record."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import sympy as sp
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from sympy.printing.numpy import NumPyPrinter
from sympy.printing.precedence import precedence

from yarnverify.symbolic.reading import UnsupportedError
from yarnverify.symbolic.steps import Program, needed

TEMPLATES = Environment(
    loader=FileSystemLoader(Path(__file__).parent / "templates"),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)


class _Printer(NumPyPrinter):  # type: ignore[misc]
    """Scalar code whose every operation is one that ``kernels.tape`` records; integer powers are products."""

    divides = False  # by 3 instead of multiplying by 1/3, which is not a double, nor is the root of 3

    def _print_Mul(self, expr: Any) -> str:
        ratio, rest = expr.as_coeff_Mul()
        if not self.divides or not ratio.is_Rational or not ratio.q & (ratio.q - 1):
            return str(super()._print_Mul(expr))
        return f"{self.parenthesize(ratio.p * rest, precedence(expr))}/{ratio.q}"

    def _print_Pow(self, expr: Any, rational: bool = False, sqrt: str = "sqrt") -> str:
        base, exponent = expr.args
        text = self._print(base)
        if exponent == sp.Rational(1, 2):
            return f"root_of({text}, q[0])" if self.divides and base.is_Integer else f"sqrt({text})"
        if exponent.is_Rational and exponent.q == 2:
            whole = abs(int(exponent - sp.sign(exponent) / 2))
            power = f"sqrt({text})*{self._print(base**whole)}" if whole else f"sqrt({text})"
            return f"({power})" if exponent > 0 else f"(1/({power}))"
        if not exponent.is_Integer:
            raise UnsupportedError(f"the power {expr}")
        size = abs(int(exponent))
        inner = text if base.is_Symbol or base.is_Function else f"({text})"
        product = "*".join([inner] * size) if base.is_Symbol and size <= 4 else f"power({text}, {size})"
        product = inner if size == 1 else f"({product})" if base.is_Symbol and size <= 4 else product
        return product if exponent > 0 else f"(1/{product})"

    def _print_Pi(self, expr: Any) -> str:
        return "pi_like(q[0])" if self.divides else "PI"

    def _print_sign(self, expr: Any) -> str:
        return f"select({self._print(expr.args[0])}, 1.0, -1.0)"

    def _print_exp(self, expr: Any) -> str:
        return f"exp({self._print(expr.args[0])})"

    def _print_log(self, expr: Any) -> str:
        return f"log({self._print(expr.args[0])})"

    def _print_atan2(self, expr: Any) -> str:
        return f"atan2({self._print(expr.args[0])}, {self._print(expr.args[1])})"

    def _print_Function(self, expr: Any) -> str:
        return f"{expr.func.__name__}({', '.join(self._print(arg) for arg in expr.args)})"


class _Divisions(_Printer):
    divides = True


_PRINTER = _Printer({"fully_qualified_modules": False})
_DIVISIONS = _Divisions({"fully_qualified_modules": False})
# not correctly rounded, so not the same on every machine
LIBRARY = {"arccos", "atan2", "cos", "exp", "expm1", "log", "log_ratio", "sin", "sinh", "tan"}
_FUNCTIONS = {
    "tape": LIBRARY | {"power", "select", "sqrt"},
 "geometry": {
        "PI", "angle", "angle_over_sine", "angle_squared", "apart", "closing", "corner", "corner_exact", "deviation", "dot",
        "half_tangent", "in_order", "normal_of", "pi_like", "right_corner", "right_corner_exact", "root_of", "scaled",
        "segment", "segment_exact", "segment_twice", "sine_excess", "total", "total_twice", "turning", "versine",
    },
}  # fmt: skip


def text_of(value: Any, divides: bool = False) -> str:
    """The text of a value; ``divides`` where a third must be one to more digits than a double has."""
    return str((_DIVISIONS if divides else _PRINTER).doprint(value))


def statements(program: Program, divides: bool = False) -> list[str]:
    """The assignments of a program, each before it is used."""
    return [
        *program.prologue,
        *(f"{symbol} = {text_of(value, divides)}" for symbol, value in needed(program.steps, program.outputs).items()),
    ]


def used_functions(code: str, module: str) -> list[str]:
    """The names of ``kernels.tape`` or ``kernels.geometry`` that emitted code uses, in alphabetical order."""
    return sorted(name for name in _FUNCTIONS[module] if re.search(rf"\b{name}\b", code))
