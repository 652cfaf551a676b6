"""Implementations to be checked, as people write them: right ones, and one for each mistake that is to be recognised."""

from __future__ import annotations

import ctypes
import os
import time
from typing import Any

import numpy as np

from yarnverify.kernels.accurate import bending, shear, stretch
from yarnverify.kernels.printed import bending as printed


def _of(kernel: Any, q: Any, **parameters: Any) -> tuple[Any, Any, Any]:
    e, g, h = kernel.evaluate(q, **parameters, errors="mask")
    return e, g, h


# -- right, in several manners ----------------------------------------------------------------------------------------


def bending_of_arrays(q: Any, k_b: Any) -> Any:
    return _of(bending, q, k_b=k_b)


def bending_element_first(q: Any, kb: Any) -> Any:
    e, g, h = _of(bending, q.T, k_b=kb)
    return {"V": e, "force": -g.T, "jac": -h.transpose(2, 0, 1)}


def bending_by_name(x0: Any, x1: Any, x2: Any, u1: float, u2: float, Kb: float) -> Any:
    e, g, h = _of(bending, np.concatenate([x0, x1, x2, [u1, u2]])[:, None], k_b=Kb)
    return float(e[0]), g[:, 0], h[..., 0]


def bending_blocks(q: Any, k_b: float) -> Any:
    """Two blocks of the force and one of its Jacobian, of one state."""
    _, g, h = _of(bending, q[:, None], k_b=k_b)
    return -g[3:6, 0], -g[6:9, 0], -h[3:6, 6:9, 0]


def bending_previous_middle_next(q: Any, k_b: Any) -> Any:
    """Rows x2, x0, x1, u2, u1, as in a chain of points."""
    mine = [6, 7, 8, 0, 1, 2, 3, 4, 5, 10, 9]
    own = np.argsort(mine)
    e, g, h = _of(bending, q[own], k_b=k_b)
    return e, g[mine], h[np.ix_(mine, mine)]


def bending_of_nodes(q: Any, k_b: Any) -> Any:
    """Nodes (x, u, v): 15 rows, of which u of the middle and all v do nothing."""
    where = [0, 1, 2, 5, 6, 7, 10, 11, 12, 8, 13]
    _, g, h = _of(bending, q[where], k_b=k_b)
    force, jacobian = np.zeros((15, q.shape[1])), np.zeros((15, 15, q.shape[1]))
    force[where] = -g
    jacobian[np.ix_(where, where)] = -h
    return force, jacobian


def stretch_by_radius(q: Any, Y: Any, R: Any) -> Any:
    """Young's modulus and radius instead of the stiffness."""
    return _of(stretch, q, k_s=Y * np.pi * R**2)


def stretch_sliding_forces(x0: Any, x1: Any, u0: float, u1: float, ks: float) -> Any:
    """Two numbers, one a sliding coordinate."""
    force = 0.5 * ks * (np.sum((x1 - x0) ** 2) / (u1 - u0) ** 2 - 1)
    return -force, force


def _segment(x0: Any, x1: Any, u0: Any, u1: Any, k_s: Any) -> tuple[Any, Any]:
    """Force on the far end of a segment and of its sliding coordinate, one state or many."""
    step, du = x1 - x0, u1 - u0
    length = np.sqrt((step**2).sum(axis=-1))
    return (-k_s * (length - du) / (du * length))[..., None] * step, 0.5 * k_s * (length - du) * (length + du) / du**2


def stretch_forces_in_a_row(x0: Any, x1: Any, u0: Any, u1: Any, k_s: Any) -> Any:
    force, sliding = _segment(x0, x1, u0, u1, k_s)
    return -force, force, -sliding, sliding


def stretch_sparse(q: Any, k_s: float) -> Any:
    """As assembled from triplets."""
    from scipy.sparse import coo_array

    _, g, h = _of(stretch, q[:, None], k_s=k_s)
    rows, columns = np.nonzero(h[..., 0] == h[..., 0])
    return {"force": -g[:, 0], "jacobian": coo_array((-h[rows, columns, 0], (rows, columns)), shape=(8, 8))}


def stretch_F(x0: Any, x1: Any, u0: float, u1: float, k_s: float) -> Any:
    force, sliding = _segment(x0, x1, u0, u1, np.float64(k_s))
    return -force, force, -sliding, sliding


