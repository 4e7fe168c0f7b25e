"""Nonlinear program of a problem, with its sparse exact derivatives.

One CasADi function F(s, z_k) holds all that is nonlinear at point k of the grid: rates times the
duration, residuals, and integrands times the duration. s are the times and the parameters, z_k the
variables of the point. The constraints are ``A w + B F`` with constant sparse A and B. Jacobian and
Hessian are thus constant sparse maps of the derivatives of F at the points, and nothing is
differentiated twice. Terms that depend on both ends are one more function, E(s, z_0, z_n,
integrals).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.base.text import format_count
from osimlite.derivatives.symbols import casadi, postpone_interrupts, raise_interrupt
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.bounds import read_range
from osimlite.optimal.layout import VARIABLE_KINDS, VariableLayout
from osimlite.optimal.point import Endpoints, PointSymbols
from osimlite.optimal.point_functions import BufferedFunction, PointGroup, cache_last
from osimlite.optimal.problem import Problem
from osimlite.optimal.sparse import SparseMatrix

SX: Any = casadi.SX
"""Type of CasADi's symbolic scalar expressions."""
MAX_CACHED_TIMES = 8
"""Number of sets of times for which the data of functions of time are cached."""


class Program:
    """Nonlinear program: minimize f(w) subject to lower <= g(w) <= upper.

    Args:
        problem: optimal control problem.

    Attributes:
        problem: optimal control problem.
        layout: layout of the variables w.
        time_data_size: number of data of the functions of time at a point.
        integrals: goals with an integrand, with their terms.
        groups: groups of points with the same variables.
        labels: labels of the rows of g (m,).
        times: fraction of time of each row of g (m,), from 0 to 1; NaN for constraints on both
            ends.
        lower: lower bounds of g (m,).
        upper: upper bounds of g (m,).
        costs: names of the parts of f.
        end_labels: labels of the endpoint constraints, the last rows of g.
        end_columns: indices of the variables of E: times and parameters, first point, last point.
        jacobian_sparsity: sparsity pattern of the Jacobian of g.
    """

    @postpone_interrupts()
    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.layout = VariableLayout(problem)
        self._time_data: dict[bytes, Array] = {}
        self._compute_rows = cache_last(
            lambda w: self._a @ w + self._b @ self._evaluate_groups("value", w)
        )
        self.labels: list[str] = []
        self.times: Array = np.zeros(0)
        self.lower: Array = np.zeros(0)
        self.upper: Array = np.zeros(0)
        self.time_data_size = 1 + 3 * len(problem.time_functions)
        self.integrals: list[Any] = [
            (goal, terms) for goal, terms in problem.goals if terms.integrand is not None
        ]
        points = range(len(problem.grid.fractions))
        is_mesh = problem.grid.is_mesh
        # Points between nodes have no constraint errors, and maybe no path constraints: other
        # formulas.
        groups = [[k for k in points if is_mesh[k]], [k for k in points if not is_mesh[k]]]
        has_rows_between_nodes = (
            problem.solver.enforce_path_constraint_mesh_interior_points or not problem.path_rows
        )
        if has_rows_between_nodes and not problem.has_constraints:
            # Without such rows all points have the same formulas, which one call evaluates.
            groups = [[*points]]
        if problem.uses_projection:
            # No interval ends at the first point, so that it has no projection.
            groups = [[0], groups[0][1:], groups[1]]
        self.groups = [PointGroup(self, numbers) for numbers in groups if numbers]
        self._offsets = np.cumsum([0, *(group.rows * len(group.numbers) for group in self.groups)])
        self._assemble_matrices()
        self._make_ends()
        self._map_jacobian()
        self._map_ends()

    # --------------------------------------------------------------------------------------------- formulas
    def point(self, s: Any, z: Any, fraction: Any, time_data: Any, number: int) -> PointSymbols:
        """Return the formulas at a point of the grid, which hold for all points with the same variables.

        Args:
            s: symbols of the times and the parameters.
            z: symbols of the variables of the point.
            fraction: fraction of time, from 0 to 1.
            time_data: symbols of the data of the functions of time.
            number: index of the point.

        Returns:
            Point whose controls are zero where the actuator does not act.
        """
        variables = {}
        first_index = 0
        for kind in VARIABLE_KINDS:
            count = len(self.layout.names[kind]) if self.layout.has_kind(kind, number) else 0
            variables[kind] = z[first_index : first_index + count]
            first_index += count
        parameters = [s[2 + parameter_index] for parameter_index in self.problem.parameter_owners]
        u = SX(len(self.problem.functions.controls), 1)
        # Controls that do not vary stay structural zeros, which CasADi leaves out of formulas.
        u[[*map(self.problem.functions.controls.index, self.problem.controls)]] = variables[
            "controls"
        ]
        t = s[0] + fraction * (s[1] - s[0])
        return PointSymbols(
            problem=self.problem,
            t=casadi.vertcat(t, *(series.expand(t, time_data) for series in self.problem.loads)),
            x=variables["states"],
            u=u,
            multipliers=variables["multipliers"],
            derivatives=variables["derivatives"],
            slacks=variables["slacks"],
            projections=variables["projections"],
            p=casadi.vertcat(*parameters) if parameters else SX(0, 1),
            parameters=s[2:],
            time_data=time_data,
        )

    def _make_ends(self) -> None:
        """Make E: the parts of the cost and the endpoint constraints, with their derivatives."""
        problem = self.problem
        layout = self.layout
        size = layout.shared
        last_point = len(layout.point_indices) - 1
        s = SX.sym("s", size)
        z0 = SX.sym("z0", len(layout.point_indices[0]))
        z1 = SX.sym("z1", len(layout.point_indices[last_point]))
        totals = SX.sym("integrals", len(self.integrals))
        time_data = [SX.sym(f"known{k}", self.time_data_size) for k in range(2)]
        start = self.point(s, z0, SX(0.0), time_data[0], 0)
        end = self.point(s, z1, SX(1.0), time_data[1], last_point)
        costs = []
        rows = []
        self.costs: list[str] = []
        self.end_labels: list[str] = []
        limits: list[tuple[float, float]] = []
        for goal, terms in problem.goals:
            raise_interrupt()
            # By identity: goals may be equal.
            indices = [k for k, integral in enumerate(self.integrals) if integral[0] is goal]
            endpoints = Endpoints(start, end, totals[indices[0]] if indices else None)
            value = SX(terms.value(endpoints))
            if (goal.mode or terms.modes[0]) == "cost":
                # The values of an endpoint constraint are errors of either sign.
                value = value**2 if terms.modes[0] != "cost" else value
                costs.append(goal.weight * casadi.sum1(self._divide_value(goal, value, endpoints)))
                self.costs.append(goal.name)
                continue
            rows.append(self._divide_value(goal, value, endpoints))
            bounds = [
                read_range(end_formula) or (0.0, 0.0)
                for end_formula in goal.moco_constraint_info.bounds
            ]
            # A goal such as the periodicity has one value per pair, and its bounds are one range
            # per value.
            count = rows[-1].numel()
            if bounds and len(bounds) != count:
                raise problem.invalid_error(
                    goal,
                    f"it has {format_count(count, 'value')} and {format_count(len(bounds), 'bound')}",
                )
            limits += bounds or [(0.0, 0.0)] * count
            self.end_labels += [
                goal.name if count == 1 else f"{goal.name} {k}" for k in range(count)
            ]
        arguments = [s, z0, z1, totals, *time_data]
        cost = casadi.densify(casadi.vertcat(*costs)) if costs else SX.zeros(0, 1)
        end_rows = casadi.densify(casadi.vertcat(*rows)) if rows else SX.zeros(0, 1)
        # Accelerations at the ends are eliminated, as E is small and evaluated once.
        for symbol, equations in start.linear_systems + end.linear_systems:
            factors = casadi.ldl(casadi.jacobian(equations, symbol))
            solution = casadi.ldl_solve(-casadi.substitute(equations, symbol, 0), *factors)
            cost, end_rows = casadi.substitute([cost, end_rows], [symbol], [solution])
        end_variables = casadi.vertcat(s, z0, z1, totals)
        total = casadi.sum1(cost)
        multipliers = SX.sym("multipliers", end_rows.numel())
        factor = SX.sym("factor")
        self.end_columns = np.concatenate(
            [np.arange(size), layout.point_indices[0], layout.point_indices[last_point]]
        )
        lagrangian = factor * total + casadi.dot(multipliers, end_rows)
        self._end_value = BufferedFunction(casadi.Function("E", arguments, [cost, end_rows]))
        # Dense, as E depends on few variables; the pattern below tells which entries can be
        # nonzero.
        slopes = [
            casadi.densify(casadi.jacobian(end_formula, end_variables))
            for end_formula in (total, end_rows)
        ]
        self._end_slope = BufferedFunction(casadi.Function("dE", arguments, slopes))
        self._end_pattern = np.array(
            casadi.DM(casadi.jacobian(end_rows, end_variables).sparsity(), 1.0).full(), dtype=bool
        )
        hessian = casadi.hessian(lagrangian, end_variables)[0]
        self._end_hessian_pattern = np.array(casadi.DM(hessian.sparsity(), 1.0).full(), dtype=bool)
        self._end_curvature = BufferedFunction(
            casadi.Function("HE", [*arguments, factor, multipliers], [casadi.densify(hessian)])
        )
        self.labels += self.end_labels
        self.times = np.append(self.times, np.full(len(self.end_labels), np.nan))
        self.lower = np.append(self.lower, [lower for lower, _ in limits])
        self.upper = np.append(self.upper, [upper for _, upper in limits])

    def _divide_value(self, goal: Any, value: Any, ends: Endpoints) -> Any:
        """Return the value of a goal after its divisions by displacement, duration and mass.

        Args:
            goal: goal with the settings.
            value: value or column of values.
            ends: both ends of the motion.
        """
        if goal.divide_by_displacement:
            value = value / casadi.norm_2(ends.end.mass_center() - ends.start.mass_center())
        if goal.divide_by_duration:
            value = value / ends.duration
        return value / self.problem.functions.mechanism.total_mass if goal.divide_by_mass else value

    # ------------------------------------------------------------------------------------------ constant parts
    def _assemble_matrices(self) -> None:
        """Assemble A and B and the labels of their rows; the rows of the integrals follow those of g."""
        grid = self.problem.grid
        layout = self.layout
        # Index of the first result of F of each point in the stacked results of all groups.
        starts = np.zeros(len(grid.fractions), dtype=int)
        for group, offset in zip(self.groups, self._offsets, strict=False):
            starts[group.numbers] = offset + group.rows * np.arange(len(group.numbers))
        entries_a: list[tuple[Any, Any, Any]] = []
        entries_b: list[tuple[Any, Any, Any]] = []
        row = self._assemble_intervals(entries_a, entries_b, starts)
        self._row_count = self._assemble_points(entries_b, starts, row)
        self._assemble_integrals(entries_b, starts)
        size = self._row_count + len(self.integrals)

        def make_matrix(entry_groups: list[tuple[Any, Any, Any]], width: int) -> SparseMatrix:
            rows, columns, values = (
                np.concatenate([np.ravel(entries[k]) for entries in entry_groups])
                if entry_groups
                else np.zeros(0)
                for k in range(3)
            )
            return SparseMatrix.from_entries(rows, columns, values, (size, width))

        self._a: SparseMatrix = make_matrix(entries_a, len(layout.lower))
        self._b: SparseMatrix = make_matrix(entries_b, int(self._offsets[-1]))

    def _assemble_intervals(
        self,
        entries_a: list[tuple[Any, Any, Any]],
        entries_b: list[tuple[Any, Any, Any]],
        starts: Array,
    ) -> int:
        """Add the equations of the scheme for states and controls of each interval.

        Args:
            entries_a: rows, columns and values of A, to which entries are added.
            entries_b: rows, columns and values of B, to which entries are added.
            starts: index of the first result of F of each point.

        Returns:
            Number of the rows.
        """
        grid = self.problem.grid
        layout = self.layout
        scheme = grid.scheme
        states = layout.names["states"]
        controls = layout.names["controls"]
        count = len(states)
        projected = len(layout.names["projections"])
        # Moco can make controls linear between the nodes of an interval.
        lines = (
            scheme.controls if self.problem.solver.interpolate_control_mesh_interior_points else ()
        )
        interval_count = len(grid.lengths)
        points = np.array([grid.get_points(interval) for interval in range(interval_count)])
        labels = [f"{name} defect" for name in states] * len(scheme.states)
        labels += [f"{name} between nodes" for name in controls] * len(lines)
        first_row = len(labels) * np.arange(interval_count)[:, None]
        state_range = np.arange(count)
        for number, factors in enumerate(zip(scheme.states, scheme.rates, strict=True)):
            rows = first_row + number * count + state_range
            for k, (state_factor, rate_factor) in enumerate(zip(*factors, strict=True)):
                variables = layout.indices["states"][points[:, k]]
                results = state_range
                if projected and k == len(points[0]) - 1:
                    # The interval ends at the states before projection, whose rates follow those of
                    # the projected states among the results of F.
                    indices_before_projection = layout.indices["projections"][points[:, k]]
                    variables = np.hstack([indices_before_projection, variables[:, projected:]])
                    results = np.concatenate(
                        [count + state_range[:projected], state_range[projected:]]
                    )
                if state_factor:
                    entries_a.append((rows, variables, np.full(rows.shape, state_factor)))
                if rate_factor:
                    # F contains rates times the duration of the motion; the interval is a fraction.
                    weights = np.broadcast_to(grid.lengths[:, None] * rate_factor, rows.shape)
                    entries_b.append((rows, starts[points[:, k]][:, None] + results, weights))
        for number, line in enumerate(lines):
            rows = first_row + len(scheme.states) * count + number * len(controls)
            rows = rows + np.arange(len(controls))
            for k in np.flatnonzero(line).tolist():
                variables = layout.indices["controls"][points[:, k]]
                entries_a.append((rows, variables, np.full(rows.shape, line[k])))
        # Messages give the middle of the interval as the time of a defect.
        middles = 0.5 * (grid.fractions[points[:, 0]] + grid.fractions[points[:, -1]])
        self.labels += labels * interval_count
        self.times = np.repeat(middles, len(labels))
        self.lower = np.zeros(len(self.times))
        self.upper = np.zeros(len(self.times))
        return len(self.times)

    def _assemble_points(
        self, entries_b: list[tuple[Any, Any, Any]], starts: Array, row: int
    ) -> int:
        """Add the residuals and path constraints of each point.

        Args:
            entries_b: rows, columns and values of B, to which entries are added.
            starts: index of the first result of F of each point.
            row: first row.

        Returns:
            Row after the last one.
        """
        count = len(self.layout.names["states"])
        for group in self.groups:
            size = len(group.labels) * len(group.numbers)
            row_indices = np.arange(len(group.labels))
            # The results of F are rates, rates before projection, these rows, and integrands.
            results = starts[group.numbers][:, None] + count + group.projected + row_indices
            entries_b.append((row + np.arange(size), results, np.ones(size)))
            fractions = self.problem.grid.fractions[group.numbers]
            self.labels += group.labels * len(group.numbers)
            self.times = np.append(self.times, np.repeat(fractions, len(group.labels)))
            limits = group.limits * len(group.numbers)
            self.lower = np.append(self.lower, [lower for lower, _ in limits])
            self.upper = np.append(self.upper, [upper for _, upper in limits])
            row += size
        return row

    def _assemble_integrals(self, entries_b: list[tuple[Any, Any, Any]], starts: Array) -> None:
        """Add a row for each integral: integrands, the last results of F, times their quadrature weights.

        Args:
            entries_b: rows, columns and values of B, to which entries are added.
            starts: index of the first result of F of each point.
        """
        for k, (_, terms) in enumerate(self.integrals):
            for group in self.groups:
                results = starts[group.numbers] + group.rows - len(self.integrals) + k
                weights = (
                    np.ones(len(results))
                    if terms.is_sum
                    else self.problem.grid.weights[group.numbers]
                )
                rows = np.full(len(results), self._row_count + k)
                entries_b.append((rows, results, weights))

    def _list_entries(self, rows: str, columns: str) -> tuple[Array, Array]:
        """Return rows and columns of the derivatives of all points.

        Args:
            rows: attribute of the groups with the rows.
            columns: attribute of the groups with the columns.

        Returns:
            Rows and columns in the program of each entry.
        """
        row_arrays = []
        column_arrays = []
        for group, start in zip(self.groups, self._offsets, strict=False):
            local_rows = getattr(group, rows)
            local_columns = getattr(group, columns)
            count = len(group.numbers)
            variables = np.hstack(
                [np.tile(np.arange(self.layout.shared), (count, 1)), group.columns]
            )
            numbers = (
                start + group.rows * np.arange(count)[:, None] + local_rows
                if rows == "jacobian_rows"
                else variables[:, local_rows]
            )
            row_arrays.append(numbers.ravel())
            column_arrays.append(variables[:, local_columns].ravel())
        return np.concatenate(row_arrays), np.concatenate(column_arrays)

    def _map_jacobian(self) -> None:
        """Make the sparse map from the Jacobians of the points to that of A w + B F, and the part of A."""
        width = len(self.layout.lower)
        rows, columns = self._list_entries("jacobian_rows", "jacobian_columns")
        # An entry of a point's Jacobian appears once in each row of B F that contains its result of
        # F.
        point_entries = self._b.select_columns(rows.astype(np.int64))
        constant = self._a
        keys = np.concatenate(
            [
                point_entries.rows * np.int64(width) + columns[point_entries.columns],
                constant.rows * np.int64(width) + constant.columns,
            ]
        )
        # One integer per place of the Jacobian: entries of several points, and of A, at one place
        # are added.
        unique, inverse = np.unique(keys, return_inverse=True)
        count = len(point_entries.rows)
        self._jacobian_map = SparseMatrix.from_entries(
            inverse[:count], point_entries.columns, point_entries.values, (len(unique), len(rows))
        )
        self._jacobian_constant = np.bincount(
            inverse[count:], weights=constant.values, minlength=len(unique)
        )
        self._jacobian_rows = unique // width
        self._jacobian_columns = unique % width
        self._of_g = self._jacobian_rows < self._row_count

    def _map_ends(self) -> None:
        """Make the sparsity pattern of the endpoint constraints, whose rows follow the others."""
        width = len(self.layout.lower)
        direct = len(self.end_columns)
        pattern = np.zeros((len(self.end_labels), width), dtype=bool)
        pattern[:, self.end_columns] |= self._end_pattern[:, :direct]
        for k in range(len(self.integrals)):
            # Rows after those of g belong to the integrals.
            columns = self._jacobian_columns[self._jacobian_rows == self._row_count + k]
            # An integral depends on the variables of all points, and so does each endpoint
            # constraint on it.
            for row in np.flatnonzero(self._end_pattern[:, direct + k]):
                pattern[row, columns] = True
        self._end_entries = np.nonzero(pattern)
        rows = np.concatenate(
            [self._jacobian_rows[self._of_g], self._end_entries[0] + self._row_count]
        )
        columns = np.concatenate([self._jacobian_columns[self._of_g], self._end_entries[1]])
        # CasADi stores sparse matrices column by column.
        self._jacobian_order = np.lexsort((rows, columns))
        self.jacobian_sparsity = casadi.Sparsity.triplet(
            len(self.labels),
            width,
            rows[self._jacobian_order].tolist(),
            columns[self._jacobian_order].tolist(),
        )

    # ------------------------------------------------------------------------------------------------- numbers
    def _sample_time_functions(self, times: Array) -> Array:
        """Return the data of the functions of time (n, 3 k + 1) at times (n,): the time, then three numbers each."""
        key = times.tobytes()
        if key not in self._time_data:
            # Ipopt's line search alternates between few sets of times.
            if len(self._time_data) >= MAX_CACHED_TIMES:
                self._time_data.clear()
            values = (np.asarray(series.values(times)) for series in self.problem.time_functions)
            self._time_data[key] = np.vstack([times[None], *values]).T
        return self._time_data[key]

    def _make_point_arguments(self, group: PointGroup, w: Array) -> list[Array]:
        """Return the arguments of F for a group of points, one row per point."""
        return self._make_arguments(w, self.problem.grid.fractions[group.numbers], w[group.columns])

    def _make_arguments(self, w: Array, fractions: Array, z: Array) -> list[Array]:
        """Return the arguments of F at fractions of time (n,) with variables z (n, ...)."""
        s = w[: self.layout.shared]
        times = w[0] + fractions * (w[1] - w[0])
        # CasADi's mapped functions take one column per point, so that the shared variables are
        # repeated.
        return [np.tile(s, len(fractions)), z, fractions, self._sample_time_functions(times)]

    def _evaluate_groups(self, name: str, w: Array) -> Array:
        """Evaluate a function at all points.

        Args:
            name: "value" or "slope", the attribute of the groups with the function.
            w: variables (n,).

        Returns:
            Results of all groups in one array, group by group and point by point.
        """
        return np.concatenate(
            [
                getattr(group, name)(*self._make_point_arguments(group, w))[0].ravel()
                for group in self.groups
            ]
        )

    def _make_end_arguments(self, w: Array, totals: Array) -> list[Array]:
        """Return the arguments of E for variables w and integrals `totals`."""
        time_data = self._sample_time_functions(w[:2])
        first_variables = self.layout.point_indices[0]
        last_variables = self.layout.point_indices[-1]
        return [
            w[: self.layout.shared],
            w[first_variables],
            w[last_variables],
            totals,
            time_data[0],
            time_data[1],
        ]

    def compute_values(self, w: Array) -> tuple[Array, Array]:
        """Compute the parts of f, and g.

        Args:
            w: variables (n,).

        Returns:
            Parts of f in the order of `costs`, and g (m,).
        """
        rows = self._compute_rows(w)
        costs, end_rows = self._end_value(*self._make_end_arguments(w, rows[self._row_count :]))
        return costs.ravel(), np.concatenate([rows[: self._row_count], end_rows.ravel()])

    def compute_slopes(self, w: Array) -> tuple[Array, Array]:
        """Compute the first derivatives.

        Args:
            w: variables (n,).

        Returns:
            Gradient of f (n,), and the entries of the Jacobian of g in the order of
            `jacobian_sparsity`.
        """
        gradient, end_jacobian, numbers, _ = self._compute_slopes(w)
        entries = np.concatenate([numbers[self._of_g], end_jacobian[self._end_entries]])
        return gradient, entries[self._jacobian_order]

    def _compute_slopes(self, w: Array) -> tuple[Array, Array, Array, Array]:
        """Compute the parts that gradient, Jacobian and Hessian share.

        Returns:
            Gradient of f (n,), rows of the endpoint constraints (e, n), entries of the Jacobian of
            A w + B F, and the gradients of the integrals (i, n).
        """
        width = len(w)
        direct = len(self.end_columns)
        numbers = self._jacobian_constant + self._jacobian_map @ self._evaluate_groups("slope", w)
        integrals = np.zeros((len(self.integrals), width))
        is_integral = ~self._of_g
        integrals[
            self._jacobian_rows[is_integral] - self._row_count, self._jacobian_columns[is_integral]
        ] = numbers[is_integral]
        totals = self._compute_rows(w)[self._row_count :]
        cost, end_slopes = (
            matrix.T for matrix in self._end_slope(*self._make_end_arguments(w, totals))
        )
        # The chain rule: E depends on variables directly, and by the integrals.
        gradient = cost.ravel()[direct:] @ integrals
        gradient[self.end_columns] += cost.ravel()[:direct]
        end_jacobian = end_slopes[:, direct:] @ integrals
        end_jacobian[:, self.end_columns] += end_slopes[:, :direct]
        return gradient, end_jacobian, numbers, integrals
