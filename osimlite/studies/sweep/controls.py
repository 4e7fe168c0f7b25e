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
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.forces import Actuator
from osimlite.schema.functions import Constant, Function, MultiplierFunction
from osimlite.schema.model import Model
from osimlite.schema.sets import Controller
from osimlite.schema.splines import GCVSpline, PiecewiseConstantFunction, PiecewiseLinearFunction

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


def parse_control(name: str, actuators: Sequence[str], time_or_mode: str) -> Control:
    """Return the control that is meant by the word after the `@` in the name of a variable.

    Args:
        name: name of the variable, for errors.
        actuators: paths of the actuators.
        time_or_mode: word after the `@`, or "" for an offset.

    Raises:
        SettingError: the word has no meaning.
    """
    mode, time = OFFSET, 0.0
    if time_or_mode == SCALE:
        mode = SCALE
    elif number := re.fullmatch(rf"{SWITCH}(\d+)", time_or_mode):
        mode = SWITCH
        time = float(number[1])
    elif time_or_mode:
        mode = NODE
        time = _parse_time(name, time_or_mode)
    return Control(tuple(actuators), mode, time)


def expand_nodes(name: str) -> list[str]:
    """Return the names of the nodes that one name stands for.

    For example, `a@0:0.4:3` is `a@0`, `a@0.2` and `a@0.4`.

    Raises:
        SettingError: the times are malformed.
    """
    control_name, separator, times_text = name.partition("@")
    if separator and not times_text:
        _parse_time(name, times_text)
    if ":" in times_text:
        first_time, _, end_and_count = times_text.partition(":")
        last_time, _, number = end_and_count.partition(":")
        if not number.isdigit() or int(number) < 2:
            raise SettingError(
                f"write nodes of a control as @FIRST:LAST:COUNT, with a COUNT of at least 2; found '{name}'"
            )
        times = np.linspace(
            _parse_time(name, first_time), _parse_time(name, last_time), int(number)
        ).tolist()
    elif "," in times_text:
        times = [_parse_time(name, time_text) for time_text in times_text.split(",")]
    else:
        return [name]
    return [f"{control_name}@{time:.12g}" for time in times]


