"""Surfaces that paths of muscles and springs wrap around."""

from __future__ import annotations

from typing import Annotated

from osimlite.schema.base import ModelComponent, made, none
from osimlite.schema.fields import Flag, LegacyMany, Text, Unnamed, Vec3, vec3
from osimlite.schema.geometry import Appearance
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class WrapObject(ModelComponent, abstract=True):
    """A surface fixed in the frame that owns it."""

    active: Flag = True
    xyz_body_rotation: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    translation: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    quadrant: Text = "Unassigned"
    appearance: Unnamed[Appearance] = made(Appearance, opacity=0.5, color=(0.0, 1.0, 1.0))


class WrapObjectSet(ModelComponentSet):
    """The wrap surfaces of one frame."""

    objects: LegacyMany[WrapObject] = none()
    groups: LegacyMany[ObjectGroup] = none()
