"""OSIM852: settings of tools that make them fail, or have an unexpected effect."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

from osimlite.base.text import format_count, join_words
from osimlite.lint.registry import ERROR, WARNING, FindingCollector, rule
from osimlite.lint.setup import Setup, names_file, select_members
from osimlite.lint.words import describe_object, find_nearest_name
from osimlite.schema.tree import is_a

_SETTINGS: tuple[tuple[str, str, str, Callable[[Any], bool], str], ...] = (
    ("pose-accuracy", "InverseKinematicsToolBase", "accuracy", lambda value: 0.01 < value < math.inf,
     "the accuracy is {:g}: poses are barely fitted"),
    ("pose-accuracy", "InverseKinematicsToolBase", "accuracy", lambda value: value == 0.0,
     "an accuracy of 0 is never reached"),
    ("few-integrator-steps", "AbstractTool", "maximum_number_of_integrator_steps", lambda value: value < 10,
     "OpenSim does not apply this limit: the run does not end after {} steps"),
    ("step-interval", "Analysis", "step_interval", lambda value: value < 1, "step_interval is {}, expected 1 or more"),
    ("unnamed-point", "PointKinematics", "point_name", lambda value: not value.strip(),
     "results of a point without a name get no proper file name"),
    ("without-model-forces", "StaticOptimization", "use_model_force_set", lambda value: not value,
     "without the forces of the model OpenSim crashes"),
    ("activation-exponent", "StaticOptimization", "activation_exponent", lambda value: not value > 1.0,
     "with an exponent of {:g} the sum of activations has no unique minimum"),
    ("few-optimizer-iterations", "StaticOptimization", "optimizer_max_iterations", lambda value: value < 10,
     "the optimizer stops after {} iterations"),
    ("loose-optimizer-convergence", "StaticOptimization", "optimizer_convergence_criterion", lambda value: value > 0.05,
     "the optimizer stops at a convergence criterion of {:g}, far from the optimum"),
)  # fmt: skip
"""Name, class, property, test for invalid values, and message of each fault."""


def _make_tool_example(kind: str, *lines: str, model: str = "leg.osim") -> str:
    content = "".join(f"    {line}\n" for line in (f"<model_file>{model}</model_file>", *lines))
    return f'```setup\n<{kind} name="run">\n{content}</{kind}>\n```'


def _make_analysis_example(start: str, end: str = "", model: str = "leg.osim") -> str:
    content = f"{start}\n                {{}}\n            {end}" if end else "{}"
    objects = f"        <objects>\n            {content}\n        </objects>"
    analyses = f'<AnalysisSet name="analyses">\n{objects}\n    </AnalysisSet>'
    equilibrium_setting = "<solve_for_equilibrium_for_auxiliary_states>true</solve_for_equilibrium_for_auxiliary_states>"
    return _make_tool_example(
        "AnalyzeTool",
        "<coordinates_file>leg.mot</coordinates_file>",
        equilibrium_setting,
        analyses,
        model=model,
    )


_TRACKING = (
    "<initial_time>0</initial_time>", "<final_time>0.5</final_time>",
    "<desired_kinematics_file>leg.mot</desired_kinematics_file>", "<task_set_file>tasks.xml</task_set_file>",
)  # fmt: skip
_MARKERS = "<marker_file>leg.trc</marker_file>", "<output_motion_file>ik.mot</output_motion_file>"
FRAMES = {
    "ik": _make_tool_example("InverseKinematicsTool", "{}", *_MARKERS),
    "forward": _make_tool_example("ForwardTool", "{}"),
    "rra": _make_tool_example("RRATool", *_TRACKING, "{}", model="muscle.osim"),
    "analyze": _make_tool_example(
        "AnalyzeTool", "<coordinates_file>leg.mot</coordinates_file>", "{}"
    ),
    "analyses": _make_analysis_example("", model="muscle.osim"),
    "actuators": _make_tool_example(
        "AnalyzeTool",
        "<coordinates_file>leg.mot</coordinates_file>",
        "{}",
        '<AnalysisSet name="analyses"> <objects> <StaticOptimization name="optimization"/> </objects> </AnalysisSet>',
        model="muscle.osim",
    ),
    "optimization": _make_analysis_example(
        '<StaticOptimization name="optimization">', "</StaticOptimization>"
    ),
    "kinematics": _make_analysis_example('<Kinematics name="kinematics">', "</Kinematics>"),
    "point": _make_analysis_example(
        '<PointKinematics name="point"> <body_name>shank</body_name>', "</PointKinematics>"
    ),
    "muscles": _make_analysis_example('<MuscleAnalysis name="muscles">', "</MuscleAnalysis>"),
    "reaction": _make_analysis_example(
        '<JointReaction name="loads"> <joint_names>hip knee</joint_names>', "</JointReaction>"
    ),
    "forces": '```setup\n<ForceSet name="forces">\n    <objects>\n        {}\n    </objects>\n</ForceSet>\n```',
}
"""Documents around the lines of the examples of OSIM852."""


_FAULTS = """\
01 pose-accuracy, warning, in ik: The accuracy of inverse kinematics is above 0.01, or 0. Poses are barely fitted, or
the search does not end.
- <accuracy>0.5</accuracy>
+ <accuracy>1e-5</accuracy>
02 few-integrator-steps, warning, in forward: A tool may take fewer than 10 steps. OpenSim 4.6 does not apply this limit;
the run ends at its final time.
- <maximum_number_of_integrator_steps>5</maximum_number_of_integrator_steps>
+ <maximum_number_of_integrator_steps>5000</maximum_number_of_integrator_steps>
03 step-interval, warning, in kinematics: A step interval is below 1. It is the number of steps between two rows.
- <step_interval>0</step_interval>
+ <step_interval>1</step_interval>
04 unnamed-point, warning, in point: A PointKinematics analysis has no name for its point. The files of the
results are named after it.
- <point_name></point_name>
+ <point_name>heel</point_name>
05 without-model-forces, error, in optimization: The forces of the model are excluded. OpenSim crashes.
- <use_model_force_set>false</use_model_force_set>
+ <use_model_force_set>true</use_model_force_set>
06 activation-exponent, warning, in optimization: The exponent of activations is 1 or less. The sum of activations then has no
unique minimum.
- <activation_exponent>1</activation_exponent>
+ <activation_exponent>2</activation_exponent>
07 few-optimizer-iterations, warning, in optimization: The optimizer may use fewer than 10 iterations. It stops too early.
- <optimizer_max_iterations>5</optimizer_max_iterations>
+ <optimizer_max_iterations>100</optimizer_max_iterations>
08 loose-optimizer-convergence, warning, in optimization: The optimizer may stop far from the optimum. With a criterion
above 0.05 activations are hardly optimized.
- <optimizer_convergence_criterion>0.5</optimizer_convergence_criterion>
+ <optimizer_convergence_criterion>1e-4</optimizer_convergence_criterion>
09 integrator-error-tolerance, error, in forward: The error tolerance of the integrator is not positive. It is never
met, and OpenSim runs forever.
- <integrator_error_tolerance>0</integrator_error_tolerance>
+ <integrator_error_tolerance>1e-5</integrator_error_tolerance>
10 no-residual-forces, error, in rra: Residual reduction has no forces. It controls the forces of force_set_files, and
fails without them.
  <replace_force_set>true</replace_force_set>
