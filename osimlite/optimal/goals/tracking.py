"""Goals that track columns of a table: states, controls, markers and generalized forces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import Formula, GoalTerms, PointSymbols, make_integral_terms
from osimlite.optimal.tables import fit_splines, read_reference, read_table
from osimlite.schema.constraint_types import CoordinateCouplerConstraint
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import Force
from osimlite.schema.markers import Marker
from osimlite.schema.moco.tracking import (
    MocoControlTrackingGoal,
    MocoGeneralizedForceTrackingGoal,
    MocoMarkerTrackingGoal,
    MocoStateTrackingGoal,
)
from osimlite.schema.states import find_variables

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem


def build_state_tracking_goal(goal: MocoStateTrackingGoal, problem: Problem) -> GoalTerms:
    """Return the integral of the weighted squared errors of states from splines through a table.

    Args:
        goal: goal of the study.
        problem: problem with the states.

    Raises:
        DocumentError: the goal or its table is invalid.
    """
    states = problem.functions.states
    table = read_reference(problem, goal, goal.reference)
    state_weights = problem.find_weights(goal, goal.state_weights, None, states, "state")
    weights = dict(zip(states, state_weights, strict=True))
    matches = problem.compile_pattern(goal, goal.pattern if goal.pattern is not None else ".*")
    tracked = [name for name in table.columns if name in states and matches(name)]
    for name in table.columns:
        if name not in tracked and not goal.allow_unused_references:
            problem.check_name(goal, name, states, "state")
            raise problem.invalid_error(
                goal, f"the column '{name}' does not match the pattern; set allow_unused_references"
            )
    if goal.scale_weights_with_range:
        # As in Moco, the weight is divided by the range once, although the error is squared.
        weights |= {name: weights[name] / float(np.ptp(table[name])) for name in tracked}
    tracked_series = [*zip(tracked, fit_splines(problem, table, tracked), strict=True)]

    def integrand(point: PointSymbols) -> Formula:
        return sum(
            weights[name] * (point.state(name) - point.evaluate(series)) ** 2
            for name, series in tracked_series
        )

    return make_integral_terms(integrand)


def build_control_tracking_goal(goal: MocoControlTrackingGoal, problem: Problem) -> GoalTerms:
    """Return the integral of the weighted squared errors of controls from splines through a table.

    Args:
        goal: goal of the study.
        problem: problem with the controls.

    Raises:
        DocumentError: the goal or its table is invalid.
    """
    controls = [*problem.controls]
    table = read_reference(problem, goal, goal.reference)
    columns = {
        reference_label.name: reference_label.reference for reference_label in goal.reference_labels
    }
    if not columns:
        columns = {
            name: name
            for name in table.columns
            if name in controls or not goal.allow_unused_references
        }
    for name, label in columns.items():
        problem.check_name(goal, name, controls, "control")
        if label not in table.columns:
            raise problem.invalid_error(
                goal, f"reference has no column '{label}' for the control '{name}'"
            )
    control_weights = problem.find_weights(goal, goal.control_weights, None, controls, "control")
    weights = dict(zip(controls, control_weights, strict=True))
    tracked_series = [*zip(columns, fit_splines(problem, table, [*columns.values()]), strict=True)]

    def integrand(point: PointSymbols) -> Formula:
        return sum(
            weights[name] * (point.control(name) - point.evaluate(series)) ** 2
            for name, series in tracked_series
        )

    return make_integral_terms(integrand)


def build_marker_tracking_goal(goal: MocoMarkerTrackingGoal, problem: Problem) -> GoalTerms:
    """Return the integral of the weighted squared distances, m² s, of markers from measured ones.

    Args:
        goal: goal of the study.
        problem: problem with the markers.

    Raises:
        DocumentError: the goal or its table is invalid.
    """
    reference = goal.markers_reference
    table = problem.tables.get(goal.name)
    if table is None:
        if not reference.marker_file.strip():
            raise problem.invalid_error(goal, "markers_reference has no marker_file")
        table = read_table(problem.locate_file(reference.marker_file))
    # Labels end in _1, _2 and _3; a marker with three columns is named once.
    measured_names = [*dict.fromkeys(label[:-2] for label in table.columns)]
    paths = {
        component.name: path
        for path, component in problem.components.items()
        if isinstance(component, Marker)
    }
    # Tables may name markers by their paths, too.
    paths |= {path: path for path in paths.values()}
    tracked = [name for name in measured_names if name in paths or not goal.allow_unused_references]
    for name in tracked:
        problem.check_name(goal, name, paths, "marker")
    explicit_weights = {
        marker_weight.name: marker_weight.weight
        for marker_weight in reference.marker_weights.objects
    }
    weights = [explicit_weights.get(name, reference.default_weight) for name in tracked]
    labels = [f"{name}_{k}" for name in tracked for k in (1, 2, 3)]
    series = fit_splines(problem, table, labels)

    def integrand(point: PointSymbols) -> Formula:
        positions = point.output("stations")
        total = casadi.SX(0.0)
        for number, (name, weight) in enumerate(zip(tracked, weights, strict=True)):
            for axis, target in zip("xyz", series[3 * number : 3 * number + 3], strict=True):
                error = positions[f"{paths[name]}|{axis}"] - point.evaluate(target)
                total += weight * error**2
        return total

    return make_integral_terms(integrand)


def build_generalized_force_tracking_goal(
    goal: MocoGeneralizedForceTrackingGoal, problem: Problem
) -> GoalTerms:
    """Return the integral of the weighted squared errors of generalized forces from splines through a table.

    The generalized forces (N, N m) are those that the motion needs beyond gravity and the forces of
    `force_paths`.

    Args:
        goal: goal of the study.
        problem: problem with the coordinates.

    Raises:
        DocumentError: the goal or its table is invalid.
    """
    applied_forces = _match_forces(goal, problem)
    coordinates: dict[str, Any] = {**find_variables(problem.model.tree(), "generalized force")}
    paths = {
        label: coordinate.path
        for label, coordinate in coordinates.items()
        if not (goal.ignore_constrained_coordinates and _is_constrained(problem, coordinate))
    }
    table = read_reference(problem, goal, goal.reference)
    tracked = [name for name in table.columns if name in paths or not goal.allow_unused_references]
    for name in tracked:
        problem.check_name(goal, name, paths, "free generalized force")
    force_weights = problem.find_weights(
        goal,
        goal.generalized_force_weights,
        goal.generalized_force_weights_pattern,
        [*paths],
        "free generalized force",
    )
    weights = dict(zip(paths, force_weights, strict=True))
    rows: list[Any] = []
    for name, series in zip(tracked, fit_splines(problem, table, tracked), strict=True):
        if weights[name] < 0.0:
            raise problem.invalid_error(
                goal, f"the weight of '{name}' is negative; OpenSim rejects this too"
            )
        greatest = float(np.abs(table[name]).max()) if goal.normalize_tracking_error else 1.0
        if not greatest:
            raise problem.invalid_error(
                goal,
                f"the column '{name}' is zero everywhere; set normalize_tracking_error to false",
            )
        rows.append((series, weights[name] / greatest**2))
    needed_forces = problem.dynamics.make_generalized_forces(
        applied_forces, [paths[name] for name in tracked]
    )

    def integrand(point: PointSymbols) -> Formula:
        values = needed_forces(point)
        return sum(
            weight * (values[k] - point.evaluate(series)) ** 2
            for k, (series, weight) in enumerate(rows)
        )

    return make_integral_terms(integrand)


def _match_forces(goal: MocoGeneralizedForceTrackingGoal, problem: Problem) -> list[str]:
    """Return the paths of forces that the patterns match; OpenSim refuses to match one twice.

    Args:
        goal: goal with the patterns.
        problem: problem with the forces.
    """
    forces = [
        path for path, component in problem.components.items() if isinstance(component, Force)
    ]
    result: list[str] = []
    for pattern in map(str, goal.force_paths):
        matched = [*filter(problem.compile_pattern(goal, pattern), forces)]
        if not matched:
            problem.check_name(goal, pattern, forces, "force")
        if repeated := [path for path in matched if path in result]:
            raise problem.invalid_error(goal, f"force_paths matches '{repeated[0]}' twice")
        result += matched
    return result


def _is_constrained(problem: Problem, coordinate: Coordinate) -> bool:
    """Return whether a coordinate's motion is prescribed or depends on other coordinates.

    Args:
        problem: problem with the couplers.
        coordinate: coordinate of the model.
    """
    couplers = (
        component
        for component in problem.components.values()
        if isinstance(component, CoordinateCouplerConstraint)
    )
    dependent = {
        str(component.dependent_coordinate_name) for component in couplers if component.isEnforced
    }
    return (
        coordinate.prescribed
        or coordinate.is_free_to_satisfy_constraints
        or coordinate.name in dependent
    )
