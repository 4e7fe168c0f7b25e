"""Layout of the variables of the nonlinear program."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.mechanics.multibody.smoothing_spline import SampledCurves
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.bounds import Bounds, compute_midpoint, compute_scaling, read_range
from osimlite.schema.model import Model

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem

MIN_SPLINE_TIMES = 6
"""Number of times that a spline of fifth degree needs at least."""
VARIABLE_KINDS = "states", "controls", "multipliers", "derivatives", "slacks", "projections"
"""Kinds of variables of a point, in their order."""
PROJECTION_SUFFIX = "/projection"
"""Suffix of the names of states at the end of an interval, before they are projected onto the constraints."""


class VariableLayout:
    """Vector of variables: initial and final time, parameters, then the variables of each point in turn.

    Args:
        problem: problem with the bounds of all variables.

    Attributes:
        problem: problem with the bounds of all variables.
        names: names of the variables of a point, by kind.
        bounds: bounds of the variables of a point, by kind.
        shared: number of variables before those of the first point: times and parameters.
        point_indices: indices of the variables of each point.
        indices: indices (points, names) of the variables by kind; -1 where a point has none.
        lower: lower bounds (n,).
        upper: upper bounds (n,).

    Raises:
        DocumentError: the bounds of a variable exclude each other.
    """

    def __init__(self, problem: Problem) -> None:
        functions = problem.functions
        grid = problem.grid
        solver = problem.solver
        self.problem = problem
        multipliers = [f"lambda_{name}" for name in problem.constraint_names]
        accelerations = (
            [f"{path}/accel" for path in functions.coordinates]
            if problem.dynamics.is_implicit
            else []
        )
        self.names: dict[str, list[str]] = {
            "states": [*functions.states],
            "controls": [*problem.controls],
            "multipliers": multipliers,
            "derivatives": [*accelerations, *problem.dynamics.tendons.names],
            "slacks": problem.slack_names,
            "projections": problem.projected_names,
        }
        force = read_range(problem.phase.multiplier_bounds) or (-np.inf, np.inf)
        # Bounds that the study leaves open are infinite; Moco's defaults are in the schema.
        acceleration = read_range(solver.implicit_multibody_acceleration_bounds) or (
            -np.inf,
            np.inf,
        )
        rate = read_range(solver.implicit_auxiliary_derivative_bounds) or (-np.inf, np.inf)
        of_slacks = (
            solver.projection_slack_variable_bounds
            if problem.uses_projection
            else solver.velocity_correction_bounds
        )
        correction = read_range(of_slacks) or (-np.inf, np.inf)
        self.bounds: dict[str, list[Bounds]] = {
            "states": [*problem.states.values()],
            "controls": [*problem.controls.values()],
            "multipliers": [Bounds.from_ranges(force)] * len(multipliers),
            "derivatives": [
                *[Bounds.from_ranges(acceleration)] * len(accelerations),
                *[Bounds.from_ranges(rate)] * len(problem.dynamics.tendons.names),
            ],
            "slacks": [Bounds.from_ranges(correction)] * len(problem.slack_names),
            "projections": [*problem.states.values()][: len(problem.projected_names)],
        }
        self.shared: int = 2 + len(problem.parameters)
        ranges = [*problem.times, *problem.parameters.values()]
        lower, upper = ([variable_range[k] for variable_range in ranges] for k in range(2))
        self.point_indices: list[Any] = []
        self.indices = {
            kind: np.full((len(grid.fractions), len(self.names[kind])), -1)
            for kind in VARIABLE_KINDS
        }
        lows = [np.array(lower)]
        highs = [np.array(upper)]
        size = self.shared
        end = len(grid.fractions) - 1
        limits = {
            kind: np.array([[b.overall, b.first, b.last] for b in group_bounds])
            for kind, group_bounds in self.bounds.items()
        }
        for point in range(len(grid.fractions)):
            first_index = size
            # Bounds at the start and at the end replace those over the motion.
            column = 1 if point == 0 else 2 if point == end else 0
            for kind, group_bounds in limits.items():
                if len(group_bounds) and self.has_kind(kind, point):
                    lows.append(group_bounds[:, column, 0])
                    highs.append(group_bounds[:, column, 1])
                    self.indices[kind][point] = np.arange(size, size + len(group_bounds))
                    size += len(group_bounds)
            self.point_indices.append(np.arange(first_index, size))
        self.lower = np.concatenate(lows)
        self.upper = np.concatenate(highs)
        self._check_bounds()

    def _check_bounds(self) -> None:
        """Check that each variable has a value between its bounds.

        Raises:
            DocumentError: a lower bound is above the upper one, or a bound is NaN.
        """
        # The negation also catches NaN.
        for index in np.flatnonzero(~(self.lower <= self.upper))[:1]:
            range_text = f"from {self.lower[index]:g} to {self.upper[index]:g}"
            message = (
                f"the bounds of '{self.describe_variable(index)}' leave no value ({range_text})"
            )
            raise self.problem.invalid_error(self.problem.phase, message)

    def has_kind(self, kind: str, point: int) -> bool:
        """Return whether a point has variables of a kind.

        Velocity corrections are at points between nodes, projections and their slacks at the ends
        of intervals.

        Args:
            kind: one of `VARIABLE_KINDS`.
            point: index of the point.
        """
        if kind == "slacks" and not self.problem.uses_projection:
            return not self.problem.grid.is_mesh[point]
        return kind not in ("slacks", "projections") or bool(
            point and self.problem.grid.is_mesh[point]
        )

    @cached_property
    def scaling(self) -> tuple[Array, Array]:
        """Factors and offsets with which the search scales the variables; 1 and 0 if it does not.

        Each variable is scaled by its own bounds; Moco 4.6 takes those of the last variable of a
        kind for all of that kind.

        Returns:
            Factors (n,), and offsets (n,), see :func:`~osimlite.optimal.bounds.compute_scaling`.
        """
        scale = np.ones(len(self.lower))
        shift = np.zeros(len(self.lower))
        if not self.problem.solver.scale_variables_using_bounds:
            return scale, shift
        indexed_ranges: list[Any] = [
            *enumerate([*self.problem.times, *self.problem.parameters.values()])
        ]
        for kind in VARIABLE_KINDS:
            for column, bounds in zip(self.indices[kind].T, self.bounds[kind], strict=True):
                indexed_ranges.append((column[column >= 0], bounds.overall))
        for indices, (lower, upper) in indexed_ranges:
            scale[indices], shift[indices] = compute_scaling(lower, upper)
        return scale, shift

    def make_guess(self) -> Array:
        """Return the middle between the bounds of each variable (n,), as Moco's default guess."""
        return compute_midpoint(self.lower, self.upper)

    def guess_from_trajectory(self, trajectory: Any) -> Array:
        """Return the variables of a trajectory, interpolated by splines at the points of the grid.

        Args:
            trajectory: trajectory with its times, columns and parameters.

        Returns:
            Variables (n,); those that the trajectory lacks are in the middle between their bounds.
        """
        result = self.make_guess()
        times = trajectory.times
        result[:2] = times[0], times[-1]
        grid_times = times[0] + self.problem.grid.fractions * (times[-1] - times[0])
        for kind in VARIABLE_KINDS:
            for number, name in enumerate(self.names[kind]):
                # Files hold no states before projection; the projected ones are near them.
                column = trajectory.columns.get(name.removesuffix(PROJECTION_SUFFIX))
                if column is not None:
                    indices = self.indices[kind][:, number]
                    result[indices[indices >= 0]] = _resample_column(times, column, grid_times)[
                        indices >= 0
                    ]
        for number, name in enumerate(self.problem.parameters):
            if name in trajectory.parameters:
                result[2 + number] = trajectory.parameters[name]
        return result

    def describe_variable(self, index: int) -> str:
        """Return the name of a variable by its index, for messages."""
        if index < self.shared:
            return ["initial time", "final time", *self.problem.parameters][index]
        for kind in VARIABLE_KINDS:
            matches = np.argwhere(self.indices[kind] == index)
            if len(matches):
                return self.names[kind][matches[0][1]]
        return ""


