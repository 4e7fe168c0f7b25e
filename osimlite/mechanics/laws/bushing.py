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
    """Return the body-fixed X-Y-Z angles (a, b, c) of a rotation (rad), with -pi/2 <= b <= pi/2.

    Where b is a right angle, a and c turn about the same axis; then c = 0.

    Args:
        R00: entry of the rotation matrix in row 0 and column 0.
        R01: entry in row 0 and column 1.
        R02: entry in row 0 and column 2.
        R10: entry in row 1 and column 0.
        R11: entry in row 1 and column 1.
        R12: entry in row 1 and column 2.
        R22: entry in row 2 and column 2.

    Returns:
        (a, b, c).
    """
    # cos b is a factor of R00 and R01, and of R12 and R22. It keeps full precision near a right
    # angle, where asin(R02) would lose half of the digits.
    cosine = sqrt(0.5 * (R00 * R00 + R01 * R01 + R12 * R12 + R22 * R22))
    b = atan2(R02, cosine)
    # Gimbal lock: only the sum (or difference) of a and c is determined.
    if cosine < 1e-12:
        return atan2(R10 if R02 > 0.0 else -R10, R11), b, 0.0
    return atan2(-R12, R22), b, atan2(-R01, R00)


def xyz_rates(b: float, c: float, wx: float, wy: float, wz: float) -> tuple[float, float, float]:
    """Return the rates of the angles (rad/s), not finite where cos b = 0.

    Args:
        b: second angle (rad).
        c: third angle (rad).
        wx: x component of the angular velocity of M in F, along the axes of M (rad/s).
        wy: y component of this angular velocity (rad/s).
        wz: z component of this angular velocity (rad/s).

    Returns:
        Rates of a, b and c.
    """
    # `first` is the rate of a; cos b = 0 is the singularity of body-fixed X-Y-Z angles.
    first = (cos(c) * wx - sin(c) * wy) / cos(b)
    return first, sin(c) * wx + cos(c) * wy, wz - sin(b) * first


def xyz_moment(b: float, c: float, fa: float, fb: float, fc: float) -> tuple[float, float, float]:
    """Return the moment on M along its axes (N m).

    Args:
        b: second angle (rad).
        c: third angle (rad).
        fa: generalized force on a (N m).
        fb: generalized force on b (N m).
        fc: generalized force on c (N m).

    Returns:
        Components x, y and z.
    """
    # Transpose of the matrix in `xyz_rates`, so that moment w equals force times angle rates.
    across = (fa - sin(b) * fc) / cos(b)
    return cos(c) * across + sin(c) * fb, cos(c) * fb - sin(c) * across, fc


def bushing_load(x: float, v: float, k: float, c: float) -> float:
    """Return the force -k x - c v of one of the six spring-dampers on M, in N m (N).

    Args:
        x: deviation, rad (m).
        v: rate of the deviation, rad/s (m/s).
        k: stiffness, N m/rad (N/m).
        c: damping, N m/(rad/s) (N/(m/s)).
    """
    return -k * x - c * v


def bushing_dissipation(v: float, c: float) -> float:
    """Return the power c v^2 that one of the six dampers dissipates (W).

    Args:
        v: rate of the deviation, rad/s (m/s).
        c: damping, N m/(rad/s) (N/(m/s)).
    """
    return c * v * v
