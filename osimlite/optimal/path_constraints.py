"""Path constraints of Moco studies, and the table of all supported classes of them.

A new path constraint is a function ``build_..._rows(constraint, problem)`` and a line in
:data:`PATH_CONSTRAINT_BUILDERS`. It receives the constraint as the schema has it and the
:class:`~osimlite.optimal.problem.Problem`, and returns the
:class:`~osimlite.optimal.point.ConstraintRows`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.optimal.goals.outputs import build_output_formula
from osimlite.optimal.point import ConstraintRows, Formula, PointSymbols, make_projection
from osimlite.optimal.tables import sample_function
from osimlite.schema.moco.path_constraints import (
    MocoControlBoundConstraint,
    MocoFrameDistanceConstraint,
    MocoOutputBoundConstraint,
    MocoPathConstraint,
    MocoStateBoundConstraint,
)

if TYPE_CHECKING:
    from osimlite.optimal.bounds import Range
    from osimlite.optimal.problem import Problem


def build_control_bound_rows(
    constraint: MocoControlBoundConstraint, problem: Problem
) -> ConstraintRows:
    """Return the difference of each control from each of the bounding functions of time.

    Args:
        constraint: constraint of the study.
        problem: problem with the controls.
    """
    paths = [str(path) for path in constraint.control_paths]
    for path in paths:
        problem.check_name(constraint, path, problem.controls, "control")
    return build_bound_rows(constraint, problem, paths, PointSymbols.control)


def build_state_bound_rows(
    constraint: MocoStateBoundConstraint, problem: Problem
) -> ConstraintRows:
    """Return the difference of each state from each of the bounding functions of time.

    Args:
        constraint: constraint of the study.
        problem: problem with the states.
    """
    paths = [str(path) for path in constraint.state_paths]
    for path in paths:
        problem.check_name(constraint, path, problem.functions.states, "state")
    return build_bound_rows(constraint, problem, paths, PointSymbols.state)


def build_output_bound_rows(
    constraint: MocoOutputBoundConstraint, problem: Problem
) -> ConstraintRows:
    """Return the difference of the output from each of the bounding functions of time.

    Args:
        constraint: constraint of the study.
        problem: problem with the components.
    """
    value = build_output_formula(constraint, problem)
    paths = [constraint.output_path]
    return build_bound_rows(constraint, problem, paths, lambda point, _: value(point))


def build_frame_distance_rows(
    constraint: MocoFrameDistanceConstraint, problem: Problem
) -> ConstraintRows:
    """Return the squared distances, m², of pairs of frame origins, as OpenSim bounds them.

    Args:
        constraint: constraint of the study.
        problem: problem with the frames.

    Raises:
        DocumentError: a frame does not exist, or the distances of a pair exclude each other.
    """
    paths_of_pairs = []
    limits = []
    for frame_pair in constraint.frame_pairs:
        frame_paths = str(frame_pair.frame1_path), str(frame_pair.frame2_path)
        for path in frame_paths:
            problem.check_name(constraint, path, problem.functions.mechanism.frames, "frame")
        minimum = frame_pair.minimum_distance
        maximum = frame_pair.maximum_distance
        # Written so that NaN is refused too.
        if not 0.0 <= minimum <= maximum:
            raise problem.invalid_error(
                constraint,
                f"minimum_distance {minimum:g} m and maximum_distance {maximum:g} m exclude each other",
            )
        paths_of_pairs.append(frame_paths)
        # A squared distance has a slope everywhere, unlike the distance at zero.
        limits.append((minimum * minimum, maximum * maximum))
    project = make_projection(constraint, problem)

    def formula(point: PointSymbols) -> Formula:
        offsets = (
            point.frame(end).position - point.frame(start).position for start, end in paths_of_pairs
        )
        return casadi.vertcat(*(casadi.sumsqr(project(offset)) for offset in offsets))

    labels = [f"{constraint.name} of {start} and {end}" for start, end in paths_of_pairs]
    return ConstraintRows(labels, formula, limits)


def build_bound_rows(
    constraint: MocoControlBoundConstraint | MocoStateBoundConstraint | MocoOutputBoundConstraint,
    problem: Problem,
    paths: Sequence[str],
    variable: Callable[[PointSymbols, str], Formula],
) -> ConstraintRows:
    """Return the difference of each variable from each of the bounding functions of time.

    Args:
        constraint: constraint with the functions.
        problem: problem with the variables.
        paths: paths of the variables.
        variable: function of a point and a path that returns the variable.

    Returns:
        Rows in the unit of the variables: those of the first variable first.

    Raises:
        DocumentError: the constraint has no function, or a wrong set of them.
    """
    bound_limits = [("lower_bound", (0.0, math.inf)), ("upper_bound", (-math.inf, 0.0))]
    functions = [(getattr(constraint, name), limits) for name, limits in bound_limits]
    functions = [
        function_and_limits
        for function_and_limits in functions
        if function_and_limits[0] is not None
    ]
    if not functions:
        raise problem.invalid_error(constraint, "lower_bound or upper_bound is required")
    if constraint.equality_with_lower:
        if constraint.lower_bound is None or constraint.upper_bound is not None:
            raise problem.invalid_error(
                constraint, "equality_with_lower requires a lower_bound and no upper_bound"
            )
        # Both bounds of the difference are zero: the variable equals the function.
        functions = [(constraint.lower_bound, (0.0, 0.0))]
    series = [
        problem.add_time_function(
            partial(
                sample_function, convert_function(function, 1, f"a bound of '{constraint.name}'")
            )
        )
        for function, _ in functions
    ]
    # In the order of `formula`: all functions of the first variable, then those of the second.
    limits: list[Range] = [limit for _ in paths for _, limit in functions]

    def formula(point: PointSymbols) -> Formula:
        return casadi.vertcat(
            *(
                variable(point, path) - point.evaluate(bound_series)
                for path in paths
                for bound_series in series
            )
        )

    labels = [f"{constraint.name} of {path}" for path in paths for _ in functions]
    return ConstraintRows(labels, formula, limits)


PATH_CONSTRAINT_BUILDERS: dict[
    type[MocoPathConstraint], Callable[[Any, Problem], ConstraintRows]
] = {
    MocoControlBoundConstraint: build_control_bound_rows,
    MocoFrameDistanceConstraint: build_frame_distance_rows,
    MocoOutputBoundConstraint: build_output_bound_rows,
    MocoStateBoundConstraint: build_state_bound_rows,
}
"""Function that formulates each supported class of path constraints."""