def stretch_forces_by_name(x0: Any, x1: Any, u0: float, u1: float, k_s: float) -> Any:
    force, sliding = _segment(x0, x1, u0, u1, np.float64(k_s))
    return {"F_x0": -force, "F_u1": sliding}


def gravity_by_name(x0: Any, x1: Any, u0: float, u1: float, rho: float, g: Any) -> Any:
    force, per_length = rho * (u1 - u0) / 2 * g, rho * (g @ (x0 + x1)) / 2
    return {"V": -(u1 - u0) * per_length, "F": np.concatenate([force, force, [-per_length, per_length]])}


def contact_of_other_names(left: float, right: float, stiffness: float, R: float) -> float:
    """No name of the energy's."""
    return stiffness * min(right - left - 4 * R, 0) ** 2 / 2


def bending_of_a_chain(x0: Any, x1: Any, x2: Any, u1: float, u2: float, k_b: float) -> Any:
    """Points in the order of the yarn: the middle one comes second."""
    e, g, h = _of(bending, np.concatenate([x1, x0, x2, [u1, u2]])[:, None], k_b=k_b)
    mine = [3, 4, 5, 0, 1, 2, 6, 7, 8, 9, 10]
    return float(e[0]), g[mine, 0], h[np.ix_(mine, mine)][..., 0]


# -- mistakes ---------------------------------------------------------------------------------------------------------


def bending_force_unsaid(q: Any, k_b: Any) -> Any:
    e, g, h = _of(bending, q, k_b=k_b)
    return e, -g, h


def bending_all_signs(q: Any, k_b: Any) -> Any:
    e, g, h = _of(bending, q, k_b=k_b)
    return e, -g, -h


def bending_clamped(q: Any, k_b: Any) -> Any:
    """The energy with a cosine that is kept from 1."""
    e, _, _ = _of(bending, q, k_b=k_b)
    theta = np.sqrt(e * (q[9] - q[10]) / k_b)
    return k_b * np.clip(theta, 1e-3, None) ** 2 / (q[9] - q[10])


def shear_short_pi(q: Any, k_x: Any, L: Any) -> Any:
    """Eleven digits of pi."""
    a, b = q[3:6] - q[:3], q[6:9] - q[:3]
    psi = np.arctan2((a * b).sum(axis=0), np.sqrt((np.cross(a, b, axis=0) ** 2).sum(axis=0)))
    return 0.5 * k_x * L * (psi + (3.1415926535 - np.pi) / 2) ** 2


def bending_factor(q: Any, k_b: Any) -> Any:
    e, g, h = _of(bending, q, k_b=k_b)
    g[3:6] *= 2
    return e, g, h


def bending_half(q: Any, k_b: Any) -> Any:
    return tuple(part / 2 for part in _of(bending, q, k_b=k_b))


def bending_without_stiffness(q: Any, k_b: Any) -> Any:
    return _of(bending, q, k_b=1.0)


def bending_without_length(q: Any, k_b: Any) -> Any:
    e, g, h = _of(bending, q, k_b=k_b)
    h[3:6, 3:6] *= np.sqrt(((q[3:6] - q[:3]) ** 2).sum(axis=0))
    return e, g, h


def bending_angle_unsquared(q: Any, k_b: Any) -> Any:
    """The angle where its square belongs, in the forces on u1 and u2."""
    e, g, h = _of(bending, q, k_b=k_b)
    with np.errstate(all="ignore"):
        g[9:] /= np.sqrt(e * (q[9] - q[10]) / k_b)
    return e, g, h


def bending_transposed(q: Any, k_b: Any) -> Any:
    e, g, h = _of(bending, q, k_b=k_b)
    h[3:6, 6:9] = h[3:6, 6:9].swapaxes(0, 1).copy()
    return e, g, h


def stretch_without_projection(q: Any, k_s: Any) -> Any:
    """The second term of the Jacobian alone."""
    e, g, h = _of(stretch, q, k_s=k_s)
    h[3:6, 3:6] = (k_s / (q[7] - q[6])) * np.eye(3)[:, :, None]
    return e, g, h


def bending_sign_of_a_term(q: Any, k_b: Any) -> Any:
    e, g, h = _of(bending, q, k_b=k_b)
    with np.errstate(all="ignore"):
        d = (q[3:6] - q[:3]) / np.sqrt(((q[3:6] - q[:3]) ** 2).sum(axis=0))
        h[3:6, 3:6] -= 2 * d[:, None] * g[None, 3:6]  # as if of d_1 d_2^T P_1
    return e, g, h


