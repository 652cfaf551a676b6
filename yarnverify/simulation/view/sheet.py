"""Writing around a picture: title, time, a scale bar, and the legend of what it is coloured by."""

from __future__ import annotations

from textwrap import fill
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.simulation.cloth import Fabric
from yarnverify.simulation.view.camera import Camera
from yarnverify.simulation.view.drawing import FAMILIES, families_of, table_of
from yarnverify.simulation.view.measures import Measure

INK = "#222222"
TOP, BOTTOM, RIGHT = 0.09, 0.10, 0.15  # shares of the picture that are for writing: the body keeps out of them


class Sheet:
    """Writing that stays while the picture under it changes.

    Parameters
    ----------
    size
        Width and height in pixels.
    limits
        The scale of the measure, if there is one.
    """

    def __init__(
        self,
        fabric: Fabric,
        size: tuple[int, int],
        seen: Camera,
        measure: Measure | None = None,
        limits: tuple[float, float] | None = None,
        title: str = "",
    ) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.size = size
        dots = size[1] / 6  # an inch: writing keeps its share of the picture
        self.figure = Figure(figsize=(size[0] / dots, 6), dpi=dots, facecolor="white")
        self.canvas = FigureCanvasAgg(self.figure)
        self.image: Any = None
        self.axes = self.figure.add_axes((0, 0, 1, 1))
        self.axes.set_axis_off()
        self.figure.text(0.03, 0.955, title, fontsize=10, color=INK, va="center")
        self.note = self.figure.text(0.97, 0.955, "", fontsize=9, color=INK, va="center", ha="right")
        self._scale_bar(seen)
        if measure is None:
            self._families(fabric)
        else:
            self._colour_bar(fabric, measure, limits or measure.limits)

    def compose(self, picture: NDArray[np.uint8], note: str = "") -> NDArray[np.uint8]:
        """The picture with its writing, (height, width, 3)."""
        if self.image is None:
            self.axes.set_xlim(0, self.size[0])
            self.axes.set_ylim(0, self.size[1])
            extent = (0, self.size[0], 0, self.size[1])
            self.image = self.axes.imshow(picture, extent=extent, interpolation="nearest", aspect="auto")
        else:
            self.image.set_data(picture)
        self.note.set_text(note)
        self.canvas.draw()
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()

    def _scale_bar(self, seen: Camera) -> None:
        from matplotlib.lines import Line2D

        across = seen.height * self.size[0] / self.size[1]  # m
        length = _round_below(0.22 * across)
        share = length / across
        left, low = 0.03, 0.05
        bar = Line2D([left, left + share], [low, low], color=INK, linewidth=2, solid_capstyle="butt",
                     transform=self.figure.transFigure)  # fmt: skip
        self.figure.add_artist(bar)
        self.figure.text(
            left + share / 2, low + 0.012, _length(length), fontsize=8, color=INK, ha="center", va="bottom"
        )

    def _colour_bar(self, fabric: Fabric, measure: Measure, limits: tuple[float, float]) -> None:
        from matplotlib.ticker import MaxNLocator

        low, high = limits
        if not high > low:
            high, low = (high + 1.0, low - 1.0 if measure.signed else low)
        bar = self.figure.add_axes((0.885, 0.25, 0.018, 0.5))
        column = np.linspace(0, 255, 256).astype(int)
        bar.imshow(table_of(measure.signed)[column][:, None], aspect="auto", origin="lower", extent=(0, 1, low, high))
        bar.set_xticks([])
        bar.yaxis.tick_right()
        bar.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
        bar.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4), useMathText=True)
        bar.yaxis.get_offset_text().set_fontsize(7)
        bar.tick_params(labelsize=7, width=0.5, length=2.5, colors=INK)
        for spine in bar.spines.values():
            spine.set_linewidth(0.5)
        if measure.lacking(fabric):
            self.figure.text(0.894, 0.2, "grey: none", fontsize=7, color=INK, ha="center")
        label = fill(measure.name, 16) + (f"\n({measure.unit})" if measure.unit else "")
        self.figure.text(0.915, 0.79, label, fontsize=8, color=INK, ha="center", va="bottom", linespacing=1.3)

    def _families(self, fabric: Fabric) -> None:
        from matplotlib.patches import Rectangle

        for row, name in enumerate(families_of(fabric)):
            y = 0.54 - 0.05 * row
            colour = tuple(c / 255 for c in FAMILIES[name])
            self.figure.add_artist(
                Rectangle((0.88, y), 0.018, 0.024, facecolor=colour, transform=self.figure.transFigure)
            )
            self.figure.text(0.905, y + 0.011, name, fontsize=8, color=INK, va="center")


def _round_below(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not greater."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * max(step for step in (1, 2, 5) if step * power <= length * (1 + 1e-12)))


def _length(length: float) -> str:
    """A length with a unit that suits it: 2 mm, 5 cm, 50 µm."""
    for unit, size in (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("µm", 1e-6)):
        if length >= size * (1 - 1e-9):
            return f"{length / size:.3g} {unit}"
    return f"{length:.3g} m"
