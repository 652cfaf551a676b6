"""Proofs for printed yarn formulas, and the NumPy kernels that follow from them.

The flow, in the order in which a person performs it::

    derivations/          what a person writes: printed formulas (.md), declared energies (.py), errata.toml
    yarnverify.symbolic   read -> derive -> prove -> repair -> emit      (SymPy)
    yarnverify.kernels    energy, gradient and Hessian                   (generated; NumPy only)
    yarnverify.report     records (JSON) -> pages

Importing this package imports none of them; each is imported where it is used.
"""

__version__ = "0.1.0"
