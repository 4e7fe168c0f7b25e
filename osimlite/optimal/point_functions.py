"""CasADi functions of the points of a grid: values, Jacobians and Hessians."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.derivatives.symbols import casadi, raise_interrupt
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.bounds import read_range

if TYPE_CHECKING:
    from osimlite.optimal.program import Program

SX: Any = casadi.SX
"""Type of CasADi's symbolic scalar expressions."""


class BufferedFunction:
    """CasADi function on NumPy arrays, called through buffers: CasADi's own call mostly converts arguments.

    Args:
        function: CasADi function of dense matrices.
    """

    def __init__(self, function: Any) -> None:
        self._buffer, self._run = function.buffer()
        self._inputs = [np.zeros(function.nnz_in(k)) for k in range(function.n_in())]
        self._results = [np.zeros(function.size_out(k)[::-1]) for k in range(function.n_out())]
        for k, array in enumerate(self._inputs):
            self._buffer.set_arg(k, array.data)
        for k, array in enumerate(self._results):
            if array.size:
                self._buffer.set_res(k, array.reshape(-1).data)

    def __call__(self, *values: Array) -> list[Array]:
        """Return the results for some arguments.

        Args:
            values: array of each argument; its rows are the columns of CasADi's matrix.

        Returns:
            Array of each result, whose rows are the columns of CasADi's matrix.
        """
        for buffer, array in zip(self._inputs, values, strict=True):
            buffer[:] = array.reshape(-1)
        self._run()
        # The next call overwrites the buffers.
        return [array.copy() for array in self._results]


def cache_last(law: Callable[[Array], Any]) -> Callable[[Array], Any]:
    """Return a function that caches its result for the last array it was called with.

    Args:
        law: function of an array.
    """
    cached: Any = None

    def result(x: Array) -> Any:
        nonlocal cached
        if cached is None or not np.array_equal(cached[0], x):
            # The caller may change its array in place: Ipopt reuses the memory of x.
            cached = x.copy(), law(x)
        return cached[1]

    return result


class PointFormula:
    """F and its derivatives at points with the same variables, independent of the mesh.

    Accelerations are not eliminated in the formulas: they are symbols that linear equations with a
    symmetric matrix determine (`Point.linear_systems`), which is factorized once for values, first
    and second derivatives.

    Args:
        program: nonlinear program.
        number: index of one of the points.
        size: number of variables of each point.

    Attributes:
        projected: number of values and speeds before projection; 0 without projection.
        labels: labels of the rows between rates and integrands.
        limits: lower and upper bound of each of these rows.
        rows: number of all results of F.
        jacobian_entries: rows and columns of the entries of the Jacobian by (s, z).
        value: CasADi function F(s, z, fraction, known).
        slope: CasADi function of the entries of the Jacobian, with the same arguments.
    """

    def __init__(self, program: Program, number: int, size: int) -> None:
        problem = program.problem
        layout = program.layout
        is_mesh = bool(problem.grid.is_mesh[number])
        self.projected = (
            len(layout.names["projections"]) if layout.has_kind("projections", number) else 0
        )
        s = SX.sym("s", layout.shared)
        z = SX.sym("z", size)
        fraction = SX.sym("fraction")
        time_data = SX.sym("known", program.time_data_size)
        point = program.point(s, z, fraction, time_data, number)
        # Rates are per fraction of the motion, as the duration may vary.
        duration = s[1] - s[0]
        names, residuals = problem.dynamics.compute_residuals(point)
        rows = [residuals]
        labels = [*names]
        limits = [(0.0, 0.0)] * len(names)
        if is_mesh or problem.solver.enforce_path_constraint_mesh_interior_points:
            for constraint in problem.path_rows:
                rows.append(constraint.formula(point))
                labels += constraint.labels
                limits += constraint.limits
        names, errors = problem.dynamics.compute_constraint_errors(point, is_mesh)
        rows.append(errors)
        labels += names
        limits += [read_range(problem.phase.kinematic_constraint_bounds) or (0.0, 0.0)] * len(names)
        raise_interrupt()
        # The order of the results: rates, rates before projection, rows, integrands.
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
        # Eliminate common subexpressions before differentiating: afterwards it takes ten times as
        # long and finds fewer.
        implicit, equations = (
            casadi.vertcat(SX(0, 1), *(system_pair[k] for system_pair in point.linear_systems))
            for k in range(2)
        )
        self.labels = labels
        self.limits = limits
        self.rows = column.numel()
        raise_interrupt()
        simplified = casadi.cse(casadi.densify(casadi.vertcat(column, equations)))
        self._inputs = [s, z, fraction, time_data]
        self._variables = casadi.vertcat(s, z)
        self._implicit = implicit
        self._column = simplified[: self.rows]
        self._equations = simplified[self.rows :]
        raise_interrupt()
        slopes = casadi.jacobian(simplified, casadi.vertcat(self._variables, implicit))
        width = self._variables.numel()
        jacobian = slopes[: self.rows, :width]
        self._slope_by_implicit = slopes[: self.rows, width:]
        self._implicit_value = SX(0, 1)
        self._implicit_slope = SX(0, width)
        if implicit.numel():
            # The solution of the equations is not differentiated: its derivatives follow from the
            # implicit function theorem, with the factors of the same symmetric matrix.
            self._factors = casadi.ldl(slopes[self.rows :, width:])
            self._implicit_value = casadi.ldl_solve(
                -casadi.substitute(self._equations, implicit, 0), *self._factors
            )
            self._implicit_slope = -casadi.sparsify(
                casadi.ldl_solve(slopes[self.rows :, :width], *self._factors)
            )
            jacobian += self._slope_by_implicit @ self._implicit_slope
        raise_interrupt()
        self.jacobian_entries = [*map(np.array, jacobian.sparsity().get_triplet())]
        self.value = self._make_function("F", self._inputs, self._column)
        self.slope = self._make_function("J", self._inputs, casadi.vertcat(*jacobian.nonzeros()))

    def _make_function(self, name: str, arguments: list[Any], column: Any) -> Any:
        """Return a CasADi function in which solutions replace the symbols of the linear equations.

        Args:
            name: name of the function.
            arguments: symbols of its arguments.
            column: formula of its result.
        """
        return casadi.Function(
            name, arguments, [casadi.substitute(column, self._implicit, self._implicit_value)]
        )

    @cached_property
    def curvature(self) -> tuple[Any, list[Any]]:
        """CasADi function of the upper triangle of the second derivatives of ``multipliers · F``.

        It is only made when it is used, as it takes longest.

        Returns:
            Function of the arguments of F and of the multipliers of its results, and rows and
            columns of the entries of its result.
        """
        multipliers = SX.sym("multipliers", self.rows)
        adjoints = SX.sym("adjoints", self._implicit.numel())
        combined = casadi.dot(multipliers, self._column) + casadi.dot(adjoints, self._equations)
        hessian = casadi.hessian(combined, casadi.vertcat(self._variables, self._implicit))[0]
        if self._implicit.numel():
            # With these multipliers of the equations (adjoint variables) the first derivative of the
            # sum by their solution vanishes, so that its second derivatives do not enter.
            adjoint_values = casadi.ldl_solve(
                -self._slope_by_implicit.T @ multipliers, *self._factors
            )
            directions = casadi.vertcat(SX.eye(self._variables.numel()), self._implicit_slope)
            hessian = casadi.substitute(
                directions.T @ hessian @ directions, adjoints, adjoint_values
            )
        # Ipopt reads the upper triangle only.
        hessian = casadi.triu(hessian)
        function = self._make_function(
            "H", [*self._inputs, multipliers], casadi.vertcat(*hessian.nonzeros())
        )
        return function, [*map(np.array, hessian.sparsity().get_triplet())]


