"""``yarnverify check``: right implementations pass in every manner, mistakes are called by their names, crashes survived."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.sparse import csc_matrix

from yarnverify.check.command import Checked, check
from yarnverify.check.factors import number_text
from yarnverify.check.setting import Options, Setting, write_states
from yarnverify.check.show import grouped, record
from yarnverify.cli import app
from yarnverify.errors import InputError, NotRunError

ZOO = str(Path(__file__).parent / "implementations.py")
ONE = ("moderate",)
COMPILER = shutil.which("cc") or shutil.which("gcc")


def checked(name: str, energy: str | None = None, **options: Any) -> Checked:
    return check(
        name if name.startswith("yarnverify.") else f"{ZOO}:{name}", Options(energy=energy, count=6, **options)
    )


def said(found: Checked) -> str:
    """All reasons of all blocks, one line a group."""
    lines = []
    for blocks, diagnosis in grouped(found):
        if diagnosis.status != "pass":
            names = " ".join(f"{block.kind}[{block.name}]" for block in blocks)
            lines.append(f"{diagnosis.status}: {names}: {'; '.join(diagnosis.reasons)}")
    return "\n".join(lines)


# -- what is right passes -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("energy", "variant"),
    [*((energy, "accurate") for energy in ("stretch", "bending", "shear", "parallel_contact")), ("bending", "fast")],
)
def test_kernels_of_the_package_pass(energy: str, variant: str) -> None:
    found = check(f"yarnverify.kernels.{variant}.{energy}", Options(count=4, extreme=True))
    assert found.passes, said(found)
    if variant == "accurate":
        assert max(block.error for block, _ in found.found) <= 16


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("bending_of_arrays", {}),
        ("bending_element_first", {}),
        ("bending_by_name", {}),
        ("bending_blocks", {"force": True, "jacobian": True, "returns": ("x1", "x2", "x1,x2")}),
        ("bending_previous_middle_next", {"order": "x2,x0,x1,u2,u1"}),
        ("bending_of_nodes", {"order": "x0,u0,v0,x1,u1,v1,x2,u2,v2", "returns": ("force", "jacobian")}),
        ("bending_force_unsaid", {"force": True}),
        ("bending_force_unsaid", {"returns": ("_", "force", "hessian")}),
        ("stretch_by_radius", {"given": ("R=0.25", "Y=k_s/(pi*R**2)")}),
        ("bending_without_stiffness", {"fix": ("k_b=1",)}),
        ("bending_half", {"given": ("k_b=k_b/(0.5)",)}),
        (
            "stretch_sliding_forces",
            {"returns": ("u0", "u1"), "force": True, "regimes": ("moderate", "sliding", "ratios")},
        ),
        ("stretch_forces_in_a_row", {"returns": ("F_x0", "F_x1", "F_u0", "F_u1")}),
        ("stretch_forces_in_a_row", {"layout": "element", "force": True, "returns": ("x0", "x1", "u0", "u1")}),
        ("stretch_forces_in_a_row", {"force": True}),
        ("stretch_forces_by_name", {}),
        ("stretch_F", {}),
        ("stretch_sparse", {}),
        ("stretch_of_points_and_slides", {}),
        ("stretch_of_points_backwards", {"order": "x1,x0,u1,u0"}),
        ("segment.stretch", {"energy": "stretch", "fix": ("k_s=2",)}),
        ("gravity_by_name", {"regimes": ONE}),
        (
            "contact_of_other_names",
            {
                "energy": "parallel_contact",
                "given": ("left=u0", "right=u1", "stiffness=k_c*L", "R=d/4"),
                "regimes": ONE,
            },
        ),
        ("bending_of_a_chain", {"order": "x1,x0,x2,u1,u2", "given": ("x0=x1", "x1=x0")}),
    ],
)
def test_right_ones_pass_in_every_manner(name: str, options: dict[str, Any]) -> None:
    found = checked(name, **{"regimes": ("moderate", "near rest", "exact"), **options})
    assert found.passes, said(found)
    assert found.found and all(block.judged.any() for block, _ in found.found)


def test_single_precision_is_held_to_its_own_unit() -> None:
    assert checked("yarnverify.kernels.bending", float32=True).passes


# -- mistakes are recognised ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("bending_factor", "wrong: G[x1]: is 2 times what it should be"),
        ("bending_half", "is 1/2 times what it should be"),
        ("bending_without_stiffness", "lacks a factor k_b"),
        ("bending_without_length", "wrong: H[x1,x1]: lacks a factor 1/|x1 - x0|"),
        ("bending_angle_unsquared", "wrong: G[u1] G[u2]: lacks a factor angle"),
        ("bending_transposed", "wrong: H[x1,x2]: is transposed"),
        ("stretch_without_projection", "wrong: H[x1,x1]: is off by a multiple of P_1: that term is wrong, or missing"),
        ("bending_sign_of_a_term", "wrong: H[x1,x1]: is off by a multiple of d_1 d_2^T P_1: that term is wrong"),
        ("bending_chord", "wrong: E[]: takes 2 sin(angle/2) for the angle, and so 2 (1 - cos(angle)) for its square"),
        ("bending_chord", "wrong: G[x1]: lacks a factor (|x1 - x0| + |x0 - x2|)/(u1 - u2)"),
        ("bending_chord", "wrong: G[x2]: lacks a factor angle/sin(angle)"),
        ("bending_swapped", "wrong: G[x1]: is the block x2: indices are swapped"),
        ("bending_left_out", "wrong: H[u1,u1]: is zero, as if left out"),
        ("shear_gauss_newton", "holds first derivatives only (Gauss-Newton)"),
        ("shear_definite", "has its negative eigenvalues set to zero"),
        ("shear_rounded_pi", "wrong: G[x0] G[x1] G[x3]: takes 1.57 for pi/2"),
        ("bending_sign_and_length", "wrong: H[x1,x1]: lacks a factor 1/|x1 - x0|, and has the wrong sign"),
        (
            "bending_printed_with_a_step",
            "H[x1,x1]: is what the document prints, misprint included: equation (18), times 1e-06",
        ),
        (
            "bending_printed_with_two_stiffnesses",
            "H[x1,x1]: is what the document prints, misprint included: equation (18), times 2 k_b",
        ),
        ("bending_supplement", "takes pi minus the angle for the angle: its cosine has the wrong sign"),
        ("bending_sum_left_out", "wrong: G[x0]: lacks minus x2: it is left out of a sum"),
        (
            "bending_lengths_exchanged",
            "wrong: G[x0]: is minus the sum of other blocks as they came: no mistake of its own",
        ),
        ("bending_two_left_out", "wrong: H[x0,x0]: lacks x1, x2 and x2, x1: they are left out of a sum"),
        ("stretch_of_the_weight_alone", "wrong: G[u0] G[u1]: is the energy over (u1 - u0): what is squared depends on"),
        (
            "stretch_sign_of_the_projection",
            "H[x1,x0] H[x1,x1]: is off by a multiple of P_1: that term is wrong, or missing",
        ),
        ("bending_reads_exchanged", "has x0 and x2 exchanged in what it reads, and not in what it gives"),
        (
            "bending_of_curvature",
            "takes 2 tan(angle/2), as discrete elastic rods have it, for the angle, and takes the present length for the rest "
            "length that it is spread on",
        ),
        ("shear_of_the_cosine", "wrong: E[]: takes cos(angle) for pi/2 - angle"),
        ("parallel_contact_nearer", "is right for 1/2 d in place of d"),
        ("gravity_upwards", "wrong: G[u0] G[u1]: has the wrong sign"),
        ("shear_in_degrees", "is (180/pi)^2 times what it should be: an angle in degrees"),
        ("shear_short_pi", "takes 1.57079632675 for pi/2"),
        ("bending_single_inside", "is in single precision"),
        ("bending_differences", "digits everywhere: a difference quotient"),
    ],
)
def test_mistakes_are_called_by_their_names(name: str, expected: str) -> None:
    found = checked(name, regimes=ONE)
    assert not found.passes
    assert expected in said(found)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("stretch_slack", "wrong: E[]: is zero where the yarn is shorter than at rest: the energy acts there too"),
        ("stretch_definite", "has its negative eigenvalues set to zero"),
        ("bending_zero_where_straight", "loses digits near a straight yarn"),
        ("bending_clamped", "near a straight yarn (as if the angle never came nearer than 0.001 rad"),
        ("bending_arccos", "is NaN or infinite near a straight yarn"),
        ("bending_arccos", "loses digits near a straight yarn (about u/angle^2)"),
    ],
)
def test_losses_are_called_by_their_names(name: str, expected: str) -> None:
    found = checked(name)
    assert not found.passes
    assert expected in said(found)


@pytest.mark.parametrize(("relative", "passes"), [(1e-16, True), (1e-12, False), (-1e-12, False)])
def test_every_block_is_judged_by_itself_and_relative_to_itself(relative: float, passes: bool) -> None:
    from yarnverify.check.cases import hard_cases
    from yarnverify.check.conventions import Results
    from yarnverify.check.judge import block_places, judged
    from yarnverify.kernels.accurate import bending

    cases = hard_cases("bending", None, "float64", 6, ONE, False, (("k_b", 1e-30),))
    all_given = {"E": np.ones((), bool), "G": np.ones(11, bool), "H": np.ones((11, 11), bool)}
    for kind in "EGH":
        for name, place in block_places(kind, cases):
            results = Results(*bending.evaluate(cases.points.q, **cases.points.parameters), all_given)
            results.part(kind)[place] *= 1 + relative
            failing = [(b.kind, b.name) for b in judged(results, cases, np.ones(len(cases), bool)) if not b.passes]
            assert failing == ([] if passes else [(kind, name)])


def test_only_the_mistaken_blocks_fail() -> None:
    assert [block.title for block, _ in checked("bending_factor", regimes=ONE).found if not block.passes] == [
        "gradient x1"
    ]
    assert [block.title for block, _ in checked("bending_transposed", regimes=ONE).found if not block.passes] == [
        "Hessian x1, x2"
    ]


@pytest.mark.parametrize(
    ("name", "options", "hint"),
    [
        ("bending_force_unsaid", {}, "matches with --force"),
        ("bending_all_signs", {}, "matches with --force --jacobian"),
        ("bending_of_arrays", {"force": True}, "matches with no --force"),
        ("bending_half", {}, "--with k_b=k_b/(1/2)"),
        (
            "bending_sign_and_length",
            {},
            "the signs are right with --force --jacobian; 1 block fails then, of 31, for other reasons",
        ),
        ("bending_mixed_signs", {}, "x0 x1 x2 have the sign of the gradient, u1 u2 have that of the force"),
        ("stretch_of_nodes", {"energy": "stretch"}, "matches with --order x0,u0,x1,u1 --force --jacobian"),
        ("bending_without_stiffness", {}, "matches with --fix k_b=1"),
        (
            "stretch_with_a_step",
            {},
            "the whole Hessian is 0.0001 times what it should be; if that is a squared time step",
        ),
        (
            "stretch_of_weft",
            {"order": "x0,x1,v0,u0,v1,u1"},
            "the Hessian u0, u1 came in the place of v0 by v1",
        ),
    ],
)
def test_another_convention_is_found(name: str, options: dict[str, Any], hint: str) -> None:
    found = checked(name, regimes=ONE, **options)
    assert not found.passes
    assert any(hint in text for text in found.hints), (found.hints, said(found))


def test_an_order_that_changes_nothing_is_no_explanation() -> None:
    found = check(f"{ZOO}:stretch_of_tension", Options(count=16))  # of six moderate states none is compressed
    assert "is zero where the yarn is shorter than at rest" in said(found) and not found.hints


def test_a_number_in_a_hint_is_as_short_as_it_may_be() -> None:
    assert number_text(1e-6, expression=True) == "1e-06"


def test_an_entry_in_the_place_of_the_other_yarn_is_found_besides_lost_digits() -> None:
    (*_, hint) = checked("bending_of_weft", order="x0,x1,x2,u1,v1,v2,u2").hints
    assert hint == "the Hessian u2, u2 came in the place of v2 by v2"


def test_no_sign_fits_blocks_that_differ_even_where_all_fail() -> None:
    found = checked("bending_mixed_signs_losing")
    assert not any(block.passes for block, _ in found.found)
    assert found.hints == [
        "signs differ from block to block, so that none fits all: x0 x1 x2 have the sign of the gradient, u1 u2 have that of "
        "the force"
    ]


def test_not_everything_is_doubled_where_the_rest_only_loses_digits() -> None:
    found = checked("bending_doubled_points")
    assert "wrong: G[x0] G[x1] G[x2]: is 2 times what it should be" in said(found) and not found.hints


def test_names_that_a_function_gives_and_nobody_knows() -> None:
    with pytest.raises(
        InputError, match=r"implementations.py:stretch_named_oddly returns: 'pull' is no output; there are"
    ):
        checked("stretch_named_oddly", regimes=ONE)


def test_a_force_where_there_should_be_none() -> None:
    found = checked("parallel_contact_always")
    assert not any(block.passes for block, _ in found.found)
    assert {d.reasons for _, d in found.found} == {("is not zero where the energy does not act",)}


def test_two_mistakes_in_one_block() -> None:
    options = {"force": True, "returns": ("x1", "x3"), "fix": ("k_x=120", "L=1"), "regimes": ONE}
    text = said(checked("shear_without_lengths", **options))
    assert "wrong: G[x1]: takes 1.57 for pi/2, and lacks a factor 1/(|x1 - x0| sin(angle))" in text
    assert "wrong: G[x3]: takes 1.57 for pi/2, and lacks a factor 1/(|x3 - x0| sin(angle))" in text


def test_other_names_are_found() -> None:
    (hint,) = checked("bending_of_a_chain").hints
    words = hint.split()
    given = tuple(words[i + 1] for i, word in enumerate(words) if word == "--with")
    assert checked("bending_of_a_chain", order=words[words.index("--order") + 1], given=given).passes


def test_another_order_is_found() -> None:
    (hint,) = checked("bending_previous_middle_next").hints
    assert hint.startswith("matches with --order x")
    assert checked("bending_previous_middle_next", order=hint.rpartition(" ")[2]).passes


def test_the_printed_formulas_fail_exactly_where_they_are_misprinted() -> None:
    found = checked("yarnverify.kernels.printed.bending", regimes=ONE)
    wrong = {block.name: diagnosis.reasons[0] for block, diagnosis in found.found if not block.passes}
    what = "is what the document prints, misprint included: equation "
    assert wrong["x1,x1"] == f"{what}(18)" and wrong["x2,x2"] == f"{what}(21)"
    assert set(wrong) == {"x1,x1", "x2,x2", "x0,x0", "x0,x1", "x0,x2", "x1,x0", "x2,x0"}
    assert all("a sum of mistaken Jacobians" in wrong[name] for name in wrong if "x0" in name)
    assert checked("yarnverify.kernels.printed.stretch", regimes=ONE).passes
    assert checked("yarnverify.kernels.printed.shear", regimes=ONE).passes


def test_a_small_stiffness_hides_nothing() -> None:
    assert checked("stretch_rounded_off", regimes=ONE).passes
    found = checked("stretch_rounded_off", regimes=ONE, fix=("k_s=1e-12",))
    assert not any(block.passes for block, _ in found.found)


# -- crashes and other bad manners ----------------------------------------------------------------------------------------


def test_a_crash_is_found_and_survived() -> None:
    found = checked("stretch_crash", regimes=("moderate", "sliding"))
    assert not found.passes
    (text, count, first), *_ = found.troubles
    assert text.startswith("crashes: SIG") and count <= 3
    q = found.cases.points.q[:, first]
    assert q[7] - q[6] < 0.3
    assert found.left and all(block.passes for block, _ in found.found if block.judged.any())


def test_a_hang_is_found_and_ended() -> None:
    found = checked("stretch_hang", regimes=ONE, time_limit=0.5)
    assert [text for text, *_ in found.troubles] == ["does not come back within 0.5 s"]
    assert found.cases.points.parameters["k_s"][found.troubles[0][2]] > 1.5


def test_an_exception_is_a_finding_where_there_is_a_value() -> None:
    found = checked("bending_raises", regimes=("moderate", "sliding"))
    assert [text for text, *_ in found.troubles] == ["ZeroDivisionError: segments too short"]
    assert all(block.passes for block, _ in found.found)


def test_nothing_came_back() -> None:
    found = checked("stretch_exit", regimes=ONE)
    assert not found.passes and found.troubles[0][0] == "ends its process" and not found.found


@pytest.mark.parametrize(
    ("target", "options", "error", "text"),
    [
        (f"{ZOO}:stretch_text", {}, InputError, "is not made of real numbers"),
        (f"{ZOO}:stretch_complex", {}, InputError, "is not made of real numbers but of complex128"),
        (
            f"{ZOO}:stretch_odd",
            {},
            InputError,
            "results of 7 numbers for a state of 8: say what they are with --returns",
        ),
        (
            f"{ZOO}:stretch_piece",
            {},
            InputError,
            "^[^;]* with --returns, such as --returns F_x1 for the force on x1, x1 for the gradient$",
        ),
        (
            f"{ZOO}:stretch_stranger",
            {},
            InputError,
            "youngs is no .*--with youngs=FORMULA; q gets the whole state, or write a function of those names around it$",
        ),
        (f"{ZOO}:bending_by_name", {"returns": ("energy",)}, InputError, "it gives 3 results, and --returns names 1"),
        (
            f"{ZOO}:Segment.stretch",
            {},
            InputError,
            r"is a method: make an object in .*, and name its own, .*implementations.py:OBJECT.stretch$",
        ),
        (f"{ZOO}:stretch_nowhere", {}, InputError, "there is no function stretch_nowhere; there are "),
        (f"{ZOO}:bending_half", {"order": "x0,x1,x2,u1"}, InputError, "u2 is missing"),
        (f"{ZOO}:bending_half", {"order": "x0,x1,x2,u1,u2,u2"}, InputError, "u2 comes twice"),
        (f"{ZOO}:bending_half", {"order": "x0,x1,x2,u1,u2,1"}, InputError, "'1' is no name"),
        (f"{ZOO}:bending_half", {"returns": ("x7",)}, InputError, "'x7' is no output"),
        (f"{ZOO}:bending_half", {"regimes": ("odd",)}, InputError, "has no such hard cases; there are moderate"),
        (f"{ZOO}:bending_half", {"fix": ("k=1",)}, InputError, "--fix k: bending has the parameters k_b"),
        (f"{ZOO}:bending_half", {"fix": ("k_b",)}, InputError, "give NAME=VALUE"),
        (f"{ZOO}:bending_half", {"given": ("k=sin(1)",)}, InputError, "only names, numbers"),
        (f"{ZOO}:bending_half", {"given": ("k=kk",)}, InputError, "'kk' in 'kk' is not known[^;]*; there are [^;]*$"),
        (
            f"{ZOO}:bending_half",
            {"given": ("k_b=2*kb",)},
            InputError,
            "'kb' in '2\\*kb' is not known.*; write an argument of yours on the left: k_b is the energy's$",
        ),
        (f"{ZOO}:bending_half", {"time_limit": 0.0}, InputError, "--time-limit"),
        ("nowhere.py:bending", {}, InputError, "nowhere.py: there is no such file"),
        ("nowhere_at_all:bending", {}, InputError, "there is no such module"),
        ("libnowhere.so:bending", {}, InputError, "libnowhere.so: there is no such file"),
        ("libnowhere.so", {"energy": "bending"}, InputError, "say which function"),
        ("numpy", {}, InputError, "say which energy with --energy; there are bending"),
        ("x.py:f", {"energy": "bent"}, InputError, "bent: no such energy; there are bending"),
        (f"{ZOO}:gravity_by_name", {"fix": ("g=1",)}, InputError, "--fix g: is a vector"),
    ],
)
def test_what_cannot_be_checked_says_why(
    target: str, options: dict[str, Any], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        check(target, Options(count=2, **options))


def test_files_that_cannot_be_imported(tmp_path: Path) -> None:
    bad, missing, two = tmp_path / "bending_bad.py", tmp_path / "bending_missing.py", tmp_path / "bending_two.py"
    bad.write_text("def f(q:\n")
    missing.write_text("import no_such_library\n")
    two.write_text("def a(q): ...\ndef b(q): ...\n")
    with pytest.raises(InputError, match=r"bending_bad.py:1:\d+: "):
        check(str(bad), Options(count=2))
    with pytest.raises(NotRunError, match="imports no_such_library, which is not installed here"):
        check(str(missing), Options(count=2))
    with pytest.raises(InputError, match=r"say which function.*there are a, b"):
        check(str(two), Options(count=2))


# -- C --------------------------------------------------------------------------------------------------------------------

_C = """
#include <math.h>
#include <stdlib.h>
typedef const double *in; typedef double *out;
void contact(in q, in p, out e, out g, out h) {
    double gap = q[1] - q[0] - p[2], k = gap < 0 ? p[0] * p[1] : 0;
    *e = 0.5 * k * gap * gap; g[1] = k * gap; g[0] = -g[1]; h[0] = h[3] = k; h[1] = h[2] = -k;
}
void too_far(in q, in p, out e, out g, out h) { contact(q, p, e, g, h); g[2] = 1; }
void too_little(in q, in p, out e, out g, out h) { double t[4]; contact(q, p, e, g, t); h[0] = t[0]; h[1] = t[1]; h[2] = t[2]; }
void meddles(double *q, in p, out e, out g, out h) { contact(q, p, e, g, h); q[0] = 0; }
void aborts(in q, in p, out e, out g, out h) { if (p[0] > 1.5) abort(); contact(q, p, e, g, h); }
void radius_first(in q, in p, out e, out g, out h) { double t[3] = {p[1], p[2], 4 * p[0]}; contact(q, t, e, g, h); }
void force_only(in q, in p, out f) { double e, g[2], h[4]; contact(q, p, &e, g, h); f[0] = -g[0]; f[1] = -g[1]; }
void single(const float *q, const float *p, float *e, float *g, float *h) {
    float gap = q[1] - q[0] - p[2], k = gap < 0 ? p[0] * p[1] : 0;
    *e = 0.5f * k * gap * gap; g[1] = k * gap; g[0] = -g[1]; h[0] = h[3] = k; h[1] = h[2] = -k;
}
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> str:
    if COMPILER is None:
        pytest.skip("no C compiler here")
    folder = tmp_path_factory.mktemp("c")
    (folder / "contact.c").write_text(_C)
    subprocess.run([COMPILER, "-shared", "-fPIC", "-O1", "contact.c", "-o", "contact.so"], cwd=folder, check=True)
    return str(folder / "contact.so")


