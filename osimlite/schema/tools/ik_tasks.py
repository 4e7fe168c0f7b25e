"""Tasks of inverse kinematics: weights of markers and coordinates."""

from typing import Annotated

from osimlite.schema.base import Object, make_empty_list
from osimlite.schema.fields import (
    Flag,
    LegacyMany,
    LegacyNumber,
    Number,
    Reference,
    word,
)
from osimlite.schema.sets import Set


class IKTask(Object, abstract=True):
    """Something measured that the pose is fitted to."""

    apply: Flag = True
    """Whether the task counts."""
    # OpenSim's default is 0, so that a task without a weight is not tracked, but still counts in
    # the reported error.
    weight: Number = 0.0
    """How much the squared deviation counts beside those of other tasks; without one, nothing."""


class IKMarkerTask(IKTask):
    """A marker that is to be where it was measured; the name is that of the marker, in the model and in the data."""

    # OpenSim drops a task without a marker silently, but crashes if none of them has one.
    name_reference = Reference("marker-name", "Marker", consequence="left out")


class IKCoordinateTask(IKTask):
    """A coordinate that is to have a value; the name is that of the coordinate."""

    # Squares of radians stand beside a mean of squared metres: a weight of 1 outweighs centimetres
    # of marker errors.
    name_reference = Reference("coordinate-name", "Coordinate")

    value_type: Annotated[str, word("default_value", "manual_value", "from_file", legacy=True)] = (
        "default_value"
    )
    """Where the value is from: the model, this task, or the coordinate file of the tool."""
    # OpenSim accepts values in degrees silently: 10 is 10 rad.
    value: LegacyNumber = 0.0
    """The value if `value_type` is manual_value, in radians or metres."""


class IKTaskSet(Set):
    """What inverse kinematics fits."""

    objects: LegacyMany[IKTask] = make_empty_list()
    """The tasks, each with the name of a marker or a coordinate."""
