"""The scenes: what known answers the simulations are compared with, in reading order, then cloth that people know."""

from yarnverify.simulation.scene import Scene
from yarnverify.simulation.scenes.bias_extension import bias_extension
from yarnverify.simulation.scenes.buckling import buckling
from yarnverify.simulation.scenes.catenary import catenary
from yarnverify.simulation.scenes.closed_ring import closed_ring
from yarnverify.simulation.scenes.elastica import elastica
from yarnverify.simulation.scenes.end_moment import end_moment
from yarnverify.simulation.scenes.hanging_yarn import hanging_yarn
from yarnverify.simulation.scenes.heavy_cantilever import heavy_cantilever
from yarnverify.simulation.scenes.picture_frame import picture_frame
from yarnverify.simulation.scenes.pressed_yarns import pressed_yarns
from yarnverify.simulation.scenes.sliding_yarn import sliding_yarn

SCENES: tuple[Scene, ...] = (
    hanging_yarn,
    elastica,
    heavy_cantilever,
    end_moment,
    closed_ring,
    buckling,
    catenary,
    sliding_yarn,
    pressed_yarns,
    picture_frame,
    bias_extension,
)
