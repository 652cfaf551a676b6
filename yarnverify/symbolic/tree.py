"""The typed expression tree: what a printed formula and a declared energy both become.

One tree has several readings (normal forms, exact rationals, balls, NumPy text); none of them is in this file.
The order of factors is kept, because vectors, covectors (rows) and 3x3 matrices do not commute.
"""

from __future__ import annotations

import keyword
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from fractions import Fraction
from numbers import Real
from typing import Any


class Type(Enum):
    """Shape of a value. ``UNKNOWN`` is the shape of a symbol that nobody defined; it fits anywhere."""

    SCALAR = "scalar"
    VECTOR = "vector"
    COVECTOR = "covector"
    MATRIX = "matrix"
    UNKNOWN = "undefined"


@dataclass(frozen=True, slots=True, order=True)
class Name:
    r"""A symbol as printed: ``\mathbf{x}_1`` is ``Name("x", "1", bold=True)``, ``\Delta u`` is ``Name("Delta u")``."""

    base: str
    sub: str = ""
    bold: bool = False

    def __str__(self) -> str:
        return f"{self.base}_{self.sub}" if self.sub else self.base

    @property
    def label(self) -> str:
        """Short form used in the names of blocks and degrees of freedom, such as ``x1``."""
        return f"{self.base}{self.sub}".replace(" ", "")

    @property
    def identifier(self) -> str:
        """The symbol as a Python name, such as ``k_b`` or ``bar_l``."""
        text = "".join(c if c.isalnum() else "_" for c in str(self))
        return text + "_" if keyword.iskeyword(text) else text

    def with_sub(self, sub: str) -> Name:
        return replace(self, sub=sub)


class FormulaError(TypeError):
    """What a formula cannot be made of; the message says what to write."""


@dataclass(frozen=True, slots=True)
class Inequality:
    """``left > right``, as a declared domain states it."""

    left: Expr
    right: Expr

    def __bool__(self) -> bool:
        raise FormulaError(
            "write a chain such as a > b > c, or a and b, as a list: [a > b, b > c]; in place of if, max and min in a formula, "
            'give @energy(domain=..., elsewhere="zero"): where it acts, and nothing elsewhere'
        )


@dataclass(frozen=True, slots=True)
class Expr:
    """A node: an operation, its arguments in printed order, and its place in the source.

    Operations: ``number`` (value: natural number), ``symbol``, ``force``, ``energy`` (value: Name), ``pi``, ``identity``,
    ``add``, ``neg``, ``mul``, ``frac``, ``pow`` (value: int), ``transpose``, ``norm``, ``abs``, ``sqrt``,
    ``call`` (value: function name), ``cross``, ``dot``, ``derivative`` (value: Name of the unknown).
    ``span`` holds the offsets of the node in its file, and takes no part in comparison.
    """

    op: str
    args: tuple[Expr, ...] = ()
    value: Name | str | int | None = None
    span: tuple[int, int] = field(default=(0, 0), compare=False)

    @property
    def name(self) -> Name:
        assert isinstance(self.value, Name)
        return self.value

    def walk(self) -> Iterator[Expr]:
        """This node and all below it, in printed order."""
        yield self
        for arg in self.args:
            yield from arg.walk()

    def size(self) -> int:
        return 1 + sum(arg.size() for arg in self.args)

    # Arithmetic for declared energies; `*` keeps the order of its factors.
    def __add__(self, other: Expr | int) -> Expr:
        return Expr("add", (*self._joined("add"), as_expr(other)))

    def __radd__(self, other: int) -> Expr:
        return Expr("add", (as_expr(other), self))

    def __sub__(self, other: Expr | int) -> Expr:
        return Expr("add", (*self._joined("add"), Expr("neg", (as_expr(other),))))

    def __rsub__(self, other: int) -> Expr:
        return Expr("add", (as_expr(other), Expr("neg", (self,))))

    def __mul__(self, other: Expr | int | Fraction) -> Expr:
        return Expr("mul", (*self._joined("mul"), as_expr(other)))

    def __rmul__(self, other: int | Fraction) -> Expr:
        return Expr("mul", (as_expr(other), self))

    def __truediv__(self, other: Expr | int) -> Expr:
        return Expr("frac", (self, as_expr(other)))

    def __rtruediv__(self, other: int) -> Expr:
        return Expr("frac", (as_expr(other), self))

    def __pow__(self, exponent: int) -> Expr:
        if not isinstance(exponent, int):
            instead = "exp(p * log(a)) for another power" if isinstance(exponent, Expr) else "sqrt(...) for a root"
            if isinstance(exponent, float | Fraction) and 2 * exponent == int(2 * exponent) and abs(exponent) > 1:
                instead = f"sqrt(...) ** {int(2 * exponent)}"
            given = "a formula" if isinstance(exponent, Expr) else repr(exponent)
            raise FormulaError(f"an exponent must be an integer, not {given}; write {instead}")
        return Expr("pow", (self,), exponent)

    def __neg__(self) -> Expr:
        return Expr("neg", (self,))

    def __lt__(self, other: Expr | int) -> Inequality:
        return Inequality(as_expr(other), self)

    def __gt__(self, other: Expr | int) -> Inequality:
        return Inequality(self, as_expr(other))

    def __ge__(self, other: object) -> Inequality:
        raise FormulaError("a domain is without its border: write > for >=, and < for <=")

    __le__ = __ge__

    def _joined(self, op: str) -> tuple[Expr, ...]:
        return self.args if self.op == op else (self,)

    def _repr_latex_(self) -> str:
        from yarnverify.symbolic.latex import latex

        return f"$\\displaystyle {latex(self)}$"

    @property
    def T(self) -> Expr:
        """Transpose."""
        return Expr("transpose", (self,))


