"""``yarnverify check``: call somebody's implementation, judge every block, say what is wrong."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.regimes import vector_parameters
from yarnverify.check.cases import Cases
from yarnverify.check.conventions import Convention, Results, decoded
from yarnverify.check.hints import argument_hint, factor_hints, order_hint, sign_hints, stray_hints, triangle_hints
from yarnverify.check.judge import Block, judged, narrowed
from yarnverify.check.recognise import Diagnosis, Judge
from yarnverify.check.running import Ran
from yarnverify.check.setting import Options, Setting, energy_of
from yarnverify.check.sources import Again, called, from_files
from yarnverify.errors import InputError

Array = NDArray[Any]
Advance = Callable[[str, int], None]


@dataclass
class Checked:
    """All that was found.

    Attributes
    ----------
    target, cases, convention
        What was checked, on what, and how it was called.
    found
        Each block and what is wrong with it.
    troubles
        What happened at how many states, and the first of them: crashes, exceptions.
    left
        States that were not tried, since too many ended the process.
    extra
        Coordinates that the energy does not have, and the largest result for each, which must be 0.
    invented
        How many states without derivatives came back with some.
    hints, notes
        Conventions that would match; what was taken for granted.
    """

    target: str
    cases: Cases
    convention: Convention
    found: list[tuple[Block, Diagnosis]]
    troubles: list[tuple[str, int, int]] = field(default_factory=list)
    left: int = 0
    extra: dict[str, float] = field(default_factory=dict)
    invented: int = 0
    hints: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def passes(self) -> bool:
        return all(block.passes for block, _ in self.found) and not self.troubles and not any(self.extra.values())


def check(
    target: str | None, options: Options, command: str | None = None, outputs: Path | None = None, kind: str = "json",
    advance: Advance = lambda label, total: None,
) -> Checked:  # fmt: skip
    """Check one implementation.

    Parameters
    ----------
    target
        ``module:function``, ``file.py:function``, a module or file with functions of known names, ``library.so:function``.
    options
        How it is called.
    command, outputs
        Instead of a target: a command line with ``{in}`` and ``{out}``, or a file with results.
    kind
        Of the files of a command: json, npz, mat or csv.

    Raises
    ------
    InputError
        Where the target is not there, or the options do not fit it.
    NotRunError
        Where it could not be run here.
    """
    if sum(given is not None for given in (target, command, outputs)) != 1:
        raise InputError(
            "give one of: a target (mine.py:function, module:function, libmine.so:function), --command, --outputs"
        )
    setting = Setting(energy_of(target or command, options), options)
    values = setting.values()
    q = setting.states(values)
    notes: list[str] = []
    if vector_parameters(setting.cases.energy):
        notes.append("no hard cases: what is hard about a vector is not known, and so all states are moderate")
    run_again = None
    if target is not None:
        ran, convention, run_again = called(target, setting, options, q, values, notes, advance)
    else:
        ran, convention = from_files(command, outputs, kind, setting, options, q, values, notes)
    name = target or command or str(outputs)
    if convention is None:
        return Checked(
            name, setting.cases, setting.convention, [], _troubles(ran, setting.cases), ran.left, notes=notes
        )
    ours = options.derivations is None
    return _judged(name, setting.cases, convention, ran, notes, ours, run_again, setting.given, advance)


def _judged(
    name: str, cases: Cases, convention: Convention, ran: Ran, notes: list[str], ours: bool,
    again: Again | None, said: Mapping[str, str], advance: Advance,
) -> Checked:  # fmt: skip
    results = decoded(ran.flat, convention, cases.dof)
    blocks = judged(results, cases, ran.done)
    judge = Judge(cases, blocks, lambda: printed(cases) if ours else None)
    found = []
    for block in blocks:
        diagnosis = judge.diagnosis(block)
        if diagnosis.status in ("wrong", "approximate"):
            plainest = narrowed(block, cases, judge.plain & ~np.isinf(block.errors))  # shows it best
            block = block if plainest.passes else plainest
        found.append((block, diagnosis))
        advance("judging", len(cases) + len(blocks))
    found = judge.sums(found)
    checked = Checked(name, cases, convention, found, notes=notes, extra={k: v for k, v in results.extra.items() if v})
    checked.left = ran.left
    checked.troubles = _troubles(ran, cases)
    checked.invented = _invented(results, cases, ran)
    if not checked.passes:

        def fails(other: Convention) -> int:
            return sum(not block.passes for block in judged(decoded(ran.flat, other, cases.dof), cases, ran.done))

        checked.hints = sign_hints(found, convention, fails) + factor_hints(found, cases)
        unknown = any(
            (diagnosis.status == "wrong" and (not diagnosis.reasons or diagnosis.reasons[0].endswith("exchanged")))
            or diagnosis.status == "no value"
            for _, diagnosis in found
        )
        nothing = not any(diagnosis.status != "wrong" and block.judged.any() for block, diagnosis in found)
        if again is not None and nothing and not checked.hints:
            checked.hints = argument_hint(convention, cases, again, said)
        if again is not None and unknown and not checked.hints:
            checked.hints = order_hint(convention, cases, again)
        wrong = [(block, diagnosis) for block, diagnosis in found if diagnosis.status == "wrong"]
        laws = [judge.formula.laws.of(block) for block, _ in wrong] if all(d.factor is None for _, d in wrong) else []
        if laws and all(law is not None and law.text.startswith(("takes", "leaves")) for law in laws):
            checked.hints.append(
                "if that law is meant: yarnverify init, declare it there, and check with --energy against it"
            )
        checked.hints += triangle_hints(results, convention, cases, judge.plain & ran.done)
        checked.hints += stray_hints(found, results.stray, judge.plain)
    return checked


def _troubles(ran: Ran, cases: Cases) -> list[tuple[str, int, int]]:
    """What happened, at how many states, and the first of them; refusing a state without value is no trouble."""
    has = cases.valued
    found: dict[str, list[int]] = {}
    for at, text in ran.troubles.items():
        ends = text.startswith(
            ("crashes", "does not come back", "does not end", "ends", "it calls exit", "MemoryError: ")
        )
        if ends or has[at]:
            found.setdefault(text.removeprefix("MemoryError: "), []).append(at)
    return [(text, len(states), states[0]) for text, states in found.items()]


def _invented(results: Results, cases: Cases, ran: Ran) -> int:
    """States without derivatives at which finite ones came back."""
    finite = np.zeros(len(cases), bool)
    for kind in "GH":
        given = results.given[kind]
        if given.any():
            finite |= np.isfinite(results.part(kind)[given]).all(axis=0)
    return int((finite & ran.done & ~cases.truth.has_derivatives).sum())


def printed(cases: Cases) -> dict[str, Array] | None:
    """What the formulas give as the document prints them; None where it prints none."""
    try:
        module = importlib.import_module(f"yarnverify.kernels.printed.{cases.energy.name}")
    except ModuleNotFoundError:
        return None
    _, gradient, hessian = module.evaluate(cases.points.q, **cases.points.parameters, errors="mask")
    return {"G": np.asarray(gradient), "H": np.asarray(hessian)}