+ <force_set_files>residuals.xml</force_set_files>
11 replaced-forces, warning, in analyze: The forces of the model are replaced. The model then has no muscles, and the
results belong to another model.
- <replace_force_set>true</replace_force_set>
+ <replace_force_set>false</replace_force_set>
  <AnalysisSet name="analyses"> <objects> <Kinematics name="kinematics"/> </objects> </AnalysisSet>
12 muscles-left-in-model, error, in rra: Residual reduction leaves the muscles in the model. OpenSim crashes.
  <force_set_files>residuals.xml</force_set_files>
- <replace_force_set>false</replace_force_set>
+ <replace_force_set>true</replace_force_set>
13 no-adjusted-body, error, in rra: A center of mass is adjusted without a body. OpenSim rejects the setup.
  <force_set_files>residuals.xml</force_set_files> <replace_force_set>true</replace_force_set>
  <adjust_com_to_reduce_residuals>true</adjust_com_to_reduce_residuals>
  <output_model_file>adjusted.osim</output_model_file>
+ <adjusted_com_body>thigh</adjusted_com_body>
14 no-analysis, error, in analyze: An analyze tool has no analysis. OpenSim rejects it.
+ <AnalysisSet name="analyses"> <objects> <Kinematics name="kinematics"/> </objects> </AnalysisSet>
15 analysis-off, info, in kinematics: An analysis is disabled. It writes nothing.
- <on>false</on>
16 analyses-of-one-name, warning, in analyses: Two analyses have one name. They write to the same files.
- <Kinematics name="run"/> <Kinematics name="run"/>
+ <Kinematics name="run"/> <Kinematics name="again"/>
17 unactuated-root, warning, in actuators: No actuator moves the coordinates between the model and ground. Static
optimization fails without residual actuators.
- <force_set_files></force_set_files>
+ <force_set_files>residuals.xml</force_set_files>
18 nothing-analyzed, warning, in kinematics: An analysis names no body or coordinate. Nothing is written.
- <coordinates></coordinates>
+ <coordinates>all</coordinates>
19 fibers-not-in-equilibrium, warning, in analyze: Muscles are analyzed without being put into equilibrium. Fibers keep
their default lengths, whatever the coordinates are.
  <AnalysisSet name="analyses"> <objects> <MuscleAnalysis name="muscles"/> </objects> </AnalysisSet>
