"""What sets the controls of actuators: functions of time, and columns of a file.

A control that nothing sets is 0. OpenSim keeps it within no limits.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

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
    for controller in controllers(builder):
        words = controller.socket_actuators
        named = [builder.target(controller, "socket_actuators", word) for word in words]
        functions += [
            _function(builder, controller, place, actuator) for place, target in enumerate(named) if target is actuator
        ]
        if isinstance(controller, PrescribedController) and controller.controls_file:
            functions += _from_file(builder, controller, actuator, actuator in named)
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


def _from_file(
    builder: ElementBuilder, controller: PrescribedController, actuator: Any, is_named: bool
) -> Iterator[Function]:
    """The column of the controller's file for an actuator, if there is one.

    As in OpenSim, a column whose actuator the controller names by the same words is passed over.
    """
    path = builder.path(controller)
    table = read_beside(builder.folder, str(controller.controls_file))
    words = {word if isinstance(word, str) else builder.path(word) for word in controller.socket_actuators}
    for place, label in enumerate(table.columns):
        if label in words:
            continue
        target = _actuator(builder, label)
        if target is None:
            names = [item.name for item in builder.tree.components if isinstance(item, Actuator)]
            raise ModelError(
                f"the column '{label}' of the file of '{path}' is no actuator of the model{did_you_mean(label, names)}",
                file=table.file,
            )
        if target is not actuator:
            continue
        if is_named:
            raise ModelError(
                f"'{path}' sets '{builder.path(actuator)}' by a function and by the column '{label}'; leave one out",
                file=table.file,
            )
        yield _column(table, place, controller, path)


def _actuator(builder: ElementBuilder, label: str) -> Any:
    """The first actuator of a name or path."""
    for component in builder.tree.components:
        if isinstance(component, Actuator) and label in (component.name, builder.path(component)):
            return component
    return None


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
