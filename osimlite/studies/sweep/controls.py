"""Variables of a sweep that are controls of actuators, and the controllers that apply them.

=============================  ==========================================================================
``soleus_r/control``           number that is added to the control at all times
``soleus_r/control@0.1``       node: value that is added at a time (s); all nodes of an actuator are joined
``soleus_r/control@0:0.5:6``   six nodes from 0 to 0.5 s; ``@0,0.1,0.3`` are nodes at these times
``soleus_r/control@switch1``   time (s) from which 1 is added until the next one, ``@switch2``, and so on
``soleus_r/control@scale``     factor of the functions of PrescribedControllers of the model
=============================  ==========================================================================

All of these become functions of PrescribedControllers, so that the model that is written behaves
the same in OpenSim.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from itertools import count
from typing import Any

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import suggest_name, suggest_or_list
from osimlite.errors import SettingError
from osimlite.schema.actuators import Actuator
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.functions import (
    Constant,
    Function,
    GCVSpline,
    MultiplierFunction,
    PiecewiseConstantFunction,
    PiecewiseLinearFunction,
)
from osimlite.schema.model import Model
from osimlite.schema.sets import Controller

OFFSET = "offset"
"""Kind of a control: a number that is added at all times."""
NODE = "node"
"""Kind of a control: a value at a time, between which controls are interpolated."""
SWITCH = "switch"
"""Kind of a control: a time at which 1 is added or removed."""
SCALE = "scale"
"""Kind of a control: a factor of the model's own control functions."""

INTERPOLATIONS = ("linear", "steps", "cubic")
"""Interpolations between nodes. Before the first and after the last node, lines and steps hold
their values.
"""

MIN_CUBIC_NODES = 4
"""Fewest nodes of a cubic spline of OpenSim (GCVSpline of degree 3)."""

BEFORE_START_S = -1.0
"""Time (s) before any run, at which functions begin so that their first value holds from the start."""

Values = Sequence[float]
"""Values of all variables of a sample."""


@dataclass(frozen=True)
class Control:
    """Number that the controls of one or more actuators depend on.

    Attributes:
        actuators: paths of the actuators.
        kind: `OFFSET`, `NODE`, `SWITCH` or `SCALE`.
        at: time of a node (s), or number of a switch.
    """

    actuators: tuple[str, ...]
    kind: str = OFFSET
    at: float = 0.0

    @property
    def parts(self) -> tuple[Control, ...]:
        """Controls of the single actuators.

        Returns:
            One control per actuator, so that two variables of the same one can be found.
        """
        return tuple(Control((path,), self.kind, self.at) for path in self.actuators)

    @property
    def unit(self) -> str:
        """Unit of the number: "s" for a time, else ""."""
        return "s" if self.kind == SWITCH else ""

    @property
    def current_value(self) -> float | None:
        """Number that changes nothing, from which a search starts; None for nodes and switches."""
        return {OFFSET: 0.0, SCALE: 1.0}.get(self.kind)


def parse_control(name: str, actuators: Sequence[str], word: str) -> Control:
    """Return the control that is meant by the word after the `@` in the name of a variable.

    Args:
        name: name of the variable, for errors.
        actuators: paths of the actuators.
        word: word after the `@`, or "" for an offset.

    Raises:
        SettingError: the word has no meaning.
    """
    kind, at = OFFSET, 0.0
    if word == SCALE:
        kind = SCALE
    elif number := re.fullmatch(rf"{SWITCH}(\d+)", word):
        kind, at = SWITCH, float(number[1])
    elif word:
        kind, at = NODE, _parse_time(name, word)
    return Control(tuple(actuators), kind, at)


