"""Yarns that stick in a wall."""

from __future__ import annotations

from yarnverify.errors import InputError
from yarnverify.simulation.answers import Tip
from yarnverify.simulation.cloth import Fabric
from yarnverify.simulation.fabric import yarn
from yarnverify.simulation.setting import Known


def clamped(length: float, segments: int, wall: str = "middle", R: float = 0.2e-3) -> Fabric:
    """A yarn along x from a wall at x = 0, held at its first two nodes.

    A chain turns at its nodes, so that its direction belongs to the middle of a segment. With the wall in the middle of the
    segment that is held, the chain is of second order; with the wall at its first node, of first order only.

    Parameters
    ----------
    length
        From the wall to the tip, m.
    wall
        ``middle`` or ``node``.
    """
    if segments < 2:
        raise InputError(f"a yarn in a wall needs two segments, one to hold and one that is free; not {segments}")
    h = length / (segments - 0.5) if wall == "middle" else length / segments
    first = -h / 2 if wall == "middle" else 0.0
    return yarn(length - first, segments, R=R, start=(first, 0, 0))


def tip_answers(tip: Tip, length: float, wall: str, *, within: float, stretched: float) -> list[Known]:
    """Where the tip of a clamped yarn is known to be, of the order that the place of its wall gives.

    Parameters
    ----------
    tip
        In units of the length.
    length, wall
        As for ``clamped``.
    within
        Relative error that is allowed with the wall in the middle of a segment; at a node it is 0.1.
    stretched
        Relative error that stretch leaves, which the answer does without.
    """
    order, allowed = (2, within) if wall == "middle" else (1, 0.1)
    return [
        Known("deflection of the tip", "m", tip.deflection * length, lambda end: -end.points[-1, 2], order, allowed,
              floor=stretched),
        Known("place of the tip along", "m", tip.along * length, lambda end: end.points[-1, 0], order, allowed,
              floor=stretched),
    ]  # fmt: skip
