"""Conjugate gradients with the yarn-line preconditioner: a banded Cholesky along each yarn, warp and weft added.

Cloth is stiff along its yarns and soft across them, which makes a line the natural block. All yarns of a family lie one
after the other in one banded matrix. Sums are NumPy's own, not those of BLAS, whose threads cost more than dot products do.
A step makes no array but the product with the matrix, and goes over its vectors as few times as it can.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from yarnverify.simulation.linear.protocol import LinearSolveError, pattern_of, same_pattern
from yarnverify.simulation.linear.threads import one_thread

Array = NDArray[Any]
COLUMNS = 8192  # of the matrix at a time


def lines_of(fabric: Any, system: Any) -> list[list[Array]]:
    """The unknowns along each yarn of each family, places in ``system.active``."""
    families: dict[str, list[Array]] = {}
    for yarn in fabric.yarns:
        entries = np.concatenate([fabric.position(yarn.nodes), np.asarray(yarn.slides)[:, None]], axis=1)
        if yarn.closed:
            entries = entries[:-2]
        found = system.pattern.local[entries.reshape(-1)]
        families.setdefault(yarn.family, []).append(found[found >= 0])
    covered = np.zeros(system.count, bool)
    for parts in families.values():
        covered[np.concatenate(parts)] = True
    return [*families.values(), *([[np.flatnonzero(~covered)]] if not covered.all() else [])]


class ConjugateGradients:
    """An iterative solver for positive definite matrices of one pattern.

    Parameters
    ----------
    families
        For each family of yarns the unknowns of each yarn in order along it; each unknown is in one family at least.
    tolerance
        Residual at which to stop, relative to the right-hand side.
    iterations
        Greatest number of iterations.
    """

    def __init__(self, families: Sequence[Sequence[Array]], tolerance: float = 1e-10, iterations: int = 5000) -> None:
        self.lines = [np.concatenate([np.empty(0, np.int32), *yarns]).astype(np.int32) for yarns in families]
        self._yarns = [np.repeat(np.arange(len(yarns), dtype=np.int32), [len(y) for y in yarns]) for yarns in families]
        self.tolerance, self.iterations = tolerance, iterations
        self._widths: list[int] | None = None
        self._known: Any = None

    @one_thread()
    def factorise(self, matrix: Any) -> Gradients:
        """Factorise the line blocks of a symmetric sparse matrix.

        Raises
        ------
        LinearSolveError
            A block is not positive definite.
        """
        if self._widths is None or not same_pattern(matrix, self._known):
            if np.unique(np.concatenate([np.empty(0, np.int32), *self.lines])).size != matrix.shape[0]:
                raise ValueError("conjugate gradients: an unknown lies on no line")
            self._widths = [_width(matrix, line, yarn) for line, yarn in zip(self.lines, self._yarns, strict=True)]
            self._known = pattern_of(matrix)
        factors = []
        for line, yarn, width in zip(self.lines, self._yarns, self._widths, strict=True):
            factor, info = lapack.dpbtrf(_band(matrix, line, yarn, width).T, lower=1, overwrite_ab=1)
            if info:
                raise LinearSolveError("conjugate gradients: the block of a yarn is not positive definite")
            factors.append(_Lines.made(line, factor, matrix.shape[0]))
        return Gradients(matrix, factors, self.tolerance, self.iterations)


def _band(matrix: Any, line: Array, yarn: Array, width: int) -> Array:
    """The lower band of a line, (n, width + 1), a row for each column of the matrix.

    What lies outside of the band is lost to it; for its size both diagonal entries grow, which keeps the band positive definite
    wherever the matrix is. What couples one yarn with another is left out: a matrix without such blocks stays definite.
    Where entries come from is found anew each time, at a hundredth of what a solution costs, and takes no memory in between.
    """
    band = np.zeros((line.size, width + 1))
    for at, column, distance in _inside(matrix, line, yarn):
        inside = distance <= width
        band[column[inside], distance[inside]] = matrix.data[at[inside]]
        outside = ~inside
        if outside.any():
            column, lost = column[outside], np.abs(matrix.data[at[outside]])
            np.add.at(band[:, 0], column, lost)
            np.add.at(band[:, 0], column + distance[outside], lost)
    return band


def _inside(matrix: Any, line: Array, yarn: Array) -> Iterator[tuple[Array, Array, Array]]:
    """Entries of the lower triangle of a line within its yarns: where, column in the line, distance from the diagonal.

    Some columns of the matrix at a time, since what is needed on the way is larger than the band.
    """
    place = np.full(matrix.shape[0], -1, np.int32)
    place[line] = np.arange(line.size, dtype=np.int32)
    for first in range(0, matrix.shape[1], COLUMNS):
        last = min(first + COLUMNS, matrix.shape[1])
        part = slice(int(matrix.indptr[first]), int(matrix.indptr[last]))
        column = np.repeat(place[first:last], np.diff(matrix.indptr[first : last + 1])).astype(np.int64)
        row = place[matrix.indices[part]]
        mine = np.flatnonzero((column >= 0) & (row >= column))
        row, column = row[mine], column[mine]
        same = yarn[row] == yarn[column]
        yield part.start + mine[same], column[same], row[same] - column[same]


def _width(matrix: Any, line: Array, yarn: Array) -> int:
    """The distance to which the entries of nearly every unknown of a line reach, without a gap."""
    counts = np.zeros(line.size, np.int64)
    for _, _, distance in _inside(matrix, line, yarn):
        counts += np.bincount(distance, minlength=line.size)
    if not counts.size:
        return 0
    often = counts > counts[0] // 50
    return int(np.argmin(often) - 1) if not often.all() else len(counts) - 1


@dataclass(frozen=True, eq=False)
class _Lines:
    """The blocks of a family of yarns, factorised, and the way to them and back.

    ``order`` is where in the system the unknowns of the lines are, ``back`` where in the lines those of the system are: at the
    end of ``own``, which is zero, if they are in none.
    """

    factor: Array
    order: Array
    back: Array
    own: Array

    @staticmethod
    def made(line: Array, factor: Array, count: int) -> _Lines:
        back = np.full(count, line.size, np.intp)
        back[line] = np.arange(line.size)
        return _Lines(factor, line.astype(np.intp), back, np.zeros(line.size + 1))

    def solve(self, r: Array, out: Array) -> None:
        """The solution along the lines; zero elsewhere."""
        x = self.own[:-1]
        np.take(r, self.order, out=x, mode="clip")  # by this mode, without a copy on the way
        lapack.dpbtrs(self.factor, x, lower=1, overwrite_b=1)
        np.take(self.own, self.back, out=out, mode="clip")


class Gradients:
    """A matrix with its preconditioner."""

    negative: int | None = None

    def __init__(self, matrix: Any, lines: list[_Lines], tolerance: float, iterations: int) -> None:
        self._matrix, self._lines = matrix.T, lines  # of a symmetric matrix: rows are faster to multiply with
        self._tolerance, self._iterations = tolerance, iterations
        self._part = np.empty(matrix.shape[0])
        self.steps = 0  # of the last solution

    @property
    def bytes(self) -> int:
        """Memory that the preconditioner takes."""
        return sum(lines.factor.nbytes for lines in self._lines)

    @one_thread()
    def solve(self, b: Array) -> Array:
        """The solution for a right-hand side (n,).

        Raises
        ------
        LinearSolveError
            A direction of negative curvature, or too many iterations.
        """
        x = np.zeros(b.shape)
        goal = self._tolerance * _length(b)
        for _ in range(3):  # the recursion's residual drifts; the true one decides
            residual = b - self._matrix @ x if x.any() else np.array(b, float)
            if _length(residual) <= 2 * goal:
                return x
            self._iterate(x, residual, goal)
        worst = _length(b - self._matrix @ x)
        if not worst <= 100 * goal:
            raise LinearSolveError(
                f"conjugate gradients: residual {worst:.1e} after {self.steps} iterations, wanted {goal:.1e}"
            )
        return x

    def _iterate(self, x: Array, residual: Array, goal: float) -> None:
        """Steps from x, both in place; so are the sums of ``daxpy``."""
        better, direction = np.empty((2, x.size))
        self._precondition(residual, direction)
        product = _sum(residual, direction)
        self.steps = 0
        while _length(residual) > goal:
            image = self._matrix @ direction
            curvature = _sum(direction, image)
            if not curvature > 0:
                found = direction if curvature < 0 else None
                raise LinearSolveError("conjugate gradients: the matrix is not positive definite", found)
            step = product / curvature
            blas.daxpy(direction, x, a=step)
            blas.daxpy(image, residual, a=-step)
            del image  # its memory serves for the next
            self._precondition(residual, better)
            before, product = product, _sum(residual, better)
            blas.daxpy(direction, better, a=product / before)
            direction, better = better, direction
            self.steps += 1
            if self.steps > self._iterations:
                raise LinearSolveError(
                    f"conjugate gradients: residual {_length(residual):.1e} after {self.steps} iterations, wanted {goal:.1e}"
                )

    def _precondition(self, r: Array, out: Array) -> None:
        first, *others = self._lines
        first.solve(r, out)
        for lines in others:
            lines.solve(r, self._part)
            out += self._part


def _sum(a: Array, b: Array) -> float:
    return float(np.einsum("i,i->", a, b))


def _length(a: Array) -> float:
    return float(np.sqrt(_sum(a, a)))
