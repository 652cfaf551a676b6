"""What a scene is made of: a problem at rest or in motion, and the answers that are known for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError
from yarnverify.simulation.assembly import System, Term
from yarnverify.simulation.cloth import Fabric
from yarnverify.simulation.dynamics import Motion, Scheme
from yarnverify.simulation.solids import Ball

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Outcome:
    """The end of a run, from which answers are read.

    Attributes
    ----------
    Q
        Configuration, (size,), m.
    system
        Energies with the loads of the end.
    recorded
        What the problem watches, one value a stage or step, by name; ``time`` is always among them: s, or the stage.
    motion
        The last state of a motion; None for a problem at rest.
    """

    fabric: Fabric
    Q: Array
    system: System
    recorded: Mapping[str, Array]
    motion: Motion | None = None

    @property
    def points(self) -> Array:
        """Positions of the nodes, (nodes, 3), m."""
        return self.fabric.points(self.Q)


@dataclass(frozen=True, eq=False)
class Known:
    """An answer that is known.

    Attributes
    ----------
    name, unit
        Of the quantity.
    exact
        A number, or an array of which the entry with the largest error counts.
    found
        The same from an outcome.
    order
        None where the answer is exact for every size, so that nothing but rounding may be left. Else the power of 1/size
        with which the error falls.
    within
        Relative error that is allowed: at every size for an exact answer, else at the largest size of the scene.
    scale
        What errors are relative to; by default the greatest exact value.
    floor
        Relative error that stays however large the size, where the answer is that of a yarn that does not stretch: three times
        as much is allowed at least, and an order is not judged below thirty times.
    """

    name: str
    unit: str
    exact: ArrayLike
    found: Callable[[Outcome], ArrayLike]
    order: float | None = None
    within: float = 1e-12
    scale: float | None = None
    floor: float = 0.0

    @property
    def size(self) -> float:
        """What errors are relative to; 1 where that would be zero."""
        return (float(np.abs(self.exact).max()) if self.scale is None else self.scale) or 1.0

    def compared(self, outcome: Outcome) -> tuple[float, float, float]:
        """Found, exact, and relative error, where the error is greatest."""
        exact, found = (
            np.atleast_1d(np.asarray(self.exact, float)),
            np.atleast_1d(np.asarray(self.found(outcome), float)),
        )
        if exact.shape != found.shape:
            raise ValueError(f"{self.name}: found {found.shape} values for {exact.shape} exact ones")
        error = np.abs(found - exact)
        at = np.unravel_index(int(np.argmax(np.where(np.isnan(error), np.inf, error))), error.shape)
        return float(found[at]), float(exact[at]), float(error[at]) / self.size


@dataclass(frozen=True, eq=False)
class Stage:
    """What is imposed in a stage of a problem at rest.

    Attributes
    ----------
    loads
        Constant forces, (size,), N; None for those before.
    held
        A configuration whose entries that are not unknown are imposed, (size,); None to leave them.
    """

    loads: Array | None = None
    held: Array | None = None


@dataclass(frozen=True, eq=False)
class Static:
    """A problem at rest: equilibria of one stage after the other.

    Attributes
    ----------
    fabric, terms, active
        Nodes and yarns; energies; indices into ``fabric.Q`` of the unknowns.
    known
        Answers.
    stages
        What is imposed.
    start
        Where the search starts, (size,); at rest if not given.
    options
        Of ``newton.Options``.
    watch
        Values to record at the end of each stage, by name.
    colour
        What pictures are coloured by; None for the yarns.
    view
        From where pictures are seen.
    solids
        What the yarns lie on, in pictures.
    """

    fabric: Fabric
    terms: Sequence[Term]
    active: ArrayLike
    known: Sequence[Known] = ()
    stages: Sequence[Stage] = (Stage(),)
    start: Array | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    watch: Mapping[str, Callable[[Outcome], float]] = field(default_factory=dict)
    colour: str | None = None
    view: Any = "oblique"
    solids: Sequence[Ball] = ()

    def __post_init__(self) -> None:
        _check(self.terms)


@dataclass(frozen=True, eq=False)
class Moving:
    """A problem in motion.

    Attributes
    ----------
    fabric, terms, active, known, start, options, watch, colour, view, solids
        As for ``Static``; ``start`` is the configuration at time 0, and values are recorded after each step.
    kinetic
        Kinetic kernel, its table and the linear density.
    until, h
        Time to simulate, and the length of a step, which fits into it a whole number of times; s.
    scheme
        ``implicit_euler``, ``midpoint`` or ``bdf2``.
    V
        Velocities at time 0, (size,), m/s; at rest if not given.
    loads
        Constant forces, (size,), N.
    held
        ``held(time, Q)`` changes those entries of Q in place that are not unknown.
    tolerance
        Greatest error of a step, m, if steps are to adapt; h is the first one then.
    frames
        How many pictures of the motion are kept, besides the one at its start.
    """

    fabric: Fabric
    terms: Sequence[Term]
    active: ArrayLike
    kinetic: Term
    until: float
    h: float
    known: Sequence[Known] = ()
    scheme: Scheme = "midpoint"
    start: Array | None = None
    V: Array | None = None
    loads: Array | None = None
    held: Callable[[float, Array], None] | None = None
    tolerance: float | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    watch: Mapping[str, Callable[[Outcome], float]] = field(default_factory=dict)
    frames: int = 40
    colour: str | None = None
    view: Any = "oblique"
    solids: Sequence[Ball] = ()

    def __post_init__(self) -> None:
        _check(self.terms)
        if not isinstance(self.kinetic, Term):
            raise InputError(
                f"kinetic is a Term, such as Term(kinetic, segments(fabric, kinetic), {{'rho': 1e-4}}), not {self.kinetic!r}"
            )


def _check(terms: Sequence[Term]) -> None:
    """Refuse what is no energy of a configuration, whose velocities would be read from positions."""
    for term in terms:
        if term.kernel.KERNEL.rates:
            raise InputError(
                f"{term.name} is of velocities: a scene has energies of positions, and dissipates nothing by others"
            )


Setting = Static | Moving


def rounding(condition: float) -> float:
    """Error that is allowed for an exact answer: 1e-12, or 64 units of rounding where these make more of it.

    A search ends where no force is more than 8 units of |H| |Q|, of which a row adds up to 4 k/h times the extent for a chain
    of springs k/h: 32. The kernels may add as much: 8 units in each of the 4 blocks of a row. That errors of many nodes could
    all have one sign is not allowed for.

    Parameters
    ----------
    condition
        Relative change of the answer for a relative change of the coordinates, of their extent.
    """
    return max(1e-12, 64 * float(np.finfo(float).eps) * condition)


def ramp(loads: Array, stages: int) -> tuple[Stage, ...]:
    """Loads that grow to their size in equal stages."""
    return tuple(Stage(loads=loads * (k / stages)) for k in range(1, stages + 1))
