"""A series for ParaView, written step by step: a .vtp file for each step, and a .pvd file that lists them with their times."""

from __future__ import annotations

import base64
import re
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from yarnverify.errors import InputError
from yarnverify.files import whole
from yarnverify.simulation.cloth import Fabric
from yarnverify.simulation.view.measures import MEASURES, Measure, measure
from yarnverify.simulation.view.strands import strands
from yarnverify.simulation.view.tubes import tubes

_TYPES = {"f4": "Float32", "f8": "Float64", "i1": "Int8", "i4": "Int32", "i8": "Int64"}
Arrays = dict[str, NDArray[np.generic]]


@dataclass
class Series:
    """A series on disk; whole after each step, whenever the run is stopped.

    Attributes
    ----------
    path
        The .pvd file; the steps lie beside it.
    colours
        Names of measures that every step carries.
    surface
        Whether yarns are tubes of their radius, over and under each other. If not, they are straight segments between the
        nodes with the sliding coordinate of each, which takes a hundredth of the space.
    resume
        Whether to go on with the series that is there, rather than to start afresh.
    """

    fabric: Fabric
    path: Path
    colours: Sequence[str] = tuple(MEASURES)
    surface: bool = True
    detail: int = 4
    sides: int = 8
    resume: bool = False
    steps: list[tuple[float, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.path = Path(self.path)
        if self.path.suffix != ".pvd":
            raise InputError(f"{self.path.name}: a series ends in .pvd")
        if self.resume and self.path.exists():
            listed = re.findall(r'timestep="([^"]+)"[^>]* file="([^"]+)"', self.path.read_text(encoding="utf-8"))
            self.steps = [(float(time), name) for time, name in listed]

    def write(self, time: float, Q: ArrayLike, measures: Iterable[Measure] = ()) -> Path:
        """Add a step, and drop those that are not before it: a run that resumes from an earlier state writes them again.

        Parameters
        ----------
        time
            s.
        Q
            Configuration, (size,), m.
        measures
            More of them, such as energies.
        """
        time = float(time)  # a NumPy number is written with its type
        self.steps = [step for step in self.steps if step[0] < time]
        name = f"{self.path.stem}_{len(self.steps):05d}.vtp"
        all_measures = [*(measure(self.fabric, Q, colour) for colour in self.colours), *measures]
        text = self._tubes(Q, all_measures) if self.surface else self._segments(Q, all_measures)
        with whole(self.path.with_name(name)) as part:
            part.write_text(text, encoding="ascii")
        self.steps.append((time, name))
        rows = "\n".join(f'    <DataSet timestep="{t!r}" part="0" file="{file}"/>' for t, file in self.steps)
        with whole(self.path) as part:
            part.write_text(
                f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0">\n  <Collection>\n{rows}\n'
                "  </Collection>\n</VTKFile>\n",
                encoding="utf-8",
            )
        return self.path.with_name(name)

    def _tubes(self, Q: ArrayLike, measures: Iterable[Measure]) -> str:
        line = strands(self.fabric, Q, self.detail)
        made = tubes(line, self.sides)
        points: Arrays = {"Normals": made.normals.astype("<f4")}
        cells: Arrays = {
            "yarn": line.yarn[made.interval].astype("<i4"),
            "family": _families(self.fabric, line.yarn[made.interval]),
        }
        for one in measures:
            values = one.on_samples(line).astype("<f4")
            if one.at == "segments":
                cells[one.label] = values[made.interval]
            else:
                points[one.label] = values[made.sample]
        faces = np.concatenate([made.quads.ravel(), made.caps.ravel()])
        sizes = np.r_[np.full(len(made.quads), 4), np.full(len(made.caps), self.sides)]
        return _vtp(made.points, "Polys", faces, sizes, points, cells)

    def _segments(self, Q: ArrayLike, measures: Iterable[Measure]) -> str:
        chain = self.fabric.chain
        first, second = chain.pairs
        points: Arrays = {
            "sliding coordinate (m)": np.asarray(Q, float)[chain.slides].astype("<f8"),
            "node": chain.nodes.astype("<i4"),
        }
        cells: Arrays = {"yarn": chain.yarn[first].astype("<i4"), "family": _families(self.fabric, chain.yarn[first])}
        for one in measures:
            if one.at == "segments":
                cells[one.label] = one.values[first].astype("<f4")
            else:
                points[one.label] = one.values.astype("<f4")
        ends = np.stack([first, second], 1).ravel()
        nodes = self.fabric.points(Q)[chain.nodes]
        return _vtp(nodes, "Lines", ends, np.full(len(first), 2), points, cells)


def _families(fabric: Fabric, yarn: NDArray[np.int64]) -> NDArray[np.generic]:
    """0 warp, 1 weft, 2 neither."""
    return np.array([("warp", "weft", "yarn").index(y.family) for y in fabric.yarns], "<i1")[yarn]


def _vtp(
    points: NDArray[np.float64],
    kind: str,
    corners: NDArray[np.int64],
    sizes: NDArray[np.int64],
    at_points: Arrays,
    at_cells: Arrays,
) -> str:
    """VTK's XML for polygons or lines."""
    count = dict.fromkeys(("Verts", "Lines", "Strips", "Polys"), 0) | {kind: len(sizes)}
    numbers = " ".join(f'NumberOf{name}="{number}"' for name, number in count.items())
    body = [
        '<PointData Normals="Normals">' if "Normals" in at_points else "<PointData>",
        *(_array(name, values) for name, values in at_points.items()),
        "</PointData>",
        "<CellData>",
        *(_array(name, values) for name, values in at_cells.items()),
        "</CellData>",
        "<Points>",
        _array("Points", points.astype("<f4" if kind == "Polys" else "<f8")),
        "</Points>",
        f"<{kind}>",
        _array("connectivity", corners.astype("<i4")),
        _array("offsets", np.cumsum(sizes).astype("<i4")),
        f"</{kind}>",
    ]
    return "\n".join([
        '<?xml version="1.0"?>',
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkZLibDataCompressor">',
        f'<PolyData><Piece NumberOfPoints="{len(points)}" {numbers}>',
        *body,
        "</Piece></PolyData></VTKFile>\n",
    ])  # fmt: skip


def _array(name: str, values: NDArray[np.generic]) -> str:
    data = np.ascontiguousarray(values).tobytes()
    squeezed = zlib.compress(data, 1)
    header = np.array([1, len(data), 0, len(squeezed)] if data else [0, 0, 0], "<u8").tobytes()  # one block
    text = base64.b64encode(header).decode() + (base64.b64encode(squeezed).decode() if data else "")
    width = values.shape[1] if values.ndim == 2 else 1
    escaped = "".join(c if ord(c) < 128 else f"&#{ord(c)};" for c in name.replace("&", "&amp;").replace('"', "&quot;"))
    kind = _TYPES[values.dtype.str[1:]]
    return f'<DataArray type="{kind}" Name="{escaped}" NumberOfComponents="{width}" format="binary">{text}</DataArray>'
