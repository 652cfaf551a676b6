"""Work-precision diagram of a scene, from its records alone: error against seconds, a line a way, a panel an answer."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from yarnverify.report.marks import mark
from yarnverify.report.pictures import write

LEAST = 1e-17  # relative; an error of zero is drawn here


def write_precision(result: Mapping[str, Any], timings: Mapping[str, Any], path: Path) -> tuple[Path, Path]:
    """Draw and write SVG and PNG.

    Parameters
    ----------
    result, timings
        As ``yarnverify simulate --out`` writes them.
    path
        Without suffix.
    """
    return write(partial(precision, result, timings), path)


def precision(result: Mapping[str, Any], timings: Mapping[str, Any]) -> Figure:
    """Relative error against seconds."""
    answers = list(dict.fromkeys(name for line in result["lines"] for name in _errors(line)))
    figure = Figure(figsize=(0.6 + 3.4 * len(answers), 3.9), layout="constrained")
    panels = figure.subplots(1, len(answers), sharex=True, squeeze=False)[0]
    names = [line["name"] for line in result["lines"]]
    for axes, answer in zip(panels, answers, strict=True):
        for line, timed in zip(result["lines"], timings["lines"], strict=True):
            if answer in _errors(line):
                _line(axes, line, timed, answer, names)
        _dress(axes, result, answer)
    panels[0].set_ylabel("relative error")
    handles, labels = max((axes.get_legend_handles_labels() for axes in panels), key=lambda shown: len(shown[1]))
    labels = [f"{result['compared']}: {label}" for label in labels]
    figure.legend(
        handles, labels, loc="outside upper center", ncols=min(4, len(labels), 2 * len(answers)), frameon=False
    )
    room = "\n" if len(answers) == 1 else " "
    figure.supxlabel(f"seconds of processor time;{room}numbers beside the marks are {result['size']}", fontsize=8)
    return figure


def _errors(line: Mapping[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """What a way found for each answer, size by size."""
    found: dict[str, list[dict[str, Any]]] = {}
    for run in line["runs"]:
        for answer in run["answers"]:
            found.setdefault(answer["name"], []).append(answer)
    return found


def _line(axes: Axes, line: Mapping[str, Any], timed: Mapping[str, Any], answer: str, names: list[str]) -> None:
    seconds = [run["seconds"] for run in timed["runs"]]
    errors = [max(found["error"], LEAST) for found in _errors(line)[answer]]
    style = mark(line["name"], names)
    axes.plot(
        seconds, errors, color=style.colour, linestyle=style.line, marker=style.marker, markersize=5, linewidth=1.1,
        markerfacecolor="white", label=line["name"],
    )  # fmt: skip
    for run, x, y in zip(line["runs"], seconds, errors, strict=True):
        axes.annotate(
            str(run["size"]), (x, y), xytext=(4, 4), textcoords="offset points", fontsize=6, color=style.colour
        )


def _dress(axes: Axes, result: Mapping[str, Any], answer: str) -> None:
    axes.set_title(answer, fontsize=8)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(x=0.12)
    runs = [found for line in result["lines"] for found in _errors(line).get(answer, [])]
    first = next(line for line in result["lines"] if answer in _errors(line))
    known = [found["allowed"] for found in _errors(first)[answer] if found["allowed"] is not None]
    if known:
        axes.axhline(max(known), color="0.4", linewidth=0.7, linestyle=(0, (1, 3)))
        axes.annotate("allowed", (1, max(known)), xycoords=("axes fraction", "data"), xytext=(-2, 2),
                      textcoords="offset points", ha="right", fontsize=6, color="0.3")  # fmt: skip
    heights = [max(found["error"], LEAST) for found in runs] + known
    axes.set_ylim(min(heights) / 4, max(heights) * 6)
    axes.yaxis.set_major_locator(LogLocator(numticks=8))
    axes.yaxis.set_minor_formatter(NullFormatter())
    low, high = axes.get_xlim()
    wider = max(1.0, (12 * low / high) ** 0.5)  # a decade at least, so that what takes about as long looks so
    axes.set_xlim(low / wider, high * wider)
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 50 * low else (1,)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, at: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", color="0.92", linewidth=0.5)
