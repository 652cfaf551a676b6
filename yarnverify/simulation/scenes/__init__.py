"""The scenes: what known answers the simulations are compared with, in reading order, then cloth that people know."""

from yarnverify.simulation.scene import Scene
from yarnverify.simulation.scenes.axial_swing import axial_swing
from yarnverify.simulation.scenes.bias_extension import bias_extension
from yarnverify.simulation.scenes.buckling import buckling
from yarnverify.simulation.scenes.catenary import catenary
from yarnverify.simulation.scenes.closed_ring import closed_ring
from yarnverify.simulation.scenes.draped_cloth import draped_cloth
from yarnverify.simulation.scenes.elastica import elastica
from yarnverify.simulation.scenes.end_moment import end_moment
from yarnverify.simulation.scenes.energy_over_time import energy_over_time
from yarnverify.simulation.scenes.hanging_yarn import hanging_yarn
from yarnverify.simulation.scenes.heavy_cantilever import heavy_cantilever
from yarnverify.simulation.scenes.hung_cloth import hung_cloth
from yarnverify.simulation.scenes.picture_frame import picture_frame
from yarnverify.simulation.scenes.pressed_yarns import pressed_yarns
from yarnverify.simulation.scenes.pulled_yarn import pulled_yarn
from yarnverify.simulation.scenes.rigid_motion import rigid_motion
from yarnverify.simulation.scenes.sliding_yarn import sliding_yarn
from yarnverify.simulation.scenes.still_cloth import still_cloth
from yarnverify.simulation.scenes.swinging_yarn import swinging_yarn
from yarnverify.simulation.scenes.thrown_cloth import thrown_cloth

SCENES: tuple[Scene, ...] = (
    hanging_yarn,
    elastica,
    heavy_cantilever,
    end_moment,
    closed_ring,
    buckling,
    swinging_yarn,
    catenary,
    sliding_yarn,
    pressed_yarns,
    picture_frame,
    bias_extension,
    still_cloth,
    rigid_motion,
    thrown_cloth,
    axial_swing,
    energy_over_time,
    hung_cloth,
    draped_cloth,
    pulled_yarn,
)
