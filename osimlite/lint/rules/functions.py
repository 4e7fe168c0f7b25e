"""OSIM60x: functions given by points."""

from __future__ import annotations

from collections.abc import Iterator
from math import comb
from typing import Final, cast

from osimlite.base.text import format_count
from osimlite.lint.axes import axes_of
from osimlite.lint.registry import ERROR, WARNING, FindingSink, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import called, quantity
from osimlite.schema.base import Component, Object
from osimlite.schema.forces import Force
from osimlite.schema.functions import (
    Function,
    FunctionSet,
    GCVSpline,
    LinearFunction,
    MultiplierFunction,
    MultivariatePolynomialFunction,
    PiecewiseConstantFunction,
    PiecewiseLinearFunction,
    PolynomialFunction,
    SimmSpline,
    Sine,
    StepFunction,
)
from osimlite.schema.paths import FunctionBasedPath
from osimlite.schema.sets import Controller

Tabulated = SimmSpline | GCVSpline | PiecewiseLinearFunction | PiecewiseConstantFunction


@rule("OSIM601", "unsorted-abscissae", severity=ERROR)
def unsorted_abscissae(subject: Subject, report: FindingSink) -> None:
    """The x values of a function do not rise.

    Reports the first x that is smaller than the one before it, and of splines also the first that
    is equal to it.

    A GCVSpline is refused, or OpenSim fails when a force or a controller asks for its value. A
    SimmSpline divides by the difference without a word and gives values in the millions; piecewise
    functions take the wrong piece. A moment arm or a moving point is then anywhere. Where the same
    point stands twice, a SimmSpline has no slope (a warning). What is off, a controller or a force,
    never computes its functions (a warning).

    ```xml
      <Coordinate name="knee_angle">
          <prescribed_function>
    -         <SimmSpline> <x>0 0.5 0.5 1</x> <y>0 -0.4 -0.5 -1</y> </SimmSpline>
    +         <SimmSpline> <x>0 0.5 0.6 1</x> <y>0 -0.4 -0.5 -1</y> </SimmSpline>
          </prescribed_function>
      </Coordinate>
    ```
    """
    for function in _tabulated(subject):
        strictly = isinstance(function, (SimmSpline, GCVSpline))
        for index in range(1, len(function.x)):
            before, here = function.x[index - 1], function.x[index]
            if here < before or (strictly and here == before):
                refused = isinstance(function, GCVSpline)
                is_off = is_unused(subject, function)
                level = (
                    here == before
                    and not refused
                    and function.y[index - 1 : index] == function.y[index : index + 1]
                )
                fate = (
                    UNUSED
                    if is_off
                    else "OpenSim refuses it"
                    if refused
                    else "it is level there"
                    if level
                    else "its values are wrong"
                )
                relation = "repeats" if here == before else "is smaller than"
                word, nth = subject.word_at(function, "x", index)
                report(
                    f"x of {subject.called_with(function)}: number {index + 1}, {quantity(here)}, {relation} the one "
                    f"before; {fate}",
                    function,
                    tag="x",
                    word=word,
                    nth=nth,
                    severity=WARNING if level or is_off else None,
                )
                if not level:
                    break


@rule("OSIM602", "unequal-points", severity=ERROR)
def unequal_points(subject: Subject, report: FindingSink) -> None:
    """A function has not as many y values as x values.

    Reports tabulated functions whose lists are of different length. Too many y are a warning.

    Where y is missing OpenSim reads beyond the end of the list, whatever is in memory there; a
    GCVSpline is refused. Too many y are ignored.

    ```xml
      <Coordinate name="knee_angle">
          <prescribed_function>
    -         <SimmSpline> <x>0 0.5 1</x> <y>0 -0.4</y> </SimmSpline>
    +         <SimmSpline> <x>0 0.5 1</x> <y>0 -0.4 -1</y> </SimmSpline>
          </prescribed_function>
      </Coordinate>
    ```
    """
    for function in _tabulated(subject):
        xs, ys = len(function.x), len(function.y)
        if xs == ys:
            continue
        is_off = is_unused(subject, function)
        fate = (
            UNUSED
            if is_off
            else "OpenSim reads beyond the end of the list"
            if ys < xs
            else "the rest is ignored"
        )
        report(
            f"{subject.called_with(function)} has {xs} x and {ys} y: {fate}",
            function,
            tag="y",
            severity=WARNING if is_off or ys > xs else None,
        )