- <solve_for_equilibrium_for_auxiliary_states>false</solve_for_equilibrium_for_auxiliary_states>
+ <solve_for_equilibrium_for_auxiliary_states>true</solve_for_equilibrium_for_auxiliary_states>
20 no-moment-arm-coordinate, error, in muscles: A muscle analysis names no coordinate for moment arms. OpenSim fails.
- <moment_arm_coordinate_list></moment_arm_coordinate_list>
+ <moment_arm_coordinate_list>all</moment_arm_coordinate_list>
21 reaction-on-neither, error, fix unsafe, in reaction: A joint reaction is requested on neither child nor parent.
OpenSim knows these two words only, and rejects others.
- <apply_on_bodies>childs</apply_on_bodies>
+ <apply_on_bodies>child</apply_on_bodies>
22 reaction-count, error, in reaction: The words in apply_on_bodies differ in number from the joints. OpenSim accepts
no word, one word for all joints, or one word for each joint, and rejects other numbers.
- <apply_on_bodies>child parent child</apply_on_bodies>
+ <apply_on_bodies>child parent</apply_on_bodies>
23 force-of-one-name, warning, in forces: A force that a tool adds has the name of a force of the model. The added force replaces
the force of the model.
- <CoordinateActuator name="knee_limit"> <coordinate>knee_angle</coordinate> </CoordinateActuator>
+ <CoordinateActuator name="reserve"> <coordinate>knee_angle</coordinate> </CoordinateActuator>
24 force-off, info, in forces: A force of a set is disabled. It does not act.
  <CoordinateActuator name="reserve">
- <appliesForce>false</appliesForce>
  <coordinate>knee_angle</coordinate> </CoordinateActuator>
25 controller-off, info, in forward: A controller of a tool is disabled. Its actuators have no control.
  <ControllerSet name="controllers"> <objects>
- <ControlSetController name="controls"> <enabled>false</enabled> </ControlSetController>
  </objects> </ControllerSet>
