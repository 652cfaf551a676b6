"""Pictures from records alone: error against angle, and speed against error.

Both stand without colour: markers, dash patterns and names tell who is who. Results that are not finite, and those without
a correct digit, lie in bands of their own at the top. Files are the same bytes for the same record.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

from yarnverify.report.benchmark import shown_size
from yarnverify.report.marks import NONE_LEFT, front, mark, spaced
from yarnverify.report.names import places

OUTPUTS = {"E": "energy", "G": "gradient", "H": "Hessian"}
_LEAST = 0.1  # units; smaller errors are drawn here
_WRONG, _NOTHING = 2e17, 2e20  # where results without a correct digit, and those without a value, are drawn
_EDGES = (NONE_LEFT, 7e18, 6e21)  # lower edges of both bands, and the top
_TOWARDS = {
    "0": r"angle (rad), towards 0",
    "right angle": r"deviation from the right angle (rad)",
    "pi": r"$\pi$ $-$ angle (rad), towards $\pi$",
    "rest": "distance from rest, relative to the size",
}
_STYLE: dict[str, Any] = {
    "svg.hashsalt": "yarnverify",
    "svg.fonttype": "path",
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "axes.linewidth": 0.6,
    "axes.titlesize": 9,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "hatch.linewidth": 0.4,
}


def write(draw: Callable[[], Figure], path: Path) -> tuple[Path, Path]:
    """Draw a picture and write it as SVG and PNG.

    Parameters
    ----------
    draw
        Makes the figure.
    path
        Without suffix.
    """
    written = path.with_suffix(".svg"), path.with_suffix(".png")
    with matplotlib.rc_context({**matplotlib.rcParamsDefault, **_STYLE}):
        figure = draw()
        figure.savefig(written[0], metadata={"Date": None, "Creator": None})
        figure.savefig(written[1], dpi=200, metadata={"Software": None})
    return written


# -- error against angle ----------------------------------------------------------------------------------------------


def error_against_angle(record: dict[str, Any], energy: str) -> Figure | None:
    """Error of every variant as its hard states are approached; None where the record has no such curves.

    Parameters
    ----------
    record
        As ``yarnverify accuracy`` writes it.
    energy
        Name of an energy.
    """
    curves = {c["towards"]: c for c in record["curves"] if c["energy"] == energy and c["dtype"] == "float64"}
    shown = [towards for towards in _TOWARDS if towards in curves and _matters(towards, curves)]
    if not shown:
        return None
    names = list(dict.fromkeys(name for towards in shown for name in curves[towards]["variants"]))
    figure = Figure(figsize=(2.2 + 2.7 * len(shown), 7.6), layout="constrained")
    grid = figure.subplots(len(OUTPUTS), len(shown), sharey=True, sharex="col", squeeze=False)
    for row, (output, title) in enumerate(OUTPUTS.items()):
        for column, towards in enumerate(shown):
            axes, last = grid[row][column], column == len(shown) - 1
            _bands(axes, described=column == 0)
            _curves(axes, curves[towards], output, names)
            axes.set_xscale("log")
            low, high = min(curves[towards]["distance"]), max(curves[towards]["distance"])
            axes.set_xlim((high * 2, low / 2) if last else (low / 2, high * 2))
            if row == len(OUTPUTS) - 1:
                axes.set_xlabel(_TOWARDS[towards])
            if column == 0:
                axes.set_ylabel(f"{title}: error in units of $2^{{-53}}$")
            if last:
                _names_at_the_end(axes, curves[towards], output, names)
    handles = [_handle(name, names) for name in names]
    handles.append(
        Line2D([], [], color="0.55", linewidth=3, label="conditioning: what one rounding of the inputs costs")
    )
    figure.legend(handles=handles, loc="outside upper center", ncols=min(len(handles), 1 + len(shown)), frameon=False)
    return figure


def _matters(towards: str, curves: dict[str, Any]) -> bool:
    """Whether anything happens there: the condition grows, or there is no other panel."""
    conditions = [value for line in curves[towards]["condition"].values() for value in line if _is_number(value)]
    return towards in ("0", "pi", "rest") or max(conditions, default=0.0) > 1e3


def _curves(axes: Axes, curve: dict[str, Any], output: str, names: Sequence[str]) -> None:
    distance = curve["distance"]
    there = [(d, c) for d, c in zip(distance, curve["condition"][output], strict=True) if _is_number(c) and c > 0]
    if there:
        x, y = zip(*there, strict=True)
        axes.plot(x, [max(_height(value), _LEAST) for value in y], color="0.55", linewidth=3, alpha=0.6, zorder=1)
    for place, name in enumerate(names):
        if name not in curve["variants"]:
            continue
        style = mark(name, names)
        heights = [_height(value) for value in curve["variants"][name][output]]
        finite = [
            math.nan if value == "inf" else h for value, h in zip(curve["variants"][name][output], heights, strict=True)
        ]
        every = (2 * place % 8, 8)
        axes.plot(
            distance, finite, color=style.colour, linestyle=style.line, linewidth=1.1, marker=style.marker,
            markersize=4, markerfacecolor="white", markevery=every, zorder=3,
        )  # fmt: skip
        lost = [
            (d, h) for d, h, f in zip(distance, heights, finite, strict=True) if math.isnan(f) and not math.isnan(h)
        ]
        if lost:
            shift = 2.2 ** (place - (len(names) - 1) / 2)
            x, y = zip(*(lost[place % 3 :: 3] or lost), strict=True)
            axes.plot(
                x, [h * shift for h in y], color=style.colour, linestyle="none", marker=style.marker,
                markersize=3.5, markerfacecolor="white", markeredgewidth=0.8, zorder=3,
            )  # fmt: skip


def _names_at_the_end(axes: Axes, curve: dict[str, Any], output: str, names: Sequence[str]) -> None:
    """Names beside the last panel, each at the height where its line ends, moved apart where they would overlap."""
    ends = {}
    for name in names:
        values = [value for value in curve["variants"].get(name, {}).get(output, []) if value is not None]
        if values:
            ends[name] = math.log10(_height(values[-1]))
    places = spaced(list(ends.values()), 1.15, math.log10(_LEAST), math.log10(_EDGES[2]))
    edge = axes.get_xlim()[1]
    for (name, end), place in zip(ends.items(), places, strict=True):
        axes.annotate(
            name, (edge, 10**end), xytext=(edge / 60, 10**place), color="0.1", va="center",
            ha="left", fontsize=7.5, annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": mark(name, names).colour, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip


# -- speed against error ----------------------------------------------------------------------------------------------


def speed_against_error(record: dict[str, Any], energy: str) -> Figure:
    """Time per element against the worst error of energy, gradient and Hessian, on ordinary and on hard states.

    Parameters
    ----------
    record
        As ``yarnverify benchmark`` writes it.
    energy
        Name of an energy.
    """
    found = record["energies"][energy]
    sizes = [entry["n"] for entry in found["states"]["mixed"]]
    size = shown_size(sizes)
    times: dict[str, list[float]] = {}
    for entry in sorted(found["states"]["mixed"], key=lambda entry: entry["n"]):
        if entry["n"] <= size:  # who is too slow for that size is shown at the largest at which it was measured
            times |= {name: ns for name, ns in entry["ns"].items() if name in found["contestants"]}
    easy = [state for state in found["errors"] if state == "mixed"]
    hard = [state for state in found["errors"] if state not in easy]
    names = list(times)
    figure = Figure(figsize=(10, 5.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, states, title in ((left, easy, "ordinary states"), (right, hard, "hard states, the worst of")):
        _bands(axes, described=axes is left)
        axes.set_xscale("log")
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, at: f"{value:g}"))
        axes.set_title(f"{title}\n{', '.join(states)}", fontsize=8)
        axes.set_xlabel(f"ns per element for energy, gradient and Hessian; {size} elements")
    low, high = min(t[1] for t in times.values()) / 2.5, max(t[2] for t in times.values()) * 1.8
    left.set_xlim(low, high)
    left.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 200 * low else (1,)))
    left.set_ylabel("worst error in units of $2^{-53}$")
    front_is = "filled and named, dashed line: the Pareto front; italic: what else people use"
    figure.suptitle(f"{energy}: speed against error ({front_is})", fontsize=9)
    _key(figure, names, found["contestants"])
    figure.draw_without_rendering()  # settles the layout, so that names can be placed in points
    for axes, states in ((left, easy), (right, hard)):
        _scatter(axes, times, {name: _worst(found["errors"], states, name) for name in names})
    return figure


def _worst(errors: dict[str, Any], states: Sequence[str], name: str) -> float | str:
    values = [value for state in states for value in errors[state][name].values()]
    return "inf" if None in values else max(values, default=0.0)


def _scatter(axes: Axes, times: dict[str, list[float]], errors: dict[str, float | str]) -> None:
    names = list(times)
    spots = {name: (times[name][0], _height(errors[name])) for name in names}
    for band in (_WRONG, _NOTHING):  # heights in a band mean nothing; neighbours take different ones
        inside = sorted((name for name in names if spots[name][1] == band), key=lambda name: times[name])
        spots |= {name: (times[name][0], band * 10.0 ** (0.75 * (1 - k % 3))) for k, name in enumerate(inside)}
    best = front({name: (times[name][0], math.inf if errors[name] == "inf" else float(errors[name])) for name in names})
    stairs = [spots[name] for name in best]
    corners = [(stairs[0][0], _EDGES[2])]
    for x, y in stairs:
        corners += [(x, corners[-1][1]), (x, y)]
    corners.append((axes.get_xlim()[1], stairs[-1][1]))
    axes.plot(*zip(*corners, strict=True), color="0.5", linewidth=1, linestyle=(0, (6, 2)), zorder=1)
    lines = [*pairwise(corners)]
    for name, (x, y) in spots.items():
        style = mark(name, names)
        axes.plot(times[name][1:], [y, y], color=style.colour, linewidth=0.8, alpha=0.5, zorder=2)
        lines.append(((times[name][1], y), (times[name][2], y)))
        axes.plot(
            x, y, marker=style.marker, color=style.colour, markersize=7, linestyle="none", zorder=3 + (name not in best),
            markerfacecolor=style.colour if name in best else "none",  # so that no spot hides another
        )  # fmt: skip
    _names_beside(axes, best, spots, lines)


def _names_beside(
    axes: Axes,
    named: Sequence[str],
    spots: dict[str, tuple[float, float]],
    lines: Sequence[tuple[tuple[float, float], tuple[float, float]]],
) -> None:
    """The names of some spots, with a leader where they cannot be near; the others are in the legend alone."""
    scale = 72 / axes.figure.dpi

    def in_points(spot: tuple[float, float]) -> tuple[float, float]:
        x, y = axes.transData.transform(spot) * scale
        return float(x), float(y)

    (left, bottom), (right, top) = axes.transAxes.transform([(0, 0), (1, 1)]) * scale
    ends = [(in_points(a), in_points(b)) for a, b in lines]
    there = {name: in_points(spot) for name, spot in spots.items()}
    lead = {"arrowstyle": "-", "color": "0.4", "linewidth": 0.5, "shrinkA": 0, "shrinkB": 2}
    for name, (shift, led) in places(named, there, ends, (left, bottom, right, top)).items():
        axes.annotate(
            name, spots[name], xytext=shift, textcoords="offset points", ha="center", va="center",
            fontsize=7.5, fontweight="bold", arrowprops=lead if led else None,
        )  # fmt: skip


def _key(figure: Figure, names: Sequence[str], contestants: dict[str, Any]) -> None:
    """The marks and names of all, below the panels; italic is what else people use."""
    spots = [
        Line2D([], [], color=(own := mark(name, names)).colour, marker=own.marker, linestyle="none", markersize=7,
               markerfacecolor="none", label=name)
        for name in names
    ]  # fmt: skip
    legend = figure.legend(handles=spots, loc="outside lower center", ncols=math.ceil(len(spots) / 2), frameon=False)
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_fontstyle("italic" if contestants[name]["kind"] == "peer" else "normal")


# -- what both share --------------------------------------------------------------------------------------------------


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)


def _height(value: float | str | None) -> float:
    """Where an error is drawn; NaN where there is nothing to draw."""
    if value is None:
        return math.nan
    if value == "inf":
        return _NOTHING
    return _WRONG if float(value) >= NONE_LEFT else max(float(value), _LEAST)


def _bands(axes: Axes, described: bool) -> None:
    axes.set_yscale("log")
    axes.set_ylim(_LEAST / 2, _EDGES[2])
    axes.axhspan(_EDGES[0], _EDGES[1], facecolor="0.93", edgecolor="none", zorder=0)
    axes.axhspan(_EDGES[1], _EDGES[2], facecolor="0.85", edgecolor="0.7", hatch="////", linewidth=0, zorder=0)
    decades = [10.0**k for k in range(0, 16, 3)]
    axes.yaxis.set_major_locator(FixedLocator([*decades, _WRONG, _NOTHING]))
    axes.yaxis.set_minor_locator(NullLocator())
    texts = {_WRONG: "no digit", _NOTHING: "no value"}
    axes.yaxis.set_major_formatter(
        FuncFormatter(lambda value, at: texts.get(value) or f"$10^{{{round(math.log10(value))}}}$")
    )
    for height in decades:
        axes.axhline(height, color="0.9", linewidth=0.5, zorder=0)
    axes.axhline(16, color="black", linewidth=0.6, linestyle=(0, (1, 3)), zorder=1)
    if described:
        axes.annotate("target 16", (0, 16), xycoords=("axes fraction", "data"), xytext=(-3, 0), textcoords="offset points",
                      ha="right", va="center", fontsize=6)  # fmt: skip


def _handle(name: str, names: Sequence[str]) -> Line2D:
    style = mark(name, names)
    return Line2D([], [], color=style.colour, linestyle=style.line, marker=style.marker, markersize=4.5,
                  markerfacecolor="white", linewidth=1.1, label=name)  # fmt: skip
