"""Measures of sweeps that are expressions of quantities of a run.

``max(center_of_mass_Y) - 0.01*integral(soleus_r/activation^2)``: functions `max`, `min`, `mean`,
`start`, `end` and `integral` (over time in s) turn a quantity into a number. They use its values at
the times of the reports and at the end of the run.

================================  =========================================================================
``time``                          time (s)
``knee_r``, ``knee_r/speed``      value and generalized speed of a coordinate, by its name or path (rad, m)
``soleus_r/activation``           any state of a component, by its name or path
``soleus_r/control``              control of an actuator
``soleus_r``                      any column of the forces that `osimlite simulate` writes (N, N·m)
``metabolics_TOTAL``              any column of the probes
``center_of_mass_Y``              mass centre of the model in ground (m); with ``/speed`` its velocity (m/s)
``pelvis_X``, ``heel_Z``          the same of a body, as in OpenSim's BodyKinematics, or of a marker
================================  =========================================================================
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from osimlite.base.syntax_trees import parse_expression
from osimlite.base.text import suggest_name, suggest_or_list
from osimlite.errors import SettingError
from osimlite.simulation.link_motion import Moments, locate_mass_centers, locate_station
from osimlite.simulation.run_report import compute_probe_rows, list_probe_labels
from osimlite.studies.sweep.variables import Floats

Quantity = Callable[[Any, Moments], Any]
"""Function of an engine and of moments of a run that returns a number for each moment (k,)."""

REDUCTIONS: dict[str, Callable[[Floats, Floats], Any]] = {
    "start": lambda t, x: x[0],
    "end": lambda t, x: x[-1],
    "max": lambda t, x: x.max(),
    "min": lambda t, x: x.min(),
    "integral": lambda t, x: np.diff(t) @ (x[1:] + x[:-1]) / 2.0,
    "mean": lambda t, x: np.diff(t) @ (x[1:] + x[:-1]) / 2.0 / (t[-1] - t[0]),
}
"""Functions of times (k,) and values (k,) that return one number; integrals use the trapezoidal
rule.
"""
FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    name: getattr(np, name) for name in ("abs", "sqrt", "exp", "log", "sin", "cos", "tan")
}
"""Functions of one number, which apply to each moment."""
MAX_DEPTH = 200
"""Levels of an expression: each takes two calls of Python, which allows a thousand."""
OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
"""Operators by the nodes of Python's syntax tree."""


