"""Other conventions under which an implementation would be right: the other sign, another order, another stiffness."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from yarnverify.accuracy.shape import shape_of
from yarnverify.check.cases import Cases
from yarnverify.check.conventions import Convention, Results, Row, decoded
from yarnverify.check.factors import number_text
from yarnverify.check.judge import Block
from yarnverify.check.recognise import Diagnosis
from yarnverify.check.siblings import triangle
from yarnverify.check.sources import Again

Array = NDArray[Any]
Found = Sequence[tuple[Block, Diagnosis]]
_TRIED = 6  # states that an order is tried at
_ARGUMENTS = 4  # that are tried in every order


def sign_hints(found: Found, convention: Convention, fails: Callable[[Convention], int]) -> list[str]:
    """``--force`` or ``--jacobian``, where every block whose sign can be told has the other one; else which has which.

    Parameters
    ----------
    found, convention
        What was found under a convention.
    fails
        How many blocks fail under another.
    """
    flags, texts, turned = [], [], []
    for kind, flag, taken, words in (
        ("G", "--force", convention.force, ("gradient", "force")),
        ("H", "--jacobian", convention.jacobian, ("Hessian", "Jacobian of the force")),
    ):
        mine = [output for output in convention.outputs if output.kind == kind]
        signs = [(block.name, diagnosis.sign) for block, diagnosis in found if block.kind == kind and _live(block)]
        right = [name for name, sign in signs if sign > 0]
        opposite = [name for name, sign in signs if sign < 0]
        if opposite and not right:
            flags.append(_flag(flag, taken, [output.name for output in mine if output.whole]))
            turned.append(kind)
        elif opposite and 2 * len(opposite) >= len(right):
            forces = taken or any(output.sign < 0 for output in mine)
            one, other = words[::-1] if forces else words
            texts.append(
                f"signs differ from block to block, so that none fits all: {_names(right)} {_have(right)} the sign of the "
                f"{one}, {_names(opposite)} {_have(opposite)} that of the {other}"
            )
    if not flags:
        return texts
    outputs = tuple(replace(o, sign=-o.sign) if o.kind in turned else o for o in convention.outputs)
    left = fails(replace(convention, outputs=outputs))
    matches = f"matches with {' '.join(flags)}"
    if left:
        fail = "block fails" if left == 1 else "blocks fail"
        matches = f"the signs are right with {' '.join(flags)}; {left} {fail} then, of {len(found)}, for other reasons"
    return [matches, *texts]


def _names(names: list[str]) -> str:
    return " ".join(names) if len(names) <= 9 else f"{len(names)} blocks"


def _have(names: list[str]) -> str:
    return "has" if len(names) == 1 else "have"


def _live(block: Block) -> bool:
    return bool(np.any(block.true[:, block.judged]))


def _flag(flag: str, taken: bool, named: list[str]) -> str:
    if taken:
        return f"no {flag}"
    if any(name in ("force", "jacobian") for name in named):
        return f"--returns {'gradient' if flag == '--force' else 'hessian'} (it is not {named[0]})"
    return flag


def factor_hints(found: Found, cases: Cases) -> list[str]:
    """Another meaning of the stiffness, where everything is off by the same factor."""
    wrong = [(block, diagnosis) for block, diagnosis in found if diagnosis.status == "wrong"]
    if not wrong or any(diagnosis.factor is None for _, diagnosis in wrong):
        return []
    kinds = {block.kind for block, _ in wrong}
    right = {
        block.kind for block, diagnosis in found if diagnosis.status != "wrong" and diagnosis.sign and _live(block)
    }
    only = kinds == {"H"} and kinds.isdisjoint(right) and any(block.kind != "H" for block, _ in found)
    if right and not only:
        return []
    texts = {str(diagnosis.factor).lstrip("-") for _, diagnosis in wrong}
    name = next(iter(shape_of(cases.energy).others), None)
    first = wrong[0][1].factor
    if len(texts) != 1 or name is None or first is None or first.is_sign or str(first).lstrip("-") == "1":
        return []
    if first.powers == ((name, -1),) and abs(abs(first.number) - 1) < 1e-5:
        return [f"{name} is not used: matches with --fix {name}=1"]
    if first.powers:
        return []
    size = number_text(abs(first.number), expression=True)
    size = size if size.isalnum() else f"({size})"
    if only:
        text = texts.pop()
        return [
            f"the whole Hessian is {text} times what it should be; if that is a squared time step, call it with a step of 1"
        ]
    return [f"everything is {texts.pop()} times this energy; if your stiffness means that: --with {name}={name}/{size}"]


def argument_hint(convention: Convention, cases: Cases, again: Again, said: Mapping[str, str]) -> list[str]:
    """An order of the arguments under which the results are right.

    Parameters
    ----------
    convention, cases
        As they were tried.
    again
        The implementation.
    said
        What each argument is, by name, as a person said it.
    """
    names = list(again.positions)
    at = np.flatnonzero(cases.of_regime("moderate"))[:_TRIED]
    others = list(permutations(names))[1:] if len(names) <= _ARGUMENTS else []
    if not at.size or not others:
        return []
    many = np.tile(at, len(others))
    passed = {name: np.concatenate([again.positions[order[i]][at] for order in others]) for i, name in enumerate(names)}
    flat = again.run(again.states[many], many, passed)
    for number, order in enumerate(others if flat is not None else ()):
        assert flat is not None
        results = decoded(flat[number * at.size : (number + 1) * at.size], convention, cases.dof)
        signs = _signs(results, cases, at, every=False)
        if signs:
            words = " ".join(f"--with {name}={said.get(name, name)}" for name in order)
            better = "matches" if signs == _signs(results, cases, at) else "more is right"
            return [f"{better} with the arguments in another order: {words}{_flags(signs, convention)}"]
    return []


def triangle_hints(results: Results, convention: Convention, cases: Cases, plain: Array) -> list[str]:
    """What was done to the whole Hessian, in the order in which the implementation has it."""
    rows = [row.index for row in convention.rows if row.index is not None]
    if not results.given["H"].all() or len(rows) != cases.dof:
        return []
    mine = np.ix_(rows, rows)
    text = triangle(results.hessian[mine][..., plain], cases.truth.hessian[mine][..., plain], 1e-4)
    return [text] if text else []


def stray_hints(found: Found, stray: Mapping[str, Array], plain: Array) -> list[str]:
    """Numbers that came in the row or column of a coordinate that the energy does not have."""
    texts, left = [], dict(stray)
    for block, _ in found:
        if block.kind != "H" or block.computed.shape[0] != 1 or block.computed.any():
            continue
        for label, values in left.items():
            at = plain & block.judged & np.isfinite(values) & (block.true[0] != 0)
            if at.any() and np.abs(values[at] / block.true[0, at] - 1).max() < 1e-3:
                texts.append(f"the Hessian {block.name.replace(',', ', ')} came in the place of {label}")
                del left[label]
                break
    return texts


def orders(convention: Convention, cases: Cases) -> list[tuple[str, tuple[Row, ...]]]:
    """Other orders of the unknowns, and their text for ``--order``."""
    points = [label for label, rows in cases.labels if rows.stop - rows.start == 3]
    scalars = [label for label, rows in cases.labels if rows.stop - rows.start == 1]
    by_name = {row.label: row for row in convention.rows}
    now = tuple(row.label for row in convention.rows)
    found: dict[tuple[str, ...], str] = {}

    def add(labels: Sequence[str]) -> None:
        single = [
            part for label in labels for part in ([f"{label}.{axis}" for axis in "xyz"] if label in points else [label])
        ]
        found.setdefault(tuple(single), ",".join(labels))

    for p in permutations(points):
        for s in permutations(scalars):
            add([*p, *s])
            add([*s, *p])
            if len(p) == len(s):
                add([label for pair in zip(p, s, strict=True) for label in pair])
            add([*(f"{point}.{axis}" for axis in "xyz" for point in p), *s])
    return [(text, tuple(by_name[label] for label in labels)) for labels, text in found.items() if labels != now]


def order_hint(convention: Convention, cases: Cases, again: Again) -> list[str]:
    """An order of the unknowns under which the results are right.

    Parameters
    ----------
    convention, cases
        As they were tried.
    again
        The implementation; if it takes its unknowns by name, the hint is about names.
    """
    if any(row.index is None for row in convention.rows):
        return []
    at = np.flatnonzero(cases.of_regime("moderate"))[:_TRIED]
    candidates = [("", convention.rows), *orders(convention, cases)]
    if not at.size or len(candidates) == 1:
        return []
    places = [[row.index for row in rows if row.index is not None] for _, rows in candidates]
    states = np.vstack([cases.points.q[place][:, at].T for place in places])
    flat = again.run(states, np.tile(at, len(candidates)), {})
    if flat is None:
        return []
    for number, (text, rows) in enumerate(candidates):
        part = flat[number * at.size : (number + 1) * at.size]
        results = decoded(part, replace(convention, rows=rows), cases.dof)
        signs = _signs(results, cases, at)
        if signs and not text:  # all is right here as it is: what is wrong elsewhere is not the order
            return []
        if signs:
            flags = _flags(signs, convention)
            if again.by_name:
                pairs = [
                    (old.label, new.label)
                    for old, new in zip(convention.rows, rows, strict=True)
                    if old.label != new.label
                ]
                named = dict.fromkeys((old.split(".")[0], new.split(".")[0]) for old, new in pairs)
                renamed = " ".join(f"--with {old}={new}" for old, new in named)
                return [f"matches with other names: --order {text} {renamed}{flags}"]
            return [f"matches with --order {text}{flags}"]
    return []


def _flags(signs: dict[str, int], convention: Convention) -> str:
    words = []
    for kind, flag, taken in (("G", "--force", convention.force), ("H", "--jacobian", convention.jacobian)):
        if signs.get(kind) == -1:
            named = [output.name for output in convention.outputs if output.kind == kind and output.whole]
            words.append(f" {_flag(flag, taken, named)}")
    return "".join(words)


def _signs(results: Results, cases: Cases, at: Array, every: bool = True) -> dict[str, int]:
    """The sign under which each output is right to six digits; empty if one is under neither, and ``every`` one must be."""
    found = {}
    for kind, true in (("E", cases.truth.energy), ("G", cases.truth.gradient), ("H", cases.truth.hessian)):
        given = results.given[kind]
        if not given.any():
            continue
        computed, exact = results.part(kind)[given], true[..., at][given]
        scale = np.sqrt((exact**2).sum(axis=0)) if exact.ndim > 1 else np.abs(exact)
        for sign in (1, -1):
            gap = sign * computed - exact
            if np.all((np.sqrt((gap**2).sum(axis=0)) if gap.ndim > 1 else np.abs(gap)) <= 1e-6 * scale):
                found[kind] = sign
                break
        else:
            if every:
                return {}
    return found
