"""What yarns lie on, in pictures; and how far yarns have slid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="matplotlib is not installed")

from yarnverify.simulation.fabric import weave, yarn
from yarnverify.simulation.solids import Ball
from yarnverify.simulation.view import measure, movie, picture, why_not
from yarnverify.simulation.view.camera import camera
from yarnverify.simulation.view.drawing import FAMILIES, STONE, body, pixels
from yarnverify.simulation.view.flat import drawn as drawn_flat


def test_the_surface_of_a_ball_is_closed_and_faces_outwards() -> None:
    ball = Ball((0.1, -0.2, 0.3), 0.05)
    points, normals, quads = ball.surface()
    away = points - np.array(ball.centre)
    assert np.linalg.norm(away, axis=1) == pytest.approx(0.05, rel=1e-12)
    assert (away / 0.05 - normals) == pytest.approx(0.0, abs=1e-12)
    corners = points[quads]
    area = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]) / 2
    assert np.abs(area.sum(0)).max() < 1e-15  # closed
    assert ((area * normals[quads].mean(1)).sum(1) > 0).all()
    assert np.linalg.norm(area, axis=1).sum() == pytest.approx(4 * np.pi * 0.05**2, rel=2e-3)


@pytest.mark.parametrize("colour", [None, "stretch", "bending"])
def test_a_ball_hides_what_is_behind_it(colour: str | None) -> None:
    thread = yarn(0.02, 8, R=1e-3)
    Q = thread.Q.copy()
    thread.points(Q)[:, 0] = 0.01 + 1.1 * (thread.points(Q)[:, 0] - 0.01)  # stretched, so that it has a colour
    chosen = None if colour is None else measure(thread, Q, colour)
    seen = camera([thread.points(Q)], "top", aspect=2.0, margin=5e-3)
    for height, wanted in ((5e-3, STONE), (-5e-3, None)):
        drawn = body(thread, Q, chosen, solids=[Ball((0.01, 0.0, height), 2e-3)])
        assert len(drawn.colours) == (
            len(drawn.tubes.quads) + len(drawn.tubes.caps) if drawn.by_face else len(drawn.tubes.points)
        )
        middle = drawn_flat(drawn, seen, (200, 100))[50, 100].astype(float)
        grey = np.ptp(middle / middle.max()) < 0.06
        assert grey == (wanted is not None)
        if wanted is None and colour is None:
            share = np.array(FAMILIES["yarn"]) / max(FAMILIES["yarn"])
            assert middle / middle.max() == pytest.approx(share, abs=0.05)


def test_both_ways_of_drawing_show_the_ball() -> None:
    if why_not() is not None:
        pytest.skip(why_not() or "")
    cloth = weave("plain", (5, 5), tails=1e-3)
    drawn = body(cloth, cloth.Q, solids=[Ball((2e-3, 2e-3, -2.5e-3), 2e-3)])
    seen = camera([drawn.tubes.points], "oblique", aspect=4 / 3, room=(0.05, 0.05, 0.05, 0.05))
    one, other = (draw(drawn, seen, (400, 300)).astype(float) for draw in (pixels, drawn_flat))
    outside = [(image > 250).all(2) for image in (one, other)]
    assert (outside[0] != outside[1]).mean() < 0.03
    inside = ~outside[0] & ~outside[1]
    assert np.corrcoef(one[inside].ravel(), other[inside].ravel())[0, 1] > 0.85


def test_pictures_and_movies_see_all_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from PIL import Image

    monkeypatch.setattr("yarnverify.simulation.view.drawing.why_not", lambda: "not here")
    cloth = weave("plain", (3, 3))
    ball = Ball((1e-3, 1e-3, -4e-3), 4e-3)
    still = picture(cloth, cloth.Q, tmp_path / "p.png", size=(320, 240), solids=[ball])
    moving = movie(cloth, [cloth.Q, cloth.Q], tmp_path / "m.gif", size=(320, 240), solids=[ball])
    for path in (still, moving):
        with Image.open(path) as image:
            there = np.asarray(image.convert("RGB")).astype(int)[22:216, 60:272]
        grey = (np.ptp(there, axis=2) < 25) & (there.max(2) < 245)
        across, high = grey.any(0).sum(), grey.any(1).sum()
        assert across == pytest.approx(high, rel=0.15)  # a whole disc, less what the cloth hides of it
        assert 80 < across < 200


def test_sliding_is_how_far_the_yarn_went_through() -> None:
    cloth = weave("plain", (4, 4), tails=2e-3)
    Q = cloth.Q.copy()
    Q[cloth.slides([1])] -= 0.7e-3
    found = measure(cloth, Q, "sliding")
    slid = np.isin(cloth.chain.slides, cloth.slides([1]))
    assert found.values[slid] == pytest.approx(0.7, rel=1e-9) and found.unit == "mm"
    assert (found.values[~slid] == 0).all() and found.limits == (0.0, pytest.approx(0.7))