@pytest.mark.parametrize(
    ("function", "options", "passes", "text"),
    [
        ("contact", {}, True, ""),
        ("force_only", {"returns": ("force",)}, True, ""),
        ("single", {"float32": True}, True, ""),
        ("too_far", {}, False, "writes 1 numbers past the end of gradient, which has 2"),
        ("too_little", {}, False, "does not write number 3 of hessian, which has 4"),
        ("meddles", {}, False, "changes its inputs"),
        ("aborts", {}, False, "crashes: SIGABRT"),
        (
            "single",
            {},
            False,
            "does not write number 1 of gradient, which has 2: are its numbers float? Then say --float32",
        ),
    ],
)
def test_c_functions(library: str, function: str, options: dict[str, Any], passes: bool, text: str) -> None:
    found = check(f"{library}:{function}", Options(energy="parallel_contact", count=6, **options))
    assert found.passes is passes, said(found)
    assert text in " ".join(what for what, *_ in found.troubles)


def test_another_order_of_the_arguments_is_found(library: str) -> None:
    options = Options(energy="parallel_contact", count=6, given=("kc=k_c", "L=L", "R=d/4"))
    (hint,) = check(f"{library}:radius_first", options).hints
    assert hint == "matches with the arguments in another order: --with R=d/4 --with kc=k_c --with L=L"
    assert check(f"{library}:radius_first", replace(options, given=("R=d/4", "kc=k_c", "L=L"))).passes