def bending_chord(q: Any, k_b: Any) -> Any:
    """2 (1 - cos) for the squared angle, and the lengths of the segments for the yarn's."""
    _, g, _ = _of(bending, q, k_b=k_b)
    a, b = q[3:6] - q[:3], q[:3] - q[6:9]
    l_1, l_2 = np.sqrt((a * a).sum(axis=0)), np.sqrt((b * b).sum(axis=0))
    cosine = (a * b).sum(axis=0) / (l_1 * l_2)
    theta = np.arccos(cosine)
    return {
        "energy": 2 * k_b * (1 - cosine) / (q[9] - q[10]),
        "x1": g[3:6] * (q[9] - q[10]) / (l_1 + l_2),
        "x2": g[6:9] * np.sin(theta) / theta,
    }


def bending_swapped(q: Any, k_b: Any) -> Any:
    e, g, h = _of(bending, q, k_b=k_b)
    g[3:9] = np.concatenate([g[6:9], g[3:6]])
    return e, g, h


def bending_left_out(q: Any, k_b: Any) -> Any:
    e, g, h = _of(bending, q, k_b=k_b)
    h[9, 9] = 0
    return e, g, h


def shear_gauss_newton(q: Any, k_x: Any, L: Any) -> Any:
    e, g, _ = _of(shear, q, k_x=k_x, L=L)
    with np.errstate(all="ignore"):
        return e, g, g[:, None] * g[None] / (2 * e)


def _definite(h: Any) -> Any:
    values, vectors = np.linalg.eigh(np.nan_to_num(np.moveaxis(h, -1, 0)))
    return np.moveaxis((vectors * np.maximum(values, 0)[:, None]) @ vectors.swapaxes(1, 2), 0, -1)


def stretch_definite(q: Any, k_s: Any) -> Any:
    e, g, h = _of(stretch, q, k_s=k_s)
    return e, g, _definite(h)


def shear_definite(q: Any, k_x: Any, L: Any) -> Any:
    e, g, h = _of(shear, q, k_x=k_x, L=L)
    return e, g, _definite(h)


def shear_rounded_pi(q: Any, k_x: Any, L: Any) -> Any:
    _, g, _ = _of(shear, q, k_x=k_x, L=L)
    a, b = q[3:6] - q[:3], q[6:9] - q[:3]
    phi = np.arctan2(np.sqrt((np.cross(a, b, axis=0) ** 2).sum(axis=0)), (a * b).sum(axis=0))
    return {"gradient": g * (phi - 1.57) / (phi - np.pi / 2)}


def shear_without_lengths(x0: Any, x1: Any, x3: Any) -> Any:
    """A right angle in three digits, no lengths, and a cross product that is not of length one."""
    a, b = (x1 - x0) / np.linalg.norm(x1 - x0), (x3 - x0) / np.linalg.norm(x3 - x0)
    size = -120 * (np.arccos(np.clip(a @ b, -1, 1)) - 1.57)
    c = np.cross(a, b)
    return np.cross(a, c) * size, np.cross(c, b) * size


def bending_mixed_signs(q: Any, k_b: Any) -> Any:
    """The gradient of the points, and the force on u1 and u2."""
    _, g, _ = _of(bending, q, k_b=k_b)
    g[9:] *= -1
    return {"gradient": g}


def bending_mixed_signs_losing(x0: Any, x1: Any, x2: Any, u1: float, u2: float, k_b: float) -> Any:
    """The same by textbook formulas, so that no block passes."""
    g = -bending_arccos(x0, x1, x2, u1, u2, k_b)["force"]
    g[9:] *= -1
    return {"gradient": g}


def bending_sign_and_length(q: Any, k_b: Any) -> Any:
    e, g, h = bending_without_length(q, k_b)
    return e, -g, -h


def bending_printed_with_a_step(q: Any, k_b: Any) -> Any:
    """Minus the squared time step times the printed Jacobian."""
    _, g, h = _of(printed, q, k_b=k_b)
    return {"gradient": g, "hessian": 1e-6 * h}


def bending_supplement(x0: Any, x1: Any, x2: Any, u1: float, u2: float, k_b: float) -> Any:
    a, b = (x1 - x0) / np.linalg.norm(x1 - x0), (x2 - x0) / np.linalg.norm(x2 - x0)
    return float(k_b * np.arccos(a @ b) ** 2 / (u1 - u2))


