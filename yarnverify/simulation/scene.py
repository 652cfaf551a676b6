"""Scenes: a function that names fabric, energies, constraints and known answers, and the parameters that it takes.

@scene(title="...", size="segments", sizes=(10, 20, 40), source="...", wall="...")
def hanging_yarn(size: int, k_s: float = positive(50.0, "N", "...")) -> Static: ...
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from traceback import walk_tb
from typing import Any

from yarnverify.errors import InputError
from yarnverify.kernels import ElementError
from yarnverify.simulation.quantities import Quantity, Value, quantities_of
from yarnverify.simulation.setting import Moving, Setting, Static

SOLVERS = ("direct", "superlu")


@dataclass(frozen=True, eq=False)
class Line:
    """One way to solve a scene, a line in its diagram: a name, the linear solver, and parameters that it sets."""

    name: str
    solver: str
    values: Mapping[str, Value]


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene.

    Attributes
    ----------
    build
        Makes the problem from a size and the parameters.
    title
        What happens, in one line.
    size, sizes
        What the size counts, and the sizes of the convergence study.
    least
        The smallest size that makes sense.
    source
        Where the known answer is from.
    wall
        Where what is held is held.
    quantities
        Parameters by name.
    compare
        The parameter, one of some words, whose values are the lines of the diagram; the linear solvers if empty.
    """

    build: Callable[..., Setting]
    title: str
    size: str
    sizes: tuple[int, ...]
    least: int
    source: str
    wall: str
    quantities: Mapping[str, Quantity]
    compare: str = ""
    solvers: tuple[str, ...] = SOLVERS

    @property
    def name(self) -> str:
        """Name on the command line."""
        return self.build.__name__

    @property
    def code(self) -> str:
        """Hash of its file, by which states of another version of the scene are told."""
        return sha256(Path(self.build.__code__.co_filename).read_bytes()).hexdigest()[:16]

    @property
    def validates(self) -> bool:
        """Whether an answer is known to compare with."""
        return bool(self.source)

    def values(self, given: Mapping[str, Any] | None = None) -> dict[str, Value]:
        """All parameters, those given and the defaults.

        Raises
        ------
        InputError
            A parameter that the scene does not have, or a value that it cannot have.
        """
        given = dict(given or {})
        for name in given:
            if name not in self.quantities:
                raise InputError(f"{self.name} has no parameter {name!r}{suggestion(name, self.quantities, 'it has')}")
        return {
            name: q.checked(f"{self.name}: {name}", given.get(name, q.default)) for name, q in self.quantities.items()
        }

    def problem(self, size: int, given: Mapping[str, Any] | None = None) -> Setting:
        """The problem of a size.

        Raises
        ------
        InputError
            For a size or parameters for which there is none.
        """
        if isinstance(size, bool) or not isinstance(size, int) or size < self.least:
            raise InputError(
                f"{self.name}: the size, {self.size}, must be a whole number, at least {self.least}; not {size!r}"
            )
        values = self.values(given)
        try:
            found: Any = self.build(size, **values)
        except InputError as error:
            raise InputError(f"{self.name}: {error}") from None
        except (ElementError, ValueError, OverflowError, ZeroDivisionError) as error:
            raise InputError(f"{self.name} at size {size} cannot be built with these parameters: {error}") from None
        except (NameError, AttributeError, TypeError, LookupError) as error:
            own = self.build.__code__.co_filename
            line = [at for frame, at in walk_tb(error.__traceback__) if frame.f_code.co_filename == own][-1]
            raise InputError(f"{self.name}: {type(error).__name__}: {error}", (own, line, 1)) from error
        if not isinstance(found, Static | Moving):
            raise InputError(f"{self.name} must return Static(...) or Moving(...); it returns {type(found).__name__}")
        return found

    def lines(self, given: Mapping[str, Any] | None = None, solver: str | None = None) -> list[Line]:
        """The ways to solve it that are compared: one, where the parameter that is compared or the solver is given."""
        values = self.values(given)
        solvers = self.solvers if solver is None else (solver,)
        if not self.compare:
            return [Line(name, name, values) for name in solvers]
        names = (str(values[self.compare]),) if self.compare in (given or {}) else self.quantities[self.compare].choices
        return [Line(name, solvers[0], {**values, self.compare: name}) for name in names]


def scene(
    *, title: str, size: str, sizes: Sequence[int], source: str = "", wall: str = "", least: int = 1, compare: str = "",
    solvers: Sequence[str] = SOLVERS,
) -> Callable[[Callable[..., Setting]], Scene]:  # fmt: skip
    """Declare a scene; see ``Scene`` for what is given."""

    def declared(function: Callable[..., Setting]) -> Scene:
        quantities = quantities_of(function)
        if compare and (compare not in quantities or quantities[compare].kind != "choice"):
            raise InputError(
                f"scene {function.__name__}: what is compared, {compare!r}, must be a parameter declared by choice()"
            )
        return Scene(function, title, size, tuple(sizes), least, source, wall, quantities, compare, tuple(solvers))

    return declared


def suggestion(name: str, known: Any, lead: str) -> str:
    """What may have been meant, or all there is."""
    from difflib import get_close_matches

    near = get_close_matches(name, list(known), 1, 0.6)
    return f"; did you mean {near[0]}?" if near else f"; {lead} {', '.join(known) or 'none'}"
