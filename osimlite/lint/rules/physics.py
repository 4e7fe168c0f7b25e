"""OSIM505 and following: gravity, materials and limits."""

from __future__ import annotations

import math
from collections.abc import Iterator

from osimlite.lint.registry import INFO, WARNING, FindingCollector, Threshold, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object, format_quantity
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import (
    CoordinateLimitForce,
    HuntCrossleyContactParameters,
    HuntCrossleyForce,
)
from osimlite.schema.joints import Joint
from osimlite.schema.states import list_motions
from osimlite.schema.tree import Use

GRAVITY = Threshold(
    "largest-gravity",
    30.0,
    "m/s^2",
    "largest plausible gravity",
)
BEYOND = Threshold(
    "limit-beyond-range",
    0.0,
    "of the range",
    "largest accepted distance of a limit outside the range",
)
INSIDE = Threshold(
    "limit-inside-range",
    0.25,
    "of the range",
    "largest accepted distance of a limit from the end of the range, inside the range",
)
UNLIMITED = Threshold(
    "unlimited-range",
    4 * math.pi,
    "rad",
    "wider ranges are ignored: they mean no limit, or are in degrees",
)


@rule("OSIM505", "strange-gravity", severity=WARNING, thresholds=(GRAVITY,))
def report_strange_gravity(subject: Subject, report: FindingCollector) -> None:
    """Gravity is far from that of the Earth.

    Reports gravity stronger than 30 m/s^2, which is usually in mm/s^2, and gravity that points up
    along Y.

    OpenSim works in metres, kilograms and seconds, with Y up. With gravity in mm/s^2 a model falls
    a thousand times too fast.

    ```xml
    - <gravity>0 -9806.65 0</gravity>
    + <gravity>0 -9.80665 0</gravity>
    ```
    """
    model = subject.model
    assert model is not None
    size = math.sqrt(sum(part * part for part in model.gravity))
    # NaN and infinity have OSIM205.
    if not math.isfinite(size):
        return
    if size > subject.config.value_of(GRAVITY):
        # 9.81 m/s^2 are 9810 mm/s^2.
        unit = "; is it in mm/s^2?" if 9000 < size < 11000 else ""
        report(f"gravity is {format_quantity(size, 'm/s^2')}{unit}", model, tag="gravity")
    # Numbers of the order of rounding, relative to the gravity, are no direction.
    elif model.gravity[1] > 1e-9 * size and model.gravity[1] > 0.9 * size:
        report("gravity points up: Y is the upward axis in OpenSim", model, tag="gravity")


@rule("OSIM506", "friction-order", severity=WARNING)
def report_friction_order(subject: Subject, report: FindingCollector) -> None:
    """Static friction is smaller than dynamic friction.

    Reports contact materials whose static coefficient is below the dynamic one.

    No material has more friction while sliding than at rest; usually the two numbers are swapped.
    Simbody computes the friction coefficient as min(v, 1) (d + 2 (s - d) / (1 + v^2)). Here s is
    the static and d the dynamic coefficient, and v the sliding speed divided by the transition
    velocity. If s is less than half of d, the result is negative at small v: friction then
    accelerates the sliding.

    ```xml
      <HuntCrossleyForce::ContactParameters>
          <geometry>heel floor</geometry> <stiffness>1e6</stiffness>
    -     <static_friction>0.4</static_friction> <dynamic_friction>0.8</dynamic_friction>
    +     <static_friction>0.8</static_friction> <dynamic_friction>0.4</dynamic_friction>
      </HuntCrossleyForce::ContactParameters>
    ```
    """
    for material in subject.find_instances(HuntCrossleyContactParameters):
        # Negative coefficients have OSIM207.
        if 0 <= material.static_friction < material.dynamic_friction:
            report(
                f"static friction of {subject.describe(material)}, "
                f"{format_quantity(material.static_friction)}, is smaller than dynamic friction, "
                f"{format_quantity(material.dynamic_friction)}"
                + (
                    "; below half of the dynamic friction, friction accelerates slow sliding"
                    if _drives_sliding(subject, material)
                    else ""
                ),
                material,
                tag="static_friction",
            )


