"""An energy for those who do not use Python: golden vectors, formulas, C source.

    vectors.py   states of the hard cases with correctly rounded results and condition numbers
    writing.py   these as NPZ, JSON, C header and MATLAB file, the same bytes every time
    formulas.py  the document's equations, corrected, as LaTeX
    command.py   ``yarnverify export ENERGY --out DIR``

The C source comes from ``symbolic/c_source.py``.
"""
