"""What continuous integration is given, and that the README's snippets name what there is."""

from __future__ import annotations

import copy
import re
import shlex
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import fromstring

import pytest
import yaml

from tests.commands import status_of
from tests.pages import records
from yarnverify import ci, cli
from yarnverify.errors import NotRunError

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def found() -> dict[str, Any]:
    return copy.deepcopy(records()["verdicts"])


def spoilt(found: dict[str, Any]) -> dict[str, Any]:
    """(18) is not accepted, (9) is a defect of the tool, a block is missing, and an erratum is stale."""
    for claim in found["claims"]:
        if claim["equation"] == "18":
            claim["erratum"] = None
        if claim["block"] == "dF_u1/du1" and claim["equation"] == "9":
            claim.update(verdict="inconsistent", reason="two methods: differ,\n100 % of the time")
    found["completeness"][0]["missing"] = [{"block": "F_u9", "latex": "F_{u_9}", "derived": None}]
    found["errata"]["stale"] = ["44"]
    found["as_expected"] = False
    return found


def test_a_claim_is_a_test_and_an_accepted_erratum_is_skipped(found: dict[str, Any]) -> None:
    root = fromstring(ci.junit(found, "doc.md"))
    cases = root.findall("testsuite/testcase")
    assert len(cases) == len(found["claims"]) + len(found["completeness"]) == int(root.attrib["tests"])
    assert (root.get("failures"), root.get("errors"), root.get("skipped")) == ("0", "0", "6")
    skipped = {case.get("name") for case in cases if case.find("skipped") is not None}
    assert {"(18) dF_x1/dx1", "(21) dF_x2/dx2"} <= skipped


def test_what_is_not_expected_fails(found: dict[str, Any]) -> None:
    root = fromstring(ci.junit(spoilt(found), "doc.md"))
    failed = {case.get("name") for case in root.iter("testcase") if case.find("failure") is not None}
    assert failed == {"(18) dF_x1/dx1", "list of forces and Jacobians", "(44)"}
    assert [case.get("name") for case in root.iter("testcase") if case.find("error") is not None] == ["(9) dF_u1/du1"]
    assert (root.get("failures"), root.get("errors")) == ("3", "1")


def test_workflow_commands_mark_lines_and_are_escaped(found: dict[str, Any]) -> None:
    assert {line.split(" ")[0] for line in ci.workflow_commands(found, "doc.md")} == {"::notice"}
    lines = ci.workflow_commands(spoilt(found), "a,b:c.md")
    wrong = [line for line in lines if line.startswith("::error")]
    assert len(wrong) == 4
    assert wrong[0].startswith(
        "::error file=a%2Cb%3Ac.md,line=25,col=1,title=(9) dF_u1/du1::inconsistent, two methods: differ,"
    )
    assert "%0A100 %25 of the time" in wrong[0]
    assert all(
        re.fullmatch(r"::(error|notice) file=[^,:]+,line=\d+,col=\d+,title=[^,:]+::[^\n]+", line) for line in lines
    )


def test_summary_is_short_and_says_what_is_new(found: dict[str, Any]) -> None:
    text = ci.summary(found, "doc.md")
    assert text.startswith("### ✅ yarnverify: cirio2014.md\n")
    assert len(text.splitlines()) < 20
    assert "**new**" not in text
    text = ci.summary(spoilt(found), "doc.md")
    assert text.startswith("### ❌")
    assert re.search(r"\| \(18\) dF_x1/dx1 \| doc.md:47 \| REFUTED \| sign: .* \| \*\*new\*\* \|", text)
    assert "Stretch does not list F_u9." in text


