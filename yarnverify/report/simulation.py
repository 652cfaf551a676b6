"""Tables of the simulation record: every scene against its known answer, and what it saves by modelling only what it needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from yarnverify.report.table import Table

WAYS = ("own", "all energies", "all energies, all sliding")
NO_ANSWER = "no answer any more"


def summary(record: Mapping[str, Any]) -> Table:
    """A row an answer: of each scene in its first way, at its largest size."""
    rows = []
    for each in record["scenes"]:
        scene = each["result"]
        line, timed = scene["lines"][0], each["timings"]["lines"][0]
        run, name = line["runs"][-1], scene["scene"]
        size, seconds = f"{run['size']} {scene['size']}", _time(timed["runs"][-1]["seconds"])
        for answer in run["answers"]:
            found = (answer["name"], error_text(answer["error"]), _allowed(answer), _order(answer))
            rows.append((name, size, *found, str(run["iterations"]), seconds))
            name = size = seconds = ""
    headings = ("scene", "size", "answer", "error", "allowed", "order", "iterations or steps", "time")
    return Table("Every scene in its first way, at its largest size", headings, tuple(rows), (
        "Errors are relative; *exact*: no error but rounding at any size; else the order between the two largest sizes, and "
        "what is expected. Times are those of the processor; shown, and compared with nothing.",
    ))  # fmt: skip


def studies(each: Mapping[str, Any]) -> list[Table]:
    """A table for each way to solve a scene."""
    scene, timed = each["result"], each["timings"]["lines"]
    tables = []
    for line, times in zip(scene["lines"], timed, strict=True):
        rows = []
        for run, time in zip(line["runs"], times["runs"], strict=True):
            first = (str(run["size"]), str(run["unknowns"]), str(run["iterations"]), _time(time["seconds"]))
            for answer in run["answers"]:
                value = (_value(answer, "found"), _value(answer, "exact"), error_text(answer["error"]), _order(answer))
                rows.append((*first, answer["name"], *value))
                first = ("", "", "", "")
        headings = (
            scene["size"],
            "unknowns",
            "iterations or steps",
            "time",
            "answer",
            "found",
            "exact",
            "error",
            "order",
        )
        tables.append(Table(f"{scene['scene']}: {line['name']}", headings, tuple(rows)))
    return tables


def frugality(record: Mapping[str, Any]) -> Table | None:
    """Each scene as it is, with all energies, and with all sliding coordinates as well; None where that was not measured."""
    rows = []
    for each in record["scenes"]:
        if "frugality" not in each:
            return None
        scene, found, timed = each["result"], each["frugality"]["result"], each["frugality"]["timings"]
        for way in WAYS:
            own, time, base = found[way], timed[way], timed["own"]
            first = (
                f"{scene['scene']}, {found['size']} {scene['size']}" if way == "own" else "",
                way if way != "own" else "as it is",
            )
            rows.append((
                *first, ", ".join(f"{name} {count}" for name, count in own["energies"].items() if count),
                str(own["unknowns"]), str(own["entries"]), *_spent(own, time, base), _moved(own, way),
            ))  # fmt: skip
    headings = (
        "scene",
        "",
        "energies and their elements",
        "unknowns",
        "entries of the Hessian",
        "time",
        "memory",
        "answers move by",
    )
    return Table("The same scenes with everything switched on", headings, tuple(rows), (
        "Energies that a scene does not name are those of cotton yarn, weight without gravity; walls and other constraints "
        "are the scene's. Time is that of the whole solution, memory that of the system with its factorised Hessian, both as "
        "multiples of the scene as it is; answers move relative to their size.",
        "Where sliding is everywhere and nothing holds it, many a scene has no answer. A yarn that nothing crosses slides "
        "through its nodes: straight, it does so for nothing; bent, two nodes that draw together share a turn, each with the "
        "long segment beside it, for half the energy, and the energy falls until segments have no length. The directions in "
        "which it falls, or stays, are counted at the scene's own answer. Where a second search, from there, found an "
        "equilibrium, answers are compared with it.",
    ))  # fmt: skip


def _spent(own: Mapping[str, Any], time: Mapping[str, Any], base: Mapping[str, Any]) -> tuple[str, str]:
    if time is base:
        return _time(time["seconds"]), f"{time['bytes'] / 1e6:.2g} MB"
    memory = _number(time["bytes"] / base["bytes"], "times")
    if not own["trouble"]:
        return _number(time["seconds"] / base["seconds"], "times"), memory
    each = time["seconds an iteration"], base["seconds an iteration"]
    return (f"{_number(each[0] / each[1], 'times')} an iteration" if all(each) else ""), memory


def _moved(own: Mapping[str, Any], way: str) -> str:
    if way == "own":
        return ""
    most = [_size(move["by"]) for move in own["moved"]]
    moves = ", ".join(f"{move['name']} {size}" for move, size in zip(own["moved"], most, strict=True))
    if len(set(most)) == 1:
        moves = most[0]
    if not own["trouble"]:
        return moves
    if moves:
        return f"{own['trouble']}; from the scene's own answer: {moves}"
    where = (
        f"; of {own['unknowns']} directions {own['falling']} fall and {own['flat']} stay" if "falling" in own else ""
    )
    return f"no answer: {own['trouble']}{where}"


def error_text(value: float | None) -> str:
    """A relative error as tables have it."""
    return "none" if value is None else "0" if value == 0 else f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e")


def _size(by: float | None) -> str:
    return NO_ANSWER if by is None else f"{by:.0e}" if by else "0"


def _allowed(answer: Mapping[str, Any]) -> str:
    return "" if answer["allowed"] is None else f"{answer['allowed']:.0e}"


def _order(answer: Mapping[str, Any]) -> str:
    if answer["expected order"] is None:
        return "exact"
    if answer["order"] is None:
        return ""
    judged = f"{answer['order']:.2f} ({answer['expected order']:g})"
    return judged if answer["order is judged"] else f"{judged}, as yarns stretch"


def _value(answer: Mapping[str, Any], which: str) -> str:
    unit = "" if answer["unit"] in ("", "1") else f" {answer['unit']}"
    return f"{answer[which]:.8g}{unit}"


def _time(seconds: float) -> str:
    return _number(seconds, "s") if seconds >= 1 else _number(1e3 * seconds, "ms")


def _number(value: float, unit: str) -> str:
    """Two digits, but no power of ten."""
    return f"{value:.0f} {unit}" if value >= 10 else f"{value:.1f} {unit}" if value >= 1 else f"{value:.2g} {unit}"
