"""Commands for somebody's own implementation: ``check``, ``export``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from yarnverify.commands.shared import Json, named, progress, stop, write_json


def check(
    target: str | None = None,
    /,
    *,
    energy: Annotated[str | None, Parameter(help="Which energy; found in the target's name by default.")] = None,
    order: Annotated[
        str | None,
        Parameter(
            help="Order of your unknowns: x0,x1,x2,u1,u2. Results for a name that the energy lacks must be 0; _ is passed over."
        ),
    ] = None,
    returns: Annotated[
        list[str] | None,
        Parameter(
            help="What comes back, in order: energy, gradient or force, hessian or jacobian, blocks such as x1 or x1,u1.",
            consume_multiple=True,
            negative="",
        ),
    ] = None,
    force: Annotated[bool, Parameter(negative="", help="Your gradients are forces.")] = False,
    jacobian: Annotated[bool, Parameter(negative="", help="Your Hessians are Jacobians of forces.")] = False,
    layout: Annotated[
        Literal["auto", "single", "component", "element"],
        Parameter(
            help="One state a call, arrays (rows, states), or arrays (states, rows); tried in this order by default."
        ),
    ] = "auto",
    column_major: Annotated[bool, Parameter(negative="", help="Your matrices are stored column by column.")] = False,
    float32: Annotated[bool, Parameter(negative="", help="Hold it to single precision.")] = False,
    with_: Annotated[
        tuple[str, ...],
        Parameter(name="--with", help="What an argument of yours is: kb=k_b, R=d/4, du=u1-u0.", negative=""),
    ] = (),
    fix: Annotated[
        tuple[str, ...], Parameter(help="A parameter that your code has built in: k_b=1.", negative="")
    ] = (),
    command: Annotated[
        str | None,
        Parameter(help="Instead of a target, a command line: './mine {in} {out}'.", allow_leading_hyphen=True),
    ] = None,
    files: Annotated[
        Literal["json", "npz", "mat", "csv"], Parameter(help="What the command reads and writes.")
    ] = "json",
    write_inputs: Annotated[
        Path | None, Parameter(help="Only write the states: a .json, .npz, .mat or .csv file.")
    ] = None,
    outputs: Annotated[Path | None, Parameter(help="Instead of a target, results for the states so written.")] = None,
    count: Annotated[int, Parameter(help="States of each regime.")] = 16,
    regime: Annotated[
        tuple[str, ...], Parameter(help="Only these hard cases, such as 'small angle'.", negative="")
    ] = (),
    extreme: Annotated[
        bool, Parameter(negative="", help="Sizes from 1e-200 to 1e200 too, which no cloth has.")
    ] = False,
    time_limit: Annotated[float, Parameter(help="Seconds that a call may take.")] = 10.0,
    derivations: Annotated[Path | None, Parameter(help="Folder of declared energies.")] = None,
    json_file: Json = None,
) -> None:
    """Your own implementation against the truth, over the hard cases, block by block.

    Parameters
    ----------
    target
        module:function, file.py:function, a module or file with functions energy, gradient or force, hessian or jacobian;
        or library.so:function with the C interface that README.md describes.
    """
    from yarnverify.check.command import check as checked
    from yarnverify.check.setting import Options, write_states
    from yarnverify.check.show import record, show

    energy, derivations = named(energy, derivations)
    options = Options(
        energy, order, tuple(returns or ()), force, jacobian, layout, column_major, float32, with_, fix, count, regime,
        extreme, time_limit, derivations,
    )  # fmt: skip
    if write_inputs is not None:
        print(write_states(write_inputs, options))
        return
    try:
        with progress("checking") as advance:
            found = checked(target, options, command, outputs, files, advance)
    except KeyboardInterrupt:
        stop("interrupted; nothing was judged", 3)
    if not write_json(record(found), json_file):
        show(found)
    if not found.passes:
        sys.exit(1)


def export(
    energy: str,
    /,
    *,
    out: Annotated[Path, Parameter(help="Folder for the files.")],
    count: Annotated[int, Parameter(help="States of each hard case.")] = 8,
    extreme: Annotated[
        bool, Parameter(negative="", help="Sizes from 1e-200 to 1e200 too, which no cloth has.")
    ] = False,
    derivations: Annotated[Path | None, Parameter(help="Folder of declared energies.")] = None,
) -> None:
    """Golden vectors, corrected formulas and C source, for those who do not use Python.

    Parameters
    ----------
    energy
        Name of a declared energy, such as bending; one of your own as FOLDER/NAME.
    """
    from yarnverify.export.command import export as run

    name, derivations = named(energy, derivations)
    with progress("exporting") as advance:
        lines = run(name or energy, out, derivations, count, extreme, advance)
    print("\n".join(lines))
