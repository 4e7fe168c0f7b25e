"""OSIM41x: the axes of custom joints, and the coordinates and functions on them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

from osimlite.base.text import find_nearest, join_words
from osimlite.lint.axes import axes_of, axes_refused, coordinates_of
from osimlite.lint.registry import ERROR, WARNING, FindingSink, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import called
from osimlite.mechanics.laws.vectors import cross, norm
from osimlite.schema.base import Unknown
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.functions import (
    Constant,
    Function,
    GCVSpline,
    LinearFunction,
    MultiplierFunction,
    MultivariatePolynomialFunction,
    PiecewiseConstantFunction,
    PiecewiseLinearFunction,
    PolynomialFunction,
    SimmSpline,
)
from osimlite.schema.tree import is_a

if TYPE_CHECKING:
    from osimlite.schema.custom_joint import CustomJoint


@rule("OSIM410", "made-up-coordinate", severity=ERROR)
def made_up_coordinate(subject: Subject, report: FindingSink) -> None:
    """An axis of a custom joint names a coordinate that the joint does not declare.

    Reports such names where OpenSim takes the model all the same; where it refuses the model, the
    name is reported as a reference that leads nowhere. It is a warning if the joint declares no
    coordinate at all.

    OpenSim makes a coordinate of that name up, without a word: the joint has one degree of freedom
    more, its value is 0, and the axis no longer follows the coordinate it was meant to follow.

    ```xml
      <TransformAxis name="translation1">
    -     <coordinates>ankle_angel</coordinates>
    +     <coordinates>ankle_angle</coordinates>
          <LinearFunction name="function"> <coefficients>0.01 0</coefficients> </LinearFunction>
      </TransformAxis>
    ```
    """
    for joint in subject.named("CustomJoint"):
        declared = [coordinate.name for coordinate in coordinates_of(joint)]
        if axes_refused(joint):
            continue
        for axis in axes_of(joint):
            for index, name in enumerate(axis.coordinates):
                if not isinstance(name, str) or name in declared:
                    continue
                word, nth = subject.word_at(axis, "coordinates", index)
                report(
                    f"{axis.name} of {called(joint)} names '{name}', which the joint does not declare: OpenSim makes a "
                    "coordinate of that name up",
                    axis,
                    tag="coordinates",
                    word=word,
                    nth=nth,
                    suggestion=find_nearest(name, declared),
                    severity=None if declared else WARNING,
                )


@rule("OSIM412", "axis-without-coordinate", severity=ERROR)
def axis_without_coordinate(subject: Subject, report: FindingSink) -> None:
    """An axis of a custom joint has a function and no coordinate for it.

    Reports axes that name no coordinate though their function wants a variable. Constant and linear
    functions do without.

    OpenSim crashes, without a message.

    ```xml
      <TransformAxis name="translation1">
    +     <coordinates>ankle_angle</coordinates>
          <SimmSpline name="function"> <x>-1 0 1</x> <y>0.01 0 0.01</y> </SimmSpline>
      </TransformAxis>
    ```
    """
    for joint in subject.named("CustomJoint"):
        for axis in axes_of(joint):
            function = axis.function
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
                    f"{axis.name} of {called(joint)} names no coordinate for its {called(axis.function)}: "
                    "OpenSim crashes",
                    axis,
                    tag="coordinates",
                )


@rule("OSIM413", "collinear-axes", severity=ERROR)
def collinear_axes(subject: Subject, report: FindingSink) -> None:
    """Two rotations, or two translations, of a custom joint have the same axis.

    Reports axes of a custom joint that are parallel to one before of the same kind, or have no
    length.

    OpenSim refuses to load the file, also where an axis moves nothing. Give each unused axis a
    direction of its own.

    ```xml
      <TransformAxis name="rotation1"> <axis>0 0 1</axis> </TransformAxis>
    - <TransformAxis name="rotation2"> <axis>0 0 1</axis> </TransformAxis>
    + <TransformAxis name="rotation2"> <axis>0 1 0</axis> </TransformAxis>
    ```
    """
    for joint in subject.named("CustomJoint"):
        axes = axes_of(joint)
        for kind in (axes[:3], axes[3:]):
            # Of an axis with NaN in it OpenSim's comparison says nothing.
            kind = [axis for axis in kind if not any(map(math.isnan, axis.axis))]
            for index, axis in enumerate(kind):
                twin = next(
                    (
                        other
                        for other in kind[:index]
                        if not norm(cross(axis.axis, other.axis)) >= _COLLINEAR
                    ),
                    None,
                )
                # An axis without a length is parallel to every other one; the finding belongs to
                # it.
                short = math.hypot(*axis.axis) < _COLLINEAR
                if short or (twin is not None and math.hypot(*twin.axis) >= _COLLINEAR):
                    state = (
                        "has no length"
                        if short
                        else f"is parallel to that of {twin.name if twin else ''}"
                    )
                    report(
                        f"the axis of {axis.name} of {called(joint)} {state}: OpenSim refuses to load the file",
                        axis,
                        tag="axis",
                    )


@rule("OSIM414", "idle-coordinate", severity=ERROR)
def idle_coordinate(subject: Subject, report: FindingSink) -> None:
    """A coordinate of a custom joint moves nothing.

    Reports coordinates that no axis uses, or only with a function that does not change with them in
    the default pose: a constant one, one with the weight 0, or one of a single variable that reads
    another coordinate.

    The joint has a degree of freedom without a motion, so that the mass matrix cannot be inverted:
    all accelerations of the joint become NaN, without a message, also if the coordinate is locked
    or prescribed.

    ```xml
      <TransformAxis name="rotation1">
          <coordinates>ankle_angle</coordinates>
    -     <LinearFunction name="function"> <coefficients>0 0.5</coefficients> </LinearFunction>
    +     <LinearFunction name="function"> <coefficients>0.5 0</coefficients> </LinearFunction>
      </TransformAxis>
    ```
    """
    for joint in subject.named("CustomJoint"):
        coordinates = coordinates_of(joint)
        if not coordinates or axes_refused(joint):
            continue
        columns = {coordinate.name: _motion_by(joint, coordinate) for coordinate in coordinates}
        idle = [coordinate for coordinate in coordinates if not any(columns[coordinate.name])]
        for coordinate in idle:
            axes = [axis.name for axis in axes_of(joint) if coordinate.name in axis.names]
            state = f"does not change {join_words(axes)} of it" if axes else "is on no axis of it"
            report(
                f"{called(coordinate)} of {called(joint)} {state}: accelerations become NaN, without a message",
                coordinate,
                attribute="name",
            )
        if not idle and _rank(list(columns.values())) < len(columns):
            report(
                f"the coordinates of {called(joint)} move it in the same way: accelerations are NaN, or anything",
                joint,
                number=subject.element_of(joint, "coordinates"),
            )


_COLLINEAR = 1e-5
"""Length of the cross product of two axes below which OpenSim 4.6 refuses them; it does not make them unit vectors."""


def _motion_by(joint: CustomJoint, coordinate: Coordinate) -> list[float]:
    """How fast each axis moves with a coordinate in the default pose; where nobody can tell, some number but 0."""
    values = {item.name: item.default_value for item in coordinates_of(joint)}
    result = []
    for number, axis in enumerate(axes_of(joint)):
        names = axis.names
        # Of a name that stands twice the last place counts.
        place = max(
            (place for place, name in enumerate(names) if name == coordinate.name), default=None
        )
        known = 0.0 if place is None else _slope(axis.function, place, values.get(names[0], 0.0))
        # No combination of these numbers is 0 by chance.
        result.append(math.sqrt(2 + number + 7 * (place or 0)) if known is None else known)
    return result


def _slope(function: Function | None, place: int, first: float) -> float | None:
    """The derivative of a function by one of its variables, of which the first has a value; None if it is not known."""
    match function:
        case None | Constant():
            return 0.0
        case LinearFunction():
            return function.coefficients[place] if place < len(function.coefficients) else 0.0
        case MultiplierFunction():
            inner = _slope(function.function, place, first)
            return 0.0 if function.scale == 0 else None if inner is None else function.scale * inner
        case PolynomialFunction() if place == 0:
            degree = len(function.coefficients) - 1
            powers = enumerate(function.coefficients[:-1])
            return sum((degree - n) * weight * first ** (degree - n - 1) for n, weight in powers)
        case SimmSpline() | PiecewiseLinearFunction() | PiecewiseConstantFunction() | GCVSpline():
            return 0.0 if place or len(set(function.y)) < 2 else None
    return (
        0.0
        if place and not isinstance(function, Unknown | MultivariatePolynomialFunction)
        else None
    )


def _rank(rows: list[list[float]]) -> int:
    """The number of rows that no others make up, by elimination."""
    rank = 0
    rows = [row[:] for row in rows]
    for column in range(6):
        pivot = max(range(rank, len(rows)), key=lambda n: abs(rows[n][column]), default=None)
        if pivot is None or abs(rows[pivot][column]) < 1e-12:
            continue
        rows[rank], rows[pivot] = rows[pivot], rows[rank]
        for below in rows[rank + 1 :]:
            share = below[column] / rows[rank][column]
            for index in range(column, 6):
                below[index] -= share * rows[rank][index]
        rank += 1
    return rank
