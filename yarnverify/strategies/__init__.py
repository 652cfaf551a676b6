"""Hypothesis strategies for kernels of yarns: angles, lengths, offsets and whole elements where they are hard.

Numbers are drawn by exponent and mantissa, since uniform floats almost never come near a singular angle::

    from hypothesis import given
    from yarnverify.kernels import bending
    from yarnverify.strategies import elements

    @given(elements(bending))
    def test_my_bending(element):
        q, parameters = element          # (11, 1), {"k_b": ...}
        ...

They shrink to plain numbers: powers of two near 1, axis-aligned frames, right angles, no offset. Only this folder and the
search behind ``yarnverify fuzz`` import Hypothesis (``pip install yarnverify[fuzz]``).
"""

from yarnverify.strategies.build import Element, element, elements
from yarnverify.strategies.frames import Turn, angles, orientations, turns
from yarnverify.strategies.numbers import length_ratios, magnitudes, offsets, scales, strains

__all__ = [
    "Element",
    "Turn",
    "angles",
    "element",
    "elements",
    "length_ratios",
    "magnitudes",
    "offsets",
    "orientations",
    "scales",
    "strains",
    "turns",
]
