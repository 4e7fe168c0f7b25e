"""Equilibrium equations between tendon and fibers of DeGrooteFregly2016Muscle."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from osimlite.derivatives.symbolic import make_symbolic
from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.mechanics.laws.smooth_muscles import (
    TENDON_FORCE_OFFSET,
    SmoothMuscle,
    SmoothTendon,
    degroote_active,
    degroote_factor,
    degroote_passive,
    degroote_residual,
    smooth_tendon_length,
)
from osimlite.optimal.point import Formula, PointSymbols
from osimlite.schema.smooth_muscles import DeGrooteFregly2016Muscle

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem


IMPLICIT = "implicit"
"""Value of ``tendon_compliance_dynamics_mode``: the rate of the tendon force is a variable."""
EXPLICIT = "explicit"
"""Value of ``tendon_compliance_dynamics_mode``: the rate of the tendon force follows from the equilibrium."""


class TendonEquations:
    """Equations of DeGrooteFregly2016Muscles with elastic tendons.

    Args:
        problem: problem with the muscles.
        elements: forces of the model with their paths.
        mode: ``tendon_compliance_dynamics_mode`` of the muscles to include.

    Attributes:
        problem: problem with the muscles.
        muscles: path of each muscle, with the numbers of its fibers and of its tendon.
        paths: paths of the muscles.
        names: names of the rates of their tendon forces, as in Moco.
    """

    def __init__(
        self, problem: Problem, elements: Iterable[tuple[str, Any]], mode: str = IMPLICIT
    ) -> None:
        self.problem = problem
        self.muscles: list[tuple[str, SmoothMuscle, SmoothTendon]] = []
        for path, element in elements:
            component = problem.components.get(path)
            if (
                isinstance(component, DeGrooteFregly2016Muscle)
                and component.tendon_compliance_dynamics_mode == mode
                and not component.ignore_tendon_compliance
            ):
                values = {type(muscle_part): muscle_part for muscle_part in element.values}
                self.muscles.append((path, values[SmoothMuscle], values[SmoothTendon]))
        self.paths = [path for path, _, _ in self.muscles]
        self.names = [f"{path}/implicitderiv_normalized_tendon_force" for path in self.paths]

    def compute_residuals(self, point: PointSymbols, rates: Formula) -> tuple[list[str], Formula]:
        """Compute the excess of each tendon force over the fiber force, relative to the muscle's strength.

        The rate of its force determines how fast the tendon lengthens; the fibers take the rest of
        the path's lengthening speed.

        Args:
            point: point of the grid.
            rates: rates of the normalized tendon forces (m, 1), 1/s.

        Returns:
            Names of the residuals, and the residuals (m, 1).
        """
        if not self.muscles:
            return [], casadi.SX(0, 1)
        functions = self.problem.functions
        rows = []
        lengths, speeds = self.problem.dynamics.compute_path_lengths(point)
        residual = make_symbolic(degroote_residual)
        for number, (path, muscle, tendon) in enumerate(self.muscles):
            path_index = functions.path_names.index(path)
            force = point.state(f"{path}/normalized_tendon_force")
            activation = (
                point.state(f"{path}/activation") if muscle.follows else point.control(path)
            )
            # Derivative of the tendon's length, the inverse of its exponential force curve, times
            # the rate of the force.
            tendon_speed = (
                muscle.slack * rates[number] / (tendon.growth * (force + TENDON_FORCE_OFFSET))
            )
            muscle_inputs = (
                lengths[path_index],
                speeds[path_index] - tendon_speed,
                point.control(path),
                activation,
                0.0,
                0.0,
                force,
            )
            rows.append(residual(force, MuscleInputs(*muscle_inputs), muscle, tendon))
        return [f"{path} equilibrium" for path in self.paths], casadi.vertcat(*rows)

    def compute_rate_errors(self, point: PointSymbols) -> Formula:
        """Compute the rate of each fiber force along the tendon less the rate of the tendon force, N/s.

        The fibers are springs here: neither the activation nor the force-velocity factor changes
        (M. Millard et al., Journal of Biomechanical Engineering 135, 2013, A6).

        Args:
            point: point of the grid.

        Returns:
            Errors (m, 1).
        """
        functions = self.problem.functions
        rows = [casadi.SX(0, 1)]
        lengths, speeds = self.problem.dynamics.compute_path_lengths(point)
        for path, muscle, tendon in self.muscles:
            path_index = functions.path_names.index(path)
            state = f"{path}/normalized_tendon_force"
            force = point.state(state)
            rate = point.rates[functions.states.index(state)]
            activation = (
                point.state(f"{path}/activation") if muscle.follows else point.control(path)
            )
            fiber_along_tendon = casadi.SX.sym("along")
            # Pennate fibers keep their height normal to the tendon.
            length = casadi.sqrt(fiber_along_tendon**2 + muscle.height**2)
            fiber_speed = speeds[path_index] - muscle.slack * rate / (
                tendon.growth * (force + TENDON_FORCE_OFFSET)
            )
            velocity = casadi.SX.sym("velocity")
            active = activation * make_symbolic(degroote_active)(
                length / muscle.optimal, muscle.scale
            )
            passive, _ = make_symbolic(degroote_passive)(
                length / muscle.optimal, tendon.passive_strain
            )
            springs = passive * muscle.passive + muscle.damping * velocity
            fiber_force = active * make_symbolic(degroote_factor)(velocity) + springs
            # Differentiated for symbols that the present length and speed replace afterwards: the
            # speed counts as constant.
            stiffness = casadi.jacobian(
                fiber_force * fiber_along_tendon / length, fiber_along_tendon
            )
            present_length = lengths[path_index] - muscle.slack * make_symbolic(
                smooth_tendon_length
            )(force, tendon.growth)
            present_velocity = (
                fiber_speed
                * casadi.substitute(fiber_along_tendon / length, fiber_along_tendon, present_length)
                / (muscle.fastest * muscle.optimal)
            )
            stiffness = casadi.substitute(
                stiffness,
                casadi.vertcat(fiber_along_tendon, velocity),
                casadi.vertcat(present_length, present_velocity),
            )
            rows.append(muscle.strength * (stiffness * fiber_speed - rate))
        return casadi.vertcat(*rows)
