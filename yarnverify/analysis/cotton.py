"""The fabric that is analysed unless another is given: a plain weave of cotton yarns."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from yarnverify.errors import InputError


@dataclass(frozen=True)
class Cotton:
    """Yarns and their stiffness; each is a parameter of ``yarnverify analyse --set``.

    Attributes
    ----------
    L
        Distance of neighbouring yarns, m: ten yarns a centimetre.
    R
        Radius of a yarn, m.
    rho
        Linear density, kg/m: 50 tex.
    k_s
        Stretch stiffness, N: Y pi R^2 with Y = 0.4 GPa.
    k_b
        Bending stiffness, N m^2: fibres that slide freely, 6e-12 N m^2 each. A solid yarn has Y pi R^4/4, 500 times as much.
    k_x
        Shear stiffness, N: a shear modulus 4 k_x/L of 40 N/m, as cotton cloth has by Kawabata's test.
    k_c
        Contact stiffness, N/m^2.
    """

    L: float = 1e-3
    R: float = 0.2e-3
    rho: float = 5e-5
    k_s: float = 50.0
    k_b: float = 1e-9
    k_x: float = 0.01
    k_c: float = 1e5

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{each.name} = {value!r} must be a positive number, {UNITS[each.name]}")


UNITS = {"L": "m", "R": "m", "rho": "kg/m", "k_s": "N", "k_b": "N m^2", "k_x": "N", "k_c": "N/m^2"}


def cotton(settings: tuple[str, ...] | list[str] = ()) -> Cotton:
    """The fabric with parameters given as ``name=value``.

    Raises
    ------
    InputError
        A name that is not one of the parameters, or a value that is not a positive number.
    """
    from yarnverify.simulation.command import settings as named

    given: dict[str, float] = {}
    for name, value in named(settings).items():
        if name not in UNITS:
            raise InputError(f"--set {name}: the fabric has {', '.join(UNITS)}")
        try:
            given[name] = float(value)
        except ValueError:
            raise InputError(f"--set {name}={value}: {value!r} is not a number; {name} is in {UNITS[name]}") from None
    return Cotton(**given)
