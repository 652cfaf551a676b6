"""What the reference scenes have to come out as: exact answers, or answers to many more digits than a scene has.

Pure functions of numbers; each states its formula and where it comes from.

    chains      hanging yarn, catenary with and without stretch, a crossing that slides
    rods        cantilever with a load at its tip or under its own weight, arc, ring, buckling, frequencies
    cloth       picture frame, bias extension, parallel contact
    bias        bias extension of a net of yarns that do not stretch, of any proportions
"""

from yarnverify.simulation.answers.bias import bias_net
from yarnverify.simulation.answers.chains import (
    Catenary,
    Chain,
    catenary,
    hanging_chain,
    hanging_elongation,
    hung_chain,
    sliding_split,
)
from yarnverify.simulation.answers.cloth import bias_extension, contact_gap, picture_frame
from yarnverify.simulation.answers.elastica import Tip, elastica, elastica_shape
from yarnverify.simulation.answers.rods import (
    Cantilever,
    arc,
    buckled,
    buckling_load,
    cantilever,
    frequency,
    ring_energy,
)

__all__ = [
    "Cantilever", "Catenary", "Chain", "Tip", "arc", "bias_extension", "bias_net", "buckled", "buckling_load",
    "cantilever", "catenary",
    "contact_gap", "elastica", "elastica_shape", "frequency", "hanging_chain", "hanging_elongation", "hung_chain",
    "picture_frame", "ring_energy", "sliding_split",
]  # fmt: skip
