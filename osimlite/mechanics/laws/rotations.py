"""Rotations as the three axes that they turn x, y and z into: the columns of their matrices."""

from __future__ import annotations

from osimlite.mechanics.laws.vectors import Vector

Axes = tuple[Vector, Vector, Vector]

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def along_axes(axes: Axes, a: Vector) -> Vector:
    """A vector that has these components along axes."""
    x, y, z = a
    one, two, three = axes
    return (
        x * one[0] + y * two[0] + z * three[0],
        x * one[1] + y * two[1] + z * three[1],
        x * one[2] + y * two[2] + z * three[2],
    )


def turned_axes(axes: Axes, others: Axes) -> Axes:
    """Axes that have these components along others, which are the first."""
    one, two, three = others
    return along_axes(axes, one), along_axes(axes, two), along_axes(axes, three)


def transposed(axes: Axes) -> Axes:
    """The rotation back."""
    one, two, three = axes
    return (one[0], two[0], three[0]), (one[1], two[1], three[1]), (one[2], two[2], three[2])


def about_axis(axis: Vector, s: float, c: float) -> Axes:
    """By an angle with this sine and cosine about a unit vector (Rodrigues' formula)."""
    x, y, z = axis
    d = 1.0 - c
    return (
        (x * x * d + c, x * y * d + z * s, x * z * d - y * s),
        (x * y * d - z * s, y * y * d + c, y * z * d + x * s),
        (x * z * d + y * s, y * z * d - x * s, z * z * d + c),
    )


def body_fixed(s1: float, c1: float, s2: float, c2: float, s3: float, c3: float) -> Axes:
    """Rx(a) Ry(b) Rz(c), of the sines and cosines of body-fixed X-Y-Z angles a, b, c."""
    return (
        (c2 * c3, c1 * s3 + s1 * s2 * c3, s1 * s3 - c1 * s2 * c3),
        (-c2 * s3, c1 * c3 - s1 * s2 * s3, s1 * c3 + c1 * s2 * s3),
        (s2, -s1 * c2, c1 * c2),
    )