class ExpressionMeasure:
    """Measure that is an expression.

    Args:
        text: text of the expression.
        engine: engine of a model of the same structure as those of the runs.

    Attributes:
        names: quantities that the expression uses.

    Raises:
        SettingError: the text is no expression, or names an unknown quantity or function.
    """

    def __init__(self, text: str, engine: Any) -> None:
        self._text, quantities = text, list_quantities(engine)
        # Longer names first, so that "knee_r/speed" is not read as "knee_r" divided by "speed".
        names = sorted(map(re.escape, quantities), key=len, reverse=True)
        calls = "|".join([*REDUCTIONS, *FUNCTIONS])
        self._quantities: list[Quantity] = []
        self.names: set[str] = set()

        # Names of quantities, such as "soleus_r/activation", are not Python names. They are replaced
        # by placeholders, so that Python's parser reads the rest.
        def replace_name(match: re.Match[str]) -> str:
            if match["call"] or match["number"]:
                return match[0]
            if match["word"] and text[match.end() :].lstrip().startswith("("):
                functions = [*REDUCTIONS, *FUNCTIONS]
                raise SettingError(
                    f"the measure '{text}' calls the unknown function '{match[0]}'{suggest_or_list(match[0], functions)}"
                )
            if match["word"]:
                raise SettingError(
                    f"the measure '{text}' names the unknown quantity '{match[0]}'{suggest_name(match[0], quantities)}"
                )
            self._quantities.append(quantities[match[0]])
            self.names.add(match[0])
            return f"_{len(self._quantities) - 1}"

        token_pattern = (
            rf"(?P<call>\b({calls})(?=\s*\())|(?P<name>(?<!\w)({'|'.join(names)})(?![\w.]))"
        )
        token_pattern += r"|(?P<number>(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)|(?P<word>[^\W\d][\w.|]*)"
        python = re.sub(token_pattern, replace_name, text).replace("^", "**")
        try:
            self._tree = parse_expression(python.strip()).body
        except SyntaxError:
            raise SettingError(
                f"the measure '{text}' is not an expression; an example of one is max(NAME) - 2*end(NAME)"
            ) from None
        if _measure_depth(self._tree) > MAX_DEPTH:
            raise SettingError(
                f"the measure '{text[:40]}…' nests more than {MAX_DEPTH} levels deep; write it shorter"
            )
        # A trial with two moments shows whether the result is a number or a history.
        if np.ndim(self._evaluate_columns(np.arange(2.0), [np.ones(2)] * len(self._quantities))):
            raise SettingError(
                f"the measure '{text}' changes during a run; reduce it to one number, for example with max({text})"
            )

    def evaluate(self, engine: Any, moments: Moments) -> float:
        """Return the number of a run.

        Args:
            engine: engine of the model of the run.
            moments: times and states of the run, two or more.
        """
        times = np.array([t for t, _ in moments])
        return float(
            self._evaluate_columns(
                times, [quantity(engine, moments) for quantity in self._quantities]
            )
        )

    def _evaluate_columns(self, times: Floats, columns: Sequence[Floats]) -> Any:
        """Return the value of the expression for histories (t,) of its quantities.

        Returns:
            A number, or a history (t,) if the expression does not reduce its quantities to a
            number.
        """
        # A division by zero gives NaN or infinity, which counts as a run without a result.
        with np.errstate(all="ignore"):
            return self._evaluate_node(self._tree, times, columns)

    def _evaluate_node(self, node: ast.AST, times: Floats, columns: Sequence[Floats]) -> Any:
        """Return the value of a part of the expression: a number, or a history (t,).

        Raises:
            SettingError: an operator, a function or another part is not allowed in expressions.
        """

        def evaluate(child: ast.AST) -> Any:
            return self._evaluate_node(child, times, columns)

        match node:
            case ast.Constant(int() | float() as number):
                return np.float64(number)
            case ast.Name(name):
                return columns[int(name[1:])]
            case ast.BinOp(left, sign, right) if type(sign) in OPERATORS:
                return OPERATORS[type(sign)](evaluate(left), evaluate(right))
            case ast.UnaryOp(sign, operand) if type(sign) in OPERATORS:
                return OPERATORS[type(sign)](evaluate(operand))
            case ast.Call(ast.Name(name), [argument], []) if name in FUNCTIONS:
                return FUNCTIONS[name](evaluate(argument))
            case ast.Call(ast.Name(name), [argument], []) if name in REDUCTIONS:
                # Adding zeros makes a history of a constant.
                return REDUCTIONS[name](times, evaluate(argument) + np.zeros(len(times)))
        raise SettingError(
            f"the measure '{self._text}' is not a valid expression; it may contain + - * / ^ and functions of one argument"
        )


def _measure_depth(tree: ast.AST) -> int:
    """Return the number of levels of nested expressions."""
    depth = 0
    level = [tree]
    while level:
        depth += 1
        level = [child for node in level for child in ast.iter_child_nodes(node)]
    return depth


