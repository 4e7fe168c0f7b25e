"""Frames neither too near nor too far apart."""

from __future__ import annotations

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import ConstraintRows, Formula, Point
from osimlite.optimal.problem import Problem
from osimlite.optimal.projection import make_projection
from osimlite.schema.moco.path_constraints import MocoFrameDistanceConstraint


def rows(constraint: MocoFrameDistanceConstraint, problem: Problem) -> ConstraintRows:
    """The squares of the distances of the origins, m², as OpenSim bounds them."""
    pairs, limits = [], []
    for pair in constraint.frame_pairs:
        ends = str(pair.frame1_path), str(pair.frame2_path)
        for path in ends:
            problem.check_name(constraint, path, problem.functions.mechanism.frames, "frame")
        near, far = pair.minimum_distance, pair.maximum_distance
        if not 0.0 <= near <= far:
            raise problem.invalid_error(
                constraint, f"its distances rise from {near:g} to {far:g} m, which none can fulfil"
            )
        pairs.append(ends)
        limits.append((near * near, far * far))
    along = make_projection(constraint, problem)

    def formula(point: Point) -> Formula:
        ways = (point.frame(end).position - point.frame(start).position for start, end in pairs)
        return casadi.vertcat(*(casadi.sumsqr(along(way)) for way in ways))

    return ConstraintRows(
        [f"{constraint.name} of {start} and {end}" for start, end in pairs], formula, limits
    )
