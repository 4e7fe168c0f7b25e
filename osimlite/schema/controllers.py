"""Controllers, which set the controls of actuators: what all have in common."""

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.fields import Flag, LegacyMany
from osimlite.schema.references import ActuatorSockets
from osimlite.schema.sets import ModelComponentSet


class Controller(ModelComponent, abstract=True):
    """Computes the controls of the actuators it names."""

    socket_actuators: ActuatorSockets = ()
    """The actuators that are controlled; what several controllers want of one is added up."""
    enabled: Flag = True
    """Whether the controller adds anything to the controls."""


class ControllerSet(ModelComponentSet):
    """The controllers of a model."""

    objects: LegacyMany[Controller] = none()
    """The controllers; what several want of one actuator is added up."""
