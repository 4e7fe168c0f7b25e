"""Force curves of Millard's muscles.

Source: M. Millard et al., Journal of Biomechanical Engineering 135, 2013, section 2. Lengths are
normalized by the optimal fiber length or the tendon slack length, velocities by the maximum
contraction velocity, forces by the maximum isometric force. Each function takes the properties of
the OpenSim class with its name, in their order, and returns the numbers of a Bezier curve; None
stands for an omitted property.

The ValueError of properties that give no curve has a message that begins with "its" and a property,
or says which slopes make no corner; the caller adds the component.
"""

from __future__ import annotations

from functools import lru_cache
from math import cos, radians

from osimlite.mechanics.laws.bezier import Numbers, curve_size, make_curve

ACTIVE_SIZE = curve_size(5)
"""Length of an active force-length curve."""
VELOCITY_SIZE = curve_size(4)
"""Length of a force-velocity curve."""
PASSIVE_SIZE = curve_size(2)
"""Length of a passive force-length curve."""
TENDON_SIZE = curve_size(2)
"""Length of a tendon force-length curve."""
COMPRESSIVE_SIZE = curve_size(1)
"""Length of a compressive force curve."""
LENGTH_TOLERANCE = 2.0**-26
"""Difference up to which two lengths count as equal."""

_cache_curves = lru_cache(maxsize=256)
"""Cache of curves, since most muscles of a model have the same."""


@_cache_curves
def active_force_length(
    shortest: float, transition: float, longest: float, slope: float, least: float
) -> Numbers:
    """Return the active force over the fiber length; it is 1 at 1, where the curve is flat.

    Args:
        shortest: smallest active fiber length.
        transition: fiber length at the end of the steep ascending part.
        longest: largest active fiber length.
        slope: slope of the shallow ascending part.
        least: smallest force.

    Raises:
        ValueError: there is no such curve.
    """
    _require_condition(
        shortest >= 0.0
        and min(transition - shortest, 1.0 - transition, longest - 1.0) > LENGTH_TOLERANCE,
        "its min_norm_active_fiber_length, transition_norm_fiber_length, 1, max_norm_active_fiber_length do not rise",
    )
    _require_condition(least >= 0.0, "its minimum_value is negative")
    _require_below(slope, (1.0 - least) / (1.0 - transition), "shallow_ascending_slope")
    # OpenSim's constants: the plateau is 0.05 to each side of the optimal length, and the curve is
    # steepest halfway between the smallest active length and the transition.
    half = 0.05
    knee = 1.0 - slope * (1.0 - half - transition)
    top = 1.0 + half
    return make_curve(
        (
            (shortest, least, 0.0),
            (
                shortest + 0.5 * (transition - shortest),
                0.5 * knee,
                # 1.25 is OpenSim's ratio of the slope in the steep part to the mean slope.
                1.25 * knee / (transition - shortest),
            ),
            (transition + 0.5 * (1.0 - half - transition), knee + 0.5 * (1.0 - knee), slope),
            (1.0, 1.0, 0.0),
            (top + 0.5 * (longest - top), 0.5, -1.0 / ((longest - half) - top)),
            (longest, least, 0.0),
        ),
        [1.0] * 5,
    )


