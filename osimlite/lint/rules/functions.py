"""OSIM60x: functions that are given by points."""

from __future__ import annotations

from collections.abc import Iterator
from math import comb
from typing import TYPE_CHECKING, Final, cast

from osimlite.base.text import format_count
from osimlite.lint.axes import list_axes
from osimlite.lint.diagnostic import Consequence
from osimlite.lint.registry import ERROR, FAILS, NAN, REFUSES, RUNS, WARNING, FindingCollector, rule
from osimlite.lint.subject import Subject
from osimlite.lint.words import describe_object, format_quantity
from osimlite.schema.base import Component, Object
from osimlite.schema.forces import Force
from osimlite.schema.functions import (
    UNIVARIATE_FUNCTIONS,
    Function,
    FunctionSet,
    LinearFunction,
    MultiplierFunction,
)
from osimlite.schema.paths import FunctionBasedPath
from osimlite.schema.sets import Controller
from osimlite.schema.tree import is_a

if TYPE_CHECKING:
    from osimlite.schema.function_types import MultivariatePolynomialFunction
    from osimlite.schema.splines import (
        GCVSpline,
        PiecewiseConstantFunction,
        PiecewiseLinearFunction,
        SimmSpline,
    )

    TabulatedFunction = SimmSpline | GCVSpline | PiecewiseLinearFunction | PiecewiseConstantFunction


@rule("OSIM601", "unsorted-abscissae", severity=ERROR, consequences=(REFUSES, FAILS, RUNS))
def report_unsorted_abscissae(subject: Subject, report: FindingCollector) -> None:
    """The x values of a function do not increase.

    Reports the first x that is smaller than the previous one, and for splines also the first that
    is equal to it.

    A GCVSpline with such points is rejected, or makes OpenSim fail when a force or a controller
    needs its value. A SimmSpline divides by the difference of the x values and gives values in the
    millions, without a message. A piecewise function uses the wrong piece. Moment arms and moving
    points are then wrong. The finding is a warning in two cases: if the same point is given twice,
    where a SimmSpline is constant, and if the controller or force is disabled, so that OpenSim does
    not compute its functions.

    ```xml
      <Coordinate name="knee_angle">
          <prescribed_function>
    -         <SimmSpline> <x>0 0.5 0.5 1</x> <y>0 -0.4 -0.5 -1</y> </SimmSpline>
    +         <SimmSpline> <x>0 0.5 0.6 1</x> <y>0 -0.4 -0.5 -1</y> </SimmSpline>
          </prescribed_function>
      </Coordinate>
    ```
    """
    for function in _find_tabulated(subject):
        # Splines divide by the difference of neighbours; piecewise functions may have two equal
        # abscissae at a step.
        strictly = is_a(function, "SimmSpline") or is_a(function, "GCVSpline")
        for index in range(1, len(function.x)):
            previous_x = function.x[index - 1]
            current_x = function.x[index]
            if current_x < previous_x or (strictly and current_x == previous_x):
                rejected = is_a(function, "GCVSpline")
                is_disabled = is_unused(subject, function)
                # Where both values repeat, the slope of 0/0 is never used: SimmSpline gives the
                # constant.
                level = (
                    current_x == previous_x
                    and not rejected
                    and function.y[index - 1 : index] == function.y[index : index + 1]
                )
                description, consequence = (
                    _describe_refusal(subject, function)
                    if is_disabled or rejected
                    else ("the function is constant there", RUNS)
                    if level
                    else ("OpenSim computes wrong values", RUNS)
                )
                relation = "equal to" if current_x == previous_x else "smaller than"
                word, nth = subject.word_at(function, "x", index)
                report(
                    f"x value {index + 1} of {subject.describe_part(function)} is {format_quantity(current_x)}, "
                    f"{relation} the x value before: {description}",
                    function,
                    consequence=consequence,
                    tag="x",
                    word=word,
                    nth=nth,
                    severity=WARNING if level or is_disabled else None,
                )
                # A reversed order makes many pairs wrong; the first is reported. Equal points are
                # reported each.
                if not level:
                    break


