"""JAX: ``jit(vmap(...))`` of ``value_and_grad`` and a Hessian, in double precision on one core."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

# XLA reads both when JAX is first imported; whoever set them before is left alone
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
import jax.numpy as jnp

from yarnverify.benchmark.peers.walk import FORMS, Functions, energy_of, functions_of
from yarnverify.benchmark.ways import (
    Array,
    Outputs,
    Way,
    chunks,
    count_of_parameters,
    degrees_of_freedom,
    kept_outputs,
    outputs_bytes,
)
from yarnverify.symbolic.declare import Energy

PACKAGES = ("jax", "jaxlib")
AS_WRITTEN = "jit(vmap(hessian)), divided once, whole batch"  # what its documentation shows
CHUNK = 4096
_FUNCTIONS = functions_of(jnp, float, short=False)
_ARRAYS = replace(_FUNCTIONS, arrays=jnp)
_HESSIANS: tuple[tuple[str, Callable[..., Any]], ...] = (
    ("hessian", jax.hessian),
    ("jacfwd(jacfwd)", lambda f: jax.jacfwd(jax.jacfwd(f))),
    ("jacrev(jacrev)", lambda f: jax.jacrev(jax.jacrev(f))),
)


def ways(energy: Energy) -> tuple[Way, ...]:
    """Three orders of differentiation, each on the whole batch and in chunks; and the energy as it is declared."""
    jax.config.update("jax_enable_x64", True)  # this process computes in double precision from here on
    dof, parameters = degrees_of_freedom(energy), count_of_parameters(energy)

    def value(functions: Functions, form: str) -> Callable[[Any, Any], Any]:
        return lambda q, values: energy_of(energy, q, values, functions, form)

    found = []
    for form, functions, hessians in ((FORMS[1], _ARRAYS, _HESSIANS), (FORMS[0], _FUNCTIONS, _HESSIANS[:1])):
        for name, hessian in hessians:
            own = value(functions, form)
            for chunk in (None, CHUNK):
                # taking the upper triangle pays where a chunk is still in the cache, and does not for a whole batch
                outputs = _all(own, hessian(own), None if chunk is None else np.triu_indices(dof))
                function = jax.jit(jax.vmap(outputs, in_axes=(1, None)))
                found.append(_way(f"jit(vmap({name})), {form}", function, chunk, dof, parameters))
    return tuple(found)


def _all(value: Callable[..., Any], hessian: Callable[..., Any], upper: Any) -> Callable[..., Any]:
    def outputs(q: Any, values: Any) -> Any:
        energy, gradient = jax.value_and_grad(value)(q, values)
        full = hessian(q, values)
        return energy, gradient, full if upper is None else full[upper]

    return outputs


def _way(name: str, function: Any, chunk: int | None, dof: int, parameters: int) -> Way:
    def whole(q: Array, values: tuple[float, ...]) -> Outputs:
        e, g, h = jax.block_until_ready(function(q, np.array(values)))
        return np.asarray(e), np.asarray(g), np.asarray(h)

    arrays = kept_outputs(dof, "element-first")

    def chunked(q: Array, values: tuple[float, ...]) -> Outputs:
        n, given = q.shape[1], np.array(values)
        if n <= CHUNK:
            return whole(q, values)
        out = arrays(n)
        for where in chunks(n, chunk):
            for all_of_it, part in zip(out, function(q[:, where], given), strict=True):
                all_of_it[where] = part
        return out

    def bytes_at(n: int) -> int:
        m = n if chunk is None else min(n, chunk)
        shapes = (jax.ShapeDtypeStruct((dof, m), np.float64), jax.ShapeDtypeStruct((parameters,), np.float64))
        analysis = function.lower(*shapes).compile().memory_analysis()
        own = int(analysis.temp_size_in_bytes) + int(analysis.output_size_in_bytes)
        return own + n * (8 * dof if chunk is None else outputs_bytes(dof))

    how = f"{name}, {f'chunks of {chunk}' if chunk else 'whole batch'}"
    if chunk is None:
        return Way(how, "full", "element-first", whole, bytes_at)
    return Way(how, "packed", "element-first", chunked, bytes_at)