@_cache_curves
def force_velocity(
    concentric_end: float,
    concentric_near: float,
    isometric: float,
    eccentric_end: float,
    eccentric_near: float,
    eccentric_limit: float,
    concentric_curviness: float,
    eccentric_curviness: float,
    *,
    inverse: bool = False,
) -> Numbers:
    """Return the factor of the active force over the fiber velocity.

    Args:
        concentric_end: slope at the maximum shortening velocity.
        concentric_near: slope near the maximum shortening velocity.
        isometric: slope at zero velocity.
        eccentric_end: slope at the maximum lengthening velocity.
        eccentric_near: slope near the maximum lengthening velocity.
        eccentric_limit: factor at the maximum lengthening velocity.
        concentric_curviness: curviness of the sections for shortening, 0 to 1.
        eccentric_curviness: curviness of the sections for lengthening, 0 to 1.
        inverse: whether to return the velocity over the factor.

    Raises:
        ValueError: there is no such curve.
    """
    # The conditions are OpenSim's; outside them its curve has no corner or does not rise.
    _require_condition(
        eccentric_limit > 1.0, "its max_eccentric_velocity_force_multiplier is not above 1"
    )
    _require_below(concentric_end, concentric_near, "concentric_slope_at_vmax")
    # OpenSim accepts a slope of 1 for this curve, but not for the inverse one.
    _require_condition(
        concentric_near < 1.0 or (concentric_near == 1.0 and not inverse),
        "its concentric_slope_near_vmax is not less than 1",
    )
    _require_condition(isometric > 1.0, "its isometric_slope is not above 1")
    _require_condition(
        0.0 <= eccentric_end <= eccentric_near,
        "its eccentric_slope_at_vmax is not from 0 to the slope near vmax",
    )
    _require_condition(
        eccentric_near >= LENGTH_TOLERANCE,
        f"its eccentric_slope_near_vmax is less than {LENGTH_TOLERANCE:.2e}",
    )
    _require_below(eccentric_near, eccentric_limit - 1.0, "eccentric_slope_near_vmax")
    # OpenSim places the corners near the maximum velocities at 90 % of them; each point lies on a
    # line with the mean of both slopes.
    points = [
        (-1.0, 0.0, concentric_end),
        (
            -0.9,
            0.5 * concentric_near * (-0.9 + 1.0) + 0.5 * concentric_end * (-0.9 + 1.0),
            concentric_near,
        ),
        (0.0, 1.0, isometric),
        (
            0.9,
            eccentric_limit
            + 0.5 * eccentric_near * (0.9 - 1.0)
            + 0.5 * eccentric_end * (0.9 - 1.0),
            eccentric_near,
        ),
        (1.0, eccentric_limit, eccentric_end),
    ]
    # The inverse swaps the axes of the control points. It is not the exact inverse between them.
    if inverse:
        points = [(y, x, 1.0 / slope) for x, y, slope in points]
    return make_curve(points, [concentric_curviness] * 2 + [eccentric_curviness] * 2)


@_cache_curves
def fiber_force_length(
    zero: float,
    one: float,
    low: float | None = None,
    stiffness: float | None = None,
    curviness: float | None = None,
) -> Numbers:
    """Return the passive force over the fiber length.

    Where they are omitted, low is 0.2, stiffness 2 / (one - zero), curviness 0.75, as in OpenSim.

    Args:
        zero: strain at zero force.
        one: strain at the maximum isometric force.
        low: slope at low force; None for the default.
        stiffness: slope at the maximum isometric force; None for the default.
        curviness: curviness of the sections, 0 to 1; None for the default.

    Raises:
        ValueError: there is no such curve.
    """
    _require_condition(
        one > zero,
        f"its strain_at_zero_force is not less than its strain_at_one_norm_force, {one:.4g}",
    )
    low, stiffness, curviness = _complete_properties(
        (low, stiffness, curviness), (0.2, 2.0 / (one - zero), 0.75), "stiffness_at_low_force"
    )
    mean = 1.0 / (one - zero)
    _require_above(stiffness, mean, "stiffness_at_one_norm_force")
    _require_below(low, mean, "stiffness_at_low_force")
    start, end = 1.0 + zero, 1.0 + one
    # OpenSim's toe: the foot lies a tenth along, but not further than the line of the final slope
    # rises by a tenth.
    foot = start + min(0.1 / stiffness, 0.1 * (end - start))
    middle = start + 0.5 * (foot - start)
    return make_curve(
        ((start, 0.0, 0.0), (foot, low * (foot - middle), low), (end, 1.0, stiffness)),
        [curviness] * 2,
    )


