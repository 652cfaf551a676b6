"""Numerically safe atoms of the kernels: edges, corners, angles. Plain arithmetic on scalars, vectors as tuples of three.

Names that end in ``_exact`` carry the rounding errors of the edges and of the products along (TwoDiff by Knuth, TwoProduct
by Dekker), so that a sine of 1e-15 between two edges, or a cosine of 1e-15, still has all its digits.
The functions run on Python floats, on traced scalars (see ``tape``), in a numba loop, and on double-double numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from yarnverify.kernels.series import TURNING
from yarnverify.kernels.tape import maximum, select, smallest, split, sqrt

Vector = tuple[Any, Any, Any]
PI = 3.141592653589793


def two_difference(a: Any, b: Any) -> tuple[Any, Any]:
    """``a - b`` as rounded, and its rounding error."""
    rounded = a - b
    back = rounded - a
    return rounded, (a - (rounded - back)) - (b + back)


def two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """``a + b`` as rounded, and its rounding error."""
    rounded = a + b
    back = rounded - a
    return rounded, (a - (rounded - back)) + (b - back)


def two_product(a: Any, b: Any) -> tuple[Any, Any]:
    """``a b`` as rounded, and its rounding error."""
    rounded = a * b
    a_high, a_low = split(a)
    b_high, b_low = split(b)
    return rounded, ((a_high * b_high - rounded) + a_high * b_low + a_low * b_high) + a_low * b_low


def dot(a: Vector, b: Vector) -> Any:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def scaled(a: Vector, factor: Any) -> Vector:
    """``factor a``."""
    return a[0] * factor, a[1] * factor, a[2] * factor


def edge(tail: Vector, head: Vector) -> Vector:
    """Vector from one point to another."""
    return head[0] - tail[0], head[1] - tail[1], head[2] - tail[2]


def edge_exact(tail: Vector, head: Vector) -> tuple[Vector, Vector]:
    """Vector from one point to another as rounded, and what rounding took."""
    x, x_low = two_difference(head[0], tail[0])
    y, y_low = two_difference(head[1], tail[1])
    z, z_low = two_difference(head[2], tail[2])
    return (x, y, z), (x_low, y_low, z_low)


def _determinant(a: Any, b: Any, c: Any, d: Any, low: Any) -> Any:
    """``a d - b c + low`` with the rounding errors of both products."""
    first, first_low = two_product(a, d)
    second, second_low = two_product(b, c)
    return (first - second) + ((first_low - second_low) + low)


def cross_exact(a: Vector, a_low: Vector, b: Vector, b_low: Vector) -> Vector:
    """Vector product of two sums ``a + a_low``, each component good to the last digits whatever cancels."""
    (ax, ay, az), (aX, aY, aZ), (bx, by, bz), (bX, bY, bZ) = a, a_low, b, b_low
    return (
        _determinant(ay, az, by, bz, (ay * bZ + aY * bz) - (az * bY + aZ * by)),
        _determinant(az, ax, bz, bx, (az * bX + aZ * bx) - (ax * bZ + aX * bz)),
        _determinant(ax, ay, bx, by, (ax * bY + aX * by) - (ay * bX + aY * bx)),
    )


def sum_exact(parts: Sequence[Any], low: Any) -> tuple[Any, Any]:
    """A sum as rounded, and what rounding took together with ``low``."""
    value = parts[0]
    for part in parts[1:]:
        value, error = two_sum(value, part)
        low = low + error
    return value, low


def dot_exact(a: Vector, a_low: Vector, b: Vector, b_low: Vector) -> Any:
    """Scalar product of two sums ``a + a_low``, good to the last digits where it is above u^2 of its terms."""
    products = [two_product(p, q) for p, q in zip((*a, *a, *a_low), (*b, *b_low, *b), strict=True)]
    partial, partial_low = two_sum(products[0][0], products[1][0])
    total, total_low = two_sum(partial, products[2][0])
    lows = [low for _, low in products[:3]]
    crossed = [high for high, _ in products[3:]]
    tail = sum((low for _, low in products[4:]), products[3][1]) + dot(a_low, b_low)
    value, rest = sum_exact([total, partial_low, total_low, *lows, *crossed], tail)
    return value + rest


# -- segments ---------------------------------------------------------------------------------------------------------


def segment(tail: Vector, head: Vector) -> tuple[Any, Vector]:
    """Length and direction of a segment."""
    e = edge(tail, head)
    length = sqrt(dot(e, e))
    return length, scaled(e, 1 / length)


def segment_exact(tail: Vector, head: Vector) -> tuple[Any, Any, Vector]:
    """Length, the digits below its last, and direction of a segment."""
    e, low = edge_exact(tail, head)
    length = sqrt(dot(e, e))
    square, square_low = two_product(length, length)
    (x, x_low), (y, y_low), (z, z_low) = (two_product(p, p) for p in e)
    partial, partial_low = two_sum(x, y)
    total, total_low = two_sum(partial, z)
    rest = (total - square) + ((partial_low + total_low) - square_low) + ((x_low + y_low) + z_low) + 2 * dot(e, low)
    inverse = 1 / length
    return length, 0.5 * (rest * inverse), scaled(e, inverse)


def segment_twice(tail: Vector, head: Vector) -> tuple[Any, Any, Any, Vector]:
    """Length, the digits below its last, those below these, and direction of a segment.

    At rest a length is the same as a difference of sliding coordinates but for the rounding of the coordinates. The strain
    is then found in the digits below the last, of which one number would leave it with none.
    """
    e, low = edge_exact(tail, head)
    length = sqrt(dot(e, e))
    square, square_low = two_product(length, length)
    (x, x_low), (y, y_low), (z, z_low) = (two_product(p, p) for p in e)
    (cx, cx_low), (cy, cy_low), (cz, cz_low) = (two_product(p, 2 * q) for p, q in zip(e, low, strict=True))
    partial, partial_low = two_sum(x, y)
    total, total_low = two_sum(partial, z)
    parts = [total - square, partial_low, total_low, -square_low, x_low, y_low, z_low, cx, cy, cz]
    rest, rest_low = sum_exact(parts, (cx_low + cy_low + cz_low) + dot(low, low))
    inverse = 1 / length
    digits = 0.5 * (rest * inverse)  # (l + t)^2 = l^2 + rest, first as t = rest/(2 l), then with what that leaves
    back, back_low = two_product(2 * length, digits)
    left = ((rest - back) - back_low) + (rest_low - digits * digits)
    return length, digits, 0.5 * (left * inverse), scaled(e, inverse)


def total(low: Any, *terms: Any) -> Any:
    """``low`` plus a sum of terms that may cancel, the rounding errors of the sum included."""
    value = terms[0]
    for term in terms[1:]:
        value, error = two_sum(value, term)
        low = low + error
    return value + low


def total_twice(low: Any, *terms: Any) -> Any:
    """The same with the rounding errors of the sum of these errors, for what hardly more than rounding is left of."""
    value, errors = terms[0], []
    for term in terms[1:]:
        value, error = two_sum(value, term)
        errors.append(error)
    value, low = sum_exact([value, *errors], low)
    return value + low


def in_order(*terms: Any) -> Any:
    """A sum from left to right; for terms of one sign, in which nothing cancels."""
    value = terms[0]
    for term in terms[1:]:
        value = value + term
    return value


def apart(difference: Any, length: Any) -> Any:
    """Positive where a difference is more than a few roundings of a length."""
    step = (length + difference / 8) - length
    return step * step


# -- corners: two edges from one point --------------------------------------------------------------------------------

Corner = tuple[Any, Any, Vector, Vector, Vector, Any, Any]


def _corner(a: Vector, b: Vector, normal: Vector, cosine: Any = None) -> Corner:
    square_a, square_b = dot(a, a), dot(b, b)
    length_a, length_b = sqrt(square_a), sqrt(square_b)
    scale = 1 / sqrt(square_a * square_b)  # two roundings fewer than the product of two inverses
    d_a, d_b = scaled(a, 1 / length_a), scaled(b, 1 / length_b)
    return length_a, length_b, d_a, d_b, normal, scale, dot(d_a, d_b) if cosine is None else cosine * scale


def corner(origin: Vector, end_a: Vector, end_b: Vector) -> Corner:
    """Two edges: their lengths and directions, their cross product, 1 over the product of lengths, the cosine between them."""
    a, b = edge(origin, end_a), edge(origin, end_b)
    return _corner(a, b, cross(a, b))


def corner_exact(origin: Vector, end_a: Vector, end_b: Vector) -> Corner:
    """As ``corner``, the cross product without loss where the edges are nearly parallel."""
    (a, a_low), (b, b_low) = edge_exact(origin, end_a), edge_exact(origin, end_b)
    return _corner(a, b, cross_exact(a, a_low, b, b_low))


def right_corner(origin: Vector, end_a: Vector, end_b: Vector) -> Corner:
    """As ``corner``, the cosine from the scalar product of the edges, whose products are nearer to exact."""
    a, b = edge(origin, end_a), edge(origin, end_b)
    return _corner(a, b, cross(a, b), dot(a, b))


def right_corner_exact(origin: Vector, end_a: Vector, end_b: Vector) -> Corner:
    """As ``corner_exact``, the cosine too without loss where the edges are nearly perpendicular."""
    (a, a_low), (b, b_low) = edge_exact(origin, end_a), edge_exact(origin, end_b)
    return _corner(a, b, cross_exact(a, a_low, b, b_low), dot_exact(a, a_low, b, b_low))


def normal_of(m: Vector) -> tuple[Vector, Any]:
    """Direction and length of a vector that may be as short as the smallest number."""
    size = maximum(maximum(abs(m[0]), abs(m[1])), abs(m[2]))
    size = size + smallest(size)  # no 0/0 for a vector of length zero
    m = m[0] / size, m[1] / size, m[2] / size
    length = sqrt(dot(m, m))
    return (m[0] / length, m[1] / length, m[2] / length), length * size


def closing(origin: Vector, end_a: Vector, end_b: Vector) -> tuple[Vector, Vector]:
    """The third edge of a corner: ``v = a/a^2 - b/b^2``, and ``c = (a - b)/(|a| |b|)``, which has the same length.

    The difference ``v`` of what may be nearly equal is written with the third edge, so that it keeps its digits when a yarn
    is folded onto itself; with the edges themselves, whose coordinates have fewer roundings than their directions.
    """
    a, b, c = edge(origin, end_a), edge(origin, end_b), edge(end_b, end_a)
    square_a, square_b = dot(a, a), dot(b, b)
    longer, shorter = maximum(square_a, square_b), -maximum(-square_a, -square_b)
    order = square_b - square_a
    short = select(order, a[0], b[0]), select(order, a[1], b[1]), select(order, a[2], b[2])
    along = dot(c, (a[0] + b[0], a[1] + b[1], a[2] + b[2])) / shorter
    v = (c[0] - short[0] * along) / longer, (c[1] - short[1] * along) / longer, (c[2] - short[2] * along) / longer
    return v, scaled(c, 1 / sqrt(square_a * square_b))


# -- angles -----------------------------------------------------------------------------------------------------------


def series(square: Any) -> Any:
    """(sin t - t cos t)/sin(t)^3 from ``square = sin(t/2)^2``, up to the end of the polynomial's interval."""
    if hasattr(square, "turning_series"):  # more digits than the polynomial has
        return square.turning_series()
    value = TURNING[-1]
    for coefficient in TURNING[-2::-1]:
        value = value * square + coefficient
    return value


