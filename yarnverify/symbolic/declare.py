r"""Energies as a person declares them: one short file each, read aloud without stumbling.

.. code-block:: python

    @energy(document="cirio2014.md", section="Stretch", unit="J", domain=r"u_1 > u_0")
    def stretch(x0: Point, x1: Point, u0: Sliding, u1: Sliding, *, k_s: Positive["N"]):
        "Squared strain, times the rest length that carries it."
        ...

Arguments are the unknowns, keywords the parameters; the function returns a tree, so it uses ``+ - * /``, integer powers
and the functions of ``formulas``, and no floats. The domain may also be written in Python:
``domain=lambda x0, x1, h: length(x1 - x0) < h``.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal, NoReturn, get_type_hints, overload

from yarnverify.errors import InputError
from yarnverify.source import Source
from yarnverify.symbolic.energies import Assumption, Declarations, Energy, Motion, Parameter, Quantity, name_of
from yarnverify.symbolic.formulas import (
    angle,
    arccos,
    arcsin,
    arctan,
    atan2,
    cos,
    cross,
    deviation,
    dot,
    exp,
    length,
    log,
    sin,
    sqrt,
    square,
    tan,
    unit,
)
from yarnverify.symbolic.loading import load_declarations
from yarnverify.symbolic.places import part_of, place_of
from yarnverify.symbolic.reader import parse
from yarnverify.symbolic.tree import PI, Expr, Inequality, Name, ShapeError, Type, as_expr, type_of


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
    direction: bool = False

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


class Direction:
    """Annotation of a parameter that is a vector of length 1, such as a normal or a material axis.

    It is a ``Vector["1"]`` in all but the states that ``check``, ``accuracy`` and ``export`` draw: there its length is 1 to
    rounding, on which code relies that leaves it out of its formulas. A proof holds for any length.
    """


_OPTIONS = ("q", "errors", "out", "threads", "engine")  # arguments that every kernel has
_GEOMETRY = (
    ("l", False),
    ("d", True),
    ("P", True),
)  # what derivations call length, direction and projection of a segment


def _fail(function: Callable[..., Any], part: str, message: str) -> NoReturn:
    """One line for a mistake, at the part of the function where it was made."""
    raise InputError(f"{function.__name__}: {message}", part_of(place_of(function), part))


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    """The annotations; a unit that lost its quotation marks is told as what it is."""
    try:
        return get_type_hints(function)
    except (NameError, SyntaxError) as error:
        text = " ".join(str(error).split())
        _fail(function, "", f'an annotation cannot be read: {text}; units stand in quotation marks: Positive["N m^2"]')


def _unknowns(function: Callable[..., Any], hints: dict[str, Any]) -> dict[str, Expr]:
    found: dict[str, Expr] = {}
    for key, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is parameter.KEYWORD_ONLY:
            continue
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            _fail(function, key, f"*{key} stands for nothing; name every unknown and every parameter")
        if hints.get(key) not in _KINDS:
            parameter_here = isinstance(hints.get(key), Real) or hints.get(key) is Direction
            what = "a parameter goes behind the *" if parameter_here else "one of these is needed"
            _fail(
                function,
                key,
                f"argument {key!r} of {function.__name__} must be annotated Point or Sliding, Velocity or SlidingSpeed; {what}",
            )
        found[key] = Expr("symbol", value=name_of(key, _KINDS[hints[key]][0], indexed=True))
    return found


def _parameters(function: Callable[..., Any], hints: dict[str, Any]) -> dict[str, Parameter]:
    found = {}
    for key, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is not parameter.KEYWORD_ONLY:
            continue
        kind = hints.get(key)
        if kind is Direction:
            kind = Real("1", vector=True, direction=True)
        if not isinstance(kind, Real):
            what = "an unknown goes before the *" if kind in _KINDS else "a parameter has a unit, 1 for a plain number"
            _fail(
                function,
                key,
                f"parameter {key!r} of {function.__name__} must be annotated "
                f'Positive["unit"], Real["unit"], Vector["unit"] or Direction; {what}',
            )
        if not isinstance(kind.unit, str):
            _fail(function, key, f'the unit of {key!r} must be a text such as "N m^2", not {kind.unit!r}')
        found[key] = Parameter(name_of(key, kind.vector), kind.unit, kind.positive, kind.direction)
    return found


def _check_names(function: Callable[..., Any], names: dict[str, Name]) -> None:
    """Refuse names that stand for one symbol, or for what a derivation or a kernel calls something else."""
    seen: dict[str, str] = {}
    for key, name in names.items():
        if key in _OPTIONS:
            _fail(function, key, f"{key!r} is taken: every kernel has an argument of this name; take another")
        if name.sub and (name.base, name.bold) in _GEOMETRY:
            _fail(function, key, f"{key!r} is taken: derivations call a segment's own {name} so; take another")
        other = seen.setdefault(name.identifier, key)
        if other != key:
            _fail(function, key, f"{key!r} and {other!r} are one symbol, {name}; take another name for one of them")


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


def _domain(function: Callable[..., Any], domain: Any, symbols: dict[str, Expr]) -> tuple[Assumption, ...]:
    """The inequalities of a domain, written in the notation of the document or as a function."""
    if not callable(domain):
        try:
            relations = parse(Source("domain", domain), 0, len(domain)) if domain else ()
        except InputError as error:
            _fail(function, "domain", str(error))
        return tuple(found for members, operators in relations for found in assumptions(members, operators))
    wanted = inspect.signature(domain).parameters
    for key in wanted:
        if key not in symbols:
            _fail(function, "domain", f"the domain has no {key!r} to use; there are {', '.join(symbols)}")
    found = domain(**{key: symbols[key] for key in wanted})
    inequalities = found if isinstance(found, list | tuple) else (found,)
    for each in inequalities:
        if not isinstance(each, Inequality):
            _fail(function, "domain", "a domain gives an inequality such as u1 > u0, or a list of them")
    return tuple(Assumption(each.left, each.right) for each in inequalities)


def _check_rest(function: Callable[..., Any], rest: dict[str, Any], names: dict[str, Name]) -> None:
    by_label = {name.label if name.bold or key == name.label else key: name for key, name in names.items()} | {
        name.label: name for name in names.values()
    }
    for key, value in rest.items():
        if key not in by_label:
            _fail(function, "rest", f"rest has no use for {key!r}; there are {', '.join(names)}")
        size = len(value) if isinstance(value, tuple | list) else 1
        if size != (3 if by_label[key].bold else 1):
            _fail(
                function,
                "rest",
                f"rest: {key!r} takes {'three numbers' if by_label[key].bold else 'one number'}, not {value!r}",
            )


def _formula(function: Callable[..., Any], given: dict[str, Expr]) -> Expr:
    """What a function of trees returns, which must be a scalar."""
    found = function(**given)
    if found is None:
        _fail(function, "", "returns nothing; is the word return missing?")
    try:
        expression = as_expr(found)
        kind = type_of(expression, lambda symbol: Type.VECTOR if symbol.bold else Type.SCALAR)
    except ShapeError as error:
        _fail(function, "return", error.message)
    except TypeError as error:
        _fail(function, "return", str(error))
    if kind is not Type.SCALAR:
        _fail(
            function,
            "return",
            f"an energy is a scalar, and this is a {kind.value}; length(a), square(a) and dot(a, b) are scalars",
        )
    return expression


@overload
def energy(function: Callable[..., Expr], /) -> Energy: ...


@overload
def energy(
    *,
    document: str = "",
    section: str = "",
    unit: str = "J",
    domain: str | Callable[..., Any] = "",
    removable: str = "",
    singular: str = "",
    rest: dict[str, Any] | None = None,
    elsewhere: Literal["error", "zero"] = "error",
    unchanged: tuple[Literal["translation", "rotation", "sliding"], ...] = (),
) -> Callable[[Callable[..., Expr]], Energy]: ...


def energy(
    function: Callable[..., Expr] | None = None,
    /,
    *,
    document: str = "",
    section: str = "",
    unit: str = "J",
    domain: str | Callable[..., Any] = "",
    removable: str = "",
    singular: str = "",
    rest: dict[str, Any] | None = None,
    elsewhere: Literal["error", "zero"] = "error",
    unchanged: tuple[Literal["translation", "rotation", "sliding"], ...] = (),
) -> Energy | Callable[[Callable[..., Expr]], Energy]:
    """Declare an energy; see the module's example and ``Energy`` for what the options mean.

    Raises
    ------
    InputError
        For names, annotations, options and formulas that cannot be what they should be, with their place.
    """

    def declare(function: Callable[..., Expr]) -> Energy:
        hints = _hints(function)
        unknowns, parameters = _unknowns(function, hints), _parameters(function, hints)
        symbols = unknowns | {key: Expr("symbol", value=parameter.name) for key, parameter in parameters.items()}
        names = {key: symbol.name for key, symbol in symbols.items()}
        _check_names(function, names)
        if not unknowns:
            _fail(function, "", "has no unknown; name a Point or a Sliding before the *")
        if elsewhere not in ("error", "zero"):
            _fail(function, "elsewhere", f"elsewhere is 'error' or 'zero', not {elsewhere!r}")
        motions = ("translation", "rotation", "sliding")
        if isinstance(unchanged, str) or any(motion not in motions for motion in unchanged):
            _fail(function, "unchanged", f"unchanged takes a tuple of {', '.join(motions)}, not {unchanged!r}")
        where = _domain(function, domain, symbols)
        if elsewhere == "zero" and len(where) != 1:
            _fail(function, "elsewhere", f"elsewhere='zero' needs a domain of one inequality; there are {len(where)}")
        _check_rest(function, rest or {}, names)
        return Energy(
            function.__name__, document, section, unit, inspect.getdoc(function) or "",
            tuple(node.name for node in unknowns.values()), tuple(_KINDS[hints[key]][1] for key in unknowns),
            tuple(parameters.values()), _formula(function, symbols),
            where, removable, singular, rest or {}, elsewhere, unchanged, place_of(function),
        )  # fmt: skip

    return declare if function is None else declare(function)


def quantity(
    *, symbol: str, document: str = "", section: str = "", unit: str = "1"
) -> Callable[[Callable[..., Expr]], Quantity]:
    """Declare what a symbol of the document means; an argument such as ``x_i`` carries the running index."""

    def declare(function: Callable[..., Expr]) -> Quantity:
        hints = _hints(function)
        try:
            relations = parse(Source("symbol", symbol), 0, len(symbol))
        except InputError as error:
            _fail(function, "symbol", str(error))
        members, operators = relations[0]
        if len(relations) > 1 or operators or members[0].op != "symbol":
            _fail(function, "symbol", f"symbol must be one symbol such as \\theta, not {symbol!r}")
        return Quantity(members[0].name, document, section, unit, function(**_unknowns(function, hints)), function)

    return declare


def unchanged_by(energy: Energy) -> Callable[[Callable[..., dict[str, Expr | int]]], Motion]:
    """Declare a motion that leaves an energy as it is: a function of unknowns that gives the rate of each that moves."""

    def declare(function: Callable[..., dict[str, Expr | int]]) -> Motion:
        labels = {name.label: name for name in energy.unknowns}
        rates = function(**_unknowns(function, _hints(function)))
        if strange := set(rates) - set(labels):
            _fail(function, "return", f"{energy.name} has no unknown {', '.join(sorted(strange))}")
        moves = tuple((labels[label], as_expr(rate)) for label, rate in rates.items())
        return Motion(energy.name, function.__name__.replace("_", " "), inspect.getdoc(function) or "", moves)

    return declare


__all__ = [
    "PI", "Assumption", "Declarations", "Direction", "Energy", "Motion", "Parameter", "Point", "Positive", "Quantity", "Real",
    "Sliding", "SlidingSpeed", "Vector", "Velocity", "angle", "arccos", "arcsin", "arctan", "assumptions", "atan2",
    "cos", "cross", "deviation", "dot", "energy", "exp", "length", "load_declarations", "log", "name_of", "quantity",
    "sin", "sqrt", "square", "tan", "unchanged_by", "unit",
]  # fmt: skip
