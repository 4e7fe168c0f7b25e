"""Mesh refinement: estimate the error of each interval and split intervals with a large error.

After J. T. Betts, Practical Methods for Optimal Control, 2010, section 4.7: within an interval the
states are the polynomial of the scheme, and the error is the difference between its rate and the
equations of motion.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from math import inf
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.base.text import format_count, suggest_or_list
from osimlite.errors import SettingError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.ipopt import Progress, SolverResult
from osimlite.optimal.ipopt import run_ipopt as search
from osimlite.optimal.layout import VARIABLE_KINDS
from osimlite.optimal.problem import Problem
from osimlite.optimal.program import Program
from osimlite.optimal.schemes import Grid

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
SAMPLE_FRACTIONS = 0.5 * _NODES + 0.5
"""Gauss-Legendre nodes within an interval, from 0 to 1, at which the error is sampled."""
SAMPLE_WEIGHTS = 0.5 * _WEIGHTS
"""Gauss-Legendre weights of `SAMPLE_FRACTIONS`, whose sum is 1."""
MAX_PARTS = 4
"""Maximum number of parts into which an interval is split at once."""
MAX_ROUNDS = 10
"""Number of meshes after which refinement stops."""
MAX_INTERVALS = 2000
"""Number of intervals above which no finer mesh is tried."""
HESSIAN_METHODS = "exact", "limited-memory"
"""Second derivatives of the searches after the first."""


@dataclass(frozen=True)
class Refinement:
    """Settings of mesh refinement.

    Attributes:
        tolerance: bound of the error of a state within an interval, relative to 1 plus the largest
            absolute value of that state.
        hessian: second derivatives of all searches but the first: "exact" or "limited-memory".
    """

    tolerance: float
    hessian: str = "exact"

    @classmethod
    def parse(cls, value: float | str | Refinement) -> Refinement:
        """Return the settings of refinement for a tolerance or a text.

        Args:
            value: tolerance, text such as ``1e-3`` or ``1e-3:limited-memory``, or settings.

        Raises:
            SettingError: the text is invalid.
        """
        if isinstance(value, Refinement):
            return value
        text, _, hessian = str(value).partition(":")
        try:
            result = cls(float(text), hessian or "exact")
        except ValueError:
            raise SettingError(
                f"the tolerance of mesh refinement must be a number such as 1e-3, not '{text}'"
            ) from None
        if not 0.0 < result.tolerance < inf:
            raise SettingError(f"the tolerance of mesh refinement must be positive, not {text}")
        if result.hessian not in HESSIAN_METHODS:
            raise SettingError(
                f"mesh refinement has no second derivatives '{hessian}'{suggest_or_list(hessian, HESSIAN_METHODS)}"
            )
        return result


class Round(NamedTuple):
    """Search on one mesh.

    Attributes:
        intervals: number of intervals.
        error: largest error of an interval, see :func:`estimate_errors`.
        objective: value of the objective.
        iterations: number of iterations.
        duration: duration of the search, s.
    """

    intervals: int
    error: float
    objective: float
    iterations: int
    duration: float

    def __str__(self) -> str:
        steps = f"{format_count(self.iterations, 'iteration')} in {self.duration:.3g} s"
        return f"{format_count(self.intervals, 'interval')}, error {self.error:.2g}, objective {self.objective:.8g}; {steps}"


def solve_with_refinement(
    program: Program,
    guess: Array,
    refinement: Refinement,
    tell: Callable[[Progress], None] | None = None,
) -> tuple[Program, SolverResult, list[Round]]:
    """Solve on finer and finer meshes, each from the solution before, until all errors are below the tolerance.

    It stops early if a mesh has no solution, or after `MAX_ROUNDS` meshes or `MAX_INTERVALS`
    intervals.

    Args:
        program: nonlinear program on the first mesh.
        guess: initial variables.
        refinement: settings.
        tell: function that is called with the progress after each iteration; None for none.

    Returns:
        Program on the last mesh, its solution, and the searches on all meshes.

    Raises:
        UnsupportedError: the problem has variables or settings for which no error is estimated.
    """
    check_refinable(program.problem)
    result = search(program, guess, tell)
    rounds: list[Round] = []
    while True:
        error = estimate_errors(program, result.w)
        cost = float(program.compute_values(result.w)[0].sum())
        rounds.append(
            Round(len(error), float(error.max()), cost, result.iterations, result.duration)
        )
        mesh = split_intervals(program.problem.grid, error, refinement.tolerance)
        is_good = len(mesh) == len(error) + 1
        is_enough = len(rounds) > MAX_ROUNDS or len(mesh) > MAX_INTERVALS
        if not result.success or is_good or is_enough:
            return program, result, rounds
        # A quasi-Newton search may find the first solution; from near it Newton's method needs few
        # iterations.
        finer = _rebuild_program(program.problem, mesh, refinement.hessian)
        guess = interpolate_solution(program, result.w, finer)
        program = finer
        result = search(program, guess, tell, is_warm_start=True)


def check_refinable(problem: Problem) -> None:
    """Check that errors can be estimated for a problem.

    Raises:
        UnsupportedError: tendons or dynamics are implicit, or states are projected.
    """
    if problem.dynamics.tendons.names:
        raise problem.make_unsupported_error(
            problem.solver,
            "mesh refinement does not support implicit tendons; set tendon_compliance_dynamics_mode to explicit",
        )
    if problem.uses_projection:
        message = "mesh refinement requires kinematic_constraint_method Posa2016, as projections make states jump"
        raise problem.make_unsupported_error(problem.solver, message)
    if problem.dynamics.is_implicit:
        raise problem.make_unsupported_error(
            problem.solver, "mesh refinement requires multibody_dynamics_mode explicit"
        )


def estimate_errors(program: Program, w: Array) -> Array:
    """Estimate the error of each interval: that of its worst state.

    Args:
        program: nonlinear program without implicit dynamics and projections.
        w: variables of a solution (n,).

    Returns:
        Errors (m,), relative to 1 plus the largest absolute value of the state.
    """
    grid = program.problem.grid
    layout = program.layout
    polynomial = _SolutionPolynomials(program, w)
    count = len(layout.names["states"])
    # Points of meshes have all variables but slacks, so that their F holds anywhere in an interval.
    group = program.groups[0]
    rates = polynomial.rates
    sizes = 1.0 + np.abs(w[layout.indices["states"]]).max(axis=0)
    # The integral of the missing rate over the interval is the error of the state at its end.
    result = np.zeros(len(grid.lengths))
    of_rates = _evaluate_basis(polynomial.nodes, SAMPLE_FRACTIONS)
    starts = np.concatenate([[0.0], np.cumsum(grid.lengths)[:-1]])
    for fraction, weight, row in zip(SAMPLE_FRACTIONS, SAMPLE_WEIGHTS, of_rates, strict=True):
        values = polynomial.evaluate(np.full(len(starts), fraction), np.arange(len(starts)))
        z = np.hstack([values[kind] for kind in VARIABLE_KINDS if kind != "slacks"])
        actual = np.array(group.evaluate(program, w, starts + fraction * grid.lengths, z))[
            :, :count
        ]
        # Difference between the rate of the polynomial and the equations of motion.
        missing = np.abs(np.einsum("j,kji->ki", row, rates) - actual)
        result += weight * grid.lengths * (missing / sizes).max(axis=1)
    return result


def split_intervals(grid: Grid, error: Array, tolerance: float) -> Array:
    """Return the mesh in which intervals with a large error are split into equal parts.

    The error falls with the order of the scheme, from which the number of parts follows.

    Args:
        grid: grid of the mesh.
        error: error of each interval (m,).
        tolerance: bound of the error.

    Returns:
        Ends of the intervals of the new mesh, from 0 to 1.
    """
    order = 1 + int(grid.scheme.rates.any(axis=0).sum())
    part_counts = np.ones(len(error), dtype=int)
    large = error > tolerance
    # The error of an interval of length h is proportional to h ** order.
    part_counts[large] = np.clip(np.ceil((error[large] / tolerance) ** (1.0 / order)), 2, MAX_PARTS)
    lengths = np.repeat(grid.lengths / part_counts, part_counts)
    return np.concatenate([[0.0], np.cumsum(lengths)[:-1], [1.0]])


def interpolate_solution(program: Program, w: Array, finer: Program) -> Array:
    """Return the variables of a solution on another mesh, by the polynomials of its intervals.

    Args:
        program: program of the solution.
        w: variables of the solution (n,).
        finer: program on the other mesh.

    Returns:
        Variables of the other program.
    """
    grid = program.problem.grid
    layout = finer.layout
    starts = np.concatenate([[0.0], np.cumsum(grid.lengths)[:-1]])
    fractions = finer.problem.grid.fractions
    interval = np.clip(np.searchsorted(starts, fractions, side="right") - 1, 0, len(starts) - 1)
    values = _SolutionPolynomials(program, w).evaluate(
        (fractions - starts[interval]) / grid.lengths[interval], interval
    )
    # Variables without a polynomial keep the default guess; slacks vanish at a solution.
    result = layout.make_guess()
    result[: layout.shared] = w[: layout.shared]
    for kind in VARIABLE_KINDS:
        indices = layout.indices[kind]
        is_present = indices >= 0
        result[indices[is_present]] = values[kind][is_present] if kind != "slacks" else 0.0
    return result


def _rebuild_program(problem: Problem, mesh: Array, hessian: str) -> Program:
    """Return the program of the same problem on another mesh.

    Args:
        problem: problem.
        mesh: ends of the intervals, from 0 to 1.
        hessian: value of ``optim_hessian_approximation``.
    """
    # A shallow copy shares the model's functions and formulas; the solver's settings are the user's
    # and are copied.
    refined_problem = copy(problem)
    refined_problem.grid = Grid.from_mesh(problem.grid.scheme, mesh)
    refined_problem.solver = problem.solver.copy_deep()
    refined_problem.solver.optim_hessian_approximation = hessian
    return Program(refined_problem)


class _SolutionPolynomials:
    """Polynomials of a solution between its points; states are integrals of the polynomials of their rates.

    Args:
        program: program of the solution.
        w: variables of the solution (n,).

    Attributes:
        grid: grid of the solution.
        scheme: transcription scheme.
        nodes: positions of those points of the scheme whose rates count (j,), from 0 to 1.
        rates: rates at the nodes times the duration of the motion (intervals, j, states).
    """

    def __init__(self, program: Program, w: Array) -> None:
        grid = program.problem.grid
        layout = program.layout
        scheme = program.problem.grid.scheme
        self.grid = grid
        self.scheme = scheme
        # Legendre's schemes ignore the rates at some ends of an interval.
        node_indices = np.flatnonzero(scheme.rates.any(axis=0))
        self.nodes = scheme.fractions[node_indices]
        points = np.array([grid.get_points(k) for k in range(len(grid.lengths))])
        count = len(layout.names["states"])
        rates = np.zeros((len(grid.fractions), count))
        for group in program.groups:
            rates[group.numbers] = group.value(*program._make_point_arguments(group, w))[0][
                :, :count
            ]
        self.rates = rates[points[:, node_indices]]
        self._lines = program.problem.solver.interpolate_control_mesh_interior_points
        self._values = {
            kind: w[layout.indices[kind]][points] for kind in VARIABLE_KINDS if kind != "slacks"
        }

    def evaluate(self, fractions: Array, intervals: Any) -> dict[str, Array]:
        """Evaluate the variables within intervals.

        Args:
            fractions: positions within the intervals (n,), from 0 to 1.
            intervals: indices of the intervals (n,).

        Returns:
            Variables (n, names) by kind.
        """
        result = {}
        for kind, values in self._values.items():
            nodal = values[intervals]
            if kind == "states":
                basis_integrals = _integrate_basis(self.nodes, fractions)
                change = np.einsum("nj,njs->ns", basis_integrals, self.rates[intervals])
                result[kind] = nodal[:, 0] + self.grid.lengths[intervals, None] * change
            # As the study interpolates controls between the nodes: by lines, or by the polynomial
            # of the scheme.
            elif kind == "controls" and self._lines:
                result[kind] = nodal[:, 0] + fractions[:, None] * (nodal[:, -1] - nodal[:, 0])
            else:
                result[kind] = np.einsum(
                    "nj,njs->ns", _evaluate_basis(self.scheme.fractions, fractions), nodal
                )
        return result


def _evaluate_basis(nodes: Array, fractions: Array) -> Array:
    """Return the values (n, j) of the Lagrange polynomials of nodes (j,) at positions (n,)."""
    return np.polynomial.polynomial.polyvander(fractions, len(nodes) - 1) @ _compute_coefficients(
        nodes
    )


def _integrate_basis(nodes: Array, fractions: Array) -> Array:
    """Return the integrals (n, j) of the Lagrange polynomials of nodes (j,) from 0 to positions (n,)."""
    # The integral of x ** k from 0 is x ** (k + 1) / (k + 1).
    powers = np.polynomial.polynomial.polyvander(fractions, len(nodes))[:, 1:] / np.arange(
        1, len(nodes) + 1
    )
    return powers @ _compute_coefficients(nodes)


def _compute_coefficients(nodes: Array) -> Array:
    """Return the coefficients of the Lagrange polynomials of nodes (j,), one column each."""
    result: Any = np.linalg.inv(np.vander(nodes, increasing=True))
    return result
