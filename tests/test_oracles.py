"""Scenes at other loads, sizes and angles than their own, against chains that mpmath balances with 40 digits.

Nothing of the package computes these answers: forces on the nodes of a chain are written down and solved for by mpmath.
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

from yarnverify.simulation.command import find
from yarnverify.simulation.runs import Run

Points = Any


def ended(name: str, size: int, values: dict[str, Any]) -> Points:
    """Where the nodes of a scene end, across and upwards, (n + 1, 2)."""
    run = Run(find(name).problem(size, values))
    *_, last = run.go()
    return run.outcome(last.arrays()).points[:, [0, 2]]


def hung(size: int, *, length: float, span: float, rise: float, k_s: float, rho: float, g: float) -> Points:
    """A chain between two points: each segment carries the pull across H and, at its middle, what it hangs up."""
    with mpmath.workdps(40):
        h = mpmath.mpf(length) / size
        weight = mpmath.mpf(rho) * g * h

        def edges(across: Any, down: Any) -> list[tuple[Any, Any]]:
            found = []
            for i in range(size):
                up = (i + mpmath.mpf(1) / 2) * weight - down  # vertical pull at the middle of segment i
                tension = mpmath.hypot(across, up)
                stretched = h * (1 + tension / k_s)
                found.append((stretched * across / tension, stretched * up / tension))
            return found

        def missed(logarithm: Any, down: Any) -> tuple[Any, Any]:
            parts = edges(mpmath.exp(logarithm), down)
            return sum(x for x, _ in parts) - span, sum(y for _, y in parts) - rise

        # near the catenary, 2 a sinh(span/(2 a)) = sqrt(length^2 - rise^2)
        ratio = mpmath.sqrt(mpmath.mpf(length) ** 2 - mpmath.mpf(rise) ** 2) / span
        within = (mpmath.sqrt(6 * mpmath.log(ratio)), mpmath.sqrt(6 * (ratio - 1)))
        half = mpmath.findroot(lambda x: mpmath.sinh(x) / x - ratio, within, solver="anderson", tol=1e-20)
        a = span / (2 * half)
        pull = rho * g * a
        start = (mpmath.log(pull), pull * mpmath.sinh(half - mpmath.atanh(mpmath.mpf(rise) / length)))
        logarithm, down = mpmath.findroot(missed, start, tol=1e-60, maxsteps=100)
        return placed([(0, 0), *edges(mpmath.exp(logarithm), down)])


def bent(size: int, angle: float, *, length: float, k_b: float, k_s: float, weight: float, load: float) -> Points:
    """A chain from a wall in the middle of its first segment, from its tip inwards; ``angle`` is near that of its last segment.

    Moments of the weight beyond turn every node by M h/k_b, and the pull along a segment stretches it.
    """
    with mpmath.workdps(40):
        h = mpmath.mpf(length) / (size - mpmath.mpf(1) / 2)

        def segments(last: Any) -> list[tuple[Any, Any]]:
            """Length and angle below the level of each, from the tip; ends with the angle of the first, which is held."""
            beyond, moment, slope, found = load + weight * h / 2, mpmath.mpf(0), last, []
            for _ in range(size - 1):
                stretched = h * (1 + beyond * mpmath.sin(slope) / k_s)
                found.append((stretched, slope))
                moment += beyond * mpmath.cos(slope) * stretched
                beyond += weight * h
                slope -= moment * h / k_b
            return [*found, (h, slope)]

        last = mpmath.findroot(lambda last: segments(last)[-1][1], (angle, angle * 1.0001), tol=1e-70, maxsteps=100)
        steps = [(r * mpmath.cos(slope), -r * mpmath.sin(slope)) for r, slope in reversed(segments(last))]
        return placed([(-h / 2, 0), *steps])


def placed(steps: list[tuple[Any, Any]]) -> Points:
    return np.cumsum(np.array(steps, dtype=object), axis=0).astype(float)


@pytest.mark.parametrize(
    ("size", "values"),
    [
        (7, {"length": 0.3, "span": 0.1, "rise": -0.2}),
        (24, {"length": 1.7, "span": 1.1, "rise": 0.9, "rho": 2e-4, "k_s": 3.0}),
        (51, {"length": 0.09, "span": 0.0899, "rise": 0.0, "g": 1.6}),
        (40, {"length": 0.12, "span": 0.02, "rise": 0.1, "k_s": 1e4}),
    ],
)
def test_a_hung_yarn_hangs_as_mpmath_balances_it(size: int, values: dict[str, float]) -> None:
    given = find("catenary").values(values)
    exact = hung(size, **given)
    assert exact[-1] == pytest.approx([given["span"], given["rise"]], rel=1e-15)
    assert np.abs(ended("catenary", size, values) - exact).max() <= 1e-12 * given["length"]


@pytest.mark.parametrize(
    ("name", "size", "values"),
    [
        ("heavy_cantilever", 5, {"length": 0.1, "rho": 1e-4}),
        ("heavy_cantilever", 33, {"length": 0.02, "k_b": 4e-10, "g": 30.0, "k_s": 0.5}),
        ("heavy_cantilever", 70, {"length": 0.3, "rho": 1e-6, "k_b": 1e-8}),
        ("elastica", 17, {"alpha": 0.3, "k_s": 1e-3}),
        ("elastica", 48, {"alpha": 25.0, "length": 0.4, "k_b": 2e-7}),
    ],
)
def test_a_cantilever_bends_as_mpmath_balances_it(name: str, size: int, values: dict[str, float]) -> None:
    given = find(name).values({**values, "wall": "middle"})
    length, k_b, k_s = (float(given[key]) for key in ("length", "k_b", "k_s"))
    weight = float(given["rho"]) * float(given["g"]) if name == "heavy_cantilever" else 0.0
    load = float(given["alpha"]) * k_b / length**2 if name == "elastica" else 0.0
    found = ended(name, size, {**values, "wall": "middle"})
    way = found[-1] - found[-2]
    exact = bent(size, float(np.arctan2(-way[1], way[0])), length=length, k_b=k_b, k_s=k_s, weight=weight, load=load)
    assert np.abs(found - exact).max() <= 1e-12 * length
