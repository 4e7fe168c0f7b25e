"""Points fixed in frames, and the sensors fixed there."""

from typing import Annotated

from osimlite.schema.base import ModelComponent, make_empty_list
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Flag, LegacyMany, Vec3, vec3
from osimlite.schema.references import PhysicalFrameSocket
from osimlite.schema.sets import ModelComponentSet


class Point(ModelComponent, abstract=True):
    """Base class of points."""


class Station(Point):
    """A point fixed in a physical frame, `location` given in that frame."""

    facts = Facts(
        outputs="acceleration:Vec3 location:Vec3 velocity:Vec3",
        scales={"location": "socket_parent_frame"},
    )

    socket_parent_frame: PhysicalFrameSocket = ""
    """Frame in which the point is fixed."""
    location: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the point in its parent frame."""


class Marker(Station):
    """Station whose position motion capture measures."""

    fixed: Flag = False
    """Whether the marker keeps its position when markers are placed on a scaled model."""


class MarkerSet(ModelComponentSet):
    """The markers of a model."""

    objects: LegacyMany[Marker] = make_empty_list()
    """The markers, named as the columns of measured data."""


class IMU(ModelComponent):
    """An inertial measurement unit at the origin of a frame."""

    facts = Facts(
        outputs="accelerometer_signal:Vec3 gyroscope_signal:Vec3 orientation_as_quaternion:Quaternion"
    )

    socket_frame: PhysicalFrameSocket = ""
    """Frame of the sensor, which is at its origin and along its axes."""
