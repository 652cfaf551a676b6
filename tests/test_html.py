"""The HTML report as text: formulas and marks, pictures with names of their own, nothing outside itself."""

from __future__ import annotations

import copy
import re
from html.parser import HTMLParser
from itertools import pairwise
from typing import Any
from xml.etree.ElementTree import fromstring

import pytest

from tests.pages import records, simulated, whole_page
from yarnverify.report.brief import brief
from yarnverify.report.mathml import compared, formula
from yarnverify.report.scenes import scenes
from yarnverify.report.svg import inline


class Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.targets: list[str] = []
        self.outside: list[str] = []
        self.headings: list[int] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if key == "id":
                self.ids.append(value or "")
            elif key in ("href", "src", "xlink:href", "data", "poster", "action", "srcset"):
                (self.targets if (value or "").startswith("#") else self.outside).append(value or "")
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def read(text: str) -> Reader:
    reader = Reader()
    reader.feed(text)
    return reader


@pytest.fixture(scope="module")
def text() -> str:
    return whole_page()


def test_same_records_give_the_same_bytes(text: str) -> None:
    assert whole_page() == text


def test_nothing_outside_itself(text: str) -> None:
    reader = read(text)
    assert set(reader.outside) == {"data:,"}  # the icon that keeps browsers from asking a server for one
    assert not re.search(r"@import|url\((?!data:|#)", text)
    assert "<script" not in text


def test_ids_are_unique_and_links_end_somewhere(text: str) -> None:
    reader = read(text)
    assert len(set(reader.ids)) == len(reader.ids)
    assert {target[1:] for target in reader.targets} <= set(reader.ids)
    assert set(re.findall(r"url\(#([^)]+)\)", text)) <= set(reader.ids)
    assert len({target for target in reader.targets if target.startswith("#equation-")}) == 44


def test_headings_go_down_one_level_at_a_time(text: str) -> None:
    levels = read(text).headings
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b <= a + 1 for a, b in pairwise(levels))


def test_every_verdict_of_the_record_is_shown(text: str) -> None:
    found = records()["verdicts"]
    rows = dict(re.findall(r'<tr id="equation-([^"]+)" class="(\w+)">', text))
    assert list(rows) == found["equations"]
    for number, verdict in rows.items():
        verdicts = {claim["verdict"] for claim in found["claims"] if claim["equation"] == number}
        assert verdict == ("refuted" if "refuted" in verdicts else "proved")


def test_the_table_of_verdicts_adds_up(text: str) -> None:
    table = text.split('aria-label="Verdicts by section"')[1].split("</table>")[0]
    rows = [re.findall(r'<td class="number">(\d+)', row) for row in table.split("<tr>")[2:]]
    *parts, together = [[int(count) for count in row] for row in rows]
    assert len(parts) == 5  # shared definitions, and four energies
    assert [sum(column) for column in zip(*parts, strict=True)] == together
    assert together == [records()["verdicts"]["tally"][verdict] for verdict in ("proved", "refuted")]


def header(text: str) -> str:
    return " ".join("".join(read(text.split("<header>")[1].split("</header>")[0]).text).split())


def test_the_first_words_are_the_verdict(text: str) -> None:
    assert "3 of 44 numbered equations are wrong: (8), (18), (21)." in header(text)
    assert "What is refuted is known" in header(text)
    found = copy.deepcopy(records())
    for claim in found["verdicts"]["claims"]:
        claim["verdict"] = "undecided" if claim["equation"] == "18" else "proved"
    found["verdicts"]["as_expected"] = False
    found["verdicts"]["completeness"][1]["missing"] = [{"block": "dF_x1/du1", "latex": "a", "derived": "b"}]
    assert "No equation is refuted; 1 of 44 is not proved. 1 force or Jacobian is missing." in header(whole_page(found))
    assert "Not as expected" in header(whole_page(found))