def test_a_file_with_a_function_for_each_block(tmp_path: Path) -> None:
    path = tmp_path / "stretch_blocks.py"
    path.write_text(_BLOCKS)
    found = check(str(path), Options(count=3))
    assert found.passes and [block.title for block, _ in found.found] == [
        "gradient x1", "gradient u1", "Hessian x1, x1", "Hessian u1, u1",
    ]  # fmt: skip


_BLOCKS = """
import numpy as np
def _parts(x0, x1, u0, u1):
    l = np.linalg.norm(x1 - x0)
    return l, (x1 - x0) / l, u1 - u0
def Fx1(x0, x1, u0, u1, ks):
    l, d, du = _parts(x0, x1, u0, u1)
    return -ks * (l - du) / du * d
def Fu1(x0, x1, u0, u1, ks):
    l, _, du = _parts(x0, x1, u0, u1)
    return ks * (l - du) * (l + du) / (2 * du**2)
def dFx1dx1(x0, x1, u0, u1, ks):
    l, d, du = _parts(x0, x1, u0, u1)
    return ks / l * (np.eye(3) - np.outer(d, d)) - ks / du * np.eye(3)
def dFu1_du1(x0, x1, u0, u1, ks):
    l, _, du = _parts(x0, x1, u0, u1)
    return -ks * l**2 / du**3
def helper(x): return x
"""