def _parse_time(name: str, text: str) -> float:
    """Return the time (s) behind the @ of a name.

    Raises:
        SettingError: the text is not a finite number of at least 0.
    """
    try:
        time = float(text)
    except ValueError:
        time = -1.0
    if not 0.0 <= time < np.inf:
        raise SettingError(
            f"expected a time in s, 'switch1', 'switch2' ... or 'scale' after the @ of '{name}', found '{text}'"
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
    for actuator, nodes in _group_by_actuator(controls, NODE).items():
        times = [time for time, _ in nodes]
        # Beyond its nodes a cubic would be extrapolated.
        if len(times) < MIN_CUBIC_NODES or times[0] > 0.0 or times[-1] < to * (1.0 - 1e-9):
            raise SettingError(
                f"cubic interpolation needs at least {MIN_CUBIC_NODES} nodes, the first at 0 s and the last "
                f"at the end of the runs, {to:g} s; the nodes of '{actuator}' are at {', '.join(f'{time:g}' for time in times)} s"
            )


def make_controller(model: Model, controls: Mapping[str, Any]) -> PrescribedController:
    """Return a controller with given controls.

    Outside of the times of a table its first and last values hold.

    Args:
        model: model with the actuators.
        controls: number, or `(times, values)` with times in s, for each actuator by name or path.

    Raises:
        SettingError: an actuator is unknown, or a control is something else.
    """
    actuators = {
        key: actuator.path
        for actuator in model.components(Actuator)
        for key in (actuator.name, actuator.path)
    }
    controller = _make_empty_controller(
        model, "given", [actuators.get(key, key) for key in controls]
    )
    for name, control in controls.items():
        if name not in actuators:
            raise SettingError(
                f"the model has no actuator '{name}' to control{suggest_name(name, actuators)}"
            )
        if isinstance(control, tuple):
            times, values = (np.asarray(numbers, dtype=float).tolist() for numbers in control)
            # OpenSim extrapolates a PiecewiseLinearFunction linearly; equal outer values hold the
            # ends.
            y = (values[0], *values, values[-1])
            controller.ControlFunctions.objects.append(
                PiecewiseLinearFunction(x=_extend_times(times), y=y)
            )
        elif isinstance(control, int | float):
            controller.ControlFunctions.objects.append(Constant(value=float(control)))
        else:
            raise SettingError(
                f"the control of '{name}' is {control!r}; a sweep accepts only numbers and tables as controls"
            )
    return controller


def _make_empty_controller(
    model: Model, base_name: str, actuators: Sequence[str]
) -> PrescribedController:
    """Return a controller without functions, with an unused name.

    A model of an earlier search has controllers of the same kind.
    """
    used_names = {controller.name for controller in model.components(Controller)}
    name = next(name for number in count(1) if (name := f"{base_name}_{number}") not in used_names)
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
        for actuator, ((_, index),) in _group_by_actuator(controls, SCALE).items():
            self._add_multiplier(model, actuator, index)
        # One controller per kind: OpenSim adds the controls of all controllers.
        for mode in (OFFSET, NODE, SWITCH):
            if controls_by_actuator := _group_by_actuator(controls, mode):
                controller = _make_empty_controller(model, mode, list(controls_by_actuator))
                controller.ControlFunctions.objects += [
                    self._make_function(mode, actuator_controls, interpolation)
                    for actuator_controls in controls_by_actuator.values()
                ]
                self.controllers.append(model.add(controller))

    def apply(self, values: Values) -> None:
        """Set the functions of the controllers to the values of all variables."""
        for function, name, make_value in self._puts:
            setattr(function, name, make_value(values))

    def _make_function(
        self, mode: str, timed_indices: Sequence[tuple[float, int]], interpolation: str
    ) -> Function:
        """Return a control as a function of time, whose numbers each run sets."""
        times, indices = zip(*timed_indices, strict=True)
        function: Function
        if mode == OFFSET:
            function = Constant()
            self._puts.append((function, "value", lambda values: values[indices[0]]))
        elif mode == SWITCH:
            # A search may move one switch past another: sorting keeps the function defined.
            x = (BEFORE_START_S, *(0.0 for _ in indices))
            y = (float(k % 2) for k in range(len(indices) + 1))
            function = PiecewiseConstantFunction(x=x, y=tuple(y))
            self._puts.append(
                (
                    function,
                    "x",
                    lambda values: (BEFORE_START_S, *sorted(values[k] for k in indices)),
                )
            )
        else:
            if interpolation == "cubic":
                function = GCVSpline(half_order=2, x=times, weights=(1.0,) * len(times))
            else:
                function_class = (
                    PiecewiseLinearFunction
                    if interpolation == "linear"
                    else PiecewiseConstantFunction
                )
                function = function_class(x=_extend_times(times))
                indices = (indices[0], *indices, indices[-1])
            function.y = (0.0,) * len(indices)
            self._puts.append((function, "y", lambda values: tuple(values[k] for k in indices)))
        return function

    def _add_multiplier(self, model: Model, actuator: str, index: int) -> None:
        """Replace the functions of a control by multiples of them.

        Raises:
            SettingError: no PrescribedController sets the control by a function.
        """
        count_before = len(self._puts)
        for controller in model.components(PrescribedController):
            functions = controller.ControlFunctions.objects
            targets = [
                model.tree().target(controller, "socket_actuators", path)
                for path in controller.socket_actuators
            ]
            for number, (target, original) in enumerate(zip(targets, functions, strict=False)):
                if target is not None and target.path == actuator:
                    functions[number] = multiplier = MultiplierFunction(
                        name=original.name, function=original
                    )
                    self._puts.append((multiplier, "scale", lambda values: values[index]))
                    self.controllers.append(controller)
        # Scaling nothing would leave all runs equal, without a message.
        if len(self._puts) == count_before:
            raise SettingError(
                f"no PrescribedController sets the control of '{actuator}' by a function, so there is no control to "
                "scale; give one with --controls (controls=)"
            )


def _group_by_actuator(
    controls: Mapping[int, Control], mode: str
) -> dict[str, list[tuple[float, int]]]:
    """Return the controls of a kind by actuator.

    Each is a pair of time or number, and index of the variable; pairs are sorted.
    """
    result: dict[str, list[tuple[float, int]]] = {}
    for index, control in controls.items():
        if control.kind == mode:
            for actuator in control.actuators:
                result.setdefault(actuator, []).append((control.at, index))
    return {actuator: sorted(timed_indices) for actuator, timed_indices in result.items()}
