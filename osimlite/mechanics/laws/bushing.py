"""Bushing: springs and dampers for the six deviations of a frame M from a frame F.

The deviations are the body-fixed X-Y-Z angles (a, b, c) of M in F, so that R = Rx(a) Ry(b) Rz(c),
and the origin of M in F along the axes of F. The generalized forces on the angles become a moment
in M by the transpose of the matrix N that turns the angular velocity w of M in F, along the axes of
M, into rates of the angles. Source: OpenSim's BushingForce and its kin; T. Kane, P. Likins and D.
Levinson, Spacecraft Dynamics (1983), table for body-three 1-2-3.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt


def xyz_angles(
    R00: float, R01: float, R02: float, R10: float, R11: float, R12: float, R22: float
) -> tuple[float, float, float]:
    """Body-fixed X-Y-Z angles (a, b, c) of a rotation, in rad; -pi/2 <= b <= pi/2.

    Where b is a right angle, a and c turn about one axis; all of the turning is then in a.

    Args:
        R00: entry of the rotation matrix in the row and the column of these numbers.
    """
    cosine = sqrt(0.5 * (R00 * R00 + R01 * R01 + R12 * R12 + R22 * R22))
    b = atan2(R02, cosine)
    if cosine < 1e-12:
        return atan2(R10 if R02 > 0.0 else -R10, R11), b, 0.0
    return atan2(-R12, R22), b, atan2(-R01, R00)


def xyz_rates(b: float, c: float, wx: float, wy: float, wz: float) -> tuple[float, float, float]:
    """Rates of the angles, in rad/s; not finite where cos b = 0.

    Args:
        b: second angle, rad.
        c: third angle, rad.
        wx: angular velocity (wx, wy, wz) of M in F, along the axes of M, rad/s.
    """
    first = (cos(c) * wx - sin(c) * wy) / cos(b)
    return first, sin(c) * wx + cos(c) * wy, wz - sin(b) * first


def xyz_moment(b: float, c: float, fa: float, fb: float, fc: float) -> tuple[float, float, float]:
    """Moment (x, y, z) on M along its axes, in N.m.

    Args:
        b: second angle, rad.
        c: third angle, rad.
        fa: generalized forces (fa, fb, fc) on the angles, N.m.
    """
    across = (fa - sin(b) * fc) / cos(b)
    return cos(c) * across + sin(c) * fb, cos(c) * fb - sin(c) * across, fc


def bushing_load(x: float, v: float, k: float, c: float) -> float:
    """Force -k x - c v of one of the six spring-dampers on M, in N.m (N).

    Args:
        x: deviation, rad (m).
        v: its rate, rad/s (m/s).
        k: stiffness, N.m/rad (N/m).
        c: damping, N.m/(rad/s) (N/(m/s)).
    """
    return -k * x - c * v


def bushing_dissipation(v: float, c: float) -> float:
    """Power that one of the six dampers takes up, in W.

    Args:
        v: rate of its deviation, rad/s (m/s).
        c: damping, N.m/(rad/s) (N/(m/s)).
    """
    return c * v * v
