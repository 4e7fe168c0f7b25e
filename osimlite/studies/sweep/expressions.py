"""Measures that are written as expressions of what changes during a run.

``max(center_of_mass_Y) - 0.01*integral(soleus_r/activation^2)``: what stands for a number at all
times is made one by `max`, `min`, `mean`, `start`, `end` or `integral` (over time in s) of its
values at the times of the reports and at the end of the run.

================================  ===========================================================================
``time``                          s
``knee_r``, ``knee_r/speed``      value and generalized speed of a coordinate, by its name or path (rad, m)
``soleus_r/activation``           any state of a component, by its name or path
``soleus_r/control``              control of an actuator
``soleus_r``                      any column of the forces that `osimlite simulate` writes (N, N·m)
``metabolics_TOTAL``              any column of the probes
``center_of_mass_Y``              mass centre of the model in ground (m); with ``/speed`` its velocity (m/s)
``pelvis_X``, ``heel_Z``          mass centre of a body, as in OpenSim's BodyKinematics, or a marker; so too
================================  ===========================================================================
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from osimlite.base.text import suggest_name
from osimlite.errors import SettingError
from osimlite.simulation.link_motion import Moments, locate_mass_centers, locate_station
from osimlite.simulation.run_report import compute_probe_rows, list_probe_labels
from osimlite.studies.sweep.variables import Floats

Quantity = Callable[[Any, Moments], Any]
"""Numbers at all moments (k,) for an engine."""

REDUCTIONS: dict[str, Callable[[Floats, Floats], Any]] = {
    "start": lambda t, x: x[0],
    "end": lambda t, x: x[-1],
    "max": lambda t, x: x.max(),
    "min": lambda t, x: x.min(),
    "integral": lambda t, x: np.diff(t) @ (x[1:] + x[:-1]) / 2.0,
    "mean": lambda t, x: np.diff(t) @ (x[1:] + x[:-1]) / 2.0 / (t[-1] - t[0]),
}
FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    name: getattr(np, name) for name in ("abs", "sqrt", "exp", "log", "sin", "cos", "tan")
}
OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}


class Expression:
    """One number of a run.

    Args:
        text: as above.
        engine: of a model of the structure that the others have.

    Attributes:
        names: of what it looks at.

    Raises:
        SettingError: it is no expression, or names what is not there.
    """

    def __init__(self, text: str, engine: Any) -> None:
        self._text, known = text, list_quantities(engine)
        names = sorted(map(re.escape, known), key=len, reverse=True)
        calls = "|".join([*REDUCTIONS, *FUNCTIONS])
        self._quantities: list[Quantity] = []
        self.names: set[str] = set()

        def named(found: re.Match[str]) -> str:
            if found["call"] or found["number"]:
                return found[0]
            if found["word"]:
                raise SettingError(
                    f"the measure '{text}' has no '{found[0]}' to look at{suggest_name(found[0], known)}"
                )
            self._quantities.append(known[found[0]])
            self.names.add(found[0])
            return f"_{len(self._quantities) - 1}"

        marks = rf"(?P<call>\b({calls})(?=\s*\())|(?P<name>(?<!\w)({'|'.join(names)})(?![\w.]))"
        marks += r"|(?P<number>(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)|(?P<word>[^\W\d][\w.|]*)"
        python = re.sub(marks, named, text).replace("^", "**")
        try:
            self._tree = ast.parse(python.strip(), mode="eval").body
        except SyntaxError:
            raise SettingError(
                f"the measure '{text}' is no expression; write it as in max(NAME) - 2*end(NAME)"
            ) from None
        if np.ndim(self._number(np.arange(2.0), [np.ones(2)] * len(self._quantities))):
            raise SettingError(
                f"the measure '{text}' changes during a run; say what of it, as in max({text})"
            )

    def of(self, engine: Any, moments: Moments) -> float:
        """The number of a run.

        Args:
            engine: of its model.
            moments: of the run, two or more.
        """
        times = np.array([t for t, _ in moments])
        return float(
            self._number(times, [quantity(engine, moments) for quantity in self._quantities])
        )

    def _number(self, times: Floats, columns: Sequence[Floats]) -> Any:
        with np.errstate(all="ignore"):
            return self._value(self._tree, times, columns)

    def _value(self, node: ast.AST, times: Floats, columns: Sequence[Floats]) -> Any:
        def of(part: ast.AST) -> Any:
            return self._value(part, times, columns)

        match node:
            case ast.Constant(int() | float() as number):
                return np.float64(number)
            case ast.Name(name):
                return columns[int(name[1:])]
            case ast.BinOp(left, sign, right) if type(sign) in OPERATORS:
                return OPERATORS[type(sign)](of(left), of(right))
            case ast.UnaryOp(sign, operand) if type(sign) in OPERATORS:
                return OPERATORS[type(sign)](of(operand))
            case ast.Call(ast.Name(name), [argument], []) if name in FUNCTIONS:
                return FUNCTIONS[name](of(argument))
            case ast.Call(ast.Name(name), [argument], []) if name in REDUCTIONS:
                # A number is the same at all times.
                return REDUCTIONS[name](times, of(argument) + np.zeros(len(times)))
        raise SettingError(
            f"the measure '{self._text}' is no expression; there are + - * / ^ and functions of one number"
        )


def list_quantities(engine: Any) -> Mapping[str, Quantity]:
    """What can be looked at during the runs of a model, by name; of several with one name the first."""
    mechanism, count = engine.mechanism, len(engine.order)
    result: dict[str, Quantity] = {
        "time": lambda engine, moments: np.array([t for t, _ in moments])
    }
    places = {place: number for number, place in enumerate(engine.order)}
    for place, info in enumerate(mechanism.coordinates):
        value = partial(_state, places[place]) if place in places else partial(_still, place)
        speed = partial(_state, count + places[place]) if place in places else partial(_still, None)
        for name in (info.name, info.path):
            result |= {name: value, f"{name}/value": value, f"{name}/speed": speed}
    more: list[tuple[str, Quantity]] = []
    for number, path in enumerate(engine.state.paths):
        state = partial(_state, 2 * count + number)
        more += [(path, state), ("/".join(path.split("/")[-2:]), state)]
    for number, path in enumerate(engine.forces.controls.names):
        control = partial(_control, number)
        more += [(f"{path}/control", control), (f"{path.rpartition('/')[2]}/control", control)]
    points: dict[str, Callable[[Any, Moments], Floats]] = {"center_of_mass": locate_mass_centers}
    points |= {path.rpartition("/")[2]: partial(_marker, path) for path in mechanism.stations}
    points |= {body.name: partial(_body, number) for number, body in enumerate(mechanism.bodies)}
    for name, motion in points.items():
        for axis, letter in enumerate("XYZ"):
            more += [(f"{name}_{letter}", partial(_axis, motion, axis))]
            more += [(f"{name}_{letter}/speed", partial(_axis, motion, 3 + axis))]
    more += [(label, partial(_force, number)) for number, label in enumerate(engine.columns)]
    more += [
        (label, partial(_probe, number))
        for number, label in enumerate(list_probe_labels(engine.probes))
    ]
    return dict(reversed(more)) | result


def list_driven_names(engine: Any) -> set[str]:
    """Names of what depends on the controls of that moment, besides on the state."""
    controls = {
        f"{name}/control"
        for path in engine.forces.controls.names
        for name in (path, path.rpartition("/")[2])
    }
    return controls | {*engine.columns, *list_probe_labels(engine.probes)}


def _state(place: int, engine: Any, moments: Moments) -> Floats:
    return np.array([y[place] for _, y in moments])


def _still(place: int | None, engine: Any, moments: Moments) -> Floats:
    return np.full(
        len(moments), 0.0 if place is None else engine.mechanism.coordinates[place].default_value
    )


def _control(place: int, engine: Any, moments: Moments) -> Floats:
    result = []
    for t, y in moments:
        engine.compute_applied_forces(t, y)
        result.append(engine.read_controls()[place])
    return np.array(result)


def _force(place: int, engine: Any, moments: Moments) -> Floats:
    return np.array([engine.force_records(t, y)[place] for t, y in moments])


def _probe(place: int, engine: Any, moments: Moments) -> Floats:
    return np.array(list(compute_probe_rows(engine, moments, moments)))[:, place]


def _marker(path: str, engine: Any, moments: Moments) -> Floats:
    return locate_station(engine, moments, *engine.mechanism.stations[path])


def _body(number: int, engine: Any, moments: Moments) -> Floats:
    return locate_station(
        engine, moments, number, engine.mechanism.bodies[number].mass_properties.center
    )


def _axis(
    motion: Callable[[Any, Moments], Floats], axis: int, engine: Any, moments: Moments
) -> Floats:
    return motion(engine, moments)[:, axis]
