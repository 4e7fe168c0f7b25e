"""The curves of the Millard muscles (Millard et al. 2013): dimensionless, smooth, given by what a person can measure.

A `curviness` lies between 0 (straight pieces) and 1 (as round as it gets). Numbers left out are chosen by OpenSim.
"""

from typing import Annotated

from osimlite.schema.fields import Number, maybe, real
from osimlite.schema.functions import Function


class ActiveForceLengthCurve(Function):
    """Active force of a fibre over its length; `minimum_value` keeps it above zero everywhere."""

    min_norm_active_fiber_length: Annotated[float, real(domain="> 0")] = 0.4441
    transition_norm_fiber_length: Annotated[float, real(domain="> 0")] = 0.73
    max_norm_active_fiber_length: Annotated[float, real(domain="> 0")] = 1.8123
    shallow_ascending_slope: Annotated[float, real(domain=">= 0")] = 0.8616
    minimum_value: Annotated[float, real(domain=">= 0")] = 0.1


class FiberForceLengthCurve(Function):
    """Passive force of a fibre over its length."""

    strain_at_zero_force: Number = 0.0
    strain_at_one_norm_force: Annotated[float, real(domain="> 0")] = 0.7
    stiffness_at_low_force: Annotated[float | None, maybe(domain="> 0")] = None
    stiffness_at_one_norm_force: Annotated[float | None, maybe(domain="> 0")] = None
    curviness: Annotated[float | None, maybe(domain="0 to 1")] = None


class ForceVelocityCurve(Function):
    """Force multiplier of a fibre over its velocity, both normalised."""

    concentric_slope_at_vmax: Annotated[float, real(domain=">= 0")] = 0.0
    concentric_slope_near_vmax: Annotated[float, real(domain=">= 0")] = 0.25
    isometric_slope: Annotated[float, real(domain="> 0")] = 5.0
    eccentric_slope_at_vmax: Annotated[float, real(domain=">= 0")] = 0.0
    eccentric_slope_near_vmax: Annotated[float, real(domain=">= 0")] = 0.15
    max_eccentric_velocity_force_multiplier: Annotated[float, real(domain="> 1")] = 1.4
    concentric_curviness: Annotated[float, real(domain="0 to 1")] = 0.6
    eccentric_curviness: Annotated[float, real(domain="0 to 1")] = 0.9


class ForceVelocityInverseCurve(Function):
    """Fibre velocity over force multiplier: the inverse of a ForceVelocityCurve with the same numbers."""

    concentric_slope_at_vmax: Annotated[float, real(domain="> 0")] = 0.1
    concentric_slope_near_vmax: Annotated[float, real(domain=">= 0")] = 0.25
    isometric_slope: Annotated[float, real(domain="> 0")] = 5.0
    eccentric_slope_at_vmax: Annotated[float, real(domain="> 0")] = 0.1
    eccentric_slope_near_vmax: Annotated[float, real(domain=">= 0")] = 0.15
    max_eccentric_velocity_force_multiplier: Annotated[float, real(domain="> 1")] = 1.4
    concentric_curviness: Annotated[float, real(domain="0 to 1")] = 0.6
    eccentric_curviness: Annotated[float, real(domain="0 to 1")] = 0.9


class TendonForceLengthCurve(Function):
    """Force of a tendon over its length, both normalised."""

    strain_at_one_norm_force: Annotated[float, real(domain="> 0")] = 0.049
    stiffness_at_one_norm_force: Annotated[float | None, maybe(domain="> 0")] = None
    norm_force_at_toe_end: Annotated[float | None, maybe(domain="> 0")] = None
    curviness: Annotated[float | None, maybe(domain="0 to 1")] = None


class FiberCompressiveForceLengthCurve(Function):
    """A force that keeps a fibre from becoming too short."""

    norm_length_at_zero_force: Annotated[float, real(domain="> 0")] = 0.5
    stiffness_at_zero_length: Annotated[float | None, maybe()] = None
    curviness: Annotated[float | None, maybe(domain="0 to 1")] = None


class FiberCompressiveForceCosPennationCurve(Function):
    """A force that keeps a fibre from standing across the tendon."""

    engagement_angle_in_degrees: Annotated[float, real("deg", "> 0")] = 85.0
    stiffness_at_perpendicular: Annotated[float | None, maybe()] = None
    curviness: Annotated[float | None, maybe(domain="0 to 1")] = None
