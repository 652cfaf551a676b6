"""Read a document, derive its energies, prove or refute its equations, repair them, emit kernels.

In the order of work::

    tree, latex      the typed expression tree, and its way back to LaTeX
    reader           LaTeX text -> trees with positions               (grammar.lark)
    document         trees -> definitions, energies, claims per section
    declare          energies as a person declares them in derivations/*.py
    normal           reading 1: exact normal forms and derivatives     (SymPy polynomials)
    forward          reading 2: forward second-order differentiation over exact rationals, balls or floats
    prove, repair    a verdict on every claim; the smallest true change of a refuted one
    measures, derive gradients and Hessians in vector form, by the chain rule over proven measures
    emit             NumPy modules                                     (reading 3)
"""
