"""The functions that a formula may use, and those of them that are written by others."""

from __future__ import annotations

from yarnverify.symbolic.tree import ONE, PI, Expr

FUNCTIONS = ("sin", "cos", "tan", "cot", "arcsin", "arccos", "arctan", "log", "exp")
OF_TWO = ("atan2",)  # written \operatorname{atan2}(y, x)


def unfolded(expr: Expr) -> Expr | None:
    """A function by arc cosine, sine and cosine alone; None for these themselves and for ``tan``.

    The angle of the point (x, y) is the arc cosine of its x, negative where y is; a norm never is.
    """
    match expr.value:
        case "cot":
            return Expr("call", expr.args, "cos") / Expr("call", expr.args, "sin")
        case "arcsin":
            return PI / 2 - Expr("call", expr.args, "arccos")
        case "arctan":
            (slope,) = expr.args
            return PI / 2 - Expr("call", (slope / Expr("sqrt", (ONE + slope**2,)),), "arccos")
        case "atan2":
            y, x = expr.args
            angle = Expr("call", (x / Expr("sqrt", (x**2 + y**2,)),), "arccos")
            return angle if y.op == "norm" else y / Expr("norm", (y,)) * angle
    return None
