"""Parameters of scenes: a default, a unit, and what values make sense.

k_s: float = positive(50.0, "N", "cotton sewing thread")     a scene's argument, whose default this is
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from yarnverify.errors import InputError

Value = float | int | str
_COUNT = 1e9
_LEAST, _MOST = 1e-30, 1e30  # of any number in SI units, so that no product of a few leaves the range of floats


@dataclass(frozen=True)
class Quantity:
    """What a parameter may be.

    Attributes
    ----------
    kind
        ``positive`` and ``real`` for numbers, ``whole`` for numbers of at least ``least``, ``choice`` for one of some words.
    unit
        SI; empty for what has none.
    reason
        Where the default comes from.
    """

    kind: Literal["positive", "real", "whole", "choice"]
    default: Value
    unit: str = ""
    reason: str = ""
    least: int = 1
    choices: tuple[str, ...] = ()

    def checked(self, name: str, value: Any) -> Value:
        """The value as a number or word.

        Raises
        ------
        InputError
            It is none that the parameter can have.
        """
        if self.kind == "choice":
            if value not in self.choices:
                raise InputError(f"{name} is one of {', '.join(self.choices)}; not {value!r}")
            return str(value)
        number = self._number(name, value) if isinstance(value, str) else value
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise InputError(f"{name} must be a number{self._in_unit}; not {value!r}")
        if not math.isfinite(number):
            raise InputError(f"{name} must be finite; not {value!r}")
        if self.kind == "whole":
            if number != int(number) or number < self.least:
                raise InputError(f"{name} must be a whole number, at least {self.least}; not {value!r}")
            if number > _COUNT:
                raise InputError(f"{name} must be at most {_COUNT:g}; not {value!r}")
            return int(number)
        if self.kind == "positive" and number <= 0:
            raise InputError(f"{name} must be positive{self._in_unit}; not {value!r}")
        if number and not _LEAST <= abs(number) <= _MOST:
            raise InputError(f"{name} must be between {_LEAST:g} and {_MOST:g} in size{self._in_unit}; not {value!r}")
        return float(number)

    @property
    def _in_unit(self) -> str:
        return f", in {self.unit}" if self.unit else ""

    def _number(self, name: str, text: str) -> float:
        found = re.fullmatch(
            r"\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf|infinity))\s*(.*?)\s*", text, re.IGNORECASE
        )
        try:
            number = float(found[1]) if found else math.nan
        except ValueError:
            found = None
        if found is None:
            raise InputError(f"{name} must be a number{self._in_unit}; not {text!r}")
        if found[2] and " ".join(found[2].split()) != self.unit:
            expected = f"a number in {self.unit}" if self.unit else "a number without a unit"
            raise InputError(f"{name} is {expected}; {text!r} has the unit {found[2]!r}")
        return number


def positive(default: float, unit: str, reason: str = "") -> Any:
    """A number above zero."""
    return Quantity("positive", default, unit, reason)


def real(default: float, unit: str, reason: str = "") -> Any:
    """Any number."""
    return Quantity("real", default, unit, reason)


def whole(default: int, reason: str = "", least: int = 1) -> Any:
    """A whole number."""
    return Quantity("whole", default, "", reason, least)


def choice(default: str, *others: str, reason: str = "") -> Any:
    """One of some words."""
    return Quantity("choice", default, "", reason, choices=(default, *others))


def quantities_of(function: Callable[..., Any]) -> dict[str, Quantity]:
    """The parameters that a scene's function declares after its first argument, the size."""
    import inspect

    arguments = list(inspect.signature(function).parameters.values())
    if not arguments or isinstance(arguments[0].default, Quantity):
        raise InputError(f"scene {function.__name__}: the first argument is the size")
    bare = [a.name for a in arguments[1:] if not isinstance(a.default, Quantity)]
    if bare:
        raise InputError(f'scene {function.__name__}: {", ".join(bare)} must be declared, such as = positive(1.0, "m")')
    return {a.name: a.default for a in arguments[1:]}
