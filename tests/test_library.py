"""Which declarations a document is judged by, its errata, and the results that are kept."""

from __future__ import annotations

import json
import re
import shutil
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from yarnverify import verdicts as proving
from yarnverify.errors import InputError
from yarnverify.library import (
    MAIN_DOCUMENT,
    Erratum,
    Shelf,
    errata,
    fingerprint,
    known,
    recall,
    remember,
    shelf_for,
)
from yarnverify.source import Source
from yarnverify.verdicts import settle, verdicts

DISPLAYS = [rf"$$a = {n} b \quad ({n})$$" for n in range(1, 9)]


def text(first: int, last: int) -> str:
    return "\n\n".join(["# T", *DISPLAYS[first:last]]) + "\n"


def folder_of(path: Path, **documents: str) -> Path:
    """A folder of derivations that declares the documents given by stem and contents."""
    path.mkdir(exist_ok=True)
    for stem, contents in documents.items():
        (path / f"{stem}.py").write_text(f'@energy(document="{stem}.md", section="S")\n', encoding="utf-8")
        (path / f"{stem}.md").write_text(contents, encoding="utf-8")
    return path


# -- which declarations -----------------------------------------------------------------------------------------------


def test_a_document_is_judged_by_its_own_folder(tmp_path: Path) -> None:
    own = folder_of(tmp_path, d=text(0, 4))
    found = shelf_for(own / "d.md", text(0, 4))
    assert (found.folder, found.document) == (own, "d.md")


def test_the_own_folder_is_found_from_inside_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder_of(tmp_path, d=text(0, 4)))
    found = shelf_for(Path("d.md"), text(0, 4))
    assert found.folder is not None and found.folder.resolve() == tmp_path.resolve()


def test_the_main_document_is_judged_by_the_derivations_of_the_package(folder: Path, source: Source) -> None:
    found = shelf_for(folder / MAIN_DOCUMENT, source.text)
    assert (found.folder, found.document) == (folder, MAIN_DOCUMENT)


@pytest.mark.parametrize("name", ["copy.txt", MAIN_DOCUMENT])
@pytest.mark.parametrize(
    ("old", "new"), [("\n", "\n\n \t"), (r"\quad (", r"\qquad  ("), (r" \quad", r"\; ~"), ("##", "#")]
)
def test_an_edition_of_the_main_document_is_known_by_its_displays(
    tmp_path: Path, folder: Path, source: Source, name: str, old: str, new: str
) -> None:
    changed = source.text.replace(r"\sin", r"\cos", 3).replace(old, new)
    found = shelf_for(tmp_path / name, changed)
    assert (found.folder, found.document) == (folder, MAIN_DOCUMENT)


def test_half_of_the_displays_make_an_edition_and_fewer_do_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped = folder_of(tmp_path / "shipped", d=text(0, 4))
    monkeypatch.setattr("yarnverify.library.derivations", lambda: shipped)
    away = tmp_path / "away" / "other.md"
    assert shelf_for(away, text(2, 6)) == Shelf(shipped, "d.md", shelf_for(away, text(2, 6)).how)
    assert shelf_for(away, text(3, 6)).folder is None
    assert shelf_for(away, "no displays").folder is None


@pytest.mark.parametrize("name", ["d.md", "other.md"])
def test_a_document_that_nothing_declares_is_judged_by_itself(tmp_path: Path, name: str) -> None:
    found = shelf_for(tmp_path / name, text(0, 4))
    assert (found.folder, found.document) == (None, name) and "by itself alone" in found.how


def test_none_chosen_is_none_even_at_home(tmp_path: Path) -> None:
    own = folder_of(tmp_path, d=text(0, 4))
    assert shelf_for(own / "d.md", text(0, 4), "none") == Shelf(None, "d.md", "by itself alone", own)


def test_a_chosen_folder_is_taken_by_name(tmp_path: Path) -> None:
    chosen = folder_of(tmp_path / "chosen", d=text(0, 4), e=text(0, 4))
    found = shelf_for(tmp_path / "e.md", text(6, 8), str(chosen))
    assert (found.folder, found.document) == (chosen, "e.md")


