"""Origins of frames follow given places."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.frames import FrameReference
from osimlite.optimal.point import GoalTerms
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.tracking import MocoTranslationTrackingGoal


def terms(goal: MocoTranslationTrackingGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of the squares of distances, m² s."""
    followed = FrameReference(
        goal,
        goal.translation_reference_file,
        goal.states_reference,
        goal.frame_paths,
        goal.translation_weights,
        "Vec3",
        "position",
    )
    return followed.terms(
        problem, lambda point, frame, given: casadi.sumsqr(frame.position - given)
    )
