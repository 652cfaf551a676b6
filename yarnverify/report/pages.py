"""The Markdown pages of a report, from its records."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from yarnverify.report.accuracy import accuracy_table, kinds
from yarnverify.report.analysis import analysis_tables, fabric_line
from yarnverify.report.benchmark import benchmark_table, where
from yarnverify.report.proof import proof_of
from yarnverify.report.simulation import frugality, studies, summary
from yarnverify.report.simulation_speed import speed_tables

_TEMPLATES = Environment(
    loader=FileSystemLoader(Path(__file__).parent / "templates"),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)


def pages(
    records: dict[str, Any], pictures: Sequence[str] = (), source: str = "../derivations", name: str = ""
) -> dict[str, str]:
    """File name to text: an index, and a page an energy.

    Parameters
    ----------
    records
        ``verdicts``, ``derivations`` and ``kernels``, as written to ``records/``;
        ``accuracy``, ``benchmark``, ``analysis``, ``simulation``, ``simulation-speed`` and ``tutorial`` where run.
    pictures
        Names of the pictures that are in ``pictures/``.
    source
        The folder with the document, as seen from the pages.
    name
        What the command line calls that folder; empty for the one that comes with the package.
    """
    place = {"source": source, "argument": f" {name}" if name else "", "prefix": f"{name}/" if name else ""}
    found, derived = records["verdicts"], records["derivations"]
    texts = {
        "README.md": _render(
            "index.md.jinja",
            found=found,
            derived=derived,
            rows=_rows(found, ""),
            mistakes=mistakes(found, None),
            place=place,
            analysed=records.get("analysis") is not None,
            simulated=records.get("simulation") is not None,
            timed=records.get("simulation-speed") is not None,
            taught=records.get("tutorial") is not None,
        )
    }
    for energy, derivation in derived.items():
        section = derivation["section"]
        texts[f"{energy}.md"] = _render(
            "energy.md.jinja",
            name=energy,
            section=section,
            found=found,
            derivation=derivation,
            proof=proof_of(derivation),
            rows=_rows(found, section),
            mistakes=mistakes(found, section) if section else [],
            completeness=next((part for part in found["completeness"] if part["section"] == section), None),
            kernels=records["kernels"].get(energy, {}),
            accuracy=_accuracy(records.get("accuracy"), energy),
            benchmark=_benchmark(records.get("benchmark"), energy),
            pictures=pictures,
            place=place,
        )
    analysis = records.get("analysis")
    if analysis is not None:
        texts["analysis.md"] = _render(
            "analysis.md.jinja",
            tables=analysis_tables(analysis),
            fabric=fabric_line(analysis),
            command=analysis["command"],
            pictures=pictures,
        )
    simulation = records.get("simulation")
    if simulation is not None:
        texts["simulation.md"] = _render(
            "simulation.md.jinja",
            record=simulation,
            where=where(simulation),
            summary=summary(simulation),
            frugality=frugality(simulation),
            studies={each["result"]["scene"]: studies(each) for each in simulation["scenes"]},
            pictures=pictures,
        )
    speed = records.get("simulation-speed")
    if speed is not None:
        texts["simulation-speed.md"] = _render(
            "simulation_speed.md.jinja",
            tables=speed_tables(speed),
            where=where(speed),
            rounds=speed["rounds"],
            command=speed["command"],
            pictures=pictures,
        )
    if "reference" in records:
        texts["reference.md"] = _render("reference.md.jinja", modules=records["reference"]["modules"])
    if records.get("tutorial") is not None:
        texts["tutorial.md"] = tutorial_page(records["tutorial"])
    return dict(sorted(texts.items()))


def tutorial_page(record: dict[str, Any]) -> str:
    """The tutorial with what its commands and examples printed."""
    return _render("tutorial.md.jinja", parts=record["parts"])


def _accuracy(record: dict[str, Any] | None, energy: str) -> list[str]:
    """The tables of an energy; empty where the sweep was not run."""
    if record is None:
        return []
    return [accuracy_table(record, energy, kind) for kind in kinds(record, energy)]


def _benchmark(record: dict[str, Any] | None, energy: str) -> str:
    return "" if record is None or energy not in record["energies"] else benchmark_table(record, energy)


def _render(template: str, **values: Any) -> str:
    return _TEMPLATES.get_template(template).render(**values)


def _rows(found: dict[str, Any], section: str) -> list[dict[str, Any]]:
    """A row for each equation of a section and verdict."""
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for claim in found["claims"]:
        if claim["section"] != section:
            continue
        row = rows.setdefault((claim["equation"], claim["verdict"]), {**claim, "blocks": []})
        if claim["block"] not in row["blocks"]:
            row["blocks"].append(claim["block"])
    return list(rows.values())


def mistakes(found: dict[str, Any], section: str | None) -> list[dict[str, Any]]:
    """What is not proved, in a section or anywhere: one entry for each equation and reason."""
    groups: dict[tuple[str, str], dict[str, Any]] = {}
    for claim in found["claims"]:
        if claim["verdict"] == "proved" or (section is not None and claim["section"] != section):
            continue
        group = groups.setdefault((claim["equation"], claim["reason"]), {**claim, "blocks": []})
        group["blocks"].append(claim["block"])
    for group in groups.values():
        if group["witness"]:
            sizes = [abs(float(value)) for value in group["witness"]["residual"]]
            group["worst"] = sizes.index(max(sizes)) if sizes else None
    return list(groups.values())