def test_the_summary_says_what_the_records_say() -> None:
    found = copy.deepcopy(records())
    assert [part for part, _ in brief(found)] == ["accuracy", "speed", "scenes", "analysis"]
    cell = next(
        cell for cell in found["accuracy"]["cells"] if (cell["variant"], cell["dtype"]) == ("accurate", "float64")
    )
    assert float(dict(brief(found))["accuracy"].split("error is ")[1].split()[0]) <= 16
    cell["outputs"]["G"]["worst"] = 1234.0
    assert "worst error is 1e3 units of 2^-53, over 48 kinds of hard states of 7" in dict(brief(found))["accuracy"]
    cell["outputs"]["H"]["worst"] = "inf"
    assert "worst error is not finite" in dict(brief(found))["accuracy"]
    found["simulation"]["scenes"][0]["result"]["missed"] = ["one", "two"]
    assert dict(brief(found))["scenes"].endswith("2 goals missed.")
    found["analysis"]["moduli"]["rows"][0]["agree within 1e-9"] = False
    assert dict(brief(found))["analysis"].startswith("6 of 7 moduli")
    assert brief(found | {"accuracy": None, "benchmark": None, "simulation": None, "analysis": None}) == []


def test_the_summary_bears_states_without_a_true_result() -> None:
    """As in the regime without value of an energy that has none there at all."""
    found = copy.deepcopy(records())
    before = dict(brief(found))["accuracy"]
    cell = next(
        cell for cell in found["accuracy"]["cells"] if (cell["variant"], cell["dtype"]) == ("printed", "float64")
    )
    found["accuracy"]["cells"].append(cell | {"outputs": {output: {"worst": None} for output in "EGH"}})
    assert dict(brief(found))["accuracy"] == before.replace("27 of 45", "27 of 46") != before


def test_speed_in_the_summary_is_that_of_the_default_kernels() -> None:
    found = copy.deepcopy(records())
    energies = found["benchmark"]["energies"]
    for name in list(energies)[1:]:
        del energies[name]
    (own,) = energies.values()
    entry = next(entry for entry in own["states"]["mixed"] if entry["n"] == 100_000)
    entry["ns"]["accurate"] = [77.0, 1.0, 99.0]
    entry["times as fast as"] = {"jax": {"accurate": [3.5, 1.0, 9.0]}}
    assert dict(brief(found))["speed"] == (
        "Energy, gradient and Hessian of an element take 77 ns: 3.5 times as fast as jax."
    )


def test_regimes_and_variants_are_explained(text: str) -> None:
    own = text.split('<section aria-labelledby="accuracy">')[1].split("</section>")[0]
    terms = re.findall("<dt>([^<]+)</dt>", own)
    cells = records()["accuracy"]["cells"]
    assert {cell["regime"] for cell in cells} | {cell["variant"] for cell in cells} == set(terms)


def test_a_correction_and_its_equation_lead_to_each_other(text: str) -> None:
    row = text.split('<tr id="equation-18"')[1].split("</tr>")[0]
    assert 'href="#correction-18"' in row
    assert 'href="#equation-18"' in text.split('id="correction-18"')[1].split("</h3>")[0]
    assert 'href="#correction' not in text.split('<tr id="equation-17"')[1].split("</tr>")[0]


def test_powers_are_raised_whole(text: str) -> None:
    assert re.search(r"n<sup>\d\.\d\d</sup>", text)
    assert not re.search(r"</sup>\.?\d", text)


def test_commands_for_energies_of_ones_own_name_them() -> None:
    found = records() | {"benchmark": None, "accuracy": None, "analysis": None, "simulation": None}
    text = "".join(read(whole_page(found, name="my_model")).text)
    commands = re.findall(r"yarnverify (?:prove|derive|generate|accuracy|benchmark|report).*", text)
    assert "yarnverify benchmark my_model --json my_model/reports/records/benchmark.json" in commands
    assert all("my_model" in command for command in commands)


