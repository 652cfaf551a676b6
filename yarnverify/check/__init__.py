"""Somebody's own implementation against the truth, over the hard cases, block by block.

    conventions.py  how the implementation is called: order of rows, sign, layout, names, outputs
    expressions.py  what an argument is in terms of this energy's: ``R = d/4``
    setting.py      what a person says about it, and the states and arguments that follow
    cases.py        the states, with their true results and condition numbers
    exchange.py     states and results as files; formats.py has their kinds: JSON, NPZ, MATLAB, CSV
    child.py        the other process: calls a Python function or a C function, state by state
    running.py      starts it; a crash or a hang is found, not suffered
    sources.py      where results come from: functions, a command line, a file
    judge.py        each block: pass or fail, by one rule
    recognise.py    what is wrong: another formula (``formula.py``, ``factors.py``), or lost digits (``digits.py``)
    laws.py         other laws that people take for an energy's own, in one table; measures.py finds their place in its formula
    siblings.py     what a block is in terms of the others: transposed, swapped, a sum
    hints.py        other conventions under which it would be right
    show.py         the tables; command.py puts all of it together

The command is ``yarnverify check TARGET``. The pass rule: at every state, every block must lie within

    16 u + 8 u K    (norm of the difference over norm of the truth)

u being 2^-53 (2^-24 in single precision) and K the block's condition number for relative changes of all inputs, infinite where
the block jumps within their rounding. So a loss that any method must suffer, because its inputs are rounded, is forgiven, and
no other. Nothing is compared with an absolute number, so that no stiffness is too small to be seen.
"""
