"""Contact geometry: the surfaces that contact forces work on, each fixed in a physical frame."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, make_default, make_empty_list
from osimlite.schema.fields import LegacyMany, Unnamed, Vec3, vec3
from osimlite.schema.geometry import Appearance, SurfaceProperties
from osimlite.schema.references import PhysicalFrameSocket
from osimlite.schema.sets import ModelComponentSet

START_DEPTH_M = 1e-3
"""Depth of a sphere inside another surface at the start of a motion, m, above which it is reported."""

# Small spheres at the floor start a few tenths of a millimetre deep by rounding.
START_DEPTH_SHARE = 0.1
"""The same depth as a share of the radius; both must be exceeded."""


class ContactGeometry(ModelComponent, abstract=True):
    """Surface for contact forces, fixed in a physical frame."""

    socket_frame: PhysicalFrameSocket = ""
    """Frame in which the surface is fixed."""
    location: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the middle of the surface in that frame."""
    orientation: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    """Body-fixed X-Y-Z angles of the surface in that frame."""
    appearance: Unnamed[Appearance] = make_default(
        Appearance,
        color=(0.0, 1.0, 1.0),
        surface_properties=lambda: SurfaceProperties.build({"representation": 2}, set()),
    )
    """Appearance of the surface in viewers."""


class ContactGeometrySet(ModelComponentSet):
    """The contact surfaces of a model."""

    objects: LegacyMany[ContactGeometry] = make_empty_list()
    """The surfaces; contact forces name those that touch."""