@rule("OSIM507", "limits-swapped", severity=WARNING)
def report_limits_swapped(subject: Subject, report: FindingCollector) -> None:
    """The upper limit of a limit force lies below its lower limit.

    Reports limit forces whose upper limit is smaller than the lower one.

    Between the two limits no force should act. But both springs act there, against each other.

    ```xml
      <CoordinateLimitForce name="stop">
    -     <coordinate>hip_flexion</coordinate> <upper_limit>-30</upper_limit> <lower_limit>90</lower_limit>
    +     <coordinate>hip_flexion</coordinate> <upper_limit>90</upper_limit> <lower_limit>-25</lower_limit>
      </CoordinateLimitForce>
    ```
    """
    for force in subject.find_instances(CoordinateLimitForce):
        if force.upper_limit < force.lower_limit:
            report(
                f"the upper limit of {describe_object(force)}, "
                f"{format_quantity(force.upper_limit)}, is below the lower limit, "
                f"{format_quantity(force.lower_limit)}: between them both springs act at once",
                force,
                tag="upper_limit",
            )


@rule("OSIM508", "limit-outside-range", severity=INFO, thresholds=(BEYOND,))
def report_limit_outside_range(subject: Subject, report: FindingCollector) -> None:
    """A limit force begins beyond the range of its coordinate.

    Reports limits that lie outside the range of the coordinate by more than the transition.

    A range does not stop the motion. Only the limit force does, so the model can move beyond its
    range. Note that limits are in degrees and ranges in radians.

    ```xml
      <CoordinateLimitForce name="stop">
    -     <coordinate>knee_angle</coordinate> <upper_limit>0</upper_limit> <lower_limit>-170</lower_limit>
    +     <coordinate>knee_angle</coordinate> <upper_limit>0</upper_limit> <lower_limit>-120</lower_limit>
      </CoordinateLimitForce>
    ```
    """
    for force, coordinate, scale, low, high in _find_limits(subject):
        # Limits of angles are in degrees in OpenSim, those of lengths in metres.
        unit = "m" if scale == 1.0 else "deg"
        # The limit force acts from the transition on; 1e-6 allows for rounded numbers.
        slack = abs(force.transition) + subject.config.value_of(BEYOND) * (high - low) + 1e-6
        for tag, limit, is_outside in (
            ("upper_limit", force.upper_limit, force.upper_limit > high + slack),
            ("lower_limit", force.lower_limit, force.lower_limit < low - slack),
        ):
            if is_outside:
                report(
                    f"{tag} of {describe_object(force)} is {format_quantity(limit, unit)}, beyond "
                    f"the range of '{coordinate.name}' ({format_quantity(low)} to "
                    f"{format_quantity(high, unit)})",
                    force,
                    tag=tag,
                )


@rule("OSIM509", "limit-inside-range", severity=INFO, thresholds=(INSIDE, UNLIMITED))
def report_limit_inside_range(subject: Subject, report: FindingCollector) -> None:
    """A limit force begins well inside the range of its coordinate.

    Reports limits inside the range of the coordinate by more than the transition and by more than a
    quarter of the range. The finding is a warning if the default value of the coordinate is already
    beyond the limit, or if the limits seem to be in radians. Without a range, or with one of more
    than two turns, limits seem to be in radians if both are within 3.15 degrees.

    The model can reach a part of the range only against the spring of the limit force. If the
    default pose is beyond the limit, the force acts from the start. Note that limits are in degrees
    and ranges in radians.

    ```xml
      <CoordinateLimitForce name="stop">
    -     <coordinate>knee_angle</coordinate> <upper_limit>0</upper_limit> <lower_limit>-2.1</lower_limit>
    +     <coordinate>knee_angle</coordinate> <upper_limit>0</upper_limit> <lower_limit>-120</lower_limit>
      </CoordinateLimitForce>
    ```
    """
    _report_limits_in_radians(subject, report)
    for force, coordinate, scale, low, high in _find_limits(subject):
        unit = "m" if scale == 1.0 else "deg"
        slack = max(abs(force.transition), subject.config.value_of(INSIDE) * (high - low)) + 1e-6
        start = coordinate.default_value * scale
        for tag, limit, is_inside, excess in (
            (
                "upper_limit",
                force.upper_limit,
                low <= force.upper_limit < high - slack,
                start - force.upper_limit,
            ),
            (
                "lower_limit",
                force.lower_limit,
                high >= force.lower_limit > low + slack,
                force.lower_limit - start,
            ),
        ):
            acts_at_limit = excess > abs(force.transition)
            # A range of many turns stands for none, or is in degrees; so does a limit that is not
            # given.
            widest = math.degrees(subject.config.value_of(UNLIMITED))
            is_explicit = tag in force.model_fields_set and (unit == "m" or high - low < widest)
            # Swapped limits have OSIM507.
            if is_inside and is_explicit and force.lower_limit <= force.upper_limit:
                in_degrees = math.degrees(limit)
                # Both limits are as small as angles in radians are, and one is a bound of the range
                # then.
                is_small = max(abs(force.lower_limit), abs(force.upper_limit)) <= 2 * math.pi
                is_near_bound = min(abs(in_degrees - low), abs(in_degrees - high)) <= 0.1 * (
                    high - low
                )
                radians = unit == "deg" and is_small and is_near_bound
                report(
                    f"{tag} of {describe_object(force)} is {format_quantity(limit, unit)}, inside "
                    f"the range of '{coordinate.name}' ({format_quantity(low)} to "
                    f"{format_quantity(high, unit)})"
                    + (
                        f"; the force already acts in the default pose, at {format_quantity(start, unit)}"
                        if acts_at_limit
                        else ""
                    )
                    + ("; is the limit in radians?" if radians else ""),
                    force,
                    tag=tag,
                    severity=WARNING if acts_at_limit or radians else None,
                    suggestion=f"{in_degrees:.6g}" if radians else None,
                )


