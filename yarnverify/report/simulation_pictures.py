"""The picture of the simulation's speed: an iteration over the size of the cloth, part by part."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from yarnverify.report.simulation_speed import PARTS, SOLVERS

_LINES = {
    "kernels": ("#0072b2", "o", "-"),
    "assembly": ("#009e73", "s", (0, (5, 1.5))),
    "factorise": ("#d55e00", "^", "-"),
    "solve": ("#cc79a7", "v", (0, (1, 1))),
    "rest": ("0.5", "D", (0, (3, 1, 1, 1))),
}


def iteration(record: dict[str, Any]) -> Figure:
    """Seconds of an iteration by part over the number of crossings, for each solver."""
    shown = [name for name in SOLVERS if name in record["cloth"]]
    figure = Figure(figsize=(4.6 * len(shown), 3.6), layout="constrained")
    panels = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for axes, name in zip(panels, shown, strict=True):
        _panel(axes, record["cloth"][name], SOLVERS[name])
    panels[0].set_ylabel("processor time of an iteration, s")
    return figure


def _panel(axes: Axes, found: list[dict[str, Any]], title: str) -> None:
    size = [line["crossings"] for line in found]
    whole = [line["seconds"]["iteration"] for line in found]
    axes.loglog(size, whole, color="black", linewidth=1.8, label="iteration")
    for part in PARTS:
        colour, marker, dashes = _LINES[part]
        at = [(n, line["seconds"][part]) for n, line in zip(size, found, strict=True) if line["seconds"][part] > 0]
        axes.loglog(
            *zip(*at, strict=True),
            color=colour,
            marker=marker,
            markersize=4,
            linestyle=dashes,
            linewidth=1.2,
            label=part,
        )
    start = whole[-1] / size[-1]
    axes.loglog(size, [start * n for n in size], color="0.75", linewidth=0.8, zorder=0)
    axes.annotate("n", (size[0], start * size[0]), color="0.5", textcoords="offset points", xytext=(-2, 4), ha="right")
    axes.set_title(title)
    axes.set_xlabel("crossings, three unknowns each")
    axes.legend(frameon=False, fontsize=7)


PICTURES = {"simulation-speed": iteration}
