r"""Energies as a person declares them: one short file each, read aloud without stumbling.

.. code-block:: python

    @energy(document="cirio2014.md", section="Stretch", unit="J", domain=r"u_1 > u_0")
    def stretch(x0: Point, x1: Point, u0: Sliding, u1: Sliding, *, k_s: Positive["N"]):
        "Squared strain, times the rest length that carries it."
        ...

Arguments are the unknowns, keywords the parameters; the function returns a tree, so it uses ``+ - * /``, integer powers
and the measures below, and no floats.
"""

from __future__ import annotations

import inspect
import re
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_type_hints

from yarnverify.errors import InputError
from yarnverify.source import Source
from yarnverify.symbolic.latex import ACCENTS
from yarnverify.symbolic.reader import parse
from yarnverify.symbolic.tree import PI, Expr, Name, ShapeError, Type, as_expr, type_of


class Point:
    """Annotation of an unknown position: three coordinates, in metres."""


class Sliding:
    """Annotation of an unknown sliding coordinate: rest arc length along a yarn, in metres."""


class Velocity:
    """Annotation of the velocity of a point: three components, in metres per second."""


class SlidingSpeed:
    """Annotation of the velocity of a sliding coordinate, in metres per second."""


_KINDS = {Point: (True, "m"), Sliding: (False, "m"), Velocity: (True, "m s^-1"), SlidingSpeed: (False, "m s^-1")}


@dataclass(frozen=True)
class Real:
    """Annotation of a parameter of any sign: ``Real["rad"]``."""

    unit: str
    positive: bool = False
    vector: bool = False

    def __class_getitem__(cls, unit: str) -> Real:
        return cls(unit)


class Positive:
    """Annotation of a parameter that is never negative: ``Positive["N m^2"]``."""

    def __class_getitem__(cls, unit: str) -> Real:
        return Real(unit, positive=True)


class Vector:
    """Annotation of a parameter with three components of any sign: ``Vector["m s^-2"]``."""

    def __class_getitem__(cls, unit: str) -> Real:
        return Real(unit, vector=True)


def length(a: Expr) -> Expr:
    """Length of a vector."""
    return Expr("norm", (a,))


def square(a: Expr) -> Expr:
    """Square of the length of a vector."""
    return Expr("mul", (a.T, a))


def unit(a: Expr) -> Expr:
    """Direction of a vector."""
    return Expr("frac", (a, length(a)))


def angle(a: Expr, b: Expr) -> Expr:
    """Angle between two directions, from 0 to pi."""
    return Expr("call", (Expr("mul", (unit(a).T, unit(b))),), "arccos")


def dot(a: Expr, b: Expr) -> Expr:
    """Scalar product of two vectors."""
    return Expr("mul", (a.T, b))


def cross(a: Expr, b: Expr) -> Expr:
    """Vector product."""
    return Expr("cross", (a, b))


def _function(name: str, what: str) -> Callable[[Expr | int], Expr]:
    def function(value: Expr | int) -> Expr:
        return Expr("sqrt", (as_expr(value),)) if name == "sqrt" else Expr("call", (as_expr(value),), name)

    function.__name__, function.__doc__ = name, what
    return function


sqrt = _function("sqrt", "Square root of a scalar.")
sin = _function("sin", "Sine of an angle in radians.")
cos = _function("cos", "Cosine of an angle in radians.")
tan = _function("tan", "Tangent of an angle in radians.")
arccos = _function("arccos", "Angle from 0 to pi with a given cosine.")
log = _function("log", "Natural logarithm of a positive scalar.")
exp = _function("exp", "Exponential of a scalar.")


def deviation(a: Expr, b: Expr) -> Expr:
    """How much the angle between two directions exceeds a right angle, from -pi/2 to pi/2."""
    return angle(a, b) - PI / 2


@dataclass(frozen=True)
class Parameter:
    name: Name
    unit: str
    positive: bool

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


