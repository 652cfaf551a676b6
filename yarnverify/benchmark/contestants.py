"""Who is measured: every variant of an energy's kernel, and the peers that can run here.

Whoever cannot run is named with the reason; nobody is left out silently.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from yarnverify.accuracy.cells import kernel
from yarnverify.benchmark.peers import PEERS
from yarnverify.benchmark.ways import Array, Outputs, Way, degrees_of_freedom, kept_outputs, named, outputs_bytes
from yarnverify.errors import InputError, NotRunError
from yarnverify.kernels import VARIANTS
from yarnverify.symbolic.declare import Energy

COMPILED = ("accurate", "fast")


@dataclass(frozen=True)
class Contestant:
    """A kernel variant or a peer, with its ways of being called, of which the fastest is measured."""

    name: str
    kind: str
    ways: tuple[Way, ...]
    packages: tuple[str, ...] = ()


def contestants(
    energy: Energy, peers: Sequence[str] = PEERS, threads: int = 1, folder: Path | None = None
) -> tuple[list[Contestant], dict[str, str]]:
    """Those that can run, and why the others cannot.

    Parameters
    ----------
    energy
        The declaration.
    peers
        Names out of ``PEERS``.
    threads
        For the kernels; the others run on one.
    folder
        Of your own derivations, with the kernels that were generated for them.
    """
    found: list[Contestant] = []
    missing: dict[str, str] = {}
    for name in (*kernels(), *peers):
        try:
            found += _peer(energy, name) if name in peers else [_kernel(energy, name, threads, folder)]
        except ImportError as error:
            missing[name] = f"{error.name or error} is not installed"
        except NotRunError as error:
            missing[name] = str(error)
        except Exception as error:  # a peer's own failure is its result here
            missing[name] = failure(error)
    return found, missing


def kernels() -> tuple[str, ...]:
    """The kernels' variants, each in NumPy, and those that one would use for speed also compiled."""
    return *VARIANTS, *(f"{variant} compiled" for variant in COMPILED)


def failure(error: BaseException) -> str:
    """An exception as one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text[:200]}" if text else type(error).__name__


def _kernel(energy: Energy, name: str, threads: int, folder: Path | None) -> Contestant:
    variant, _, engine = name.partition(" ")
    try:
        module = kernel(variant, energy.name, folder or "")
    except InputError:
        raise NotRunError("has no kernel of this energy") from None
    if engine:
        importlib.import_module("numba")
    options: dict[str, Any] = {"threads": threads, "engine": engine or "numpy"}
    dof = degrees_of_freedom(energy)

    arrays = kept_outputs(dof)

    def run(q: Array, values: tuple[float, ...]) -> Outputs:
        given = named(energy, values)
        outputs: Outputs = module.packed(q, **given, errors="mask", out=arrays(q.shape[1]), **options)
        return outputs

    how = f"{'compiled by numba' if engine else 'NumPy'}, {threads} thread{'s' * (threads > 1)}"
    way = Way(how, "packed", "component-first", run, lambda n: n * outputs_bytes(dof))
    return Contestant(name, "kernel", (way,), ("numba",) if engine else ())


def _peer(energy: Energy, name: str) -> list[Contestant]:
    module: Any = importlib.import_module(f"yarnverify.benchmark.peers.{name}")
    found = [Contestant(name, "peer", module.ways(energy), module.PACKAGES)]
    if hasattr(module, "AS_WRITTEN"):
        ways = tuple(way for way in found[0].ways if way.how == module.AS_WRITTEN)
        found.append(Contestant(f"{name} as written", "peer", ways, module.PACKAGES))
    return found
