"""Controls that are functions of time, or columns of a file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from osimlite.base.text import did_you_mean
from osimlite.errors import ModelError, UnsupportedError
from osimlite.io.tables.storage import beside
from osimlite.schema.actuators import Actuator
from osimlite.schema.controller_types import PrescribedController
from osimlite.simulation.elements.control_tables import column_function, read_controls
from osimlite.simulation.elements.controls import Drive, actuators_by_name, named
from osimlite.simulation.elements.gather import ElementBuilder

LISTS_OF_PATHS = 40600
"""Documents before this version name actuators by their names."""


def drives(builder: ElementBuilder, controller: PrescribedController) -> Iterator[Drive]:
    """What it does to each actuator.

    Raises:
        ModelError: it has not one function for each actuator, or its file does not fit.
    """
    path, given = builder.path(controller), controller.ControlFunctions.objects
    actuators = named(builder, controller)
    if len(given) != len(actuators):
        raise ModelError(
            f"'{path}' has {len(given)} functions for {len(actuators)} actuators; give it one for each"
        )
    for actuator, function in zip(actuators, given, strict=True):
        try:
            signal: Any = builder.function(actuator, function, f"control by {path}")
        except UnsupportedError as error:
            signal = error
        yield Drive(actuator, signal)
    if controller.controls_file:
        yield from _from_file(builder, controller, actuators)


def _from_file(
    builder: ElementBuilder, controller: PrescribedController, taken: list[Any]
) -> Iterator[Drive]:
    """The columns of the file, which are called by names or paths of actuators.

    As in OpenSim, a column is passed over if the controller names an actuator by the same word, or
    if one before it has the same label.
    """
    path = builder.path(controller)
    actuators = actuators_by_name(builder)
    actuators |= {builder.path(item): item for item in builder.components(Actuator)}
    table = read_controls(beside(builder.folder, str(controller.controls_file)))
    known = {
        word if isinstance(word, str) else builder.path(word)
        for word in controller.socket_actuators
    }
    if builder.model.document_version < LISTS_OF_PATHS:
        known |= {item.name for item in taken}
    taken = list(taken)
    for index, label in enumerate(table.columns):
        if label in known:
            continue
        if label not in actuators:
            names = [item.name for item in actuators.values()]
            raise ModelError(
                f"the column '{label}' of the file of '{path}' is no actuator of the model{did_you_mean(label, names)}",
                file=table.file,
            )
        actuator = actuators[label]
        if any(item is actuator for item in taken):
            raise ModelError(
                f"'{path}' sets '{builder.path(actuator)}' by the column '{label}' and otherwise too; leave one out",
                file=table.file,
            )
        known.add(label)
        taken.append(actuator)
        degree = 1 if controller.interpolation_method is None else controller.interpolation_method
        yield Drive(
            actuator, column_function(table, index, degree, f"the interpolation_method of '{path}'")
        )
