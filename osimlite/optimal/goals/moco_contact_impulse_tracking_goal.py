"""The impulse of contact forces follows a measured one."""

from __future__ import annotations

from osimlite.optimal.contacts import compute_model_weight, read_contact_groups
from osimlite.optimal.point import Formula, GoalTerms, Point, make_integral_terms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.tracking import MocoContactImpulseTrackingGoal


def terms(goal: MocoContactImpulseTrackingGoal, problem: Problem) -> GoalTerms:
    """The square of the missing impulse (N s) along an axis of ground, over the weight of the model."""
    axis = goal.impulse_axis
    if axis not in range(3):
        raise problem.invalid_error(goal, f"its impulse_axis is {axis}; it has to be 0, 1 or 2")
    if len(goal.contact_groups) != 1:
        raise problem.invalid_error(
            goal, f"it has {len(goal.contact_groups)} contact_groups; it takes one, as in OpenSim"
        )
    ((paths, measured, _),) = read_contact_groups(goal, problem)

    def integrand(point: Point) -> Formula:
        pushes = point.output("contact_forces")
        return sum(pushes[f"{path}|force_{'xyz'[axis]}"] for path in paths) - point.evaluate(
            measured[axis]
        )

    result, weight = make_integral_terms(integrand), compute_model_weight(problem)
    return GoalTerms(lambda ends: result.value(ends) ** 2 / weight, integrand)
