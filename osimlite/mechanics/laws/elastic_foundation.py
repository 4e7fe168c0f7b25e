"""Elastic foundation: a mesh covered by a layer of springs, one at the middle of every triangle.

A spring acts while its middle is inside the other surface. It pushes from the middle towards the
nearest point of that surface, at that point; its opposite acts on the other surface at the same
point. All vectors are in one frame of the caller's choice, usually ground.

Sources: K. L. Johnson, "Contact Mechanics" (1985), section 4.3, for the foundation; damping and
friction as in Simbody's ElasticFoundationForce (friction as in
:mod:`osimlite.mechanics.laws.hunt_crossley`).
"""

from __future__ import annotations

from typing import NamedTuple

from osimlite.mechanics.laws.hunt_crossley import friction_coefficient
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    cross,
    divide,
    dot,
    minus,
    norm,
    plus,
    times,
)


def spring_in_half_space(o: Vector, n: Vector, middle: Vector) -> tuple[float, Vector]:
    """Return the depth of the middle of a spring in a half space, and the nearest point of the plane.

    Args:
        o: point on the plane (m).
        n: outward unit normal of the half space.
        middle: middle of the spring (m).

    Returns:
        Depth and point (m). The spring acts where the depth is positive.
    """
    d = dot(minus(o, middle), n)
    return d, add_scaled(middle, d, n)


def spring_in_sphere(center: Vector, r: float, middle: Vector) -> tuple[float, Vector]:
    """Return the depth of the middle of a spring in a sphere, and the nearest point of the sphere.

    At the very centre no point is nearest, so that the spring does not act.

    Args:
        center: centre of the sphere (m).
        r: radius of the sphere (m).
        middle: middle of the spring (m).

    Returns:
        Depth and point (m). The spring acts where the depth is positive.
    """
    radial = minus(middle, center)
    distance = norm(radial)
    # Scale the radius vector to the surface; at the centre its direction is undefined.
    return (
        (r - distance, add_scaled(center, r / distance, radial))
        if distance > 0.0
        else (0.0, center)
    )


class FoundationSpring(NamedTuple):
    """Constants of a spring of the layer."""

    k: float  # stiffness of the layer times area of the triangle, N/m
    c: float  # dissipation, s/m
    us: float  # coefficient of static friction, see `hunt_crossley.friction_coefficient`
    ud: float  # coefficient of dynamic friction
    uv: float  # coefficient of viscous friction, s/m
    vt: float  # transition velocity, m/s


def spring_load(
    spring: FoundationSpring,
    middle: Vector,
    end: Vector,
    about: Vector,
    v: Vector,
    turning: Vector,
) -> tuple[Vector, Vector, float]:
    """Return the load of one spring on the mesh at the nearest point of the other surface.

    With d the vector from the middle to the end and vn the component along d of the velocity there:
    f = k |d| (1 + c vn) along d, zero where that is not positive; and f mu along the slip, where mu
    is its `friction_coefficient`. The energy is k |d|^2 / 2.

    Args:
        spring: constants of the spring.
        middle: middle of the spring (m).
        end: nearest point of the other surface (m).
        about: reference point of torque and velocity (m).
        v: velocity relative to the mesh of the other surface's point at `about` (m/s).
        turning: angular velocity of the other surface relative to the mesh (rad/s).

    Returns:
        Force (N), torque about `about` (N m), and energy (J).
    """
    k, c, us, ud, uv, vt = spring
    stretch = minus(end, middle)
    d = norm(stretch)
    if d == 0.0:
        return ZERO, ZERO, 0.0
    energy = 0.5 * k * d * d
    n = divide(stretch, d)
    arm = minus(end, about)
    # Velocity of the material of the other surface at the nearest point, relative to the mesh.
    point_velocity = plus(v, cross(turning, arm))
    vn = dot(point_velocity, n)
    f = k * d * (1.0 + c * vn)
    # A fast separation would make the contact pull; only the stored energy remains.
    if f <= 0.0:
        return ZERO, ZERO, energy
    slip = add_scaled(point_velocity, -vn, n)
    w = norm(slip)
    # Without slip the direction of friction is undefined, and its size is 0.
    force = add_scaled(
        times(f, n), f * friction_coefficient(w, us, ud, uv, vt) / w if w > 0.0 else 0.0, slip
    )
    return force, cross(arm, force), energy