def test_a_chosen_folder_is_taken_whatever_the_displays(tmp_path: Path) -> None:
    chosen = folder_of(tmp_path / "chosen", d=text(0, 4))
    found = shelf_for(tmp_path / "x.md", text(6, 8), str(chosen))
    assert (found.folder, found.document) == (chosen, "d.md")


def test_in_a_chosen_folder_the_likest_document_is_taken(tmp_path: Path) -> None:
    chosen = folder_of(tmp_path / "chosen", a=text(0, 4), b=text(4, 8))
    assert shelf_for(tmp_path / "x.md", text(4, 8), str(chosen)).document == "b.md"


def test_a_chosen_folder_needs_no_copy_of_the_document(tmp_path: Path) -> None:
    chosen = folder_of(tmp_path / "chosen", d=text(0, 4))
    (chosen / "d.md").unlink()
    assert shelf_for(tmp_path / "x.md", text(0, 4), str(chosen)).folder == chosen


@pytest.mark.parametrize("name", ["missing", "file", "empty"])
def test_a_chosen_folder_that_declares_nothing_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=name):
        shelf_for(tmp_path / "d.md", text(0, 4), str(tmp_path / name))


def test_other_python_files_beside_the_document_do_not_matter(tmp_path: Path) -> None:
    (tmp_path / "latin.py").write_bytes(b"# \xe9\n")
    (tmp_path / "package.py").mkdir()
    assert shelf_for(tmp_path / "d.md", text(0, 4)).folder is None


# -- errata -----------------------------------------------------------------------------------------------------------

ENTRY = '[[erratum]]\ndocument = "d.md"\nequation = "8"\nchange = "sign of a"\nreason = "slip"\n'


def shelf_with(folder: Path, entries: str | bytes) -> Shelf:
    (folder / "errata.toml").write_bytes(entries if isinstance(entries, bytes) else entries.encode())
    return Shelf(folder, "d.md", "")


def test_errata_of_this_document_are_read(tmp_path: Path) -> None:
    shelf = shelf_with(tmp_path, ENTRY + ENTRY.replace("d.md", "other.md"))
    assert errata(shelf) == (Erratum("8", "sign of a", "slip"),)


def test_no_folder_no_file_and_no_entries_are_no_errata(tmp_path: Path) -> None:
    assert (
        errata(Shelf(None, "d.md", "")) == errata(Shelf(tmp_path, "d.md", "")) == errata(shelf_with(tmp_path, "")) == ()
    )


@pytest.mark.parametrize("key", ["document", "equation", "change", "reason"])
@pytest.mark.parametrize("value", [None, '""', '"  "', "8"])
def test_an_erratum_needs_every_text(tmp_path: Path, key: str, value: str | None) -> None:
    entry = re.sub(rf"^{key} = .*\n", f"{key} = {value}\n" if value else "", ENTRY, flags=re.MULTILINE)
    with pytest.raises(InputError, match=rf"errata\.toml.*: erratum 2 needs a text for '{key}'"):
        errata(shelf_with(tmp_path, ENTRY + entry))


@pytest.mark.parametrize(
    "entries",
    [
        "[[erratum]\n",
        "a = \n",
        b"\xff",
        "erratum = 3\n",
        'erratum = ["8"]\n',
        "[erratum]\nequation = 8\n",
        ENTRY + "equation = 2\n",
    ],
)
def test_a_bad_errata_file_is_one_line(tmp_path: Path, entries: str | bytes) -> None:
    with pytest.raises(InputError, match=r"errata\.toml") as error:
        errata(shelf_with(tmp_path, entries))
    assert "\n" not in str(error.value)


# -- settling ---------------------------------------------------------------------------------------------------------


def claim(equation: str, verdict: str, change: str | None = None) -> dict[str, Any]:
    return {"equation": equation, "verdict": verdict, "change": change, "because": []}


def settled(claims: list[dict[str, Any]], *accepted: Erratum, missing: tuple[str, ...] = ()) -> dict[str, Any]:
    part = {"missing": [{"block": block} for block in missing]}
    numbers = ["1", "2", "3", "4"]
    found: dict[str, Any] = {
        "document": "d.md", "claims": deepcopy(claims), "completeness": [part], "equations": numbers
    }  # fmt: skip
    settle(found, Shelf(None, "d.md", ""), accepted)
    return found


