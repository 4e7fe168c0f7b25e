"""Smooth contact of a half space with a sphere, and of a station with the ground.

As in :mod:`osimlite.mechanics.laws.hunt_crossley` the half space is surface 1 and the sphere
surface 2, n is the unit normal of the half space, d the depth and v the velocity of surface 1
relative to surface 2. Source: G. Serrancolí et al., "Subject-exoskeleton contact model calibration
leads to accurate interaction force predictions", IEEE Transactions on Neural Systems and
Rehabilitation Engineering 27 (2019) 1597-1605, as in Simbody's SmoothSphereHalfSpaceForce.

The station touches the plane y = 0 of ground by a damped spring. Source: A. J. Meyer et al.,
"Muscle synergies facilitate computational prediction of subject-specific walking motions",
Frontiers in Bioengineering and Biotechnology 4 (2016) 77, as in OpenSim's MeyerFregly2016Force.
"""

from __future__ import annotations

from math import cosh, log, sqrt, tanh
from typing import NamedTuple

from osimlite.mechanics.laws.hunt_crossley import friction_coefficient
from osimlite.mechanics.laws.vectors import Vector, add_scaled, dot, times


def smooth_hertz(d: float, R: float, E: float, cf: float, bd: float) -> float:
    """Return the elastic force of a sphere on a half space (N).

    It is (4/3) k sqrt(R k) (d^2 + cf)^(3/4) (1 + tanh(bd d)) / 2 with k = E^(2/3) / 2: Hertz'
    force, smoothed at d = 0.

    Args:
        d: depth (m), negative for a gap.
        R: radius of the sphere (m).
        E: stiffness property (Pa).
        cf: constant that keeps the force differentiable (m²).
        bd: steepness of the transition at contact (1/m).
    """
    # Sphere and half space have the same stiffness, so that both springs in series are half as
    # stiff.
    k: float = 0.5 * E ** (2.0 / 3.0)
    s = sqrt(d * d + cf)
    return (4.0 / 3.0) * k * sqrt(R * k) * s * sqrt(s) * (0.5 + 0.5 * tanh(bd * d))


def smooth_contact_force(
    hertz: float,
    c: float,
    us: float,
    ud: float,
    uv: float,
    vt: float,
    cf: float,
    bv: float,
    n: Vector,
    v: Vector,
) -> Vector:
    """Return the force on the sphere at the point midway between the two surfaces (N).

    f = fh (1 + (3/2) c vn) (1 + tanh(bv (vn + 2 / (3 c)))) / 2 along n, and along the slip vT f mu / w
    with w = sqrt(|vT|^2 + cf) and mu its `friction_coefficient`.

    Args:
        hertz: elastic force fh from `smooth_hertz` (N).
        c: dissipation (s/m); with 0, f = fh.
        us: coefficient of static friction, see `hunt_crossley.friction_coefficient`.
        ud: coefficient of dynamic friction.
        uv: coefficient of viscous friction (s/m).
        vt: transition velocity (m/s).
        cf: constant that keeps w from vanishing (m²/s²), the same number as in `smooth_hertz`.
        bv: steepness of the transition as the surfaces separate (s/m).
        n: outward unit normal of the half space.
        v: velocity of the half space relative to the sphere at the point (m/s).
    """
    vn = dot(v, n)
    f = hertz * (1.0 + 1.5 * c * vn)
    # The transition is centred where the factor of damping vanishes, vn = -2 / (3 c).
    if c != 0.0:
        f *= 0.5 + 0.5 * tanh(bv * (vn + 2.0 / (3.0 * c)))
    slip = add_scaled(v, -vn, n)
    w = sqrt(dot(slip, slip) + cf)
    return add_scaled(times(f, n), f * friction_coefficient(w, us, ud, uv, vt) / w, slip)


class SmoothContact(NamedTuple):
    """Constants of a smooth contact."""

    R: float  # radius of the sphere, m
    E: float  # stiffness property, Pa
    cf: float  # constant of smoothing, m², m²/s²
    bd: float  # steepness of the transition at contact, 1/m
    c: float  # dissipation, s/m
    us: float  # coefficient of static friction
    ud: float  # coefficient of dynamic friction
    uv: float  # coefficient of viscous friction, s/m
    vt: float  # transition velocity, m/s
    bv: float  # steepness of the transition as the surfaces separate, s/m