def expand_nodes(name: str) -> list[str]:
    """Return the names of the nodes that one name stands for.

    For example, `a@0:0.4:3` is `a@0`, `a@0.2` and `a@0.4`.

    Raises:
        SettingError: the times are malformed.
    """
    front, at, word = name.partition("@")
    if at and not word:
        _parse_time(name, word)
    if ":" in word:
        first, _, rest = word.partition(":")
        last, _, number = rest.partition(":")
        if not number.isdigit() or int(number) < 2:
            raise SettingError(
                f"nodes are given as @FIRST:LAST:COUNT, with a count of two or more; got '{name}'"
            )
        times = np.linspace(_parse_time(name, first), _parse_time(name, last), int(number)).tolist()
    elif "," in word:
        times = [_parse_time(name, part) for part in word.split(",")]
    else:
        return [name]
    return [f"{front}@{time:.12g}" for time in times]


def _parse_time(name: str, word: str) -> float:
    """Return the time (s) behind the @ of a name."""
    try:
        time = float(word)
    except ValueError:
        time = -1.0
    if not 0.0 <= time < np.inf:
        raise SettingError(
            f"behind the @ of '{name}' is a time in s, 'switch1', 'switch2' ... or 'scale', not '{word}'"
        )
    return time


def check_nodes(controls: Mapping[int, Control], interpolation: str, to: float) -> None:
    """Refuse nodes that define no curve.

    Args:
        controls: controls that vary, by the indices of their variables.
        interpolation: one of `INTERPOLATIONS`.
        to: duration of the runs (s).

    Raises:
        SettingError: the interpolation is unknown, or a cubic has too few nodes or does not span
            the run.
    """
    if interpolation not in INTERPOLATIONS:
        raise SettingError(
            f"there is no interpolation '{interpolation}'{suggest_or_list(interpolation, INTERPOLATIONS)}"
        )
    # Lines and steps are defined for any number of nodes.
    if interpolation != "cubic":
        return
    for actuator, parts in _group_by_actuator(controls, NODE).items():
        times = [time for time, _ in parts]
        # Beyond its nodes a cubic would be extrapolated.
        if len(times) < MIN_CUBIC_NODES or times[0] > 0.0 or times[-1] < to * (1.0 - 1e-9):
            raise SettingError(
                f"a cubic needs {MIN_CUBIC_NODES} nodes or more, the first at 0 and the last at the end of the runs, "
                f"{to:g} s; those of '{actuator}' are at {', '.join(f'{time:g}' for time in times)} s"
            )


def make_controller(model: Model, controls: Mapping[str, Any]) -> PrescribedController:
    """Return a controller with given controls.

    Outside of the times of a table its first and last values hold.

    Args:
        model: model with the actuators.
        controls: by the name or path of an actuator a number, or `(times, values)` with times in s.

    Raises:
        SettingError: an actuator is unknown, or a control is something else.
    """
    actuators = {
        key: item.path for item in model.components(Actuator) for key in (item.name, item.path)
    }
    made = _make_empty_controller(model, "given", [actuators.get(key, key) for key in controls])
    for name, given in controls.items():
        if name not in actuators:
            raise SettingError(
                f"the model has no actuator '{name}' to control{suggest_name(name, actuators)}"
            )
        if isinstance(given, tuple):
            times, values = (np.asarray(numbers, dtype=float).tolist() for numbers in given)
            # OpenSim extrapolates a PiecewiseLinearFunction linearly; equal outer values hold the
            # ends.
            y = (values[0], *values, values[-1])
            made.ControlFunctions.objects.append(
                PiecewiseLinearFunction(x=_extend_times(times), y=y)
            )
        elif isinstance(given, int | float):
            made.ControlFunctions.objects.append(Constant(value=float(given)))
        else:
            raise SettingError(
                f"the control of '{name}' is {given!r}; a sweep takes numbers and tables"
            )
    return made


def _make_empty_controller(
    model: Model, kind: str, actuators: Sequence[str]
) -> PrescribedController:
    """Return a controller without functions, with an unused name.

    A model of an earlier search has controllers of the same kind.
    """
    taken = {item.name for item in model.components(Controller)}
    name = next(name for number in count(1) if (name := f"{kind}_{number}") not in taken)
    return PrescribedController(name=name, socket_actuators=tuple(actuators))


def _extend_times(times: Values) -> tuple[float, ...]:
    """Return times with one more at either end, so that the outer values hold."""
    return (min(BEFORE_START_S, times[0] - 1.0), *times, times[-1] + 1.0)


