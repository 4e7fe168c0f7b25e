"""Surfaces that paths of muscles and springs wrap around."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, made, none
from osimlite.schema.fields import Flag, LegacyMany, Unnamed, Vec3, real, vec3, word
from osimlite.schema.geometry import Appearance
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class WrapObject(ModelComponent, abstract=True):
    """A surface fixed in the frame that owns it, turned by body-fixed X-Y-Z angles.

    `quadrant` keeps paths on one half of the surface: the half where that coordinate has that sign.
    """

    active: Flag = True
    xyz_body_rotation: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    translation: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    quadrant: Annotated[str, word("all", "x", "+x", "-x", "y", "+y", "-y", "z", "+z", "-z", "Unassigned")] = (
        "Unassigned"
    )
    appearance: Unnamed[Appearance] = made(Appearance, opacity=0.5, color=(0.0, 1.0, 1.0))


class WrapCylinder(WrapObject):
    """A cylinder along its own Z axis."""

    radius: Annotated[float, real("m", "> 0")] = 1.0
    length: Annotated[float, real("m", "> 0")] = 1.0


class WrapEllipsoid(WrapObject):
    """An ellipsoid; `dimensions` are its half axes."""

    dimensions: Annotated[Vec3, vec3("m", "> 0")] = (0.05, 0.05, 0.05)


class WrapSphere(WrapObject):
    """A ball."""

    radius: Annotated[float, real("m", "> 0")] = 0.05


class WrapTorus(WrapObject):
    """A ring about its own Z axis, between two radii; paths run through its hole."""

    inner_radius: Annotated[float, real("m", "> 0")] = 0.01
    outer_radius: Annotated[float, real("m", "> 0")] = 0.05


class WrapObjectSet(ModelComponentSet):
    """The wrap surfaces of one frame."""

    objects: LegacyMany[WrapObject] = none()
    groups: LegacyMany[ObjectGroup] = none()
