"""Forces known beforehand: as functions of time, or as columns of a data file."""

from osimlite.schema.base import made, none
from osimlite.schema.fields import Flag, LegacyMany, Single
from osimlite.schema.forces import ForceProducer
from osimlite.schema.functions import FunctionSet
from osimlite.schema.references import (
    ExpressedInFrame,
    FrameName,
    LegacyFileName,
    MaybeColumnName,
    PhysicalFrameSocket,
)
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class PrescribedForce(ForceProducer):
    """A force and a torque on a frame as functions of time: none, or three functions each for force, point, torque."""

    socket_frame: PhysicalFrameSocket = ""
    pointIsGlobal: Flag = False
    forceIsGlobal: Flag = True
    forceFunctions: Single[FunctionSet] = made(FunctionSet, name="forceFunctions")
    pointFunctions: Single[FunctionSet] = made(FunctionSet, name="pointFunctions")
    torqueFunctions: Single[FunctionSet] = made(FunctionSet, name="torqueFunctions")


class ExternalForce(ForceProducer):
    """A measured force, such as that of a force plate.

    Each identifier is the beginning that the labels of three columns share; without a point the force acts at the
    origin of the frame.
    """

    applied_to_body: FrameName = ""
    force_expressed_in_body: ExpressedInFrame = "ground"
    point_expressed_in_body: ExpressedInFrame = "ground"
    force_identifier: MaybeColumnName = None
    point_identifier: MaybeColumnName = None
    torque_identifier: MaybeColumnName = None
    data_source_name: MaybeColumnName = None


class ExternalLoads(ModelComponentSet):
    """Measured forces that share a data file."""

    objects: LegacyMany[ExternalForce] = none()
    groups: LegacyMany[ObjectGroup] = none()
    datafile: LegacyFileName = ""
