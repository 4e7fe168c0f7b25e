"""Goals on the start and the end of a motion: time, speed, equilibrium, periodicity, markers, parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite.base.text import format_count
from osimlite.derivatives.symbolic import make_symbolic
from osimlite.derivatives.symbols import RecordedVector, casadi
from osimlite.errors import ModelError, SettingError
from osimlite.mechanics.kernels.programs import run_program
from osimlite.mechanics.multibody import formula as expressions
from osimlite.optimal.point import CONSTRAINT_FIRST, COST_FIRST, Endpoints, Formula, GoalTerms
from osimlite.optimal.tendons import EXPLICIT, IMPLICIT, TendonEquations
from osimlite.schema.moco.goals import (
    MocoAverageSpeedGoal,
    MocoExpressionBasedParameterGoal,
    MocoFinalTimeGoal,
    MocoInitialActivationGoal,
    MocoInitialForceEquilibriumDGFGoal,
    MocoInitialVelocityEquilibriumDGFGoal,
    MocoMarkerFinalGoal,
    MocoPeriodicityGoal,
)
from osimlite.simulation.properties import find_properties

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem


def build_final_time_goal(goal: MocoFinalTimeGoal, problem: Problem) -> GoalTerms:
    """Return the final time, s."""
    return GoalTerms(lambda ends: ends.end.t[0])


def build_average_speed_goal(goal: MocoAverageSpeedGoal, problem: Problem) -> GoalTerms:
    """Return the desired speed less the average speed of the mass centre, m/s.

    The average speed is the distance between the mass centre's first and last position over the
    duration.

    Args:
        goal: goal of the study.
        problem: problem of the study.
    """

    def value(ends: Endpoints) -> Formula:
        distance = casadi.norm_2(ends.end.mass_center() - ends.start.mass_center())
        return goal.desired_average_speed - distance / ends.duration

    return GoalTerms(value, modes=CONSTRAINT_FIRST)


def build_initial_activation_goal(goal: MocoInitialActivationGoal, problem: Problem) -> GoalTerms:
    """Return excitation less activation at the start, for each actuator that has an activation.

    Args:
        goal: goal of the study.
        problem: problem with the actuators.
    """
    muscles = [
        name for name in problem.controls if f"{name}/activation" in problem.functions.states
    ]

    def value(ends: Endpoints) -> Formula:
        start = ends.start
        differences = [start.control(name) - start.state(f"{name}/activation") for name in muscles]
        return casadi.vertcat(*differences) if differences else casadi.SX(0, 1)

    return GoalTerms(value, modes=CONSTRAINT_FIRST)


def build_initial_force_equilibrium_goal(
    goal: MocoInitialForceEquilibriumDGFGoal, problem: Problem
) -> GoalTerms:
    """Return tendon force less fiber force at the start for muscles with explicit tendon dynamics.

    The rate of the tendon force is zero there. The force is relative to the muscle's strength.

    Args:
        goal: goal of the study.
        problem: problem with the muscles.
    """

    def value(ends: Endpoints) -> Formula:
        # The equilibrium of muscles with implicit dynamics is an equation at all points anyway.
        tendons = TendonEquations(problem, problem.dynamics.list_forces(), EXPLICIT)
        return tendons.compute_residuals(ends.start, casadi.SX.zeros(len(tendons.paths)))[1]

    return GoalTerms(value, modes=CONSTRAINT_FIRST)


def build_initial_velocity_equilibrium_goal(
    goal: MocoInitialVelocityEquilibriumDGFGoal, problem: Problem
) -> GoalTerms:
    """Return the rate of the fiber force less that of the tendon force at the start, N/s, for each muscle.

    Args:
        goal: goal of the study.
        problem: problem with the muscles.
    """
    equations = [
        TendonEquations(problem, problem.dynamics.list_forces(), mode)
        for mode in (IMPLICIT, EXPLICIT)
    ]

    def value(ends: Endpoints) -> Formula:
        return casadi.vertcat(*(tendons.compute_rate_errors(ends.start) for tendons in equations))

    return GoalTerms(value, modes=CONSTRAINT_FIRST)


def build_periodicity_goal(goal: MocoPeriodicityGoal, problem: Problem) -> GoalTerms:
    """Return the initial value less the final value of each pair of variables; for negated pairs minus their sum.

    Args:
        goal: goal of the study.
        problem: problem with the states and controls.

    Raises:
        DocumentError: a variable does not exist.
    """
    functions = problem.functions
    pairs = []
    for goal_pairs, known_names, variable_type in (
        (goal.state_pairs, functions.states, "state"),
        (goal.control_pairs, problem.controls, "control"),
    ):
        for pair in goal_pairs:
            initial_name = pair.initial_variable
            final_name = pair.final_variable
            for name in (initial_name, final_name):
                problem.check_name(pair, name, known_names, variable_type)
            pairs.append((variable_type, initial_name, final_name, -1.0 if pair.negate else 1.0))

    def value(ends: Endpoints) -> Formula:
        differences = [
            sign * getattr(ends.start, variable_type)(initial_name)
            - getattr(ends.end, variable_type)(final_name)
            for variable_type, initial_name, final_name, sign in pairs
        ]
        return casadi.vertcat(*differences) if differences else casadi.SX(0, 1)

    return GoalTerms(value, modes=CONSTRAINT_FIRST)


def build_marker_final_goal(goal: MocoMarkerFinalGoal, problem: Problem) -> GoalTerms:
    """Return the squared distance, m², of a marker or station from a fixed position in ground at the end.

    Args:
        goal: goal of the study.
        problem: problem with the markers.

    Raises:
        DocumentError: the marker or station does not exist.
    """
    name = str(goal.point_name)
    problem.check_name(goal, name, problem.functions.mechanism.stations, "marker or station")

    def value(ends: Endpoints) -> Formula:
        positions = ends.end.output("stations")
        axis_targets = zip("xyz", goal.reference_location, strict=True)
        return sum((positions[f"{name}|{axis}"] - target) ** 2 for axis, target in axis_targets)

    return GoalTerms(value)


def build_expression_based_parameter_goal(
    goal: MocoExpressionBasedParameterGoal, problem: Problem
) -> GoalTerms:
    """Return the value of an expression of parameters.

    A property that is no parameter of the study enters with the model's number.

    Args:
        goal: goal of the study.
        problem: problem with the parameters.

    Raises:
        DocumentError: the expression or its variables are invalid.
    """
    if not goal.expression.strip():
        raise problem.invalid_error(goal, "expression is required")
    if len(goal.variables) != len(goal.parameters):
        raise problem.invalid_error(
            goal,
            f"it has {format_count(len(goal.parameters), 'parameter')} and "
            f"{format_count(len(goal.variables), 'variable')}; it needs one variable for each",
        )
    try:
        formula = expressions.Formula.parse(goal.expression, goal.variables, "expression")
    except ModelError as error:
        raise problem.invalid_error(goal, error.message) from None
    steps, constants = expressions.program(formula)
    parameter_paths = problem.functions.parameters
    # OpenSim takes the first of the components, which all have one value.
    paths = [problem.list_parameter_paths(parameter)[0] for parameter in goal.parameters]
    numbers = {
        path: _read_number(goal, problem, path) for path in paths if path not in parameter_paths
    }

    def value(ends: Endpoints) -> Formula:
        arguments = [
            numbers[path] if path in numbers else ends.start.p[parameter_paths.index(path)]
            for path in paths
        ]
        registers = RecordedVector([*arguments, *[0.0] * len(formula.steps)])
        return make_symbolic(run_program)(
            RecordedVector(steps),
            len(formula.steps),
            RecordedVector(constants),
            registers,
            len(arguments),
        )

    return GoalTerms(value, modes=COST_FIRST)


def _read_number(goal: MocoExpressionBasedParameterGoal, problem: Problem, path: str) -> float:
    """Return the number that the model has at the path of a property.

    Args:
        goal: goal, for messages.
        problem: problem with the model.
        path: path of the property.

    Raises:
        DocumentError: the model has no such number.
    """
    matches = find_properties(problem.model, path)
    try:
        return matches[0].make_setter(problem.model).get_value()
    except (IndexError, SettingError):
        raise problem.invalid_error(goal, f"the model has no number '{path}'") from None
