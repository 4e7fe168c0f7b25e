"""Frames follow given orientations."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.frames import FrameReference
from osimlite.optimal.point import Formula, Frame, GoalTerms, Point
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.tracking import MocoOrientationTrackingGoal

SMALL = 1e-8
"""Squares of sines below which that of the angle is taken from its series, as a root has no slope at zero."""


def terms(goal: MocoOrientationTrackingGoal, problem: Problem) -> GoalTerms:
    """The integral of the weighted sum of the squares of the angles that are missing, rad² s."""
    followed = FrameReference(
        goal,
        goal.rotation_reference_file,
        goal.states_reference,
        goal.frame_paths,
        goal.rotation_weights,
        "Quaternion",
        "rotation",
    )
    return followed.terms(problem, squared_angle)


def squared_angle(point: Point, frame: Frame, given: Formula) -> Formula:
    """The square of the angle between a frame and a quaternion of any length, scalar first."""
    w, x, y, z = casadi.vertsplit(given / casadi.norm_2(given))
    wanted = casadi.horzcat(
        casadi.vertcat(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        casadi.vertcat(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        casadi.vertcat(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    )
    turn = frame.rotation.T @ wanted
    cosine = (casadi.trace(turn) - 1) / 2
    square = (
        (turn[2, 1] - turn[1, 2]) ** 2
        + (turn[0, 2] - turn[2, 0]) ** 2
        + (turn[1, 0] - turn[0, 1]) ** 2
    ) / 4
    angle = casadi.atan2(casadi.sqrt(casadi.fmax(square, SMALL * SMALL)), cosine)
    is_small = casadi.logic_and(square < SMALL, cosine > 0)
    return casadi.if_else(is_small, square + square**2 / 3 + 8 * square**3 / 45, angle**2)
