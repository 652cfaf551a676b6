"""``yarnverify accuracy``: sweep, show, write or compare the record; or replay one state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from yarnverify.accuracy.record import grown, make_record, missed_targets, read_record, record_text
from yarnverify.accuracy.sweep import PROFILES, executor_named, finish, plan, run, state_folder
from yarnverify.errors import InputError, NotRunError
from yarnverify.files import write_text
from yarnverify.generation import Outcome, out_of_date
from yarnverify.project import Project, project

RECORD = Path("records") / "accuracy.json"


def sweep(
    energies: Sequence[str],
    variants: Sequence[str],
    profile: str,
    executor: str,
    jobs: int | None,
    state: Path | None,
    advance: Callable[[str, int], None],
    of: Project,
) -> dict[str, Any]:
    """The record of a sweep; what an interrupted run of the same sweep has finished is not worked out again."""
    units, missing = plan(PROFILES[profile], energies, variants, of.folder if of.own else None)
    if not units:
        made = (
            f"; they are made by: {of.here('yarnverify generate')}"
            if of.own and "no such kernel" in str(missing)
            else ""
        )
        raise NotRunError(f"no kernels to measure: {'; '.join(missing)}{made}")
    folder = state or state_folder(units)
    try:
        with executor_named(executor, jobs) as pool:
            results = run(units, pool, folder, advance)
    except KeyboardInterrupt:
        kept = len(list(folder.glob("*.json")))
        raise NotRunError(f"interrupted; {kept} of {len(units)} parts are kept, and the same command goes on") from None
    finish(folder)
    command = f"{of.command('yarnverify accuracy')} --profile {profile} --write"
    return make_record(PROFILES[profile], units, results, missing, command)


def accuracy(
    energies: Sequence[str],
    variants: Sequence[str],
    profile: str,
    executor: str,
    jobs: int | None,
    state: Path | None,
    out: Path | None,
    write: bool,
    check: bool,
    advance: Callable[[str, int], None],
    of: Project | None = None,
) -> Outcome:
    """Sweep, and show, write or compare what was found.

    Raises
    ------
    InputError, NotRunError
        For names that are not there, records that cannot be read, executors that do not answer, files that cannot be written.
    """
    from yarnverify.report.accuracy import accuracy_table

    of = of or project()
    path, part = (of.reports if out is None else out) / RECORD, bool(energies or variants)
    if write and (check or part):
        raise InputError("--write takes the whole sweep: no energy, no --variant, no --check")
    known = read_record(path) if check else None
    if known is not None and known["profile"] != profile:
        raise InputError(f"{path}: was made with --profile {known['profile']}; compare with that one")
    record = sweep(energies, variants, profile, executor, jobs, state, advance, of)
    outcome = Outcome(record)
    names = list(dict.fromkeys(cell["energy"] for cell in record["cells"]))
    for name in () if check else names:
        outcome.lines += [f"{name}", "", accuracy_table(record, name)]
    problems = missed_targets(record, of.here("yarnverify accuracy"))
    if known is not None:
        problems += grown(known, record, whole=not part)
    problems += out_of_date(of)
    if write:
        write_text(record_text(record), path)
        outcome.lines.append(f"{path}: written")
    shown = set() if check else set(names)  # their tables say what was not run
    outcome.lines += [text for text in record["not_run"] if not shown & set(text.split(":")[0].split())]
    outcome.lines += problems
    outcome.differs = bool(problems)
    cells = f"{len(record['cells'])} cells of {record['points']} states"
    compared = ", none worse than its record" if check else ""
    outcome.lines.append(f"{cells}: {len(problems)} problems." if problems else f"{cells}: all as expected{compared}.")
    return outcome
