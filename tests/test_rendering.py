"""Pictures by VTK agree with those by matplotlib, and files can be read by pyvista. Needs the extra ``view`` and OpenGL."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="matplotlib is not installed")
pytest.importorskip("pyvista", reason="pyvista is not installed (extra: view)")

from yarnverify.simulation.fabric import weave, yarn
from yarnverify.simulation.view import Series, measure, picture, why_not
from yarnverify.simulation.view.camera import camera
from yarnverify.simulation.view.drawing import body, mesh, pixels
from yarnverify.simulation.view.flat import drawn as drawn_flat


@pytest.fixture(scope="module")
def vtk() -> None:
    """Skips, with the line that a user would see, where VTK cannot render."""
    if why_not() is not None:
        pytest.skip(why_not() or "")


rendered = pytest.mark.usefixtures("vtk")


def waved(size: tuple[int, int]) -> tuple[Any, Any]:
    cloth = weave("twill 2/1", size, tails=0.5e-3)
    Q = cloth.Q.copy()
    points = cloth.points(Q)
    points[:, 2] = 0.8e-3 * np.sin(points[:, 0] / 0.9e-3)
    return cloth, Q


@rendered
@pytest.mark.parametrize("colour", [None, "stretch", "bending"])
def test_both_ways_of_drawing_show_the_same(colour: str | None) -> None:
    cloth, Q = waved((5, 4))
    drawn = body(cloth, Q, None if colour is None else measure(cloth, Q, colour))
    seen = camera([drawn.tubes.points], "oblique", aspect=4 / 3, room=(0.05, 0.05, 0.05, 0.05))
    one, other = (
        image.astype(float) for image in (pixels(drawn, seen, (400, 300)), drawn_flat(drawn, seen, (400, 300)))
    )
    outside = [(image > 250).all(2) for image in (one, other)]
    assert 0.2 < outside[0].mean() < 0.9
    assert (outside[0] != outside[1]).mean() < 0.02  # the same outline, but for its edge
    inside = ~outside[0] & ~outside[1]
    assert np.median(np.abs(one - other)[inside]) < 25  # and the same colours, lit much alike
    assert np.corrcoef(one[inside].ravel(), other[inside].ravel())[0, 1] > 0.85


@rendered
def test_vtk_draws_true_to_scale() -> None:
    thread = yarn(0.02, 4, R=1e-3)
    drawn = body(thread, thread.Q, sides=48)
    seen = camera([drawn.tubes.points], "top", aspect=2.0)
    there = (pixels(drawn, seen, (800, 400)) < 250).any(2)
    metre = 400 / seen.height
    assert there.any(0).sum() == pytest.approx(0.02 * metre, abs=2)
    assert there.any(1).sum() == pytest.approx(2e-3 * metre, abs=2)


@rendered
def test_a_picture_in_a_process_without_display(tmp_path: Path) -> None:
    code = (
        "from yarnverify.simulation.fabric import weave; from yarnverify.simulation.view import picture, why_not\n"
        "cloth = weave('plain', (3, 3)); assert why_not() is None\n"
        f"picture(cloth, cloth.Q, {str(tmp_path / 'cloth.png')!r}, size=(320, 240))"
    )
    bare = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    subprocess.run([sys.executable, "-c", code], check=True, env=bare, timeout=300)
    assert (tmp_path / "cloth.png").stat().st_size > 5000


@rendered
def test_pictures_have_the_size_that_was_asked_for(tmp_path: Path) -> None:
    from PIL import Image

    cloth, Q = waved((4, 4))
    with Image.open(picture(cloth, Q, tmp_path / "p.png", colour="stretch", size=(500, 333))) as image:
        assert image.size == (500, 333)


def test_the_mesh_has_its_normals_and_is_closed() -> None:
    cloth, Q = waved((4, 3))
    surface = mesh(body(cloth, Q))
    assert surface.point_data.active_normals is not None and surface.n_cells == len(surface.cell_data["colour"])
    assert surface.clean(tolerance=1e-9).is_manifold


@pytest.mark.parametrize("surface", [True, False])
def test_pyvista_reads_a_series(tmp_path: Path, surface: bool) -> None:
    import pyvista

    cloth, Q = waved((4, 3))
    series = Series(cloth, tmp_path / "run.pvd", surface=surface)
    for time in (0.0, 0.5):
        series.write(time, Q)
    reader = pyvista.PVDReader(str(tmp_path / "run.pvd"))
    assert list(reader.time_values) == [0.0, 0.5]
    block = reader.read()[0]
    if surface:
        assert block.clean(tolerance=1e-9).is_manifold
    else:
        assert block.points == pytest.approx(cloth.points(Q)[cloth.chain.nodes])
    strains = known(block.cell_data["stretch (%)"])
    assert strains.min() == pytest.approx(known(measure(cloth, Q, "stretch").values).min(), abs=1e-4)
    assert strains.max() == pytest.approx(known(measure(cloth, Q, "stretch").values).max(), abs=1e-4)
    assert {"bending angle (°)", "shear (°)"} <= set(block.point_data) and "contact (mm overlap)" in block.cell_data


def known(values: Any) -> Any:
    return values[np.isfinite(values)]
