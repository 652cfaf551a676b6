"""The scenes: what known answers the simulations are compared with, in reading order, then cloth that people know."""

from yarnverify.simulation.scene import Scene
from yarnverify.simulation.scenes.hanging_yarn import hanging_yarn

SCENES: tuple[Scene, ...] = (hanging_yarn,)
