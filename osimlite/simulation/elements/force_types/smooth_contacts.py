"""Contact laws that are smooth in the motion: a sphere on a half space, and a station on the ground plane."""

from typing import Any

from osimlite.errors import ModelError
from osimlite.mechanics.laws.smooth_contact import (
    smooth_contact_energy,
    smooth_contact_force,
    smooth_hertz,
    station_contact_force,
)
from osimlite.mechanics.laws.vectors import Vector
from osimlite.schema.contact_forces import MeyerFregly2016Force, SmoothSphereHalfSpaceForce
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.force_type import ForceType
from osimlite.simulation.elements.geometries.body import STATION
from osimlite.simulation.elements.geometries.sphere_on_plane import SPHERE_ON_PLANE
from osimlite.simulation.elements.registry import register_force_type


def compute_smooth_contact(
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
    """Return the force on a sphere that touches a half space smoothly.

    Args:
        d: depth, m.
        radius: radius of the sphere, m.
        n: outward unit normal of the half space.
        v: velocity of the half space relative to the sphere, m/s.
        E: stiffness, Pa.
        cf: constant_contact_force, which keeps roots away from 0, m^2 and m^2/s^2.
        bd: sharpness of the onset over the depth, 1/m.
        c: dissipation, s/m.
        us: static friction.
        ud: dynamic friction.
        uv: viscous friction, s/m.
        vt: transition velocity, m/s.
        bv: sharpness of the release over the speed, s/m.

    Returns:
        Components of the force on the sphere (N) in ground, and energy (J).
    """
    hertz = smooth_hertz(d, radius, E, cf, bd)
    fx, fy, fz = smooth_contact_force(hertz, c, us, ud, uv, vt, cf, bv, n, v)
    return fx, fy, fz, smooth_contact_energy(hertz, d)


def _check_smooth_contact(builder: ElementBuilder, force: Any) -> None:
    if (
        force.stiffness < 0.0
        or force.constant_contact_force < 0.0
        or force.transition_velocity <= 0.0
    ):
        raise ModelError(
            f"'{builder.path(force)}' needs a stiffness and a constant_contact_force that are not negative, "
            "and a positive transition_velocity"
        )


register_force_type(
    ForceType(
        SmoothSphereHalfSpaceForce,
        SPHERE_ON_PLANE,
        compute_smooth_contact,
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
        check=_check_smooth_contact,
    )
)


def _check_station_contact(builder: ElementBuilder, force: Any) -> None:
    if force.stiffness == 0.1 or force.latch_velocity == 0.0:
        raise ModelError(
            f"'{builder.path(force)}' needs a latch_velocity that is not 0, and a stiffness other than 0.1"
        )


register_force_type(
    ForceType(
        MeyerFregly2016Force,
        STATION,
        station_contact_force,
        outputs=("fx", "fy", "fz"),
        parameters=(
            "stiffness",
            "dissipation",
            "spring_resting_length",
            "dynamic_friction",
            "viscous_friction",
            "latch_velocity",
        ),
        check=_check_station_contact,
    )
)
