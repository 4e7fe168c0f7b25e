"""The equations of motion at one point: explicit, implicit, or along a motion that is given."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import Formula, Point
from osimlite.optimal.tendons import TendonEquations

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem


class Dynamics:
    """What rates are, and what must be zero, at a point.

    Multipliers are variables of their own at all points, and push as ``Gᵀ multipliers``; the
    model's constraints are equations of points of the mesh (M. Posa et al., ICRA 2016),
    accelerations of all points if intervals lead to states that are moved onto them (R. Bordalba et
    al., IEEE Transactions on Robotics 39, 2023).

    Attributes:
        is_implicit: whether accelerations are variables.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.functions = problem, problem.functions
        self.is_implicit = problem.solver.multibody_dynamics_mode == "implicit"
        self.size = len(self.functions.coordinates)
        self.tendons = TendonEquations(problem, self.list_forces())
        self._first_rate = self.size if self.is_implicit else 0

    def list_forces(self) -> Iterable[tuple[str, Any]]:
        """The forces of the model, by their paths."""
        return [(item.path, item) for item in self.functions.forces.elements]

    def compute_path_lengths(self, point: Point) -> tuple[Formula, Formula]:
        """Lengths and lengthening speeds of the paths of ``functions.path_names``."""
        lengths, speeds, _ = self.functions.paths(point.t, point.x, point.p)
        return lengths, speeds

    def compute_rates(self, point: Point) -> Formula:
        """The derivative of the whole state."""
        size, f = self.size, self.functions
        speeds = point.x[size : 2 * size]
        if self.is_implicit:
            accelerations = point.derivatives[:size]
        else:
            # M udot = what pushes.
            accelerations = casadi.SX.sym("udot", size)
            none, others = casadi.SX.zeros(size), casadi.SX.zeros(len(f.states) - 2 * size)
            udot = casadi.vertcat(none, accelerations, others)
            rows = f.residual(point.t, point.x, udot, point.u, point.p, point.multipliers)[
                size : 2 * size
            ]
            point.linear_systems.append((accelerations, rows))
        return self._insert_tendon_rates(
            point, casadi.vertcat(speeds, accelerations, self._compute_auxiliary_rates(point))
        )

    def _insert_tendon_rates(self, point: Point, rates: Formula) -> Formula:
        """Rates of tendon forces that are variables, in their places."""
        for number, path in enumerate(self.tendons.paths):
            place = self.functions.states.index(f"{path}/normalized_tendon_force")
            rates[place] = point.derivatives[self._first_rate + number]
        return rates

    def _compute_auxiliary_rates(self, point: Point) -> Formula:
        """Rates of the auxiliary states by the laws."""
        none, f = casadi.SX.zeros(len(self.functions.states)), self.functions
        return -f.residual(point.t, point.x, none, point.u, point.p, point.multipliers)[
            2 * self.size :
        ]

    def correct_rates(self, point: Point) -> Formula:
        """The rates, with the correction of velocities that keeps states on the constraints."""
        rates = point.rates
        if self.problem.uses_projection or not point.slacks.numel():
            return rates
        g = self.functions.constraints(point.t, point.x, rates, point.p)[3]
        return casadi.vertcat(rates[: self.size] + g.T @ point.slacks, rates[self.size :])

    def compute_residuals(self, point: Point) -> tuple[list[str], Formula]:
        """What must be zero at all points, with its names."""
        names, errors = self.tendons.compute_residuals(point, point.derivatives[self._first_rate :])
        if not self.is_implicit:
            return names, errors
        f, size, point = self.functions, self.size, point.before_projection
        rows = f.residual(point.t, point.x, point.rates, point.u, point.p, point.multipliers)[
            size : 2 * size
        ]
        return [*(f"{path} residual" for path in f.coordinates), *names], casadi.vertcat(
            rows, errors
        )

    def compute_constraint_errors(self, point: Point, is_mesh: bool) -> tuple[list[str], Formula]:
        """Errors of the model's constraints at a point, with their names."""
        problem, own = self.problem, self.problem.constraint_names
        if not problem.has_constraints or not (is_mesh or problem.uses_projection):
            return [], casadi.SX(0, 1)
        position, velocity, _, _ = self._evaluate_constraints(point)
        acceleration = self._evaluate_constraints(point.before_projection)[2]
        if not is_mesh:
            return [f"{name}dd" for name in own], acceleration
        if not problem.solver.enforce_constraint_derivatives:
            return own, position
        names = [*own, *(f"{name}d" for name in own), *(f"{name}dd" for name in own)]
        return names, casadi.vertcat(position, velocity, acceleration)

    def make_joint_load(self, path: str, side: str, frame: str) -> Callable[[Point], Formula]:
        """Moment (N m) and force (N) that a joint pushes one of its bodies with, along the axes of a frame (6, 1)."""
        load = self.functions.joint_load(path, side)

        def formula(point: Point) -> Formula:
            force, moment = load(point.t, point.x, point.rates, point.u, point.p, point.multipliers)
            turn = point.frame(frame).rotation.T
            return casadi.vertcat(turn @ moment, turn @ force)

        return formula

    def make_generalized_forces(
        self, pushing: Sequence[str], coordinates: Sequence[str]
    ) -> Callable[[Point], Formula]:
        """What coordinates take beyond gravity and the forces of some paths, N and N m."""
        missing, rows = (
            self.functions.generalized_forces(pushing),
            [*map(self.functions.coordinates.index, coordinates)],
        )
        return lambda point: missing(point.t, point.x, point.rates, point.u, point.p)[rows]

    def _evaluate_constraints(self, point: Point) -> Sequence[Formula]:
        """Errors of positions, speeds and accelerations, and the matrix G."""
        found: Sequence[Formula] = self.functions.constraints(
            point.t, point.x, point.rates, point.p
        )
        return found

    def compute_projection_errors(self, point: Point) -> tuple[list[str], Formula]:
        """How far values and speeds are from those that the interval leads to, moved along the constraints; with names.

        Of the slacks the first half, as Moco has them, moves values and the second speeds.
        """
        names, g = self.problem.projected_names, self._evaluate_constraints(point)[3]
        moved = casadi.vertcat(*(g.T @ part for part in casadi.vertsplit(point.slacks, g.size1())))
        return names, point.x[: len(names)] - point.projections - moved
