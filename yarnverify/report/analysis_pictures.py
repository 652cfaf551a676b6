"""Pictures of the analysis record: where Hessians are indefinite, modes and their errors, moduli over the direction."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

_LEVELS = (-1.0, -0.8, -0.6, -0.4, -0.2, -0.1, -0.05, -0.02, 0.0)
_COLOURS = ("#3f007d", "#54278f", "#6a51a3", "#807dba", "#9e9ac8", "#bcbddc", "#dadaeb", "#efedf5")
_STABLE = "#fcfbfd"
_BLUE, _ORANGE = "#0072b2", "#d55e00"


def stability(record: dict[str, Any]) -> Figure:
    """Lowest over largest eigenvalue of each energy's Hessian, over angle and stretch."""
    found = record["energies"]
    figure = Figure(figsize=(10, 6.2), layout="constrained")
    grid = figure.subplots(2, 3)
    _line(grid[0][0], found["stretch"], "stretch")
    _line(grid[1][0], found["parallel_contact"], "parallel contact")
    drawn: Any = None
    for column, name in ((1, "bending"), (2, "shear")):
        own = found[name]
        drawn = _map(grid[0][column], own, own["free"], f"{name}, all unknowns")
    drawn = _map(grid[1][1], found["bending"], found["bending"]["held"], "bending, sliding held")
    _cut(grid[1][2], found)
    bar = figure.colorbar(drawn, ax=list(grid[:, 1:].ravel()), ticks=_LEVELS, shrink=0.9)
    bar.set_label("lowest eigenvalue over the largest in size")
    figure.suptitle("Where the Hessian of one element is indefinite", fontsize=9)
    return figure


def _line(axes: Axes, own: dict[str, Any], title: str) -> None:
    x = own["stretch"]["values"]
    axes.plot(x, [row[0] for row in own["free"]], color=_BLUE, linewidth=1.4, label="all unknowns")
    if own["held"] is not None:
        axes.plot(
            x,
            [row[0] for row in own["held"]],
            color=_ORANGE,
            linewidth=1.4,
            linestyle=(0, (5, 1.5)),
            label="sliding held",
        )
    axes.axhline(0, color="0.55", linewidth=0.6)
    axes.set(title=title, xlabel=_mathematical(own["stretch"]["name"]), ylim=(-1.05, 0.1))
    axes.set_ylabel("lowest eigenvalue over the largest in size")
    axes.legend(frameon=False, loc="lower right")


def _map(axes: Axes, own: dict[str, Any], values: list[list[float]], title: str) -> Any:
    x, y = own["angle"]["values"], own["stretch"]["values"]
    axes.set_facecolor(_STABLE)
    drawn = axes.contourf(x, y, values, levels=_LEVELS, colors=_COLOURS, extend="neither")
    axes.axhline(1, color="0.1", linewidth=0.6, linestyle=(0, (1, 3)))
    axes.set(title=title, xlabel=own["angle"]["name"], ylabel=_mathematical(own["stretch"]["name"]))
    axes.xaxis.set_major_locator(FixedLocator([x[0], 45, 90, 135, x[-1]]))
    axes.set_xlim(x[0], x[-1])
    return drawn


def _cut(axes: Axes, found: dict[str, Any]) -> None:
    """Bending and shear along the dotted lines of the maps, where nothing is stretched."""
    for name, colour, line in (("bending", _BLUE, "-"), ("shear", _ORANGE, (0, (5, 1.5)))):
        own = found[name]
        lengths = own["stretch"]["values"]
        row = min(range(len(lengths)), key=lambda k: abs(lengths[k] - 1))
        axes.plot(own["angle"]["values"], own["free"][row], color=colour, linestyle=line, linewidth=1.4, label=name)
    axes.axhline(0, color="0.55", linewidth=0.6)
    axes.set(title="along the dotted lines: no stretch", xlabel="angle, degrees", ylim=(-1.05, 0.1))
    axes.xaxis.set_major_locator(FixedLocator([0, 45, 90, 135, 180]))
    axes.set_xlim(0, 180)
    axes.legend(frameon=False, loc="lower center")


def _mathematical(text: str) -> str:
    return text.replace("l/(u_1 - u_0)", "$l/(u_1 - u_0)$")


def vibrations(record: dict[str, Any]) -> Figure:
    """Shapes of the net's modes, and errors of frequencies against the number of segments."""
    own = record["vibrations"]
    figure = Figure(figsize=(10, 3.4), layout="constrained")
    shapes = own["net"]["shapes"]
    frequencies = own["net"]["rows"][1]["found"]
    grid = figure.subplots(1, len(shapes) + 1, width_ratios=[1] * len(shapes) + [1.9])
    for number, (axes, shape) in enumerate(zip(grid, shapes, strict=False)):
        drawn = axes.contourf(shape, levels=[k / 5 for k in range(-5, 6)], cmap="PuOr")
        axes.set_aspect("equal")
        axes.set_xticks([])
        axes.set_yticks([])
        axes.set_title(f"net, mode {number + 1}\n{frequencies[number]:.0f} Hz", fontsize=8)
    figure.colorbar(drawn, ax=list(grid[:-1]), orientation="horizontal", shrink=0.5, label="height, relative")
    axes = grid[-1]
    for name, colour, style, sign in (("yarn", _BLUE, "-", "o"), ("net", _ORANGE, (0, (5, 1.5)), "s")):
        sizes = [row["size"] for row in own[name]["rows"]]
        errors = [row["error"] for row in own[name]["rows"]]
        axes.loglog(sizes, errors, color=colour, linestyle=style, marker=sign, markerfacecolor="white", linewidth=1.2,
                    label=f"{name}: order {own[name]['order']:.2g}")  # fmt: skip
    axes.legend(frameon=False, loc="lower left")
    axes.xaxis.set_major_locator(FixedLocator([5, 10, 20, 40, 80]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticklabels(["5", "10", "20", "40", "80"])
    axes.set(xlim=(5, 100), xlabel="segments", title="error of the four frequencies, relative")
    return figure


def moduli(record: dict[str, Any]) -> Figure:
    """The modulus of a narrow strip over the direction in which it is pulled."""
    own = record["moduli"]
    closed = {row["name"]: row["closed"] for row in own["rows"]}
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    axes = figure.subplots()
    axes.semilogy(own["angle"], own["pulled"], color=_BLUE, linewidth=1.4, label="computed")
    points = {0: "along the weft", 45: "along the bias", 90: "along the warp"}
    axes.plot(list(points), [closed[name] for name in points.values()], linestyle="none", marker="o", markersize=7,
              color=_ORANGE, markerfacecolor="white", label="closed form")  # fmt: skip
    for angle, name in points.items():
        above = angle == 45
        axes.annotate(
            name, (angle, closed[name]), xytext=(0 if above else (8 if angle == 0 else -8), 10 if above else 0),
            textcoords="offset points", ha="center" if above else ("left" if angle == 0 else "right"), va="center",
        )  # fmt: skip
    axes.xaxis.set_major_locator(FixedLocator([0, 15, 30, 45, 60, 75, 90]))
    axes.set(
        xlabel="direction of the pull, degrees from the weft",
        ylabel="modulus, N/m",
        title="Modulus of a strip that is free to narrow",
    )
    axes.legend(frameon=False, loc="upper center")
    return figure


PICTURES = {"analysis-stability": stability, "analysis-modes": vibrations, "analysis-moduli": moduli}