def place_of(function: Callable[..., Any]) -> tuple[str, int, int]:
    """Where a function begins: its ``def``, below any decorators."""
    code = function.__code__
    try:
        lines, first = inspect.getsourcelines(function)
    except (OSError, TypeError):  # not from a file
        return code.co_filename, code.co_firstlineno, 1
    below = next((i for i, line in enumerate(lines) if line.lstrip().startswith("def ")), 0)
    return code.co_filename, first + below, 1


def _unknowns(function: Callable[..., Any], hints: dict[str, Any]) -> dict[str, Expr]:
    found = {}
    for key, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is parameter.KEYWORD_ONLY:
            continue
        if hints.get(key) not in _KINDS:
            raise TypeError(
                f"argument {key!r} of {function.__name__} must be annotated Point or Sliding, Velocity or SlidingSpeed"
            )
        found[key] = Expr("symbol", value=name_of(key, _KINDS[hints[key]][0], indexed=True))
    return found


def _parameters(function: Callable[..., Any], hints: dict[str, Any]) -> dict[str, Parameter]:
    found = {}
    for key, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is not parameter.KEYWORD_ONLY:
            continue
        kind = hints.get(key)
        if not isinstance(kind, Real):
            raise TypeError(
                f"parameter {key!r} of {function.__name__} must be annotated "
                'Positive["unit"], Real["unit"] or Vector["unit"]'
            )
        found[key] = Parameter(name_of(key, kind.vector), kind.unit, kind.positive)
    return found


def assumptions(members: Iterable[Expr], operators: Iterable[str]) -> tuple[Assumption, ...]:
    """The inequalities of a chain such as ``u_1 > u_0 > u_2``; neighbours that one direction joins are all compared."""
    members, operators = tuple(members), tuple(operators)
    found = []
    for i in range(len(operators)):
        direction = ""
        for j in range(i, len(operators)):
            operator = operators[j]
            if operator != "=":
                if direction not in ("", operator[0]):
                    break
                direction = operator[0]
            if direction:
                left, right = (i, j + 1) if direction == ">" else (j + 1, i)
                strict = any(len(op) == 1 and op != "=" for op in operators[i : j + 1])
                found.append(Assumption(members[left], members[right], strict))
    return tuple(found)


def _parsed(text: str, what: str) -> Any:
    try:
        return parse(Source(what, text), 0, len(text))
    except InputError as error:
        raise ValueError(str(error)) from None


def energy(
    *,
    document: str = "",
    section: str = "",
    unit: str = "J",
    domain: str = "",
    removable: str = "",
    singular: str = "",
    rest: dict[str, Any] | None = None,
    elsewhere: Literal["error", "zero"] = "error",
    unchanged: tuple[Literal["translation", "rotation", "sliding"], ...] = (),
) -> Callable[[Callable[..., Expr]], Energy]:
    """Declare an energy; see the module's example and ``Energy`` for what the options mean."""

    def declare(function: Callable[..., Expr]) -> Energy:
        hints = get_type_hints(function)
        unknowns, parameters = _unknowns(function, hints), _parameters(function, hints)
        symbols = {key: Expr("symbol", value=parameter.name) for key, parameter in parameters.items()}
        name = function.__name__
        where: list[Assumption] = []
        if domain:
            for members, operators in _parsed(domain, f"domain of {name}"):
                where += assumptions(members, operators)
        expression = as_expr(function(**unknowns, **symbols))
        try:
            kind = type_of(expression, lambda symbol: Type.VECTOR if symbol.bold else Type.SCALAR)
        except ShapeError as error:
            raise TypeError(f"{name}: {error.message}") from None
        if kind is not Type.SCALAR:
            raise TypeError(f"{name}: an energy is a scalar, and this is a {kind.value}")
        return Energy(
            name, document, section, unit, inspect.getdoc(function) or "",
            tuple(node.name for node in unknowns.values()), tuple(_KINDS[hints[key]][1] for key in unknowns),
            tuple(parameters.values()),
            expression, tuple(where), removable, singular, rest or {}, elsewhere, unchanged, place_of(function),
        )  # fmt: skip

    return declare