def test_tensors_where_the_target_imports_them(tmp_path: Path) -> None:
    """A module of PyTorch's name, whose functions refuse what is no tensor of its own."""
    (tmp_path / "torch.py").write_text(
        "import numpy as np\nclass Tensor(np.ndarray): pass\n"
        "def as_tensor(x): return np.asarray(x).view(Tensor)\n"
        "def where(c, a, b): return np.where(c.layout_of if not isinstance(c, Tensor) else c, a, b)\n"
    )
    (tmp_path / "contact_of_tensors.py").write_text(
        "import torch\n"
        "def contact(u0, u1, kc, L, d): return 0.5 * kc * L * torch.where(u1 - u0 < d, (u1 - u0 - d) ** 2, 0.0 * u0)\n"
    )
    found = check(f"{tmp_path}/contact_of_tensors.py:contact", Options(energy="parallel_contact", count=3))
    assert found.passes and [block.title for block, _ in found.found] == ["energy"]


def test_a_library_without_that_function(library: str) -> None:
    with pytest.raises(InputError, match=r'has no function bend; in C.., declare it extern "C"'):
        check(f"{library}:bend", Options(energy="bending", count=2))


# -- any other language: files --------------------------------------------------------------------------------------------

_PROGRAM = """
import json, sys
import numpy as np
from scipy.io import loadmat, savemat
from yarnverify.kernels.accurate import stretch
kind, source, sink = sys.argv[1:]
if kind == "csv":
    table = np.loadtxt(source, delimiter=",", skiprows=1)
    q, k_s = table[:, :8], table[:, 8]
elif kind == "npz":
    found = np.load(source)
    q, k_s = found["q"], found["k_s"]
elif kind == "mat":
    found = loadmat(source)
    q, k_s = found["q"], found["k_s"].ravel()
else:
    found = json.load(open(source))
    q, k_s = np.array(found["q"]), np.array(found["k_s"])
e, g, h = stretch.evaluate(q.T, k_s=k_s, errors="mask")
if kind == "csv":
    np.savetxt(sink, np.column_stack([e, g.T]), delimiter=",", fmt="%.17g")
elif kind == "npz":
    np.savez(sink, energy=e, force=-g.T)
elif kind == "mat":
    savemat(sink, {"E": e, "force": -g, "K": h, "key": found["key"], "work": np.array([1, "a", [2]], dtype=object)})
else:
    text = [[x.hex() if x == x else None for x in row] for row in (-g.T).tolist()]
    json.dump({"key": found["key"], "energy": [None if x != x else x for x in e.tolist()], "force": text}, open(sink, "w"))
"""


