"""Goals on effort and load: controls, states and joint reactions, integrated over the motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import Formula, GoalTerms, PointSymbols, make_integral_terms
from osimlite.schema.joints import Joint
from osimlite.schema.moco.goals import (
    MEASURES,
    MocoControlGoal,
    MocoJointReactionGoal,
    MocoSumSquaredStateGoal,
)

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem


def build_control_goal(goal: MocoControlGoal, problem: Problem) -> GoalTerms:
    """Return the integral over time of the weighted sum of ``abs(control) ** exponent``, s.

    Args:
        goal: goal of the study.
        problem: problem with the controls.
    """
    controls = [*problem.controls]
    weights = problem.find_weights(
        goal, goal.control_weights, goal.control_weights_pattern, controls, "control"
    )
    power = goal.exponent

    def integrand(point: PointSymbols) -> Formula:
        values = casadi.vertcat(*map(point.control, controls))
        # An even power needs no absolute value, whose derivative jumps at zero.
        sizes = values if power % 2 == 0 else casadi.fabs(values)
        return casadi.dot(casadi.DM(weights), sizes**power)

    return make_integral_terms(integrand)


def build_sum_squared_state_goal(goal: MocoSumSquaredStateGoal, problem: Problem) -> GoalTerms:
    """Return the integral over time of the weighted sum of squares of the states that match the pattern.

    Args:
        goal: goal of the study.
        problem: problem with the states.
    """
    states = problem.functions.states
    weights = problem.find_weights(goal, goal.state_weights, None, states, "state")
    if goal.pattern is not None:
        matches = problem.compile_pattern(goal, goal.pattern)
        weights = [
            weight if matches(name) else 0.0 for weight, name in zip(weights, states, strict=True)
        ]
    return make_integral_terms(lambda point: casadi.dot(casadi.DM(weights), point.x**2))


def build_joint_reaction_goal(goal: MocoJointReactionGoal, problem: Problem) -> GoalTerms:
    """Return the integral of the weighted squares of a joint's reaction load over the model's weight.

    Forces are in N, moments in N m, along the axes of ``expressed_in_frame_path`` (by default the
    joint's frame on the side of ``loads_frame``).

    Args:
        goal: goal of the study.
        problem: problem with the joint.

    Raises:
        DocumentError: the joint or the frame does not exist.
    """
    path = str(goal.joint_path)
    side = goal.loads_frame
    joints = [key for key, component in problem.components.items() if isinstance(component, Joint)]
    problem.check_name(goal, path, joints, "joint")
    joint = problem.components[path]
    frame = str(goal.expressed_in_frame_path)
    if not frame:
        socket = f"socket_{side}_frame"
        frame = problem.model.tree().target(joint, socket, getattr(joint, socket)).path
    problem.check_name(goal, frame, problem.functions.mechanism.frames, "frame")
    measures = goal.reaction_measures or MEASURES
    weights = problem.find_weights(goal, goal.reaction_weights, None, MEASURES, "reaction measure")
    weight_by_measure = dict(zip(MEASURES, weights, strict=True))
    load = problem.dynamics.make_joint_load(path, side, frame)

    def integrand(point: PointSymbols) -> Formula:
        values = load(point)
        return sum(weight_by_measure[name] * values[MEASURES.index(name)] ** 2 for name in measures)

    result = make_integral_terms(integrand)
    model_weight = problem.model_weight
    return GoalTerms(lambda ends: result.value(ends) / model_weight, integrand)