@_cache_curves
def tendon_force_length(
    one: float,
    stiffness: float | None = None,
    toe: float | None = None,
    curviness: float | None = None,
) -> Numbers:
    """Return the force over the tendon length.

    Where they are omitted, stiffness is 1.375 / one, toe 2/3, curviness 0.5, as in OpenSim.

    Args:
        one: strain at the maximum isometric force.
        stiffness: slope at the maximum isometric force; None for the default.
        toe: force at the end of the toe region; None for the default.
        curviness: curviness of the sections, 0 to 1; None for the default.

    Raises:
        ValueError: there is no such curve.
    """
    _require_condition(
        one > LENGTH_TOLERANCE, f"its strain_at_one_norm_force is not above {LENGTH_TOLERANCE:.1e}"
    )
    stiffness, toe, curviness = _complete_properties(
        (stiffness, toe, curviness), (1.375 / one, 2.0 / 3.0, 0.5), "stiffness_at_one_norm_force"
    )
    _require_condition(0.0 < toe < 1.0, "its norm_force_at_toe_end is not between 0 and 1")
    _require_above(stiffness, 1.0 / one, "stiffness_at_one_norm_force")
    # The linear region begins where its line has the force `toe`.
    end = (toe - 1.0) / stiffness + 1.0 + one
    # OpenSim's control points of the toe: a foot at a tenth of the toe, and the line to half of its
    # force.
    foot = 1.0 + (end - 1.0) / 10.0
    middle = (0.5 * toe - 1.0) / stiffness + 1.0 + one
    slope = 0.5 * toe / (middle - foot)
    control = foot + 0.5 * (middle - foot)
    return make_curve(
        ((1.0, 0.0, 0.0), (control, slope * (control - foot), slope), (end, toe, stiffness)),
        [curviness] * 2,
    )


@_cache_curves
def fiber_compressive_force_length(
    zero: float, stiffness: float | None = None, curviness: float | None = None
) -> Numbers:
    """Return the force against short fibers over their length.

    Where they are omitted, stiffness is -2 / zero and curviness 0.5, as in OpenSim.

    Args:
        zero: fiber length at zero force.
        stiffness: slope at zero length; None for the default.
        curviness: curviness of the section, 0 to 1; None for the default.

    Raises:
        ValueError: there is no such curve.
    """
    _require_condition(zero > 0.0, "its norm_length_at_zero_force is not positive")
    stiffness, curviness = _complete_properties(
        (stiffness, curviness), (-2.0 / zero, 0.5), "stiffness_at_zero_length"
    )
    _require_condition(
        stiffness < -1.0 / zero, f"its stiffness_at_zero_length is not less than {-1.0 / zero:.4g}"
    )
    return make_curve(((0.0, 1.0, stiffness), (zero, 0.0, 0.0)), [curviness])


@_cache_curves
def fiber_compressive_force_cos_pennation(
    angle: float, stiffness: float | None = None, curviness: float | None = None
) -> Numbers:
    """Return the force against steep fibers over the cosine of pennation.

    Where they are omitted, stiffness is -2 / cos(angle) and curviness 0.1, as in OpenSim.

    Args:
        angle: pennation angle at zero force (degrees).
        stiffness: slope at a right angle; None for the default.
        curviness: curviness of the section, 0 to 1; None for the default.

    Raises:
        ValueError: there is no such curve.
    """
    zero = cos(radians(angle))
    _require_condition(0.0 < zero < 1.0, "its engagement_angle_in_degrees is not between 0 and 90")
    stiffness, curviness = _complete_properties(
        (stiffness, curviness), (-2.0 / zero, 0.1), "stiffness_at_perpendicular"
    )
    _require_condition(
        # The curve must bend upwards: steeper at its upper end than the straight line.
        stiffness < -1.0 / zero,
        f"its stiffness_at_perpendicular is not less than {-1.0 / zero:.4g}",
    )
    return make_curve(((0.0, 1.0, stiffness), (zero, 0.0, 0.0)), [curviness])


def _require_condition(holds: bool, message: str) -> None:
    if not holds:
        raise ValueError(message)


def _require_below(slope: float, limit: float, name: str) -> None:
    _require_condition(0.0 <= slope < limit, f"its {name} is not from 0 to less than {limit:.4g}")


def _require_above(slope: float, limit: float, name: str) -> None:
    _require_condition(slope > limit, f"its {name} is not above {limit:.4g}")


def _complete_properties(
    values: tuple[float | None, ...], defaults: tuple[float, ...], first_name: str
) -> tuple[float, ...]:
    """Return optional properties, or their defaults if all are omitted.

    Args:
        values: properties, None where omitted.
        defaults: default of each property.
        first_name: name of the first property, for the message.

    Raises:
        ValueError: some are omitted and others are not, which OpenSim does not accept.
    """
    result = [x for x in values if x is not None]
    _require_condition(
        len(result) in (0, len(defaults)),
        f"its {first_name} and the optional properties after it must be either all given or all left out",
    )
    return tuple(result) or defaults
