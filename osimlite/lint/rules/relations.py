"""Numbers of one object that contradict each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, Final

from osimlite.lint.consequences import REFUSED
from osimlite.lint.engine import ERROR, WARNING, Found, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import called, quantity
from osimlite.schema.base import Object
from osimlite.text import listed


@rule("OSIM209", "contradicting-values", severity=ERROR)
def contradicting_values(subject: Subject, found: Found) -> None:
    """Numbers of one object contradict each other.

    ## What it does
    Reports curves of muscles whose numbers make no curve, a torus without a hole, and `optimal_force` of muscles that
    have only `max_isometric_force`.

    ## Why is this bad
    OpenSim refuses the model, and its message names neither the muscle nor the property.

    ## Example
    ```xml
    <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
        <WrapObjectSet name="wrapobjectset">
            <objects>
                <WrapTorus name="ring"> <inner_radius>0.06</inner_radius> <outer_radius>0.04</outer_radius> </WrapTorus>
            </objects>
        </WrapObjectSet>
    </Body>
    <PathSpring name="spring">
        <GeometryPath name="path">
            <PathPointSet>
                <objects>
                    <PathPoint name="start"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
                    <PathPoint name="end"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </PathPoint>
                </objects>
            </PathPointSet>
            <PathWrapSet>
                <objects> <PathWrap name="around"> <wrap_object>ring</wrap_object> </PathWrap> </objects>
            </PathWrapSet>
        </GeometryPath>
        <resting_length>0.1</resting_length> <stiffness>100</stiffness> <dissipation>0</dissipation>
    </PathSpring>
    ```

    ## Use instead
    ```xml
    <Body name="thigh"> <mass>8</mass> <inertia>0.1 0.1 0.02 0 0 0</inertia>
        <WrapObjectSet name="wrapobjectset">
            <objects>
                <WrapTorus name="ring"> <inner_radius>0.04</inner_radius> <outer_radius>0.06</outer_radius> </WrapTorus>
            </objects>
        </WrapObjectSet>
    </Body>
    <PathSpring name="spring">
        <GeometryPath name="path">
            <PathPointSet>
                <objects>
                    <PathPoint name="start"> <socket_parent_frame>/bodyset/thigh</socket_parent_frame> </PathPoint>
                    <PathPoint name="end"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </PathPoint>
                </objects>
            </PathPointSet>
            <PathWrapSet>
                <objects> <PathWrap name="around"> <wrap_object>ring</wrap_object> </PathWrap> </objects>
            </PathWrapSet>
        </GeometryPath>
        <resting_length>0.1</resting_length> <stiffness>100</stiffness> <dissipation>0</dissipation>
    </PathSpring>
    ```
    """
    for cls, items in subject.by_class.items():
        for base in cls.__mro__:
            for item in items if base.__name__ in _RELATIONS else ():
                for tag, message in _RELATIONS[base.__name__](item):
                    owner = "" if item.name else f" of {called(subject.owner(item))}"
                    found(f"{called(item)}{owner}: {message}: {REFUSED}", item, tag=tag)


@rule("OSIM510", "controls-swapped", severity=WARNING)
def controls_swapped(subject: Subject, found: Found) -> None:
    """The least control of an actuator is above its largest.

    ## What it does
    Reports actuators and muscles whose `min_control` is larger than their `max_control`.

    ## Why is this bad
    No control is allowed. OpenSim simulates the model all the same; static optimization, computed muscle control and
    optimal control take the two as bounds and fail.

    ## Example
    ```xml
    <CoordinateActuator name="motor">
        <min_control>1</min_control> <max_control>-1</max_control>
        <coordinate>knee_angle</coordinate> <optimal_force>100</optimal_force>
    </CoordinateActuator>
    ```

    ## Use instead
    ```xml
    <CoordinateActuator name="motor">
        <min_control>-1</min_control> <max_control>1</max_control>
        <coordinate>knee_angle</coordinate> <optimal_force>100</optimal_force>
    </CoordinateActuator>
    ```
    """
    for actuator in subject.named("ScalarActuator"):
        low, high = actuator.min_control, actuator.max_control
        if low > high:
            given = "min_control" if "min_control" in actuator.model_fields_set else "max_control"
            found(
                f"min_control of {called(actuator)}, {quantity(low)}, is above its max_control, {quantity(high)}",
                actuator,
                tag=given,
            )


_Contradiction = tuple[str, str]
"""The property that is best changed, and what is wrong."""


def _active_force_length(curve: Any) -> Iterator[_Contradiction]:
    low, middle, high = "min_norm_active_fiber_length", "transition_norm_fiber_length", "max_norm_active_fiber_length"
    turn = curve.transition_norm_fiber_length
    if getattr(curve, low) >= turn:
        yield low, f"{low}, {quantity(getattr(curve, low))}, should be less than {middle}, {quantity(turn)}"
    if getattr(curve, high) <= 1:
        yield high, f"{high}, {quantity(getattr(curve, high))}, should be more than 1"
    if turn >= 1:
        yield middle, f"{middle}, {quantity(turn)}, should be less than 1"
    elif curve.shallow_ascending_slope >= (steepest := 1 / (1 - turn)):
        yield (
            "shallow_ascending_slope",
            f"shallow_ascending_slope, {quantity(curve.shallow_ascending_slope)}, should be less than "
            f"1/(1 - {middle}), {steepest:.4g}",
        )


def _force_velocity(curve: Any) -> Iterator[_Contradiction]:
    if curve.isometric_slope <= 1:
        yield "isometric_slope", f"isometric_slope, {quantity(curve.isometric_slope)}, should be more than 1"
    if curve.concentric_slope_near_vmax >= 1:
        slope = quantity(curve.concentric_slope_near_vmax)
        yield "concentric_slope_near_vmax", f"concentric_slope_near_vmax, {slope}, should be less than 1"
    limit = curve.max_eccentric_velocity_force_multiplier - 1
    if curve.eccentric_slope_near_vmax >= limit > 0:
        yield (
            "eccentric_slope_near_vmax",
            f"eccentric_slope_near_vmax, {quantity(curve.eccentric_slope_near_vmax)}, should be less than "
            f"max_eccentric_velocity_force_multiplier - 1, {limit:.4g}",
        )


def _fiber_force_length(curve: Any) -> Iterator[_Contradiction]:
    start, end = curve.strain_at_zero_force, curve.strain_at_one_norm_force
    if start >= end:
        yield (
            "strain_at_zero_force",
            f"strain_at_zero_force, {quantity(start)}, should be less than strain_at_one_norm_force, {quantity(end)}",
        )
        return
    yield from _all_or_none(curve, "stiffness_at_low_force", "stiffness_at_one_norm_force", "curviness")
    mean = 1 / (end - start)
    chord = f"1/(strain_at_one_norm_force - strain_at_zero_force), {mean:.4g}"
    low, high = curve.stiffness_at_low_force, curve.stiffness_at_one_norm_force
    if low is not None and low >= mean:
        yield "stiffness_at_low_force", f"stiffness_at_low_force, {quantity(low)}, should be less than {chord}"
    if high is not None and high <= mean:
        yield (
            "stiffness_at_one_norm_force",
            f"stiffness_at_one_norm_force, {quantity(high)}, should be more than {chord}",
        )


def _tendon_force_length(curve: Any) -> Iterator[_Contradiction]:
    yield from _all_or_none(curve, "stiffness_at_one_norm_force", "norm_force_at_toe_end", "curviness")
    strain, stiffness, toe = (
        curve.strain_at_one_norm_force,
        curve.stiffness_at_one_norm_force,
        curve.norm_force_at_toe_end,
    )
    if stiffness is not None and strain > 0 and stiffness <= 1 / strain:
        yield (
            "stiffness_at_one_norm_force",
            f"stiffness_at_one_norm_force, {quantity(stiffness)}, should be more than 1/strain_at_one_norm_force, "
            f"{1 / strain:.4g}",
        )
    if toe is not None and toe >= 1:
        yield "norm_force_at_toe_end", f"norm_force_at_toe_end, {quantity(toe)}, should be less than 1"


def _all_or_none(curve: Any, *names: str) -> Iterator[_Contradiction]:
    given = [name for name in names if getattr(curve, name) is not None]
    missing = [name for name in names if name not in given]
    if given and missing:
        yield given[0], f"{listed(given)} need{'s' * (len(given) == 1)} {listed(missing)} beside"


def _torus(torus: Any) -> Iterator[_Contradiction]:
    inner, outer = torus.inner_radius, torus.outer_radius
    if 0 < outer <= inner < math.inf:
        yield (
            "outer_radius",
            f"outer_radius, {quantity(outer, 'm')}, should be more than inner_radius, {quantity(inner, 'm')}",
        )


def _no_optimal_force(muscle: Any) -> Iterator[_Contradiction]:
    if "optimal_force" in muscle.model_fields_set:
        yield "optimal_force", "optimal_force may not be given, only max_isometric_force"


_RELATIONS: Final[dict[str, Callable[[Object], Iterator[_Contradiction]]]] = {
    "ActiveForceLengthCurve": _active_force_length,
    "DeGrooteFregly2016Muscle": _no_optimal_force,
    "FiberForceLengthCurve": _fiber_force_length,
    "ForceVelocityCurve": _force_velocity,
    "MeyerFregly2016Muscle": _no_optimal_force,
    "TendonForceLengthCurve": _tendon_force_length,
    "WrapTorus": _torus,
}
"""What OpenSim 4.6 refuses, measured like the consequences of single numbers."""
