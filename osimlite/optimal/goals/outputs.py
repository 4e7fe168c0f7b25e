"""Outputs of components by OpenSim's names, and the goals on them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from osimlite.base.text import suggest_name
from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import COST_FIRST, Formula, GoalTerms, PointSymbols, make_integral_terms
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import Frame
from osimlite.schema.markers import Station
from osimlite.schema.moco.goals import (
    MocoFinalOutputGoal,
    MocoInitialOutputGoal,
    MocoOutputBase,
    MocoOutputGoal,
)
from osimlite.schema.moco.path_constraints import MocoOutputBoundConstraint
from osimlite.schema.model import Model
from osimlite.simulation.elements.force_type import DeclaredForce

if TYPE_CHECKING:
    from osimlite.optimal.problem import Problem

MIN_SQUARED_LENGTH = 1e-32
"""Squared length that replaces smaller ones, as the square root has no slope at zero."""
OPERATIONS: dict[str, Callable[[Formula, Formula], Formula]] = {
    "addition": lambda first, second: first + second,
    "subtraction": lambda first, second: first - second,
    "multiplication": lambda first, second: first * second,
    "division": lambda first, second: first / second,
}
"""Operations on two outputs, by the words of the property ``operation``."""


def build_output_goal(goal: MocoOutputGoal, problem: Problem) -> GoalTerms:
    """Return the integral over time of an output, in its unit times s.

    Args:
        goal: goal of the study.
        problem: problem with the components.
    """
    return make_integral_terms(build_output_formula(goal, problem), COST_FIRST)


def build_initial_output_goal(goal: MocoInitialOutputGoal, problem: Problem) -> GoalTerms:
    """Return the value of an output at the start.

    Args:
        goal: goal of the study.
        problem: problem with the components.
    """
    value = build_output_formula(goal, problem)
    return GoalTerms(lambda ends: value(ends.start), modes=COST_FIRST)


def build_final_output_goal(goal: MocoFinalOutputGoal, problem: Problem) -> GoalTerms:
    """Return the value of an output at the end.

    Args:
        goal: goal of the study.
        problem: problem with the components.
    """
    value = build_output_formula(goal, problem)
    return GoalTerms(lambda ends: value(ends.end), modes=COST_FIRST)


def _differentiate(point: PointSymbols, column: Formula) -> Formula:
    """Return the time derivative of a formula that depends on the state alone.

    Args:
        point: point of the grid.
        column: formula (k, 1).
    """
    return casadi.jtimes(column, point.x, point.rates)


def _stack_vector(point: PointSymbols, group: str, path: str) -> Formula:
    """Return the vector (3, 1) of a component in a group of outputs."""
    values = point.output(group)
    return casadi.vertcat(*(values[f"{path}|{axis}"] for axis in "xyz"))


def _stack_mass_center_velocity(point: PointSymbols, path: str) -> Formula:
    """Return the velocity of the model's mass centre in ground (3, 1), m/s."""
    return casadi.vertcat(*point.output("mass_center_velocity").values())


def _get_acceleration(point: PointSymbols, path: str) -> Formula:
    """Return the acceleration of a coordinate, m/s² or rad/s²."""
    return point.accelerations[point.problem.functions.coordinates.index(path)]


OUTPUT_FORMULAS: dict[type[Any], dict[str, Callable[[PointSymbols, str], Formula]]] = {
    Model: {
        "com_position": lambda point, path: point.mass_center(),
        "com_velocity": _stack_mass_center_velocity,
        "com_acceleration": lambda point, path: _differentiate(
            point, _stack_mass_center_velocity(point, path)
        ),
    },
    Frame: {
        "position": lambda point, path: point.frame(path).position,
        "linear_velocity": lambda point, path: point.frame(path).velocity,
        "angular_velocity": lambda point, path: point.frame(path).angular_velocity,
        "linear_acceleration": lambda point, path: _differentiate(
            point, point.frame(path).velocity
        ),
        "angular_acceleration": lambda point, path: _differentiate(
            point, point.frame(path).angular_velocity
        ),
    },
    Station: {
        "location": lambda point, path: _stack_vector(point, "stations", path),
        "velocity": lambda point, path: _stack_vector(point, "station_velocities", path),
        "acceleration": lambda point, path: _differentiate(
            point, _stack_vector(point, "station_velocities", path)
        ),
    },
    Coordinate: {
        "value": lambda point, path: point.state(f"{path}/value"),
        "speed": lambda point, path: point.state(f"{path}/speed"),
        "acceleration": _get_acceleration,
    },
}
"""Formulas of outputs by component class and output name; outputs of forces come from their records."""