@rule("OSIM603", "too-few-points", severity=ERROR)
def too_few_points(subject: Subject, report: FindingSink) -> None:
    """A function has too few points.

    Reports a SimmSpline of fewer than two points, a GCVSpline of fewer than twice its half order or
    without a half order, and piecewise functions without any.

    A SimmSpline is then NaN everywhere, a GCVSpline is refused, and a piecewise function returns
    what is in memory.

    ```xml
      <Coordinate name="knee_angle">
    -     <prescribed_function> <SimmSpline> <x>0</x> <y>-1</y> </SimmSpline> </prescribed_function>
    +     <prescribed_function> <Constant> <value>-1</value> </Constant> </prescribed_function>
      </Coordinate>
    ```
    """
    for function in _tabulated(subject):
        least, is_off = 1, is_unused(subject, function)
        severity = WARNING if is_off else None
        if isinstance(function, SimmSpline):
            least = 2
        elif isinstance(function, GCVSpline):
            least = 2 * function.half_order
        if isinstance(function, GCVSpline) and function.half_order < 1:
            given = (
                str(function.half_order)
                if "half_order" in function.model_fields_set
                else "not given"
            )
            fate = _describe_refusal(subject, function)
            report(
                f"half_order of {subject.called_with(function)} is {given}: {fate}; 2 is a cubic spline",
                function,
                tag="half_order",
                severity=severity,
            )
        elif len(function.x) < least:
            fate = "it has no value"
            if is_off or isinstance(function, GCVSpline):
                fate = _describe_refusal(subject, function)
            given = format_count(len(function.x), "point")
            report(
                f"{subject.called_with(function)} has {given} and needs {least}: {fate}",
                function,
                tag="x",
                severity=severity,
            )


@rule("OSIM604", "coefficient-count", severity=WARNING)
def coefficient_count(subject: Subject, report: FindingSink) -> None:
    """A linear function or a polynomial has too many or too few coefficients.

    Reports linear functions without coefficients (an error), polynomials of several variables with
    another number than their dimension and order ask for (an error), and linear functions on the
    axis of a joint or of a coordinate coupler that have fewer (an error) or more than the
    coordinates there and a constant.

    OpenSim crashes on an empty list, and refuses a polynomial. Where the constant is missing it
    reads beyond the end of the list. Of too many it takes the first for the weights, the next for
    the constant, and ignores the rest.

    ```xml
      <Coordinate name="knee_angle">
          <prescribed_function>
    -         <LinearFunction> <coefficients></coefficients> </LinearFunction>
    +         <LinearFunction> <coefficients>0 -0.2</coefficients> </LinearFunction>
          </prescribed_function>
      </Coordinate>
    ```
    """
    for function in subject.each(LinearFunction):
        if not function.coefficients:
            is_off = is_unused(subject, function)
            fate = UNUSED if is_off else "OpenSim crashes when it needs a value"
            report(
                f"{subject.called_with(function)} has no coefficients: {fate}",
                function,
                tag="coefficients",
                severity=WARNING if is_off else ERROR,
            )
    for polynomial in subject.each(MultivariatePolynomialFunction):
        dimension, order, given = (
            polynomial.dimension,
            polynomial.order,
            len(polynomial.coefficients),
        )
        wanted = (
            comb(dimension + order, order) if 0 <= dimension < 100 and 0 <= order < 100 else given
        )
        if given != wanted:
            is_off = is_unused(subject, polynomial)
            fate = UNUSED if is_off else "OpenSim fails when it needs a value"
            report(
                f"{subject.called_with(polynomial)} has {format_count(given, 'coefficient')}; "
                f"{format_count(dimension, 'variable')} to order {order} need {wanted}: {fate}",
                polynomial,
                tag="coefficients",
                severity=WARNING if is_off else ERROR,
            )
    for holder, names, function in _linear(subject):
        given, wanted = len(function.coefficients), names + 1
        if given and given != wanted:
            fate = (
                "OpenSim reads beyond the end of the list"
                if given < wanted
                else "OpenSim ignores the rest"
            )
            report(
                f"the LinearFunction of {called(holder)} has {format_count(given, 'coefficient')} for "
                f"{format_count(names, 'coordinate')}: {wanted} belong there; {fate}",
                function,
                tag="coefficients",
                severity=ERROR if given < wanted else None,
            )


