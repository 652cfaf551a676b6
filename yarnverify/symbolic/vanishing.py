"""Laws with exponentials and logarithms near where these cancel: ``exp(x) - 1`` at x = 0, ``log(r)`` at r = 1.

What is put in their place are functions of their own, which trees have too and proofs unfold (``functions.unfolded``):

    expm1(x)         exp(x) - 1
    sinh(x)          (exp(x) - exp(-x))/2
    log_ratio(r, s)  log(r), where s = r - 1 is written by a difference that keeps its digits

so that a law's safe shape is proved with them, and a wrong s is refused.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from yarnverify.symbolic.functions import SAFE
from yarnverify.symbolic.laws import exponential
from yarnverify.symbolic.safe import Safe
from yarnverify.symbolic.tree import Expr

KEPT = frozenset({"exp", "log", *SAFE})  # functions whose values keep the digits of their arguments


class expm1(sp.Function):  # type: ignore[misc]
    """``exp(x) - 1``."""

    def fdiff(self, argindex: int = 1) -> Any:
        return sp.exp(self.args[0])


class sinh(sp.Function):  # type: ignore[misc]
    """``(exp(x) - exp(-x))/2``."""

    def fdiff(self, argindex: int = 1) -> Any:
        return (sp.exp(self.args[0]) + sp.exp(-self.args[0])) / 2


class log_ratio(sp.Function):  # type: ignore[misc]
    """``log(r)`` of r and r - 1; its derivative is taken by r."""

    def fdiff(self, argindex: int = 1) -> Any:
        return 1 / self.args[0] if argindex == 1 else sp.S.Zero


def vanishes(law: Any) -> bool:
    """Whether a law has what this module rewrites."""
    return bool(law.has(exponential, sp.log))


def without_cancellation(value: Any) -> Any:
    """A law or a derivative of one with the functions above; sums are gathered over their denominators, but never opened."""
    return _gathered(value).replace(lambda e: e.is_Add or isinstance(e, sp.log), _rewritten)


def _gathered(value: Any) -> Any:
    if not value.args:
        return value
    found = value.func(*map(_gathered, value.args))
    return sp.gcd_terms(found) if found.is_Add else found


def _rewritten(value: Any) -> Any:
    return sum_of(value) if value.is_Add else logarithm_of(value.args[0])


def sum_of(value: Any) -> Any:
    """A sum of numbers times exponentials, and of others; rewritten where the numbers add up to 0."""
    shares = {term.as_coeff_Mul() for term in value.args if isinstance(term.as_coeff_Mul()[1], exponential)}
    constant = sum((term for term in value.args if term.is_Rational), sp.S.Zero)
    if not shares or sum((share for share, _ in shares), constant) != 0:
        return value
    rest = sp.Add(*(t for t in value.args if not t.is_Rational and not isinstance(t.as_coeff_Mul()[1], exponential)))
    if len(shares) == 2:
        (p, first), (q, second) = sorted(shares, key=lambda share: (bool(share[0] < 0), str(share[1])))
        x, y = first.args[0], second.args[0]
        if (x + y).expand() == 0:
            return rest + (-p * expm1(x) * expm1(-x) if p == q else 2 * p * sinh(x))
    return rest + sp.Add(*(share * expm1(each.args[0]) for share, each in shares))


def logarithm_of(ratio: Any) -> Any:
    """The logarithm of a quotient, by what it is apart from 1."""
    above, below = sp.fraction(sp.together(ratio))
    if ratio.is_number or (below.is_number and not above.is_Add):
        return sp.log(ratio)
    excess = sp.factor(above - below) / below
    return log_ratio(above / below, excess)


def kept_by_sums(shape: Safe) -> bool:
    """Whether no sum of the scalars of a shape loses more of its function values than the rounding of coordinates explains.

    That holds for numbers and one function value, since what is 0 at a single argument other than those of ``expm1`` and
    ``log_ratio`` changes there as fast as the function does; and for exponentials of one sign.
    """
    trees = [shape.law, *(definition.expression for definition in shape.section.definitions.values())]
    trees += [tree for first, rest in shape.blocks(1) for _, tree in (first, *rest)]
    sums = {node for tree in trees for node in tree.walk() if node.op == "add"}
    return all(_keeps(node.args) for node in sums)


def _keeps(terms: tuple[Expr, ...]) -> bool:
    varying = [term for term in terms if any(node.op == "call" and node.value in KEPT for node in term.walk())]
    others = [node for term in terms if term not in varying for node in term.walk()]
    one = len(varying) < 2 and (not varying or not any(node.op in ("symbol", "call") for node in others))
    bare = [term.args[0] if term.op == "neg" else term for term in terms]
    one_sign = len({term.op == "neg" for term in terms}) == 1
    return one or (one_sign and all(term.op == "call" and term.value == "exp" for term in bare))