def bending_sum_left_out(q: Any, k_b: Any) -> Any:
    e, g, h = _of(bending, q, k_b=k_b)
    g[:3] = -g[3:6]
    return e, g, h


def bending_of_curvature(x0: Any, x1: Any, x2: Any, k_b: float) -> Any:
    """The energy of discrete elastic rods: the curvature binormal over the lengths of the edges."""
    a, b = x0 - x2, x1 - x0
    l_a, l_b = np.linalg.norm(a), np.linalg.norm(b)
    curvature = 2 * np.cross(a, b) / (l_a * l_b + a @ b)
    return float(k_b * (curvature @ curvature) / (l_a + l_b))


def shear_in_degrees(x0: Any, x1: Any, x3: Any, k_x: float, L: float) -> Any:
    a, b = x1 - x0, x3 - x0
    phi = np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
    return float(0.5 * k_x * L * (phi - 90) ** 2)


def parallel_contact_always(u0: float, u1: float, k_c: float, L: float, d: float) -> Any:
    """Pulls where it should have let go."""
    gap, k = u1 - u0 - d, k_c * L
    return {"energy": 0.5 * k * gap**2, "force": [k * gap, -k * gap], "jacobian": [[-k, k], [k, -k]]}


def parallel_contact_nearer(u0: float, u1: float, k_c: float, L: float, d: float) -> Any:
    gap = min(u1 - u0 - d / 2, 0.0)
    return 0.5 * k_c * L * gap**2


def shear_of_the_cosine(x0: Any, x1: Any, x3: Any, k_x: float, L: float) -> Any:
    a, b = (x1 - x0) / np.linalg.norm(x1 - x0), (x3 - x0) / np.linalg.norm(x3 - x0)
    return float(0.5 * k_x * L * (a @ b) ** 2)


def stretch_slack(q: Any, k_s: Any) -> Any:
    """No resistance to being pushed together."""
    e, g, h = _of(stretch, q, k_s=k_s)
    slack = np.sqrt(((q[3:6] - q[:3]) ** 2).sum(axis=0)) < q[7] - q[6]
    return np.where(slack, 0, e), np.where(slack, 0, g), np.where(slack, 0, h)


def stretch_of_tension(x0: Any, x1: Any, u0: float, u1: float, k_s: float) -> float:
    """No resistance either; of both ends alike, so that no order of them explains it."""
    du = u1 - u0
    return 0.5 * k_s * du * max(float(np.linalg.norm(x1 - x0)) / du - 1, 0.0) ** 2


def gravity_upwards(x0: Any, x1: Any, u0: float, u1: float, rho: float, g: Any) -> Any:
    force = gravity_by_name(x0, x1, u0, u1, rho, g)["F"]
    return {"F": np.concatenate([force[:6], -force[6:]])}


def bending_doubled_points(x0: Any, x1: Any, x2: Any, u1: float, u2: float, k_b: float) -> Any:
    force = bending_arccos(x0, x1, x2, u1, u2, k_b)["force"]
    return {"force": np.concatenate([2 * force[:9], force[9:]])}


def stretch_of_nodes(q: Any, k_s: Any) -> Any:
    """Forces and their Jacobian, rows x0, u0, x1, u1."""
    mine = [0, 1, 2, 6, 3, 4, 5, 7]
    _, g, h = _of(stretch, q[np.argsort(mine)], k_s=k_s)
    return -g[mine], -h[np.ix_(mine, mine)]


def stretch_of_weft(q: Any, k_s: Any) -> Any:
    """Rows x0, x1, u0, v0, u1, v1 of a weft yarn, whose v0, v1 end up in the rows of u."""
    mine = [0, 1, 2, 3, 4, 5, 7, 9]
    _, _, h = _of(stretch, q[mine], k_s=k_s)
    whole = np.zeros((10, 10, q.shape[1]))
    whole[np.ix_(mine, mine)] = h
    for row, column in ((7, 9), (9, 7)):
        whole[row - 1, column - 1], whole[row, column] = whole[row, column], 0.0
    return {"hessian": whole}


def bending_of_weft(x0: Any, x1: Any, x2: Any, u1: float, u2: float, k_b: float) -> Any:
    """The second derivative by v2 in the place of u2, from an angle by its cosine, which loses digits elsewhere."""
    a, b = (x1 - x0) / np.linalg.norm(x1 - x0), (x0 - x2) / np.linalg.norm(x0 - x2)
    curved = 2 * k_b * np.arccos(np.clip(a @ b, -1, 1)) ** 2 / (u1 - u2) ** 3
    whole = np.zeros((13, 13))
    whole[9, 9], whole[11, 11] = curved, curved
    return {"hessian": whole}


