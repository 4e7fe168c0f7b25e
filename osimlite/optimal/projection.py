"""Vectors of which only a part counts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import Formula
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.path_constraints import MocoFrameDistanceConstraint
from osimlite.schema.moco.tracking import MocoContactTrackingGoal


def make_projection(
    part: MocoContactTrackingGoal | MocoFrameDistanceConstraint, problem: Problem
) -> Callable[[Formula], Formula]:
    """What takes of a vector in ground (3, 1) the part that a ``projection`` asks for.

    Raises:
        DocumentError: it asks for one without a direction.
    """
    if part.projection == "none":
        return lambda vector: vector
    if part.projection_vector is None or not any(part.projection_vector):
        raise problem.invalid_error(part, "a projection needs a projection_vector")
    direction = casadi.DM(np.array(part.projection_vector) / np.linalg.norm(part.projection_vector))

    def along(vector: Formula) -> Formula:
        own = casadi.dot(vector, direction) * direction
        return own if part.projection == "vector" else vector - own

    return along