def _half_angle(square: Any) -> tuple[Any, Any, Any]:
    """Functions of h = t/2 from ``square = sin(h)^2``: cos h, h/sin h, (sin h - h cos h)/sin(h)^3.

    The last is a series in sin(h/2)^2; the second follows from it without cancellation.
    """
    cosine = sqrt(1 - square)
    g = series(square / (2 * (1 + cosine)))
    return cosine, (1 - g * square) / cosine, g


def turning(sine_squared: Any, cosine: Any) -> tuple[Any, Any, Any]:
    """``t^2``, ``t/sin t`` and ``(sin t - t cos t)/sin(t)^3``, analytic at t = 0; for sines that do not vanish towards pi.

    sin(t/2)^2 comes from the sine of small angles and from the cosine of large ones, whichever settles it better; a t beyond
    cos t = -1/4 is pi less another angle, which adds positive terms to both functions.
    """
    open_side = cosine + 0.25  # beyond, t is pi less an angle; at a right angle that would cost digits
    near = select(open_side, cosine, -cosine)
    square = 0.5 * select(near - 0.5, sine_squared / (1 + near), 1 - near)
    half, f, g = _half_angle(square)
    near_f, near_g = f / half, (half * g + f) / (4 * (half * half * half))
    inverse = 1 / select(open_side, 1.0, sine_squared)
    straight = pi_like(square) * (sqrt(sine_squared) * inverse)  # pi/sin t
    far = pi_like(square) - 2 * (f * sqrt(square))
    squared = select(open_side, 4 * (f * f * square), far * far)
    over = select(open_side, near_f, straight - near_f)
    return squared, over, near_g + select(open_side, 0.0, straight * near * inverse)


