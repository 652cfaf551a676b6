"""The machine that something was measured on, for its record."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from typing import Any


def environment(packages: Sequence[str], processors: int | None) -> dict[str, Any]:
    """Where a measurement was made.

    Parameters
    ----------
    packages
        Whose versions matter, besides NumPy's.
    processors
        How many the process was held to; None if it was not.
    """
    from importlib.metadata import version

    names = dict.fromkeys(["numpy", *packages])
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "held to processors": processors,
        "system": platform.system(),
        "python": platform.python_version(),
        "packages": {name: version(name) for name in names},
    }


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
            for line in file:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
