"""Vectors of three floats, as laws and kernels have them."""

from __future__ import annotations

from math import sqrt
from typing import Any

Vector = tuple[float, float, float]
Numbers = Any
"""An array, or in machine code its address."""

ZERO = 0.0, 0.0, 0.0
EPSILON = 2.220446049250313e-16


def vector(numbers: Numbers, place: int) -> Vector:
    """The three numbers from a place on."""
    return numbers[place], numbers[place + 1], numbers[place + 2]


def put(numbers: Numbers, place: int, a: Vector) -> None:
    """Put a vector into the three numbers from a place on."""
    numbers[place], numbers[place + 1], numbers[place + 2] = a


def component(a: Vector, axis: int) -> float:
    """The component on axis 0, 1 or 2."""
    x, y, z = a
    return x if axis == 0 else (y if axis == 1 else z)


def replaced(a: Vector, axis: int, value: float) -> Vector:
    """The vector with another component on axis 0, 1 or 2."""
    x, y, z = a
    return value if axis == 0 else x, value if axis == 1 else y, value if axis == 2 else z


def plus(a: Vector, b: Vector) -> Vector:
    """a + b."""
    ax, ay, az = a
    bx, by, bz = b
    return ax + bx, ay + by, az + bz


def minus(a: Vector, b: Vector) -> Vector:
    """a - b."""
    ax, ay, az = a
    bx, by, bz = b
    return ax - bx, ay - by, az - bz


def times(k: float, a: Vector) -> Vector:
    """k a."""
    x, y, z = a
    return k * x, k * y, k * z


def over(a: Vector, k: float) -> Vector:
    """a / k."""
    x, y, z = a
    return x / k, y / k, z / k


def along(a: Vector, k: float, b: Vector) -> Vector:
    """a + k b."""
    ax, ay, az = a
    bx, by, bz = b
    return ax + k * bx, ay + k * by, az + k * bz


def elementwise(a: Vector, b: Vector) -> Vector:
    """The products of the components."""
    ax, ay, az = a
    bx, by, bz = b
    return ax * bx, ay * by, az * bz


def dot(a: Vector, b: Vector) -> float:
    """a . b."""
    ax, ay, az = a
    bx, by, bz = b
    return ax * bx + ay * by + az * bz


def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    ax, ay, az = a
    bx, by, bz = b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def norm(a: Vector) -> float:
    """|a|."""
    return sqrt(dot(a, a))


def unit(a: Vector) -> Vector:
    """a / |a|, or the zero vector if a is shorter than EPSILON, as OpenSim's wrapping has it."""
    size = norm(a)
    return times(1.0 / size, a) if size >= EPSILON else (0.0, 0.0, 0.0)


def turned(rows: Numbers, a: Vector) -> Vector:
    """R a for a rotation R by rows."""
    x, y, z = a
    return (
        rows[0] * x + rows[1] * y + rows[2] * z,
        rows[3] * x + rows[4] * y + rows[5] * z,
        rows[6] * x + rows[7] * y + rows[8] * z,
    )


def turned_back(rows: Numbers, a: Vector) -> Vector:
    """The transpose of R times a."""
    x, y, z = a
    return (
        rows[0] * x + rows[3] * y + rows[6] * z,
        rows[1] * x + rows[4] * y + rows[7] * z,
        rows[2] * x + rows[5] * y + rows[8] * z,
    )
