"""The search finds what is broken, shrinks it, prints what can be pasted, and keeps to its time."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
import warnings
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.cases import GENERIC, ORIGIN, X, Y, bent, sheared, stretched, touching
from tests.variants import kernel
from yarnverify.accuracy.truth import truth
from yarnverify.errors import InputError
from yarnverify.fuzzing import command, search
from yarnverify.fuzzing.judge import Flaw, declared, judge, points_of
from yarnverify.fuzzing.labels import labels
from yarnverify.kernels import ElementError
from yarnverify.strategies import Element, element, elements


def broken(change: Any, energy: str = "bending", variant: str = "accurate") -> Any:
    """A kernel whose results are changed before they are returned."""
    good = kernel(energy, variant)

    def energy_(q: Any, **parameters: Any) -> Any:
        return change(good.energy(q, **parameters), q)

    def evaluate(q: Any, **parameters: Any) -> Any:
        return tuple(change(array, q) for array in good.evaluate(q, **parameters))

    energy_.__name__ = "energy"
    return SimpleNamespace(
        DOFS=good.DOFS,
        PARAMETERS=good.PARAMETERS,
        VARIANT=variant,
        KERNEL=good.KERNEL,
        energy=energy_,
        evaluate=evaluate,
    )


def warn(array: Any, q: Any) -> Any:
    warnings.warn("divide by zero encountered", RuntimeWarning, stacklevel=2)
    return array


def refuse(array: Any, q: Any) -> Any:
    raise ElementError("bending: element 0: too hard", np.array([0]))


FLAWS = [
    (lambda array, q: array * (1 + 2.0**-48), "error", "E is wrong by 32 u, allowed are 16 u"),
    (lambda array, q: array * np.nan, "not finite", "E is not finite where the truth is"),
    (warn, "warning", "energy warns: divide by zero encountered"),
    (refuse, "refused", "energy is refused where it has a value: bending: element 0: too hard"),
]


@pytest.mark.parametrize(("change", "kind", "text"), FLAWS)
def test_every_kind_of_flaw_is_seen(change: Any, kind: str, text: str) -> None:
    flaw = judge(broken(change), declared("bending"), bent(X, Y)).flaws[0]
    assert flaw.kind == kind
    # the error of the kernel itself, a few u, comes on top of what was put in
    assert flaw.text.split(" by ")[0] == text.split(" by ")[0]
    assert kind != "error" or 1.5 < flaw.size < 3


def test_numbers_where_there_is_no_value_are_seen() -> None:
    good = kernel("bending", "accurate")
    careless = SimpleNamespace(
        VARIANT="accurate",
        KERNEL=good.KERNEL,
        energy=good.energy,
        evaluate=lambda q, **p: tuple(np.nan_to_num(a) for a in loose(q, **p)),
    )

    def loose(q: Any, **parameters: Any) -> Any:
        return good.evaluate(q, **parameters, errors="mask")

    careless.evaluate.__name__ = "evaluate"
    assert judge(careless, declared("bending"), bent(X, X)).flaws == (
        Flaw("accepted", "evaluate", "evaluate gives numbers where there is no value in this format"),
    )


def test_a_good_kernel_has_no_flaw() -> None:
    for energy, one in {
        "bending": bent(GENERIC, X),
        "shear": sheared(GENERIC, X),
        "stretch": stretched(X, 2.0),
    }.items():
        judged = judge(kernel(energy, "accurate"), declared(energy), one)
        assert judged.flaws == () and judged.worst < 1


def test_fast_is_allowed_what_the_inputs_lose() -> None:
    """The same error is a flaw of ``accurate`` and none of ``fast`` where the result depends strongly on the inputs."""
    far = bent(X, Y - 1e-3 * X, 1e6 * GENERIC)
    for variant, expected in (("accurate", {"error"}), ("fast", set())):
        module = broken(lambda array, q: array * (1 + 2.0**-45), variant=variant)
        assert {flaw.kind for flaw in judge(module, declared("bending"), far).flaws} == expected


def test_a_true_value_half_way_between_two_doubles_is_a_value() -> None:
    """Found by a search: no precision makes both ends of such a ball round to the same double."""
    near_rest = element(
        "0x0p+0 0x0p+0 0x0p+0 -0x1.be13201737bdbp-32 0x1.c85a3f3016caap-34 -0x1.bfdcdad8e6b6fp-33 0x0p+0 0x1p-31",
        k_s="0x1.000000000023bp+7",
    )
    assert truth(declared("stretch"), points_of([near_rest])).has_derivatives.all()


BREAK_AT = 2.0**-20


def break_near(array: Any, q: Any) -> Any:
    """Wrong by far, where the second segment lies within 1e-6 of the plane of x and y without being in it."""
    return array * 1.5 if 0 < abs(q[8, 0]) < BREAK_AT else array


def search_broken(monkeypatch: pytest.MonkeyPatch, seconds: float = 60.0, most: float = 400) -> search.Search:
    monkeypatch.setattr(search, "_kernel", lambda energy, variant, folder: broken(break_near))
    return search.search("bending", "accurate", seconds, 1, most=most)


def test_a_planted_flaw_is_found_shrunk_and_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    found = search_broken(monkeypatch)
    assert found.cases == 400
    assert sum(found.regimes.values()) >= 400 and len(found.regimes) > 4
    case = next(case for case in found.found if case.flaw.where == "E")
    assert case.flaw.kind == "error" and "u, allowed are 16 u" in case.line
    line, comment = case.line.split("  # ")
    assert comment == case.flaw.text
    values = case.element.q[:, 0]
    assert 0 < abs(values[8]) < BREAK_AT
    assert np.count_nonzero(values) <= 6, "shrunk: most coordinates are zero"

    seen: list[Element] = []

    @given(st.nothing() | elements("bending"))
    def test(one: Element) -> None:
        seen.append(one)

    eval(line.removeprefix("@"), {"example": example, "element": element})(test)()
    assert seen[0].q.tobytes() == case.element.q.tobytes() and seen[0].parameters == case.element.parameters
    assert judge(broken(break_near), declared("bending"), seen[0]).flaws


def test_the_same_seed_finds_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = (search_broken(monkeypatch, most=150).record() for _ in range(2))
    assert first == second
    assert first["cases"] == 150
    json.dumps(first)


def test_what_was_found_is_kept_when_the_time_is_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock is moved on when the first flaw has been seen."""
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(search.time, "monotonic", lambda: clock.now)
    good = search.judge

    def judged(*given: Any) -> Any:
        outcome = good(*given)
        clock.now += 1000 if outcome.flaws else 0
        return outcome

    monkeypatch.setattr(search, "judge", judged)
    found = search_broken(monkeypatch, seconds=10)
    assert found.found and not found.interrupted and clock.now == 1000