def stretch_with_a_step(q: Any, k_s: Any) -> Any:
    """Minus the squared time step times the Jacobian of the force."""
    _, g, h = _of(stretch, q, k_s=k_s)
    return {"force": -g, "hessian": 1e-4 * h}


def bending_printed_with_two_stiffnesses(q: Any, k_b: Any) -> Any:
    _, _, h = printed.evaluate(q, k_b=k_b, errors="mask")
    return {"x1,x1": 2 * k_b * h[3:6, 3:6]}


def bending_single_inside(q: Any, k_b: Any) -> Any:
    e, g, h = _of(bending, q.astype(np.float32), k_b=k_b.astype(np.float32))
    return e.astype(float), g.astype(float), h.astype(float)


def bending_differences(q: Any, k_b: Any) -> Any:
    e, g, _ = _of(bending, q, k_b=k_b)
    step = 1e-6
    columns = []
    for row in range(11):
        move = np.zeros((11, 1))
        move[row] = step
        columns.append((_of(bending, q + move, k_b=k_b)[1] - _of(bending, q - move, k_b=k_b)[1]) / (2 * step))
    return e, g, np.array(columns)


def bending_arccos(x0: Any, x1: Any, x2: Any, u1: float, u2: float, k_b: float) -> Any:
    """The formulas of a textbook: right, and bad near a straight yarn."""
    a, b = x1 - x0, x2 - x0
    l1, l2 = np.linalg.norm(a), np.linalg.norm(b)
    d1, d2 = a / l1, b / l2
    theta = np.arccos(-d1 @ d2)
    p1, p2 = (d2 - d1 * (d1 @ d2), d1 - d2 * (d1 @ d2))
    size = 2 * k_b * theta / ((u1 - u2) * np.sin(theta))
    f1, f2 = -size / l1 * p1, -size / l2 * p2
    fu = k_b * theta**2 / (u1 - u2) ** 2
    return {"energy": k_b * theta**2 / (u1 - u2), "force": np.concatenate([-f1 - f2, f1, f2, [fu, -fu]])}


def bending_zero_where_straight(q: Any, k_b: Any) -> Any:
    """No Hessian where the sine vanishes."""
    e, g, h = _of(bending, q, k_b=k_b)
    a, b = q[3:6] - q[:3], q[6:9] - q[:3]
    h[..., np.abs(np.cross(a, b, axis=0)).max(axis=0) < 1e-9] = 0
    return e, g, h


def stretch_rounded_off(q: Any, k_s: Any) -> Any:
    """Wrong by something small beside 1, and not beside a small stiffness."""
    e, g, h = _of(stretch, q, k_s=k_s)
    return e + 1e-21, g + 1e-21, h + 1e-21


def bending_raises(x0: Any, x1: Any, x2: Any, u1: float, u2: float, k_b: float) -> Any:
    if abs(u1 - u2) < 1e-3:
        raise ZeroDivisionError("segments too short")
    return bending_by_name(x0, x1, x2, u1, u2, k_b)


# -- worse ------------------------------------------------------------------------------------------------------------


def stretch_crash(q: Any, k_s: float) -> Any:
    if q[7] - q[6] < 0.3:
        ctypes.string_at(0)
    return tuple(part[..., 0] for part in _of(stretch, q[:, None], k_s=k_s))


def stretch_hang(q: Any, k_s: float) -> Any:
    if k_s > 1.5:
        time.sleep(60)
    return tuple(part[..., 0] for part in _of(stretch, q[:, None], k_s=k_s))


def stretch_exit(q: Any, k_s: float) -> Any:
    os._exit(0)


def stretch_text(q: Any, k_s: float) -> Any:
    return "no numbers"


def stretch_complex(q: Any, k_s: float) -> Any:
    return np.array(k_s) * 1j


def stretch_odd(q: Any, k_s: float) -> Any:
    return np.zeros(7)


def stretch_piece(q: Any, k_s: float) -> Any:
    """Of one state alone: the products of points fail for arrays of them."""
    return (q[3:6] @ np.ones(3)) * np.ones(3)


def stretch_stranger(q: Any, youngs: float) -> Any:
    return np.zeros(8)


