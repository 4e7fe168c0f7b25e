"""The nonlinear program of a problem, with its sparse exact derivatives.

At each point k of the grid one function of CasADi, F(s, z_k), has all that is not linear: rates
times the duration, residuals, integrands times the duration. s are the times and the parameters,
z_k the variables of the point. What must be zero is ``A w + B F`` with constant sparse A and B; so
Jacobian and Hessian are constant sparse maps of the numbers that the functions' own derivatives
have, and nothing is differentiated twice. What depends on both ends is one more function, E(s, z_0,
z_n, integrals).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.bounds import read_range
from osimlite.optimal.layout import VARIABLE_KINDS, Layout
from osimlite.optimal.point import Endpoints, Point
from osimlite.optimal.problem import Problem
from osimlite.optimal.sparse import SparseMatrix

SX: Any = casadi.SX


class BufferedFunction:
    """A function of CasADi on arrays, without what its own call takes to convert them.

    Args:
        function: of dense matrices.
    """

    def __init__(self, function: Any) -> None:
        self._buffer, self._run = function.buffer()
        self._given = [np.zeros(function.nnz_in(k)) for k in range(function.n_in())]
        self._results = [np.zeros(function.size_out(k)[::-1]) for k in range(function.n_out())]
        for k, array in enumerate(self._given):
            self._buffer.set_arg(k, array.data)
        for k, array in enumerate(self._results):
            if array.size:
                self._buffer.set_res(k, array.reshape(-1).data)

    def __call__(self, *given: Array) -> list[Array]:
        """Results, and what is given, have their columns as rows."""
        for own, array in zip(self._given, given, strict=True):
            own[:] = array.reshape(-1)
        self._run()
        return [array.copy() for array in self._results]


def cache_last(law: Callable[[Array], Any]) -> Callable[[Array], Any]:
    """The law, that keeps its result for the array that it was last asked for."""
    kept: Any = None

    def result(x: Array) -> Any:
        nonlocal kept
        if kept is None or not np.array_equal(kept[0], x):
            kept = x.copy(), law(x)
        return kept[1]

    return result


class PointFormula:
    """F and its derivatives at a point of one group, whatever the mesh: those of the mesh, or those between."""

    def __init__(self, program: Program, number: int, size: int) -> None:
        problem, layout = program.problem, program.layout
        is_mesh = bool(problem.grid.is_mesh[number])
        self.projected = (
            len(layout.names["projections"]) if layout.has_kind("projections", number) else 0
        )
        s, z = SX.sym("s", layout.shared), SX.sym("z", size)
        place, known = SX.sym("place"), SX.sym("known", program.known_size)
        point = program.point(s, z, place, known, number)
        duration = s[1] - s[0]
        names, residuals = problem.dynamics.compute_residuals(point)
        rows, labels, limits = [residuals], [*names], [(0.0, 0.0)] * len(names)
        if is_mesh or problem.solver.enforce_path_constraint_mesh_interior_points:
            for own in problem.path_rows:
                rows.append(own.formula(point))
                labels += own.labels
                limits += own.limits
        names, errors = problem.dynamics.compute_constraint_errors(point, is_mesh)
        rows.append(errors)
        labels += names
        limits += [read_range(problem.phase.kinematic_constraint_bounds) or (0.0, 0.0)] * len(names)
        rates = [problem.dynamics.correct_rates(point)]
        if self.projected:
            rates.append(point.before_projection.rates[: self.projected])
            names, errors = problem.dynamics.compute_projection_errors(point)
            rows.append(errors)
            labels += names
            limits += [(0.0, 0.0)] * len(names)
        integrands = [
            terms.integrand(point) if terms.is_sum else duration * terms.integrand(point)
            for _, terms in program.integrals
        ]
        column = casadi.vertcat(duration * casadi.vertcat(*rates), *rows, *integrands)
        # What is common is found before anything is differentiated: later that takes ten times as
        # long, and finds less.
        solved, equations = (
            casadi.vertcat(SX(0, 1), *(pair[k] for pair in point.linear_systems)) for k in range(2)
        )
        self.labels, self.limits, self.rows = labels, limits, column.numel()
        parts = casadi.cse(casadi.densify(casadi.vertcat(column, equations)))
        self._given, self._both, self._unknown = [s, z, place, known], casadi.vertcat(s, z), solved
        self._column, self._equations = parts[: self.rows], parts[self.rows :]
        slopes, width = (
            casadi.jacobian(parts, casadi.vertcat(self._both, solved)),
            self._both.numel(),
        )
        jacobian, self._by_solved = slopes[: self.rows, :width], slopes[: self.rows, width:]
        self._value, self._moved = SX(0, 1), SX(0, width)
        if solved.numel():
            # Not differentiated is how the equations are solved: slopes follow from theirs.
            self._factors = casadi.ldl(slopes[self.rows :, width:])
            self._value = casadi.ldl_solve(
                -casadi.substitute(self._equations, solved, 0), *self._factors
            )
            self._moved = -casadi.sparsify(
                casadi.ldl_solve(slopes[self.rows :, :width], *self._factors)
            )
            jacobian += self._by_solved @ self._moved
        self.jacobian_entries = [*map(np.array, jacobian.sparsity().get_triplet())]
        self.value = self._function("F", self._given, self._column)
        self.slope = self._function("J", self._given, casadi.vertcat(*jacobian.nonzeros()))

    def _function(self, name: str, given: list[Any], column: Any) -> Any:
        """One whose formula has the solutions of the equations in the places of their symbols."""
        return casadi.Function(name, given, [casadi.substitute(column, self._unknown, self._value)])

    @cached_property
    def curvature(self) -> tuple[Any, list[Any]]:
        """The second derivatives, with their rows and columns; they are only made if they are asked for."""
        multipliers, pushes = (
            SX.sym("multipliers", self.rows),
            SX.sym("pushes", self._unknown.numel()),
        )
        combined = casadi.dot(multipliers, self._column) + casadi.dot(pushes, self._equations)
        hessian = casadi.hessian(combined, casadi.vertcat(self._both, self._unknown))[0]
        if self._unknown.numel():
            # With these multipliers of the equations the sum does not depend on their solution.
            found = casadi.ldl_solve(-self._by_solved.T @ multipliers, *self._factors)
            along = casadi.vertcat(SX.eye(self._both.numel()), self._moved)
            hessian = casadi.substitute(along.T @ hessian @ along, pushes, found)
        hessian = casadi.triu(hessian)
        function = self._function(
            "H", [*self._given, multipliers], casadi.vertcat(*hessian.nonzeros())
        )
        return function, [*map(np.array, hessian.sparsity().get_triplet())]


class PointGroup:
    """F and its derivatives for the points of one group."""

    def __init__(self, program: Program, numbers: list[int]) -> None:
        problem, layout = program.problem, program.layout
        self.numbers = np.array(numbers, dtype=int)
        self.columns = np.array([layout.point_indices[number] for number in numbers])
        sort = bool(problem.grid.is_mesh[numbers[0]]), layout.has_kind("projections", numbers[0])
        if sort not in problem.formulas:
            problem.formulas[sort] = PointFormula(program, numbers[0], self.columns.shape[1])
        self.formula = formula = problem.formulas[sort]
        self.projected = formula.projected
        self.labels, self.limits, self.rows = formula.labels, formula.limits, formula.rows
        self.jacobian_rows, self.jacobian_columns = formula.jacobian_entries
        self.value, self.slope = (
            BufferedFunction(each.map(len(numbers))) for each in (formula.value, formula.slope)
        )

    def evaluate(self, program: Program, w: Array, places: Array, z: Array) -> Array:
        """F (n, rows) at other places (n,), from 0 to 1, with these variables (n, ...)."""
        given = program._arguments_at(w, places, z)
        return BufferedFunction(self.formula.value.map(len(places)))(*given)[0]

    def make_hessian(self) -> None:
        """The second derivatives are only made if they are asked for."""
        function, (self.hessian_rows, self.hessian_columns) = self.formula.curvature
        self.curvature = BufferedFunction(function.map(len(self.numbers)))


class Program:
    """The nonlinear program: minimize f(w) with lower <= g(w) <= upper.

    Attributes: problem: that is solved. layout: of the variables w. labels: of the rows of g.
        times: of the rows, from 0 at the start to 1 at the end; of what concerns both ends not a
        number. lower: bounds of g. upper: bounds of g. costs: names of the parts of f.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.layout = problem, Layout(problem)
        self._found: dict[bytes, Array] = {}
        self._compute_rows = cache_last(
            lambda w: self._a @ w + self._b @ self._evaluate_groups("value", w)
        )
        self.labels: list[str] = []
        self.times: Array = np.zeros(0)
        self.lower: Array = np.zeros(0)
        self.upper: Array = np.zeros(0)
        self.known_size = 1 + 3 * len(problem.time_functions)
        self.integrals: list[Any] = [
            (goal, terms) for goal, terms in problem.goals if terms.integrand is not None
        ]
        points, is_mesh = range(len(problem.grid.fractions)), problem.grid.is_mesh
        groups = [[k for k in points if is_mesh[k]], [k for k in points if not is_mesh[k]]]
        inside = (
            problem.solver.enforce_path_constraint_mesh_interior_points or not problem.path_rows
        )
        if inside and not problem.has_constraints:
            groups = [[*points]]
        if problem.uses_projection:
            # Nothing leads to the first point.
            groups = [[0], groups[0][1:], groups[1]]
        self.groups = [PointGroup(self, numbers) for numbers in groups if numbers]
        self._offsets = np.cumsum([0, *(group.rows * len(group.numbers) for group in self.groups)])
        self._assemble()
        self._make_ends()
        self._map_jacobian()
        self._map_ends()

    # --------------------------------------------------------------------------------------------- formulas
    def point(self, s: Any, z: Any, place: Any, known: Any, number: int) -> Point:
        """The formulas at a point of the grid, for all that have the same variables as one of them."""
        parts, first = {}, 0
        for kind in VARIABLE_KINDS:
            count = len(self.layout.names[kind]) if self.layout.has_kind(kind, number) else 0
            parts[kind] = z[first : first + count]
            first += count
        parameters = [s[2 + owner] for owner in self.problem.parameter_owners]
        u = SX(len(self.problem.functions.controls), 1)
        u[[*map(self.problem.functions.controls.index, self.problem.controls)]] = parts["controls"]
        t = s[0] + place * (s[1] - s[0])
        return Point(
            problem=self.problem,
            t=casadi.vertcat(t, *(series.expand(t, known) for series in self.problem.loads)),
            x=parts["states"],
            u=u,
            multipliers=parts["multipliers"],
            derivatives=parts["derivatives"],
            slacks=parts["slacks"],
            projections=parts["projections"],
            p=casadi.vertcat(*parameters) if parameters else SX(0, 1),
            parameters=s[2:],
            known=known,
        )

    def _make_ends(self) -> None:
        """E: the parts of the cost, and what goals want to be zero at the ends."""
        problem, layout = self.problem, self.layout
        size, last = layout.shared, len(layout.point_indices) - 1
        s = SX.sym("s", size)
        z0, z1 = (
            SX.sym("z0", len(layout.point_indices[0])),
            SX.sym("z1", len(layout.point_indices[last])),
        )
        totals = SX.sym("integrals", len(self.integrals))
        known = [SX.sym(f"known{k}", self.known_size) for k in range(2)]
        start = self.point(s, z0, SX(0.0), known[0], 0)
        end = self.point(s, z1, SX(1.0), known[1], last)
        costs, rows = [], []
        self.costs: list[str] = []
        self.end_labels: list[str] = []
        limits: list[tuple[float, float]] = []
        for goal, terms in problem.goals:
            has = [k for k, pair in enumerate(self.integrals) if pair[0] is goal]
            ends = Endpoints(start, end, totals[has[0]] if has else None)
            value = SX(terms.value(ends))
            if (goal.mode or terms.modes[0]) == "cost":
                value = value**2 if terms.modes[0] != "cost" else value
                costs.append(goal.weight * casadi.sum1(self._divided(goal, value, ends)))
                self.costs.append(goal.name)
                continue
            rows.append(self._divided(goal, value, ends))
            bounds = [read_range(each) or (0.0, 0.0) for each in goal.moco_constraint_info.bounds]
            count = rows[-1].numel()
            if bounds and len(bounds) != count:
                raise problem.invalid_error(
                    goal, f"it has {count} values and bounds for {len(bounds)}"
                )
            limits += bounds or [(0.0, 0.0)] * count
            self.end_labels += [
                goal.name if count == 1 else f"{goal.name} {k}" for k in range(count)
            ]
        given = [s, z0, z1, totals, *known]
        cost = casadi.densify(casadi.vertcat(*costs)) if costs else SX.zeros(0, 1)
        wanted = casadi.densify(casadi.vertcat(*rows)) if rows else SX.zeros(0, 1)
        for symbol, equations in start.linear_systems + end.linear_systems:
            factors = casadi.ldl(casadi.jacobian(equations, symbol))
            solution = casadi.ldl_solve(-casadi.substitute(equations, symbol, 0), *factors)
            cost, wanted = casadi.substitute([cost, wanted], [symbol], [solution])
        both = casadi.vertcat(s, z0, z1, totals)
        total, multipliers = casadi.sum1(cost), SX.sym("multipliers", wanted.numel())
        factor = SX.sym("factor")
        self.end_columns = np.concatenate(
            [np.arange(size), layout.point_indices[0], layout.point_indices[last]]
        )
        lagrangian = factor * total + casadi.dot(multipliers, wanted)
        self._end_value = BufferedFunction(casadi.Function("E", given, [cost, wanted]))
        slopes = [casadi.densify(casadi.jacobian(each, both)) for each in (total, wanted)]
        self._end_slope = BufferedFunction(casadi.Function("dE", given, slopes))
        self._end_pattern = np.array(
            casadi.DM(casadi.jacobian(wanted, both).sparsity(), 1.0).full(), dtype=bool
        )
        hessian = casadi.hessian(lagrangian, both)[0]
        self._end_hessian_pattern = np.array(casadi.DM(hessian.sparsity(), 1.0).full(), dtype=bool)
        self._end_curvature = BufferedFunction(
            casadi.Function("HE", [*given, factor, multipliers], [casadi.densify(hessian)])
        )
        self.labels += self.end_labels
        self.times = np.append(self.times, np.full(len(self.end_labels), np.nan))
        self.lower = np.append(self.lower, [low for low, _ in limits])
        self.upper = np.append(self.upper, [high for _, high in limits])

    def _divided(self, goal: Any, value: Any, ends: Endpoints) -> Any:
        if goal.divide_by_displacement:
            value = value / casadi.norm_2(ends.end.mass_center() - ends.start.mass_center())
        if goal.divide_by_duration:
            value = value / ends.duration
        return value / self.problem.functions.mechanism.total_mass if goal.divide_by_mass else value

    # ------------------------------------------------------------------------------------------ constant parts
    def _assemble(self) -> None:
        """A and B, with the labels of their rows; behind those of g the rows of the integrals."""
        grid, layout = self.problem.grid, self.layout
        states, controls = layout.names["states"], layout.names["controls"]
        scheme, count = grid.scheme, len(layout.names["states"])
        start_of = np.zeros(len(grid.fractions), dtype=int)
        for group, offset in zip(self.groups, self._offsets, strict=False):
            start_of[group.numbers] = offset + group.rows * np.arange(len(group.numbers))
        a: list[tuple[Any, Any, Any]] = []
        b: list[tuple[Any, Any, Any]] = []
        lines = (
            scheme.controls if self.problem.solver.interpolate_control_mesh_interior_points else ()
        )
        many, moved = len(grid.lengths), len(layout.names["projections"])
        points = np.array([grid.get_points(interval) for interval in range(many)])
        labels = [f"{name} defect" for name in states] * len(scheme.states)
        labels += [f"{name} between nodes" for name in controls] * len(lines)
        first = len(labels) * np.arange(many)[:, None]
        for number, pair in enumerate(zip(scheme.states, scheme.rates, strict=True)):
            rows, at = first + number * count + np.arange(count), np.arange(count)
            for k, (own, rate) in enumerate(zip(*pair, strict=True)):
                places, of = layout.indices["states"][points[:, k]], at
                if moved and k == len(points[0]) - 1:
                    # What the interval leads to is moved onto the constraints afterwards.
                    ends = layout.indices["projections"][points[:, k]]
                    places, of = (
                        np.hstack([ends, places[:, moved:]]),
                        np.concatenate([count + at[:moved], at[moved:]]),
                    )
                if own:
                    a.append((rows, places, np.full(rows.shape, own)))
                if rate:
                    each = np.broadcast_to(grid.lengths[:, None] * rate, rows.shape)
                    b.append((rows, start_of[points[:, k]][:, None] + of, each))
        for number, line in enumerate(lines):
            rows = (
                first
                + len(scheme.states) * count
                + number * len(controls)
                + np.arange(len(controls))
            )
            for k in np.flatnonzero(line).tolist():
                a.append(
                    (rows, layout.indices["controls"][points[:, k]], np.full(rows.shape, line[k]))
                )
        self.labels += labels * many
        middles = 0.5 * (grid.fractions[points[:, 0]] + grid.fractions[points[:, -1]])
        times, row = [np.repeat(middles, len(labels))], len(labels) * many
        limits: list[tuple[float, float]] = [(0.0, 0.0)] * row
        for group in self.groups:
            each, size = np.arange(len(group.labels)), len(group.labels) * len(group.numbers)
            of = start_of[group.numbers][:, None] + count + group.projected + each
            b.append((row + np.arange(size), of, np.ones(size)))
            self.labels += group.labels * len(group.numbers)
            times.append(np.repeat(grid.fractions[group.numbers], len(group.labels)))
            limits += group.limits * len(group.numbers)
            row += size
        self._row_count = row
        for k, (_, terms) in enumerate(self.integrals):
            for group in self.groups:
                at = start_of[group.numbers] + group.rows - len(self.integrals) + k
                weights = np.ones(len(at)) if terms.is_sum else grid.weights[group.numbers]
                b.append((np.full(len(at), row + k), at, weights))
        size = row + len(self.integrals)

        def matrix(parts: list[tuple[Any, Any, Any]], width: int) -> SparseMatrix:
            found: list[Any] = [
                np.concatenate([np.ravel(part[k]) for part in parts]) if parts else []
                for k in range(3)
            ]
            return SparseMatrix.from_entries(found[0], found[1], found[2], (size, width))

        self._a, self._b = matrix(a, len(layout.lower)), matrix(b, int(self._offsets[-1]))
        self.times = np.concatenate(times)
        self.lower, self.upper = (np.array([limit[k] for limit in limits]) for k in range(2))

    def _entries(self, rows: str, columns: str) -> tuple[Array, Array]:
        """Of the derivatives of all points: which rows and columns their numbers belong to."""
        first, second = [], []
        for group, start in zip(self.groups, self._offsets, strict=False):
            r, c, count = getattr(group, rows), getattr(group, columns), len(group.numbers)
            places = np.hstack([np.tile(np.arange(self.layout.shared), (count, 1)), group.columns])
            own = (
                start + group.rows * np.arange(count)[:, None] + r
                if rows == "jacobian_rows"
                else places[:, r]
            )
            first.append(own.ravel())
            second.append(places[:, c].ravel())
        return np.concatenate(first), np.concatenate(second)

    def _map_jacobian(self) -> None:
        """How the numbers of the points' Jacobians make up those of A + B J."""
        width = len(self.layout.lower)
        rows, columns = self._entries("jacobian_rows", "jacobian_columns")
        spread, own = self._b.select_columns(rows.astype(np.int64)), self._a
        keys = np.concatenate(
            [
                spread.rows * np.int64(width) + columns[spread.columns],
                own.rows * np.int64(width) + own.columns,
            ]
        )
        unique, inverse = np.unique(keys, return_inverse=True)
        count = len(spread.rows)
        self._jacobian_map = SparseMatrix.from_entries(
            inverse[:count], spread.columns, spread.values, (len(unique), len(rows))
        )
        self._jacobian_constant = np.bincount(
            inverse[count:], weights=own.values, minlength=len(unique)
        )
        self._jacobian_rows, self._jacobian_columns = unique // width, unique % width
        self._of_g = self._jacobian_rows < self._row_count

    def _map_ends(self) -> None:
        """The pattern of the rows at the ends, behind the others."""
        width, direct = len(self.layout.lower), len(self.end_columns)
        pattern = np.zeros((len(self.end_labels), width), dtype=bool)
        pattern[:, self.end_columns] |= self._end_pattern[:, :direct]
        for k in range(len(self.integrals)):
            columns = self._jacobian_columns[self._jacobian_rows == self._row_count + k]
            for row in np.flatnonzero(self._end_pattern[:, direct + k]):
                pattern[row, columns] = True
        self._end_entries = np.nonzero(pattern)
        rows = np.concatenate(
            [self._jacobian_rows[self._of_g], self._end_entries[0] + self._row_count]
        )
        columns = np.concatenate([self._jacobian_columns[self._of_g], self._end_entries[1]])
        # CasADi's columns come one after the other.
        self._jacobian_order = np.lexsort((rows, columns))
        self.jacobian_sparsity = casadi.Sparsity.triplet(
            len(self.labels),
            width,
            rows[self._jacobian_order].tolist(),
            columns[self._jacobian_order].tolist(),
        )

    # ------------------------------------------------------------------------------------------------- numbers
    def _known(self, times: Array) -> Array:
        """What the series are made of at times (n,): (n, 3 k + 1)."""
        key = times.tobytes()
        if key not in self._found:
            if len(self._found) >= 8:
                self._found.clear()
            values = (np.asarray(series.values(times)) for series in self.problem.time_functions)
            self._found[key] = np.vstack([times[None], *values]).T
        return self._found[key]

    def _point_arguments(self, group: PointGroup, w: Array) -> list[Array]:
        return self._arguments_at(w, self.problem.grid.fractions[group.numbers], w[group.columns])

    def _arguments_at(self, w: Array, places: Array, z: Array) -> list[Array]:
        """What the function of a point is given at places (n,) with variables z (n, ...)."""
        s = w[: self.layout.shared]
        times = w[0] + places * (w[1] - w[0])
        return [np.tile(s, len(places)), z, places, self._known(times)]

    def _evaluate_groups(self, name: str, w: Array) -> Array:
        return np.concatenate(
            [
                getattr(group, name)(*self._point_arguments(group, w))[0].ravel()
                for group in self.groups
            ]
        )

    def _end_arguments(self, w: Array, totals: Array) -> list[Array]:
        known = self._known(w[:2])
        first, last = self.layout.point_indices[0], self.layout.point_indices[-1]
        return [w[: self.layout.shared], w[first], w[last], totals, known[0], known[1]]

    def compute_values(self, w: Array) -> tuple[Array, Array]:
        """The parts of f, and g."""
        rows = self._compute_rows(w)
        costs, wanted = self._end_value(*self._end_arguments(w, rows[self._row_count :]))
        return costs.ravel(), np.concatenate([rows[: self._row_count], wanted.ravel()])

    def compute_slopes(self, w: Array) -> tuple[Array, Array]:
        """The gradient of f, and the numbers of the Jacobian of g in the order of `jacobian_sparsity`."""
        gradient, ends, numbers, _ = self._compute_slopes(w)
        entries = np.concatenate([numbers[self._of_g], ends[self._end_entries]])
        return gradient, entries[self._jacobian_order]

    def _compute_slopes(self, w: Array) -> tuple[Array, Array, Array, Array]:
        width, direct = len(w), len(self.end_columns)
        numbers = self._jacobian_constant + self._jacobian_map @ self._evaluate_groups("slope", w)
        integrals = np.zeros((len(self.integrals), width))
        of = ~self._of_g
        integrals[self._jacobian_rows[of] - self._row_count, self._jacobian_columns[of]] = numbers[
            of
        ]
        totals = self._compute_rows(w)[self._row_count :]
        cost, wanted = (part.T for part in self._end_slope(*self._end_arguments(w, totals)))
        gradient = cost.ravel()[direct:] @ integrals
        gradient[self.end_columns] += cost.ravel()[:direct]
        ends = wanted[:, direct:] @ integrals
        ends[:, self.end_columns] += wanted[:, :direct]
        return gradient, ends, numbers, integrals
