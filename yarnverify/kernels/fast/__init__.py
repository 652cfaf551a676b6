"""Variant ``fast``: safe forms in plain arithmetic, which lose what the rounding of differences explains. Generated."""