@pytest.mark.parametrize("kind", ["json", "npz", "mat", "csv"])
def test_a_command_that_reads_and_writes_files(tmp_path: Path, kind: str) -> None:
    program = tmp_path / "mine.py"
    program.write_text(_PROGRAM)
    returns = ("energy", "force") if kind in ("json", "npz") else ()
    options = Options(energy="stretch", count=4, returns=returns)
    found = check(None, options, command=f"{sys.executable} {program} {kind} {{in}} {{out}}", kind=kind)
    assert found.passes, said(found)
    assert [block.title for block, _ in found.found][:2] == ["energy", "gradient x0"]
    assert len(found.found) == (21 if kind == "mat" else 5)


@pytest.mark.parametrize(
    ("program", "trouble"),
    [
        ("import sys; sys.exit(3)", "ends with exit status 3"),
        ("import os; os.abort()", "ends with SIGABRT"),
        ("raise ValueError('odd')", "ends with exit status 1 (ValueError: odd)"),
    ],
)
def test_a_command_that_fails(tmp_path: Path, program: str, trouble: str) -> None:
    (tmp_path / "bad.py").write_text(program)
    found = check(
        None, Options(energy="stretch", count=2), command=f"{sys.executable} {tmp_path}/bad.py {{in}} {{out}}"
    )
    assert not found.passes and found.troubles[0][0] == trouble


