"""Ideal actuators, whose force is their control times a constant, in place of the actuators of a model.

Static optimization and motions with prescribed coordinates search for controls of such actuators,
because their forces enter the equations of motion linearly.
"""

from __future__ import annotations

from typing import cast

from osimlite.base.text import add_article
from osimlite.errors import ModelError, UnsupportedError
from osimlite.schema.forces import Actuator, ScalarActuator
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle, PathActuator
from osimlite.schema.resolution import is_a

_IDEAL_CLASSES = ("CoordinateActuator", "PointActuator", "PointToPointActuator", "TorqueActuator")
"""Names of the classes whose force is the control times a constant."""


def make_ideal_actuator(actuator: ScalarActuator, optimal_force: float) -> ScalarActuator | None:
    """Return an actuator whose force is its control times a constant, in place of another one.

    Args:
        actuator: the actuator to replace.
        optimal_force: the constant, N or N m.

    Returns:
        The replacement; None for an unsupported class.
    """
    if isinstance(actuator, PathActuator):
        path = actuator.geometry_path.copy_deep()
        result: ScalarActuator = PathActuator(name=actuator.name, geometry_path=path)
    elif is_a(actuator, "ActivationCoordinateActuator"):
        from osimlite.schema.actuators import CoordinateActuator

        coordinate = cast("CoordinateActuator", actuator).coordinate
        result = CoordinateActuator(name=actuator.name, coordinate=coordinate)
    elif any(is_a(actuator, name) for name in _IDEAL_CLASSES):
        result = actuator.copy_deep()
    else:
        return None
    result.appliesForce, result.optimal_force = actuator.appliesForce, optimal_force
    return result


def replace_by_ideal_actuators(model: Model, physiology: bool) -> list[ScalarActuator]:
    """Replace all actuators but muscles with fibers by ideal ones.

    Args:
        model: the model, which is changed.
        physiology: whether muscles keep their fibers; else they become ideal actuators, too.

    Returns:
        The actuators that act, in the order of the model.

    Raises:
        UnsupportedError: the force of an actuator is not proportional to its control.
        ModelError: there are no actuators.
    """
    # By identity, as forces may share a name.
    force_indices = {id(force): number for number, force in enumerate(model.force_set.objects)}
    result: list[ScalarActuator] = []
    for item in list(model.components(Actuator)):
        if not item.appliesForce:
            continue
        if not isinstance(item, ScalarActuator):
            raise UnsupportedError(
                f"'{item.name}' is {add_article(type(item).__name__)}, which does not have exactly one control"
            )
        if not (isinstance(item, Muscle) and physiology):
            force = (
                item.max_isometric_force
                if isinstance(item, Muscle)
                else getattr(item, "optimal_force", 0.0)
            )
            ideal_actuator = make_ideal_actuator(item, force)
            if ideal_actuator is None or id(item) not in force_indices:
                message = f"'{item.name}' ({type(item).__name__}) has a force that is not proportional to its control"
                raise UnsupportedError(f"{message}; set its appliesForce to false")
            # The control keeps its bounds, so that a muscle still only pulls.
            ideal_actuator.min_control, ideal_actuator.max_control = (
                item.min_control,
                item.max_control,
            )
            model.force_set.objects[force_indices[id(item)]] = item = ideal_actuator
        result.append(item)
    if not result:
        raise ModelError(
            f"'{model.name}' has no actuators; add reserve actuators: a ForceSet in force_set_files "
            "of the setup, or with --forces (forces=)"
        )
    return result
