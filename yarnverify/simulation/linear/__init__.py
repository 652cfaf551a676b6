"""Linear solvers of the simulations, all with the same two steps.

factor = solver.factorise(matrix)     symmetric sparse matrix; raises LinearSolveError
x = factor.solve(b)                   the residual is checked; raises LinearSolveError
factor.negative                       number of negative eigenvalues, or None where a solver cannot tell

A solver is made once per pattern and keeps its ordering. ``direct`` is the default: ``banded`` for a single yarn, else
``multifrontal``, an LDL^T on the graph of nodes. ``superlu`` serves matrices that are not symmetric, ``gradients`` large
systems with mass.
"""

from yarnverify.simulation.linear.adapters import PyAMG, Qdldl
from yarnverify.simulation.linear.banded import Banded
from yarnverify.simulation.linear.direct import Direct
from yarnverify.simulation.linear.gradients import ConjugateGradients, lines_of
from yarnverify.simulation.linear.multifrontal import Multifrontal
from yarnverify.simulation.linear.protocol import Factor, LinearSolveError, Solver
from yarnverify.simulation.linear.superlu import SuperLU

__all__ = ["Banded", "ConjugateGradients", "Direct", "Factor", "LinearSolveError", "Multifrontal", "PyAMG", "Qdldl", "Solver",
           "SuperLU", "lines_of"]  # fmt: skip