def list_quantities(engine: Any) -> Mapping[str, Quantity]:
    """List the quantities of the runs of a model.

    Args:
        engine: engine of the model.

    Returns:
        Quantity by name and by path. Where several components have a name, it means the first.
    """
    mechanism = engine.mechanism
    count = len(engine.order)
    result: dict[str, Quantity] = {
        "time": lambda engine, moments: np.array([t for t, _ in moments])
    }
    dof_by_coordinate = {
        coordinate_index: number for number, coordinate_index in enumerate(engine.order)
    }
    for coordinate_index, info in enumerate(mechanism.coordinates):
        value = (
            partial(_read_state, dof_by_coordinate[coordinate_index])
            if coordinate_index in dof_by_coordinate
            else partial(_read_constant, coordinate_index)
        )
        speed = (
            partial(_read_state, count + dof_by_coordinate[coordinate_index])
            if coordinate_index in dof_by_coordinate
            else partial(_read_constant, None)
        )
        for name in (info.name, info.path):
            result |= {name: value, f"{name}/value": value, f"{name}/speed": speed}
    named_quantities: list[tuple[str, Quantity]] = []
    for number, path in enumerate(engine.state.paths):
        state = partial(_read_state, 2 * count + number)
        named_quantities += [(path, state), ("/".join(path.split("/")[-2:]), state)]
    for number, path in enumerate(engine.forces.controls.names):
        control = partial(_compute_control, number)
        named_quantities += [
            (f"{path}/control", control),
            (f"{path.rpartition('/')[2]}/control", control),
        ]
    points: dict[str, Callable[[Any, Moments], Floats]] = {"center_of_mass": locate_mass_centers}
    points |= {
        path.rpartition("/")[2]: partial(_locate_marker, path) for path in mechanism.stations
    }
    points |= {
        body.name: partial(_locate_body, number) for number, body in enumerate(mechanism.bodies)
    }
    for name, motion in points.items():
        for axis, letter in enumerate("XYZ"):
            named_quantities += [(f"{name}_{letter}", partial(_select_axis, motion, axis))]
            named_quantities += [
                (f"{name}_{letter}/speed", partial(_select_axis, motion, 3 + axis))
            ]
    named_quantities += [
        (label, partial(_compute_force, number)) for number, label in enumerate(engine.columns)
    ]
    named_quantities += [
        (label, partial(_compute_probe, number))
        for number, label in enumerate(list_probe_labels(engine.probes))
    ]
    # Reversed, so that of equal names the first one remains; coordinates have precedence.
    return dict(reversed(named_quantities)) | result


def list_driven_names(engine: Any) -> set[str]:
    """Return the names of quantities that depend on the controls at a moment besides the state."""
    controls = {
        f"{name}/control"
        for path in engine.forces.controls.names
        for name in (path, path.rpartition("/")[2])
    }
    return controls | {*engine.columns, *list_probe_labels(engine.probes)}


def _read_state(offset: int, engine: Any, moments: Moments) -> Floats:
    """Return the history (t,) of an entry of the state."""
    return np.array([y[offset] for _, y in moments])


def _read_constant(coordinate_index: int | None, engine: Any, moments: Moments) -> Floats:
    """Return the value of a locked coordinate, or 0 for its speed, at all moments."""
    return np.full(
        len(moments),
        0.0
        if coordinate_index is None
        else engine.mechanism.coordinates[coordinate_index].default_value,
    )


def _compute_control(control_index: int, engine: Any, moments: Moments) -> Floats:
    """Return the history (t,) of a control."""
    result = []
    for t, y in moments:
        # Controls are computed with the forces.
        engine.compute_applied_forces(t, y)
        result.append(engine.read_controls()[control_index])
    return np.array(result)


def _compute_force(column: int, engine: Any, moments: Moments) -> Floats:
    """Return the history (t,) of a column of the forces' records."""
    return np.array([engine.force_records(t, y)[column] for t, y in moments])


def _compute_probe(column: int, engine: Any, moments: Moments) -> Floats:
    """Return the history (t,) of a value of the probes."""
    return np.array(list(compute_probe_rows(engine, moments, moments)))[:, column]


def _locate_marker(path: str, engine: Any, moments: Moments) -> Floats:
    """Return the positions (t, 3) of a marker in ground (m)."""
    return locate_station(engine, moments, *engine.mechanism.stations[path])


def _locate_body(number: int, engine: Any, moments: Moments) -> Floats:
    """Return the positions (t, 3) of a body's mass centre in ground (m)."""
    return locate_station(
        engine, moments, number, engine.mechanism.bodies[number].mass_properties.center
    )


def _select_axis(
    motion: Callable[[Any, Moments], Floats], axis: int, engine: Any, moments: Moments
) -> Floats:
    """Return the history (t,) of one component of a position."""
    return motion(engine, moments)[:, axis]
