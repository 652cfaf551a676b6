"""Trees back to LaTeX, in the notation of the document; reading the result gives the same tree again."""

from __future__ import annotations

from yarnverify.symbolic.functions import OF_TWO, SAFE
from yarnverify.symbolic.tree import Expr, Name

# The vocabulary that the grammar reads.
GREEK = (
    "alpha", "beta", "gamma", "delta", "epsilon", "varepsilon", "zeta", "eta", "theta", "vartheta", "iota", "kappa", "lambda",
    "mu", "nu", "xi", "rho", "varrho", "sigma", "tau", "upsilon", "phi", "varphi", "chi", "psi", "omega", "Gamma", "Theta",
    "Lambda", "Xi", "Sigma", "Upsilon", "Phi", "Psi", "Omega",
)  # fmt: skip
ACCENTS = ("bar", "hat", "tilde")

_ATOMS = {"number", "symbol", "force", "energy", "pi", "identity", "norm", "abs", "sqrt", "frac", "derivative"}


def name_latex(name: Name) -> str:
    """A symbol in LaTeX: ``Name("x", "1", bold=True)`` gives ``\\mathbf{x}_1``."""
    *prefixes, letter = name.base.split(" ")
    text = "\\" + letter if letter in GREEK else letter
    if name.bold:
        text = f"\\mathbf{{{text}}}"
    for prefix in reversed(prefixes):
        text = f"\\Delta {text}" if prefix == "Delta" else f"\\{prefix}{{{text}}}"
    if not name.sub:
        return text
    sub = ",".join("\\" + item if item in GREEK else item for item in name.sub.split(","))
    return f"{text}_{sub}" if len(sub) == 1 else f"{text}_{{{sub}}}"


def _group(expr: Expr) -> str:
    return f"\\left( {latex(expr)} \\right)"


def _atom(expr: Expr) -> str:
    """An expression that a superscript may follow."""
    if expr.op in {"symbol", "pi", "norm", "abs", "sqrt", "force", "energy", "identity", "number"}:
        return latex(expr)
    return _group(expr)


def _factor(expr: Expr) -> str:
    """An expression that may stand in a product."""
    if expr.op in _ATOMS or expr.op in {"pow", "transpose", "call", "cross", "dot"}:
        return latex(expr)
    return _group(expr)


def _operand(expr: Expr) -> str:
    """An expression that may stand beside a cross or a dot."""
    if expr.op in _ATOMS or expr.op in {"pow", "transpose", "call"}:
        return latex(expr)
    return _group(expr)


def _bare(expr: Expr) -> bool:
    """Whether a function may take the expression without parentheses."""
    return expr.op in {"symbol", "pi"}


def _call(expr: Expr, power: str = "") -> str:
    if expr.value in (*OF_TWO, *SAFE):
        return f"\\operatorname{{{expr.value}}}\\left( {', '.join(map(latex, expr.args))} \\right)"
    arg = expr.args[0]
    name = "ln" if expr.value == "log" else expr.value
    return f"\\{name}{power} {latex(arg) if _bare(arg) else _group(arg)}"


def _bars(expr: Expr, bar: str) -> str:
    """A norm or absolute value; an inner one makes the outer bars explicit, since opening and closing look alike."""
    nested = any(node.op in {"norm", "abs"} for node in expr.walk())
    return f"\\left{bar} {latex(expr)} \\right{bar}" if nested else f"{bar}{latex(expr)}{bar}"


def latex(expr: Expr) -> str:
    """LaTeX of a tree.

    >>> from yarnverify.symbolic.tree import symbol
    >>> latex((symbol("x", "1", True) - symbol("x", "0", True)).T * symbol("theta") ** 2)
    '\\\\left( \\\\mathbf{x}_1 - \\\\mathbf{x}_0 \\\\right)^T \\\\theta^2'
    """
    args = expr.args
    match expr.op:
        case "number":
            return str(expr.value)
        case "symbol":
            return name_latex(expr.name)
        case "energy":
            return name_latex(expr.name)
        case "force":
            return ("\\mathbf{F}" if expr.name.bold else "F") + f"_{{{name_latex(expr.name)}}}"
        case "pi":
            return "\\pi"
        case "identity":
            return "\\mathbf{I}"
        case "add":
            text = ""
            for arg in args:
                negative = arg.op == "neg"
                body = arg.args[0] if negative else arg
                part = _group(body) if body.op in {"add", "neg"} else latex(body)
                if not text:
                    text = f"-{part}" if negative else part
                else:
                    text += f" - {part}" if negative else f" + {part}"
            return text
        case "neg":
            return "-" + (_group(args[0]) if args[0].op in {"add", "neg"} else latex(args[0]))
        case "mul":
            return " ".join(_factor(arg) for arg in args)
        case "frac":
            return f"\\frac{{{latex(args[0])}}}{{{latex(args[1])}}}"
        case "pow":
            exponent = f"^{expr.value}" if len(str(expr.value)) == 1 else f"^{{{expr.value}}}"
            if (
                args[0].op == "call" and args[0].value not in OF_TWO and len(str(expr.value)) == 1
            ):  # sin^{-1} would be read as the inverse function
                return _call(args[0], exponent)
            return _atom(args[0]) + exponent
        case "transpose":
            return _atom(args[0]) + "^T"
        case "norm":
            return _bars(args[0], "\\|")
        case "abs":
            return _bars(args[0], "|")
        case "sqrt":
            return f"\\sqrt{{{latex(args[0])}}}"
        case "call":
            return _call(expr)
        case "cross":
            return f"{_operand(args[0])} \\times {_operand(args[1])}"
        case "dot":
            return f"{_operand(args[0])} \\cdot {_operand(args[1])}"
        case "derivative":
            return f"\\frac{{\\partial {_factor(args[0])}}}{{\\partial {name_latex(expr.name)}}}"
    raise AssertionError(f"no such operation: {expr.op}")
