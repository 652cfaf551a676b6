"""Variant ``printed``: the document's own formulas, misprints included. Generated."""
