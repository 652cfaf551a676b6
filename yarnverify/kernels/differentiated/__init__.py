"""Variant ``differentiated``: the derivative by SymPy, chain rule over the measures, common subexpressions shared. Generated."""