def _drives_sliding(subject: Subject, material: HuntCrossleyContactParameters) -> bool:
    """Return whether friction at the smallest speeds accelerates the sliding, even with viscous friction."""
    force = subject.owner(material)
    viscous = (
        material.viscous_friction * force.transition_velocity
        if isinstance(force, HuntCrossleyForce)
        else 0.0
    )
    # Near rest Simbody's friction is v / vt (ud + 2 (us - ud)) + uv v: here its slope is negative.
    return 2 * material.static_friction + viscous < material.dynamic_friction


def _report_limits_in_radians(subject: Subject, report: FindingCollector) -> None:
    """Report small limits of an angle that has no range, or a range that means none."""
    widest = subject.config.value_of(UNLIMITED)
    for force, coordinate, scale in _find_limited_coordinates(subject):
        low, high = coordinate.range
        has_range = "range" in coordinate.model_fields_set and abs(high - low) < widest
        if scale == 1.0 or has_range:
            continue
        limits = force.lower_limit, force.upper_limit
        is_explicit = {"lower_limit", "upper_limit"} <= force.model_fields_set
        # Equal limits hold the coordinate in its place.
        if is_explicit and limits[0] < limits[1] and max(map(abs, limits)) <= MAX_RADIANS:
            report(
                f"the limits of {describe_object(force)} for '{coordinate.name}', "
                f"{format_quantity(limits[0])} and {format_quantity(limits[1], 'deg')}, are only "
                f"{format_quantity(limits[1] - limits[0], 'deg')} apart; are they in radians?",
                force,
                tag="lower_limit",
                severity=WARNING,
                suggestion=f"{math.degrees(limits[0]):.6g}",
            )


MAX_RADIANS = 3.15
"""Limit (degrees) up to which both limits of a joint are assumed to be in radians: half a turn."""


def _find_limits(
    subject: Subject,
) -> Iterator[tuple[CoordinateLimitForce, Coordinate, float, float, float]]:
    """Yield limit forces with their coordinate, the factor to their unit, and the range in that unit.

    Coordinates without a range are left out.
    """
    for force, coordinate, scale in _find_limited_coordinates(subject):
        if "range" in coordinate.model_fields_set:
            # A reversed range has OSIM511.
            low, high = sorted(bound * scale for bound in coordinate.range)
            yield force, coordinate, scale, low, high


def _find_limited_coordinates(
    subject: Subject,
) -> Iterator[tuple[CoordinateLimitForce, Coordinate, float]]:
    """Yield limit forces with their coordinate and the factor to their unit.

    Coordinates whose meaning depends on the functions of their joint are left out.
    """
    spec = CoordinateLimitForce.field_specs()["coordinate"]
    for force in subject.find_instances(CoordinateLimitForce):
        coordinate = subject.tree.resolve(Use(force, force, spec, force.coordinate)).target
        if not isinstance(coordinate, Coordinate):
            continue
        joint = subject.tree.parent_of(coordinate)
        motion = (
            list_motions(joint).get(coordinate.name)
            if isinstance(joint, Joint) and joint.motion_types
            else None
        )
        if motion is not None:
            yield force, coordinate, 180 / math.pi if motion == "rotational" else 1.0
