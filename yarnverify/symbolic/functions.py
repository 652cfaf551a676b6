"""The functions that a formula may use, and those of them that are written by others."""

from __future__ import annotations

from yarnverify.symbolic.tree import ONE, PI, Expr

FUNCTIONS = ("sin", "cos", "tan", "cot", "arcsin", "arccos", "arctan", "log", "exp")
OF_TWO = ("atan2",)  # written \operatorname{atan2}(y, x)
SAFE = ("expm1", "sinh", "log_ratio")  # of safe forms alone; see ``vanishing``


def is_turn(expr: Expr) -> bool:
    """Whether a tree is the angle of a point whose y has either sign: smooth where y is 0 and x positive."""
    return expr.op == "call" and expr.value == "atan2" and expr.args[0].op != "norm"


def sides_of(angle: Expr) -> tuple[Expr, Expr] | None:
    """The two vectors that a tree is the angle between; None for any other tree."""
    match angle:
        case Expr(
            op="call",
            value="arccos",
            args=(
                Expr(
                    op="mul",
                    args=(
                        Expr(op="transpose", args=(Expr(op="frac", args=(a, size_a)),)),
                        Expr(op="frac", args=(b, size_b)),
                    ),
                ),
            ),
        ) if (size_a, size_b) == (Expr("norm", (a,)), Expr("norm", (b,))):
            return a, b
    return None


def unfolded(expr: Expr) -> Expr | None:
    """A function by arc cosine, sine, cosine, exponential and logarithm alone; None for these themselves and for ``tan``.

    The angle of the point (x, y) is the arc cosine of its x, negative where y is; a norm never is.
    """
    match expr.value:
        case "expm1":
            return Expr("call", expr.args, "exp") - ONE
        case "sinh":
            return (Expr("call", expr.args, "exp") - Expr("call", (-expr.args[0],), "exp")) / 2
        case "log_ratio":
            ratio, excess = (
                expr.args
            )  # an excess that is not the ratio less 1 changes the value, so that proofs refuse it
            return (ONE + excess) / ratio * Expr("call", (ratio,), "log")
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
