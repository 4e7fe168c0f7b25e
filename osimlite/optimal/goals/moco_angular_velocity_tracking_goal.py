"""Frames follow given angular velocities."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.frames import FrameReference
from osimlite.optimal.point import GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.tracking import MocoAngularVelocityTrackingGoal


def terms(goal: MocoAngularVelocityTrackingGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of the squares of what is missing, rad²/s."""
    followed = FrameReference(
        goal,
        goal.angular_velocity_reference_file,
        goal.states_reference,
        goal.frame_paths,
        goal.angular_velocity_weights,
        "Vec3",
        "angular_velocity",
    )
    return followed.terms(
        problem, lambda point, frame, given: casadi.sumsqr(frame.angular_velocity - given)
    )
