"""Smooth, dimensionless curves of the muscles of Millard et al. (2013), with measurable parameters.

A `curviness` lies between 0 (straight pieces) and 1 (as round as it gets). Numbers left out are
chosen by OpenSim.
"""

from typing import Annotated

from osimlite.schema.facts import Facts
from osimlite.schema.fields import Number, maybe, real
from osimlite.schema.functions import Function


class ActiveForceLengthCurve(Function):
    """Active force of a fiber over its length."""

    facts = Facts(
        refused="min_norm_active_fiber_length transition_norm_fiber_length max_norm_active_fiber_length "
        "shallow_ascending_slope minimum_value",
        zero={"": "min_norm_active_fiber_length"},
    )

    min_norm_active_fiber_length: Annotated[float, real(domain="> 0")] = 0.4441
    """Length below which the force is `minimum_value`."""
    transition_norm_fiber_length: Annotated[float, real(domain="> 0")] = 0.73
    """Length at which the steep part of the rise ends and the shallow part begins."""
    max_norm_active_fiber_length: Annotated[float, real(domain="> 0")] = 1.8123
    """Length above which the force is `minimum_value`."""
    shallow_ascending_slope: Annotated[float, real(domain=">= 0")] = 0.8616
    """Slope of the shallow part of the rise, just before optimal length."""
    minimum_value: Annotated[float, real(domain=">= 0")] = 0.1
    """Smallest force at any length; a muscle without fiber damping needs more than 0."""


class FiberForceLengthCurve(Function):
    """Passive force of a fiber over its length."""

    facts = Facts(
        refused="strain_at_one_norm_force stiffness_at_low_force stiffness_at_one_norm_force curviness"
    )

    strain_at_zero_force: Number = 0.0
    """Strain up to which the fiber is slack."""
    strain_at_one_norm_force: Annotated[float, real(domain="> 0")] = 0.7
    """Strain at which the passive fiber bears `max_isometric_force`."""
    # Left out, OpenSim takes 0.2 here, 2 / (strain at one - strain at zero) at a force of 1, and a
    # curviness of 0.75.
    stiffness_at_low_force: Annotated[float | None, maybe(domain="> 0")] = None
    """Slope where the toe ends; to be given with the two below, or none of them."""
    stiffness_at_one_norm_force: Annotated[float | None, maybe(domain="> 0")] = None
    """Slope at a force of 1; to be given with the stiffness at low force, or not at all."""
    curviness: Annotated[float | None, maybe(domain="0 to 1")] = None
    """Roundness of the bend; to be given with the two stiffnesses, or not at all."""


class ForceVelocityCurve(Function):
    """Force multiplier of a fiber over its velocity, both normalised."""

    facts = Facts(
        domains={
            # OpenSim compares with the square root of the machine precision (SimTK::SqrtEps).
            "concentric_slope_near_vmax": "> 1.49e-8",
            "eccentric_slope_near_vmax": "> 1.49e-8",
        },
        refused="concentric_slope_at_vmax concentric_slope_near_vmax isometric_slope eccentric_slope_at_vmax "
        "eccentric_slope_near_vmax max_eccentric_velocity_force_multiplier concentric_curviness "
        "eccentric_curviness",
    )

    concentric_slope_at_vmax: Annotated[float, real(domain=">= 0")] = 0.0
    """Slope at the maximum shortening velocity, -1, where the force is 0."""
    concentric_slope_near_vmax: Annotated[float, real(domain=">= 0")] = 0.25
    """Slope just before the maximum shortening velocity."""
    isometric_slope: Annotated[float, real(domain="> 0")] = 5.0
    """Slope at velocity 0, where the force is 1."""
    eccentric_slope_at_vmax: Annotated[float, real(domain=">= 0")] = 0.0
    """Slope at the maximum lengthening velocity, 1."""
    eccentric_slope_near_vmax: Annotated[float, real(domain=">= 0")] = 0.15
    """Slope just before the maximum lengthening velocity."""
    max_eccentric_velocity_force_multiplier: Annotated[float, real(domain="> 1")] = 1.4
    """Force at the maximum lengthening velocity, 1."""
    concentric_curviness: Annotated[float, real(domain="0 to 1")] = 0.6
    """Roundness of the bend of the shortening side."""
    eccentric_curviness: Annotated[float, real(domain="0 to 1")] = 0.9
    """Roundness of the bend of the lengthening side."""