def test_every_step_of_every_derivation_is_shown(text: str) -> None:
    own = text.split('<section aria-labelledby="derivations">')[1].split("</section>")[0]
    parts = dict(zip(*[iter(re.split(r'<h3 id="derivation-(\w+)">', own)[1:])] * 2, strict=True))
    derived = records()["derivations"]
    assert list(parts) == list(derived)
    for name, derivation in derived.items():
        assert parts[name].count('<div class="formula"') == sum(len(step["formulas"]) for step in derivation["steps"])
        assert re.findall("<h4>([^<]+)", parts[name]) == [step["title"] for step in derivation["steps"][1:]]
        assert "ot all proved" not in parts[name]


def test_a_sum_too_long_for_a_line_leaves_its_fraction() -> None:
    one = r"\left( \mathbf{v}_0 - w_0 \frac{a - b}{c - d} \right)^2"
    long = r"\frac{\rho \left( " + " + ".join([one] * 4) + r" \right)}{6}"
    assert formula(long).count("<math") == 5  # what is before the bracket, and a piece for each term
    assert formula(r"\frac{\rho \left( " + one + r" + b \right)}{6}").count("<math") == 1


def test_steps_with_long_formulas_have_the_whole_width_of_a_paper(text: str) -> None:
    assert text.count('<div class="steps narrow">') == len(records()["derivations"])
    found = copy.deepcopy(records())
    found["derivations"]["stretch"]["steps"][1]["formulas"][0]["latex"] = r"a = \frac{1}{2" + " + b" * 25 + "}"
    assert whole_page(found).count('<div class="steps">') == 1


def test_a_derivation_that_failed_says_so() -> None:
    found = copy.deepcopy(records())
    found["derivations"]["bending"]["all_proved"] = False
    assert whole_page(found).count("Not all proved") == 1


def test_what_was_not_measured_says_so() -> None:
    found = {name: record for name, record in records().items() if name in ("verdicts", "derivations", "kernels")}
    missing = {"accuracy": None, "benchmark": None, "analysis": None, "simulation": None, "simulation-speed": None}
    text = " ".join("".join(read(whole_page(found | missing)).text).split())
    assert text.count("Not run.") == 3  # errors, speed of the simulation, and analysis
    assert "Not compared with known answers: not run." in text
    assert "Not run: stretch, bending, shear, parallel_contact" in text
    assert "Command: yarnverify accuracy --write" in text


def test_energies_without_a_document_have_no_verdicts() -> None:
    found = copy.deepcopy(records())
    nothing = {"document": "", "claims": [], "equations": [], "completeness": [], "given": []}
    found["verdicts"] |= nothing | {"tally": dict.fromkeys(found["verdicts"]["tally"], 0)}
    text = whole_page(found)
    assert not {"verdicts", "corrections", "equations"} & set(read(text).ids)
    assert {target[1:] for target in read(text).targets} <= set(read(text).ids)


def test_text_of_a_document_is_no_markup() -> None:
    found = copy.deepcopy(records())
    claim = next(claim for claim in found["verdicts"]["claims"] if claim["equation"] == "8")
    claim["reason"], claim["erratum"] = "undefined symbol <b onclick=x>", None
    text = whole_page(found)
    assert "<b onclick" not in text
    assert "undefined symbol &lt;b onclick=x&gt;" in text
    assert "<strong>New:</strong>" in text


def test_scenes_show_errors_orders_and_seconds() -> None:
    text = " ".join("".join(read(whole_page(photos={"elastica": b"PNG"})).text).split())
    assert "A hanging yarn, stretched by its own weight" in text
    assert "Command: yarnverify simulate elastica --size 10 20 --out reports/scenes/elastica" in text
    runs = scenes(simulated())[1].runs
    assert runs is not None and runs.headings[:4] == ("wall", "segments", "unknowns", "iterations")
    assert runs.headings[-1] == "seconds" and len(runs.rows) == 4
    assert float(runs.rows[1][5]) == pytest.approx(2, abs=0.2)