@rule("OSIM602", "unequal-points", severity=ERROR, consequences=(REFUSES, RUNS))
def report_unequal_points(subject: Subject, report: FindingCollector) -> None:
    """A function has different numbers of x and y values.

    Reports functions whose lists `x` and `y` differ in length. Too many y values are a warning.

    If y values are missing, OpenSim rejects a GCVSpline. For other functions it reads undefined
    memory beyond the end of the list. OpenSim ignores extra y values.

    ```xml
      <Coordinate name="knee_angle">
          <prescribed_function>
    -         <SimmSpline> <x>0 0.5 1</x> <y>0 -0.4</y> </SimmSpline>
    +         <SimmSpline> <x>0 0.5 1</x> <y>0 -0.4 -1</y> </SimmSpline>
          </prescribed_function>
      </Coordinate>
    ```
    """
    for function in _find_tabulated(subject):
        xs, ys = len(function.x), len(function.y)
        if xs == ys:
            continue
        is_disabled = is_unused(subject, function)
        description, consequence = (
            _describe_refusal(subject, function)
            if is_disabled or (ys < xs and is_a(function, "GCVSpline"))
            else ("OpenSim reads beyond the end of the list", None)
            if ys < xs
            else ("OpenSim ignores the extra values", RUNS)
        )
        report(
            f"{subject.describe_part(function)} has {xs} x values and {ys} y values: {description}",
            function,
            consequence=consequence,
            tag="y",
            severity=WARNING if is_disabled or ys > xs else None,
        )


