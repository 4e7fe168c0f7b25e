"""Controllers, which set the controls of actuators: what all have in common."""

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.fields import Flag, LegacyMany
from osimlite.schema.references import ActuatorSockets
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class Controller(ModelComponent, abstract=True):
    """Computes the controls of the actuators it names."""

    socket_actuators: ActuatorSockets = ()
    enabled: Flag = True


class ControllerSet(ModelComponentSet):
    """The controllers of a model."""

    objects: LegacyMany[Controller] = none()
    groups: LegacyMany[ObjectGroup] = none()
