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
    """A law or a derivative of one in factors, what stands under its roots as it is."""
    under = radicands(value)
    roots = {sp.Symbol(f"root_{i}", positive=True): base for i, base in enumerate(under)}
    named = value.replace(
        lambda e: e.is_Pow and not e.exp.is_Integer and e.base in under,
        lambda e: next(root for root, base in roots.items() if base == e.base) ** (2 * e.exp),
    )
    above, below = sp.fraction(sp.together(named))
    for root, base in roots.items():
        above = _lowered(above, root, base)
        above, rest = sp.fraction(sp.together(above))
        below = below * rest
    found = _conjugate(sp.factor(above), roots) / sp.factor(below)
    return found.subs({root: sp.sqrt(base) for root, base in roots.items()})


def _lowered(value: Any, root: Any, base: Any) -> Any:
    """A polynomial in a root with its square put in: ``a + b root``."""
    found = sp.S.Zero
    for (power,), factor in sp.Poly(sp.expand(value), root).terms():
        found += factor * base ** (power // 2) * root ** (power % 2)
    return found


def _conjugate(value: Any, roots: dict[Any, Any]) -> Any:
    """Products whose sums ``a root - b`` of positive a and b are written as ``(a^2 base - b^2)/(a root + b)``."""
    return sp.Mul(*(_apart(factor, roots) for factor in sp.Mul.make_args(value)))


def _apart(factor: Any, roots: dict[Any, Any]) -> Any:
    for root, base in roots.items():
        slope = factor.coeff(root, 1) if factor.is_Add else sp.S.Zero
        rest = factor - slope * root
        opposite = slope != 0 and not rest.has(*roots) and bool(slope.as_coeff_Mul()[0] * rest.as_coeff_Mul()[0] < 0)
        if opposite and not slope.is_Add and not rest.is_Add:
            return sp.factor(slope**2 * base - rest**2) / (slope * root - rest)
    return factor
