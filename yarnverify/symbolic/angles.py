"""The square of an angle as a function of its cosine: SymPy functions, their series, and proofs of both.

With t = arccos c and sigma = (1 - c)/2 = sin(t/2)^2, the functions

    A(c) = t^2,   A' = -2 f,   f(c) = t/sin t,   f' = -g,   g(c) = (sin t - t cos t)/sin(t)^3

are analytic at c = 1, where formulas in t are 0/0. There g is the series (1/3) 2F1(2, 2; 5/2; sigma), all of whose
coefficients are positive; ``turning_series`` makes a polynomial of it whose error is bounded rigorously, in rationals.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import comb
from typing import Any

import sympy as sp
from sympy.core.function import ArgumentIndexError

from yarnverify.errors import NotRunError

Rational = Fraction


class _OfCosine(sp.Function):  # type: ignore[misc]
    nargs = 1

    def _eval_is_real(self) -> bool:
        return True

    def fdiff(self, argindex: int = 1) -> Any:
        if argindex != 1:
            raise ArgumentIndexError(self, argindex)
        return self.slope(self.args[0])


class theta_squared(_OfCosine):
    """Square of the angle whose cosine is given."""

    @staticmethod
    def definition(t: Any) -> Any:
        return t**2

    @staticmethod
    def slope(c: Any) -> Any:
        return -2 * theta_over_sine(c)


class theta_over_sine(_OfCosine):
    """The angle over its sine."""

    @staticmethod
    def definition(t: Any) -> Any:
        return t / sp.sin(t)

    @staticmethod
    def slope(c: Any) -> Any:
        return -sine_excess(c)


class sine_excess(_OfCosine):
    """``(sin t - t cos t)/sin(t)^3``."""

    @staticmethod
    def definition(t: Any) -> Any:
        return (sp.sin(t) - t * sp.cos(t)) / sp.sin(t) ** 3

    @staticmethod
    def slope(c: Any) -> Any:
        return (3 * c * sine_excess(c) - theta_over_sine(c)) / (1 - c**2)


class theta_itself(_OfCosine):
    """The angle whose cosine is given; singular at c = 1 and c = -1."""

    @staticmethod
    def definition(t: Any) -> Any:
        return t

    @staticmethod
    def slope(c: Any) -> Any:
        return -1 / sine_of(c)


class sine_of(_OfCosine):
    """Sine of the angle whose cosine is given."""

    @staticmethod
    def definition(t: Any) -> Any:
        return sp.sin(t)

    @staticmethod
    def slope(c: Any) -> Any:
        return -c / sine_of(c)


FUNCTIONS = (theta_squared, theta_over_sine, sine_excess, theta_itself, sine_of)


def in_angle(value: Any, c: sp.Symbol, t: sp.Symbol) -> Any:
    """An expression of these functions of ``c``, written in the angle ``t``."""
    for function in FUNCTIONS:
        value = value.subs(function(c), function.definition(t))
    return value.subs(c, sp.cos(t))


def prove_derivatives() -> list[str]:
    """Names of the functions whose stated derivative is proved: d/dc = -1/sin(t) d/dt.

    Raises
    ------
    NotRunError
        If one is not the derivative of its definition.
    """
    c, t = sp.Symbol("c", real=True), sp.Symbol("t", positive=True)
    proved = []
    for function in FUNCTIONS:
        stated = in_angle(function.slope(c), c, t)
        true = -sp.diff(function.definition(t), t) / sp.sin(t)
        if not _is_zero_in_angle(stated - true, t):
            raise NotRunError(f"{function.__name__}: its stated derivative is not that of its definition")
        proved.append(function.__name__)
    return proved


def _is_zero_in_angle(value: Any, t: sp.Symbol) -> bool:
    """Whether a rational expression of t, sin t and cos t is zero: a polynomial identity modulo sin^2 + cos^2 = 1."""
    s, c, a = sp.symbols("s c a")
    value = value.subs({sp.sin(t): s, sp.cos(t): c}).subs(t, a)
    numerator, _ = sp.fraction(sp.together(value))
    return bool(sp.rem(sp.Poly(numerator, c, s, a), sp.Poly(c**2 - 1 + s**2, c, s, a)).is_zero)


# -- series -----------------------------------------------------------------------------------------------------------


def coefficients(count: int) -> list[Rational]:
    """The first coefficients of g in sigma, by the recurrence that ``prove_recurrence`` proves."""
    found = [Fraction(1, 3)]
    for n in range(1, count):
        found.append(found[-1] * ratio(n))
    return found


def ratio(n: int) -> Rational:
    """Coefficient n over coefficient n - 1; above 1, and falling towards 1."""
    return Fraction(2 * (n + 1) ** 2, n * (2 * n + 3))


def prove_recurrence() -> None:
    """Prove the ratio of neighbouring coefficients.

    f satisfies (1 - c^2) f' = c f - 1, which in sigma is 2 sigma (1 - sigma) df/dsigma = 1 - (1 - 2 sigma) f. Comparing
    powers gives (2 n + 1) f_n = 2 n f_(n-1) with f_0 = 1, and g = (1/2) df/dsigma gives g_n = (n + 1) f_(n+1) / 2.

    Raises
    ------
    NotRunError
        If a step fails.
    """
    c, t, n, x = sp.Symbol("c"), sp.Symbol("t", positive=True), sp.Symbol("n", positive=True), sp.Symbol("x")
    f, g = theta_over_sine(c), sine_excess(c)
    steps = [_is_zero_in_angle(in_angle((1 - c**2) * -g - (c * f - 1), c, t), t)]
    # the coefficient of x^n, where f_n x^n contributes 2 n f_n x^n - 2 n f_n x^(n+1) on the left
    f_n, f_before = sp.symbols("f_n f_before")
    left = 2 * n * f_n - 2 * (n - 1) * f_before
    right = -f_n + 2 * f_before
    steps.append(sp.simplify(sp.solve(left - right, f_n)[0] / f_before - 2 * n / (2 * n + 1)) == 0)
    of_f = 2 * (n + 1) / (2 * n + 3)  # f_(n+1) / f_n
    steps.append(sp.simplify((n + 1) * of_f / n - 2 * (n + 1) ** 2 / (n * (2 * n + 3))) == 0)
    # f_0 = 1 and f_1 = 2/3, so g_0 = 1/3; the ratio falls: its derivative is negative for n >= 1
    steps.append(sp.limit(theta_over_sine.definition(t), t, 0) == 1)
    falling = sp.diff(2 * (x + 1) ** 2 / (x * (2 * x + 3)), x)
    steps.append(
        all(k < 0 for k in sp.Poly(sp.expand(sp.fraction(sp.together(falling))[0].subs(x, x + 1)), x).coeffs())
    )
    if not all(steps):
        raise NotRunError(f"the series of (sin t - t cos t)/sin^3 t is not proved: step {steps.index(False) + 1}")


@dataclass(frozen=True)
class Series:
    """A polynomial for g on [0, ``top``], lowest power first, in doubles; its relative error is below ``bound``."""

    coefficients: tuple[float, ...]
    top: Rational
    bound: Rational


def turning_series(top: Rational, degree: int, terms: int = 90) -> Series:
    """Polynomial of small degree for g on [0, top], with a rigorous bound.

    The power series is cut where its tail is provably negligible, written in Chebyshev polynomials of the interval exactly,
    cut to the degree (each lost coefficient costs at most itself), and rounded to doubles; all costs are added up.

    Parameters
    ----------
    top
        End of the interval of sigma.
    degree
        Of the polynomial.
    terms
        Of the power series that is economised.
    """
    power = coefficients(terms + 2)
    tail = power[terms] * top**terms / (1 - power[terms + 1] / power[terms] * top)
    chebyshev = _chebyshev(_shifted(power[:terms], Fraction(top) / 2, Fraction(top) / 2))
    lost = sum(map(abs, chebyshev[degree + 1 :]), Fraction(0))
    polynomial = _shifted(_power(chebyshev[: degree + 1]), Fraction(2) / top, Fraction(-1))
    rounded = tuple(float(value) for value in polynomial)
    rounding = sum(
        (abs(Fraction(r) - p) * top**i for i, (r, p) in enumerate(zip(rounded, polynomial, strict=True))), Fraction(0)
    )
    return Series(rounded, top, (tail + lost + rounding) / power[0])  # g >= g(0) = 1/3


def _shifted(polynomial: list[Rational], scale: Rational, offset: Rational) -> list[Rational]:
    """Coefficients of p(scale x + offset)."""
    found = [Fraction(0)]
    for coefficient in reversed(polynomial):
        grown = [Fraction(0)] * (len(found) + 1)
        for i, value in enumerate(found):
            grown[i] += value * offset
            grown[i + 1] += value * scale
        grown[0] += coefficient
        found = grown
    return found[: len(polynomial)]


def _chebyshev(polynomial: list[Rational]) -> list[Rational]:
    """Coefficients in Chebyshev polynomials: x^n = 2^(1-n) sum_k C(n, k) T_(n-2k), the last halved if n is even."""
    found = [Fraction(0)] * len(polynomial)
    for n, coefficient in enumerate(polynomial):
        for k in range(n // 2 + 1):
            weight = Fraction(2 * comb(n, k), 2**n)
            found[n - 2 * k] += coefficient * (weight / 2 if n == 2 * k else weight)
    return found


def _power(chebyshev: list[Rational]) -> list[Rational]:
    """Coefficients in powers, from those in Chebyshev polynomials."""
    found = [Fraction(0)] * len(chebyshev)
    before, now = [Fraction(1)], [Fraction(0), Fraction(1)]
    for n, coefficient in enumerate(chebyshev):
        for i, value in enumerate(before):
            found[i] += coefficient * value
        if n < len(chebyshev) - 1:
            grown = [Fraction(0), *(2 * value for value in now)]
            for i, value in enumerate(before):
                grown[i] -= value
            before, now = now, grown
    return found
