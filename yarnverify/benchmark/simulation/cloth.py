"""One time step of a cloth that hangs by two corners, split into its parts.

Plain weave of cotton: R = 0.2 mm, L = 1 mm, k_s = 100 N (Young's modulus 0.8 GPa times pi R^2), k_b = 1e-9 N m^2, k_x = 1e-3 N,
rho = 1e-4 kg/m. A step of 1 ms by implicit Euler; along its yarns the cloth is 10^6 times as stiff as its mass term.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from time import thread_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.kernels import bending, gravity, shear, stretch
from yarnverify.kernels.fast import kinetic
from yarnverify.simulation.dynamics import Dynamics, Motion
from yarnverify.simulation.fabric import Fabric, bends, segments, shears, weave
from yarnverify.simulation.linear import ConjugateGradients, Factor, Multifrontal, Solver, lines_of
from yarnverify.simulation.terms import Term

Array = NDArray[Any]
SOLVERS = ("direct", "gradients")
STEP = 1e-3  # s
PARTS = ("kernels", "assembly", "factorise", "solve", "rest")


class _Enough(Exception):
    """Enough iterations."""


@dataclass(eq=False)
class Timed:
    """A solver that keeps the time it takes and the size of the last factor that it made."""

    solver: Solver
    seconds: dict[str, float] = field(default_factory=lambda: {"factorise": 0.0, "solve": 0.0})
    solves: int = 0
    inner: int = 0
    bytes: int = 0

    def factorise(self, matrix: Any) -> Factor:
        """The factor, timed."""
        start = thread_time()
        factor: Any = self.solver.factorise(matrix)
        self.seconds["factorise"] += thread_time() - start
        self.bytes = factor.bytes
        return _Solving(self, factor)


@dataclass(eq=False)
class _Solving:
    timed: Timed
    factor: Any

    @property
    def negative(self) -> int | None:
        return self.factor.negative

    def solve(self, b: Array) -> Array:
        start = thread_time()
        x: Array = self.factor.solve(b)
        self.timed.seconds["solve"] += thread_time() - start
        self.timed.solves += 1
        self.timed.inner += getattr(self.factor, "steps", 0)
        return x


@dataclass(eq=False)
class Cloth:
    """A cloth of ``side`` x ``side`` crossings, three unknowns each but for the two that are held."""

    side: int
    fabric: Fabric
    dynamics: Dynamics
    solver: Timed
    motion: Motion

    @staticmethod
    def made(side: int, solver: str, engine: Any = "auto") -> Cloth:
        """At rest but for a ripple out of its plane."""
        fabric = weave("plain", (side, side), 1e-3, 0.2e-3)
        terms = [
            Term(stretch, segments(fabric), {"k_s": 100.0}),
            Term(bending, bends(fabric), {"k_b": 1e-9}),
            Term(shear, shears(fabric), {"k_x": 1e-3}),
            Term(gravity, segments(fabric, gravity), {"rho": 1e-4, "g": [0.0, 0.0, -9.81]}),
        ]
        held = [fabric.node(0, -1), fabric.node(-1, -1)]
        active = fabric.positions(np.setdiff1d(np.arange(fabric.nodes), held))
        inertia = Term(kinetic, segments(fabric, kinetic), {"rho": 1e-4})
        dynamics = Dynamics(fabric.Q, terms, active, inertia, scheme="implicit_euler", engine=engine)
        system = dynamics.system
        chosen: Solver = (
            Multifrontal(system.nodes, system.coordinates)
            if solver == "direct"
            else ConjugateGradients(lines_of(fabric, system))
        )
        system.clock = thread_time
        dynamics.solver = timed = Timed(chosen)
        Q = fabric.Q.copy()
        x, y, z = fabric.points(Q).T
        z += 2e-5 * np.sin(900 * x) * np.cos(700 * y)
        z[held] = 0
        return Cloth(side, fabric, dynamics, timed, dynamics.start(Q))

    def step(self, iterations: int) -> dict[str, float]:
        """Seconds of processor time per iteration by part: the first few Newton iterations of a time step.

        Kernels and assembly are taken per evaluation, of which there is one more than there are linear solves.
        """
        done: list[Any] = []

        def report(line: Any) -> None:
            done.append(line)
            if len(done) == iterations:
                raise _Enough

        self.dynamics.options["report"] = report
        system, solver = self.dynamics.system, self.solver
        system.seconds.update(kernels=0.0, assembly=0.0)
        solver.seconds.update(factorise=0.0, solve=0.0)
        solver.solves = solver.inner = 0
        start = thread_time()
        with suppress(_Enough):
            self.dynamics.step(self.motion, STEP)
        whole = thread_time() - start
        rest = whole - sum(system.seconds.values()) - sum(solver.seconds.values())
        found = {name: value / (solver.solves + 1) for name, value in system.seconds.items()}
        found |= {name: value / solver.solves for name, value in solver.seconds.items()}
        found["rest"] = rest / solver.solves
        found["iteration"] = sum(found.values())
        return found | {"inner": solver.inner / solver.solves}

    def floors(self) -> dict[str, float]:
        """Bytes that an iteration cannot do without moving, by part."""
        system = self.dynamics.system
        kernels, sums = 0, 0
        for term, places in zip(system.terms, system.pattern.places, strict=False):
            n, dof = term.table.count, len(term.kernel.DOFS)
            kernels += 8 * n * (2 * dof + 1 + dof * (dof + 1) // 2)
            sums += 8 * n * (2 * dof + places.pairs.size)
        matrix = 12 * system.pattern.indices.size
        factor = self.solver.bytes
        once = matrix + 2 * factor + 8 * 8 * system.count  # of conjugate gradients: matrix, bands twice, eight vectors
        iterative = isinstance(self.solver.solver, ConjugateGradients)
        inner = self.solver.inner / max(self.solver.solves, 1)
        return {
            "kernels": kernels,
            "assembly": sums + matrix,
            "factorise": matrix + factor,
            "solve": inner * once if iterative else 2 * factor,
        }


def copying(total: float) -> Callable[[], object]:
    """Moving so many bytes: a copy between two arrays of half the size."""
    source = np.zeros(max(int(total) // 16, 1))
    target = np.zeros_like(source)
    return lambda: np.copyto(target, source)