def test_results_of_a_gallery_are_shown_without_a_record() -> None:
    result = copy.deepcopy(simulated()["scenes"][0]["result"])
    for line in result["lines"]:
        for run in line["runs"]:
            run["answers"] = []
    text = whole_page(records() | {"simulation": None}, gallery=[result], photos={"hanging_yarn": b"PNG"})
    command = "Command: yarnverify simulate hanging_yarn --size 4 8 --out reports/scenes/hanging_yarn"
    assert command in "".join(read(text).text)
    assert 'alt="The end of the scene: a hanging yarn' in text
    assert "Not compared with known answers: not run." in text
    assert len(scenes(simulated(), [result])) == 2  # the record has it


def test_a_picture_of_another_run_says_which() -> None:
    other = copy.deepcopy(simulated()["scenes"][1]["result"])
    other["lines"][0]["runs"] = other["lines"][0]["runs"][:1]
    other["parameters"]["alpha"]["value"] = 2.5
    drawn = "yarnverify simulate elastica --set alpha=2.5 --size 10 --out reports/scenes/elastica"
    assert scenes(simulated(), [other])[1].pictured == drawn
    text = "".join(read(whole_page(gallery=[other], photos={"elastica": b"PNG"})).text)
    assert f"Drawn by {drawn}" in text
    same = simulated()["scenes"][1]["result"]
    assert "Drawn by" not in whole_page(gallery=[same], photos={"elastica": b"PNG"})


def test_the_overview_leads_to_every_scene(text: str) -> None:
    assert {"#scene-hanging-yarn", "#scene-elastica"} <= set(read(text).targets)


def test_a_goal_that_was_missed_is_shown() -> None:
    record = copy.deepcopy(simulated())
    record["scenes"][0]["result"]["missed"] = ["the height is <wrong>"]
    assert "Missed: the height is &lt;wrong&gt;" in whole_page(records() | {"simulation": record})


# -- formulas ---------------------------------------------------------------------------------------------------------


def letters(mathml: str) -> str:
    return re.sub(r"<[^>]*>", "", mathml)


def marked(mathml: str, kind: str) -> list[str]:
    tree = fromstring(f"<all>{mathml.replace('<wbr>', '')}</all>")
    return ["".join(node.itertext()) for node in tree.iter() if node.get("class") == kind]


def test_every_formula_of_the_record_keeps_its_letters() -> None:
    for claim in records()["verdicts"]["claims"]:
        shown = letters(formula(claim["printed"]))
        assert shown.count("𝐏") == claim["printed"].count(r"\mathbf{P}")
        assert shown.count("∂") == claim["printed"].count(r"\partial")
        assert shown.count("(") == claim["printed"].count("(")
        assert shown.count(")") == claim["printed"].count(")")
        assert "\\" not in shown


@pytest.mark.parametrize(
    ("before", "after", "was", "now"),
    [
        (r"a + b", r"a - b", ["+"], ["−"]),
        (r"\frac{k}{l_1} \mathbf{P}_1", r"\frac{k_s}{l_1} \mathbf{P}_1", ["k"], ["ks"]),
        (r"\mathbf{d}_1^T \mathbf{P}_2", r"\mathbf{d}_2^T \mathbf{P}_2", ["1"], ["2"]),
        (r"\mathbf{d}_1", r"\mathbf{d}_1^T", ["𝐝1"], ["𝐝1T"]),
        (r"\theta \left( a + \frac{1}{2} b \right)", r"\theta \left( a + \frac{1}{3} b \right)", ["2"], ["3"]),
        (r"a b", r"a c b", [], ["c"]),
        (r"a", r"a", [], []),
    ],
)
def test_only_what_differs_is_marked(before: str, after: str, was: list[str], now: list[str]) -> None:
    left, right = compared(before, after)
    assert (marked(left, "was"), marked(right, "now")) == (was, now)
    assert not marked(left, "now")
    assert letters(left) == letters(formula(before))
    assert letters(right) == letters(formula(after))


