"""What commands write: kernels, derivations and pages, and that damage to any of them is noticed."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from yarnverify import generation, reporting
from yarnverify.errors import InputError, NotRunError
from yarnverify.generation import generate_kernels, settle_files
from yarnverify.library import MAIN_DOCUMENT
from yarnverify.reporting import build_report
from yarnverify.source import Source
from yarnverify.symbolic.declare import Declarations, Point, Positive, Sliding, energy, length
from yarnverify.symbolic.derive import declared_section
from yarnverify.symbolic.emit import plain_program
from yarnverify.symbolic.explain import explain, explain_energy, explanation
from yarnverify.symbolic.modules import VARIANTS, Modules, kernel_modules
from yarnverify.symbolic.plain import plain
from yarnverify.symbolic.printing import statements
from yarnverify.symbolic.programs import derived_programs, printed_program, proved
from yarnverify.symbolic.prove import read_with
from yarnverify.symbolic.reader import read_formula
from yarnverify.symbolic.tree import Expr

ENERGIES = ("stretch", "bending", "shear", "parallel_contact")
PHYSICS = ("gravity", "kinetic", "plane", "sphere")  # what no document prints


@pytest.fixture(scope="module")
def modules(folder: Path) -> Modules:
    """The generated files, worked out afresh."""
    steps: list[str] = []
    made = kernel_modules(folder, MAIN_DOCUMENT, generation.DEFAULT_VARIANT, lambda label, total: steps.append(label))
    assert len(steps) == len(VARIANTS) * len(ENERGIES) + 3 * len(PHYSICS)
    return made


# -- kernels ----------------------------------------------------------------------------------------------------------


def test_committed_kernels_are_what_the_derivations_give(modules: Modules) -> None:
    folder = Path(generation.__file__).parent / "kernels"
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*.py")} - generation.WRITTEN_BY_HAND
    assert there == set(modules.texts)
    for name, text in modules.texts.items():
        assert (folder / name).read_bytes() == text.encode(), f"{name} differs: run yarnverify generate"


def test_kernels_hold_no_dates_and_name_their_source(modules: Modules) -> None:
    for name, text in modules.texts.items():
        assert "yarnverify generate" in text or name.endswith("__init__.py")
        assert "202" not in text
    assert "equation (8) cannot be evaluated as printed: k should be k_s" in modules.texts["printed/stretch.py"]


def test_the_fused_form_costs_less_than_its_parts(modules: Modules) -> None:
    for counts in modules.operations.values():
        for variant in counts.values():
            assert (
                variant["hessian"] <= variant["evaluate"] <= sum(variant[k] for k in ("energy", "gradient", "hessian"))
            )


DAMAGE = {
    "a changed sign": lambda text: text.replace(" = ", " = -", 1),
    "a line end": lambda text: text.replace("\n", "\r\n", 1),
    "nothing left": lambda text: "",
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_kernel_is_shown_and_not_touched(
    damage: str, modules: Modules, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settle_files(tmp_path, modules.texts, False, [], "")
    victim = tmp_path / "differentiated" / "stretch.py"
    victim.write_bytes(DAMAGE[damage](victim.read_text(encoding="utf-8")).encode())
    before = victim.read_bytes()
    outcome = settle_files(tmp_path, modules.texts, True, [], "yarnverify generate")
    assert outcome.differs and any("differentiated/stretch.py" in line for line in outcome.lines)
    assert "yarnverify generate" in outcome.lines[-1] and victim.read_bytes() == before
    settle_files(tmp_path, modules.texts, False, [], "")
    assert not settle_files(tmp_path, modules.texts, True, [], "").differs


def test_missing_and_stale_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Named as one would name them here."""
    assert settle_files(tmp_path, {"a.py": "x\n"}, True, [], "again").lines[0] == f"{tmp_path / 'a.py'}: is missing"
    monkeypatch.chdir(tmp_path.parent)
    found = settle_files(tmp_path, {"a.py": "x\n"}, True, [], "again").lines[0]
    assert found == f"{tmp_path.name}/a.py: is missing"
    (tmp_path / "old.py").write_text("", encoding="utf-8")
    assert settle_files(tmp_path, {}, True, ["old.py"], "again").differs
    assert not settle_files(tmp_path, {}, False, ["old.py"], "again").differs
    assert not (tmp_path / "old.py").exists()


def test_a_folder_that_cannot_be_written_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(NotRunError, match="cannot write"):
        settle_files(tmp_path / "file", {"a.py": "x"}, False, [], "")