# Muscles of OpenSim set both end slopes of their inverse curve to half of the slopes near them,
# so that it need not be the inverse of their ForceVelocityCurve.
class ForceVelocityInverseCurve(Function):
    """Fiber velocity over force multiplier: the inverse of a ForceVelocityCurve with the same numbers."""

    concentric_slope_at_vmax: Annotated[float, real(domain="> 0")] = 0.1
    """Slope of the force at the maximum shortening velocity, -1; not 0, or there is no inverse."""
    concentric_slope_near_vmax: Annotated[float, real(domain=">= 0")] = 0.25
    """Slope of the force just before the maximum shortening velocity."""
    isometric_slope: Annotated[float, real(domain="> 0")] = 5.0
    """Slope of the force at velocity 0, where it is 1."""
    eccentric_slope_at_vmax: Annotated[float, real(domain="> 0")] = 0.1
    """Slope of the force at the maximum lengthening velocity, 1; not 0, or there is no inverse."""
    eccentric_slope_near_vmax: Annotated[float, real(domain=">= 0")] = 0.15
    """Slope of the force just before the maximum lengthening velocity."""
    max_eccentric_velocity_force_multiplier: Annotated[float, real(domain="> 1")] = 1.4
    """Force at the maximum lengthening velocity, 1."""
    concentric_curviness: Annotated[float, real(domain="0 to 1")] = 0.6
    """Roundness of the bend of the shortening side."""
    eccentric_curviness: Annotated[float, real(domain="0 to 1")] = 0.9
    """Roundness of the bend of the lengthening side."""


class TendonForceLengthCurve(Function):
    """Force of a tendon over its length, both normalised."""

    facts = Facts(
        refused="strain_at_one_norm_force stiffness_at_one_norm_force norm_force_at_toe_end curviness"
    )

    strain_at_one_norm_force: Annotated[float, real(domain="> 0")] = 0.049
    """Strain at which the tendon bears `max_isometric_force`."""
    # Left out, OpenSim takes 1.375 / strain at one, a toe that ends at 2/3, and a curviness of 0.5.
    stiffness_at_one_norm_force: Annotated[float | None, maybe(domain="> 0")] = None
    """Slope at a force of 1; to be given with the two below, or none of them."""
    norm_force_at_toe_end: Annotated[float | None, maybe(domain="> 0")] = None
    """Force where the toe ends and the straight part begins, of `max_isometric_force`."""
    curviness: Annotated[float | None, maybe(domain="0 to 1")] = None
    """Roundness of the toe region; to be given with the two above, or not at all."""


class FiberCompressiveForceLengthCurve(Function):
    """A force that keeps a fiber from becoming too short."""

    norm_length_at_zero_force: Annotated[float, real(domain="> 0")] = 0.5
    """Length above which there is no such force."""
    stiffness_at_zero_length: Annotated[float | None, maybe()] = None
    """Slope at length 0, negative; to be given with the curviness, or not at all."""
    curviness: Annotated[float | None, maybe(domain="0 to 1")] = None
    """Roundness of the bend; to be given with the stiffness, or not at all."""


class FiberCompressiveForceCosPennationCurve(Function):
    """A force that keeps a fiber from standing across the tendon."""

    engagement_angle_in_degrees: Annotated[float, real("deg", "> 0")] = 85.0
    """Pennation angle below which there is no such force."""
    stiffness_at_perpendicular: Annotated[float | None, maybe()] = None
    """Slope over the cosine at 90 deg, negative; to be given with the curviness, or not at all."""
    curviness: Annotated[float | None, maybe(domain="0 to 1")] = None
    """Roundness of the bend; to be given with the stiffness, or not at all."""
