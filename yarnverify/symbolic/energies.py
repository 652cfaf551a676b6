"""What declarations are as data: energies, quantities, motions, and the symbols that Python names stand for."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from yarnverify.symbolic.latex import ACCENTS
from yarnverify.symbolic.tree import Expr, Name


@dataclass(frozen=True)
class Parameter:
    name: Name
    unit: str
    positive: bool
    direction: bool = False  # a vector of length 1

    @property
    def label(self) -> str:
        """Its argument in a kernel, such as ``k_b``."""
        return self.name.identifier


@dataclass(frozen=True)
class Assumption:
    """``left > right``, in the notation of the document."""

    left: Expr
    right: Expr
    strict: bool = True


@dataclass(frozen=True)
class Energy:
    """A declared energy.

    Attributes
    ----------
    name, document, section, unit, summary
        What it is, and which section of which document prints it.
    unknowns, units, parameters
        In the order of the function's signature; ``units`` are those of the unknowns.
    expression
        The energy itself.
    domain
        Where it is meant; ``removable`` and ``singular`` are the states in which its derivatives need care, or are
        undefined, in the notation of the document.
    rest
        One state of least energy: a value for each unknown (3 for a point), and 1 for each parameter not named.
    elsewhere
        What holds outside the domain: ``error``, or ``zero`` for an energy that does not act there.
    unchanged
        Motions that leave the energy as it is: ``translation``, ``rotation``, ``sliding`` (all sliding coordinates together).
    place
        File, line and column of its declaration.
    """

    name: str
    document: str
    section: str
    unit: str
    summary: str
    unknowns: tuple[Name, ...]
    units: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    expression: Expr
    domain: tuple[Assumption, ...] = ()
    removable: str = ""
    singular: str = ""
    rest: dict[str, Any] = field(default_factory=dict)
    elsewhere: str = "error"
    unchanged: tuple[str, ...] = ()
    place: tuple[str, int, int] = field(default=("", 1, 1), compare=False)

    def _repr_latex_(self) -> str:
        return "$\\displaystyle V = " + self.expression._repr_latex_().removeprefix("$\\displaystyle ")

    @property
    def file(self) -> str:
        """Name of the file that declares it."""
        return Path(self.place[0]).name


@dataclass(frozen=True)
class Motion:
    """A special motion that leaves an energy as it is: the rate of each unknown that moves; it may depend on the state."""

    energy: str
    name: str
    summary: str
    rates: tuple[tuple[Name, Expr], ...]


@dataclass(frozen=True)
class Quantity:
    """A declared meaning of a symbol of the document; ``section`` is empty where it holds for all sections."""

    symbol: Name
    document: str
    section: str
    unit: str
    expression: Expr
    build: Callable[..., Expr] = field(compare=False)

    def __call__(self, *args: Expr) -> Expr:
        return self.build(*args)


@dataclass(frozen=True)
class Declarations:
    """All that one folder of derivations declares."""

    energies: tuple[Energy, ...] = ()
    quantities: tuple[Quantity, ...] = ()
    motions: tuple[Motion, ...] = ()


_INDEXED = re.compile(r"([A-Za-z]+?)_?(\d+|[ij])\Z")


def name_of(identifier: str, bold: bool = False, indexed: bool = False) -> Name:
    """The symbol that a Python identifier stands for: ``x1`` is x_1, ``k_b`` is k_b, ``bar_l`` is an l with a bar."""
    if indexed and (match := _INDEXED.match(identifier)):
        return Name(match[1], match[2], bold)
    accent, _, rest = identifier.partition("_")
    if accent in ACCENTS and rest:  # bar_l is \bar{l}
        inner = name_of(rest, bold, indexed)
        return replace(inner, base=f"{accent} {inner.base}")
    base, _, sub = identifier.partition("_")
    return Name(base, sub, bold)