def test_generate_agrees_with_the_package(modules: Modules, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("yarnverify.symbolic.modules.kernel_modules", lambda *_: modules)  # once afresh is enough
    outcome = generate_kernels(True, cache=False)
    assert not outcome.differs and outcome.record == modules.operations
    assert set(outcome.record) == {*ENERGIES, *PHYSICS}
    assert outcome.record["bending"]["differentiated"]["evaluate"] > 0


@energy(unit="J", domain=r"u_1 > u_0")
def volume(x0: Point, x1: Point, x2: Point, u0: Sliding, u1: Sliding, *, k: Positive["N m^-4"]) -> Expr:
    """A product of coordinates that no length or angle describes."""
    return k * ((x1 - x0).T * (x2 - x0)) ** 2 * (u1 - u0)


@energy(unit="J")
def sag(x0: Point, x1: Point, x2: Point, *, k: Positive["N"]) -> Expr:
    """The length of a vector that joins no two points."""
    return k * length(x0 + x1 - 2 * x2)


def test_an_energy_without_measures_is_differentiated_plainly() -> None:
    made = plain_program(sag, declared_section(sag))
    assert len(made.gradient) == 9 and len(made.hessian) == 45
    found = proved(sag, Declarations((sag,)))
    for variant, noted in (("accurate", ["no law of lengths and one angle of segments"]), ("differentiated", [])):
        programs, notes = derived_programs(sag, found, variant)
        assert len(programs) == 1 and [note.partition(":")[0] for note in notes] == noted
        assert (statements(programs[0]) == statements(made)) is (variant == "differentiated")
    record = explain_energy(sag, Declarations((sag,)))
    assert not record["measures"] and "Proof: none of plain differentiation" in explain(record, "text")


def test_a_rational_energy_is_differentiated_through_its_sums_and_proved() -> None:
    found = proved(volume, Declarations((volume,)))
    assert found.rational is not None
    programs, notes = derived_programs(volume, found, "fast")
    assert len(programs[0].gradient) == 11 and not notes
    plain, _ = derived_programs(volume, found, "differentiated")
    assert [statements(p) for p in plain] == [statements(plain_program(volume, declared_section(volume)))]
    record = explain_energy(volume, Declarations((volume,)))
    assert not record["measures"] and "Proved exactly: gradient and Hessian" in explain(record, "text")


def test_a_block_that_is_not_proved_is_not_emitted(declarations: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from yarnverify.symbolic.derive import Measure

    right = Measure.slope.fget  # type: ignore[attr-defined]
    monkeypatch.setattr(Measure, "slope", property(lambda self: tuple((a, -v, f) for a, v, f in right(self))))
    bending = next(e for e in declarations.energies if e.name == "bending")
    with pytest.raises(NotRunError, match="bending: derived block F_x1 is refuted"):
        proved(bending, declarations)


CANNOT_BE_PRINTED = [
    (r"\quad (25)$$", "there is no formula for dF_x1/du1"),
    ("## Bending", "has no section for it"),
]


@pytest.mark.parametrize(("gone", "message"), CANNOT_BE_PRINTED)
def test_a_document_that_lacks_a_formula(gone: str, message: str, source: Source, declarations: Any) -> None:
    lines = [line for line in source.text.splitlines() if gone not in line or gone.startswith("##")]
    text = "\n".join(lines).replace("## Bending", "## Other") if gone.startswith("##") else "\n".join(lines)
    bending = next(e for e in declarations.energies if e.name == "bending")
    with pytest.raises(NotRunError, match=message):
        printed_program(bending, read_with(Source("d.md", text), declarations))


# -- derivations ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ENERGIES)
def test_a_derivation_can_be_followed(name: str) -> None:
    record = explanation(name)
    titles = [step["title"] for step in record["steps"]]
    assert titles[0] == "Energy" and titles[-5:] == ["Law", "Chain rule", "Forces", "Jacobians", "Unchanged by"]
    assert record["all_proved"] and json.loads(json.dumps(record)) == record
    for form, mark in (("text", "∂V/∂q"), ("latex", r"\["), ("markdown", "$$")):
        shown = explain(record, form)
        assert mark in shown and "Proved exactly" in shown


@pytest.mark.parametrize("name", ENERGIES)
def test_results_of_a_derivation_can_be_read_back(name: str) -> None:
    steps = [step for step in explanation(name)["steps"] if step["title"] in ("Forces", "Jacobians")]
    assert len(steps) == 2
    for step in steps:
        for formula in step["formulas"]:
            for side in formula["latex"].split(" = "):
                read_formula(side)


def test_an_unknown_energy_is_named_with_those_there_are() -> None:
    with pytest.raises(InputError, match=r"no energy 'bend' is declared in .*; there are: bending, gravity, kinetic"):
        explanation("bend")


PLAIN = [
    (r"\frac{1}{2} k (\theta - \phi)^2", "(1 / 2) k (θ - φ)²"),
    (r"-\sin^2 \theta \mathbf{P}_1 \mathbf{d}_2^T", "-sin² θ P1 d2ᵀ"),
    (r"\|\mathbf{x}_1 - \mathbf{x}_0\| + |u_1| - \sqrt{\pi}", "|x1 - x0| + |u1| - √(π)"),
    (r"\mathbf{a} \times \mathbf{b} - \mathbf{I} \mathbf{c}", "a × b - I c"),
    (r"\mathbf{a} \cdot (-\mathbf{b})", "a · (-b)"),
    (r"\frac{\partial F_{u_1}}{\partial \mathbf{x}_0} V_{0,1}", "∂F_u1/∂x0 V_0,1"),
    (r"\frac{a b}{c + d} \bar{\theta}_0^{-1}", "(a b / (c + d)) bar_θ0⁻¹"),
    (r"\cos (a + b) - (-c)", "cos (a + b) - -c"),
]


@pytest.mark.parametrize(("tex", "text"), PLAIN)
def test_plain_text(tex: str, text: str) -> None:
    assert plain(read_formula(tex)) == text


# -- report -----------------------------------------------------------------------------------------------------------


# what commands of their own measure, and the pages show
MEASURED = {f"records/{name}.json" for name in reporting.MEASURED}


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("reports")
    (out / "records").mkdir()
    shutil.copytree(Path(__file__).parent.parent / "reports" / "pictures", out / "pictures")
    for name in MEASURED:
        shutil.copy(Path(__file__).parent.parent / "reports" / name, out / name)
    assert not build_report(out, False).differs
    return out


def test_committed_pages_are_what_the_records_give(report: Path) -> None:
    committed = Path(__file__).parent.parent / "reports"
    names = {path.relative_to(report).as_posix() for path in report.rglob("*") if path.is_file()} - MEASURED
    names = {name for name in names if not name.startswith("pictures/")} - {"report.html"}
    there = {path.relative_to(committed).as_posix() for path in committed.rglob("*") if path.is_file()}
    assert names == {name for name in there if not name.startswith(("pictures/", "scenes/"))} - MEASURED - {
        "report.html"
    }
    for name in sorted(names):
        assert (report / name).read_bytes() == (committed / name).read_bytes(), f"{name} differs: run yarnverify report"


def test_the_html_report_shows_the_scenes_as_the_pages_do(report: Path) -> None:
    page = (report / "report.html").read_text(encoding="utf-8")
    for scene in ("a cloth hung by two corners", "a cloth draped over a sphere", "a yarn pulled out of a cloth"):
        assert f'alt="The end of the scene: {scene}"' in page


def test_a_damaged_page_is_shown(report: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(report, tmp_path / "copy")
    page = copy / "bending.md"
    page.write_text(page.read_text(encoding="utf-8").replace("REFUTED", "PROVED", 1), encoding="utf-8")
    outcome = build_report(copy, True)
    assert outcome.differs and any(line.startswith("-| (18)") and "PROVED" in line for line in outcome.lines)


def test_links_of_the_pages_lead_somewhere(report: Path) -> None:
    import re

    root = Path(__file__).parent.parent
    for page in report.glob("*.md"):
        for target in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
            assert (report / target).exists() or (root / "reports" / target).resolve().exists(), (page.name, target)


def test_a_report_needs_a_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="is not a folder"):
        build_report(tmp_path / "file", False)


def test_a_report_with_a_new_mistake_is_not_as_expected(
    source: Source, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, record: dict[str, Any]
) -> None:
    """Pages of a document with what the paper does not have: a missing block, a wrong definition, no correction."""
    from yarnverify.library import Shelf, derivations
    from yarnverify.symbolic.record import prove_source
    from yarnverify.verdicts import settle

    text = source.text.replace(r"\arccos \left(-\mathbf{d}_1^T", r"\arccos \left(\mathbf{d}_1^T")
    text = "\n".join(line for line in text.splitlines() if r"\quad (11)$$" not in line and not line.endswith("(30)$$"))
    text = text.replace(r"(\|\mathbf{w}_1\|^2 - 1)", r"(\|\mathbf{w}_1\|^3 - 7 u_0)")
    shelf = Shelf(derivations(), MAIN_DOCUMENT, "")
    found = prove_source(Source(MAIN_DOCUMENT, text), shelf)
    settle(found, shelf, ())
    monkeypatch.setattr(reporting, "verdicts", lambda document, advance: (found, "made"))
    outcome = build_report(tmp_path, False)
    assert outcome.differs and not outcome.record["as_expected"]
    index, stretch, bending = (
        (tmp_path / name).read_text(encoding="utf-8") for name in ("README.md", "stretch.md", "bending.md")
    )
    assert "lacks dF_x" in index or "lacks dF_u" in index
    assert "**The document's list of forces and Jacobians lacks:**" in stretch
    assert "Derived:" in stretch and "**New:** not in `errata.toml`." in stretch
    assert "follows from equation (12)" in bending