class VariedControls:
    """Controllers that apply the controls which a sweep varies.

    Args:
        model: model to which they are added.
        controls: controls that vary, by the indices of their variables.
        interpolation: interpolation between nodes.

    Attributes:
        controllers: controllers whose functions depend on variables.

    Raises:
        SettingError: the model has no function for a control that is to be scaled.
    """

    def __init__(self, model: Model, controls: Mapping[int, Control], interpolation: str) -> None:
        self.controllers: list[Controller] = []
        self._puts: list[tuple[Function, str, Callable[[Values], Any]]] = []
        for actuator, ((_, place),) in _group_by_actuator(controls, SCALE).items():
            self._add_multiplier(model, actuator, place)
        # One controller per kind: OpenSim adds the controls of all controllers.
        for kind in (OFFSET, NODE, SWITCH):
            if parts := _group_by_actuator(controls, kind):
                made = _make_empty_controller(model, kind, list(parts))
                made.ControlFunctions.objects += [
                    self._make_function(kind, own, interpolation) for own in parts.values()
                ]
                self.controllers.append(model.add(made))

    def apply(self, values: Values) -> None:
        """Set the functions of the controllers to the values of all variables."""
        for function, name, made in self._puts:
            setattr(function, name, made(values))

    def _make_function(
        self, kind: str, parts: Sequence[tuple[float, int]], interpolation: str
    ) -> Function:
        """Return a control as a function of time, whose numbers each run sets."""
        times, places = zip(*parts, strict=True)
        function: Function
        if kind == OFFSET:
            function = Constant()
            self._puts.append((function, "value", lambda values: values[places[0]]))
        elif kind == SWITCH:
            # A search may move one switch past another: sorting keeps the function defined.
            x = (BEFORE_START_S, *(0.0 for _ in places))
            y = (float(k % 2) for k in range(len(places) + 1))
            function = PiecewiseConstantFunction(x=x, y=tuple(y))
            self._puts.append(
                (function, "x", lambda values: (BEFORE_START_S, *sorted(values[k] for k in places)))
            )
        else:
            if interpolation == "cubic":
                function = GCVSpline(half_order=2, x=times, weights=(1.0,) * len(times))
            else:
                made = (
                    PiecewiseLinearFunction
                    if interpolation == "linear"
                    else PiecewiseConstantFunction
                )
                function = made(x=_extend_times(times))
                places = (places[0], *places, places[-1])
            function.y = (0.0,) * len(places)
            self._puts.append((function, "y", lambda values: tuple(values[k] for k in places)))
        return function

    def _add_multiplier(self, model: Model, actuator: str, place: int) -> None:
        """Replace the functions of a control by multiples of them."""
        before = len(self._puts)
        for controller in model.components(PrescribedController):
            functions = controller.ControlFunctions.objects
            targets = [
                model.tree().target(controller, "socket_actuators", word)
                for word in controller.socket_actuators
            ]
            for number, (target, own) in enumerate(zip(targets, functions, strict=False)):
                if target is not None and target.path == actuator:
                    functions[number] = multiplier = MultiplierFunction(name=own.name, function=own)
                    self._puts.append((multiplier, "scale", lambda values: values[place]))
                    self.controllers.append(controller)
        # Scaling nothing would leave all runs equal, without a message.
        if len(self._puts) == before:
            raise SettingError(
                f"no function of a PrescribedController makes the control of '{actuator}', so that there is nothing to "
                "scale; give one with --controls"
            )


def _group_by_actuator(
    controls: Mapping[int, Control], kind: str
) -> dict[str, list[tuple[float, int]]]:
    """Return the controls of a kind by actuator.

    Each is a pair of time or number, and index of the variable; pairs are sorted.
    """
    result: dict[str, list[tuple[float, int]]] = {}
    for place, part in controls.items():
        if part.kind == kind:
            for actuator in part.actuators:
                result.setdefault(actuator, []).append((part.at, place))
    return {actuator: sorted(parts) for actuator, parts in result.items()}