def test_a_search_ends_even_if_no_element_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    def busy(progress: Any, number: int) -> None:
        while True:
            pass

    monkeypatch.setattr(search, "_round", busy)
    assert search.search("stretch", "accurate", 0.1, 1).cases == 0


def test_what_was_found_is_kept_on_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(label: str, total: int) -> None:
        if not label.endswith(" 0 found"):
            raise KeyboardInterrupt

    monkeypatch.setattr(search, "_kernel", lambda energy, variant, folder: broken(lambda array, q: array * 2, energy))
    lines, record = command.fuzz(None, "accurate", 1000.0, 1, interrupt)
    assert len(record) == 1 and record[0]["found"]
    assert lines[-1] == "interrupted; not run: bending, shear, parallel_contact"


def test_what_is_asked_for_wrongly() -> None:
    for given_, text in [
        (
            ("twist", "accurate", 1.0),
            "there is no energy 'twist'; one of bending, gravity, kinetic, parallel_contact, plane, shear, ",
        ),
        (("shear", "best", 1.0), "there is no variant 'best'; one of accurate, fast"),
        (("shear", "accurate", 0.0), "--time must be a positive number of seconds, not 0.0"),
        (("shear", "accurate", np.nan), "--time must be a positive number of seconds, not nan"),
    ]:
        with pytest.raises(InputError) as caught:
            command.fuzz(*given_, None, lambda label, total: None)
        assert str(caught.value).startswith(text)


LABELS = [
    ("bending", bent(X, -X), ["edges antiparallel within 0.001"]),
    ("bending", bent(X, 1e5 * (X + 1e-4 * Y)), ["edges parallel within 0.001", "lengths unequal by more than 1000"]),
    ("shear", sheared(X, Y, 1e4 * X), ["edges perpendicular within 0.001", "further than 1000 lengths away"]),
    ("shear", sheared(1e-20 * X, 1e-20 * (X + Y)), ["tiny or huge"]),
    ("shear", sheared(X, ORIGIN), ["a segment of length zero"]),
    ("bending", bent(X, X + Y), ["plain"]),
    ("stretch", stretched(X, 1.0), ["at rest within 0.001"]),
    ("stretch", stretched(X, 2.0), ["compressed"]),
    ("stretch", stretched(X, 0.5), ["plain"]),
    ("parallel_contact", touching(0.5), ["within 0.001 of contact"]),
    ("parallel_contact", touching(0.1), ["in contact"]),
    ("parallel_contact", touching(0.9), ["apart"]),
]


@pytest.mark.parametrize(("energy", "one", "expected"), LABELS)
def test_regimes_are_told_from_the_numbers(energy: str, one: Element, expected: list[str]) -> None:
    assert labels(kernel(energy, "accurate").DOFS, one) == expected


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "yarnverify", "fuzz", *arguments], capture_output=True, text=True)


def test_the_command(tmp_path: Any) -> None:
    good = run("parallel_contact", "--time", "2", "--seed", "3")
    assert good.returncode == 0, good.stdout + good.stderr
    assert good.stdout.startswith("parallel_contact, accurate: nothing found in ")
    assert "within 0.001 of contact" in good.stdout and "(seed 3, limit 16 u)" in good.stdout
    bad = run(
        "bending", "--time", "4", "--seed", "3", "--variant", "differentiated", "--json", str(tmp_path / "found.json")
    )
    assert bad.returncode == 1, bad.stdout + bad.stderr
    assert '\n@example(element("0x' in bad.stdout
    (record,) = json.loads((tmp_path / "found.json").read_text())
    assert record["found"] and record["variant"] == "differentiated"
    wrong = run("twist")
    assert (wrong.returncode, wrong.stdout, wrong.stderr.count("\n")) == (2, "", 1)


def test_without_hypothesis_the_command_says_what_to_install() -> None:
    code = (
        "import sys; sys.modules['hypothesis'] = None; sys.argv[1:] = ['fuzz']; from yarnverify.cli import main; main()"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (shown.returncode, shown.stderr) == (3, "the search needs Hypothesis: pip install 'yarnverify[fuzz]'\n")


def test_an_alarm_waits_until_the_collector_is_timed() -> None:
    """Of an error in there Python prints a trace, and goes on as if nothing had been."""
    reached = []

    def gc_callback() -> None:
        end = time.monotonic() + 0.1
        while time.monotonic() < end:
            pass
        reached.append(rung.is_set())

    rung = threading.Event()
    with pytest.raises(search._Stop), search._alarm(0.02, rung):
        gc_callback()
        time.sleep(5)
    assert reached == [True]
