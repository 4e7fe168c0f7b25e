"""Tendons of the implicit kind: the rate of their force is a variable, and equilibrium with the fibers an equation."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from osimlite.derivatives.symbolic import on_symbols
from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.laws.muscles import MuscleInputs
from osimlite.mechanics.laws.smooth_muscles import (
    BELOW,
    SmoothMuscle,
    SmoothTendon,
    degroote_active,
    degroote_factor,
    degroote_passive,
    degroote_residual,
    smooth_tendon_length,
)
from osimlite.optimal.point import Formula, Point
from osimlite.schema.muscles import DeGrooteFregly2016Muscle

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem


IMPLICIT, EXPLICIT = "implicit", "explicit"
"""What ``tendon_compliance_dynamics_mode`` may be."""


class TendonEquations:
    """The muscles of De Groote and Fregly with elastic tendons of one ``tendon_compliance_dynamics_mode``.

    Args:
        problem: that they are part of.
        elements: forces of the model, by their paths.
        mode: of the muscles.

    Attributes:
        paths: of the muscles.
        names: of the rates, as Moco has them.
    """

    def __init__(
        self, problem: Problem, elements: Iterable[tuple[str, Any]], mode: str = IMPLICIT
    ) -> None:
        self.problem = problem
        self.muscles: list[tuple[str, SmoothMuscle, SmoothTendon]] = []
        for path, element in elements:
            part = problem.components.get(path)
            if (
                isinstance(part, DeGrooteFregly2016Muscle)
                and part.tendon_compliance_dynamics_mode == mode
                and not part.ignore_tendon_compliance
            ):
                values = {type(each): each for each in element.values}
                self.muscles.append((path, values[SmoothMuscle], values[SmoothTendon]))
        self.paths = [path for path, _, _ in self.muscles]
        self.names = [f"{path}/implicitderiv_normalized_tendon_force" for path in self.paths]

    def compute_residuals(self, point: Point, rates: Formula) -> tuple[list[str], Formula]:
        """By how much each tendon's force exceeds what the fibers bear, over the muscle's strength.

        The tendon lengthens by what its force's rate asks for, and the fibers by the rest of what
        the path does.
        """
        if not self.muscles:
            return [], casadi.SX(0, 1)
        functions, rows = self.problem.functions, []
        lengths, speeds = self.problem.dynamics.compute_path_lengths(point)
        residual = on_symbols(degroote_residual)
        for number, (path, muscle, tendon) in enumerate(self.muscles):
            place = functions.path_names.index(path)
            force = point.state(f"{path}/normalized_tendon_force")
            activation = (
                point.state(f"{path}/activation") if muscle.follows else point.control(path)
            )
            stretch = muscle.slack * rates[number] / (tendon.growth * (force + BELOW))
            given = (
                lengths[place],
                speeds[place] - stretch,
                point.control(path),
                activation,
                0.0,
                0.0,
                force,
            )
            rows.append(residual(force, MuscleInputs(*given), muscle, tendon))
        return [f"{path} equilibrium" for path in self.paths], casadi.vertcat(*rows)

    def compute_rate_errors(self, point: Point) -> Formula:
        """By how much the rate of the force of the fibers along each tendon exceeds that of the tendon, N/s.

        Fibers are springs there: neither the activation nor the force's factor by the velocity
        changes (M. Millard et al., Journal of Biomechanical Engineering 135, 2013, A6).
        """
        functions, rows = self.problem.functions, [casadi.SX(0, 1)]
        lengths, speeds = self.problem.dynamics.compute_path_lengths(point)
        for path, muscle, tendon in self.muscles:
            place, state = functions.path_names.index(path), f"{path}/normalized_tendon_force"
            force, rate = point.state(state), point.rates[functions.states.index(state)]
            activation = (
                point.state(f"{path}/activation") if muscle.follows else point.control(path)
            )
            along = casadi.SX.sym("along")
            length = casadi.sqrt(along**2 + muscle.height**2)
            fiber = speeds[place] - muscle.slack * rate / (tendon.growth * (force + BELOW))
            velocity = casadi.SX.sym("velocity")
            active = activation * on_symbols(degroote_active)(length / muscle.optimal, muscle.scale)
            passive, _ = on_symbols(degroote_passive)(
                length / muscle.optimal, tendon.passive_strain
            )
            springs = passive * muscle.passive + muscle.damping * velocity
            borne = active * on_symbols(degroote_factor)(velocity) + springs
            stiffness = casadi.jacobian(borne * along / length, along)
            now = lengths[place] - muscle.slack * on_symbols(smooth_tendon_length)(
                force, tendon.growth
            )
            moves = (
                fiber
                * casadi.substitute(along / length, along, now)
                / (muscle.fastest * muscle.optimal)
            )
            stiffness = casadi.substitute(
                stiffness, casadi.vertcat(along, velocity), casadi.vertcat(now, moves)
            )
            rows.append(muscle.strength * (stiffness * fiber - rate))
        return casadi.vertcat(*rows)
