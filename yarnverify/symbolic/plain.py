"""Trees as plain text, for a terminal."""

from __future__ import annotations

from yarnverify.symbolic.latex import ACCENTS
from yarnverify.symbolic.tree import Expr, Name

_GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ", "eta": "η", "theta": "θ", "kappa": "κ",
    "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "varphi": "φ", "chi": "χ",
    "psi": "ψ", "omega": "ω", "Gamma": "Γ", "Theta": "Θ", "Phi": "Φ", "Psi": "Ψ", "Omega": "Ω", "Delta": "Δ",
}  # fmt: skip
_LOOSE = {"add", "neg", "mul", "frac", "cross", "dot"}  # what parentheses keep together in a product
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def name_plain(name: Name) -> str:
    """A symbol: ``theta``, ``x1``, ``k_b``."""
    base = "".join(_GREEK.get(part, f"{part}_" if part in ACCENTS else part) for part in name.base.split(" "))
    return base + (name.sub if name.sub.isdigit() else f"_{name.sub}" if name.sub else "")


def _wrap(expr: Expr, ops: set[str]) -> str:
    text = plain(expr)
    return f"({text})" if expr.op in ops else text


def plain(expr: Expr) -> str:
    """One line of text.

    >>> from yarnverify.symbolic.tree import symbol
    >>> plain(symbol("k", "b") * symbol("theta") ** 2 / (symbol("u", "1") - symbol("u", "2")))
    'k_b θ² / (u1 - u2)'
    """
    args = expr.args
    match expr.op:
        case "number":
            return str(expr.value)
        case "symbol" | "energy":
            return name_plain(expr.name)
        case "force":
            return f"F_{name_plain(expr.name)}"
        case "pi":
            return "π"
        case "identity":
            return "I"
        case "add":
            text = plain(args[0])
            for arg in args[1:]:
                text += f" - {_wrap(arg.args[0], {'add'})}" if arg.op == "neg" else f" + {plain(arg)}"
            return text
        case "neg":
            return "-" + _wrap(args[0], {"add", "neg"})
        case "mul":
            return " ".join(_wrap(arg, _LOOSE) for arg in args)
        case "frac":
            return f"{_wrap(args[0], {'add', 'neg'})} / {_wrap(args[1], _LOOSE)}"
        case "pow":
            inner = _wrap(args[0], {*_LOOSE, "pow", "derivative"})
            exponent = str(expr.value).translate(_SUPERSCRIPT)
            if args[0].op == "call" and len(args[0].args) == 1:
                return f"{args[0].value}{exponent} {_wrap(args[0].args[0], {'add', 'neg', 'mul', 'frac'})}"
            return inner + exponent
        case "transpose":
            return _wrap(args[0], _LOOSE) + "ᵀ"
        case "norm" | "abs":
            return f"|{plain(args[0])}|"
        case "sqrt":
            return f"√({plain(args[0])})"
        case "call":
            if len(args) > 1:
                return f"{expr.value}({', '.join(map(plain, args))})"
            return f"{expr.value} {_wrap(args[0], {'add', 'neg', 'mul', 'frac', 'dot', 'transpose'})}"
        case "cross" | "dot":
            sign = "×" if expr.op == "cross" else "·"
            return f"{_wrap(args[0], _LOOSE)} {sign} {_wrap(args[1], _LOOSE)}"
        case "derivative":
            return f"∂{plain(args[0])}/∂{name_plain(expr.name)}"
    raise AssertionError(f"no such operation: {expr.op}")
