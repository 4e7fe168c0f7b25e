"""Outputs of components, by OpenSim's names, and the numbers that goals and constraints make of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from osimlite.base.text import did_you_mean
from osimlite.derivatives.symbols import casadi
from osimlite.optimal.point import Formula, Point
from osimlite.optimal.problem import Problem
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import Frame
from osimlite.schema.markers import Station
from osimlite.schema.moco.goals import MocoOutputBase
from osimlite.schema.moco.path_constraints import MocoOutputBoundConstraint
from osimlite.schema.model import Model
from osimlite.simulation.elements.kind import DeclaredForce

MIN_SQUARED_LENGTH = 1e-32
"""Squares of lengths below which a root has no slope."""
OPERATIONS: dict[str, Callable[[Formula, Formula], Formula]] = {
    "addition": lambda one, two: one + two,
    "subtraction": lambda one, two: one - two,
    "multiplication": lambda one, two: one * two,
    "division": lambda one, two: one / two,
}


def _differentiate(point: Point, column: Formula) -> Formula:
    """By time, of what depends on the state alone."""
    return casadi.jtimes(column, point.x, point.rates)


def _stack_vector(point: Point, group: str, path: str) -> Formula:
    found = point.output(group)
    return casadi.vertcat(*(found[f"{path}|{axis}"] for axis in "xyz"))


def _stack_mass_center_velocity(point: Point, path: str) -> Formula:
    return casadi.vertcat(*point.output("mass_center_velocity").values())


def _get_acceleration(point: Point, path: str) -> Formula:
    return point.accelerations[point.problem.functions.coordinates.index(path)]


OUTPUT_FORMULAS: dict[type[Any], dict[str, Callable[[Point, str], Formula]]] = {
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
"""By classes of components, their outputs that are formulas here, besides what forces record of themselves."""


def build_output_formula(
    part: MocoOutputBase | MocoOutputBoundConstraint, problem: Problem
) -> Callable[[Point], Formula]:
    """What a goal or a constraint makes of one output or of two.

    Args:
        part: that names them.
        problem: with the components.

    Returns: A number at a point: the component of the index or the length of what comes of the
        operation, to the exponent.

    Raises: DocumentError: there is no such component, or index, operation and exponent do not go
        with it. UnsupportedError: the output has no formula.
    """
    index, exponent = part.output_index, part.exponent
    if exponent < 1:
        raise problem.invalid_error(part, f"its exponent is {exponent}, and has to be 1 at least")
    if bool(part.second_output_path) != bool(part.operation):
        raise problem.invalid_error(part, "a second_output_path and an operation need each other")
    outputs = [
        _find_output(part, problem, text)
        for text in (part.output_path, part.second_output_path)
        if text
    ]
    if not outputs:
        raise problem.invalid_error(part, "it names no output_path")
    sizes = {size for size, _ in outputs}
    if len(sizes) > 1:
        raise problem.invalid_error(part, "its outputs are of different types")
    if not -1 <= index < max(sizes) or (index >= 0 and max(sizes) == 1):
        raise problem.invalid_error(part, f"its output has no component of output_index {index}")

    def value(point: Point) -> Formula:
        found = [formula(point, path) for _, (formula, path) in outputs]
        if index >= 0:
            found = [column[index] for column in found]
        result = OPERATIONS[part.operation](*found) if part.operation else found[0]
        if result.numel() > 1:
            square = casadi.sumsqr(result)
            return (
                square
                if exponent == 2
                else casadi.sqrt(casadi.fmax(square, MIN_SQUARED_LENGTH)) ** exponent
            )
        return (
            result
            if exponent == 1
            else result**exponent
            if exponent % 2 == 0
            else casadi.fabs(result) ** exponent
        )

    return value


def _find_output(
    part: Any, problem: Problem, text: str
) -> tuple[int, tuple[Callable[[Point, str], Formula], str]]:
    """Count of the numbers of an output, what gives it, and the path of its component."""
    path, _, name = text.strip().rpartition("|")
    path = f"/{path.strip('/')}"
    component: Any = problem.model if path == "/" else problem.components.get(path)
    if component is None:
        raise problem.invalid_error(
            part, f"the model has no component '{path}'{did_you_mean(path, problem.components)}"
        )
    for kind, known in OUTPUT_FORMULAS.items():
        if isinstance(component, kind) and name in known:
            return 1 if kind is Coordinate else 3, (known[name], path)
    # Motions that are given have no outputs, and say so.
    problem.functions.outputs  # noqa: B018
    forces: Any = problem.functions.forces.elements
    law = next(
        (each.kind for each in forces if each.path == path and isinstance(each, DeclaredForce)),
        None,
    )
    place = law.known_of.get(name) if law is not None else None
    if law is None or place is None:
        raise problem.unsupported_error(part, f"the output '{name}' of {path} has no formula here")
    # What it is called in the record.
    label = f"{path}|{next(own for own, at in law.recorded.items() if at == place)}"
    return 1, (lambda point, path: point.output("forces")[label], path)