@pytest.mark.parametrize(
    ("command", "text"),
    [
        ("true {in}", "must hold {in} and {out}"),
        ("no-such-program-here {in} {out}", "there is no program no-such-program-here"),
        ("true {in} {out}", "wrote no file out.json"),
        ("cp {in} {out}", "has none of energy, gradient, hessian, force, jacobian; it has "),
    ],
)
def test_commands_that_cannot_be_run(command: str, text: str) -> None:
    with pytest.raises(InputError, match=text):
        check(None, Options(energy="stretch", count=2), command=command)


def test_inputs_are_written_and_outputs_read(tmp_path: Path) -> None:
    options = Options(energy="shear", count=3)
    assert "states of shear: x0.x, x0.y" in write_states(tmp_path / "in.json", options)
    states = json.loads((tmp_path / "in.json").read_text())
    assert states["arguments"] == ["k_x", "L"] and len(states["q"]) == len(states["tags"]) == len(states["k_x"])
    first = (tmp_path / "in.json").read_bytes()
    write_states(tmp_path / "in.json", options)
    assert (tmp_path / "in.json").read_bytes() == first
    for name in ("in.npz", "in.csv", "in.mat"):
        write_states(tmp_path / name, options)
    matlab, before = loadmat(tmp_path / "in.mat"), (tmp_path / "in.mat").read_bytes()
    assert np.array_equal(matlab["q"], states["q"]) and matlab["key"][0] == states["key"]
    assert [tag[0] for tag in matlab["tags"].ravel()] == states["tags"] and matlab["k_x"].shape == (len(states["q"]), 1)
    write_states(tmp_path / "in.mat", options)
    assert (tmp_path / "in.mat").read_bytes() == before
    stored = np.load(tmp_path / "in.npz")
    table = np.loadtxt(tmp_path / "in.csv", delimiter=",", skiprows=1)
    assert np.array_equal(stored["q"], np.array(states["q"])) and np.array_equal(table[:, :9], stored["q"])

    from yarnverify.kernels.accurate import shear

    _, g, _ = shear.evaluate(stored["q"].T, k_x=stored["k_x"], L=stored["L"], errors="mask")
    np.savez(tmp_path / "out.npz", gradient=g.T, key=states["key"])
    assert check(None, options, outputs=tmp_path / "out.npz").passes
    np.savez(tmp_path / "out.npz", gradient=-g.T)
    assert check(None, options, outputs=tmp_path / "out.npz").hints == ["matches with --force"]
    np.savez(tmp_path / "out.npz", gradient=g)  # the states last, as the package has them
    assert check(None, options, outputs=tmp_path / "out.npz").passes


