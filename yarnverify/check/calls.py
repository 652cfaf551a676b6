"""How a Python function is called, found out from its signature and its first answers; and what its answers are."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.check.conventions import ALIASES, SIGNED, force_block
from yarnverify.errors import InputError, NotRunError

Array = NDArray[Any]
Function = Callable[..., Any]
_SLIDING = ("u", "us", "s", "sliding")  # how an array of all sliding coordinates is called
TRIED = 5  # states of a first batch: a number that no row or axis has


def load(target: str, labels: Sequence[str] = ()) -> dict[str, Function]:
    """The functions of a target, by what they return: ``""`` for a single function that a person named.

    Parameters
    ----------
    target
        ``module:function``, ``file.py:function``; or a module or file alone, whose functions are called energy, gradient or
        force, hessian or jacobian, or after a block, such as Fx1 or dFx1dx1, or which has only one.
    labels
        The energy's unknowns, which blocks are named after.

    Raises
    ------
    InputError
        Where there is no such file, module or function, or it cannot be imported.
    NotRunError
        Where it imports something that is not installed.
    """
    place, _, name = target.rpartition(":") if ":" in target[2:] else (target, "", "")
    module = _module(place)
    if name:
        found: Any = module
        for part in name.split("."):
            found = getattr(found, part, None)
        if not callable(found):
            raise InputError(f"{place}: there is no function {name}{_there_are(module)}")
        return {"": found}
    meant = {}
    for attribute, value in vars(module).items():
        if callable(value) and (attribute in SIGNED or force_block(attribute, labels)):
            meant[attribute] = value
    if meant:
        return meant
    own = _own_functions(module)
    if len(own) != 1:
        raise InputError(f"{place}: say which function, as {place}:FUNCTION{_there_are(module)}")
    return {"": own[0]}


def _own_functions(module: Any) -> list[Function]:
    return [
        value
        for name, value in vars(module).items()
        if inspect.isfunction(value) and value.__module__ == module.__name__ and not name.startswith("_")
    ]


def _there_are(module: Any) -> str:
    names = [function.__name__ for function in _own_functions(module)]
    return f"; there are {', '.join(names)}" if names else ""


def _module(place: str) -> Any:
    path = Path(place)
    try:
        if path.suffix == ".py" or path.exists():
            if not path.is_file():
                raise InputError(f"{place}: there is no such file")
            spec = importlib.util.spec_from_file_location(path.stem, path)
            if spec is None or spec.loader is None:
                raise InputError(
                    f"{place}: is neither a Python file (.py) nor a C library (.so, .dylib, .dll); source must be compiled "
                    "first, and a program is called with --command 'PROGRAM {in} {out}'"
                )
            module = importlib.util.module_from_spec(spec)
            sys.path.insert(0, str(path.resolve().parent))
            sys.modules[path.stem] = module
            spec.loader.exec_module(module)
            return module
        sys.path.insert(0, "")
        return importlib.import_module(place)
    except (InputError, NotRunError):
        raise
    except SyntaxError as error:
        raise InputError(error.msg, (error.filename or place, error.lineno or 1, error.offset or 1)) from None
    except ModuleNotFoundError as error:
        if error.name and (place == error.name or place.startswith(error.name + ".")):
            raise InputError(f"{place}: there is no such module; of a file, give its path with .py") from None
        raise NotRunError(f"{place}: imports {error.name}, which is not installed here") from None
    except Exception as error:
        raise InputError(f"{place}: cannot be imported: {type(error).__name__}: {error}") from None


def alike(name: str) -> str:
    """A name without what people write differently: ``K_b`` and ``kb``."""
    return name.lower().replace("_", "")


@dataclass(frozen=True)
class Manner:
    """How a function takes its arguments.

    Attributes
    ----------
    by_name
        Whether unknowns come one by one, by name; otherwise the first argument is the whole state.
    keywords
        Name of each argument to the name of the value that it gets.
    positions
        Values passed after the state, in order, where the function does not say what it calls them.
    points
        How many points come first as an array (points, 3), the sliding coordinates following as another; 0 if all are one.
    """

    by_name: bool
    keywords: Mapping[str, str]
    positions: tuple[str, ...] = ()
    points: int = 0


def manner(
    function: Function,
    unknowns: Sequence[str],
    values: Sequence[str],
    parameters: Sequence[str],
    where: str,
    points: int = 0,
) -> Manner:
    """How a function takes its arguments, from its signature.

    Parameters
    ----------
    function, where
        What is called, and its name for messages.
    unknowns, values, parameters
        Names of unknowns; of everything that there is a value for; of the parameters that the energy has.
    points
        How many points come before the other unknowns, where there are both.

    Raises
    ------
    InputError
        For an argument without default that nothing is known for.
    """
    by_likeness: dict[str, str] = {}
    for name in values:
        by_likeness.setdefault(alike(name), name)
    try:
        arguments = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):  # built in: it does not say
        return Manner(False, {}, tuple(parameters))
    star = any(a.kind is a.VAR_KEYWORD for a in arguments)
    named = [a for a in arguments if a.kind in (a.POSITIONAL_OR_KEYWORD, a.KEYWORD_ONLY, a.POSITIONAL_ONLY)]

    if named and named[0].name == "self":
        place, _, path = where.rpartition(":")
        raise InputError(
            f"{where}: is a method: make an object in {place}, and name its own, {place}:OBJECT.{path.split('.')[-1]}"
        )

    def value_of(argument: inspect.Parameter) -> str | None:
        return argument.name if argument.name in values else by_likeness.get(alike(argument.name))

    by_name = any(value_of(a) in unknowns for a in named) or (bool(named) and value_of(named[0]) is not None)
    split = points if not by_name and len(named) > 1 and named[1].name.lower() in _SLIDING else 0
    rest = named if by_name else named[2 if split else 1 :]
    keywords, positions = {}, []
    strange = [a.name for a in rest if value_of(a) is None and a.default is a.empty]
    if strange:
        few = len(strange) == 1
        raise InputError(
            f"{where}: {', '.join(strange)} {'is no unknown or parameter' if few else 'are no unknowns or parameters'} of "
            f"this energy ({', '.join(values)}); say what {'it is' if few else 'they are'}: "
            + " ".join(f"--with {name}=FORMULA" for name in strange)
            + ("" if by_name else f"; {named[0].name} gets the whole state")
            + ", or write a function of those names around it"
        )
    for argument in rest:
        meant = value_of(argument)
        if meant is None:
            continue
        if argument.kind is argument.POSITIONAL_ONLY:
            positions.append(meant)
        else:
            keywords[argument.name] = meant
    if star:
        taken = set(keywords.values())
        keywords |= {name: name for name in parameters if name not in taken}
    if not by_name and any(a.kind is a.VAR_POSITIONAL for a in arguments) and not keywords:
        positions = list(parameters)
    return Manner(by_name, keywords, tuple(positions), split)


@dataclass(frozen=True)
class Call:
    """A function, how it takes its arguments, and what its answer is called, if that is known."""

    function: Function
    manner: Manner
    name: str

    def __call__(
        self, q: Array, values: Mapping[str, Array], where: slice, layout: str, made: Callable[[Any], Any]
    ) -> Any:
        """What the function gives at some states.

        Parameters
        ----------
        q, values
            (n, rows), and (n,) or (n, 3) by name.
        where
            Which states; one for the layout ``single``.
        layout
            As in ``conventions``.
        made
            Turns arrays and numbers into what the function takes.
        """

        def shaped(array: Array) -> Any:
            part = np.array(array[where])
            if layout == "single":
                return made(part[0] if part.ndim >= 2 else part[0][()])
            return made(np.ascontiguousarray(np.moveaxis(part, 0, -1)) if layout == "component" else part)

        at = 3 * self.manner.points
        whole = (q[:, :at].reshape(len(q), -1, 3), q[:, at:]) if at else (q,)
        state = () if self.manner.by_name else tuple(shaped(part) for part in whole)
        positions = [shaped(values[name]) for name in self.manner.positions]
        return self.function(
            *state, *positions, **{key: shaped(values[name]) for key, name in self.manner.keywords.items()}
        )


def makers() -> list[Callable[[Any], Any]]:
    """What states may be turned into: nothing else, or tensors where the target has imported PyTorch."""
    torch = sys.modules.get("torch")
    return [lambda value: value, *([torch.as_tensor] if torch is not None else [])]


def answers(value: Any, name: str, expected: int = 0) -> dict[str, Any]:
    """The parts of an answer by name; ``#0``, ``#1`` where they have none.

    A tuple of numbers is one array, unless as many parts as it has numbers are expected.
    """
    if isinstance(value, Mapping):
        return {str(key): part for key, part in value.items()}
    if hasattr(value, "_asdict"):
        return dict(value._asdict())
    parted = isinstance(value, tuple | list) and not all(np.ndim(part) == 0 for part in value)
    if parted or (isinstance(value, tuple) and len(value) == expected):
        return {f"#{i}": part for i, part in enumerate(value)}
    return {name or "#0": value}


def flattened(value: Any, layout: str, n: int, what: str) -> Array:
    """(n, size) numbers of one part of an answer, in double precision.

    Raises
    ------
    ValueError
        Where it is not made of n times some real numbers.
    """
    if hasattr(value, "detach"):  # PyTorch
        value = value.detach().cpu()
    elif hasattr(value, "numpy") and not isinstance(value, np.ndarray):  # Warp
        value = value.numpy()
    elif hasattr(value, "toarray"):  # sparse
        value = value.toarray()
    if value is None:
        raise ValueError("it returns nothing")
    array = np.asarray(value)
    if array.dtype.kind not in "fiub":
        raise ValueError(f"{what} is not made of real numbers but of {array.dtype}")
    if layout == "single":
        return array.reshape(1, -1).astype(np.float64)
    axis = -1 if layout == "component" else 0
    if array.ndim == 0 or array.shape[axis] != n:
        raise ValueError(
            f"{what} has shape {array.shape}, which has no axis for {n} states at its {'end' if axis else 'start'}"
        )
    return np.ascontiguousarray(np.moveaxis(array, axis, 0).reshape(n, -1), dtype=np.float64)


def _forces(function: str) -> bool:
    """Whether a function calls itself a force: ``stretch_force``, ``Stretch_F``."""
    return "force" in function.lower() or "F" in function.split("_")


def joined(parts: Mapping[str, Array], points: int, rows: int) -> dict[str, Array]:
    """Answers without names in which one for the points, followed by one for the other unknowns, is a single one."""
    found: dict[str, Array] = {}
    for name, part in parts.items():
        last = next(reversed(found), "")
        if name[0] == "#" == last[:1] and (found[last].shape[1], part.shape[1]) == (3 * points, rows - 3 * points):
            found[last] = np.hstack([found[last], part])
        else:
            found[name] = part
    return found


def guessed(
    parts: Sequence[tuple[str, int]], rows: int, function: str, pieces: Sequence[tuple[str, int]]
) -> list[str] | None:
    """Names for the parts of an answer that have none, by their sizes; None where a size means nothing.

    A function that calls itself a force, and gives no energy, gives forces. Parts of the sizes of all unknowns in order, the
    ``pieces``, points among them, are the blocks of these.
    """
    sizes = [size for name, size in parts if name.startswith("#")]
    if len(parts) > 1 and len(sizes) == len(parts) and sizes == [size for _, size in pieces] and 3 in sizes:
        return [f"F_{label}" if _forces(function) else label for label, _ in pieces]
    words = function.lower()
    forces = _forces(function) and not any(size == 1 for _, size in parts)
    found = []
    for name, size in parts:
        if not name.startswith("#"):
            meant = ALIASES.get(name.lower(), name.lower())
            found.append(meant if meant in SIGNED else name)
        elif size == 1 and "E" not in found and not (rows == 1 and found):
            found.append("energy")
        elif size == rows:
            found.append("force" if forces else "gradient")
        elif size == rows * rows:
            found.append("jacobian" if forces or "jac" in words else "hessian")
        else:
            return None
    return found