def as_expr(value: Expr | int | Fraction) -> Expr:
    if isinstance(value, Expr):
        return value
    if isinstance(value, int | Fraction) and not isinstance(value, bool):
        return number(value)
    raise FormulaError(f"{_shown(value)} cannot stand in a formula, {_instead(value)}")


def _shown(value: Any) -> str:
    return repr(float(value)) if isinstance(value, Real) and not isinstance(value, bool) else repr(value)


def _instead(value: Any) -> str:
    """What to write for something that is no exact number."""
    if isinstance(value, list | tuple):
        return 'which has no constant vectors: make it a parameter e: Vector["1"]'
    if not isinstance(value, Real) or isinstance(value, bool) or not math.isfinite(value):
        return "which is made of its arguments and of exact numbers, integers and fractions"
    if abs(value) == math.pi:
        return "whose numbers are exact: write PI"
    exact = Fraction(repr(float(value)))
    near = exact.limit_denominator(1000)
    if float(near) != value:
        return f'whose numbers are exact: write Fraction("{float(value)!r}") of the module fractions'
    if near.denominator == 1:
        return f"whose numbers are exact: write {near}"
    times = "k" if near.numerator == 1 else f"{near.numerator} * k"
    fraction = f"Fraction({near.numerator}, {near.denominator})"
    return (
        f"whose numbers are exact: write {times} / {near.denominator} for {float(value)!r} * k, "
        f"or {fraction} of the module fractions"
    )


def number(value: int | Fraction) -> Expr:
    """An exact number; leaves are natural numbers, so that a printed fraction and a declared one are the same tree."""
    value = Fraction(value)
    if value < 0:
        return Expr("neg", (number(-value),))
    if value.denominator != 1:
        return Expr("frac", (number(value.numerator), number(value.denominator)))
    return Expr("number", value=int(value))


def symbol(base: str, sub: str = "", bold: bool = False) -> Expr:
    return Expr("symbol", value=Name(base, sub, bold))


FORCE = -1  # a force is this times the gradient, in every reading

PI = Expr("pi")
IDENTITY = Expr("identity")
ZERO = number(0)
ONE = number(1)


def is_zero(expr: Expr) -> bool:
    """Whether the tree is the printed number 0, which equals the zero of every shape."""
    return expr.op == "number" and expr.value == 0


def paired(left: Expr, right: Expr, a: list[Any], b: list[Any]) -> list[tuple[Any, Any]]:
    """Components side by side; the printed 0 stands for as many zeros as are wanted."""
    if is_zero(right):
        b = b * len(a)
    if is_zero(left):
        a = a * len(b)
    return list(zip(a, b, strict=True))


def rebuild(expr: Expr, change: Callable[[Expr], Expr | None]) -> Expr:
    """Copy of a tree in which ``change`` replaced nodes from the top; None leaves a node and descends."""
    new = change(expr)
    if new is not None:
        return new
    args = tuple(rebuild(arg, change) for arg in expr.args)
    return expr if args == expr.args else replace(expr, args=args)


class ShapeError(Exception):
    """Shapes that do not go together, at a place in the source."""

    def __init__(self, expr: Expr, message: str) -> None:
        super().__init__(message)
        self.span = expr.span
        self.message = message


