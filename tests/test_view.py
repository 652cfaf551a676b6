"""Pictures of yarns: geometry, measures, files; what draws is matplotlib here, so that none of it needs VTK."""

from __future__ import annotations

import base64
import gzip
import json
import re
import shutil
import subprocess
import sys
import zlib
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="matplotlib is not installed")

from scipy.spatial import cKDTree

from yarnverify.errors import InputError, NotRunError
from yarnverify.kernels import bending, shear, stretch
from yarnverify.simulation.fabric import Fabric, bends, contacts, ring, segments, shears, weave, yarn
from yarnverify.simulation.view import Series, energy, measure, movie, picture, probe, scene, turntable, why_not
from yarnverify.simulation.view.camera import camera
from yarnverify.simulation.view.drawing import FAMILIES, body, colours_of, pixels, table_of
from yarnverify.simulation.view.measures import shown
from yarnverify.simulation.view.strands import strands
from yarnverify.simulation.view.tubes import tubes

SMALL = (320, 240)


@pytest.fixture
def no_vtk(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a machine where VTK cannot render."""
    monkeypatch.setattr("yarnverify.simulation.view.drawing.why_not", lambda: "not here")


def sheared(fabric: Fabric, degrees: float) -> Any:
    Q = fabric.Q.copy()
    points = fabric.points(Q)
    points[:, 0] += points[:, 1] * np.sin(np.radians(degrees))
    points[:, 1] *= np.cos(np.radians(degrees))
    return Q


# -- geometry ---------------------------------------------------------------------------------------------------------


def clearance(fabric: Fabric, Q: Any) -> float:
    """Least distance of the centre lines of two yarns, in radii."""
    line = strands(fabric, Q, 30)
    least = np.inf
    for k in range(len(fabric.yarns)):
        own = line.yarn == k
        least = min(least, float(cKDTree(line.points[~own]).query(line.points[own])[0].min()))
    return least / fabric.R


@pytest.mark.parametrize("spacing", [4.02, 4.5, 8.0])
@pytest.mark.parametrize("pattern", ["plain", "twill 2/2", "twill 2/1", "satin 5"])
def test_yarns_touch_at_crossings_and_do_not_overlap(pattern: str, spacing: float) -> None:
    fabric = weave(pattern, (6, 6), L=spacing * 0.2e-3, R=0.2e-3, tails=0.5e-3)
    assert clearance(fabric, fabric.Q) == pytest.approx(2, abs=4e-3)  # 0.2 % of a diameter is not seen


@pytest.mark.parametrize("degrees", [15, 30, 45])
def test_yarns_do_not_overlap_in_shear_while_there_is_room(degrees: float) -> None:
    fabric = weave("plain", (5, 5), L=1.6e-3, R=0.2e-3)
    assert clearance(fabric, sheared(fabric, degrees)) == pytest.approx(2, abs=2e-3)


def test_the_warp_lies_over_the_weft_where_the_pattern_says_so() -> None:
    fabric = weave("satin 5", (7, 6))
    line = strands(fabric, fabric.Q, 8)
    for place, node in enumerate(fabric.crossings):
        x, y, _ = fabric.points(fabric.Q)[node]
        there = np.hypot(line.points[:, 0] - x, line.points[:, 1] - y) < 1e-9
        heights = {fabric.yarns[k].family: z for k, z in zip(line.yarn[there], line.points[there, 2], strict=True)}
        assert heights["warp"] == pytest.approx(fabric.over[place] * fabric.R)
        assert heights["weft"] == pytest.approx(-fabric.over[place] * fabric.R)


def test_strands_run_through_the_nodes_and_turn_with_the_cloth() -> None:
    fabric = weave("twill 2/1", (5, 4), tails=0.7e-3)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    Q = sheared(fabric, 20)
    plain = strands(fabric, Q, 5, crimp=False)
    on_nodes = plain.part == 0
    assert plain.points[on_nodes] == pytest.approx(
        fabric.points(Q)[fabric.chain.nodes[plain.place[on_nodes]]], abs=1e-15
    )
    moved = Q.copy()
    fabric.points(moved)[:] = fabric.points(Q) @ turn.T + 0.3
    assert strands(fabric, moved, 5).points == pytest.approx(strands(fabric, Q, 5).points @ turn.T + 0.3, abs=1e-12)


BODIES: dict[str, Any] = {
    "cloth": lambda: weave("plain", (4, 3), tails=0.6e-3),
    "yarn": lambda: yarn(0.02, 5, R=1e-3),
    "ring": lambda: ring(0.1, 9, R=1e-3),
}


@pytest.mark.parametrize("name", BODIES)
def test_tubes_are_closed_and_of_their_radius(name: str) -> None:
    fabric = BODIES[name]()
    line = strands(fabric, fabric.Q, 12)
    made = tubes(line, 32)
    faces = [*made.quads.tolist(), *made.caps.tolist()]
    place = {}
    key = np.array([place.setdefault(tuple(p), len(place)) for p in np.round(made.points, 9).tolist()])
    edges: dict[tuple[int, int], int] = {}
    volume = 0.0
    for face in faces:
        for a, b in pairwise([*face, face[0]]):
            edges[key[a], key[b]] = edges.get((key[a], key[b]), 0) + 1
        p = made.points[face] - made.points.mean(0)
        volume += sum(np.dot(p[0], np.cross(p[k], p[k + 1])) for k in range(1, len(face) - 1)) / 6
    assert all(count == 1 and edges.get((b, a)) == 1 for (a, b), count in edges.items())  # closed, and turned one way
    length = np.linalg.norm(np.diff(line.points, axis=0)[line.yarn[1:] == line.yarn[:-1]], axis=1).sum()
    assert volume == pytest.approx(np.pi * fabric.R**2 * length, rel=0.02)  # a polygon of 32 sides has 0.6 % less
    mantle = made.sample[: len(line.points) * 32]
    away = made.points[: len(mantle)] - line.points[mantle]
    assert np.linalg.norm(away, axis=1) == pytest.approx(fabric.R, rel=1e-12)
    assert np.linalg.norm(made.normals, axis=1) == pytest.approx(1, rel=1e-12)


def test_a_frame_is_carried_where_a_yarn_turns_everywhere() -> None:
    fabric = yarn(1.0, 60, R=1e-3)
    Q = fabric.Q.copy()
    s = np.linspace(0, 1, 61)
    fabric.points(Q)[:] = np.stack([np.sin(9 * s), np.cos(9 * s) * np.cos(7 * s), np.sin(7 * s)], axis=1)
    made = tubes(strands(fabric, Q, 6), 12)
    mantle = made.normals[: -2 * 12].reshape(-1, 12, 3)
    assert (mantle[1:] * mantle[:-1]).sum(2).min() > 0.8  # rings follow each other without a jump


# -- measures ---------------------------------------------------------------------------------------------------------


def known(values: Any) -> Any:
    return values[np.isfinite(values)]


def test_measures_have_the_known_values() -> None:
    thread = yarn(0.1, 10)
    assert known(measure(thread, 1.03 * thread.Q - 0.03 * np.where(np.arange(thread.size) < 33, 0, thread.Q), "stretch").values
                 ) == pytest.approx(3.0)  # fmt: skip
    loop = ring(0.1, 9)
    assert known(measure(loop, loop.Q, "bending").values) == pytest.approx(40.0)
    cloth = weave("plain", (4, 4))
    assert known(measure(cloth, sheared(cloth, 25), "shear").values) == pytest.approx(25.0)
    Q = cloth.Q.copy()
    Q[cloth.yarns[1].slides[2]] -= 0.3e-3  # L = 1 mm, d = 0.8 mm
    overlap = measure(cloth, Q, "contact").values
    assert np.flatnonzero(overlap > 0).tolist() == [np.flatnonzero(cloth.chain.slides == cloth.yarns[1].slides[1])[0]]
    assert np.nanmax(overlap) == pytest.approx(0.1)


def test_energies_lie_where_their_elements_are() -> None:
    cloth = weave("plain", (4, 3), tails=0.5e-3)
    Q = sheared(cloth, 10) * np.where(np.arange(cloth.size) < 3 * cloth.nodes, 1.01, 1.0)
    cloth.points(Q)[:, 2] = 1e-4 * np.random.default_rng(3).normal(size=cloth.nodes)
    for kernel, make, parameters, at in (
        (stretch, segments, {"k_s": 10.0}, "segments"),
        (bending, bends, {"k_b": 1e-8}, "nodes"),
        (shear, shears, {"k_x": 1e-3}, "nodes"),
    ):
        made = make(cloth)
        energies = kernel.energy(Q[made.rows], **made.parameters, **parameters)
        found = energy(cloth, made, energies, "x")
        assert found.at == at and found.unit == "J"
        twice = 2 if kernel is shear else 1  # a crossing's energy is shown on both its yarns
        assert known(found.values).sum() == pytest.approx(twice * energies.sum())
        easy = shown(found)
        assert 1 <= max(easy.limits) < 1000 and easy.unit in ("µJ", "nJ", "pJ")
    with pytest.raises(InputError, match="energy of x: 1 values"):
        energy(cloth, segments(cloth), [1.0], "x")
    with pytest.raises(InputError, match="there are stretch, bending, shear, contact"):
        measure(cloth, Q, "colour")


def test_rounding_is_not_shown_as_if_it_were_something() -> None:
    cloth = weave("plain", (5, 5))
    for name in ("stretch", "bending", "shear", "contact"):
        assert measure(cloth, cloth.Q + 1e-17, name).limits == (0.0, 0.0)


def test_segments_are_of_one_colour_and_nodes_blend() -> None:
    thread = yarn(0.1, 4)
    Q = thread.Q.copy()
    Q[3:15:3] += [0.0, 0.001, 0.001, 0.001]
    drawn = body(thread, Q, measure(thread, Q, "stretch"), detail=5)
    first = drawn.colours[: 5 * 12]
    assert drawn.by_face and (first == first[0]).all() and len(np.unique(drawn.colours, axis=0)) == 2
    bent = measure(thread, Q, "bending")
    assert np.isnan(bent.values[[0, -1]]).all()
    assert np.isfinite(bent.on_samples(strands(thread, Q, 5))).all()  # an end takes the value of the node beside it
    assert colours_of(np.array([np.nan]), (0.0, 1.0), False).tolist() == [[190, 190, 190]]
    assert (colours_of(np.array([-9.0, 9.0]), (-1.0, 1.0), True) == table_of(True)[[0, 255]]).all()


# -- pictures ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("view", ["top", "front", "side", "oblique", ((1, 2, 3), (0, 0, 1))])
@pytest.mark.parametrize("turning", [False, True])
def test_the_camera_sees_everything(view: Any, turning: bool) -> None:
    cloud = np.random.default_rng(5).normal(size=(200, 3)) * [3, 1, 0.2] + 7
    room = (0.03, 0.15, 0.1, 0.09)
    seen = camera([cloud], view, aspect=1.5, room=room, turning=turning)
    for angle in np.linspace(0, 6, 7) if turning else [0.0]:
        turned = seen.turned(angle)
        assert turned.axes @ turned.axes.T == pytest.approx(np.eye(3), abs=1e-12)
        at = (cloud - turned.centre) @ turned.axes.T[:, :2] / [1.5 * turned.height, turned.height] + 0.5
        assert (at >= np.array([room[0], room[2]]) - 1e-9).all() and (
            at <= 1 - np.array([room[1], room[3]]) + 1e-9
        ).all()
    with pytest.raises(InputError, match="there are top, front, side, oblique"):
        camera([cloud], "below")


def test_the_picture_is_true_to_scale(no_vtk: None) -> None:
    """A yarn is as thick and as long in pixels as it is in metres."""
    thread = yarn(0.02, 4, R=1e-3)
    drawn = body(thread, thread.Q, sides=48)
    seen = camera([drawn.tubes.points], "top", aspect=2.0)
    image = pixels(drawn, seen, (800, 400))
    there = (image < 250).any(2)
    metre = 400 / seen.height
    assert there.any(0).sum() == pytest.approx(0.02 * metre, abs=2)
    assert there.any(1).sum() == pytest.approx(2e-3 * metre, abs=2)


def test_the_upper_yarn_hides_the_lower(no_vtk: None) -> None:
    for pattern, upper in (([[1, 0], [0, 1]], "warp"), ([[0, 1], [1, 0]], "weft")):
        cloth = weave(pattern, (1, 1), tails=1e-3)
        drawn = body(cloth, cloth.Q)
        image = pixels(drawn, camera([drawn.tubes.points], "top", aspect=1.0), (101, 101)).astype(float)
        middle = image[50, 50] / image[50, 50].sum()
        apart = {name: np.abs(middle - np.array(c) / sum(c)).max() for name, c in FAMILIES.items()}
        assert min(apart, key=lambda name: apart[name]) == upper


def test_a_picture_carries_legend_unit_and_scale(tmp_path: Path, no_vtk: None, monkeypatch: pytest.MonkeyPatch) -> None:
    from PIL import Image

    from yarnverify.simulation.view import pictures

    said: list[str] = []

    class Listening(pictures.Sheet):
        def compose(self, *given: Any) -> Any:
            from matplotlib.text import Text

            image = super().compose(*given)
            said.extend(
                re.sub(r"\$\\mathdefault{(.*)}\$", r"\1", text.get_text()) for text in self.figure.findobj(Text)
            )
            return image

    monkeypatch.setattr(pictures, "Sheet", Listening)
    cloth = weave("plain", (4, 4))
    made = picture(
        cloth, sheared(cloth, 20), tmp_path / "a" / "cloth.png", colour="shear", title="T", note="N", size=SMALL
    )
    with Image.open(made) as image:
        assert image.size == SMALL
    assert [p.name for p in made.parent.iterdir()] == ["cloth.png"]  # nothing half written beside it
    assert {"T", "N", "shear\n(°)", "0", "20"} <= set(said) and any(
        re.fullmatch(r"[125]0* [mcµ]?m", text) for text in said
    )
    picture(cloth, cloth.Q, tmp_path / "families.png", size=SMALL)
    assert {"warp", "weft"} <= set(said)


def test_movies_have_their_frames_and_colours(tmp_path: Path, no_vtk: None) -> None:
    from PIL import Image

    cloth = weave("plain", (3, 3))
    frames = [sheared(cloth, degrees) for degrees in (0, 15, 30)]
    with Image.open(movie(cloth, frames, tmp_path / "m.gif", times=[0, 1, 2], colour="shear", size=SMALL)) as gif:
        assert gif.n_frames == 3 and gif.size == SMALL
        shots = []
        for k in range(3):
            gif.seek(k)
            shots.append(np.asarray(gif.convert("RGB")))
    assert all((shot[3, 3] == 255).all() for shot in shots)  # white stays white
    top = np.abs(shots[0].astype(int) - table_of(False)[-1].astype(int)).sum(2).min()
    assert top <= 24  # the top of the scale has its colour though nothing has that value yet
    assert (shots[0] != shots[2]).any()
    with Image.open(turntable(cloth, cloth.Q, tmp_path / "t.gif", frames=3, size=SMALL)) as gif:
        assert gif.n_frames == 3
    for wrong, message in (("m.avi", "ends in .gif or .mp4"), ("n.gif", "a time for each")):
        with pytest.raises(InputError, match=message):
            movie(cloth, frames, tmp_path / wrong, times=[0.0])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["m.gif", "t.gif"]


def test_an_mp4_without_its_writer_is_refused(tmp_path: Path, no_vtk: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    cloth = weave("plain", (2, 2))
    with pytest.raises(NotRunError, match="pip install imageio-ffmpeg"):
        movie(cloth, [cloth.Q], tmp_path / "m.mp4", size=SMALL)
    assert not list(tmp_path.iterdir())


# -- what can draw here -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("code", "said", "message"),
    [
        (0, "rendered\n", None),
        (
            -11,
            "",
            r"^VTK cannot render here \(on Debian: apt install libegl1 libgl1-mesa-dri\): matplotlib draws instead$",
        ),
        (-6, "", "libegl1 libgl1-mesa-dri"),
        (1, "ImportError: libXrender.so.1: cannot open", "cannot be imported here .ImportError: libXrender"),
    ],
)
def test_the_probe(code: int, said: str, message: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    def trial(*_: Any, **__: Any) -> Any:
        return subprocess.CompletedProcess([], code, said, said)

    monkeypatch.setattr(probe.subprocess, "run", trial)
    monkeypatch.setattr(probe.importlib.util, "find_spec", lambda name: object())
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    why_not.cache_clear()
    try:
        found = why_not()
        assert found is None if message is None else re.search(message, found or "") and "\n" not in (found or "")
    finally:
        why_not.cache_clear()


def test_without_pyvista_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(probe.importlib.util, "find_spec", lambda name: None)
    why_not.cache_clear()
    try:
        assert "pip install 'yarnverify[view]'" in (why_not() or "")
    finally:
        why_not.cache_clear()


def test_the_reason_is_told_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    monkeypatch.setattr("yarnverify.simulation.view.drawing.why_not", lambda: "VTK cannot render here (on Debian: ...)")
    probe.tell.cache_clear()
    cloth = weave("plain", (2, 2))
    for _ in range(2):
        picture(cloth, cloth.Q, tmp_path / "p.png", size=SMALL)
    assert [record.message for record in caplog.records] == ["VTK cannot render here (on Debian: ...)"]


def test_without_matplotlib_nothing_is_drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(probe.importlib.util, "find_spec", lambda name: None)
    cloth = weave("plain", (2, 2))
    for draw, name in ((picture, "p.png"), (scene, "s.html"), (turntable, "t.gif")):
        with pytest.raises(NotRunError, match="pip install 'yarnverify"):
            draw(cloth, cloth.Q, tmp_path / name)
    Series(cloth, tmp_path / "run.pvd").write(0.0, cloth.Q)  # needs neither


def test_nothing_that_draws_is_imported_before_a_picture_is_made() -> None:
    code = (
        "import sys, yarnverify.simulation.fabric, yarnverify.simulation.view\n"
        "print(sorted({'pyvista', 'vtkmodules', 'matplotlib', 'PIL', 'sympy', 'imageio_ffmpeg'} & set(sys.modules)))"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.strip() == "[]"


# -- scene and series -------------------------------------------------------------------------------------------------


def data_of(page: str) -> Any:
    found = re.search(r"const DATA = (.*);\nconst", page)
    assert found is not None
    return json.loads(found[1])


def test_a_scene_is_one_file_that_needs_nothing_else(tmp_path: Path) -> None:
    cloth = weave("twill 2/1", (4, 3), tails=0.5e-3)
    frames = [sheared(cloth, degrees) for degrees in (0, 10)]
    made = scene(
        cloth, frames, tmp_path / "s.html", times=[0.0, 0.5], title="</script> & more", colours=["stretch", "shear"]
    )
    page = made.read_text(encoding="utf-8")
    assert not re.search(r"https?://|src=|@import|<link", page) and page.count("</script>") == 1
    data = data_of(page)
    assert data["title"] == "</script> & more" and data["notes"] == ["t = 0.0 ms", "t = 500.0 ms"]
    packed = np.frombuffer(gzip.decompress(base64.b64decode(data["lines"])), "<u2").reshape(2, -1, 3)
    for Q, steps in zip(frames, packed, strict=True):
        points = np.array(data["low"]) + data["step"] * steps
        assert points == pytest.approx(strands(cloth, Q, 6).points, abs=0.51 * data["step"])
    assert data["step"] < cloth.R / 100
    assert [m["name"] for m in data["measures"]] == ["yarns", "stretch", "shear"]
    levels = np.frombuffer(gzip.decompress(base64.b64decode(data["measures"][2]["values"])), np.uint8).reshape(2, -1)
    assert set(levels[0]) == {0} and set(levels[1]) == {253}
    assert (
        data["measures"][2]["ticks"][-1] == [pytest.approx(1.0), "10"] and data["measures"][2]["label"] == "shear (°)"
    )
    with pytest.raises(InputError, match=f"configurations of {cloth.size} numbers"):
        scene(cloth, cloth.Q[:-1], tmp_path / "s.html")


def test_the_script_of_a_scene_is_javascript(tmp_path: Path) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    thread = yarn(0.1, 3)
    page = scene(thread, thread.Q, tmp_path / "s.html").read_text(encoding="utf-8")
    script = tmp_path / "s.js"
    script.write_text(page.split("<script>")[1].split("</script>")[0], encoding="utf-8")
    assert subprocess.run([node, "--check", str(script)], capture_output=True).returncode == 0


def read_vtp(path: Path) -> dict[str, Any]:
    """Arrays of a file by name, by a reader that knows no more than VTK's description of the format."""
    piece = ElementTree.parse(path).getroot()[0][0]
    found: dict[str, Any] = {key: int(value) for key, value in piece.attrib.items()}
    for array in piece.iter("DataArray"):
        text = array.text or ""
        blocks, size, rest, squeezed = np.frombuffer(base64.b64decode(text[:44]), "<u8").tolist()
        assert (blocks, rest) == (1, 0)
        raw = zlib.decompress(base64.b64decode(text[44:])[:squeezed])
        assert len(raw) == size
        values = np.frombuffer(
            raw, {"Float32": "<f4", "Float64": "<f8", "Int32": "<i4", "Int8": "<i1"}[array.attrib["type"]]
        )
        width = int(array.attrib["NumberOfComponents"])
        found[array.attrib["Name"]] = values.reshape(-1, width) if width > 1 else values
    return found


@pytest.mark.parametrize("surface", [True, False])
def test_a_series_is_whole_after_every_step(tmp_path: Path, surface: bool) -> None:
    cloth = weave("plain", (3, 4), tails=0.5e-3)
    series = Series(cloth, tmp_path / "run.pvd", surface=surface)
    for k in range(3):
        series.write(0.1 * k, sheared(cloth, 10 * k))
        listed = ElementTree.parse(tmp_path / "run.pvd").getroot().iter("DataSet")
        files = [(float(d.attrib["timestep"]), tmp_path / d.attrib["file"]) for d in listed]
        assert [time for time, _ in files] == pytest.approx([0.1 * j for j in range(k + 1)])
        for j, (_, file) in enumerate(files):
            read = read_vtp(file)
            assert np.nanmax(np.abs(read["shear (°)"] - 10 * j)) < 1e-4
            assert len(read["Points"]) == read["NumberOfPoints"] == len(read["shear (°)"])
            assert read["connectivity"].max() < read["NumberOfPoints"] and read["offsets"][-1] == len(
                read["connectivity"]
            )
            assert len(read["yarn"]) == len(read["stretch (%)"]) == len(read["offsets"])
    if not surface:
        assert read["Points"] == pytest.approx(cloth.points(sheared(cloth, 20))[read["node"]])
        assert read["sliding coordinate (m)"] == pytest.approx(cloth.Q[cloth.chain.slides])
    assert not [p for p in tmp_path.iterdir() if "part" in p.name]


def test_a_series_goes_on_where_a_run_resumes(tmp_path: Path) -> None:
    cloth = weave("plain", (2, 2))
    first = Series(cloth, tmp_path / "run.pvd", surface=False)
    for time in (0.0, 0.1, 0.2):
        first.write(time, cloth.Q)
    again = Series(cloth, tmp_path / "run.pvd", surface=False, resume=True)
    again.write(np.float64(0.1), cloth.Q)  # the state that was saved last is older; its time is NumPy's
    assert Series(cloth, tmp_path / "run.pvd", surface=False, resume=True).steps == again.steps
    assert again.steps == [(0.0, "run_00000.vtp"), (0.1, "run_00001.vtp")]
    assert Series(cloth, tmp_path / "new.pvd", resume=True).steps == []
    with pytest.raises(InputError, match=r"ends in \.pvd"):
        Series(cloth, tmp_path / "run.vtp")


def test_a_full_disk_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cloth = weave("plain", (2, 2))
    series = Series(cloth, tmp_path / "run.pvd", surface=False)
    series.write(0.0, cloth.Q)
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}

    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(NotRunError, match=r"run_00001.vtp: cannot write: no space left on device"):
        series.write(0.1, cloth.Q)
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_contacts_are_shown_between_the_yarns_that_touch() -> None:
    cloth = weave("plain", (3, 3))
    assert contacts(cloth).places["place"].tolist() == cloth.chain.pairs[0].tolist()
