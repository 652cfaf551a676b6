"""Answers of runs, observed orders, and which goals are missed: data for the record of a study."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from yarnverify.simulation.setting import Known, Outcome

SLACK = 0.1  # how far an observed order may be from the expected one


def answer(known: Known, outcome: Outcome, large: bool) -> dict[str, Any]:
    """An answer of a run beside the known one.

    Parameters
    ----------
    large
        Whether the size is at least the largest one of the scene, at which an answer with an order has to be good.
    """
    found, exact, error = known.compared(outcome)
    allowed = float(max(known.within, 3 * known.floor)) if large or known.order is None else None
    return {
        "name": known.name,
        "unit": known.unit,
        "found": found,
        "exact": exact,
        "error": error,
        "allowed": allowed,
        "order": None,
        "expected order": known.order,
        "order is judged": known.order is not None and bool(error > 30 * known.floor),
    }


def add_orders(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Observed orders, between each size and the one before: log of the ratio of errors over that of sizes."""
    for before, run in pairwise(runs):
        for coarse, fine in zip(before["answers"], run["answers"], strict=True):
            if fine["expected order"] is not None and coarse["error"] > 0 and fine["error"] > 0:
                fine["order"] = math.log(coarse["error"] / fine["error"]) / math.log(run["size"] / before["size"])
    return runs


def missed(result: Mapping[str, Any]) -> list[str]:
    """A line for each error above what is allowed, and for each order between the two largest sizes that is not as expected."""
    lines = []
    for line in result["lines"]:
        for run in line["runs"]:
            for one in run["answers"]:
                what = f"{result['scene']}, {line['name']}, size {run['size']}: {one['name']}"
                if one["allowed"] is not None and not one["error"] <= one["allowed"]:
                    lines.append(f"{what} has the error {one['error']:.1e}, and {one['allowed']:.0e} is allowed")
                judged = run is line["runs"][-1] and one["order is judged"] and one["order"] is not None
                if judged and not abs(one["order"] - one["expected order"]) <= SLACK:
                    lines.append(f"{what} has the order {one['order']:.2f}, and {one['expected order']:g} is expected")
    return lines
