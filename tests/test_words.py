"""Numbers of several words: what a sum keeps where its terms cancel, against fractions."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from yarnverify.kernels.tape import record
from yarnverify.kernels.words import number

U = 2.0**-53
FORMULAS: dict[str, Callable[[Any, Any, Any, Any, Any], Any]] = {  # e is what makes the rest of it cancel, as rounded
    "difference of products": lambda a, b, c, d, e: a * b - c * e,
    "of differences": lambda a, b, c, d, e: (a - b) * c - (a - d) * e,
    "quotient": lambda a, b, c, d, e: a / b - e,
    "squared, times the same": lambda a, b, c, d, e: (a * b - c * e) * (2**53 * (a * b - c * e)) * d,
    "sums in sums": lambda a, b, c, d, e: 2 * (a * b - c * e) - d * (a * b - c * e) / 2,
    "of three factors": lambda a, b, c, d, e: a * b * (c + d) - e * (a + c),
    "over another": lambda a, b, c, d, e: 1 / (a * b - c * e),
}
CANCELS: dict[str, Callable[[Any, Any, Any, Any], Any]] = {
    "of differences": lambda a, b, c, d: (a - b) * c / (a - d),
    "quotient": lambda a, b, c, d: a / b,
    "of three factors": lambda a, b, c, d: a * b * (c + d) / (a + c),
}


@pytest.mark.parametrize("name", FORMULAS)
def test_a_sum_that_cancels_to_the_rounding_of_its_terms_keeps_its_digits(name: str) -> None:
    formula = FORMULAS[name]
    draw = np.random.default_rng(2)
    a, b, c, d = draw.uniform(1, 2, (4, 200)) * np.array([3, 1, 1, 1])[:, None]
    e = CANCELS.get(name, lambda a, b, c, d: a * b / c)(a, b, c, d)
    tape = record(lambda s: [formula(*map(number, s)).rounded], 5, np.float64)
    plain = 0.0
    for row in np.array([a, b, c, d, e]).T:
        true = formula(*map(Fraction, row.tolist()))
        (found,) = tape.run_one(row.tolist())
        if U < abs(true) < 1 / U:  # what is smaller than the rounding of terms takes more words than are promised
            assert abs(Fraction(found) - true) <= 16 * U * abs(true)
            with np.errstate(divide="ignore"):
                plain = max(plain, abs(formula(*row) / float(true) - 1))
    assert plain > 0.01  # nothing of it is left in plain arithmetic


def test_exact_zeros_and_single_words() -> None:
    tape = record(lambda s: [(number(s[0]) * number(s[1]) - number(s[2]) * number(s[3])).rounded], 4, np.float64)
    assert tape.run_one([0.1, 0.3, 0.3, 0.1]) == [0.0] and tape.run_one([0.1, 0.3, 0.1, 0.2]) != [0.0]
    product = record(lambda s: [(number(s[0]) * number(s[1])).rounded], 2, np.float64)
    assert product.operations == 1
