"""Vectors of three floats, as laws and kernels use them."""

from __future__ import annotations

from math import sqrt
from typing import Any

Vector = tuple[float, float, float]
Numbers = Any
"""Array of floats, or its address in machine code."""

ZERO = 0.0, 0.0, 0.0
"""Zero vector."""
EPSILON = 2.220446049250313e-16
"""Spacing of floats at 1."""


def vector(numbers: Numbers, offset: int) -> Vector:
    """Return the three numbers of an array from an offset on.

    Args:
        numbers: array of floats.
        offset: index of the first component.
    """
    return numbers[offset], numbers[offset + 1], numbers[offset + 2]


def store_vector(numbers: Numbers, offset: int, a: Vector) -> None:
    """Store a vector in the three numbers of an array from an offset on.

    Args:
        numbers: array of floats.
        offset: index of the first component.
        a: vector.
    """
    numbers[offset], numbers[offset + 1], numbers[offset + 2] = a


def component(a: Vector, axis: int) -> float:
    """Return the component of a vector on axis 0, 1 or 2.

    Translated kernels cannot index a tuple by a variable.

    Args:
        a: vector.
        axis: index of the axis.
    """
    x, y, z = a
    return x if axis == 0 else (y if axis == 1 else z)


def replace_component(a: Vector, axis: int, value: float) -> Vector:
    """Return a vector with another component on axis 0, 1 or 2.

    Args:
        a: vector.
        axis: index of the axis.
        value: new component.
    """
    x, y, z = a
    return value if axis == 0 else x, value if axis == 1 else y, value if axis == 2 else z


def plus(a: Vector, b: Vector) -> Vector:
    """Return the sum a + b of two vectors."""
    ax, ay, az = a
    bx, by, bz = b
    return ax + bx, ay + by, az + bz


def minus(a: Vector, b: Vector) -> Vector:
    """Return the difference a - b of two vectors."""
    ax, ay, az = a
    bx, by, bz = b
    return ax - bx, ay - by, az - bz


def times(k: float, a: Vector) -> Vector:
    """Return the multiple k a of a vector."""
    x, y, z = a
    return k * x, k * y, k * z


def divide(a: Vector, k: float) -> Vector:
    """Return the quotient a / k of a vector and a number that is not 0."""
    x, y, z = a
    return x / k, y / k, z / k


def add_scaled(a: Vector, k: float, b: Vector) -> Vector:
    """Return the sum a + k b of a vector and a multiple of another one."""
    ax, ay, az = a
    bx, by, bz = b
    return ax + k * bx, ay + k * by, az + k * bz


def multiply_elementwise(a: Vector, b: Vector) -> Vector:
    """Return the vector of products of the components."""
    ax, ay, az = a
    bx, by, bz = b
    return ax * bx, ay * by, az * bz


def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product a . b."""
    ax, ay, az = a
    bx, by, bz = b
    return ax * bx + ay * by + az * bz


def cross(a: Vector, b: Vector) -> Vector:
    """Return the cross product a x b."""
    ax, ay, az = a
    bx, by, bz = b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def norm(a: Vector) -> float:
    """Return the Euclidean norm |a| of a vector."""
    return sqrt(dot(a, a))


def unit(a: Vector) -> Vector:
    """Return a / |a|, or the zero vector if |a| < EPSILON, as OpenSim's wrapping does."""
    # OpenSim's wrapping takes the zero vector as the direction of points that coincide.
    size = norm(a)
    return times(1.0 / size, a) if size >= EPSILON else (0.0, 0.0, 0.0)


def rotate(rows: Numbers, a: Vector) -> Vector:
    """Return R a for a rotation R that is stored by rows.

    Args:
        rows: nine entries of R, row by row.
        a: vector.
    """
    x, y, z = a
    return (
        rows[0] * x + rows[1] * y + rows[2] * z,
        rows[3] * x + rows[4] * y + rows[5] * z,
        rows[6] * x + rows[7] * y + rows[8] * z,
    )


def rotate_back(rows: Numbers, a: Vector) -> Vector:
    """Return Rᵀ a for a rotation R that is stored by rows.

    Args:
        rows: nine entries of R, row by row.
        a: vector.
    """
    x, y, z = a
    return (
        rows[0] * x + rows[3] * y + rows[6] * z,
        rows[1] * x + rows[4] * y + rows[7] * z,
        rows[2] * x + rows[5] * y + rows[8] * z,
    )
