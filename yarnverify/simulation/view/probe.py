"""Whether VTK can render here, found out in a child process: without OpenGL it ends the process instead of raising."""

from __future__ import annotations

import importlib.util
import logging
import os
import subprocess
import sys
from collections.abc import Mapping
from functools import cache

from yarnverify.errors import NotRunError

PACKAGES = "libegl1 libgl1-mesa-dri"  # Debian: EGL without a display, and Mesa's renderer for processors
_WINDOW, _EGL = "VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow"
_TRIAL = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.set_background("white")
plotter.add_mesh(pyvista.Sphere(), color="red")
image = plotter.screenshot(return_img=True)
assert (image[32, 32] != image[0, 0]).any()
print("rendered")
"""


def without_display() -> None:
    """Make VTK render without a display where there is none. Has to come before the first import of VTK."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        os.environ.setdefault(_WINDOW, _EGL)


def required() -> None:
    """Refuse, in one line, where not even matplotlib is installed, which writes legends as well."""
    if importlib.util.find_spec("matplotlib") is None:
        raise NotRunError("pictures need the extra view: pip install 'yarnverify[view]'")


@cache
def tell(reason: str) -> None:
    """Log a reason, once a process."""
    logging.getLogger("yarnverify").warning(reason)


@cache
def why_not() -> str | None:
    """None where pyvista renders; else one line that says why not and what would help. Looked up once a process."""
    if importlib.util.find_spec("pyvista") is None:
        return "pyvista is not installed (pip install 'yarnverify[view]'): matplotlib draws instead"
    without_display()
    failed = _failure(os.environ)
    if failed and sys.platform.startswith("linux") and os.environ.get(_WINDOW) != _EGL:
        if not _failure({**os.environ, _WINDOW: _EGL}):  # there is a display, but not one that draws
            os.environ[_WINDOW] = _EGL
            return None
    if failed and "ImportError" in failed:
        return f"pyvista cannot be imported here ({failed}): matplotlib draws instead"
    return f"VTK cannot render here (on Debian: apt install {PACKAGES}): matplotlib draws instead" if failed else None


def _failure(environment: Mapping[str, str]) -> str:
    """Empty where a picture could be made, else the last line that was said."""
    try:
        command = [sys.executable, "-c", _TRIAL]
        trial = subprocess.run(command, capture_output=True, text=True, timeout=120, env=dict(environment))
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    if trial.returncode == 0 and trial.stdout.strip().endswith("rendered"):
        return ""
    return (trial.stderr.strip().splitlines() or ["it ended without a word"])[-1]
