"""Origins of frames follow given accelerations, as an accelerometer measures them."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.frames import FrameReference
from osimlite.optimal.point import Formula, Frame, GoalTerms, Point
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.tracking import MocoAccelerationTrackingGoal


def terms(goal: MocoAccelerationTrackingGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of the squares of what is missing, m²/s³."""
    gravity = casadi.DM(problem.functions.mechanism.gravity)

    def error(point: Point, frame: Frame, given: Formula) -> Formula:
        found = point.acceleration(frame)
        if goal.gravity_offset:
            found -= gravity
        if goal.express_accelerations_in_tracking_frames:
            found = frame.rotation.T @ found
        return casadi.sumsqr(found - given)

    followed = FrameReference(
        goal,
        goal.acceleration_reference_file,
        None,
        goal.frame_paths,
        goal.acceleration_weights,
        "Vec3",
    )
    return followed.terms(problem, error)
