"""Frames and bodies: what can be attached to."""

import math
from typing import Annotated

from osimlite.schema.base import ModelComponent, made, none
from osimlite.schema.fields import LegacyMany, Many, Single, Unnamed, Value, Vec3, Vec6, real, vec3, word
from osimlite.schema.geometry import FrameGeometry, Geometry
from osimlite.schema.references import PhysicalFrameSocket, StationSocket
from osimlite.schema.sets import ModelComponentSet, ObjectGroup
from osimlite.schema.wrapping import WrapObjectSet


class Frame(ModelComponent, abstract=True):
    """An orthogonal set of axes with an origin."""

    frame_geometry: Single[FrameGeometry] = made(FrameGeometry, name="frame_geometry")
    attached_geometry: Many[Geometry] = none()

    def attach(self, *shapes: Geometry) -> None:
        """Draw shapes in this frame; one without a name is called ``<frame>_geom_<number>`` as OpenSim does."""
        for shape in shapes:
            self.attached_geometry.append(shape)
            if not shape.name:
                shape.name = f"{self.name}_geom_{len(self.attached_geometry)}"


class PhysicalFrame(Frame, abstract=True):
    """A frame fixed to a body or to ground."""

    wrap_object_set: Unnamed[WrapObjectSet] = made(WrapObjectSet)


class Ground(PhysicalFrame):
    """The inertial frame, root of every multibody tree."""


class Body(PhysicalFrame):
    """A rigid body: mass, mass centre and inertia, in its own frame.

    `inertia` is about the mass centre, in body axes, in the order xx yy zz xy xz yz.
    """

    mass: Annotated[float, real("kg", ">= 0")] = math.nan
    mass_center: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    inertia: Annotated[Vec6, Value("double", "Vec6", "kg*m^2")] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class PhysicalOffsetFrame(PhysicalFrame):
    """A frame fixed in another physical frame, displaced by `translation` and turned by `orientation`.

    `orientation` holds body-fixed X-Y-Z angles.
    """

    socket_parent: PhysicalFrameSocket = ""
    translation: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    orientation: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)


_AXES = ("+x", "-x", "x", "+y", "-y", "y", "+z", "-z", "z")


class StationDefinedFrame(PhysicalFrame):
    """A frame laid through stations of one body: from a to b runs `ab_axis`, across a, b and c `ab_x_ac_axis`.

    The second axis is the cross product of b - a and c - a. The origin is the fourth station.
    """

    socket_point_a: StationSocket = ""
    socket_point_b: StationSocket = ""
    socket_point_c: StationSocket = ""
    socket_origin_point: StationSocket = ""
    ab_axis: Annotated[str, word(*_AXES)] = "+x"
    ab_x_ac_axis: Annotated[str, word(*_AXES)] = "+y"


class TwoFrameLinker(ModelComponent, abstract=True):
    """What joins two frames; `frames` holds the offset frames made for it."""

    socket_frame1: PhysicalFrameSocket = ""
    socket_frame2: PhysicalFrameSocket = ""
    frames: Many[PhysicalFrame] = none()


class BodySet(ModelComponentSet):
    """The bodies of a model."""

    objects: LegacyMany[Body] = none()
    groups: LegacyMany[ObjectGroup] = none()
