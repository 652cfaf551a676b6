"""Read a document, derive its energies, prove or refute its equations, repair them, emit kernels.

In the order of work::

    tree, functions             the typed expression tree; the functions that formulas may use
    latex, plain                its ways back to LaTeX and to text
    tokens, grammar, reader     LaTeX text -> trees with positions                 (grammar.lark)
    declare, loading, energies, energies as a person declares them in derivations/*.py: their units, the integrals in them,
      dimensions, integrals,      the motions that leave them as they are, and where in its file a mistake stands
      invariants, places
    sections, document          trees -> definitions, assumptions, energies and claims per section
    polynomials, square_roots,  reading 1: exact normal forms and derivatives      (FLINT's polynomials)
      roots, circles, turns,
      logarithms, enclosures,
      slopes, reading, normal,
      blocks
    algebraic, numbers, linear, reading 2: forward differentiation over exact rationals, balls or doubles
      exponentials, jets, forward
    states, signs, evidence     where reading 2 looks, and what it sees there
    court, prove                a verdict on two sides; the trial of a document
    changes, repair             the smallest true change of a refuted chain
    effects, record             what a mistake does; all that was found, as JSON
    measures, laws, scalars     lengths and angles; energies as laws of them; SymPy scalars back to trees
    derive, explain             gradients and Hessians in vector form, proved; the derivation step by step
    corner, safe, safe_laws,    the same blocks rearranged so that they have no 0/0, proved again
      vanishing, radicals,
      cancelling, safe_program
    steps, emit, sums,          reading 3: straight-line programs, also of energies without safe forms; their text,
      vector_angles, angle_trees, which of them a variant consists of, and the modules that hold them
      printing, programs, modules
    c_functions, c_source       the same programs as C
"""
