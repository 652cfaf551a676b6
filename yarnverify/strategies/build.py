"""Whole elements: rows and parameters of a kernel, drawn or read from hexadecimal floats."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from yarnverify.strategies.frames import Array, Turn, orientations, turns
from yarnverify.strategies.numbers import length_ratios, magnitudes, offsets, scales, strains


@dataclass(frozen=True, eq=False, repr=False)
class Element:
    """One element: unpacks into ``q`` (dof, 1), read-only, and its parameters by name.

    Its repr is Python with hexadecimal floats, exact and ready for ``@example(...)``; ``element`` reads it.
    """

    q: Array
    parameters: Mapping[str, Any]

    def __iter__(self) -> Iterator[Any]:
        return iter((self.q, dict(self.parameters)))

    def __repr__(self) -> str:
        rows = _texts(self.q[:, 0])
        given = "".join(f', {name}="{_texts(value)}"' for name, value in self.parameters.items())
        kind = "" if self.q.dtype == np.float64 else f', dtype="{self.q.dtype}"'
        return f'element("{rows}"{given}{kind})'

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:
        printer.text(repr(self))  # Hypothesis would print the arrays of a dataclass, rounded


def _texts(values: Any) -> str:
    return " ".join(_hexadecimal(value) for value in np.atleast_1d(values))


def _hexadecimal(value: float) -> str:
    """As ``float.hex``, without zeros at the end."""
    text = float(value).hex()
    digits, mark, exponent = text.partition("p")
    return text if not mark else digits.rstrip("0").rstrip(".") + mark + exponent if "." in digits else text


def element(rows: str, *, dtype: str = "float64", **parameters: str) -> Element:
    """An element from hexadecimal floats.

    Parameters
    ----------
    rows
        The rows of ``q`` in the order of the kernel's ``DOFS``, separated by blanks; read by ``float.fromhex``.
    dtype
        Of ``q``.
    parameters
        Value of each parameter; three of a vector.

    Raises
    ------
    ValueError
        For text that is no hexadecimal float.

    Examples
    --------
    >>> element("0x0p+0 0x1.8p+0", k_c="0x1p+0", L="0x1p-1", d="0x1p+1")
    element("0x0p+0 0x1.8p+0", k_c="0x1p+0", L="0x1p-1", d="0x1p+1")
    >>> q, parameters = element("0x0p+0 0x1.8p+0", d="0x1p+1")
    >>> q.tolist(), parameters
    ([[0.0], [1.5]], {'d': 2.0})
    """
    values = [float.fromhex(text) for text in rows.split()]
    given = {name: [float.fromhex(part) for part in text.split()] for name, text in parameters.items()}
    return _element(values, {name: np.array(own) if len(own) > 1 else own[0] for name, own in given.items()}, dtype)


def _element(rows: Any, parameters: dict[str, Any], dtype: Any) -> Element:
    q = np.array(rows, dtype=dtype).reshape(-1, 1)
    q.flags.writeable = False
    return Element(q, parameters)


def elements(
    kernel: Any,
    *,
    turn: SearchStrategy[Turn] | None = None,
    orientation: SearchStrategy[Array] | None = None,
    ratio: SearchStrategy[float] | None = None,
    offset: SearchStrategy[tuple[float, float, float]] | None = None,
    scale: SearchStrategy[float] | None = None,
    strain: SearchStrategy[float] | None = None,
    stiffness: SearchStrategy[float] | None = None,
    units: Mapping[str, str] = MappingProxyType({}),
    dtype: Any = np.float64,
) -> SearchStrategy[Element]:
    """Elements of a kernel, made by the names of its rows.

    The first point is where the segments meet; the second segment makes the angle ``turn`` with the first and has
    ``ratio`` times its length. Sliding coordinates increase in the order u2, u0, u1 (others: as listed); their steps are
    lengths of segments over ``1 + strain``. Without points, the step is ``1 + strain`` times the parameter ``d``, so that
    contact is drawn as often as none. Rounding may fold an element exactly, and an offset may
    swallow a segment: then the element has no value, and a kernel must say so.

    Parameters
    ----------
    kernel
        Name of an energy in ``yarnverify.kernels``, or any object with ``DOFS`` and ``PARAMETERS``, such as a kernel of yours.
    turn, orientation, ratio, offset, scale, strain
        Strategies to draw from instead of ``turns()``, ``orientations()``, and so on; with float32, in its range.
    stiffness
        Strategy for each parameter; for a vector, of its length.
    units
        Units of parameters by name, where they are known: what is in m is drawn near the size of the element as often as not,
        and what is in rad between -3 and 3, or from 0 if it must be positive.
    dtype
        float64 or float32.

    Raises
    ------
    ValueError
        For a name that is no kernel, or rows that are neither axes of points nor scalars.

    Examples
    --------
    >>> from hypothesis import find
    >>> find(elements("stretch"), lambda element: True)
    element("0x0p+0 0x0p+0 0x0p+0 0x1p+0 0x0p+0 0x0p+0 0x0p+0 0x1p+0", k_s="0x1p+0")
    >>> q, parameters = find(elements("bending", turn=turns("pi")), lambda element: element.q[7, 0] > 0)
    >>> q.shape, parameters
    ((11, 1), {'k_b': 1.0})
    """
    module = _module(kernel)
    points, sliding = _rows(module.DOFS)
    vectors = module.KERNEL.vectors if hasattr(module, "KERNEL") else ()
    positive = {name for name, sign in module.KERNEL.parameters if sign} if hasattr(module, "KERNEL") else set()
    single = np.dtype(dtype) == np.float32
    turn = turns(smallest=1e-30 if single else 1e-300) if turn is None else turn
    orientation = orientations() if orientation is None else orientation
    ratio = (length_ratios(1e-3, 1e3) if single else length_ratios()) if ratio is None else ratio
    offset = (offsets(1e5) if single else offsets()) if offset is None else offset
    scale = (scales(1e-4, 1e4) if single else scales()) if scale is None else scale
    strain = (strains(1e-8) if single else strains()) if strain is None else strain
    stiffness = (
        (magnitudes(2.0**-8, 2.0**8) if single else magnitudes(2.0**-20, 2.0**20)) if stiffness is None else stiffness
    )

    @st.composite
    def drawn(draw: st.DrawFn) -> Element:
        size, shift = draw(scale), draw(offset)
        lengths = [size, *(size * draw(ratio) for _ in points[2:])]
        at: dict[str, float] = {}
        for point, position in zip(points, _positions(draw, len(points), turn, orientation, lengths), strict=True):
            at |= {f"{point}.{axis}": p + size * s for axis, p, s in zip("xyz", position, shift, strict=True)}
        parameters: dict[str, Any] = {}
        for name in module.PARAMETERS:
            if name in vectors:
                parameters[name] = draw(stiffness) * draw(orientation)[:, 0]
            elif units.get(name) == "rad":
                parameters[name] = draw(st.floats(0 if name in positive else -3, 3, width=32 if single else 64))
            elif units.get(name) == "m" and points and draw(st.booleans()):
                parameters[name] = size * (1 + draw(strain))
            else:
                parameters[name] = draw(stiffness)
        if not points and "d" in parameters:
            parameters["d"] = size
        stretched = 1 + draw(strain) if sliding else 1.0
        steps = [sum(lengths)] if len(sliding) == 2 else lengths + [size] * len(sliding)
        u = shift[0] * size
        for label, step in zip(sliding, [0.0, *steps], strict=False):
            u += step / stretched if points else step * stretched
            at[label] = u
        return _element([at[label] for label in module.DOFS], parameters, dtype)

    return drawn()


def _positions(
    draw: st.DrawFn, count: int, turn: SearchStrategy[Turn], orientation: SearchStrategy[Array], lengths: list[float]
) -> Iterator[Array]:
    """Where the points are: the first at the origin, further ones than three anywhere around it."""
    if not count:
        return
    yield np.zeros(3)
    if count > 1:
        frame = draw(orientation)
        yield lengths[0] * frame[:, 0]
    if count > 2:
        angle = draw(turn)
        yield lengths[1] * (angle.cosine * frame[:, 0] + angle.sine * frame[:, 1])
    for length in lengths[2:]:
        yield length * draw(orientation)[:, 0]


def _module(kernel: Any) -> Any:
    if not isinstance(kernel, str):
        return kernel
    try:
        return importlib.import_module(f"yarnverify.kernels.{kernel}")
    except ModuleNotFoundError:
        raise ValueError(
            f"there is no kernel {kernel!r} in yarnverify.kernels; give a name such as 'bending'"
        ) from None


def _rows(labels: tuple[str, ...]) -> tuple[list[str], list[str]]:
    """Points in their order, and sliding coordinates from the lowest to the highest."""
    points = list(dict.fromkeys(label.partition(".")[0] for label in labels if "." in label))
    for point in points:
        if not {f"{point}.{axis}" for axis in "xyz"} <= set(labels):
            raise ValueError(f"the point {point} needs the rows {point}.x, {point}.y and {point}.z")
    sliding = [label for label in labels if "." not in label]
    rank = {"2": -1, "0": 0, "1": 1}
    return points, sorted(sliding, key=lambda label: rank.get(label[1:], 2))