def build_output_formula(
    owner: MocoOutputBase | MocoOutputBoundConstraint, problem: Problem
) -> Callable[[PointSymbols], Formula]:
    """Build the formula that a goal or a constraint makes of one or two outputs.

    Args:
        owner: goal or constraint with the paths of the outputs.
        problem: problem with the components.

    Returns:
        Function of a point that returns a number: the component of `output_index`, or the length,
        of the result of `operation`, raised to `exponent`.

    Raises:
        DocumentError: there is no such component, or index, operation and exponent do not fit it.
        UnsupportedError: the output has no formula.
    """
    index = owner.output_index
    exponent = owner.exponent
    if exponent < 1:
        raise problem.invalid_error(owner, f"exponent is {exponent}; expected 1 or more")
    if bool(owner.second_output_path) != bool(owner.operation):
        raise problem.invalid_error(owner, "second_output_path and operation require each other")
    outputs = [
        _find_output(owner, problem, text)
        for text in (owner.output_path, owner.second_output_path)
        if text
    ]
    if not outputs:
        raise problem.invalid_error(owner, "output_path is required")
    sizes = {size for size, _ in outputs}
    if len(sizes) > 1:
        raise problem.invalid_error(
            owner, "output_path and second_output_path have different types"
        )
    if not -1 <= index < max(sizes) or (index >= 0 and max(sizes) == 1):
        raise problem.invalid_error(
            owner, f"output_index is {index}, but the output has no component of this index"
        )

    def value(point: PointSymbols) -> Formula:
        """Return the number that the property `operation` makes of the outputs at a point."""
        values = [formula(point, path) for _, (formula, path) in outputs]
        if index >= 0:
            values = [column[index] for column in values]
        result = OPERATIONS[owner.operation](*values) if owner.operation else values[0]
        if result.numel() > 1:
            square = casadi.sumsqr(result)
            # The square of the length needs no root, which has no slope at zero.
            if exponent == 2:
                return square
            return casadi.sqrt(casadi.fmax(square, MIN_SQUARED_LENGTH)) ** exponent
        if exponent == 1:
            return result
        # Odd powers take the absolute value, as in OpenSim.
        return result**exponent if exponent % 2 == 0 else casadi.fabs(result) ** exponent

    return value


def _find_output(
    owner: Any, problem: Problem, text: str
) -> tuple[int, tuple[Callable[[PointSymbols, str], Formula], str]]:
    """Find the formula of an output by its path.

    Args:
        owner: goal or constraint, for messages.
        problem: problem with the components.
        text: path of the component, "|" and the name of the output.

    Returns:
        Size of the output, and its formula with the path of the component.

    Raises:
        DocumentError: the model has no such component.
        UnsupportedError: the output has no formula.
    """
    path, _, name = text.strip().rpartition("|")
    path = f"/{path.strip('/')}"
    component: Any = problem.model if path == "/" else problem.components.get(path)
    if component is None:
        raise problem.invalid_error(
            owner, f"the model has no component '{path}'{suggest_name(path, problem.components)}"
        )
    for component_class, formulas in OUTPUT_FORMULAS.items():
        if isinstance(component, component_class) and name in formulas:
            return 1 if component_class is Coordinate else 3, (formulas[name], path)
    # Prescribed motions have no outputs: the property raises the error that says so.
    problem.functions.outputs  # noqa: B018
    forces: Any = problem.functions.forces.elements
    law = next(
        (
            element.force_type
            for element in forces
            if element.path == path and isinstance(element, DeclaredForce)
        ),
        None,
    )
    index = law.record_names.get(name) if law is not None else None
    if law is None or index is None:
        raise problem.make_unsupported_error(
            owner, f"the output '{name}' of {path} is not supported"
        )
    # The record of the force may have another label for the output.
    label = f"{path}|{next(label for label, record_index in law.record_offsets.items() if record_index == index)}"
    return 1, (lambda point, path: point.output("forces")[label], path)
