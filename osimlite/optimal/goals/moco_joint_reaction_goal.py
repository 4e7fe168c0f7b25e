"""The load that a joint carries."""

from __future__ import annotations

from osimlite.optimal.contacts import compute_model_weight
from osimlite.optimal.point import Formula, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.schema.joints import Joint
from osimlite.schema.moco.goals import MEASURES, MocoJointReactionGoal


def terms(goal: MocoJointReactionGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of the squares of forces (N) and moments (N m), over the weight of the model."""
    path, side = str(goal.joint_path), goal.loads_frame
    problem.check_name(
        goal,
        path,
        [key for key, part in problem.components.items() if isinstance(part, Joint)],
        "joint",
    )
    joint = problem.components[path]
    frame = str(goal.expressed_in_frame_path)
    if not frame:
        name = f"socket_{side}_frame"
        frame = problem.model.tree().target(joint, name, getattr(joint, name)).path
    problem.check_name(goal, frame, problem.functions.mechanism.frames, "frame")
    names = goal.reaction_measures or MEASURES
    weights = problem.find_weights(goal, goal.reaction_weights, None, MEASURES, "reaction measure")
    known = dict(zip(MEASURES, weights, strict=True))
    load = problem.dynamics.make_joint_load(path, side, frame)

    def integrand(point: Point) -> Formula:
        own = load(point)
        return sum(known[name] * own[MEASURES.index(name)] ** 2 for name in names)

    result, weight = make_integral_terms(integrand), compute_model_weight(problem)
    return GoalTerms(lambda ends: result.value(ends) / weight, integrand)
