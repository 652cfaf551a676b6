"""Variant ``reference``: safe forms in pairs of doubles, rounded once; slow. Generated."""