GOOD, SIGN = claim("1", "proved"), claim("2", "refuted", "sign of a")
KNOWN = Erratum("2", "sign of a", "slip")


@pytest.mark.parametrize(
    ("claims", "accepted", "expected"),
    [
        ([GOOD], [], ([], [], [])),
        ([GOOD, SIGN], [KNOWN], (["2"], [], [])),
        ([SIGN, SIGN], [KNOWN], (["2"], [], [])),
        ([GOOD, SIGN], [], ([], ["2"], [])),
        ([SIGN, SIGN], [], ([], ["2"], [])),
        ([GOOD], [KNOWN], ([], [], ["2"])),
        ([claim("2", "refuted", "sign of b")], [KNOWN], ([], ["2"], ["2"])),
        ([claim("2", "refuted", None)], [KNOWN], ([], ["2"], ["2"])),
        ([claim("2", "undecided", "sign of a")], [KNOWN], ([], ["2"], ["2"])),
        ([claim("2", "inconsistent", "sign of a")], [KNOWN], ([], ["2"], ["2"])),
        ([claim("3", "refuted", "sign of a")], [KNOWN], ([], ["3"], ["2"])),
        ([SIGN, claim("2", "refuted", "sign of b")], [KNOWN], (["2"], ["2"], [])),
        ([SIGN, claim("3", "undecided"), claim("4", "refuted")], [KNOWN], (["2"], ["3", "4"], [])),
    ],
)
def test_errata_are_settled(
    claims: list[dict[str, Any]], accepted: list[Erratum], expected: tuple[list[str], ...]
) -> None:
    found = settled(claims, *accepted)
    assert found["errata"] == dict(zip(("accepted", "new", "stale"), expected, strict=True))
    assert found["as_expected"] is not any(expected[1:])


@pytest.mark.parametrize(("name", "stale"), [("d.md", ["2", "9"]), ("excerpt.md", ["2"])])
def test_an_erratum_of_an_equation_that_is_not_printed_is_stale_but_in_an_excerpt(name: str, stale: list[str]) -> None:
    found: dict[str, Any] = {"document": name, "claims": [deepcopy(GOOD)], "completeness": [], "equations": ["1", "2"]}
    settle(found, Shelf(None, "d.md", ""), (KNOWN, Erratum("9", "sign of a", "slip")))
    assert found["errata"]["stale"] == stale


def test_an_accepted_claim_carries_its_reason() -> None:
    assert [c["erratum"] for c in settled([GOOD, SIGN], KNOWN)["claims"]] == [None, "slip"]


def test_a_missing_block_is_not_as_expected() -> None:
    assert not settled([GOOD], missing=("dF_x1/dx0",))["as_expected"]


# -- what is kept -----------------------------------------------------------------------------------------------------


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "yarnverify"


def test_what_is_remembered_is_recalled(cache: Path) -> None:
    assert recall("key") is None
    remember("key", {"claims": [1, None, "é"]})
    assert recall("key") == {"claims": [1, None, "é"]}
    assert [path.name for path in cache.iterdir()] == ["key.json"]


def test_a_record_is_made_once_for_the_same_contents(cache: Path) -> None:
    made: list[int] = []

    def make() -> dict[str, Any]:
        made.append(len(made))
        return {"made": len(made)}

    assert known([b"a"], make) == ({"made": 1}, False)
    assert known([b"a"], make) == ({"made": 1}, True)
    assert known([b"b"], make) == ({"made": 2}, False)
    assert known([b"a"], make, cache=False) == ({"made": 3}, False)
    assert known([b"a"], make) == ({"made": 1}, True)


@pytest.mark.parametrize("data", [b"", b"{", b"\xff\xfe", b"1", b'{"key": "other", "record": {}}'])
def test_a_spoilt_result_is_forgotten(cache: Path, data: bytes) -> None:
    remember("key", {"claims": []})
    (cache / "key.json").write_bytes(data)
    assert recall("key") is None


