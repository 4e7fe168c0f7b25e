"""Points fixed in frames, and the sensors fixed there."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, none
from osimlite.schema.fields import Flag, LegacyMany, Vec3, vec3
from osimlite.schema.references import PhysicalFrameSocket
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class Point(ModelComponent, abstract=True):
    """A point."""


class Station(Point):
    """A point fixed in a physical frame, `location` given in that frame."""

    socket_parent_frame: PhysicalFrameSocket = ""
    location: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)


class Marker(Station):
    """A station that motion capture sees."""

    fixed: Flag = False


class MarkerSet(ModelComponentSet):
    """The markers of a model."""

    objects: LegacyMany[Marker] = none()
    groups: LegacyMany[ObjectGroup] = none()


class IMU(ModelComponent):
    """An inertial measurement unit at the origin of a frame."""

    socket_frame: PhysicalFrameSocket = ""
