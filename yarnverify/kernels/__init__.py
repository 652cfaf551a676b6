"""Kernels of yarn energies: NumPy in, NumPy out, arrays component first.

    from yarnverify.kernels import bending

    bending.DOFS                            names of the rows of q
    bending.energy(q, k_b=...)              (n,)
    bending.gradient(q, k_b=...)            (dof, n)
    bending.hessian(q, k_b=...)             (dof, dof, n), exactly symmetric
    bending.evaluate(q, k_b=...)            all three at once, sharing what they share
    bending.packed(q, k_b=...)              the same with the upper triangle only, for assembly

Everything in this folder but this file and ``runtime.py`` is generated; every variant has the same interface.
"""

from yarnverify.kernels import bending, parallel_contact, shear, stretch
from yarnverify.kernels.runtime import ElementError

__all__ = ["ElementError", "bending", "parallel_contact", "shear", "stretch"]
