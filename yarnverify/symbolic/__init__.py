"""Read a document, derive its energies, prove or refute its equations, repair them, emit kernels.

In the order of work::

    tree, latex, plain          the typed expression tree, and its ways back to LaTeX and to text
    reader                      LaTeX text -> trees with positions                 (grammar.lark)
    declare                     energies as a person declares them in derivations/*.py
    document                    trees -> definitions, assumptions, energies and claims per section
    reading, normal             reading 1: exact normal forms and derivatives      (SymPy polynomials)
    numbers, jets, forward      reading 2: forward differentiation over exact rationals, balls or doubles
    states                      where reading 2 looks
    court, prove                a verdict on two sides; the trial of a document
    repair, record              the smallest true change of a refuted chain; all that was found, as JSON
    measures, laws, scalars     lengths and angles; energies as laws of them; SymPy scalars back to trees
    derive, explain             gradients and Hessians in vector form, proved; the derivation step by step
    emit, modules               reading 3: straight-line NumPy programs, and the modules that hold them
"""
