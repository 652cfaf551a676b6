"""Variant ``accurate``: safe forms, the rounding errors of edges, products and sums carried along. Generated."""
