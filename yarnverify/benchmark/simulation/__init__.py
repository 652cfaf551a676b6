"""How fast the simulations are: an iteration on cloth of growing size, and a cantilever beside what people would use instead.

In the order of work:

    cloth        one time step of a cloth, its seconds split into kernels, assembly and linear solve
    memory       the most that such a step holds, found in a process of its own
    cantilever   the time until the tip of a bent yarn is right, for these simulations and for the peers
    run          all of it, as one record
"""