def test_matlab_arrays_as_matlab_has_them(tmp_path: Path) -> None:
    """States last, a cell for each, or sparse; forces by their name."""
    from yarnverify.kernels.accurate import stretch

    options, path = Options(energy="stretch", count=3, regimes=ONE), tmp_path / "out.mat"
    q = Setting("stretch", options).cases.points
    e, g, h = stretch.evaluate(q.q, **q.parameters)
    cells = np.empty(len(e), dtype=object)
    cells[:] = [csc_matrix(part) for part in np.moveaxis(-h, -1, 0)]
    savemat(path, {"energy": csc_matrix(e[:, None]), "force": -g, "jacobian": cells})
    found = check(None, options, outputs=path)
    assert found.passes and len(found.found) == 21 and found.notes == ["taken as: energy, force, jacobian"]


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("out.txt", "", "the name must end in .json, .npz, .mat or .csv"),
        ("out.mat", None, "cannot read: no such file"),
        ("out.mat", "MATLAB", r"is no MATLAB file of version 7 or older; write it with save\('-v7', 'out.mat', ...\)"),
        (
            "out.mat",
            f"{'MATLAB 7.3 MAT-file':124}\0\2IM",
            r"is a MATLAB 7.3 file; write it with save\('-v7', 'out.mat', ...\)",
        ),
        ("out.json", None, "cannot read: no such file"),
        ("out.json", "{", "out.json:1:2: "),
        ("out.json", "[]", "holds no object"),
        ("out.json", '{"energy": [1]}', "energy has 1 numbers in shape"),
        ("out.json", '{"energy": ["high"]}', "energy: could not convert"),
        ("out.json", '{"energy": [[1], [1, 2]]}', "energy: "),
        ("out.json", '{"key": "other", "energy": [1]}', "belongs to other states"),
        ("out.npz", "PK", "is no NPZ file"),
        ("out.csv", "1 2 3\n", "has 1 lines of numbers, not 2"),
        ("out.csv", "a b\n1\n2 3\n", "has 1 numbers, not 91"),
        ("out.csv", "1\nx\n", "out.csv:2:1: "),
    ],
)
def test_bad_files(tmp_path: Path, name: str, text: str | None, message: str) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=message):
        check(None, Options(energy="shear", count=2, regimes=ONE), outputs=tmp_path / name)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"E_total": np.zeros(4)}, "has none of energy, gradient, hessian, force, jacobian; it has E_total$"),
        ({"energy": np.zeros(5)}, r"energy has 5 numbers in shape \(5, 1\), not 1 for each of 2 states"),
        ({"gradient": np.zeros((3, 6))}, r"gradient has the shape \(3, 6\); give the 2 states first, or last"),
        ({"energy": {"a": 1.0}}, "energy is a struct; save its arrays themselves"),
        ({"energy": np.array([1j, 2])}, "energy is not made of real numbers but of complex128"),
        (
            {"hessian": np.array([np.eye(9), np.eye(8)], dtype=object)},
            "hessian is a cell array of matrices of different sizes",
        ),
    ],
)
def test_bad_arrays_of_matlab(tmp_path: Path, given: dict[str, Any], message: str) -> None:
    savemat(tmp_path / "out.mat", given, oned_as="column")
    with pytest.raises(InputError, match=message):
        check(None, Options(energy="shear", count=2, regimes=ONE), outputs=tmp_path / "out.mat")


