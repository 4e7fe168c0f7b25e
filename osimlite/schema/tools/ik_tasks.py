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
    """Base class of tasks to which the pose is fitted."""

    apply: Flag = True
    """Whether the task is active."""
    # OpenSim's default is 0, so that a task without a weight is not tracked, but still counts in
    # the reported error.
    weight: Number = 0.0
    """Weight of the squared deviation relative to other tasks; without one, it does not count."""


class IKMarkerTask(IKTask):
    """Task to fit the marker of the same name to its measured position."""

    # OpenSim drops a task without a marker silently, but crashes if none of them has one.
    name_reference = Reference("marker-name", "Marker", consequence="left out")


class IKCoordinateTask(IKTask):
    """Task to fit the coordinate of the same name to a value."""

    # Squares of radians stand beside a mean of squared metres: a weight of 1 outweighs centimetres
    # of marker errors.
    name_reference = Reference("coordinate-name", "Coordinate")

    value_type: Annotated[str, word("default_value", "manual_value", "from_file", legacy=True)] = (
        "default_value"
    )
    """Source of the value: the model, this task, or the coordinate file of the tool."""
    # OpenSim accepts values in degrees silently: 10 is 10 rad.
    value: LegacyNumber = 0.0
    """Target value if `value_type` is manual_value, in radians or metres."""


class IKTaskSet(Set):
    """Tasks that inverse kinematics fits."""

    objects: LegacyMany[IKTask] = make_empty_list()
    """The tasks, each with the name of a marker or a coordinate."""