def stretch_named_oddly(q: Any, k_s: float) -> Any:
    return {"pull": np.zeros(3)}


# -- one slip in code that forms everything from parts ---------------------------------------------------------------------


def bending_reads_exchanged(q: Any, k_b: Any) -> Any:
    """The state with x0 and x2 in each other's place, and results as if it were not."""
    return _of(bending, q[[6, 7, 8, 3, 4, 5, 0, 1, 2, 9, 10]], k_b=k_b)


def bending_lengths_exchanged(q: Any, k_b: Any) -> Any:
    """The other segment's length in the forces on the ends; that on the middle is minus their sum."""
    _, g, _ = _of(bending, q, k_b=k_b)
    lengths = [np.sqrt(((q[rows] - q[:3]) ** 2).sum(axis=0)) for rows in (slice(3, 6), slice(6, 9))]
    with np.errstate(all="ignore"):
        g[3:6] *= lengths[0] / lengths[1]
        g[6:9] *= lengths[1] / lengths[0]
    g[:3] = -g[3:6] - g[6:9]
    return {"gradient": g}


def bending_two_left_out(q: Any, k_b: Any) -> Any:
    """The middle's own block without the two mixed ones."""
    _, _, h = _of(bending, q, k_b=k_b)
    h[:3, :3] -= h[3:6, 6:9] + h[6:9, 3:6]
    return {"hessian": h}


def bending_upper_triangle(q: Any, k_b: Any) -> Any:
    return {"hessian": np.triu(np.moveaxis(_of(bending, q, k_b=k_b)[2], -1, 0)).transpose(1, 2, 0)}


def bending_lower_triangle_doubled(q: Any, k_b: Any) -> Any:
    h = np.moveaxis(_of(bending, q, k_b=k_b)[2], -1, 0)
    return {"hessian": (np.tril(h) + np.tril(h, -1)).transpose(1, 2, 0)}


def bending_sum_with_transpose(q: Any, k_b: Any) -> Any:
    h = np.moveaxis(_of(bending, q, k_b=k_b)[2], -1, 0)
    return {"hessian": (2 * h - h * np.eye(11)).transpose(1, 2, 0)}


def stretch_of_the_weight_alone(x0: Any, x1: Any, u0: float, u1: float, k_s: float) -> Any:
    """The forces on u0 and u1 without the strain's own dependence on them."""
    strain = np.linalg.norm(x1 - x0) / (u1 - u0) - 1
    return {"F_u0": k_s * strain**2 / 2, "F_u1": -k_s * strain**2 / 2}


def stretch_sign_of_the_projection(q: Any, k_s: Any) -> Any:
    """I/du + P/l, which is also what two exchanged sliding coordinates and another sign would give."""
    _, _, h = _of(stretch, q, k_s=k_s)
    h[:6, :6] = 0
    d = q[3:6] - q[:3]
    length = np.sqrt((d * d).sum(axis=0))
    one = np.eye(3)[:, :, None]
    block = k_s * (one / (q[7] - q[6]) + (one - (d / length)[:, None] * (d / length)[None]) / length)
    for rows, columns, sign in ((0, 0, 1), (3, 3, 1), (0, 3, -1), (3, 0, -1)):
        h[rows : rows + 3, columns : columns + 3] = sign * block
    return {"hessian": h}


class Segment:
    """Code of objects."""

    def __init__(self, k_s: float) -> None:
        self.k_s = k_s

    def stretch(self, x0: Any, x1: Any, u0: float, u1: float) -> float:
        return float(self.k_s * (np.linalg.norm(x1 - x0) - u1 + u0) ** 2 / (2 * (u1 - u0)))


segment = Segment(2.0)


def stretch_of_points_and_slides(x: Any, u: Any, k_s: Any) -> Any:
    """Points (2, 3) and sliding coordinates (2,), and results of the same shapes."""
    first, second, third, fourth = stretch_forces_in_a_row(x[0], x[1], u[0], u[1], np.float64(k_s))
    energy = k_s * (np.linalg.norm(x[1] - x[0]) - u[1] + u[0]) ** 2 / (2 * (u[1] - u[0]))
    return energy, -np.array([first, second]), -np.array([third, fourth])


def stretch_of_points_backwards(x: Any, u: Any, k_s: Any) -> Any:
    energy, points, slides = stretch_of_points_and_slides(x[::-1], u[::-1], k_s)
    return energy, points[::-1], slides[::-1]
