"""Arrays by name as files for NumPy and MATLAB: the same bytes every time, without the time of day that they hold otherwise."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
_MAT_TEXT = 116  # bytes of a MATLAB file that hold a text, with the time of day unless it is replaced


def npz(arrays: Mapping[str, Array]) -> bytes:
    """For NumPy."""
    found = io.BytesIO()
    with zipfile.ZipFile(found, "w") as archive:
        for name, array in arrays.items():
            text = io.BytesIO()
            np.save(text, array)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), text.getvalue())
    return found.getvalue()


def mat(arrays: Mapping[str, Array], title: str) -> bytes:
    """For MATLAB and Octave: several texts as a cell array, one text as characters, one value a state as a column."""
    from scipy.io import savemat

    named = {
        name: value.astype(object) if value.dtype.kind == "U" and value.ndim else value
        for name, value in arrays.items()
    }
    found = io.BytesIO()
    savemat(found, named, oned_as="column")
    head = f"MATLAB 5.0 MAT-file: {title}".encode().ljust(_MAT_TEXT)[:_MAT_TEXT]
    return head + found.getvalue()[_MAT_TEXT:]
