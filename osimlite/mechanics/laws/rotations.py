"""Rotations as three axes, the columns of their matrices; and sine and cosine of joint angles.

Sources of `sine_cosine`: S. L. Moshier, Methods and Programs for Mathematical Functions, 1989 (the
approximations of the Cephes library); W. J. Cody and W. Waite, Software Manual for the Elementary
Functions, 1980 (the reduction of the argument). Its error is less than 1.5 units in the last place.
"""

from __future__ import annotations

from math import cos, floor, sin

from osimlite.mechanics.laws.vectors import Vector

Axes = tuple[Vector, Vector, Vector]
"""Three unit vectors: the columns of a rotation matrix."""

X = (1.0, 0.0, 0.0)
"""Unit vector along x."""
Y = (0.0, 1.0, 0.0)
"""Unit vector along y."""
Z = (0.0, 0.0, 1.0)
"""Unit vector along z."""


def combine_axes(axes: Axes, a: Vector) -> Vector:
    """Return the vector with these components along axes.

    Args:
        axes: axes, usually those of a frame in another one.
        a: components of the vector along the axes.
    """
    x, y, z = a
    x_axis, y_axis, z_axis = axes
    return (
        x * x_axis[0] + y * y_axis[0] + z * z_axis[0],
        x * x_axis[1] + y * y_axis[1] + z * z_axis[1],
        x * x_axis[2] + y * y_axis[2] + z * z_axis[2],
    )


def multiply_rotations(axes: Axes, local_axes: Axes) -> Axes:
    """Return axes whose components along `axes` are `local_axes`: the product of both rotations.

    Args:
        axes: axes of a frame B in A.
        local_axes: axes of a frame C in B.

    Returns:
        Axes of C in A.
    """
    x_axis, y_axis, z_axis = local_axes
    return combine_axes(axes, x_axis), combine_axes(axes, y_axis), combine_axes(axes, z_axis)


def transpose_rotation(axes: Axes) -> Axes:
    """Return the inverse of a rotation, the transpose of its matrix."""
    x_axis, y_axis, z_axis = axes
    return (
        (x_axis[0], y_axis[0], z_axis[0]),
        (x_axis[1], y_axis[1], z_axis[1]),
        (x_axis[2], y_axis[2], z_axis[2]),
    )


def rotation_about_axis(axis: Vector, s: float, c: float) -> Axes:
    """Return the rotation about a unit vector by Rodrigues' formula, from sine s and cosine c.

    It is R = c I + (1 - c) a a' + s [a x].

    Args:
        axis: unit vector a.
        s: sine of the angle.
        c: cosine of the angle.
    """
    x, y, z = axis
    d = 1.0 - c
    return (
        (x * x * d + c, x * y * d + z * s, x * z * d - y * s),
        (x * y * d - z * s, y * y * d + c, y * z * d + x * s),
        (x * z * d + y * s, y * z * d - x * s, z * z * d + c),
    )


def rotation_from_xyz(s1: float, c1: float, s2: float, c2: float, s3: float, c3: float) -> Axes:
    """Return the rotation Rx(a) Ry(b) Rz(c) of body-fixed X-Y-Z angles a, b, c.

    Args:
        s1: sine of a.
        c1: cosine of a.
        s2: sine of b.
        c2: cosine of b.
        s3: sine of c.
        c3: cosine of c.
    """
    return (
        (c2 * c3, c1 * s3 + s1 * s2 * c3, s1 * s3 - c1 * s2 * c3),
        (-c2 * s3, c1 * c3 - s1 * s2 * s3, s1 * c3 + c1 * s2 * s3),
        (s2, -s1 * c2, c1 * c2),
    )


QUARTER_TURNS_PER_RAD = 0.6366197723675814
"""2 / pi, the number of quarter turns per radian."""
MAX_ANGLE_RAD = 1e6
"""Largest angle (rad) for which the reduction of the argument is accurate enough."""
# pi / 2 in three parts (Cody and Waite): the digits of the first two are so few that their products
# with a number of quarter turns are exact.
HIGH, MIDDLE, LOW = 1.5707962512969971, 7.549789415861596e-8, 5.390302858158119e-15


def sine_cosine(angle: float) -> tuple[float, float]:
    """Return sine and cosine of an angle (rad).

    Returns:
        Sine and cosine.
    """
    # Also true for NaN. Large angles are rare, and the C library reduces them with more digits.
    if not abs(angle) < MAX_ANGLE_RAD:
        return sin(angle), cos(angle)
    quarters = floor(angle * QUARTER_TURNS_PER_RAD + 0.5)
    z = ((angle - quarters * HIGH) - quarters * MIDDLE) - quarters * LOW
    # z is between -pi/4 and pi/4; polynomials of Cephes in z^2.
    a = z * z
    s = 1.58962301576546568060e-10 * a - 2.50507477628578072866e-8
    s = (s * a + 2.75573136213857245213e-6) * a - 1.98412698295895385996e-4
    s = (s * a + 8.33333333332211858878e-3) * a - 1.66666666666666307295e-1
    s = z + z * a * s
    c = -1.13585365213876817300e-11 * a + 2.08757008419747316778e-9
    c = (c * a - 2.75573141792967388112e-7) * a + 2.48015872888517045348e-5
    c = (c * a - 1.38888888888730564116e-3) * a + 4.16666666666665929218e-2
    h = 0.5 * a
    t = 1.0 - h
    # Add the rounding error of t.
    c = t + ((1.0 - t) - h + a * a * c)
    # The quadrant says which of both is which, and with what signs. Two bits of the integer
    # suffice, for negative numbers too.
    quadrant = int(quarters) & 3
    if quadrant & 1:
        s, c = c, -s
    if quadrant & 2:
        s, c = -s, -c
    return s, c