# -- the command ------------------------------------------------------------------------------------------------------------


def run(*words: str) -> int:
    try:
        app(list(words), exit_on_error=False, print_error=False)
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def test_the_command_and_its_exit_status(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("check", f"{ZOO}:bending_of_arrays", "--count", "2") == 0
    shown = capsys.readouterr().out
    assert "taken as: energy, gradient, hessian; called with arrays (rows, states)" in shown
    assert "PASS: 31 blocks; each block at each state: norm of the error <= (16 + 8 K) u" in shown
    target = tmp_path / "found.json"
    assert run("check", f"{ZOO}:bending_force_unsaid", "--count", "2", "--json", str(target)) == 1
    shown = capsys.readouterr().out
    assert "WRONG        gradient x0 x1 x2 u1 u2" in shown and "Matches with --force." in shown
    assert "FAIL: 5 of 31 blocks" in shown and "x0.x = " in shown and "0x1." in shown
    found = json.loads(target.read_text())
    assert found["passes"] is False and found["hints"] == ["matches with --force"]
    worst = next(block for block in found["blocks"] if block["block"] == "x1")
    assert worst["status"] == "wrong" and worst["reasons"] == ["has the wrong sign"]
    assert float.fromhex(worst["worst"]["state"]["k_b"]) > 0 and worst["worst"]["error"] > 1e15
    assert run("check", "--energy", "shear", "--write-inputs", str(tmp_path / "in.csv")) == 0
    assert "states of shear" in capsys.readouterr().out


def test_the_record_is_the_same_every_time() -> None:
    first, second = (json.dumps(record(checked("bending_transposed"))) for _ in range(2))
    assert first == second


def test_the_shim_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("g++") is None or not Path("/usr/include/eigen3/Eigen/Dense").exists():
        pytest.skip("no g++ with Eigen here")
    readme = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
    source = re.search(r"<!-- shim.cpp -->\n```cpp\n(.*?)```", readme, re.DOTALL)
    compiling = re.search(r"^(g\+\+ .*)\n(yarnverify check ./libmine.so:stretch .*)\n", readme, re.MULTILINE)
    assert source is not None and compiling is not None
    (tmp_path / "shim.cpp").write_text(source[1])
    (tmp_path / "mine.h").write_text(_MINE)
    monkeypatch.chdir(tmp_path)
    subprocess.run(compiling[1].split(), check=True)
    assert run(*compiling[2].split()[1:], "--count", "3") == 0
    assert run(*compiling[2].replace("jacobian", "hessian").split()[1:], "--count", "3") == 1


_MINE = """
#pragma once
#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <vector>
using Triplets = std::vector<Eigen::Triplet<double>>;
struct Node { Eigen::Vector3d x; double u, v; int index; };
inline void add_stretch(const Node &a, const Node &b, double k_s, Eigen::VectorXd &f, Triplets &K) {
    Eigen::Vector3d e = b.x - a.x;
    double l = e.norm(), du = b.u - a.u, w = l / du;
    Eigen::Vector3d d = e / l;
    Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - d * d.transpose();
    Eigen::Matrix4d J;
    J << k_s / l * P - k_s / du * Eigen::Matrix3d::Identity(), k_s * w / du * d,
        k_s * w / du * d.transpose(), -k_s * w * w / du;
    Eigen::Vector4d F;
    F << -k_s * (l - du) / du * d, 0.5 * k_s * (l - du) * (l + du) / (du * du);
    for (int i = 0; i < 4; i++) {
        f(5 * a.index + i) -= F(i);
        f(5 * b.index + i) += F(i);
        for (int j = 0; j < 4; j++)
            for (const Node *r : {&a, &b})
                for (const Node *c : {&a, &b})
                    K.emplace_back(5 * r->index + i, 5 * c->index + j, r == c ? J(i, j) : -J(i, j));
    }
}
"""