@rule("OSIM607", "function-of-several", severity=ERROR)
def function_of_several(subject: Subject, report: FindingSink) -> None:
    """A function of one variable stands on several coordinates.

    Reports splines, piecewise functions, polynomials, sines and steps on an axis of a CustomJoint,
    or in a CoordinateCouplerConstraint, that names more than one coordinate; and
    MultivariatePolynomialFunctions whose `dimension` is not the number of the coordinates.

    OpenSim gives no message. It takes values and derivatives of different coordinates, so that the
    motion is that of neither. A LinearFunction takes any number of coordinates, a
    MultivariatePolynomialFunction those of its dimension.

    ```xml
      <CoordinateCouplerConstraint name="follow">
          <coupled_coordinates_function>
              <SimmSpline> <x>-1 0 1</x> <y>0 -0.1 -0.3</y> </SimmSpline>
          </coupled_coordinates_function>
    -     <independent_coordinate_names>hip_flexion pelvis_rz</independent_coordinate_names>
    +     <independent_coordinate_names>hip_flexion</independent_coordinate_names>
          <dependent_coordinate_name>knee_angle</dependent_coordinate_name>
      </CoordinateCouplerConstraint>
    ```
    """
    for holder, count, held in _find_functions_of_coordinates(subject):
        function = held
        while isinstance(function, MultiplierFunction):
            function = function.function
        wanted = function.dimension if isinstance(function, MultivariatePolynomialFunction) else 1
        if (
            not isinstance(function, (*_OF_ONE, MultivariatePolynomialFunction))
            or count == wanted
            or not count
        ):
            continue
        report(
            f"the {type(function).tag} of {called(holder)} is a function of {format_count(wanted, 'variable')} and stands "
            f"on {format_count(count, 'coordinate')}: OpenSim computes what is meant for neither",
            holder,
        )


_NEEDED: Final = {
    "Bhargava2004SmoothedMuscleMetabolics_MuscleParameters": ("use_provided_muscle_mass",),
    "CoordinateCouplerConstraint": ("coupled_coordinates_function",),
    "FunctionBasedBushingForce": tuple(
        f"{letter}_{axis}_{kind}_{axis}_function"
        for letter, kind in (("m", "theta"), ("f", "delta"))
        for axis in "xyz"
    ),
    "FunctionBasedPath": ("length_function",),
    "MovingPathPoint": ("x_location", "y_location", "z_location"),
}
"""Properties that may be empty by OpenSim's declarations, and without which it cannot compute."""


