"""How exact the kernels are: error against the true result, where it is hard to get right.

    forms.py         an energy as a function of differences of its unknowns, which the truth is fast in
    truth.py         the exact result at the exact floats, by ball arithmetic
    metrics.py       errors in units of the rounding, normwise and componentwise
    conditioning.py  what any method must lose, so that a loss is either the inputs' or the computation's
    rule.py          what an error may be at a condition number
    frames.py        random and exact frames, numbers drawn by exponent, angles that the floats really have
    regimes.py       the hard cases, from the measures that an energy is made of
    cells.py         energy x variant x type x regime: one cell each, and the point that was worst
    sweep.py         all cells, in parallel through any executor, resumable
    record.py        what is kept of a sweep, and compared with the next one
    replay.py        one point again, by hand

The command is ``yarnverify accuracy``. Ball arithmetic is the only authority here: no code is shared with the SymPy
derivation or with the kernels.
"""