def test_command_writes_what_was_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    document = tmp_path / "d.md"
    document.write_text("## A\n\n$$V = k u_1^2 \\quad (1)$$\n\n$$F_{u_1} = k u_1 \\quad (2)$$\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    status = run(["prove", "d.md", "--junit", "j.xml", "--summary", "s.md", "--annotations", "--no-cache"], monkeypatch)
    shown = capsys.readouterr().out
    assert status == 1
    assert "::error file=d.md,line=5,col=1,title=(2) F_u1::refuted, differs from the true value" in shown
    assert fromstring((tmp_path / "j.xml").read_text(encoding="utf-8")).get("failures") != "0"
    assert "REFUTED" in (tmp_path / "s.md").read_text(encoding="utf-8")


def test_text_that_cannot_be_read_is_marked_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "d.md").write_text("$$V = \\foo \\quad (1)$$\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert run(["prove", "d.md", "--annotations"], monkeypatch) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith("::error file=d.md,line=1,col=7,title=yarnverify::")
    assert second.startswith("d.md:1:7: ")


def test_a_file_that_cannot_be_written_is_named(found: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(NotRunError, match=r"none/j\.xml: cannot write: no such file or directory"):
        ci.write(found, "d.md", tmp_path / "none" / "j.xml", None)


def test_a_report_tells_of_files_that_differ(found: dict[str, Any]) -> None:
    good = ci.of_report(found, {"as_expected": True, "as_generated": True})
    assert fromstring(ci.junit(good, "d.md")).get("failures") == "0"
    bad = ci.of_report(found, {"as_expected": True, "as_generated": False})
    assert [case.name for case in ci.cases(bad) if case.result == "failure"] == ["files are as generated"]
    assert ci.summary(bad, "d.md").startswith("### ❌")
    assert "::error file=d.md,line=1,col=1,title=files are as generated::" in "\n".join(
        ci.workflow_commands(bad, "d.md")
    )


def test_report_writes_what_was_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "d.md").write_text("## A\n\n$$V = k u_1^2 \\quad (1)$$\n\n$$F_{u_1} = k u_1 \\quad (2)$$\n")
    monkeypatch.chdir(tmp_path)
    status = run(["report", "own", "--junit", "j.xml", "--summary", "s.md"], monkeypatch)
    assert status == 1
    failed = [
        case
        for case in fromstring((tmp_path / "j.xml").read_text()).iter("testcase")
        if case.find("failure") is not None
    ]
    assert "(2) F_u1" in {case.get("name") for case in failed}
    assert {case.get("file") for case in failed} == {"own/d.md"}
    assert "| (2) F_u1 | own/d.md:5 |" in (tmp_path / "s.md").read_text()


def run(tokens: list[str], monkeypatch: pytest.MonkeyPatch) -> int:
    return status_of(monkeypatch, *tokens)


# -- snippets ---------------------------------------------------------------------------------------------------------


def snippet(name: str) -> Any:
    found = re.search(rf"<!-- ci: {name} -->\n```yaml\n(.*?)```", README, re.DOTALL)
    assert found
    return yaml.safe_load(found[1])


def steps(name: str) -> list[str]:
    found = snippet(name)
    if name == "gitlab":
        assert set(found["prove"]) <= {"image", "script", "artifacts"}
        return list(found["prove"]["script"])
    assert set(found) == {"name", True, "jobs"}  # YAML 1.1 reads the key on as true
    return [step["run"] for step in found["jobs"]["prove"]["steps"] if "run" in step]


@pytest.mark.parametrize("name", ["github", "gitlab"])
def test_snippets_name_commands_and_options_that_exist(name: str) -> None:
    commands = [shlex.split(line)[1:] for line in steps(name) if line.startswith("yarnverify ")]
    assert [command[0] for command in commands] == ["prove", "report"]
    for tokens in commands:
        command, bound, _ = cli.app.parse_args(tokens, exit_on_error=False, print_error=False)
        assert callable(command) and bound.arguments


def test_snippets_keep_what_the_commands_write() -> None:
    github = snippet("github")["jobs"]["prove"]["steps"]
    assert github[-1]["with"]["path"].split("\n") == ["verdicts.xml", "report/report.html"]
    assert snippet("gitlab")["prove"]["artifacts"]["reports"]["junit"] in " ".join(steps("gitlab"))
