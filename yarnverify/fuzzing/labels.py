"""What is hard about an element, from its numbers, to tell what a search has tried."""

from __future__ import annotations

from typing import Any

import numpy as np

from yarnverify.strategies import Element

NEAR = 1e-3  # rad, from where on an angle counts as nearly 0, right or pi
FAR = 1e3


def labels(dofs: tuple[str, ...], element: Element) -> list[str]:
    """Names of the regimes that an element belongs to; ``plain`` if none.

    Parameters
    ----------
    dofs
        Names of the rows.
    element
        Of float64 or float32.
    """
    with np.errstate(all="ignore"):  # extreme elements may overflow here; they still belong somewhere
        found = [*_of_points(dofs, element), *_of_sliding(dofs, element)]
    return found or ["plain"]


def _of_points(dofs: tuple[str, ...], element: Element) -> list[str]:
    rows = [i for i, label in enumerate(dofs) if "." in label]
    if not rows:
        return []
    points = element.q[rows, 0].astype(float).reshape(-1, 3)
    edges = points[1:] - points[0]
    if not len(edges):
        return []
    lengths = np.abs(edges).max(axis=1)
    if not lengths.all():
        return ["a segment of length zero"]
    found = []
    if len(edges) > 1:
        a, b = (edge / length for edge, length in zip(edges[:2], lengths[:2], strict=True))
        sine, cosine = np.linalg.norm(np.cross(a, b)), float(a @ b)
        found += _angle(float(np.arctan2(sine, cosine)))
        if max(lengths) > FAR * min(lengths):
            found.append(f"lengths unequal by more than {FAR:g}")
    if np.abs(points[0]).max() > FAR * min(lengths):
        found.append(f"further than {FAR:g} lengths away")
    if not 1e-10 < max(lengths) < 1e10:
        found.append("tiny or huge")
    return found


def _angle(angle: float) -> list[str]:
    if angle < NEAR:
        return [f"edges parallel within {NEAR:g}"]
    if np.pi - angle < NEAR:
        return [f"edges antiparallel within {NEAR:g}"]
    return [f"edges perpendicular within {NEAR:g}"] if abs(angle - np.pi / 2) < NEAR else []


def _of_sliding(dofs: tuple[str, ...], element: Element) -> list[str]:
    at: dict[str, Any] = dict(zip(dofs, element.q[:, 0].astype(float), strict=True))
    if not {"u0", "u1"} <= set(at):
        return []
    gap = at["u1"] - at["u0"]
    if "x1.x" in at:
        length = float(np.linalg.norm([at[f"x1.{axis}"] - at[f"x0.{axis}"] for axis in "xyz"]))
        strain = length / gap - 1 if gap else np.inf
        return [f"at rest within {NEAR:g}"] if abs(strain) < NEAR else ["compressed"] if strain < 0 else []
    if "d" not in element.parameters:
        return []
    inside = float(element.parameters["d"]) - gap
    return [f"within {NEAR:g} of contact"] if abs(inside) < NEAR * gap else ["in contact" if inside > 0 else "apart"]
