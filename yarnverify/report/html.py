"""The report as one HTML file that needs nothing else: no network, no script, no installed font."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from yarnverify.report.accuracy import VARIANTS, error_table, kinds, worst_state
from yarnverify.report.analysis import analysis_tables, fabric_line
from yarnverify.report.benchmark import tables, where
from yarnverify.report.brief import brief
from yarnverify.report.mathml import compared, formula, widest
from yarnverify.report.pages import mistakes
from yarnverify.report.proof import proof_of
from yarnverify.report.scenes import scenes
from yarnverify.report.simulation import frugality, summary
from yarnverify.report.simulation_speed import speed_tables
from yarnverify.report.svg import inline
from yarnverify.report.tally import anchor_of, counted

_FOLDER = Path(__file__).parent
_ORDER = ("refuted", "inconsistent", "undecided", "proved")
_PHONE = 18  # letters of a formula that a telephone has room for
_SCROLLS = Markup(' tabindex="0" role="group" aria-label="A long formula"')
_COLUMN = 48  # letters of a formula that half the width of a paper has room for
_SIGN = {"proved": "✓", "refuted": "✗", "undecided": "?", "inconsistent": "!"}
_PARTS = ("verdicts", "corrections", "equations", "derivations", "accuracy", "speed", "scenes", "analysis", "commands")


def page(
    records: dict[str, Any],
    pictures: Mapping[str, str],
    name: str = "",
    *,
    gallery: Sequence[Mapping[str, Any]] = (),
    photos: Mapping[str, bytes] | None = None,
    turned: Mapping[str, str] | None = None,
) -> str:
    """The whole report.

    Parameters
    ----------
    records
        As for :func:`yarnverify.report.pages.pages`.
    pictures
        Name without suffix to SVG text, of those that were drawn.
    name
        What the command line calls the folder that it is about; empty for the one that comes with the package.
    gallery
        Results of scenes as ``yarnverify simulate --out`` writes them, shown where the record of simulations lacks them.
    photos, turned
        Name of a scene to its picture as PNG, and to the page that shows it in three dimensions.
    """
    found, derived = records["verdicts"], records["derivations"]
    analysis, simulation = records.get("analysis"), records.get("simulation")
    speed = records.get("simulation-speed")
    shown = scenes(simulation, gallery)
    absent = ("scenes", "analysis") * bool(name) + ("verdicts", "corrections", "equations") * (not found["document"])
    templates = Environment(
        loader=FileSystemLoader(_FOLDER / "templates" / "page"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=True,
    )
    templates.filters["scrolls"] = lambda latex: _SCROLLS if widest(latex) > _PHONE else ""
    templates.filters["math"] = lambda latex: Markup(formula(latex))
    templates.filters["powers"] = _powers
    templates.filters["capitalize_first"] = lambda text: text[:1].upper() + text[1:]
    templates.globals.update(sign=_SIGN, worst_verdict=_worst, where=where)
    templates.globals.update(argument=f" {name}" if name else "", prefix=f"{name}/" if name else "")
    templates.globals["benchmark_command"] = (
        f"yarnverify benchmark{f' {name}' if name else ''} --json {f'{name}/' if name else ''}reports/records/benchmark.json"
    )
    return templates.get_template("report.html.jinja").render(
        parts=[part for part in _PARTS if part not in absent],
        absent=absent,
        style=Markup((_FOLDER / "templates" / "page" / "report.css").read_text(encoding="utf-8")),
        font=b64encode((_FOLDER / "fonts" / "stix-two-math.woff2").read_bytes()).decode(),
        found=found,
        brief=brief(records),
        missing=sum(len(part["missing"]) for part in found["completeness"]),
        variants=VARIANTS,
        hard_cases={case: text for own in derived.values() for case, text in own["hard_cases"].items()},
        refuted=list(dict.fromkeys(claim["equation"] for claim in found["claims"] if claim["verdict"] == "refuted")),
        columns=[each for each in found["tally"] if each in ("proved", "refuted") or found["tally"][each]],
        derived=derived,
        narrow={name: _narrow(derivation) for name, derivation in derived.items()},
        proofs={name: proof_of(derivation) for name, derivation in derived.items()},
        sections=_sections(found),
        counted=counted(found, derived),
        wrong=list(dict.fromkeys(claim["equation"] for claim in found["claims"] if claim["verdict"] != "proved")),
        mistakes=[{**claim, "marked": _marked(claim)} for claim in mistakes(found, None)],
        accuracy=records.get("accuracy"),
        analysis=analysis,
        analysed=analysis_tables(analysis) if analysis else [],
        fabric=fabric_line(analysis) if analysis else "",
        benchmark=records.get("benchmark"),
        simulation=simulation,
        simulation_speed=speed,
        simulation_tables=speed_tables(speed) if speed else [],
        simulation_pictures=[name for name in sorted(pictures) if name.startswith("simulation")],
        scenes=shown,
        scene_links={scene.name: f"scene-{scene.name.replace('_', '-')}" for scene in shown},
        overview=summary(simulation) if simulation else None,
        frugal=frugality(simulation) if simulation else None,
        photos={scene: b64encode(data).decode() for scene, data in (photos or {}).items()},
        turned=turned or {},
        errors={name: _errors(records.get("accuracy"), name) for name in derived},
        hardest={name: _hardest(records.get("accuracy"), name) for name in derived},
        speeds={name: _speeds(records.get("benchmark"), name) for name in derived},
        pictures={name: _drawn(text, name) for name, text in sorted(pictures.items())},
    )


def _powers(text: str) -> Markup:
    """Powers such as 2^-53 and N m^2 in raised figures, *words* in italics."""
    text = re.sub(r"(?<=[\w)])\^(-?\d+(?:\.\d+)?)", lambda m: f"<sup>{m[1].replace('-', '−')}</sup>", str(escape(text)))
    return Markup(re.sub(r"(?<!\S)\*(\w+)\*", r"<em>\1</em>", text))


def _worst(verdicts: list[str]) -> str:
    return next(verdict for verdict in _ORDER if verdict in verdicts)


def _sections(found: dict[str, Any]) -> list[dict[str, Any]]:
    """The equations of each section in printed order: what is printed, and what was claimed and found."""
    sections: dict[str, dict[str, Any]] = {}
    for claim in found["claims"]:
        equations = sections.setdefault(claim["section"], {})
        equation = equations.setdefault(claim["equation"], {"line": claim["line"], "printed": {}, "claims": {}})
        equation["printed"].setdefault(claim["printed"], claim)
        blocks = equation["claims"].setdefault(claim["verdict"], [])
        if claim["block"] not in blocks:
            blocks.append(claim["block"])
    return [
        {
            "name": name,
            "anchor": anchor_of(name),
            "equations": [
                {"number": number, "formulas": [_marked(claim) for claim in own.pop("printed").values()], **own}
                for number, own in equations.items()
            ],
        }
        for name, equations in sections.items()
    ]


def _marked(claim: dict[str, Any]) -> dict[str, Any]:
    """A printed formula and, where it has one, its correction, with marks where they differ."""
    if claim["correction"] and claim["edit"]:
        before, after = compared(claim["printed"], claim["correction"])
    else:
        before = formula(claim["printed"])
        after = formula(claim["correction"]) if claim["correction"] else ""
    return {"printed": Markup(before), "corrected": Markup(after), "edit": claim["edit"], "claim": claim}


def _narrow(derivation: dict[str, Any]) -> bool:
    """Whether the steps of a derivation fit into two columns."""
    return all(widest(formula["latex"]) <= _COLUMN for step in derivation["steps"][1:] for formula in step["formulas"])


def _errors(record: dict[str, Any] | None, energy: str) -> list[Any]:
    return [] if record is None else [error_table(record, energy, kind) for kind in kinds(record, energy)]


def _hardest(record: dict[str, Any] | None, energy: str) -> str | None:
    return None if record is None else worst_state(record, energy, "accurate")


def _speeds(record: dict[str, Any] | None, energy: str) -> list[Any]:
    return tables(record, energy) if record is not None and energy in record["energies"] else []


_ALT = {
    "error": "Error of every variant of {} as its hard states are approached; the table below has the worst.",
    "speed": "Nanoseconds per element against worst error, for every way to compute {}; the tables below have both.",
    "simulation-speed": "Time of a Newton iteration on cloth over the number of crossings, by part; the tables have it.",
    "analysis-stability": "Lowest over largest eigenvalue of each energy's Hessian over angle and stretch: stretch is "
    "indefinite where it is compressed, bending wherever it is bent, shear off the right angle, contact never.",
    "analysis-modes": "Heights of the first four modes of a net, and errors of frequencies over the number of segments.",
    "analysis-moduli": "Modulus of a strip over the direction of the pull: greatest along the yarns, least along the bias.",
}


def _drawn(text: str, name: str) -> Markup:
    energy, _, what = name.rpartition("-")
    if what == "precision":
        alt = (
            f"Relative error over seconds, for every way to solve {energy.replace('_', ' ')}; the table above has both."
        )
        return Markup(inline(text, name, alt))
    alt = _ALT.get(name) or _ALT.get(what, name.replace("-", " ")).format(energy)
    return Markup(inline(text, name, alt))
