"""For notebooks: verdicts, equations, derivations and scenes that show themselves, formulas as formulas.

    from yarnverify.notebook import derive, prove, simulate

    prove()                                  verdict on every equation of the paper's document; prove("my_model") of your own
    prove()["18"]                            one equation: as printed, as corrected, what differs marked
    derive("bending")                        a derivation to follow
    simulate("hanging_yarn", size=10)        a scene beside its known answer, with its picture

What is shown is MathML and plain HTML, and needs neither network nor extension; printed as text it is what the commands print.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from markupsafe import Markup, escape

from yarnverify.errors import InputError, NotRunError
from yarnverify.report.mathml import compared, formula

_COLOUR = {"proved": "#1a7f37", "refuted": "#cf222e", "undecided": "#9a6700", "inconsistent": "#8250df"}
_STYLE = Markup(
    "<style>.yarnverify .was{background:#cf222e33}.yarnverify .now{background:#1a7f3733}"
    ".yarnverify td{text-align:left;vertical-align:top}</style>"
)


def _block(*parts: Markup) -> str:
    return str(Markup('<div class="yarnverify">{}{}</div>').format(_STYLE, Markup("").join(parts)))


def _verdict(name: str) -> Markup:
    return Markup('<b style="color:{}">{}</b>').format(_COLOUR[name], name.upper())


@dataclass(frozen=True)
class Equation:
    """One numbered equation of a document: what it claims, and what was found.

    Attributes
    ----------
    number
        As printed.
    claims
        Its claims, as ``yarnverify prove --json`` writes them.
    """

    number: str
    claims: tuple[Mapping[str, Any], ...]

    @property
    def verdict(self) -> str:
        """The worst verdict of its claims."""
        return max((claim["verdict"] for claim in self.claims), key=list(_COLOUR).index)

    def __repr__(self) -> str:
        blocks = ", ".join(dict.fromkeys(claim["block"] for claim in self.claims))
        return f"({self.number}) {blocks}: {self.verdict.upper()}"

    def _repr_latex_(self) -> str:
        shown = dict.fromkeys(claim["correction"] or claim["printed"] for claim in self.claims)
        return "".join(f"$\\displaystyle {latex} \\quad ({self.number})$\n\n" for latex in shown)

    def _html(self) -> Markup:
        rows: dict[str, Markup] = {}
        for claim in self.claims:
            printed, corrected = formula(claim["printed"]), ""
            if claim["correction"]:
                printed, corrected = compared(claim["printed"], claim["correction"])
            found = Markup(printed)
            if corrected:
                found += Markup("<br>should be: {}").format(Markup(corrected))
            rows.setdefault(claim["printed"], found)
        return Markup("<br>").join(rows.values())

    def _repr_html_(self) -> str:
        return _block(Markup("({}) {} ").format(self.number, _verdict(self.verdict)), self._html())


@dataclass(frozen=True)
class Verdicts:
    """The verdicts on a document; ``verdicts["18"]`` is one equation.

    Attributes
    ----------
    record
        As ``yarnverify prove --json`` writes it.
    """

    record: Mapping[str, Any]

    @property
    def equations(self) -> tuple[Equation, ...]:
        """Every equation that claims something, in printed order."""
        found: dict[str, list[Mapping[str, Any]]] = {}
        for claim in self.record["claims"]:
            found.setdefault(claim["equation"], []).append(claim)
        return tuple(Equation(number, tuple(claims)) for number, claims in found.items())

    def __getitem__(self, number: str | int) -> Equation:
        for equation in self.equations:
            if equation.number == str(number):
                return equation
        there = ", ".join(equation.number for equation in self.equations)
        raise KeyError(f"no equation ({number}) claims anything; there are {there}")

    def __repr__(self) -> str:
        from yarnverify.show import mistake_lines, tally_lines

        return "\n".join([*mistake_lines(dict(self.record)), *tally_lines(dict(self.record))])

    def _repr_html_(self) -> str:
        from yarnverify.show import tally_lines

        rows = [
            Markup("<tr><td>({})</td><td>{}</td><td>{}</td></tr>").format(
                each.number, _verdict(each.verdict), each._html()
            )
            for each in self.equations
        ]
        tally = Markup("<br>").join(escape(line) for line in tally_lines(dict(self.record)))
        return _block(Markup("<p>{}</p><table>{}</table>").format(tally, Markup("").join(rows)))


@dataclass(frozen=True)
class Derived:
    """The derivation of an energy.

    Attributes
    ----------
    record
        Titled steps of formulas, as ``yarnverify derive --json`` writes them.
    """

    record: dict[str, Any]

    def _as(self, form: str) -> str:
        from yarnverify.symbolic.explain import explain

        return explain(self.record, form)

    def __repr__(self) -> str:
        return self._as("text")

    def _repr_latex_(self) -> str:
        formulas = (each["latex"] for step in self.record["steps"] for each in step["formulas"])
        return "\n\n".join(f"$\\displaystyle {latex}$" for latex in formulas)

    def _repr_html_(self) -> str:
        parts = []
        for step in self.record["steps"]:
            lines = [Markup("<p>{}</p>").format(Markup(formula(each["latex"]))) for each in step["formulas"]]
            parts.append(Markup("<h4>{}</h4><p>{}</p>").format(step["title"], step["note"]) + Markup("").join(lines))
        verdict = self._as("text").rpartition("\n")[2]
        return _block(*parts, Markup("<p><b>{}</b></p>").format(verdict))


@dataclass(frozen=True)
class Simulated:
    """A scene beside its known answer.

    Attributes
    ----------
    result, timings
        As ``yarnverify simulate --json`` writes them.
    png
        The picture.
    """

    result: Mapping[str, Any]
    timings: Mapping[str, Any]
    png: bytes

    def __repr__(self) -> str:
        from yarnverify.simulation.show import study_lines

        return "\n".join(study_lines(self.result, self.timings))

    def _repr_png_(self) -> bytes:
        return self.png

    def _repr_html_(self) -> str:
        source = "data:image/png;base64," + b64encode(self.png).decode()
        image = Markup('<img src="{}" alt="{}" style="max-width:100%">').format(source, self.result["title"])
        return _block(image, Markup("<pre>{}</pre>").format(repr(self)))


def prove(document: str | Path | None = None, cache: bool = True) -> Verdicts:
    """A verdict on every printed equation of a document, or of the one in a folder; of the paper's by default.

    Raises
    ------
    InputError
        For what cannot be read.
    """
    from yarnverify.project import document_of
    from yarnverify.verdicts import verdicts

    return Verdicts(verdicts(document_of(None if document is None else Path(document)), cache=cache)[0])


def derive(energy: str) -> Derived:
    """The derivation of an energy by name; of one of your own as ``"FOLDER/NAME"``.

    Raises
    ------
    InputError
        If there is no such energy.
    """
    from yarnverify.project import find
    from yarnverify.symbolic.explain import explanation

    place, name = find(energy)
    if name is None:
        raise InputError(f"{energy}: is a folder; name an energy in it, as {energy}/NAME")
    return Derived(explanation(name, place.folder))


def simulate(scene: str, size: int, **parameters: float | str) -> Simulated:
    """Run a scene at one size and draw it; ``yarnverify simulate`` lists the scenes.

    Raises
    ------
    InputError, NotRunError
        For scenes and parameters that are not there or cannot be, and where nothing can draw.
    """
    from yarnverify.simulation.command import simulate as run

    given = [f"{name}={value}" for name, value in parameters.items()]
    with TemporaryDirectory() as folder:
        found, _ = run(scene, [size], given, None, Path(folder) / "run", False, 1e9, True, lambda *args: None)
        picture = Path(folder) / "run" / f"{found.result['scene']}.png"
        if not picture.is_file():
            raise NotRunError("the picture of a scene needs matplotlib: pip install 'yarnverify[view]'")
        png = picture.read_bytes()
    return Simulated(found.result, found.timings, png)
