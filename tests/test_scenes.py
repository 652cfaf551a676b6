"""Scenes: every one against its known answer, runs that are interrupted, and what cannot be run."""

from __future__ import annotations

import pytest

from yarnverify.simulation.scene import Scene
from yarnverify.simulation.scenes import SCENES
from yarnverify.simulation.study import study

VALIDATING = [scene for scene in SCENES if scene.validates]


@pytest.mark.parametrize("scene", VALIDATING, ids=lambda scene: scene.name)
def test_a_scene_comes_out_as_known(scene: Scene) -> None:
    assert len(scene.sizes) >= 3
    assert study(scene, scene.sizes, {}).failures == []
