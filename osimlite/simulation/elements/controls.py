"""What sets the controls of actuators: functions of time, and columns of a file.

A control that nothing sets is 0. OpenSim keeps it within no limits.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from osimlite.errors import ModelError
from osimlite.multibody.functions import Function, PiecewiseConstant
from osimlite.multibody.smoothing_spline import smoothing_spline
from osimlite.schema.actuators import Actuator
from osimlite.schema.base import Unknown
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.controllers import Controller
from osimlite.simulation.elements.gather import ElementBuilder, kind_of
from osimlite.simulation.storage import StoTable, read_beside
from osimlite.text import did_you_mean


def control_functions(builder: ElementBuilder, actuator: Any) -> tuple[Function, ...]:
    """What the controllers of the model do to an actuator: functions of time whose sum is its control.

    Raises:
        UnsupportedError: it is driven by a controller that is no PrescribedController.
        ModelError: a controller has not one function for each actuator, or a file that does not fit.
    """
    functions: list[Function] = []
    for source in _sources(builder):
        functions += [
            _function(builder, source.controller, place, actuator)
            for place, target in enumerate(source.named)
            if target is actuator
        ]
        functions += _from_file(builder, source, actuator)
    return tuple(functions)


def controllers(builder: ElementBuilder) -> Iterator[Controller]:
    """The controllers that are enabled."""
    for component in builder.tree.components:
        if not isinstance(component, Unknown) and isinstance(component, Controller) and component.enabled:
            yield component


def _function(builder: ElementBuilder, controller: Controller, place: int, actuator: Any) -> Function:
    if not isinstance(controller, PrescribedController):
        raise builder.unsupported(actuator, f" driven by the {kind_of(controller)} '{builder.path(controller)}'")
    given = controller.ControlFunctions.objects
    if len(given) != len(controller.socket_actuators):
        raise ModelError(
            f"'{builder.path(controller)}' has {len(given)} functions for {len(controller.socket_actuators)} "
            "actuators; give it one for each"
        )
    return builder.function(actuator, given[place], f"control by {builder.path(controller)}")


class _Source(NamedTuple):
    """A controller, the actuators that it names, its file if it has one, and the actuator of each column there.

    As in OpenSim, a column whose actuator the controller names by the same words is passed over: it has none.
    """

    controller: Controller
    named: list[Any]
    table: StoTable | None
    columns: list[Any]


_known: WeakKeyDictionary[ElementBuilder, list[_Source]] = WeakKeyDictionary()
"""What was found for the actuators of a model: each file is read once."""


def _sources(builder: ElementBuilder) -> list[_Source]:
    """All enabled controllers."""
    if builder not in _known:
        _known[builder] = [_source(builder, controller) for controller in controllers(builder)]
    return _known[builder]


def _source(builder: ElementBuilder, controller: Controller) -> _Source:
    words = controller.socket_actuators
    named = [builder.target(controller, "socket_actuators", word) for word in words]
    if not (isinstance(controller, PrescribedController) and controller.controls_file):
        return _Source(controller, named, None, [])
    actuators: dict[str, Any] = {}
    for component in builder.tree.components:
        if isinstance(component, Actuator):
            actuators.setdefault(component.name, component)
            actuators.setdefault(builder.path(component), component)
    table = read_beside(builder.folder, str(controller.controls_file))
    passed_over = {word if isinstance(word, str) else builder.path(word) for word in words}
    columns: list[Any] = []
    for label in table.columns:
        if label not in passed_over and label not in actuators:
            names = [item.name for item in builder.tree.components if isinstance(item, Actuator)]
            raise ModelError(
                f"the column '{label}' of the file of '{builder.path(controller)}' is no actuator of the model"
                f"{did_you_mean(label, names)}",
                file=table.file,
            )
        columns.append(None if label in passed_over else actuators[label])
    return _Source(controller, named, table, columns)


def _from_file(builder: ElementBuilder, source: _Source, actuator: Any) -> Iterator[Function]:
    """The column of a controller's file for an actuator, if there is one."""
    controller, table = source.controller, source.table
    if table is None or not isinstance(controller, PrescribedController):
        return
    path = builder.path(controller)
    for place, target in enumerate(source.columns):
        if target is not actuator:
            continue
        if actuator in source.named:
            raise ModelError(
                f"'{path}' sets '{builder.path(actuator)}' by a function and by the column '{table.columns[place]}'; "
                "leave one out",
                file=table.file,
            )
        yield _column(table, place, controller, path)


def _column(table: StoTable, place: int, controller: PrescribedController, path: str) -> Function:
    """A column as the function that the controller asks for: steps, or a spline of some degree (1 if not said)."""
    degree = 1 if controller.interpolation_method is None else controller.interpolation_method
    times, values = table.times, table.rows[:, place]
    label = table.columns[place]
    if not (np.isfinite(values).all() and (np.diff(times) > 0.0).all()):
        raise ModelError(f"'{label}' has gaps, or times that do not increase; mend the file", file=table.file)
    if degree == 0 and len(times):
        return PiecewiseConstant(tuple(times.tolist()), tuple(values.tolist()))
    if degree not in (1, 3, 5, 7) or len(times) < degree + 1:
        raise ModelError(
            f"the interpolation_method of '{path}' is {degree}, which {len(times)} rows do not allow; take 0 for steps "
            "or 1 for straight lines",
            file=table.file,
        )
    return smoothing_spline(times, values, (degree + 1) // 2, 0.0)