@rule("OSIM605", "missing-function", severity=ERROR)
def missing_function(subject: Subject, report: FindingSink) -> None:
    """A function is not there that OpenSim cannot do without.

    Reports MultiplierFunctions, CoordinateCouplerConstraints and FunctionBasedPaths without a
    function inside, and empty functions of MovingPathPoints and FunctionBasedBushingForces; and
    PrescribedForces with other than three functions, or none, for the force, its point or the
    torque.

    OpenSim refuses the model, or fails when it needs the value. Scaling a model wraps functions in
    multipliers; one that was taken out later leaves an empty multiplier.

    ```xml
      <Coordinate name="knee_angle">
          <prescribed_function>
              <MultiplierFunction> <scale>2</scale>
    +             <function> <Constant> <value>-0.1</value> </Constant> </function>
              </MultiplierFunction>
          </prescribed_function>
      </Coordinate>
    ```
    """
    for force in subject.named("PrescribedForce"):
        for name in ("forceFunctions", "pointFunctions", "torqueFunctions"):
            functions = getattr(force, name)
            if isinstance(functions, FunctionSet) and len(functions.objects) not in (0, 3):
                given = format_count(len(functions.objects), "function")
                report(
                    f"{name} of {called(force)} has {given}, not three or none: OpenSim refuses to load the file",
                    functions,
                )
    if subject.has_unknown:
        return
    for kind, properties in _NEEDED.items():
        refused = (
            "OpenSim refuses the model"
            if len(properties) == 1
            else "OpenSim fails when it needs a value"
        )
        for item in subject.named(kind):
            for name in properties:
                if getattr(item, name) is None:
                    report(f"{called(item)} has no {name}: {refused}", item, tag=name)
    for function in subject.each(MultiplierFunction):
        if function.function is None:
            is_off = is_unused(subject, function)
            fate = UNUSED if is_off else "OpenSim fails when it needs a value"
            report(
                f"{subject.called_with(function)} has no function to multiply: {fate}",
                function,
                severity=WARNING if is_off else None,
            )


_OF_ONE: Final = (
    SimmSpline,
    GCVSpline,
    PiecewiseLinearFunction,
    PiecewiseConstantFunction,
    PolynomialFunction,
    Sine,
    StepFunction,
)


def _find_functions_of_coordinates(
    subject: Subject,
) -> Iterator[tuple[Object, int, Function | None]]:
    """Yield the functions of coordinates: what they belong to, the number of coordinates, the function."""
    for joint in subject.named("CustomJoint"):
        # An axis without coordinates takes any function that needs none.
        for axis in axes_of(joint):
            if axis.coordinates:
                yield axis, len(axis.coordinates), axis.function
    for coupler in subject.named("CoordinateCouplerConstraint"):
        yield (
            coupler,
            len(coupler.independent_coordinate_names),
            coupler.coupled_coordinates_function,
        )


def _linear(subject: Subject) -> Iterator[tuple[Object, int, LinearFunction]]:
    """The linear functions of several variables: what they belong to, how many variables, and the function."""
    for holder, count, held in _find_functions_of_coordinates(subject):
        function = held
        while isinstance(function, MultiplierFunction):
            function = function.function
        if isinstance(function, LinearFunction) and (
            function._index is not None or subject.source is None
        ):
            yield holder, count, function


UNUSED: Final = "what it belongs to is off, and OpenSim does not compute it"


def is_unused(subject: Subject, function: Object) -> bool:
    """Return whether OpenSim never computes a function, since what it belongs to is off.

    That is a force that is not applied or a controller that is not enabled. Functions of
    coordinates and constraints are made with the system, even where they are off, and the
    integrator asks each enabled controller, even if no actuator does.
    """
    user = _find_user(subject, function)
    if isinstance(user, Force):
        return not user.appliesForce
    return isinstance(user, Controller) and not user.enabled


def _find_user(subject: Subject, function: Object) -> Force | Controller | None:
    """Return what asks for the values of a function; None if it is made with the model or the system."""
    item: Component | None = subject.owner(function)
    while item is not None and not isinstance(item, Force | Controller):
        # OpenSim makes the functions of such a path as it reads it, whether the force is applied or
        # not.
        item = None if isinstance(item, FunctionBasedPath) else subject.tree.parent_of(item)
    return item


def _describe_refusal(subject: Subject, function: Object) -> str:
    """Return what OpenSim does with a spline that it cannot make."""
    if is_unused(subject, function):
        return UNUSED
    # What a force or a controller asks for is made at the first acceleration.
    is_late = _find_user(subject, function) is not None
    return "OpenSim fails when it needs a value" if is_late else "OpenSim refuses it"


def _tabulated(subject: Subject) -> Iterator[Tabulated]:
    for cls in (SimmSpline, GCVSpline, PiecewiseLinearFunction, PiecewiseConstantFunction):
        for function in subject.each(cls):
            if function._index is not None or subject.source is None:
                yield cast("Tabulated", function)
