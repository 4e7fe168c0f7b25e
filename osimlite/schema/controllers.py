"""Controllers: what sets the controls of actuators."""

from __future__ import annotations

from typing import Annotated

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.fields import Flag, LegacyMany, Reference
from osimlite.schema.references import Named
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class Controller(ModelComponent, abstract=True):
    """Computes the controls of the actuators it names."""

    socket_actuators: Annotated[tuple[Named, ...], Reference("socket", "Actuator", "list", required=False)] = ()
    enabled: Flag = True


class ControllerSet(ModelComponentSet):
    """The controllers of a model."""

    objects: LegacyMany[Controller] = none()
    groups: LegacyMany[ObjectGroup] = none()
