"""Kernels of yarn energies: NumPy in, NumPy out, arrays component first.

    from yarnverify.kernels import bending

    bending.DOFS                            names of the rows of q
    bending.energy(q, k_b=...)              (n,)
    bending.gradient(q, k_b=...)            (dof, n)
    bending.hessian(q, k_b=...)             (dof, dof, n), exactly symmetric
    bending.evaluate(q, k_b=...)            all three at once, sharing what they share
    bending.packed(q, k_b=...)              the same with the upper triangle only, for assembly

The default variant is ``accurate``; the packages ``yarnverify.kernels.fast`` and so on hold the others, all with the same
interface; what the document does not print (gravity, kinetic energy, obstacles) comes as ``accurate``, ``fast``, ``reference``.
Generated modules hold straight-line formulas over ``geometry`` (safe atoms); ``batch`` runs them by way of ``tape``
(chunks of NumPy calls), ``doubledouble`` or ``compiled`` (numba), and the few elements of extreme size by way of ``wide``;
``words`` keeps the digits of sums without measures.
"""

from yarnverify.kernels import bending, gravity, kinetic, parallel_contact, plane, shear, sphere, stretch
from yarnverify.kernels.runtime import ElementError

VARIANTS = ("accurate", "fast", "reference", "differentiated", "printed")

__all__ = [
    "VARIANTS", "ElementError", "bending", "gravity", "kinetic", "parallel_contact", "plane", "shear", "sphere", "stretch",
]  # fmt: skip
