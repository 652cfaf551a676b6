"""Tapes on numbers of any size, for the few elements whose intermediate values might not fit their floats.

A number is a mantissa, a float64 of size 0.5 to 1, and an exponent of 2 of its own. Sums, products, quotients and roots are
rounded just as floats would be if nothing could overflow or underflow, so an element that needs none of this has the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from yarnverify.kernels.tape import Tape, smallest

Array = NDArray[Any]
Wide: TypeAlias = tuple[Array, Array]
_LEAST = -(2**40)  # exponent of zero: below that of any number
_APART = 1100  # further than this below another term, a term is nothing


def wide(values: Any) -> Wide:
    """Floats as mantissas and exponents."""
    mantissa, exponent = np.frexp(values)
    return mantissa, np.where(mantissa == 0, _LEAST, exponent.astype(np.int64))


def rounded(number: Wide) -> Array:
    """The nearest floats: infinite, subnormal or zero where they must be."""
    mantissa, exponent = number
    found: Array = np.ldexp(mantissa, np.clip(exponent, -4000, 4000).astype(np.int32))
    return found


def _normal(mantissa: Array, exponent: Array) -> Wide:
    mantissa, shift = np.frexp(mantissa)
    return mantissa, np.where(mantissa == 0, _LEAST, np.where(np.isfinite(mantissa), exponent + shift, 0))


def _aligned(a: Wide, b: Wide) -> tuple[Array, Array, Array]:
    """Two mantissas to the larger of their exponents, and that."""
    exponent = np.maximum(a[1], b[1])
    first, second = (np.ldexp(m, np.maximum(e - exponent, -_APART).astype(np.int32)) for m, e in (a, b))
    return first, second, exponent


def _add(a: Wide, b: Wide) -> Wide:
    first, second, exponent = _aligned(a, b)
    return _normal(first + second, exponent)


def _subtract(a: Wide, b: Wide) -> Wide:
    first, second, exponent = _aligned(a, b)
    return _normal(first - second, exponent)


def _maximum(a: Wide, b: Wide) -> Wide:
    first, second, _ = _aligned(a, b)
    return _where(first >= second, a, b)


def _select(condition: Wide, yes: Wide, no: Wide) -> Wide:
    return _where(condition[0] > 0, yes, no)


def _where(chosen: Array, a: Wide, b: Wide) -> Wide:
    return np.where(chosen, a[0], b[0]), np.where(chosen, a[1], b[1])


def _sqrt(a: Wide) -> Wide:
    odd = a[1] % 2
    return _normal(np.sqrt(np.ldexp(a[0], odd.astype(np.int32))), (a[1] - odd) // 2)


_LN2_HIGH, _LN2_LOW = float.fromhex("0x1.62e42feep-1"), float.fromhex("0x1.a39ef35793c76p-33")
_TINY, _LARGE = -100, 700.0  # an exponent below which sinh x = x; an argument beyond which exp x might not fit


def _either(chosen: Array, value: Array, otherwise: Wide) -> Wide:
    """A function as floats have it where that serves."""
    return _where(chosen, wide(np.where(chosen, value, 0.0)), otherwise)


def _exp(a: Wide) -> Wide:
    x = rounded(a)
    power = np.clip(np.rint(x / (_LN2_HIGH + _LN2_LOW)), -(2.0**20), 2.0**20)  # far beyond what fits, either way
    rest = np.clip((x - power * _LN2_HIGH) - power * _LN2_LOW, -1, 1)
    mantissa, exponent = wide(np.exp(rest))
    return _either(
        np.abs(x) <= _LARGE, np.exp(np.clip(x, -_LARGE, _LARGE)), (mantissa, exponent + power.astype(np.int64))
    )


def _expm1(a: Wide) -> Wide:
    x = np.clip(rounded(a), -_LARGE, _LARGE)
    return _where(a[1] < _TINY, a, _either(np.abs(rounded(a)) <= _LARGE, np.expm1(x), _subtract(_exp(a), wide(1.0))))


def _sinh(a: Wide) -> Wide:
    x = np.clip(rounded(a), -_LARGE, _LARGE)
    mantissa, exponent = _exp((np.abs(a[0]), a[1]))
    large = np.copysign(mantissa, a[0]), exponent - 1
    return _where(a[1] < _TINY, a, _either(np.abs(rounded(a)) <= _LARGE, np.sinh(x), large))


def _log(a: Wide) -> Wide:
    near = np.abs(a[1]) < 1000
    return wide(np.where(near, np.log(rounded(a)), np.log(a[0]) + a[1] * (_LN2_HIGH + _LN2_LOW)))


def _log1p(a: Wide) -> Wide:
    return _where(a[1] < _TINY, a, _either(a[1] < 1000, np.log1p(rounded(a)), _log(a)))


def _arctan2(a: Wide, b: Wide) -> Wide:
    first, second, _ = _aligned(a, b)
    slight = (second > 0) & (a[1] < b[1] - 40)  # where an angle is its tangent
    return _where(slight, _CALLS["divide"](a, b), wide(np.arctan2(first, second)))


def _of_floats(function: Any) -> Any:
    return lambda a: wide(function(rounded(a)))


_CALLS: dict[str, Any] = {
    "add": _add,
    "subtract": _subtract,
    "multiply": lambda a, b: _normal(a[0] * b[0], a[1] + b[1]),
    "divide": lambda a, b: _normal(a[0] / b[0], a[1] - b[1]),
    "negative": lambda a: (-a[0], a[1]),
    "positive": lambda a: a,
    "absolute": lambda a: (np.abs(a[0]), a[1]),
    "sqrt": _sqrt,
    "maximum": _maximum,
    "select": _select,
    "exp": _exp,
    "expm1": _expm1,
    "sinh": _sinh,
    "log": _log,
    "log1p": _log1p,
    "arctan2": _arctan2,
} | {f.__name__: _of_floats(f) for f in (np.cos, np.sin, np.tan)}


def serves(tape: Tape) -> bool:
    """Whether all that a tape does can be done here: not arc cosines, which hold few digits of small angles anyway."""
    return all(name in _CALLS for name, _, _ in tape.calls)


def run_wide(tape: Tape, inputs: Sequence[Any]) -> list[Wide]:
    """The outputs of a tape.

    Parameters
    ----------
    tape
        Of float64, one that this module ``serves``.
    inputs
        Finite floats, each (m,) or 0-d.
    """
    slots: list[Any] = [*map(wide, inputs), *[None] * (tape.outputs + tape.scratch)]
    for value in tape.constants:  # what is added so that nothing is divided by zero must stay below all else
        slots.append((np.float64(0.5), np.int64(_LEAST // 2)) if value == smallest(0.0) else wide(np.float64(value)))
    for name, operands, result in tape.calls:
        slots[result] = _CALLS[name](*[slots[i] for i in operands])
    return slots[tape.inputs : tape.inputs + tape.outputs]