def _resample_column(times: Array, column: Array, new_times: Array) -> Array:
    """Interpolate a column: by a natural spline of fifth degree as Moco, linearly with few times.

    Args:
        times: times (n,), s.
        column: values (n,); those that are not finite are skipped.
        new_times: times of the result (m,), s.

    Returns:
        Values at these times (m,).
    """
    # On the same grid the values are kept, so that a solution evaluates to what was written.
    if len(times) == len(new_times) and np.allclose(times, new_times, rtol=0.0, atol=1e-12):
        return column
    is_finite = np.isfinite(column)
    if is_finite.sum() < MIN_SPLINE_TIMES:
        return np.interp(new_times, times[is_finite], column[is_finite])
    return SampledCurves(times[is_finite], column[is_finite][:, None]).derivatives(new_times, (0,))[
        0
    ][:, 0]


def number_equations(model: Model, count: int) -> Iterable[tuple[int, int]]:
    """Number the equations of a model's constraints.

    Args:
        model: model with the constraints.
        count: number of equations.

    Returns:
        Number of its constraint, and row within the constraint, of each equation.
    """
    # Other classes have one equation.
    sizes = {"WeldConstraint": 6, "PointConstraint": 3}
    rows: list[tuple[int, int]] = []
    constraints: Mapping[str, Any] = {
        constraint.path: constraint for constraint in model.constraint_set.objects
    }
    enforced = [constraint for constraint in constraints.values() if constraint.isEnforced]
    for number, constraint in enumerate(enforced):
        rows += [(number, row) for row in range(sizes.get(type(constraint).tag, 1))]
    # A constraint with another number of equations: their names count them one by one then.
    return rows if len(rows) == count else [(row, 0) for row in range(count)]
