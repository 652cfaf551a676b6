"""What the energies are like: stability of an element, vibrations of a fabric, stiffness of a weave.

spectra       eigenvalues of an element's Hessian at rest, and where it is indefinite
steps         the largest stable explicit time step for a given mass
vibrations    modes of a fabric or of a scene (scipy.sparse.linalg.eigsh)
moduli        small-strain moduli of a weave, beside their closed forms
command       ``yarnverify analyse``: all of it as one record
"""
