"""CasADi: its generated C, compiled for this processor, in a loop over the elements."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import casadi
import numpy as np

from yarnverify.benchmark.peers.walk import FORMS, energy_of, functions_of
from yarnverify.benchmark.ways import (
    Array,
    Outputs,
    Way,
    count_of_parameters,
    degrees_of_freedom,
    kept_outputs,
    outputs_bytes,
    sizes,
)
from yarnverify.errors import NotRunError
from yarnverify.symbolic.declare import Energy

PACKAGES = ("casadi",)
FLAGS = ("-O3", "-march=native", "-fno-math-errno")
_FUNCTIONS = functions_of(casadi, float, short=True)
_LOOP = """
void loop(long n, const double* q, const double* p, double* e, double* g, double* h) {{
  casadi_int iw[{iw}];
  double w[{w}], x[{dof}];
  for (long i = 0; i < n; ++i) {{
    for (int k = 0; k < {dof}; ++k) x[k] = q[k * n + i];
    const double* arg[{arg}] = {{x, p}};
    double* res[{res}] = {{e + i, g + {dof} * i, h + {triangle} * i}};
    element(arg, res, iw, w, 0);
  }}
}}
"""


def ways(energy: Energy) -> tuple[Way, ...]:
    """The compiled loop of each form of the energy.

    Raises
    ------
    NotRunError
        Without a C compiler, or where it fails.
    """
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise NotRunError("no C compiler: install gcc")
    return tuple(_way(energy, compiler, form) for form in FORMS)


def _way(energy: Energy, compiler: str, form: str) -> Way:
    dof = degrees_of_freedom(energy)
    loop = _compiled(compiler, _function(energy, dof, form), dof)

    arrays = kept_outputs(dof, "element-first")

    def run(q: Array, values: tuple[float, ...]) -> Outputs:
        n = q.shape[1]
        q, p = np.ascontiguousarray(q, np.float64), np.array(values)
        e, g, h = arrays(n)
        loop(n, q.ctypes.data, p.ctypes.data, e.ctypes.data, g.ctypes.data, h.ctypes.data)
        return e, g, h

    how = f"generated C, {' '.join(FLAGS)}, loop over elements, {form}"
    return Way(how, "packed", "element-first", run, lambda n: n * outputs_bytes(dof))


def _function(energy: Energy, dof: int, form: str) -> Any:
    q, p = casadi.SX.sym("q", dof), casadi.SX.sym("p", count_of_parameters(energy))
    parameters = [p[i] for i in range(count_of_parameters(energy))]
    value = energy_of(energy, [q[i] for i in range(dof)], parameters, _FUNCTIONS, form)
    hessian, gradient = casadi.hessian(value, q)
    upper = casadi.vertcat(*(hessian[i, j] for i in range(dof) for j in range(i, dof)))
    dense = [casadi.densify(part) for part in (value, gradient, upper)]
    return casadi.Function("element", [q, p], dense, {"cse": True})


def _compiled(compiler: str, function: Any, dof: int) -> Any:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        generator = casadi.CodeGenerator("element.c", {"with_header": False, "casadi_int": "long long int"})
        generator.add(function)
        needs = {"iw": function.sz_iw(), "w": function.sz_w(), "arg": function.sz_arg(), "res": function.sz_res()}
        needs = {key: max(int(size), 3) for key, size in needs.items()}
        text = generator.dump() + _LOOP.format(dof=dof, triangle=sizes(dof), **needs)
        (folder / "element.c").write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, "-shared", "-fPIC", "-o", "element.so", "element.c", "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if done.returncode:
            raise NotRunError(f"{compiler} failed: {(done.stderr.strip() or 'no message').splitlines()[-1]}")
        loop = ctypes.CDLL(str(folder / "element.so")).loop
    loop.argtypes = [ctypes.c_long, *([ctypes.c_void_p] * 5)]
    loop.restype = None
    return loop