_TRANSPOSED = {
    Type.SCALAR: Type.SCALAR,
    Type.VECTOR: Type.COVECTOR,
    Type.COVECTOR: Type.VECTOR,
    Type.MATRIX: Type.MATRIX,
    Type.UNKNOWN: Type.UNKNOWN,
}

_PRODUCT = {
    (Type.VECTOR, Type.COVECTOR): Type.MATRIX,
    (Type.COVECTOR, Type.VECTOR): Type.SCALAR,
    (Type.COVECTOR, Type.MATRIX): Type.COVECTOR,
    (Type.MATRIX, Type.VECTOR): Type.VECTOR,
    (Type.MATRIX, Type.MATRIX): Type.MATRIX,
}

# Rows are the quantity, columns are the unknown (numerator layout, as the document has it).
_DERIVATIVE = {
    (Type.SCALAR, Type.SCALAR): Type.SCALAR,
    (Type.SCALAR, Type.VECTOR): Type.COVECTOR,
    (Type.VECTOR, Type.SCALAR): Type.VECTOR,
    (Type.VECTOR, Type.VECTOR): Type.MATRIX,
}


def product_type(left: Type, right: Type) -> Type | None:
    """Shape of a product, or None where there is none."""
    if Type.UNKNOWN in (left, right):
        return Type.UNKNOWN
    if left is Type.SCALAR:
        return right
    if right is Type.SCALAR:
        return left
    return _PRODUCT.get((left, right))


def type_of(expr: Expr, lookup: Callable[[Name], Type]) -> Type:
    """Shape of a tree, given the shapes of its symbols.

    Raises
    ------
    ShapeError
        Where an operation is applied to shapes that it does not have.
    """
    kinds = tuple(type_of(arg, lookup) for arg in expr.args)
    unknown = Type.UNKNOWN in kinds
    match expr.op:
        case "number" | "pi" | "energy":
            return Type.SCALAR
        case "identity":
            return Type.MATRIX
        case "symbol":
            return lookup(expr.name)
        case "force":
            return Type.VECTOR if expr.name.bold else Type.SCALAR
        case "neg":
            return kinds[0]
        case "transpose":
            return _TRANSPOSED[kinds[0]]
        case "add":
            if unknown:
                return Type.UNKNOWN
            for arg, kind in zip(expr.args, kinds, strict=True):
                if kind is not kinds[0]:
                    raise ShapeError(arg, f"cannot add a {kind.value} to a {kinds[0].value}")
            return kinds[0]
        case "mul":
            kind = kinds[0]
            for arg, right in zip(expr.args[1:], kinds[1:], strict=True):
                result = product_type(kind, right)
                if result is None:
                    raise ShapeError(arg, f"cannot multiply a {kind.value} by a {right.value}")
                kind = result
            return kind
        case "frac":
            if kinds[1] not in (Type.SCALAR, Type.UNKNOWN):
                raise ShapeError(expr.args[1], f"cannot divide by a {kinds[1].value}")
            return kinds[0]
        case "pow" | "sqrt" | "abs" | "call":
            wrong = [i for i, kind in enumerate(kinds) if kind not in (Type.SCALAR, Type.UNKNOWN)]
            if wrong:
                what = {"pow": "raise {} to a power", "sqrt": "take the square root of {}"}.get(
                    expr.op, f"take {expr.value or 'the absolute value'} of {{}}"
                )
                raise ShapeError(expr.args[wrong[0]], "cannot " + what.format(f"a {kinds[wrong[0]].value}"))
            return Type.SCALAR
        case "norm":
            if kinds[0] is Type.MATRIX:
                raise ShapeError(expr.args[0], "cannot take the norm of a matrix")
            return Type.SCALAR
        case "cross":
            if not unknown and kinds != (Type.VECTOR, Type.VECTOR):
                raise ShapeError(expr, f"cannot take the cross product of a {kinds[0].value} and a {kinds[1].value}")
            return Type.VECTOR
        case "dot":
            if kinds == (Type.VECTOR, Type.VECTOR):
                return Type.SCALAR
            result = product_type(*kinds) if unknown or Type.SCALAR in kinds else None
            if result is None:
                raise ShapeError(expr, f"cannot take the dot product of a {kinds[0].value} and a {kinds[1].value}")
            return result
        case "derivative":
            wrt = Type.VECTOR if expr.name.bold else Type.SCALAR
            if kinds[0] is Type.UNKNOWN:
                return Type.UNKNOWN
            found = _DERIVATIVE.get((kinds[0], wrt))
            if found is None:
                raise ShapeError(expr, f"cannot differentiate a {kinds[0].value} by a {wrt.value}")
            return found
    raise AssertionError(f"no such operation: {expr.op}")