"""


@rule("OSIM852", "tool-setting", severity=ERROR, about="document", faults=_FAULTS, frames=FRAMES)
def report_tool_setting(setup: Setup, report: FindingCollector) -> None:
    """A tool has a setting that makes it fail or has no effect.

    Checks accuracies and tolerances, steps, analyses, excluded or replaced forces, and disabled
    parts.

    Some of these settings make OpenSim crash or run forever. Others give wrong results without a
    message.
    """
    # 1. Settings that one comparison decides.
    for fault, of_class, tag, is_wrong, message in _SETTINGS:
        for item in setup.find_by_class(of_class):
            value = getattr(item, tag)
            if is_wrong(value):
                report(message.format(value), item, fault=fault, tag=tag)
    # 2. Settings of tools that depend on each other.
    for tool in setup.find_by_class("AbstractTool"):
        # AnalyzeTool integrates nothing, so its tolerance does not matter; `not >` includes NaN.
        if not (tool.integrator_error_tolerance > 0.0 or is_a(tool, "AnalyzeTool")):
            report(
                f"an error tolerance of {tool.integrator_error_tolerance:g} is never met: OpenSim "
                "runs forever",
                tool,
                tag="integrator_error_tolerance",
                # Other tools use the tolerance only if they integrate.
                severity=None if is_a(tool, "ForwardTool") else WARNING,
                fault="integrator-error-tolerance",
            )
        if is_a(tool, "RRATool") and not tool.force_set_files:
            report(
                f"{describe_object(tool)} has no forces to control: OpenSim fails; name them in "
                "force_set_files",
                tool,
                tag="force_set_files",
                fault="no-residual-forces",
            )
        # RRATool must replace the forces; in other tools that is seldom meant.
        if tool.replace_force_set and not is_a(tool, "RRATool"):
            report(
                "the forces of force_set_files replace all forces of the model, also its muscles",
                tool,
                tag="replace_force_set",
                fault="replaced-forces",
            )
        if is_a(tool, "RRATool") and not tool.replace_force_set and setup.list_names("Muscle"):
            report(
                "the muscles stay in the model, and OpenSim crashes: the forces of "
                "force_set_files must replace them",
                tool,
                tag="replace_force_set",
                fault="muscles-left-in-model",
            )
        if (
            is_a(tool, "RRATool")
            and tool.adjust_com_to_reduce_residuals
            and not str(tool.adjusted_com_body).strip()
        ):
            report(
                f"{describe_object(tool)} must move a center of mass, but adjusted_com_body names "
                "no body: OpenSim rejects it",
                tool,
                tag="adjusted_com_body",
                fault="no-adjusted-body",
            )
        if is_a(tool, "AnalyzeTool") and not tool.analysis_set.objects:
            report(
                f"{describe_object(tool)} has no analysis: OpenSim rejects it",
                tool,
                fault="no-analysis",
            )
    # 3. Analyses.
    names = Counter(item.name for item in setup.find_by_class("Analysis"))
    for analysis in setup.find_by_class("Analysis"):
        if not analysis.on:
            report(
                f"{describe_object(analysis)} is disabled", analysis, tag="on", fault="analysis-off"
            )
        if names[analysis.name] > 1:
            # Reported once for each name.
            names[analysis.name] = 0
            report(
                f"two analyses are named '{analysis.name}' and write to the same files",
                analysis,
                attribute="name",
                fault="analyses-of-one-name",
            )
        if is_a(analysis, "StaticOptimization"):
            carrying = _find_unactuated_coordinates(setup)
            if carrying:
                report(
                    f"no actuator moves {join_words(carrying)}: without residual actuators the "
                    "optimizer fails",
                    analysis,
                    fault="unactuated-root",
                )
        for tag, part_kind in (("bodies", "body"), ("coordinates", "coordinate")):
            if getattr(analysis, tag, None) == ():
                report(
                    f"{describe_object(analysis)} names no {part_kind}: nothing is written",
                    analysis,
                    tag=tag,
                    fault="nothing-analyzed",
                )
        if is_a(analysis, "MuscleAnalysis") and analysis.on:
            # Fiber lengths come from a states file if there is one, and else from the equilibrium.
            for tool in setup.find_by_class("AnalyzeTool"):
                if (
                    names_file(tool.coordinates_file)
                    and not tool.solve_for_equilibrium_for_auxiliary_states
                ):
                    report(
                        "fibers keep their default lengths, whatever the coordinates are: "
                        "solve_for_equilibrium_for_auxiliary_states is false",
                        tool,
                        tag="solve_for_equilibrium_for_auxiliary_states",
                        fault="fibers-not-in-equilibrium",
                    )
        if (
            is_a(analysis, "MuscleAnalysis")
            and analysis.compute_moments
            and not analysis.moment_arm_coordinate_list
        ):
            report(
                "no coordinate is given for moment arms: OpenSim fails",
                analysis,
                tag="moment_arm_coordinate_list",
                fault="no-moment-arm-coordinate",
            )
        if is_a(analysis, "JointReaction"):
            for word in analysis.apply_on_bodies:
                if word.lower() not in ("child", "parent"):
                    report(
                        f"'{word}' is neither child nor parent: OpenSim rejects it",
                        analysis,
                        tag="apply_on_bodies",
                        word=word,
                        suggestion=find_nearest_name(word, ["child", "parent"]),
                        fault="reaction-on-neither",
                    )
            if len(analysis.apply_on_bodies) not in (0, 1, len(analysis.joint_names)):
                # OpenSim takes none, one word for all joints, or one word for each.
                report(
                    f"apply_on_bodies has {format_count(len(analysis.apply_on_bodies), 'word')} for "
                    f"{format_count(len(analysis.joint_names), 'joint')}: OpenSim rejects it",
                    analysis,
                    tag="apply_on_bodies",
                    fault="reaction-count",
                )
    # 4. Forces and controllers that a set or tool adds.
    user = setup.tool[1] if setup.tool is not None else None
    # Without `replace_force_set` a force of the same name replaces that of the model; OpenSim adds
    # it by name.
    if setup.tree is not None and getattr(user, "replace_force_set", True) is False:
        model_forces = {force.name for force in setup.tree.model.force_set.objects}
        for force in (
            force for forces in setup.find_by_class("ForceSet") for force in forces.objects
        ):
            if force.name in model_forces:
                report(
                    f"this force replaces the force '{force.name}' of the model",
                    force,
                    attribute="name",
                    fault="force-of-one-name",
                )
    for forces in setup.find_by_class("ForceSet"):
        for force in select_members(forces, "Force"):
            if not force.appliesForce:
                report(
                    f"{describe_object(force)} is disabled (appliesForce is false)",
                    force,
                    tag="appliesForce",
                    fault="force-off",
                )
    for controller in setup.find_by_class("Controller") if setup.tool is not None else ():
        if not controller.enabled:
            report(
                f"{describe_object(controller)} is disabled: its actuators have no control",
                controller,
                tag="enabled",
                fault="controller-off",
            )


def _find_unactuated_coordinates(setup: Setup) -> list[str]:
    """Return the free coordinates of joints to ground, if only paths between bodies act in the model."""
    if setup.tree is None or not setup.tree.find_by_class("Actuator"):
        return []
    files = setup.find_having("force_set_files")
    # A file that cannot be read may hold the residual actuators.
    if any(len(tool.force_set_files) > len(setup.added_sets) for tool in files):
        return []
    added = [
        force for _, top in setup.added_sets for force in top.walk() if is_a(force, "Actuator")
    ]
    # Any actuator other than a muscle or path may act on the free coordinates.
    if any(
        not is_a(force, "PathActuator")
        for force in (*setup.tree.find_by_class("Actuator").values(), *added)
    ):
        return []
    # A path to ground carries the model as well.
    parts: list[Any] = setup.tree.components
    if any(
        is_a(part, "AbstractPathPoint") and str(part.socket_parent_frame) == "/ground"
        for part in parts
    ):
        return []
    joints: Any = setup.tree.find_by_class("Joint").values()
    on_ground = (
        joint
        for joint in joints
        if str(joint.socket_parent_frame).rpartition("/")[2].startswith("ground")
    )
    return [
        item.name
        for joint in on_ground
        for item in joint.coordinates
        if not setup.is_bound(item.name)
    ]
