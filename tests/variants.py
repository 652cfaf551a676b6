"""Kernels by energy and variant, for tests that hold for all of them."""

from __future__ import annotations

import importlib
from types import SimpleNamespace
from typing import Any

from yarnverify import kernels
from yarnverify.strategies import Element

ENERGIES = ("stretch", "bending", "shear", "parallel_contact")
VARIANTS = kernels.VARIANTS
# safe forms: these give values at straight yarns and use only correctly rounded operations
SAFE = ("accurate", "fast")
PORTABLE = (*SAFE, "reference")
FUNCTIONS = ("energy", "gradient", "hessian", "evaluate", "packed")


def kernel(energy: str, variant: str) -> Any:
    return importlib.import_module(f"yarnverify.kernels.{variant}.{energy}")


def outputs(
    module: Any, element: Element | SimpleNamespace, function: str = "evaluate", **options: Any
) -> tuple[Any, ...]:
    """What a function of a kernel returns, always as a tuple."""
    found = getattr(module, function)(element.q, **element.parameters, **options)
    return found if isinstance(found, tuple) else (found,)


def bits(arrays: tuple[Any, ...]) -> list[bytes]:
    """Contents bit by bit, whatever the memory layout; -0.0 differs from 0.0."""
    return [array.tobytes() for array in arrays]
