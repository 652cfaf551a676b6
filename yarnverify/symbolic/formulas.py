"""Functions that declared formulas are made of; each takes and gives trees."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from yarnverify.symbolic.tree import PI, Expr, as_expr

Scalar = Expr | int | Fraction


def length(a: Expr) -> Expr:
    """Length of a vector."""
    return Expr("norm", (as_expr(a),))


def square(a: Expr) -> Expr:
    """Square of the length of a vector."""
    a = as_expr(a)
    return Expr("mul", (a.T, a))


def unit(a: Expr) -> Expr:
    """Direction of a vector."""
    return Expr("frac", (as_expr(a), length(a)))


def angle(a: Expr, b: Expr) -> Expr:
    """Angle between two directions, from 0 to pi."""
    return Expr("call", (Expr("mul", (unit(a).T, unit(b))),), "arccos")


def dot(a: Expr, b: Expr) -> Expr:
    """Scalar product of two vectors."""
    return Expr("mul", (as_expr(a).T, as_expr(b)))


def cross(a: Expr, b: Expr) -> Expr:
    """Vector product."""
    return Expr("cross", (as_expr(a), as_expr(b)))


def atan2(y: Scalar, x: Scalar) -> Expr:
    """Angle of the point (x, y), from -pi to pi."""
    return Expr("call", (as_expr(y), as_expr(x)), "atan2")


def _function(name: str, what: str) -> Callable[[Scalar], Expr]:
    def function(value: Scalar) -> Expr:
        return Expr("sqrt", (as_expr(value),)) if name == "sqrt" else Expr("call", (as_expr(value),), name)

    function.__name__, function.__doc__ = name, what
    return function


sqrt = _function("sqrt", "Square root of a scalar.")
sin = _function("sin", "Sine of an angle in radians.")
cos = _function("cos", "Cosine of an angle in radians.")
tan = _function("tan", "Tangent of an angle in radians.")
arccos = _function("arccos", "Angle from 0 to pi with a given cosine.")
arcsin = _function("arcsin", "Angle from -pi/2 to pi/2 with a given sine.")
arctan = _function("arctan", "Angle from -pi/2 to pi/2 with a given tangent.")
log = _function("log", "Natural logarithm of a positive scalar.")
exp = _function("exp", "Exponential of a scalar.")


def deviation(a: Expr, b: Expr) -> Expr:
    """How much the angle between two directions exceeds a right angle, from -pi/2 to pi/2."""
    return angle(a, b) - PI / 2


FUNCTIONS = (
    "angle", "arccos", "arcsin", "arctan", "atan2", "cos", "cross", "deviation", "dot", "exp", "length", "log", "sin",
    "sqrt", "square", "tan", "unit",
)  # fmt: skip
__all__ = ["FUNCTIONS", *FUNCTIONS]
