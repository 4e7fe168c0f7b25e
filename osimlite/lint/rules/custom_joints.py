"""OSIM41x: the axes of custom joints, and the coordinates and functions on them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

from osimlite.base.text import find_nearest, join_words
from osimlite.lint.axes import list_axes, list_coordinates, refuses_axes
from osimlite.lint.registry import ERROR, NAN, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object
from osimlite.mechanics.laws.vectors import cross, norm
from osimlite.schema.base import Unknown
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.function_types import MultivariatePolynomialFunction, PolynomialFunction
from osimlite.schema.functions import Constant, Function, LinearFunction, MultiplierFunction
from osimlite.schema.splines import (
    GCVSpline,
    PiecewiseConstantFunction,
    PiecewiseLinearFunction,
    SimmSpline,
)
from osimlite.schema.tree import is_a

if TYPE_CHECKING:
    from osimlite.schema.custom_joint import CustomJoint


@rule("OSIM410", "made-up-coordinate", severity=ERROR, consequences=(RUNS,))
def report_made_up_coordinate(subject: Subject, report: FindingCollector) -> None:
    """An axis of a custom joint names a coordinate that the joint does not declare.

    Reports such names if OpenSim accepts the model. If OpenSim rejects the model because of the
    name, OSIM301 reports an unresolved reference instead. The finding is a warning if the joint
    declares no coordinate at all.

    OpenSim creates a coordinate with that name, without a message. The joint gets an additional
    degree of freedom with the value 0, and the axis does not follow the intended coordinate.

    ```xml
      <TransformAxis name="translation1">
    -     <coordinates>ankle_angel</coordinates>
    +     <coordinates>ankle_angle</coordinates>
          <LinearFunction name="function"> <coefficients>0.01 0</coefficients> </LinearFunction>
      </TransformAxis>
    ```
    """
    for joint in subject.find_by_class("CustomJoint"):
        declared = [coordinate.name for coordinate in list_coordinates(joint)]
        if refuses_axes(joint):
            continue
        for axis in list_axes(joint):
            for index, name in enumerate(axis.coordinates):
                # An unreadable word has a finding of another rule.
                if not isinstance(name, str) or name in declared:
                    continue
                word, nth = subject.word_at(axis, "coordinates", index)
                report(
                    f"{axis.name} of {describe_object(joint)} names '{name}', which the joint "
                    "does not declare: OpenSim creates a coordinate of that name",
                    axis,
                    tag="coordinates",
                    word=word,
                    nth=nth,
                    suggestion=find_nearest(name, declared),
                    severity=None if declared else WARNING,
                )


@rule("OSIM412", "axis-without-coordinate", severity=ERROR, consequences=(REFUSES,))
def report_axis_without_coordinate(subject: Subject, report: FindingCollector) -> None:
    """An axis of a custom joint has a function, but no coordinate for it.

    Reports axes that name no coordinate although their function needs a variable. Constant and
    linear functions need none.

    OpenSim crashes, without a message.

    ```xml
      <TransformAxis name="translation1">
    +     <coordinates>ankle_angle</coordinates>
          <SimmSpline name="function"> <x>-1 0 1</x> <y>0.01 0 0.01</y> </SimmSpline>
      </TransformAxis>
    ```
    """
    for joint in subject.find_by_class("CustomJoint"):
        for axis in list_axes(joint):
            function = axis.function
            # Scaled functions are wrapped.
            while (
                is_a(function, "MultiplierFunction")
                and getattr(function, "function", None) is not None
            ):
                function = cast("Any", function).function
            if not axis.coordinates and type(function).__name__ not in (
                "Constant",
                "LinearFunction",
                "Unknown",
            ):
                report(
                    f"{axis.name} of {describe_object(joint)} names no coordinate for its "
                    f"{describe_object(axis.function)}: OpenSim crashes",
                    axis,
                    tag="coordinates",
                )


@rule("OSIM413", "collinear-axes", severity=ERROR, consequences=(REFUSES,))
def report_collinear_axes(subject: Subject, report: FindingCollector) -> None:
    """Two rotations, or two translations, of a custom joint have the same axis.

    Reports rotation axes that are parallel to an earlier rotation axis of the same joint, and
    translation axes that are parallel to an earlier translation axis. Also reports axes of length
    0.

    OpenSim rejects the file, even if nothing moves along or about the axis. Give each unused axis a
    different direction, too.

    ```xml
      <TransformAxis name="rotation1"> <axis>0 0 1</axis> </TransformAxis>
    - <TransformAxis name="rotation2"> <axis>0 0 1</axis> </TransformAxis>
    + <TransformAxis name="rotation2"> <axis>0 1 0</axis> </TransformAxis>
    ```
    """
    for joint in subject.find_by_class("CustomJoint"):
        axes = list_axes(joint)
        # OpenSim compares rotations with rotations and translations with translations.
        for kind in (axes[:3], axes[3:]):
            # Of an axis with NaN in it OpenSim's comparison says nothing.
            kind = [axis for axis in kind if not any(map(math.isnan, axis.axis))]
            for index, axis in enumerate(kind):
                twin = next(
                    (
                        earlier_axis
                        for earlier_axis in kind[:index]
                        # `not >=` counts NaN as parallel.
                        if not norm(cross(axis.axis, earlier_axis.axis)) >= _COLLINEAR
                    ),
                    None,
                )
                # An axis without a length is parallel to every other one; the finding belongs to
                # it.
                has_no_length = math.hypot(*axis.axis) < _COLLINEAR
                if has_no_length or (twin is not None and math.hypot(*twin.axis) >= _COLLINEAR):
                    state = (
                        "has no length"
                        if has_no_length
                        else f"is parallel to that of {twin.name if twin else ''}"
                    )
                    report(
                        f"the axis of {axis.name} of {describe_object(joint)} {state}: OpenSim "
                        "rejects the file",
                        axis,
                        tag="axis",
                    )


@rule("OSIM414", "idle-coordinate", severity=ERROR, consequences=(NAN,))
def report_idle_coordinate(subject: Subject, report: FindingCollector) -> None:
    """A coordinate of a custom joint moves nothing.

    Reports coordinates that no axis uses. Also reports coordinates that do not change the value of
    any axis function in the default pose. Such functions are constant, have the weight 0, or read
    only another coordinate. Also reports joints whose coordinates all together produce fewer
    independent motions than there are coordinates.

    The joint has a degree of freedom without motion, so the mass matrix has no inverse. All
    accelerations of the joint become NaN, without a message. This happens even if the coordinate is
    locked or prescribed.

    ```xml
      <TransformAxis name="rotation1">
          <coordinates>ankle_angle</coordinates>
    -     <LinearFunction name="function"> <coefficients>0 0.5</coefficients> </LinearFunction>
    +     <LinearFunction name="function"> <coefficients>0.5 0</coefficients> </LinearFunction>
      </TransformAxis>
    ```
    """
    for joint in subject.find_by_class("CustomJoint"):
        coordinates = list_coordinates(joint)
        # If OpenSim rejects the joint, OSIM405 reports the reason.
        if not coordinates or refuses_axes(joint):
            continue
        columns = {
            coordinate.name: _compute_axis_rates(joint, coordinate) for coordinate in coordinates
        }
        # A zero column of the joint's Jacobian: the mass matrix is singular.
        idle = [coordinate for coordinate in coordinates if not any(columns[coordinate.name])]
        for coordinate in idle:
            axes = [axis.name for axis in list_axes(joint) if coordinate.name in axis.names]
            state = (
                f"does not change the value of {join_words(axes)}"
                if axes
                else "is not used by any of its axes"
            )
            report(
                f"{describe_object(coordinate)} of {describe_object(joint)} {state}: "
                "accelerations become NaN, without a message",
                coordinate,
                attribute="name",
            )
        # Two coordinates with dependent columns make it singular as well.
        if not idle and _compute_rank(list(columns.values())) < len(columns):
            report(
                f"the coordinates of {describe_object(joint)} produce the same motion: "
                "accelerations are NaN or meaningless",
                joint,
                number=subject.element_of(joint, "coordinates"),
            )


_COLLINEAR = 1e-5
"""Length of the cross product of two axes below which OpenSim 4.6 rejects them; it does not make them unit vectors."""


def _compute_axis_rates(joint: CustomJoint, coordinate: Coordinate) -> list[float]:
    """Return the rate of each axis with a coordinate in the default pose; unknown rates are arbitrary but not 0."""
    values = {item.name: item.default_value for item in list_coordinates(joint)}
    result = []
    for number, axis in enumerate(list_axes(joint)):
        names = axis.names
        # For a repeated name the last position counts.
        variable_index = max(
            (
                variable_index
                for variable_index, name in enumerate(names)
                if name == coordinate.name
            ),
            default=None,
        )
        rate = (
            0.0
            if variable_index is None
            else _compute_slope(axis.function, variable_index, values.get(names[0], 0.0))
        )
        # No combination of these numbers is 0 by chance.
        result.append(math.sqrt(2 + number + 7 * (variable_index or 0)) if rate is None else rate)
    return result


def _compute_slope(
    function: Function | None, variable_index: int, first_value: float
) -> float | None:
    """Return the derivative of a function by one of its variables, at a value of the first; None if unknown."""
    match function:
        case None | Constant():
            return 0.0
        case LinearFunction():
            return (
                function.coefficients[variable_index]
                if variable_index < len(function.coefficients)
                else 0.0
            )
        case MultiplierFunction():
            inner_slope = _compute_slope(function.function, variable_index, first_value)
            return (
                0.0
                if function.scale == 0
                else None
                if inner_slope is None
                else function.scale * inner_slope
            )
        case PolynomialFunction() if variable_index == 0:
            # OpenSim lists the highest power first.
            degree = len(function.coefficients) - 1
            powers = enumerate(function.coefficients[:-1])
            return sum(
                (degree - n) * weight * first_value ** (degree - n - 1) for n, weight in powers
            )
        case SimmSpline() | PiecewiseLinearFunction() | PiecewiseConstantFunction() | GCVSpline():
            # With different values the slope depends on the pose, which is not worth computing
            # here.
            return 0.0 if variable_index or len(set(function.y)) < 2 else None
    return (
        0.0
        if variable_index and not isinstance(function, Unknown | MultivariatePolynomialFunction)
        else None
    )


def _compute_rank(rows: list[list[float]]) -> int:
    """Return the number of linearly independent rows, by elimination."""
    rank = 0
    rows = [row[:] for row in rows]
    # A joint has six axes.
    for column in range(6):
        pivot = max(range(rank, len(rows)), key=lambda n: abs(rows[n][column]), default=None)
        # The pivot is the largest number of the column, so that rounding stays small.
        if pivot is None or abs(rows[pivot][column]) < 1e-12:
            continue
        rows[rank], rows[pivot] = rows[pivot], rows[rank]
        for below in rows[rank + 1 :]:
            factor = below[column] / rows[rank][column]
            for index in range(column, 6):
                below[index] -= factor * rows[rank][index]
        rank += 1
    return rank
