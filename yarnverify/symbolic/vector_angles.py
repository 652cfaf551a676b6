"""Angles between vectors of any kind, such as the normals of two triangles, as steps whose derivatives follow rules.

For vectors a and b with directions p and q let C = p.q = cos t, m = p x q, S = |m|^2, s = |m| = sin t, n = m/s. Then

    dC     = ((m x p)/|a|).da + ((q x m)/|b|).db
    d(t^2) = -2 f dC,  df = -g dC                      f = t/sin t and g of ``angles``: analytic at t = 0
    ds     = n.dm,     d(n.d_i m) = Q_i.Q_j/s + n.d_ij m      where Q_i = d_i m - n (n.d_i m)
    dt     = C ds - s dC

in none of which two large terms leave a small one as t goes to 0, unlike the derivatives of an arc cosine. What is even in an
angle is made of the first two lines and so has derivatives at t = 0; what is odd has none there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

import sympy as sp

from yarnverify.symbolic.plain import plain
from yarnverify.symbolic.steps import Check
from yarnverify.symbolic.tree import PI, Expr

if TYPE_CHECKING:
    from yarnverify.symbolic.sums import Steps

Slope: TypeAlias = Callable[[Any, sp.Symbol], Any]  # of an expression by a row
Rule: TypeAlias = Callable[[Slope, sp.Symbol], Any]  # the derivative of a step by a row
_TURNS = ("sin", "cos", "tan")


def _cross(a: list[Any], b: list[Any]) -> list[Any]:
    (x, y, z), (u, v, w) = a, b
    return [y * w - z * v, z * u - x * w, x * v - y * u]


def _dot(a: list[Any], b: list[Any]) -> Any:
    return sp.Add(*(x * y for x, y in zip(a, b, strict=True)))


@dataclass(eq=False)
class VectorAngle:
    """The angle t between two vectors, or pi less it where ``sign`` is -1; what is used of it becomes a step.

    Attributes
    ----------
    reading
        Whose steps these are.
    a, b
        Trees of the vectors.
    """

    reading: Steps
    a: Expr
    b: Expr
    sign: int = 1
    singular: set[str] = field(default_factory=set)

    def _step(self, value: Any, rule: Rule) -> Any:
        symbol = self.reading.hold(value)
        self.reading.rules.setdefault(symbol, rule)
        return symbol

    def _function(self, name: str, sine: Any, cosine: Any, rule: Rule) -> Any:
        return self._step(sp.Function(name, real=True)(sine, cosine), rule)

    @cached_property
    def _sides(self) -> tuple[tuple[list[Any], Any, list[Any]], ...]:
        """Components, length and direction of either vector."""
        hold, found = self.reading.hold, []
        for tree in (self.a, self.b):
            vector, size = self.reading.value(tree), self.reading.value(Expr("norm", (tree,)))
            found.append((vector, size, [hold(part / size) for part in vector]))
        return tuple(found)

    @cached_property
    def _m(self) -> list[Any]:
        (_, _, p), (_, _, q) = self._sides
        return [self.reading.hold(part) for part in _cross(p, q)]

    @cached_property
    def cosine(self) -> Any:
        """cos t."""
        hold, m = self.reading.hold, self._m
        (a, size_a, p), (b, size_b, q) = self._sides
        along_a = [hold(part / size_a) for part in _cross(m, p)]
        along_b = [hold(part / size_b) for part in _cross(q, m)]

        def rule(slope: Slope, row: sp.Symbol) -> Any:
            parts = zip((*along_a, *along_b), (*a, *b), strict=True)
            return self.sign * sp.Add(*(along * slope(component, row) for along, component in parts))

        return self._step(self.sign * _dot(p, q), rule)

    @cached_property
    def sine_squared(self) -> Any:
        """sin(t)^2."""
        cosine = self.cosine
        return self._step(_dot(self._m, self._m), lambda slope, row: -2 * cosine * slope(cosine, row))

    @cached_property
    def squared(self) -> Any:
        """t^2."""
        self.singular.add("pi")
        sine, cosine = self.sine_squared, self.cosine
        excess = self.reading.hold(sp.Function("sine_excess", real=True)(sine, cosine))
        over = self._function("angle_over_sine", sine, cosine, lambda slope, row: -excess * slope(cosine, row))
        return self._function("angle_squared", sine, cosine, lambda slope, row: -2 * over * slope(cosine, row))

    @cached_property
    def versine(self) -> Any:
        """1 - cos t."""
        cosine = self.cosine
        return self._function("versine", self.sine_squared, cosine, lambda slope, row: -slope(cosine, row))

    @cached_property
    def vercosine(self) -> Any:
        """1 + cos t."""
        cosine = self.cosine
        return self._function("versine", self.sine_squared, -cosine, lambda slope, row: slope(cosine, row))

    @cached_property
    def sine(self) -> Any:
        """sin t."""
        self.singular |= {"0", "pi"}
        hold, m = self.reading.hold, self._m
        s = hold(sp.sqrt(self.sine_squared))
        n = [hold(part / s) for part in m]

        def rule(slope: Slope, row: sp.Symbol) -> Any:
            def across(one: sp.Symbol) -> list[Any]:
                along = rule(slope, one)
                return [hold(slope(part, one) - unit * along) for part, unit in zip(m, n, strict=True)]

            def second(slope: Slope, column: sp.Symbol) -> Any:
                bent = _dot(n, [slope(slope(part, row), column) for part in m])
                return _dot(across(row), across(column)) / s + bent

            found = hold(_dot(n, [slope(part, row) for part in m]))
            if found.is_Symbol:
                self.reading.rules.setdefault(found, second)
            return found

        self.reading.rules.setdefault(s, rule)
        return s

    def _turn(self, slope: Slope, row: sp.Symbol) -> Any:
        return self.cosine * slope(self.sine, row) - self.sine * slope(self.cosine, row)

    @cached_property
    def angle(self) -> Any:
        """t."""
        return self._function("angle", self.sine, self.cosine, self._turn)

    @cached_property
    def deviation(self) -> Any:
        """t - pi/2."""
        return self._function("deviation", self.sine, self.cosine, self._turn)

    @cached_property
    def half(self) -> dict[str, Any]:
        """Sine, cosine and tangent of t/2."""
        hold, vercosine = self.reading.hold, self.vercosine
        cosine = hold(sp.sqrt(vercosine / 2))
        return {
            "cos": cosine,
            "sin": self._step(sp.sqrt(self.versine / 2), lambda slope, row: cosine * self._turn(slope, row) / 2),
            "tan": self._function(
                "half_tangent", self.sine, self.cosine, lambda slope, row: self._turn(slope, row) / vercosine
            ),
        }

    def of(self, function: str) -> Any:
        """Sine, cosine or tangent of t."""
        return {"sin": lambda: self.sine, "cos": lambda: self.cosine, "tan": lambda: self.sine / self.cosine}[
            function
        ]()

    def square_of(self, function: str, half: bool) -> Any:
        """The square of a function of t or of t/2, which is even."""
        if half:
            above = {"sin": self.versine / 2, "cos": self.vercosine / 2}
            return above[function] if function in above else self.versine / self.vercosine
        squares = {"sin": self.sine_squared, "cos": self.cosine**2}
        return squares[function] if function in squares else self.sine_squared / self.cosine**2

    def checks(self) -> Iterator[Check]:
        """What is wrong where the angle is 0 or pi and derivatives are wanted that do not exist there."""
        name = f"the angle between {plain(self.a)} and {plain(self.b)}"
        if "0" in self.singular:
            yield self.sine, "derivatives", f"{name} is 0 or pi, where the energy has no derivative"
        elif self.singular:
            end = "pi" if self.sign > 0 else "0"
            yield self.vercosine, "derivatives", f"{name} is {end}, where the energy has no derivative"


class VectorAngles:
    """The angles of a reading's trees, each made once."""

    def __init__(self, reading: Steps) -> None:
        self._reading = reading
        self.found: dict[tuple[Expr, Expr, int], VectorAngle] = {}
        self.sines: set[Expr] = set()  # lengths of cross products in angles of two arguments, which may be zero

    def value(self, expr: Expr) -> Any:
        """The value of a tree that is an angle, a function of one, or a power of such; None for any other."""
        op, args = expr.op, expr.args
        if (angle := self._angle(expr)) is not None:
            return angle.angle
        if op == "add" and len(args) == 2:
            return self._compared(*args)
        if op == "call" and expr.value in _TURNS:
            found, half = self._halved(args[0])
            if found is None:
                return None
            return found.half[str(expr.value)] if half else found.of(str(expr.value))
        if op == "pow" and isinstance(expr.value, int) and expr.value > 1:
            return self._power(args[0], expr.value)
        if op == "mul":
            repeated = [arg for arg in dict.fromkeys(args) if args.count(arg) > 1 and self._is_odd(arg)]
            if repeated:
                rest = [arg for arg in args if arg not in repeated]
                powers = [Expr("pow", (arg,), args.count(arg)) for arg in repeated]
                return self._reading.value(Expr("mul", (*rest, *powers)) if rest or powers[1:] else powers[0])
        return None

    def without_cancellation(self, total: Any) -> Any:
        """A sum in which 1 less or plus a cosine is one step."""
        for angle in self.found.values():
            if "cosine" not in vars(angle) or angle.cosine not in total.free_symbols:
                continue
            share, constant = total.coeff(angle.cosine), total.as_coeff_Add()[0]
            if share.is_Rational and constant and abs(share) == abs(constant):
                whole = angle.versine if share == -constant else angle.vercosine
                return total - share * angle.cosine - constant + constant * whole
        return total

    def checks(self) -> Iterator[Check]:
        """What is wrong where derivatives are wanted that do not exist."""
        for angle in self.found.values():
            yield from angle.checks()

    def _made(self, a: Expr, b: Expr, sign: int) -> VectorAngle:
        return self.found.setdefault((a, b, sign), VectorAngle(self._reading, a, b, sign))

    def _angle(self, expr: Expr) -> VectorAngle | None:
        if expr.op != "call":
            return None
        if expr.value == "atan2" and expr.args[0].op == "norm" and expr.args[0].args[0].op == "cross":
            a, b = expr.args[0].args[0].args
            product = Expr("mul", (a.T, b)), Expr("mul", (b.T, a))
            if expr.args[1] not in product:
                return None
            self.sines.add(expr.args[0])
            return self._made(a, b, 1)
        if expr.value != "arccos":
            return None
        (cosine,) = expr.args
        sign = -1 if cosine.op == "neg" else 1
        match cosine.args[0] if sign < 0 else cosine:
            case Expr(op="mul", args=(Expr(op="transpose", args=(first,)), second)):
                one, other = _direction(first), _direction(second)
                if one is not None and other is not None:
                    return self._made(one, other, sign)
        return None

    def _compared(self, first: Expr, second: Expr) -> Any:
        """An angle less a right angle, or pi less an angle."""
        right, straight = PI / 2, PI
        for one, other in ((first, second), (second, first)):
            sign, inner = (-1, one.args[0]) if one.op == "neg" else (1, one)
            angle = self._angle(inner)
            if angle is None:
                continue
            if other == (-right if sign > 0 else right):
                return sign * angle.deviation
            if sign < 0 and other == straight:
                return self._made(angle.a, angle.b, -angle.sign).angle
        return None

    def _halved(self, expr: Expr) -> tuple[VectorAngle | None, bool]:
        """The angle that a tree is, or is half of."""
        half = expr.op == "frac" and expr.args[1] == Expr("number", value=2)
        return self._angle(expr.args[0] if half else expr), half

    def _is_odd(self, expr: Expr) -> bool:
        """Whether a tree is an angle, or the sine or tangent of one or of its half, or pi less an angle."""
        if self._supplement(expr) is not None or self._angle(expr) is not None:
            return True
        return expr.op == "call" and expr.value in ("sin", "tan") and self._halved(expr.args[0])[0] is not None

    def _supplement(self, expr: Expr) -> VectorAngle | None:
        if expr.op == "add" and len(expr.args) == 2 and PI in expr.args:
            rest = expr.args[1 - expr.args.index(PI)]
            angle = self._angle(rest.args[0]) if rest.op == "neg" else None
            return angle and self._made(angle.a, angle.b, -angle.sign)
        return None

    def _power(self, base: Expr, exponent: int) -> Any:
        if base.op in ("mul", "frac", "neg") and any(self._is_odd(node) for node in base.walk()):
            parts = [self._reading.value(Expr("pow", (part,), exponent)) for part in base.args]
            if base.op == "neg":
                return (-1) ** exponent * parts[0]
            return parts[0] / parts[1] if base.op == "frac" else sp.Mul(*parts)
        if not self._is_odd(base):
            return None
        whole = self._supplement(base) or self._angle(base)
        if whole is not None:
            square = whole.squared
        else:
            angle, half = self._halved(base.args[0])
            assert angle is not None
            square = angle.square_of(str(base.value), half)
        odd = self._reading.value(base) if exponent % 2 else 1
        return square ** (exponent // 2) * odd


def _direction(expr: Expr) -> Expr | None:
    """The vector that a tree is the direction of."""
    if expr.op == "frac" and expr.args[1] == Expr("norm", (expr.args[0],)):
        return expr.args[0]
    return None
