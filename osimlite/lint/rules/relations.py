"""Numbers of one object that contradict each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, Final, cast

from osimlite.base.text import format_count
from osimlite.lint.registry import ERROR, REFUSES, WARNING, FindingCollector, rule
from osimlite.lint.rules.domains import find_outside_domain
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object, format_quantity
from osimlite.mechanics.laws.muscle_curves import (
    active_force_length,
    fiber_compressive_force_cos_pennation,
    fiber_compressive_force_length,
    fiber_force_length,
    force_velocity,
    tendon_force_length,
)
from osimlite.schema.base import Object
from osimlite.schema.facts import REFUSED, Contradiction
from osimlite.schema.functions import (
    UNIVARIATE_FUNCTIONS,
    Constant,
    LinearFunction,
    MultiplierFunction,
)
from osimlite.schema.tree import is_a


@rule("OSIM209", "contradicting-values", severity=ERROR, consequences=(REFUSES,))
def report_contradicting_values(subject: Subject, report: FindingCollector) -> None:
    """Numbers of one object contradict each other.

    Reports curves of muscles whose numbers do not define a curve, a torus without a hole, and a
    FunctionBasedPath whose functions do not take its coordinates. Also reports settings that a
    class of muscles does not support. These are `ignore_tendon_compliance` of a Thelen2003Muscle, a
    `minimum_activation` of 1, and `optimal_force` beside `max_isometric_force`.

    OpenSim rejects the model, and its message names neither the muscle nor the property.

    ```xml
      <WrapObjectSet name="wrapobjectset">
          <objects>
    -         <WrapTorus name="condyle"> <inner_radius>0.6</inner_radius> <outer_radius>0.4</outer_radius> </WrapTorus>
    +         <WrapTorus name="condyle"> <inner_radius>0.4</inner_radius> <outer_radius>0.6</outer_radius> </WrapTorus>
          </objects>
      </WrapObjectSet>
    ```
    """
    # A number outside its domain is reported already, and would give a second message here.
    strange = {id(item) for item, *_ in find_outside_domain(subject)}
    for cls, items in subject.by_class.items():
        relation = next(
            (_RELATIONS[base.__name__] for base in cls.__mro__ if base.__name__ in _RELATIONS), None
        )
        if relation is not None or cls.find_contradictions is not Object.find_contradictions:
            for item in [item for item in items if id(item) not in strange]:
                owner = subject.owner(item)
                for tag, message in (
                    relation(item, owner) if relation is not None else item.find_contradictions()
                ):
                    owner_phrase = (
                        "" if item.name and item is owner else f" of {describe_object(owner)}"
                    )
                    report(
                        f"{describe_object(item)}{owner_phrase}: {message}; {REFUSED}",
                        item,
                        tag=tag,
                    )


@rule("OSIM510", "controls-swapped", severity=WARNING)
def report_controls_swapped(subject: Subject, report: FindingCollector) -> None:
    """The minimum control of an actuator exceeds its maximum.

    Reports actuators and muscles whose `min_control` is larger than their `max_control`.

    No number lies between the two, so no control is allowed. OpenSim simulates the model anyway.
    But static optimization, computed muscle control and optimal control use both numbers as bounds,
    and fail.

    ```xml
      <CoordinateActuator name="motor">
    -     <min_control>1</min_control> <max_control>-1</max_control>
    +     <min_control>-1</min_control> <max_control>1</max_control>
          <coordinate>knee_angle</coordinate> <optimal_force>100</optimal_force>
      </CoordinateActuator>
    ```
    """
    for actuator in subject.find_by_class("ScalarActuator"):
        low, high = actuator.min_control, actuator.max_control
        if low > high:
            tag = "min_control" if "min_control" in actuator.model_fields_set else "max_control"
            report(
                f"min_control of {describe_object(actuator)}, {format_quantity(low)}, is above "
                f"its max_control, {format_quantity(high)}",
                actuator,
                tag=tag,
            )


_Relation = Callable[[Any, Any], Iterator[Contradiction]]
"""Function that yields the contradictions of an object, from it and its component."""


def _make_curve_relation(make: Callable[..., object]) -> _Relation:
    """Return the check of a muscle curve; `make` takes its properties and raises what is wrong."""

    def contradiction(curve: Any, owner: Any) -> Iterator[Contradiction]:
        values = {name: getattr(curve, name) for name in type(curve).__annotations__}
        # NaN and infinity have OSIM205.
        if not all(value is None or math.isfinite(value) for value in values.values()):
            return
        # Muscles overwrite some properties of their curves.
        overwritten = owner.overwritten if is_a(owner, "Muscle") else {}
        values |= {name: overwritten[name] for name in values.keys() & overwritten.keys()}
        try:
            make(*values.values())
        except ValueError as error:
            # The message names the property as its second word.
            word = str(error).split()[1].rstrip(",")
            yield word if word in values else None, str(error)

    return contradiction


def _check_function_based_path(path: Any, owner: Any) -> Iterator[Contradiction]:
    """Yield contradictions between the coordinates of a function-based path and its functions."""
    coordinates = path.coordinate_paths
    if not coordinates:
        yield None, "coordinate_paths is empty"
    for name in sorted({name for name in coordinates if coordinates.count(name) > 1}):
        yield "coordinate_paths", f"coordinate_paths names '{name}' twice"
    arms = path.moment_arm_functions
    count = len(coordinates)
    if arms and len(arms) != count:
        counts = f"{format_count(len(arms), 'function')} for {format_count(count, 'coordinate')}"
        yield "moment_arm_functions", f"moment_arm_functions has {counts}"
    # The speed depends on all coordinates and their speeds.
    functions = [("length_function", path.length_function, count)]
    functions += [("moment_arm_functions", arm, count) for arm in arms]
    functions.append(("lengthening_speed_function", path.lengthening_speed_function, 2 * count))
    for tag, function, expected_count in functions:
        result = _count_arguments(function)
        if result is not None and result != expected_count:
            yield (
                tag,
                f"a function in {tag} takes {format_count(result, 'argument')}, expected {expected_count}",
            )


def _count_arguments(function: Any) -> int | None:
    """Return the number of arguments of a function according to OpenSim; None if it is unknown."""
    if isinstance(function, MultiplierFunction):
        return _count_arguments(function.function)
    if isinstance(function, LinearFunction):
        return len(function.coefficients) - 1
    if isinstance(function, Constant):
        return 0
    if is_a(function, "MultivariatePolynomialFunction"):
        return cast("int", function.dimension)
    if is_a(function, "ExpressionBasedFunction"):
        return len(function.variables)
    return 1 if any(is_a(function, name) for name in UNIVARIATE_FUNCTIONS) else None


_RELATIONS: Final[dict[str, _Relation]] = {
    "ActiveForceLengthCurve": _make_curve_relation(active_force_length),
    "FiberCompressiveForceCosPennationCurve": _make_curve_relation(
        fiber_compressive_force_cos_pennation
    ),
    "FiberCompressiveForceLengthCurve": _make_curve_relation(fiber_compressive_force_length),
    "FiberForceLengthCurve": _make_curve_relation(fiber_force_length),
    "ForceVelocityCurve": _make_curve_relation(force_velocity),
    "FunctionBasedPath": _check_function_based_path,
    "TendonForceLengthCurve": _make_curve_relation(tendon_force_length),
}
"""Checks for combinations of numbers that OpenSim 4.6 rejects, by class."""
