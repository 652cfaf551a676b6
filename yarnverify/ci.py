"""What continuous integration shows of a verdict: JUnit XML, a step summary in Markdown, lines that mark the source.

All from the record of ``yarnverify prove``. A claim passes if it is proved; one that an accepted erratum explains is skipped,
as an expected failure is; anything else fails.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from yarnverify.errors import NotRunError, why
from yarnverify.show import mistakes, tally_lines


@dataclass(frozen=True)
class Case:
    """One thing that was checked: where, its name, and what was found: passed, skipped, failure or error."""

    group: str
    name: str
    line: int
    column: int
    result: str
    message: str = ""


def cases(record: dict[str, Any]) -> list[Case]:
    """Every claim of a record, then every list of forces and Jacobians, then the errata that are stale.

    A record of ``yarnverify report`` says too whether its files are as generated and its derivations are proved.
    """
    return [*_claims(record), *_lists(record), *_stale(record), *_files(record)]


def of_report(verdicts: dict[str, Any], report: dict[str, Any]) -> dict[str, Any]:
    """The record of verdicts with what a report found besides."""
    return {
        **verdicts,
        "as_generated": report["as_generated"],
        "as_expected": report["as_expected"] and report["as_generated"],
    }


def _files(record: dict[str, Any]) -> Iterator[Case]:
    if "as_generated" in record:
        good = record["as_generated"]
        message = "" if good else "files of the report differ from what the derivations and records give"
        yield Case("report", "files are as generated", 1, 1, "passed" if good else "failure", message)


def _claims(record: dict[str, Any]) -> Iterator[Case]:
    for claim in record["claims"]:
        verdict, message, result = claim["verdict"], "", "passed"
        if verdict != "proved":
            message = f"{verdict}, {claim['reason']}"
            if claim["change"]:
                message += f"; {claim['change']}"
            if claim["erratum"]:
                result = "skipped"
                message += f"; accepted erratum: {claim['erratum']}"
            else:
                result = "error" if verdict == "inconsistent" else "failure"
                message += "; not in errata.toml"
        name = f"({claim['equation']}) {claim['block']}"
        yield Case(claim["section"] or "Definitions", name, claim["line"], claim["column"], result, message)


def _lists(record: dict[str, Any]) -> Iterator[Case]:
    for part in record["completeness"]:
        lacking = ", ".join(item["block"] for item in part["missing"])
        message = f"the document does not list {lacking}" if lacking else ""
        name = "list of forces and Jacobians"
        yield Case(part["section"], name, 1, 1, "failure" if lacking else "passed", message)


def _stale(record: dict[str, Any]) -> Iterator[Case]:
    for number in record["errata"]["stale"]:
        yield Case(
            "errata.toml", f"({number})", 1, 1, "failure", f"the erratum of equation ({number}) is stale: remove it"
        )


def junit(record: dict[str, Any], path: str) -> str:
    """JUnit XML, as GitLab, Jenkins and most others read it.

    Parameters
    ----------
    record
        As ``yarnverify prove --json`` writes it.
    path
        Of the document, for who opens a failure.
    """
    found = cases(record)
    counts = {kind: str(sum(case.result == kind for case in found)) for kind in ("failure", "error", "skipped")}
    totals = {
        "tests": str(len(found)),
        "failures": counts["failure"],
        "errors": counts["error"],
        "skipped": counts["skipped"],
    }
    root = Element("testsuites", {"name": "yarnverify", **totals})
    suite = SubElement(root, "testsuite", {"name": record["document"], **totals})
    for case in found:
        attributes = {"classname": f"{record['document']}.{case.group}", "name": case.name}
        node = SubElement(suite, "testcase", {**attributes, "file": path, "line": str(case.line)})
        if case.result != "passed":
            SubElement(node, case.result, {"message": case.message})
    indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def workflow_commands(record: dict[str, Any], path: str) -> list[str]:
    """Workflow commands of GitHub Actions: errors on what fails, notices on what an erratum explains."""
    grouped: dict[tuple[Any, ...], list[Case]] = {}
    for case in cases(record):
        if case.result != "passed":
            grouped.setdefault((case.group, case.line, case.column, case.result, case.message), []).append(case)
    lines = []
    for (_, line, column, result, message), same in grouped.items():
        title = ", ".join(case.name for case in same)
        level = "notice" if result == "skipped" else "error"
        lines.append(annotation(level, path, line, column, title, message))
    return lines


def annotation(level: str, path: str, line: int, column: int, title: str, message: str) -> str:
    """One workflow command, escaped as the runner unescapes it."""
    return (
        f"::{level} file={_property(path)},line={line},col={column},title={_property(title)}::"
        f"{message.replace('%', '%25').replace(chr(13), '%0D').replace(chr(10), '%0A')}"
    )


def _property(text: str) -> str:
    for letter in "%\r\n:,":
        text = text.replace(letter, f"%{ord(letter):02X}")
    return text


def summary(record: dict[str, Any], path: str) -> str:
    """A short summary of a step, as Markdown."""
    good = "✅" if record["as_expected"] else "❌"
    tally, *rest = tally_lines(record)
    lines = [
        f"### {good} yarnverify: {record['document'] or path}",
        "",
        f"**{tally}**  ",
        *(f"{line}  " for line in rest),
    ]
    wrong = mistakes(record)
    if wrong:
        lines += ["", "| equation | where | verdict | what | erratum |", "|---|---|---|---|---|"]
    for claim in wrong:
        change = (
            f"{claim['edit']['kind']}: ${claim['edit']['before']}$ → ${claim['edit']['after']}$"
            if claim["edit"]
            else ""
        )
        cells = (
            f"({claim['equation']}) {', '.join(claim['blocks'])}",
            f"{path}:{claim['line']}",
            claim["verdict"].upper(),
            change or claim["reason"],
            "accepted" if claim["erratum"] else "**new**",
        )
        lines.append("| " + " | ".join(cell.replace("\\|", "\\Vert ").replace("|", "\\|") for cell in cells) + " |")
    if not record.get("as_generated", True):
        lines += ["", "Files of the report differ from what the derivations and records give."]
    for part in record["completeness"]:
        if part["missing"]:
            lines += ["", f"{part['section']} does not list {', '.join(item['block'] for item in part['missing'])}."]
    return "\n".join(lines) + "\n"


def shown_path(document: Path) -> str:
    """A document's path as the root of a checkout sees it, where a step usually runs."""
    try:
        return document.resolve().relative_to(Path.cwd()).as_posix()
    except ValueError:
        return document.as_posix()


def write(record: dict[str, Any], path: str, junit_file: Path | None, summary_file: Path | None) -> None:
    """Write the files that were asked for.

    Raises
    ------
    NotRunError
        For a file that cannot be written.
    """
    for target, make in ((junit_file, junit), (summary_file, summary)):
        if target is None:
            continue
        try:
            target.write_text(make(record, path), encoding="utf-8")
        except OSError as error:
            raise NotRunError(f"{target}: cannot write: {why(error)}") from None