def quantity(
    *, symbol: str, document: str = "", section: str = "", unit: str = "1"
) -> Callable[[Callable[..., Expr]], Quantity]:
    """Declare what a symbol of the document means; an argument such as ``x_i`` carries the running index."""

    def declare(function: Callable[..., Expr]) -> Quantity:
        hints = get_type_hints(function)
        relations = _parsed(symbol, f"symbol of {function.__name__}")
        members, operators = relations[0]
        if len(relations) > 1 or operators or members[0].op != "symbol":
            raise ValueError(f"symbol of {function.__name__} must be one symbol, not {symbol!r}")
        return Quantity(members[0].name, document, section, unit, function(**_unknowns(function, hints)), function)

    return declare


def unchanged_by(energy: Energy) -> Callable[[Callable[..., dict[str, Expr | int]]], Motion]:
    """Declare a motion that leaves an energy as it is: a function of unknowns that gives the rate of each that moves."""

    def declare(function: Callable[..., dict[str, Expr | int]]) -> Motion:
        labels = {name.label: name for name in energy.unknowns}
        rates = function(**_unknowns(function, get_type_hints(function)))
        if strange := set(rates) - set(labels):
            raise ValueError(f"{function.__name__}: {energy.name} has no unknown {', '.join(sorted(strange))}")
        moves = tuple((labels[label], as_expr(rate)) for label, rate in rates.items())
        return Motion(energy.name, function.__name__.replace("_", " "), inspect.getdoc(function) or "", moves)

    return declare


@dataclass(frozen=True)
class Declarations:
    """All that one folder of derivations declares."""

    energies: tuple[Energy, ...] = ()
    quantities: tuple[Quantity, ...] = ()
    motions: tuple[Motion, ...] = ()


def load_declarations(folder: Path) -> Declarations:
    """Run the Python files of a folder, in alphabetical order, and collect what they declare.

    Raises
    ------
    InputError
        Where a file does not run.
    """
    energies: dict[str, Energy] = {}
    quantities: list[Quantity] = []
    motions: list[Motion] = []
    for path in sorted(path for path in folder.glob("*.py") if path.is_file()):
        namespace: dict[str, Any] = {"__name__": path.stem, "__file__": str(path)}
        try:
            exec(compile(path.read_bytes(), str(path), "exec"), namespace)
        except SyntaxError as error:
            raise InputError(error.msg, (str(path), error.lineno or 1, error.offset or 1)) from None
        except Exception as error:
            frames = traceback.extract_tb(error.__traceback__)
            lines = [frame.lineno for frame in frames if frame.filename == str(path) and frame.lineno]
            place = (str(path), lines[-1] if lines else 1, 1)
            raise InputError(f"{type(error).__name__}: {error}", place) from None
        for value in namespace.values():
            if isinstance(value, Energy):
                if energies.get(value.name, value) is not value:
                    raise InputError(f"energy {value.name!r} is declared twice", (str(path), 1, 1))
                energies[value.name] = value
            elif isinstance(value, Quantity):
                quantities.append(value)
            elif isinstance(value, Motion):
                motions.append(value)
    return Declarations(tuple(energies.values()), tuple(quantities), tuple(motions))


__all__ = [
    "PI", "Assumption", "Declarations", "Energy", "Motion", "Parameter", "Point", "Positive", "Quantity", "Real", "Sliding",
    "SlidingSpeed", "Vector", "Velocity", "angle", "arccos", "assumptions", "cos", "cross", "deviation", "dot", "energy", "exp",
    "length", "load_declarations", "log", "name_of", "quantity", "sin", "sqrt", "square", "tan", "unchanged_by", "unit",
]  # fmt: skip
