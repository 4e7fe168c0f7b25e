"""Smooth contact of a sphere with a half space."""

from typing import Any

from osimlite.errors import ModelError
from osimlite.mechanics.laws.smooth_contact import (
    smooth_contact_energy,
    smooth_contact_force,
    smooth_hertz,
)
from osimlite.mechanics.laws.vectors import Vector
from osimlite.schema.contact_forces import SmoothSphereHalfSpaceForce
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.geometries.sphere_on_plane import SPHERE_ON_PLANE
from osimlite.simulation.elements.kind import Kind


def contact(
    d: float,
    radius: float,
    n: Vector,
    v: Vector,
    E: float,
    cf: float,
    bd: float,
    c: float,
    us: float,
    ud: float,
    uv: float,
    vt: float,
    bv: float,
) -> tuple[float, float, float, float]:
    """Force on the sphere, and energy."""
    hertz = smooth_hertz(d, radius, E, cf, bd)
    fx, fy, fz = smooth_contact_force(hertz, c, us, ud, uv, vt, cf, bv, n, v)
    return fx, fy, fz, smooth_contact_energy(hertz, d)


def _check(builder: ElementBuilder, force: Any) -> None:
    if (
        force.stiffness < 0.0
        or force.constant_contact_force < 0.0
        or force.transition_velocity <= 0.0
    ):
        raise ModelError(
            f"'{builder.path(force)}' needs a stiffness and a constant_contact_force that are not negative, "
            "and a positive transition_velocity"
        )


KIND = Kind(
    SmoothSphereHalfSpaceForce,
    SPHERE_ON_PLANE,
    contact,
    outputs=("fx", "fy", "fz", "energy"),
    parameters=(
        "stiffness",
        "constant_contact_force",
        "hertz_smoothing",
        "dissipation",
        "static_friction",
        "dynamic_friction",
        "viscous_friction",
        "transition_velocity",
        "hunt_crossley_smoothing",
    ),
    contact_response="smooth_contact_response",
    check=_check,
)