def test_marks_of_the_document_show_the_edit() -> None:
    wanted = {"8": (["k", "k"], ["ks", "ks"]), "18": (["+"], ["−"]), "21": (["+"], ["−"])}
    for claim in records()["verdicts"]["claims"]:
        if claim["verdict"] != "proved":
            left, right = compared(claim["printed"], claim["correction"])
            assert (marked(left, "was"), marked(right, "now")) == wanted[claim["equation"]]


@pytest.mark.parametrize("latex", [r"a \|b - c\|", r"a \|b - c\|^2 d", r"|b - c|", r"\|b - c\| + \|d\|_2 - \|b - c\|"])
def test_bars_are_brackets(latex: str) -> None:
    shown = formula(latex)
    trees = [fromstring(piece) for piece in shown.split("<wbr>")]
    bars = [node for tree in trees for node in tree.iter("mo") if node.text in ("‖", "|", "∥")]
    assert [bar.get("form") for bar in bars] == ["prefix", "postfix"] * (len(bars) // 2) and bars
    assert all(bar.get("fence") == "true" for bar in bars)
    assert all("".join(tree.itertext()).count("b") == "".join(tree.itertext()).count("c") for tree in trees)


def test_long_formulas_can_be_scrolled_by_keys() -> None:
    found = copy.deepcopy(records())
    claim = next(claim for claim in found["verdicts"]["claims"] if claim["equation"] == "9")
    claim["printed"] = r"a = \frac{1}{2" + " + b" * 25 + "}"
    assert whole_page(found).count('tabindex="0" role="group"') == whole_page().count('tabindex="0" role="group"') + 1


def test_formulas_break_at_their_terms() -> None:
    assert formula(r"a = b + c - d").count("<wbr>") == 3
    assert formula(r"-a").count("<wbr>") == 0
    assert 'form="prefix"' in formula(r"a = -b")


# -- pictures ---------------------------------------------------------------------------------------------------------


def test_pictures_keep_their_names_apart_and_follow_the_theme() -> None:
    one: Any = """<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="10pt" height="5pt"
        viewBox="0 0 10 5"><metadata>m</metadata><style>*{a:b}</style><defs><path id="m1" d="M 1.23456 2 L 3.00001 4"/>
        <rect fill="#d9d9d9"/></defs>
        <g id="unused"><use xlink:href="#m1" clip-path="url(#m1)" style="fill: #ffffff; stroke: #0072b2"/></g></svg>"""
    text = inline(one, "bending", 'error "of" <all>')
    root = fromstring(text)
    assert root.get("aria-label") == 'error "of" <all>'
    assert root.get("style") == "max-width: 13px; min-width: min(36rem, 13px)"
    assert 'id="bending-m1"' in text and 'href="#bending-m1"' in text and "url(#bending-m1)" in text
    assert "unused" not in text and "metadata" not in text and "<style" not in text
    assert 'd="M 1.23 2 L 3 4"' in text
    assert "fill: var(--paper); stroke: var(--c0072b2, #0072b2)" in text
    assert 'fill="var(--shade)"' in text


def test_grey_lines_follow_the_page(text: str) -> None:
    """On a dark page, every dark line has another colour, and a grid of light grey is not brighter than what it carries."""
    dark = text.split("(prefers-color-scheme: dark)")[1].split("* { box-sizing")[0]
    used = set(re.findall(r"stroke: var\(--c([0-9a-f]{6}), #", text))
    for colour in used:
        if max(bytes.fromhex(colour)) < 0x60:
            assert f"--c{colour}:" in dark, colour
        red, green, blue = bytes.fromhex(colour)
        assert not red == green == blue or red < 0xD0, colour
