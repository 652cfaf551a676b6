"""What people would use instead: one file a peer, imported only when it is measured.

A peer takes the energy as declared, so that any declared energy can be measured; nothing of its formulas is typed here.
Each file has ``PACKAGES``, the installed packages that it needs, and ``ways(energy)``, which gives a tuple of ``Way``. One with
``AS_WRITTEN`` is measured a second time, in the way of that name, since the fastest is not what people write.
"""

PEERS = ("lambdify", "jax", "casadi", "numba", "differences")  # file names, in reading order
