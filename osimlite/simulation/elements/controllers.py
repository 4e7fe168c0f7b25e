"""Controllers of a model that are functions of time, columns of a file, or reflexes of muscles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from osimlite.base.text import format_count, suggest_name
from osimlite.errors import ModelError, UnsupportedError
from osimlite.io.tables.storage import find_named_file
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.examples import ToyPropMyoController, ToyReflexController
from osimlite.schema.forces import Actuator
from osimlite.schema.muscles import Muscle
from osimlite.simulation.elements.builder import ElementBuilder
from osimlite.simulation.elements.control_tables import make_column_function, read_controls
from osimlite.simulation.elements.controls import Drive, Reflex, find_actuators, map_actuators
from osimlite.simulation.elements.registry import register_controller

LISTS_OF_PATHS = 40600
"""Documents before this version name actuators by name instead of path."""


@register_controller(PrescribedController)
def drive_as_prescribed(
    builder: ElementBuilder, controller: PrescribedController
) -> Iterator[Drive]:
    """Yield the functions of the controller, and the columns of its file.

    Raises:
        ModelError: the number of functions is not that of the actuators, or the file does not fit.
    """
    path = builder.path(controller)
    functions = controller.ControlFunctions.objects
    actuators = find_actuators(builder, controller)
    if len(functions) != len(actuators):
        raise ModelError(
            f"'{path}' has {format_count(len(functions), 'function')} for "
            f"{format_count(len(actuators), 'actuator')}; give it one for each"
        )
    for actuator, function in zip(actuators, functions, strict=True):
        try:
            signal: Any = builder.read_function(actuator, function, f"control by {path}")
        except UnsupportedError as error:
            signal = error
        yield Drive(actuator, signal)
    if controller.controls_file:
        yield from _drive_from_file(builder, controller, actuators)


def _drive_from_file(
    builder: ElementBuilder, controller: PrescribedController, driven_actuators: list[Any]
) -> Iterator[Drive]:
    """Yield the columns of the file, whose labels are names or paths of actuators.

    As in OpenSim, a column is ignored if the controller names an actuator by the same text, or if
    an earlier column has the same label.

    Args:
        builder: builder of the model's elements.
        controller: the controller.
        driven_actuators: actuators that the controller drives already.

    Raises:
        ModelError: a column is not an actuator, or is one that another column or entry of the
            controller drives.
    """
    path = builder.path(controller)
    actuators = map_actuators(builder)
    actuators |= {builder.path(item): item for item in builder.find_components(Actuator)}
    table = read_controls(find_named_file(builder.folder, str(controller.controls_file)))
    driven_names = {
        word if isinstance(word, str) else builder.path(word)
        for word in controller.socket_actuators
    }
    if builder.model.document_version < LISTS_OF_PATHS:
        driven_names |= {item.name for item in driven_actuators}
    driven_actuators = list(driven_actuators)
    for index, label in enumerate(table.columns):
        if label in driven_names:
            continue
        if label not in actuators:
            names = [item.name for item in actuators.values()]
            raise ModelError(
                f"the column '{label}' of the file of '{path}' is not an actuator of the model{suggest_name(label, names)}",
                file=table.file,
            )
        actuator = actuators[label]
        if any(item is actuator for item in driven_actuators):
            raise ModelError(
                f"'{path}' sets '{builder.path(actuator)}' by the column '{label}' and by another entry; remove one of them",
                file=table.file,
            )
        driven_names.add(label)
        driven_actuators.append(actuator)
        degree = 1 if controller.interpolation_method is None else controller.interpolation_method
        yield Drive(
            actuator,
            make_column_function(table, index, degree, f"the interpolation_method of '{path}'"),
        )


@register_controller(ToyReflexController)
def drive_by_reflex(builder: ElementBuilder, controller: ToyReflexController) -> Iterator[Drive]:
    """Yield a reflex for each muscle, with the gain at its maximum contraction velocity.

    Raises:
        ModelError: the controller names an actuator that is not a muscle.
    """
    for muscle in find_actuators(builder, controller):
        if isinstance(muscle, Actuator) and not isinstance(muscle, Muscle):
            raise ModelError(
                f"'{builder.path(controller)}' drives '{builder.path(muscle)}', which is not a muscle; name muscles only"
            )
        yield Drive(muscle, Reflex(controller.gain))


@register_controller(ToyPropMyoController)
def refuse_proportional_control(
    builder: ElementBuilder, controller: ToyPropMyoController
) -> Iterator[Drive]:
    """Yield the error that osimlite does not compute this controller."""
    actuator = builder.resolve_target(controller, "socket_actuator", controller.socket_actuator)
    why = f" driven by the ToyPropMyoController '{builder.path(controller)}', whose control follows an activation"
    yield Drive(actuator, builder.make_unsupported_error(actuator, why))
