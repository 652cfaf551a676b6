"""Which trees are angles between vectors, functions of these, or powers: what is even in an angle is told from what is odd."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import sympy as sp

from yarnverify.symbolic.functions import sides_of
from yarnverify.symbolic.steps import Check
from yarnverify.symbolic.tree import PI, Expr
from yarnverify.symbolic.vector_angles import Stepwise, VectorAngle

_TURNS = ("sin", "cos", "tan")


class VectorAngles:
    """The angles of a reading's trees, each made once."""

    def __init__(self, reading: Stepwise) -> None:
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
        opposite = expr.args[0].op == "neg"
        sides = sides_of(replace(expr, args=expr.args[0].args) if opposite else expr)
        return None if sides is None else self._made(*sides, -1 if opposite else 1)

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