def smooth_contact_derivatives(
    constants: SmoothContact, d: float, n: Vector, v: Vector
) -> tuple[float, float, float, float]:
    """Return the derivatives of the force of `smooth_contact_force`.

    Args:
        constants: constants of the contact.
        d: depth (m), negative for a gap.
        n: outward unit normal of the half space.
        v: velocity of the half space relative to the sphere at the point (m/s).

    Returns:
        Derivatives of the normal force by the depth (N/m) and by the approach velocity v n (N s/m),
        tangential force over slip (N s/m), and relative derivative of the force by the depth (1/m);
        all 0 where there is no force.
    """
    R, E, cf, bd, c, us, ud, uv, vt, bv = constants
    hertz = smooth_hertz(d, R, E, cf, bd)
    vn = dot(v, n)
    # Deep in a gap tanh underflows to -1 and the force is exactly 0.
    if hertz <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    # The derivative of (1 + tanh(b x)) / 2 is that expression times b (1 - tanh(b x)).
    growth = 1.5 * d / (d * d + cf) + bd * (1.0 - tanh(bd * d))
    damping_factor = 1.0 + 1.5 * c * vn
    slope = 1.5 * c
    if c != 0.0:
        t = tanh(bv * (vn + 2.0 / (3.0 * c)))
        slope = (0.5 + 0.5 * t) * (slope + damping_factor * bv * (1.0 - t))
        damping_factor *= 0.5 + 0.5 * t
    slip = add_scaled(v, -vn, n)
    w = sqrt(dot(slip, slip) + cf)
    return (
        hertz * damping_factor * growth,
        hertz * slope,
        hertz * damping_factor * friction_coefficient(w, us, ud, uv, vt) / w,
        growth,
    )


def smooth_contact_energy(hertz: float, d: float) -> float:
    """Return (2/5) fh d, Simbody's approximation of the energy (J); negative and tiny for a gap.

    Args:
        hertz: elastic force fh from `smooth_hertz` (N).
        d: depth (m).
    """
    return 0.4 * hertz * d


def station_contact_force(
    y: float,
    vx: float,
    vy: float,
    vz: float,
    k: float,
    c: float,
    l0: float,
    ud: float,
    uv: float,
    vl: float,
) -> tuple[float, float, float]:
    """Return the force on a station that touches the plane y = 0 of ground.

    With h = 0.7 tanh((y - l0) / 0.7), s = (k - k0) / 2 and v = (k + k0) / (k - k0), the elastic force
    is s (v (y0 - h) - e (log cosh((y0 + d) / e) - log cosh((h + d) / e))), where k0 = 0.1 N/m, y0 =
    0.01 m, d = e = 0.001 m. It is multiplied by 1 - c vy. The friction is (ud tanh(w / vl) + uv w)
    w / (w + w0) times the normal force, where w is the slip velocity and w0 = 1e-4 m/s.

    Args:
        y: height of the station (m).
        vx: velocity of the station in ground along x (m/s).
        vy: velocity of the station in ground along y (m/s).
        vz: velocity of the station in ground along z (m/s).
        k: stiffness, not k0 (N/m).
        c: dissipation (s/m).
        l0: height at which the spring rests (m).
        ud: coefficient of dynamic friction.
        uv: coefficient of viscous friction (s/m).
        vl: latch velocity, not 0 (m/s).

    Returns:
        (fx, fy, fz), N.
    """
    # 0.7 tanh(x / 0.7) bounds the deflection, so that cosh cannot overflow.
    h = 0.7 * tanh((y - l0) / 0.7)
    s = 0.5 * (k - 0.1)
    v = (k + 0.1) / (k - 0.1)
    # log cosh is the smooth transition from the small stiffness k0 above the ground to k below it.
    elastic = s * (v * (0.01 - h) - 0.001 * (log(cosh(11.0)) - log(cosh((h + 0.001) / 0.001))))
    fy = elastic * (1.0 - c * vy)
    w = sqrt(vx * vx + vz * vz)
    # 1e-4 m/s keeps the direction of friction defined at rest.
    g = -fy * (ud * tanh(w / vl) + uv * w) / (w + 1e-4)
    return g * vx, fy, g * vz
