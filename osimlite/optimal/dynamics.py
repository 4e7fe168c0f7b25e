"""Equations of motion at one point of the grid, explicit or implicit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import Formula, PointSymbols
from osimlite.optimal.tendons import TendonEquations

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem


class Dynamics:
    """Rates of the states and residuals of the equations of motion at a point.

    Multipliers are variables at all points. As in Moco they push with the generalized forces ``-Gᵀ
    multipliers``, N or N m. The model's constraints are equations at the points of the mesh (M.
    Posa et al., ICRA 2016), or at all points for accelerations if states are projected onto the
    constraints at the end of intervals (R. Bordalba et al., IEEE Transactions on Robotics 39,
    2023).

    Args:
        problem: problem with the functions of the model.

    Attributes:
        problem: problem with the functions of the model.
        functions: CasADi functions of the model.
        is_implicit: whether accelerations are variables.
        size: number of coordinates.
        tendons: equations of the muscles with implicit tendon dynamics.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.functions = problem.functions
        self.is_implicit = problem.solver.multibody_dynamics_mode == "implicit"
        self.size = len(self.functions.coordinates)
        self.tendons = TendonEquations(problem, self.list_forces())
        self._first_rate = self.size if self.is_implicit else 0

    def list_forces(self) -> Iterable[tuple[str, Any]]:
        """Return the forces of the model with their paths."""
        return [(element.path, element) for element in self.functions.forces.elements]

    def compute_path_lengths(self, point: PointSymbols) -> tuple[Formula, Formula]:
        """Compute the lengths and speeds of the paths of ``functions.path_names``.

        Args:
            point: point of the grid.

        Returns:
            Lengths (m, 1), m, and lengthening speeds (m, 1), m/s.
        """
        lengths, speeds, _ = self.functions.paths(point.t, point.x, point.p)
        return lengths, speeds

    def compute_rates(self, point: PointSymbols) -> Formula:
        """Compute the time derivative of the complete state (n, 1): speeds, accelerations, auxiliary rates.

        With explicit dynamics the accelerations are symbols, and the point receives the equations
        that determine them.

        Args:
            point: point of the grid.

        Returns:
            Formula of the derivative.
        """
        size = self.size
        functions = self.functions
        speeds = point.x[size : 2 * size]
        if self.is_implicit:
            accelerations = point.derivatives[:size]
        else:
            # The accelerations remain symbols: M udot = f is solved with the factors of M (see PointFormula).
            accelerations = casadi.SX.sym("udot", size)
            zero_speeds = casadi.SX.zeros(size)
            zero_rates = casadi.SX.zeros(len(functions.states) - 2 * size)
            udot = casadi.vertcat(zero_speeds, accelerations, zero_rates)
            rows = functions.residual(point.t, point.x, udot, point.u, point.p, point.multipliers)[
                size : 2 * size
            ]
            point.linear_systems.append((accelerations, rows))
        return self._insert_tendon_rates(
            point, casadi.vertcat(speeds, accelerations, self._compute_auxiliary_rates(point))
        )

    def _insert_tendon_rates(self, point: PointSymbols, rates: Formula) -> Formula:
        """Return the rates with those rates of tendon forces that are variables in their places.

        Args:
            point: point of the grid.
            rates: rates of the complete state (n, 1), which this changes.
        """
        for number, path in enumerate(self.tendons.paths):
            index = self.functions.states.index(f"{path}/normalized_tendon_force")
            rates[index] = point.derivatives[self._first_rate + number]
        return rates

    def _compute_auxiliary_rates(self, point: PointSymbols) -> Formula:
        """Compute the rates of the auxiliary states by the force laws, in the order of the states.

        Returns:
            Formula of the rates (m, 1).
        """
        zero_rates = casadi.SX.zeros(len(self.functions.states))
        functions = self.functions
        # The residual of an auxiliary state is its rate less the law's rate: at zero rates it is
        # the negative of the law's rate.
        return -functions.residual(
            point.t, point.x, zero_rates, point.u, point.p, point.multipliers
        )[2 * self.size :]

    def correct_rates(self, point: PointSymbols) -> Formula:
        """Return the rates with the velocity correction that keeps states on the constraints (Posa et al.).

        Args:
            point: point of the grid.

        Returns:
            Rates (n, 1), whose first part is ``speeds + Gᵀ slacks`` where the point has slacks.
        """
        rates = point.rates
        # With projection the slacks move states at the end of an interval instead:
        # compute_projection_errors.
        if self.problem.uses_projection or not point.slacks.numel():
            return rates
        jacobian = self.functions.constraints(point.t, point.x, rates, point.p)[3]
        return casadi.vertcat(rates[: self.size] + jacobian.T @ point.slacks, rates[self.size :])

    def compute_residuals(self, point: PointSymbols) -> tuple[list[str], Formula]:
        """Compute the residuals that are zero at all points: of implicit dynamics, then of implicit tendons.

        Args:
            point: point of the grid.

        Returns:
            Names of the residuals, and the residuals (k, 1).
        """
        names, errors = self.tendons.compute_residuals(point, point.derivatives[self._first_rate :])
        if not self.is_implicit:
            return names, errors
        functions = self.functions
        size = self.size
        # The interval ends at the state before projection, so that its equations of motion hold
        # there.
        point = point.before_projection
        rows = functions.residual(
            point.t, point.x, point.rates, point.u, point.p, point.multipliers
        )[size : 2 * size]
        return [*(f"{path} residual" for path in functions.coordinates), *names], casadi.vertcat(
            rows, errors
        )

    def compute_constraint_errors(
        self, point: PointSymbols, is_mesh: bool
    ) -> tuple[list[str], Formula]:
        """Compute the errors of the model's constraints at a point.

        Args:
            point: point of the grid.
            is_mesh: whether the point is an end of an interval.

        Returns:
            Names of the errors, and the errors (k, 1).
        """
        problem = self.problem
        labels = self.problem.constraint_names
        if not problem.has_constraints or not (is_mesh or problem.uses_projection):
            return [], casadi.SX(0, 1)
        # Positions and speeds hold for the projected state; the accelerations belong to the state
        # at which the interval ended.
        position, velocity, _, _ = self._evaluate_constraints(point)
        acceleration = self._evaluate_constraints(point.before_projection)[2]
        if not is_mesh:
            return [f"{name}dd" for name in labels], acceleration
        if not problem.solver.enforce_constraint_derivatives:
            return labels, position
        names = [*labels, *(f"{name}d" for name in labels), *(f"{name}dd" for name in labels)]
        return names, casadi.vertcat(position, velocity, acceleration)

    def make_joint_load(
        self, path: str, side: str, frame: str
    ) -> Callable[[PointSymbols], Formula]:
        """Return the function of a point for the load of a joint on one of its bodies.

        Args:
            path: path of the joint.
            side: "parent" or "child", the body on which the load acts.
            frame: path of the frame along whose axes the load is expressed.

        Returns:
            Function of a point that returns the column of moment (N m) and force (N), (6, 1).
        """
        load = self.functions.joint_load(path, side)

        def formula(point: PointSymbols) -> Formula:
            force, moment = load(point.t, point.x, point.rates, point.u, point.p, point.multipliers)
            # The kernels give loads in ground; the transposed rotation expresses them along the
            # axes of the frame.
            ground_to_frame = point.frame(frame).rotation.T
            return casadi.vertcat(ground_to_frame @ moment, ground_to_frame @ force)

        return formula

    def make_generalized_forces(
        self, pushing: Sequence[str], coordinates: Sequence[str]
    ) -> Callable[[PointSymbols], Formula]:
        """Return the function of a point for the generalized forces that the motion needs.

        Args:
            pushing: paths of the forces that act; gravity acts as well.
            coordinates: paths of the coordinates.

        Returns:
            Function of a point that returns the generalized forces still missing (k, 1), N and N m.
        """
        missing = self.functions.generalized_forces(pushing)
        rows = [*map(self.functions.coordinates.index, coordinates)]
        return lambda point: missing(point.t, point.x, point.rates, point.u, point.p)[rows]

    def _evaluate_constraints(self, point: PointSymbols) -> Sequence[Formula]:
        """Return the errors of the model's constraints at a point.

        Returns:
            Errors of positions, speeds and accelerations (c, 1) each, and the Jacobian G (c, n).
        """
        result: Sequence[Formula] = self.functions.constraints(
            point.t, point.x, point.rates, point.p
        )
        return result

    def compute_projection_errors(self, point: PointSymbols) -> tuple[list[str], Formula]:
        """Compute the errors of projected values and speeds: ``x - projections - Gᵀ slacks``.

        The first half of the slacks moves values and the second half speeds, as in Moco.

        Args:
            point: end of an interval.

        Returns:
            Names of the errors, and the errors (k, 1).
        """
        names = self.problem.projected_names
        jacobian = self._evaluate_constraints(point)[3]
        displacements = casadi.vertcat(
            *(
                jacobian.T @ slack_half
                for slack_half in casadi.vertsplit(point.slacks, jacobian.size1())
            )
        )
        return names, point.x[: len(names)] - point.projections - displacements