class PointGroup:
    """F and its derivatives at all points of a grid that have the same variables.

    Args:
        program: nonlinear program.
        numbers: indices of the points.

    Attributes:
        numbers: indices of the points (k,).
        columns: indices of the variables of each point (k, z).
        formula: formulas of one point.
        projected: number of values and speeds before projection.
        labels: labels of the rows of a point.
        limits: lower and upper bound of each row of a point.
        rows: number of results of F at a point.
        jacobian_rows: row of each entry of a point's Jacobian.
        jacobian_columns: column of each entry among the variables (s, z).
        value: function F of all points.
        slope: function of the entries of the Jacobians of all points.
    """

    def __init__(self, program: Program, numbers: list[int]) -> None:
        problem = program.problem
        layout = program.layout
        self.numbers = np.array(numbers, dtype=int)
        self.columns = np.array([layout.point_indices[number] for number in numbers])
        # Programs on finer meshes share the formulas of a point, which do not depend on the mesh.
        key = bool(problem.grid.is_mesh[numbers[0]]), layout.has_kind("projections", numbers[0])
        if key not in problem.formulas:
            problem.formulas[key] = PointFormula(program, numbers[0], self.columns.shape[1])
        self.formula = formula = problem.formulas[key]
        self.projected = formula.projected
        self.labels = formula.labels
        self.limits = formula.limits
        self.rows = formula.rows
        self.jacobian_rows, self.jacobian_columns = formula.jacobian_entries
        self.value, self.slope = (
            BufferedFunction(function.map(len(numbers)))
            for function in (formula.value, formula.slope)
        )

    def evaluate(self, program: Program, w: Array, fractions: Array, z: Array) -> Array:
        """Compute F at other fractions of time.

        Args:
            program: nonlinear program of the group.
            w: variables of the program (n,), from which times and parameters are taken.
            fractions: fractions of the motion (k,), from 0 to 1.
            z: variables of the points (k, z).

        Returns:
            Results of F (k, rows).
        """
        arguments = program._make_arguments(w, fractions, z)
        return BufferedFunction(self.formula.value.map(len(fractions)))(*arguments)[0]

    def make_hessian(self) -> None:
        """Make the function of the second derivatives, which a quasi-Newton search never needs."""
        function, (self.hessian_rows, self.hessian_columns) = self.formula.curvature
        self.curvature = BufferedFunction(function.map(len(self.numbers)))
