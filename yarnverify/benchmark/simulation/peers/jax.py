"""JAX as a generic user would: the energy as a function, its gradient and Hessian by jit, and SciPy's dense solver.

The energy bends by 2 tan(theta/2), whose square is smooth at the straight rod, where theta^2 has no automatic derivative.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from scipy.linalg import solve

os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
import jax.numpy as jnp

from yarnverify.benchmark.simulation.cantilever import STOP, STRETCH, Solve

PACKAGES = ("jax", "jaxlib", "scipy")


def make(n: int, alpha: float, goal: float) -> Solve:
    """A cantilever of n segments; compiled when it is first run."""
    jax.config.update("jax_enable_x64", True)  # this process computes in double precision from here on
    h = 1 / (n - 0.5)
    rest = np.stack([h * np.arange(n + 1.0), np.zeros(n + 1), np.zeros(n + 1)], axis=1)

    def energy(free: Any) -> Any:
        x = jnp.concatenate([jnp.asarray(rest[:2]), free.reshape(-1, 3)])
        edge = x[1:] - x[:-1]
        length = jnp.sqrt((edge * edge).sum(1))
        unit = edge / length[:, None]
        cosine = (unit[1:] * unit[:-1]).sum(1)
        bent = 4 * (1 - cosine) / (1 + cosine)  # (2 tan(theta/2))^2
        return STRETCH * h * ((length / h - 1) ** 2).sum() / 2 + bent.sum() / (2 * h) + alpha * x[-1, 1]

    both = jax.jit(lambda x: (jax.grad(energy)(x), jax.hessian(energy)(x)))

    def run() -> float:
        x = rest[2:].ravel()
        for _ in range(50):
            gradient, hessian = both(x)
            step = solve(np.asarray(hessian), -np.asarray(gradient), assume_a="sym")
            x = x + step
            if np.abs(step).max() <= STOP:
                break
        return -float(x[-2])

    return Solve("jit of gradient and dense Hessian, full Newton steps, scipy.linalg.solve", run)
