"""OSIM852 and OSIM853: settings of tools that cannot work, or do not what they seem to."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

from osimlite.lint.diagnostic import Severity
from osimlite.lint.engine import ERROR, INFO, WARNING, Found, rule
from osimlite.lint.setup import UNGIVEN, Setup, is_given, members
from osimlite.lint.words import called, nearest_name
from osimlite.schema.tree import is_a
from osimlite.text import listed

_SETTINGS: tuple[tuple[str, str, Callable[[Any], bool], str, Severity], ...] = (
    ("InverseKinematicsToolBase", "accuracy", lambda value: 0.01 < value < math.inf,
     "the accuracy is {:g}: poses are hardly fitted at all", WARNING),
    ("InverseKinematicsToolBase", "accuracy", lambda value: value == 0.0, "an accuracy of 0 is never reached", WARNING),
    ("AbstractTool", "maximum_number_of_integrator_steps", lambda value: value < 10,
     "the run ends after {} steps", WARNING),
    ("Analysis", "step_interval", lambda value: value < 1, "a step interval of {}", WARNING),
    ("PointKinematics", "point_name", lambda value: not value.strip(),
     "results of a point without a name get no proper file", WARNING),
    ("StaticOptimization", "use_model_force_set", lambda value: not value,
     "without the forces of the model OpenSim crashes", ERROR),
    ("StaticOptimization", "activation_exponent", lambda value: not value > 1.0,
     "an exponent of {:g} leaves nothing to be made small", WARNING),
    ("StaticOptimization", "optimizer_max_iterations", lambda value: value < 10,
     "the optimizer stops after {} iterations", WARNING),
    ("StaticOptimization", "optimizer_convergence_criterion", lambda value: value > 0.05,
     "the optimizer stops at {:g}, far from its goal", WARNING),
)  # fmt: skip
"""Of the objects of a class, a property, whether its value is none to work with, and what is said of it then."""


@rule("OSIM852", "tool-setting", severity=ERROR, mends="unsafe", about="document")
def tool_setting(setup: Setup, found: Found) -> None:
    """A tool has a setting with which it cannot work.

    Looks for accuracies and error tolerances that are not positive or far too large, tools without an analysis,
    analyses with one name, that are off, or whose step is not positive, static optimization without the model's forces,
    without an actuator for the joint to ground, or with an exponent of 1 or less, muscles that are analyzed without
    being in equilibrium, forces that replace those of the model, and forces and
    controllers that are off.

    Some make OpenSim crash or run for ever, some give other results without a word.

    ```setup
      <InverseKinematicsTool name="ik">
          <model_file>leg.osim</model_file>
    -     <accuracy>0.5</accuracy>
    +     <accuracy>1e-5</accuracy>
          <marker_file>leg.trc</marker_file>
          <output_motion_file>ik.mot</output_motion_file>
      </InverseKinematicsTool>
    ```
    """
    for of_class, tag, is_wrong, told, severity in _SETTINGS:
        for item in setup.named(of_class):
            value = getattr(item, tag)
            if is_wrong(value):
                found(told.format(value), item, tag=tag, severity=severity)
    for tool in setup.named("AbstractTool"):
        if not (tool.integrator_error_tolerance > 0.0 or is_a(tool, "AnalyzeTool")):
            found(
                f"an error tolerance of {tool.integrator_error_tolerance:g} is never met: OpenSim runs for ever",
                tool, tag="integrator_error_tolerance", severity=None if is_a(tool, "ForwardTool") else WARNING,
            )  # fmt: skip
        if is_a(tool, "RRATool") and not tool.force_set_files:
            found(
                f"{called(tool)} is given no forces that it could control: OpenSim fails", tool, tag="force_set_files"
            )
        if tool.replace_force_set and not is_a(tool, "RRATool"):
            found(
                "the forces of force_set_files replace those of the model: its muscles are gone",
                tool, tag="replace_force_set", severity=WARNING,
            )  # fmt: skip
        if is_a(tool, "RRATool") and not tool.replace_force_set and setup.names_of("Muscle"):
            found(
                "the muscles of the model are left in it, and OpenSim crashes: the forces of force_set_files are to "
                "replace them",
                tool, tag="replace_force_set",
            )  # fmt: skip
        if is_a(tool, "RRATool") and tool.adjust_com_to_reduce_residuals and not str(tool.adjusted_com_body).strip():
            found(
                f"{called(tool)} is to move a center of mass, and adjusted_com_body names no body: OpenSim refuses it",
                tool, tag="adjusted_com_body",
            )  # fmt: skip
        if is_a(tool, "AnalyzeTool") and not tool.analysis_set.objects:
            found(f"{called(tool)} has no analysis: OpenSim refuses it", tool)
    names = Counter(item.name for item in setup.named("Analysis"))
    for analysis in setup.named("Analysis"):
        if not analysis.on:
            found(f"{called(analysis)} is off", analysis, tag="on", severity=INFO)
        if names[analysis.name] > 1:
            names[analysis.name] = 0
            found(
                f"two analyses are called '{analysis.name}', and write to the same files", analysis, attribute="name",
                severity=WARNING,
            )  # fmt: skip
        if is_a(analysis, "StaticOptimization"):
            carrying = _carried_by_none(setup)
            if carrying:
                found(
                    f"no actuator moves {listed(carrying)}: without residual actuators the optimizer fails", analysis,
                    severity=WARNING,
                )  # fmt: skip
        for tag, what in (("bodies", "body"), ("coordinates", "coordinate")):
            if getattr(analysis, tag, None) == ():
                found(f"{called(analysis)} names no {what}: nothing is written", analysis, tag=tag, severity=WARNING)
        if is_a(analysis, "MuscleAnalysis") and analysis.on:
            for tool in setup.named("AnalyzeTool"):
                if is_given(tool.coordinates_file) and not tool.solve_for_equilibrium_for_auxiliary_states:
                    found(
                        "coordinates tell nothing of fibers, which stay at their default lengths: "
                        "solve_for_equilibrium_for_auxiliary_states is false",
                        tool, tag="solve_for_equilibrium_for_auxiliary_states", severity=WARNING,
                    )  # fmt: skip
        if is_a(analysis, "MuscleAnalysis") and not analysis.moment_arm_coordinate_list:
            found("no coordinate for moment arms: OpenSim fails", analysis, tag="moment_arm_coordinate_list")
        if is_a(analysis, "JointReaction"):
            for word in analysis.apply_on_bodies:
                if word.lower() not in ("child", "parent"):
                    found(
                        f"'{word}' is neither child nor parent: OpenSim refuses it", analysis, tag="apply_on_bodies",
                        word=word, suggestion=nearest_name(word, ["child", "parent"]),
                    )  # fmt: skip
            if len(analysis.apply_on_bodies) not in (0, 1, len(analysis.joint_names)):
                found(
                    f"{len(analysis.apply_on_bodies)} words for {len(analysis.joint_names)} joints: OpenSim refuses it",
                    analysis, tag="apply_on_bodies",
                )  # fmt: skip
    user = setup.tool[1] if setup.tool is not None else None
    if setup.tree is not None and getattr(user, "replace_force_set", True) is False:
        present = {force.name for force in setup.tree.model.force_set.objects}
        for force in (force for forces in setup.named("ForceSet") for force in forces.objects):
            if force.name in present:
                found(
                    f"the model has a force '{force.name}' already, whose place this one takes", force,
                    attribute="name", severity=WARNING,
                )  # fmt: skip
    for forces in setup.named("ForceSet"):
        for force in members(forces, "Force"):
            if not force.appliesForce:
                found(f"{called(force)} does not act", force, tag="appliesForce", severity=INFO)
    for controller in setup.named("Controller") if setup.tool is not None else ():
        if not controller.enabled:
            found(f"{called(controller)} is off", controller, tag="enabled", severity=INFO)


def _carried_by_none(setup: Setup) -> list[str]:
    """The free coordinates of joints to ground, if nothing but paths between bodies acts in the model."""
    if setup.tree is None or not setup.tree.of_class("Actuator"):
        return []
    files = setup.having("force_set_files")
    if any(len(tool.force_set_files) > len(setup.added) for tool in files):
        return []
    added = [force for _, top in setup.added for force in top.walk() if is_a(force, "Actuator")]
    if any(not is_a(force, "PathActuator") for force in (*setup.tree.of_class("Actuator").values(), *added)):
        return []
    parts: list[Any] = setup.tree.components
    if any(is_a(part, "AbstractPathPoint") and str(part.socket_parent_frame) == "/ground" for part in parts):
        return []
    joints: Any = setup.tree.of_class("Joint").values()
    on_ground = (joint for joint in joints if str(joint.socket_parent_frame).rpartition("/")[2].startswith("ground"))
    return [item.name for joint in on_ground for item in joint.coordinates if not setup.is_bound(item.name)]


@rule("OSIM853", "scale-setting", severity=ERROR, mends="both", about="document")
def scale_setting(setup: Setup, found: Found) -> None:
    """A setting of the scale tool has no effect, or makes it fail.

    Looks at the order of scaling, at measurements without a pair of two different markers, at axes other than X, Y and
    Z, at the mass, at steps that are left out, and at the times that are averaged.

    A measurement with one marker makes OpenSim crash. What it does not know in `axes` it leaves out without a word, and
    the body keeps its size.

    ```setup
      <MeasurementSet name="measurements">
          <objects>
              <Measurement name="thigh">
                  <MarkerPairSet name="pairs">
    -                 <objects> <MarkerPair name="first"> <markers>asis</markers> </MarkerPair> </objects>
    +                 <objects> <MarkerPair name="first"> <markers>asis knee_marker</markers> </MarkerPair> </objects>
                  </MarkerPairSet>
              </Measurement>
          </objects>
      </MeasurementSet>
    ```
    """
    for tool in setup.named("ScaleTool"):
        scaler = tool.model_scaler
        if tool.mass == 0.0 or (tool.mass < 0.0 and scaler.apply and scaler.preserve_mass_distribution):
            found(f"a mass of {tool.mass:g}: OpenSim leaves the mass as it is", tool, tag="mass", severity=WARNING)
    for scaler in setup.named("ModelScaler"):
        if not scaler.apply:
            found("the model is not scaled", scaler, tag="apply", severity=WARNING)
            continue
        for word in scaler.scaling_order:
            if word not in ("measurements", "manualScale"):
                found(
                    f"'{word}' is no way of scaling: OpenSim refuses it", scaler, tag="scaling_order", word=word,
                    suggestion=nearest_name(word, ["measurements", "manualScale"]),
                )  # fmt: skip
        measures = "measurements" in scaler.scaling_order
        if scaler.scaling_order[:1] == ("manualScale",) and measures:
            found(
                "measurements come last and overwrite what is scaled by hand", scaler, tag="scaling_order",
                severity=WARNING,
            )  # fmt: skip
        if measures and scaler.measurement_set.objects and not is_given(scaler.marker_file):
            found(
                f"{called(scaler)} measures, and names no marker_file: {UNGIVEN}", scaler, tag="marker_file",
                severity=WARNING,
            )  # fmt: skip
    for measurement in setup.named("Measurement"):
        if not measurement.apply:
            continue
        pairs = members(measurement.marker_pair_set, "MarkerPair")
        if not pairs:
            found(f"{called(measurement)} has no pair of markers: it measures nothing", measurement, severity=WARNING)
        for pair in pairs:
            if len(pair.markers) != 2:
                found(f"a pair has two markers, this one {len(pair.markers)}: OpenSim crashes", pair, tag="markers")
            elif pair.markers[0] == pair.markers[1]:
                found(
                    f"both markers of a pair are '{pair.markers[0]}': OpenSim leaves {called(measurement)} out", pair,
                    tag="markers", severity=WARNING,
                )  # fmt: skip
    for scale in setup.named("BodyScale"):
        for axis in scale.axes:
            if axis not in ("X", "Y", "Z"):
                found(
                    f"'{axis}' is none of the axes X, Y and Z: OpenSim leaves it out", scale, tag="axes", word=axis,
                    suggestion=axis.upper() if axis.upper() in ("X", "Y", "Z") else None,
                )  # fmt: skip
    for placer in setup.named("MarkerPlacer"):
        if not placer.apply:
            found("the markers are not placed, and the tool says that it failed", placer, tag="apply", severity=WARNING)
        elif not is_given(placer.output_model_file):
            found("the model with its markers placed is not written", placer, tag="output_model_file", severity=WARNING)
        if placer.apply and placer.time_range and not placer.time_range[0] < placer.time_range[-1]:
            found(
                f"times from {placer.time_range[0]:g} to {placer.time_range[-1]:g} s cannot be averaged: OpenSim fails",
                placer, tag="time_range",
            )  # fmt: skip
