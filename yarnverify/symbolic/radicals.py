"""Laws with square roots of sums that are no plain differences, such as ``sqrt(1 + ((l - L)/a)^2) - 1``.

Factoring would open what stands under the root, where a sum of squares then cancels; and differentiating leaves quotients
by powers of the root, whose sums cancel. Here each root is a symbol while terms are brought over one denominator, its
square is put in above, and what is under it stays as it was declared. A root less what is as large is written by the sum of
both: ``sqrt(1 + t) - 1 = t/(sqrt(1 + t) + 1)``.
"""

from __future__ import annotations

from typing import Any

import sympy as sp


def radicands(law: Any) -> list[Any]:
    """The sums under square roots that factoring would open."""
    found = {power.base for power in law.atoms(sp.Pow) if not power.exp.is_Integer and _opens(power.base)}
    return sorted(found, key=sp.default_sort_key)


def _opens(base: Any) -> bool:
    return any(
        not term.as_coeff_Mul()[1].is_Symbol for each in base.atoms(sp.Add) for term in each.args if not term.is_number
    )


def with_roots(value: Any) -> Any:
    """A law or a derivative of one as a sum of factors times roots, what stands under these as it is."""
    under = radicands(value)
    roots = {sp.Symbol(f"root_{i}", positive=True): base for i, base in enumerate(under)}
    named = value.replace(
        lambda e: e.is_Pow and not e.exp.is_Integer and e.base in under,
        lambda e: next(root for root, base in roots.items() if base == e.base) ** (2 * e.exp),
    )
    above, below = sp.fraction(sp.together(named))
    powers = {root: -sp.degree(below, root) for root in roots}
    below = below.xreplace(dict.fromkeys(roots, sp.S.One)) if below.is_Mul or below.is_Pow or below in roots else below
    if below.has(*roots):
        return value  # roots within sums below the line stay as they are
    parts: dict[
        tuple[int, ...], Any
    ] = {}  # by the parities of the roots' powers: of each the factor of the lowest ones
    for degrees, factor in sp.Poly(sp.expand(above), *roots).terms():
        whole = [power + degree for power, degree in zip(powers.values(), degrees, strict=True)]
        parts.setdefault(tuple(power % 2 for power in whole), []).append((whole, factor))
    found: list[tuple[Any, Any]] = []  # factor, product of roots
    for terms in parts.values():
        lowest = [min(whole[i] for whole, _ in terms) for i in range(len(roots))]
        total = sp.S.Zero
        for whole, factor in terms:
            lifts = zip(roots.values(), whole, lowest, strict=True)
            total += factor * sp.Mul(*(base ** ((power - low) // 2) for base, power, low in lifts))
        found.append((sp.factor(total), sp.Mul(*(root**low for root, low in zip(roots, lowest, strict=True)))))
    made = _paired(found, roots) / sp.factor(below)
    return made.xreplace({root: sp.sqrt(base) for root, base in roots.items()})


def _paired(parts: list[tuple[Any, Any]], roots: dict[Any, Any]) -> Any:
    """The sum of the parts, in which ``a root - b`` is written as ``(a^2 base - b^2)/(a root + b)`` where that is shorter."""
    rest = list(sp.Add.make_args(sp.expand(next((factor for factor, product in parts if product == 1), sp.S.Zero))))
    done = []
    for factor, product in parts:
        if product == 1:
            continue
        base, partner = roots.get(product), None
        if base is not None and not sp.expand(factor).is_Add:
            square = factor**2 * base
            for each in rest:
                opposite = each.as_coeff_Mul()[0] * factor.as_coeff_Mul()[0] < 0
                if opposite and _size(square - each**2) < _size(square):
                    partner = each
                    break
        if partner is None:
            done.append(factor * product)
            continue
        rest.remove(partner)
        done.append(sp.factor(square - partner**2) / (factor * product - partner))
    return sp.Add(sp.factor(sp.Add(*rest)), *done)


def _size(value: Any) -> int:
    return int(sp.count_ops(sp.factor(value)))