@rule("OSIM603", "too-few-points", severity=ERROR, consequences=(REFUSES, FAILS, NAN))
def report_too_few_points(subject: Subject, report: FindingCollector) -> None:
    """A function has too few points.

    Reports a SimmSpline with fewer than two points, and piecewise functions without points. Also
    reports a GCVSpline without a `half_order`, or with fewer points than twice its `half_order`.

    A SimmSpline is then NaN everywhere, a GCVSpline is rejected, and a piecewise function returns
    undefined values.

    ```xml
      <Coordinate name="knee_angle">
    -     <prescribed_function> <SimmSpline> <x>0</x> <y>-1</y> </SimmSpline> </prescribed_function>
    +     <prescribed_function> <Constant> <value>-1</value> </Constant> </prescribed_function>
      </Coordinate>
    ```
    """
    for function in _find_tabulated(subject):
        min_count = 1
        is_disabled = is_unused(subject, function)
        severity = WARNING if is_disabled else None
        if is_a(function, "SimmSpline"):
            min_count = 2
        elif is_a(function, "GCVSpline"):
            # A GCVSpline of order 2 m needs 2 m points (Woltring's GCVSPL).
            min_count = 2 * cast("GCVSpline", function).half_order
        if is_a(function, "GCVSpline") and min_count < 2:
            count_text = (
                str(min_count // 2) if "half_order" in function.model_fields_set else "not given"
            )
            description, consequence = _describe_refusal(subject, function)
            report(
                f"half_order of {subject.describe_part(function)} is {count_text}: {description}; 2 gives a "
                "cubic spline",
                function,
                consequence=consequence,
                tag="half_order",
                severity=severity,
            )
        elif len(function.x) < min_count:
            description, consequence = "the function has no value", None
            if is_disabled or is_a(function, "GCVSpline"):
                description, consequence = _describe_refusal(subject, function)
            elif is_a(function, "SimmSpline"):
                consequence = NAN
            count_text = format_count(len(function.x), "point")
            report(
                f"{subject.describe_part(function)} has {count_text}, but needs {min_count}: {description}",
                function,
                consequence=consequence,
                tag="x",
                severity=severity,
            )


@rule("OSIM604", "coefficient-count", severity=WARNING, consequences=(FAILS, RUNS))
def report_coefficient_count(subject: Subject, report: FindingCollector) -> None:
    """A linear function or a polynomial has too many or too few coefficients.

    Reports linear functions without coefficients, and polynomials of several variables whose number
    of coefficients does not match their dimension and order; both are errors. A linear function of a
    joint axis or a coordinate coupler needs one coefficient for each coordinate, and a constant.
    Fewer are an error. More are a warning, or an error if there is no coordinate.

    If a linear function has no coefficients, OpenSim crashes. If a polynomial has the wrong number,
    OpenSim fails when it needs the value. If the constant of a linear function is missing, OpenSim
    reads beyond the end of the list. If there are too many coefficients, it uses the first ones as
    weights and the next one as the constant, and ignores the rest.

    ```xml
      <Coordinate name="knee_angle">
          <prescribed_function>
    -         <LinearFunction> <coefficients></coefficients> </LinearFunction>
    +         <LinearFunction> <coefficients>0 -0.2</coefficients> </LinearFunction>
          </prescribed_function>
      </Coordinate>
    ```
    """
    for function in subject.find_instances(LinearFunction):
        if not function.coefficients:
            is_disabled = is_unused(subject, function)
            consequence = UNUSED if is_disabled else "OpenSim crashes when it needs a value"
            report(
                f"{subject.describe_part(function)} has no coefficients: {consequence}",
                function,
                consequence=FAILS,
                tag="coefficients",
                severity=WARNING if is_disabled else ERROR,
            )
    polynomials: Iterator[MultivariatePolynomialFunction] = subject.find_by_class(
        "MultivariatePolynomialFunction"
    )
    for polynomial in polynomials:
        dimension = polynomial.dimension
        order = polynomial.order
        coefficient_count = len(polynomial.coefficients)
        # The number of monomials of n variables up to order m is (n + m)! / (n! m!). Larger orders
        # would take very long to compute.
        expected_count = (
            comb(dimension + order, order)
            if 0 <= dimension < 100 and 0 <= order < 100
            else coefficient_count
        )
        if coefficient_count != expected_count:
            is_disabled = is_unused(subject, polynomial)
            consequence = UNUSED if is_disabled else "OpenSim fails when it needs a value"
            report(
                f"{subject.describe_part(polynomial)} has {format_count(coefficient_count, 'coefficient')}; "
                f"{format_count(dimension, 'variable')} and order {order} need {expected_count}: {consequence}",
                polynomial,
                consequence=FAILS,
                tag="coefficients",
                severity=WARNING if is_disabled else ERROR,
            )
    for owner, coordinate_count, function in _find_linear_functions(subject):
        # One weight per coordinate; the last coefficient is the constant.
        coefficient_count = len(function.coefficients)
        expected_count = coordinate_count + 1
        if coefficient_count and coefficient_count != expected_count:
            # Measured: of ten runs with no coordinate, three computed NaN.
            is_broken = coefficient_count < expected_count or not coordinate_count
            consequence = (
                "OpenSim reads beyond the end of the list"
                if coefficient_count < expected_count
                else "OpenSim ignores the rest"
                if coordinate_count
                else "OpenSim reads an undefined number"
            )
            report(
                f"the LinearFunction of {describe_object(owner)} has "
                f"{format_count(coefficient_count, 'coefficient')} for "
                f"{format_count(coordinate_count, 'coordinate')}, expected "
                f"{expected_count}; {consequence}",
                function,
                tag="coefficients",
                severity=ERROR if is_broken else None,
            )


@rule("OSIM607", "function-of-several", severity=ERROR, consequences=(RUNS,))
def report_function_of_several(subject: Subject, report: FindingCollector) -> None:
    """A function of one variable is given several coordinates.

    Reports splines, piecewise functions, polynomials, sines and steps that get more than one
    coordinate from an axis of a CustomJoint or from a CoordinateCouplerConstraint. Also reports
    MultivariatePolynomialFunctions whose `dimension` is not the number of coordinates.

    OpenSim gives no message. It mixes values and derivatives of different coordinates, so the
    motion is wrong. A LinearFunction takes any number of coordinates. A
    MultivariatePolynomialFunction takes exactly as many as its `dimension` says.

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
    for owner, coordinate_count, wrapped_function in _find_functions_of_coordinates(subject):
        # Scaling wraps functions in multipliers, maybe several times.
        function = wrapped_function
        while isinstance(function, MultiplierFunction):
            function = function.function
        # Linear functions take any number, which the rule OSIM604 compares.
        dimension = None
        if function is not None and is_a(function, "MultivariatePolynomialFunction"):
            dimension = cast("MultivariatePolynomialFunction", function).dimension
        elif function is not None and any(is_a(function, name) for name in UNIVARIATE_FUNCTIONS):
            dimension = 1
        if function is None or dimension in (None, coordinate_count) or not coordinate_count:
            continue
        report(
            f"the {type(function).tag} of {describe_object(owner)} takes "
            f"{format_count(dimension, 'variable')} but is given "
            f"{format_count(coordinate_count, 'coordinate')}: OpenSim computes wrong values",
            owner,
        )


_REQUIRED_FUNCTIONS: Final = {
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
"""Properties that OpenSim's declarations allow to be empty, and that it needs for computing."""


@rule("OSIM605", "missing-function", severity=ERROR, consequences=(REFUSES, FAILS))
def report_missing_function(subject: Subject, report: FindingCollector) -> None:
    """A required function is missing.

    Reports MultiplierFunctions, CoordinateCouplerConstraints and FunctionBasedPaths without a
    function inside, and empty functions of MovingPathPoints and FunctionBasedBushingForces. A
    PrescribedForce needs either no function or three functions for each of the force, its point and
    the torque; other numbers are reported.

    OpenSim rejects the model, or fails when it needs the value. Scaling a model wraps functions in
    multipliers; deleting the function later leaves an empty multiplier.

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
    for force in subject.find_by_class("PrescribedForce"):
        for name in ("forceFunctions", "pointFunctions", "torqueFunctions"):
            functions = getattr(force, name)
            if isinstance(functions, FunctionSet) and len(functions.objects) not in (0, 3):
                count_text = format_count(len(functions.objects), "function")
                report(
                    f"{name} of {describe_object(force)} has {count_text}, expected three or none: OpenSim "
                    "rejects the file",
                    functions,
                    consequence=REFUSES,
                )
    # An unknown class may be a function that stands where the property seems empty.
    if subject.has_unknown:
        return
    for kind, properties in _REQUIRED_FUNCTIONS.items():
        description, consequence = (
            ("OpenSim rejects the model", REFUSES)
            if len(properties) == 1
            else ("OpenSim fails when it needs a value", FAILS)
        )
        for item in subject.find_by_class(kind):
            for name in properties:
                if getattr(item, name) is None:
                    report(
                        f"{describe_object(item)} has no {name}: {description}",
                        item,
                        tag=name,
                        consequence=consequence,
                    )
    for function in subject.find_instances(MultiplierFunction):
        if function.function is None:
            is_disabled = is_unused(subject, function)
            description = UNUSED if is_disabled else "OpenSim fails when it needs a value"
            report(
                f"{subject.describe_part(function)} has no function to multiply: {description}",
                function,
                consequence=FAILS,
                severity=WARNING if is_disabled else None,
            )


def _find_functions_of_coordinates(
    subject: Subject,
) -> Iterator[tuple[Object, int, Function | None]]:
    """Yield the functions of coordinates: owner, number of coordinates, function."""
    for joint in subject.find_by_class("CustomJoint"):
        # An axis without coordinates takes any function that needs none.
        for axis in list_axes(joint):
            if axis.coordinates:
                yield axis, len(axis.coordinates), axis.function
    for coupler in subject.find_by_class("CoordinateCouplerConstraint"):
        yield (
            coupler,
            len(coupler.independent_coordinate_names),
            coupler.coupled_coordinates_function,
        )


def _find_linear_functions(subject: Subject) -> Iterator[tuple[Object, int, LinearFunction]]:
    """Yield the linear functions of coordinates: owner, number of coordinates, function."""
    for owner, coordinate_count, wrapped_function in _find_functions_of_coordinates(subject):
        function = wrapped_function
        while isinstance(function, MultiplierFunction):
            function = function.function
        # Functions that the upgrade adds have no element, so no author could correct them.
        if isinstance(function, LinearFunction) and (
            function._index is not None or subject.source is None
        ):
            yield owner, coordinate_count, function


UNUSED: Final = "the force or controller is disabled, so OpenSim does not compute this"
"""Consequence, in findings, of a fault in a function of a disabled force or controller."""


def is_unused(subject: Subject, part: Object) -> bool:
    """Return whether OpenSim never computes a part, because its force or controller is disabled.

    A force is disabled if it is not applied. Functions of coordinates and constraints are made with
    the system, even where they are off, and the integrator evaluates each enabled controller, even
    if no actuator does.

    Args:
        subject: model under check.
        part: function, force or controller.
    """
    owner = None if subject.model is None else _find_force_or_controller(subject, part)
    if isinstance(owner, Force):
        return not owner.appliesForce
    return isinstance(owner, Controller) and not owner.enabled


def _find_force_or_controller(subject: Subject, part: Object) -> Force | Controller | None:
    """Return the force or controller that evaluates a function, and that the function belongs to.

    Args:
        subject: model under check.
        part: function of the model; a force or controller is returned itself.

    Returns:
        The nearest force or controller above the part. None for functions of coordinates,
        constraints and paths, which OpenSim makes with the model or its system.
    """
    component: Component | None = subject.owner(part)
    while component is not None and not isinstance(component, Force | Controller):
        # OpenSim makes the functions of such a path as it reads it, whether the force is applied or
        # not.
        component = (
            None if isinstance(component, FunctionBasedPath) else subject.tree.parent_of(component)
        )
    return component


def _describe_refusal(subject: Subject, function: Object) -> tuple[str, Consequence]:
    """Return what OpenSim does with a spline that it cannot make, in words and as declared."""
    if is_unused(subject, function):
        return UNUSED, RUNS
    # Functions of forces and controllers are made at the first acceleration, those of coordinates
    # with the system.
    is_late = _find_force_or_controller(subject, function) is not None
    return (
        ("OpenSim fails when it needs a value", FAILS)
        if is_late
        else ("OpenSim rejects it", REFUSES)
    )


def _find_tabulated(subject: Subject) -> Iterator[TabulatedFunction]:
    """Yield the functions given by points, without those that the reader has added."""
    for name in ("SimmSpline", "GCVSpline", "PiecewiseLinearFunction", "PiecewiseConstantFunction"):
        for function in subject.find_by_class(name):
            # Functions that the reader adds by default have no element in the text.
            if function._index is not None or subject.source is None:
                yield cast("TabulatedFunction", function)
