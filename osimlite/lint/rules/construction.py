"""OSIM42x and OSIM53x: obstacles to the computation of a model."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

from osimlite.base.patterns import compile_later
from osimlite.base.text import append_clause, format_count
from osimlite.errors import ModelError
from osimlite.lint.construction import CONSTRUCTION, Obstacle, Stage, obstacles_of
from osimlite.lint.diagnostic import Severity
from osimlite.lint.registry import ERROR, FAILS, INFO, NAN, REFUSES, WARNING, FindingCollector, rule
from osimlite.lint.rules.functions import is_unused
from osimlite.lint.subject import Subject
from osimlite.schema.base import Unknown
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.function_types import ExpressionBasedFunction
from osimlite.schema.prescribed import PrescribedForce
from osimlite.schema.registry import get_plugin_classes

_QUOTED = compile_later(r"'([^']+)'")


@rule(
    "OSIM421",
    "impossible-mechanism",
    severity=ERROR,
    about=CONSTRUCTION,
    consequences=(REFUSES, NAN),
)
def report_impossible_mechanism(subject: Subject, report: FindingCollector) -> None:
    """The bodies, joints and constraints of a model do not form a mechanism.

    Builds the mechanism as `osimlite simulate` does. Reports each joint, frame, function or
    constraint that cannot be computed, unless another rule has reported its cause.

    OpenSim rejects such a model, or computes with undefined values. The commands of osimlite that
    compute with a model reject it.

    ```xml
      <Coordinate name="knee_angle">
          <prescribed>true</prescribed>
          <prescribed_function>
    -         <PiecewiseLinearFunction> <x>0 0 1</x> <y>0 -0.1 -0.5</y> </PiecewiseLinearFunction>
    +         <PiecewiseLinearFunction> <x>0 0.5 1</x> <y>0 -0.1 -0.5</y> </PiecewiseLinearFunction>
          </prescribed_function>
      </Coordinate>
    ```
    """
    for obstacle in _select_unreported(subject, report, Stage.MECHANISM):
        _report_obstacle(subject, report, obstacle, obstacle.message)


@rule("OSIM422", "unmet-constraint", severity=ERROR, about=CONSTRUCTION, consequences=(FAILS,))
def report_unmet_constraint(subject: Subject, report: FindingCollector) -> None:
    """No pose of the model fulfils a constraint.

    Assembles the default pose: searches for the nearest pose that fulfils all constraints. Reports
    each constraint that is still not fulfilled, with its remaining error (m, or rad for constraints
    of angles).

    OpenSim logs that it cannot assemble the model, and relaxes the constraints; its integrator then
    fails to start. Usual causes are a length in millimetres, a constraint with both ends on one
    body, and a constraint between two coordinates that are locked or prescribed.

    ```xml
      <ConstantDistanceConstraint name="rod">
          <socket_body_1>/bodyset/thigh</socket_body_1>
          <socket_body_2>/bodyset/shank</socket_body_2>
    -     <constant_distance>40</constant_distance>
    +     <constant_distance>0.4</constant_distance>
      </ConstantDistanceConstraint>
    ```
    """
    for obstacle in _select_unreported(subject, report, Stage.ASSEMBLY):
        _report_obstacle(
            subject,
            report,
            obstacle,
            append_clause(obstacle.message, "OpenSim cannot start a simulation from this pose"),
        )


@rule("OSIM423", "range-not-kept", severity=WARNING, about=CONSTRUCTION)
def report_range_not_kept(subject: Subject, report: FindingCollector) -> None:
    """A clamped coordinate leaves its range in the default pose.

    Assembles the default pose. Reports clamped coordinates that leave their range because of a
    constraint, or because of their prescribed function.

    If a constraint is the cause, OpenSim logs an error; if a function is the cause, it logs
    nothing. In both cases OpenSim simulates, and the clamp has no effect. Widen the range, or
    correct the constraint or the function.

    ```xml
      <Coordinate name="knee_angle">
          <range>-2.1 0</range>
          <clamped>true</clamped>
          <prescribed>true</prescribed>
    -     <prescribed_function> <Constant> <value>0.5</value> </Constant> </prescribed_function>
    +     <prescribed_function> <Constant> <value>-0.5</value> </Constant> </prescribed_function>
      </Coordinate>
    ```
    """
    for obstacle in _select_unreported(subject, report, Stage.CLAMP):
        _report_obstacle(
            subject,
            report,
            obstacle,
            append_clause(obstacle.message, "OpenSim simulates without the clamp"),
        )


@rule("OSIM424", "singular-mass-matrix", severity=ERROR, about=CONSTRUCTION, consequences=(NAN,))
def report_singular_mass_matrix(subject: Subject, report: FindingCollector) -> None:
    """A coordinate moves no mass in the default pose.

    Computes the accelerations in the default pose, and reports a coordinate that moves no mass.
    Either no body beyond its joint has mass, or its axis coincides with the axis of another
    coordinate, and the body between them has no mass.

    The mass matrix has no inverse. OpenSim gives no message: every acceleration is NaN, or a
    meaningless number that depends on rounding errors.

    ```xml
    - <Body name="shank"> <mass>0</mass> </Body>
    + <Body name="shank"> <mass>3</mass> <inertia>0.05 0.05 0.005 0 0 0</inertia> </Body>
      <Body name="foot"> <mass>1</mass> <inertia>0.01 0.01 0.01 0 0 0</inertia> </Body>
      <PinJoint name="ankle">
          <socket_parent_frame>shank_ankle</socket_parent_frame>
          <socket_child_frame>/bodyset/foot</socket_child_frame>
          <coordinates> <Coordinate name="ankle_angle" /> </coordinates>
          <frames>
              <PhysicalOffsetFrame name="shank_ankle">
                  <socket_parent>/bodyset/shank</socket_parent> <translation>0 0.2 0</translation>
              </PhysicalOffsetFrame>
          </frames>
      </PinJoint>
    ```
    """
    if _has_error(report, "2456"):
        return
    for obstacle in _select_unreported(subject, report, Stage.INERTIA):
        message = append_clause(
            obstacle.message, "OpenSim computes NaN, or meaningless accelerations", separator=":"
        )
        _report_obstacle(subject, report, obstacle, message)


@rule(
    "OSIM531", "impossible-force", severity=ERROR, about=CONSTRUCTION, consequences=(REFUSES, FAILS)
)
def report_impossible_force(subject: Subject, report: FindingCollector) -> None:
    """A force, a controller or a probe cannot be computed.

    Builds all forces, controllers and probes as `osimlite simulate` does. Reports those that cannot
    be built, unless another rule has reported the cause. The finding is a warning if OpenSim can
    compute the component: it is disabled, or has a number that OSIM207 reports.

    OpenSim rejects such a model when it builds the system, or fails when it needs the force. The
    commands of osimlite that compute with a model reject it.

    ```xml
      <ComponentSet>
          <objects>
              <Station name="sole"> <socket_parent_frame>/bodyset/shank</socket_parent_frame> </Station>
          </objects>
      </ComponentSet>
      <MeyerFregly2016Force name="contact">
          <socket_station>/componentset/sole</socket_station>
    -     <stiffness>0.1</stiffness>
    +     <stiffness>10000</stiffness>
      </MeyerFregly2016Force>
    ```
    """
    doubtful = {item.component for item in report.findings if item.code == "OSIM207"}
    for obstacle in _select_unreported(subject, report, Stage.FORCE):
        item = subject.tree.by_path.get(obstacle.path)
        if obstacle.path in doubtful:
            message = f"OpenSim accepts this number, osimlite does not: {obstacle.message}"
            _report_obstacle(subject, report, obstacle, message, severity=WARNING)
        elif item is not None and is_unused(subject, item):
            # OpenSim never asks a force that is disabled; osimlite makes it for its states.
            message = f"osimlite cannot compute this, OpenSim can: {obstacle.message}"
            _report_obstacle(subject, report, obstacle, message, severity=WARNING)
        else:
            _report_obstacle(subject, report, obstacle, obstacle.message)


@rule("OSIM532", "no-acceleration", severity=ERROR, about=CONSTRUCTION, consequences=(NAN,))
def report_no_acceleration(subject: Subject, report: FindingCollector) -> None:
    """The accelerations of a model are not finite in the default pose.

    Computes the accelerations in the default pose, and reports the forces that make them NaN or
    infinite. The finding is a warning if only the rate of a muscle state is not finite, which can
    happen before the muscle is put into equilibrium.

    OpenSim gives no message: every acceleration is NaN from the start, and so is the motion.

    ```xml
      <ExpressionBasedCoordinateForce name="spring">
          <coordinate>hip_flexion</coordinate>
    -     <expression>-1/q</expression>
    +     <expression>-1/(q+1)</expression>
      </ExpressionBasedCoordinateForce>
    ```
    """
    for obstacle in _select_unreported(subject, report, Stage.ACCELERATION):
        if obstacle.path or not _has_error(report, "2456"):
            _report_obstacle(subject, report, obstacle, obstacle.message)
    for obstacle in _select_unreported(subject, report, Stage.RATE):
        _report_obstacle(subject, report, obstacle, obstacle.message, severity=WARNING)
    for function in _find_undefined_formulas(subject):
        report(
            f"expression of {subject.describe_part(function)} is '{function.expression}', which is "
            "not a finite number at 0 s: every acceleration is NaN or infinite",
            function,
            tag="expression",
        )


def _find_undefined_formulas(subject: Subject) -> Iterator[ExpressionBasedFunction]:
    """Yield the formulas of time, of prescribed forces and controls, that are infinite or undefined at 0 s.

    Simulations do not compute them, so that evaluating the accelerations does not find them.
    """
    for function in subject.find_instances(ExpressionBasedFunction):
        owner = subject.owner(function)
        is_of_time = isinstance(owner, PrescribedForce | PrescribedController)
        if not is_of_time or len(function.variables) != 1 or is_unused(subject, function):
            continue
        # Reading formulas takes the kernels, and few models have them.
        from osimlite.mechanics.multibody.formula import Formula

        try:
            Formula.parse(function.expression, function.variables, "it")
        except ModelError:
            # Another rule reports what cannot be read.
            continue
        at_zero = f"{function.expression};{function.variables[0]}=0"
        try:
            *_, last = Formula.parse(at_zero, (), "it").steps
            if last.law == "number" and not isfinite(last.value):
                yield function
        except ModelError:
            # A part such as 0/0 is not a number.
            yield function


@rule("OSIM533", "not-computed", severity=INFO, about=CONSTRUCTION)
def report_not_computed(subject: Subject, report: FindingCollector) -> None:
    """OpenSim runs a component that osimlite cannot compute.

    Reports joints, constraints, forces and controllers of OpenSim's own classes with which
    `osimlite simulate` and similar commands cannot compute. Only the first component of each class
    is reported, with the number of the others.

    The model is correct. But commands that compute with the model reject it. With the option
    `--skip-unsupported` they leave the component out instead.

    ```xml
      <Coordinate name="knee_angle">
          <prescribed>true</prescribed>
          <prescribed_function>
    -         <ExpressionBasedFunction>
    -             <variables>t</variables> <expression>-0.2*t</expression>
    -         </ExpressionBasedFunction>
    +         <LinearFunction> <coefficients>-0.2 0</coefficients> </LinearFunction>
          </prescribed_function>
      </Coordinate>
    ```
    """
    groups: dict[object, list[Obstacle]] = {}
    for obstacle in _select_unreported(subject, report, Stage.UNSUPPORTED):
        item = subject.tree.by_path.get(obstacle.path)
        # Users who declare the classes of a plug-in know them.
        if isinstance(item, Unknown) or (
            item is not None and type(item).tag in get_plugin_classes()
        ):
            continue
        groups.setdefault(type(item), []).append(obstacle)
    for first, *similar in groups.values():
        similar_note = (
            f"; the same for {format_count(len(similar), 'more component')} of its class"
            if similar
            else ""
        )
        component = subject.tree.by_path.get(first.path)
        reason = first.message.partition(";")[0]
        if component is not None and reason.startswith(f"'{first.path}' ("):
            # Forces are named with their class, and why it cannot be computed.
            reason = reason.removeprefix(f"'{first.path}' (").removesuffix(")")
            reason = f"'{component.name}', a {reason}"
        message = f"osimlite cannot compute this, OpenSim can: {reason}{similar_note}"
        _report_obstacle(subject, report, first, message)


@rule("OSIM534", "impassable-obstacle", severity=ERROR, about=CONSTRUCTION, consequences=(REFUSES,))
def report_impassable_obstacle(subject: Subject, report: FindingCollector) -> None:
    """A path cannot wrap over an obstacle.

    Reports three faults of paths over obstacles (Scholz2015GeometryPath). First, a point of the
    path or another obstacle is inside an obstacle in the default pose, before or after assembly.
    Second, an obstacle is a ContactMesh. Third, the search for the path fails because a
    `contact_hint` is in the middle of the surface or unsuitable.

    OpenSim computes the path when it initialises the system, and then rejects the model. A
    GeometryPath, in contrast, goes straight through a surface that contains one of its points
    (OSIM616).

    ```xml
      <PathSpring name="cable">
          <Scholz2015GeometryPath name="path">
              <path_elements>
                  <Scholz2015GeometryPathPoint name="a">
                      <PathPoint name="start">
                          <socket_parent_frame>/bodyset/shank</socket_parent_frame> <location>0.1 0 0</location>
                      </PathPoint>
                  </Scholz2015GeometryPathPoint>
                  <Scholz2015GeometryPathObstacle name="over">
                      <socket_contact_geometry>/contactgeometryset/heel</socket_contact_geometry>
                  </Scholz2015GeometryPathObstacle>
                  <Scholz2015GeometryPathPoint name="b">
                      <PathPoint name="end">
                          <socket_parent_frame>/bodyset/shank</socket_parent_frame>
    -                     <location>0.04 -0.2 0</location>
    +                     <location>0.06 -0.2 0</location>
                      </PathPoint>
                  </Scholz2015GeometryPathPoint>
              </path_elements>
          </Scholz2015GeometryPath>
          <resting_length>0.1</resting_length> <stiffness>100</stiffness> <dissipation>0</dissipation>
      </PathSpring>
    ```
    """
    for obstacle in _select_unreported(subject, report, Stage.CABLE):
        _report_obstacle(
            subject,
            report,
            obstacle,
            append_clause(obstacle.message, "OpenSim rejects the model", separator=":"),
        )


def _select_unreported(
    subject: Subject, report: FindingCollector, stage: Stage
) -> Iterator[Obstacle]:
    """Yield the obstacles of a stage whose cause no other rule has reported."""
    errors = [finding for finding in report.findings if finding.severity == ERROR]
    if stage == Stage.ACCELERATION:
        # An element that OpenSim ignores does not make what it computes NaN.
        errors = [finding for finding in errors if not finding.code.startswith("OSIM10")]
    reported_paths = {finding.component for finding in errors if finding.component}
    # A file that is missing stops what needs it.
    causes = [
        *errors,
        *(finding for finding in report.findings if finding.code.startswith("OSIM7")),
    ]
    reported_names = {word for finding in causes for word in _QUOTED.findall(finding.message)}
    for obstacle in obstacles_of(subject, stage):
        quoted_names = {word.strip("/") for word in _QUOTED.findall(obstacle.message)}
        if quoted_names & reported_names or any(
            _is_related(obstacle.path, reported_path) for reported_path in reported_paths
        ):
            continue
        if not obstacle.path and errors:
            continue
        yield obstacle


def _is_related(path: str, other_path: str) -> bool:
    """Return whether two components are the same, or one is a part of the other, but not of the model."""
    if not path or other_path == "/":
        return False
    return (
        path == other_path or other_path.startswith(f"{path}/") or path.startswith(f"{other_path}/")
    )


def _has_error(report: FindingCollector, families: str) -> bool:
    return any(item.severity == ERROR and item.code[4] in families for item in report.findings)


def _report_obstacle(
    subject: Subject,
    report: FindingCollector,
    obstacle: Obstacle,
    message: str,
    severity: Severity | None = None,
) -> None:
    item = subject.tree.by_path.get(obstacle.path, subject.model)
    report(
        message.replace("; 'osimlite validate' lists every such place", ""), item, severity=severity
    )
