"""Surfaces that paths of muscles and springs wrap around."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, make_default, make_empty_list
from osimlite.schema.facts import HOLDER, Facts
from osimlite.schema.fields import Flag, LegacyMany, Unnamed, Vec3, vec3, word
from osimlite.schema.geometry import Appearance
from osimlite.schema.sets import ModelComponentSet


class WrapObject(ModelComponent, abstract=True):
    """Surface for paths to wrap around, fixed in the frame that owns it."""

    facts = Facts(scales={"translation": HOLDER})

    active: Flag = True
    """Whether paths wrap around the surface."""
    xyz_body_rotation: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    """Body-fixed X-Y-Z angles of the surface in the frame that owns it."""
    translation: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the middle of the surface in the frame that owns it."""
    quadrant: Annotated[
        str, word("all", "x", "+x", "-x", "y", "+y", "-y", "z", "+z", "-z", "Unassigned")
    ] = "Unassigned"
    """Coordinate and sign of the half of the surface on which paths stay; `all` for both halves."""
    appearance: Unnamed[Appearance] = make_default(Appearance, opacity=0.5, color=(0.0, 1.0, 1.0))
    """Appearance of the surface in viewers."""


class WrapObjectSet(ModelComponentSet):
    """The wrap surfaces of one frame."""

    objects: LegacyMany[WrapObject] = make_empty_list()
    """Surfaces; a path names those that it wraps around."""