def angle_squared(sine_squared: Any, cosine: Any) -> Any:
    """``t^2``; see ``turning``."""
    return turning(sine_squared, cosine)[0]


def angle_over_sine(sine_squared: Any, cosine: Any) -> Any:
    """``t/sin t``; see ``turning``."""
    return turning(sine_squared, cosine)[1]


def sine_excess(sine_squared: Any, cosine: Any) -> Any:
    """``(sin t - t cos t)/sin(t)^3``; see ``turning``."""
    return turning(sine_squared, cosine)[2]


def pi_like(value: Any) -> Any:
    """pi to as many digits as ``value`` has."""
    return value.pi() if hasattr(value, "pi") else PI


def root_of(whole: int, value: Any) -> Any:
    """The square root of a whole number to as many digits as ``value`` has."""
    return value.root_of(whole) if hasattr(value, "root_of") else sqrt(whole)


def _acute(opposite: Any, adjacent: Any) -> Any:
    """The angle from 0 to a right angle with this sine and cosine; the smaller of the two settles it."""
    small = opposite / sqrt(2 * (1 + adjacent))
    half_sine = select(adjacent - 0.5, small, sqrt(0.5 * abs(1 - adjacent)))
    _, f, _ = _half_angle(half_sine * half_sine)
    return 2 * (f * half_sine)


def angle(sine: Any, cosine: Any) -> Any:
    """The angle from 0 to pi with this sine and cosine; relative accuracy at both ends is that of the sine."""
    acute = _acute(sine, abs(cosine))
    return select(cosine, acute, pi_like(acute) - acute)


def deviation(sine: Any, cosine: Any) -> Any:
    """The angle with this sine and cosine less a right angle; its relative accuracy is that of the cosine."""
    size = _acute(abs(cosine), sine)
    return select(cosine, -size, size)


def versine(sine_squared: Any, cosine: Any) -> Any:
    """``1 - cos t`` without cancellation."""
    return select(cosine, sine_squared / (1 + abs(cosine)), 1 - cosine)


def half_tangent(sine: Any, cosine: Any) -> Any:
    """``tan(t/2)`` without cancellation, for t above 0."""
    return select(cosine, sine / (1 + abs(cosine)), (1 + abs(cosine)) / sine)
