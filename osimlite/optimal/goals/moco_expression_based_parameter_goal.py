"""An expression of parameters."""

from __future__ import annotations

from osimlite.derivatives.symbolic import on_symbols
from osimlite.derivatives.symbols import Vector
from osimlite.errors import ModelError, SettingError
from osimlite.mechanics.kernels.programs import compute
from osimlite.mechanics.multibody.formula import Formula, program
from osimlite.optimal.point import Endpoints, GoalTerms
from osimlite.optimal.point import Formula as Value
from osimlite.optimal.problem import Problem
from osimlite.schema.moco.goals import MocoExpressionBasedParameterGoal
from osimlite.simulation.properties import places


def terms(goal: MocoExpressionBasedParameterGoal, problem: Problem) -> GoalTerms:
    """Its value; a property that is no parameter of the study is the number that the model has."""
    if not goal.expression.strip():
        raise problem.invalid_error(goal, "it has no expression")
    if len(goal.variables) != len(goal.parameters):
        raise problem.invalid_error(
            goal, f"it has {len(goal.parameters)} parameters and {len(goal.variables)} variables"
        )
    try:
        formula = Formula.parse(goal.expression, goal.variables, "expression")
    except ModelError as error:
        raise problem.invalid_error(goal, error.message) from None
    steps, constants = program(formula)
    known = problem.functions.parameters
    # OpenSim takes the first of the components, which all have one value.
    paths = [problem.list_parameter_paths(parameter)[0] for parameter in goal.parameters]
    numbers = {path: _number(goal, problem, path) for path in paths if path not in known}

    def value(ends: Endpoints) -> Value:
        given = [
            numbers[path] if path in numbers else ends.start.p[known.index(path)] for path in paths
        ]
        registers = Vector([*given, *[0.0] * len(formula.steps)])
        return on_symbols(compute)(
            Vector(steps), len(formula.steps), Vector(constants), registers, len(given)
        )

    return GoalTerms(value, modes=("cost", "endpoint_constraint"))


def _number(goal: MocoExpressionBasedParameterGoal, problem: Problem, path: str) -> float:
    found = places(problem.model, path)
    try:
        return found[0].setter(problem.model).get()
    except (IndexError, SettingError):
        raise problem.invalid_error(goal, f"the model has no number '{path}'") from None