def test_without_the_variable_results_are_kept_at_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    remember("key", {"claims": []})
    assert (tmp_path / ".cache" / "yarnverify" / "key.json").is_file() and recall("key") == {"claims": []}


def test_a_cache_that_cannot_be_written_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    remember("key", {"claims": []})
    assert recall("key") is None


def test_a_fingerprint_tells_contents_and_their_borders_apart(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"ab")
    prints = [fingerprint(parts) for parts in ([b"ab"], [b"a", b"b"], [b"ba"], [b"ab", b""], [])]
    assert len(set(prints)) == len(prints)
    assert fingerprint([path]) == fingerprint([b"ab"])


DOCUMENT = r"""## Spring

$$V = \frac{1}{2} k u_1^2 \quad (1)$$

$$F_{u_1} = k u_1 \quad (2)$$

$$\frac{\partial F_{u_1}}{\partial u_1} = -k \quad (3)$$
"""
SPRING = """from yarnverify.symbolic.declare import *
@energy(document="d.md", section="Spring")
def spring(u1: Sliding, *, k: Positive["N/m"]):
    return k * u1**2 / 2
"""


def home(tmp_path: Path) -> Path:
    (tmp_path / "d.md").write_text(DOCUMENT, encoding="utf-8")
    (tmp_path / "spring.py").write_text(SPRING, encoding="utf-8")
    return tmp_path / "d.md"


def test_a_known_record_is_the_record(tmp_path: Path, cache: Path) -> None:
    path = home(tmp_path)
    first, took = verdicts(path)
    again, took_again = verdicts(path)
    assert first == again and again == verdicts(path, cache=False)[0] == json.loads(json.dumps(first))
    assert took.startswith("derived and proved") and took_again.startswith("known from an earlier run")


@pytest.mark.parametrize("stored", ["null", "[]", "{}", "3"])
def test_a_stored_result_of_another_shape_is_worked_out_again(tmp_path: Path, cache: Path, stored: str) -> None:
    path = home(tmp_path)
    first, _ = verdicts(path)
    (kept,) = cache.glob("*.json")
    kept.write_text(stored, encoding="utf-8")
    assert verdicts(path)[0] == first


@pytest.mark.parametrize("changed", ["d.md", "spring.py"])
def test_a_changed_file_is_judged_anew(tmp_path: Path, cache: Path, changed: str) -> None:
    path = home(tmp_path)
    verdicts(path)
    with (tmp_path / changed).open("a", encoding="utf-8") as file:
        file.write("\n")
    assert verdicts(path)[1].startswith("derived and proved")


def test_an_accepted_erratum_counts_at_once(tmp_path: Path, cache: Path) -> None:
    path = home(tmp_path)
    found, _ = verdicts(path)
    (bad,) = [c for c in found["claims"] if c["verdict"] != "proved"]
    assert (bad["equation"], found["errata"]["new"], found["as_expected"]) == ("2", ["2"], False)
    entry = f"[[erratum]]\ndocument = 'd.md'\nequation = '2'\nchange = '{bad['change']}'\nreason = 'slip'\n"
    shelf_with(tmp_path, entry)
    found, took = verdicts(path)
    assert found["as_expected"] and found["errata"]["accepted"] == ["2"] and took.startswith("known")


def test_nothing_is_kept_if_not_wanted(tmp_path: Path, cache: Path) -> None:
    verdicts(home(tmp_path), cache=False)
    assert not cache.exists()


def test_the_main_document_is_the_default(
    folder: Path, monkeypatch: pytest.MonkeyPatch, cache: Path, record: dict[str, Any]
) -> None:
    monkeypatch.setattr("yarnverify.symbolic.record.prove_source", lambda source, shelf, advance: deepcopy(record))
    found, _ = proving.verdicts()
    assert found["document"] == MAIN_DOCUMENT and found["as_expected"]


def test_the_derivations_work_from_any_place(tmp_path: Path, folder: Path) -> None:
    shutil.copytree(folder, tmp_path / "paper")
    found = shelf_for(tmp_path / "paper" / MAIN_DOCUMENT, "")
    assert found.folder == tmp_path / "paper" and len(errata(found)) == 3
