"""The record: plain data, the same on every run, with exact witnesses and the effect of each mistake."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from yarnverify.library import Shelf, shelf_for
from yarnverify.source import Source
from yarnverify.symbolic.record import SCHEMA, prove_source

Record = dict[str, Any]


def flat(value: Any) -> list[str]:
    return [part for item in value for part in flat(item)] if isinstance(value, list) else [value]


def claim(record: Record, equation: str) -> Record:
    return next(c for c in record["claims"] if c["equation"] == equation)


def test_a_record_is_json_that_reads_back_the_same(record: Record) -> None:
    assert json.loads(json.dumps(record, allow_nan=False)) == record
    assert record["schema"] == SCHEMA == 1


def test_a_record_does_not_depend_on_hashes(folder: Path) -> None:
    script = (
        "import hashlib, json, sys; from pathlib import Path; from yarnverify.library import shelf_for;"
        "from yarnverify.source import load; from yarnverify.symbolic.record import prove_source;"
        "p = Path(sys.argv[1]); s = load(p);"
        "print(hashlib.sha256(json.dumps(prove_source(s, shelf_for(p, s.text))).encode()).hexdigest())"
    )
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", script, str(folder / "cirio2014.md")],
            env={**os.environ, "PYTHONHASHSEED": seed}, stdout=subprocess.PIPE, text=True,
        )
        for seed in ("1", "2")
    ]  # fmt: skip
    first, second = (run.communicate(timeout=120)[0] for run in runs)
    assert len(first.strip()) == 64
    assert first == second


def test_every_claim_names_its_place(record: Record, source: Source) -> None:
    lines = source.text.split("\n")
    for c in record["claims"]:
        assert rf"\quad ({c['equation']})" in lines[c["line"] - 1]
        assert c["column"] >= 1


def test_a_witness_is_exact(record: Record) -> None:
    witnesses = [c["witness"] for c in record["claims"] if c["witness"]]
    assert len(witnesses) == 2  # (18) and (21); (8) is refuted for its symbol
    for witness in witnesses:
        assert witness["point"].keys() == witness["hex"].keys()
        rationals, hexes = (flat([*witness[key].values()]) for key in ("point", "hex"))
        assert [Fraction(text) for text in rationals] == [Fraction(float.fromhex(text)) for text in hexes]
        for printed, true, residual in zip(*(witness[key] for key in ("printed", "true", "residual")), strict=True):
            assert float(residual) == pytest.approx(float(printed) - float(true), rel=1e-12, abs=1e-14)
        assert any(abs(float(r)) > 0.1 for r in witness["residual"])


@pytest.mark.parametrize("equation", ["18", "21"])
def test_the_effect_of_a_wrong_stiffness_is_its_spectrum(record: Record, equation: str) -> None:
    """With t the turning angle, dF/dx = 2 k/(l^2 du) (t c/s (..) - ..): at rest -k on the plane, and +k if the sign is lost."""
    effect = claim(record, equation)["effect"]
    assert "printed 1, 1, 0; true 0, -1, -1" in effect
    assert "negative in 2 directions, the true one in 0" in effect
    assert "2^-20 m aside" in effect


def test_a_missing_symbol_has_no_effect_and_no_witness(record: Record) -> None:
    found = claim(record, "8")
    assert (found["reason"], found["witness"], found["effect"]) == ("undefined symbol k", None, None)
    assert found["correction"].endswith(r"\frac{k_s}{l_1} \mathbf{P}_1 - \frac{k_s}{\Delta u} \mathbf{I}")


def test_a_proved_claim_carries_nothing_to_explain(record: Record) -> None:
    for c in record["claims"]:
        if c["verdict"] == "proved":
            assert not any((c["reason"], c["because"], c["correction"], c["change"], c["witness"], c["effect"]))


STRETCH = r"""
## Stretch

Assumed: $\Delta u = u_1 - u_0 > 0$.

$$l_1 = \|\mathbf{x}_1 - \mathbf{x}_0\| \quad (1)$$

$$V = \frac{1}{2} k_s \Delta u (\frac{l_1}{\Delta u} - 1)^2 \quad (2)$$

"""


def stretch(folder: Path, line: str, declared: bool = True) -> Record:
    shelf = Shelf(folder, "cirio2014.md", "") if declared else Shelf(None, "made.md", "by itself")
    record = prove_source(Source("made.md", STRETCH + line), shelf)
    return next(c for c in record["claims"] if c["equation"] == "3")


FORCE = r"$$F_{u_1} = -F_{u_0} = k_s (\frac{l_1}{\Delta u} + 1) \quad (3)$$"
JACOBIAN = (
    r"$$-\frac{\partial \mathbf{F}_{\mathbf{x}_1}}{\partial \mathbf{x}_0} "
    r"= -\frac{\partial \mathbf{F}_{\mathbf{x}_0}}{\partial \mathbf{x}_1}"
    r" = \frac{k_s}{\Delta u} \mathbf{I} \quad (3)$$"
)
IDENTITY = r"$$\frac{\partial l_1}{\partial \mathbf{x}_1} = 2 \frac{1}{l_1} (\mathbf{x}_1 - \mathbf{x}_0)^T \quad (3)$$"


def test_the_effect_of_a_wrong_force_is_its_values(folder: Path) -> None:
    assert stretch(folder, FORCE)["effect"] == "at rest: printed 2; true 0"


def test_the_effect_on_a_block_off_the_diagonal_counts_no_directions(folder: Path) -> None:
    effect = stretch(folder, JACOBIAN)["effect"]
    assert effect == "eigenvalues at rest: printed -1, -1, -1; true 1, 0, 0"


def test_what_is_no_block_or_undeclared_has_no_effect(folder: Path) -> None:
    assert stretch(folder, IDENTITY)["effect"] is None
    assert stretch(folder, FORCE, declared=False)["effect"] is None


def test_an_undeclared_document_says_so(source: Source) -> None:
    part = Source("made.md", STRETCH + FORCE)
    record = prove_source(part, Shelf(None, "made.md", "by itself alone"))
    assert record["judged"] == "by itself alone"
    assert [(g["equation"], g["kind"]) for g in record["given"] if not g["equation"].startswith("line")] == [
        ("1", "definition"),
        ("2", "energy"),
    ]
    assert shelf_for(Path("cirio2014.md"), source.text).document == "cirio2014.md"


def test_progress_has_a_total(folder: Path) -> None:
    told: list[tuple[str, int]] = []
    prove_source(Source("made.md", STRETCH + FORCE), Shelf(folder, "cirio2014.md", ""), lambda *step: told.append(step))
    assert told and all(label.startswith("equation (") and total > 0 for label, total in told)
    assert len(told) <= told[0][1]
