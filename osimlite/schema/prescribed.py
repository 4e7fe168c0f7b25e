"""Prescribed and measured forces: functions of time, or columns of a data file."""

from typing import Annotated

from osimlite.schema.base import make_default, make_empty_list
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Flag, LegacyMany, Single
from osimlite.schema.forces import ForceProducer
from osimlite.schema.functions import FunctionSet
from osimlite.schema.references import (
    ExpressedInFrame,
    FrameName,
    MaybeColumnName,
    PhysicalFrameSocket,
    make_input_file,
)
from osimlite.schema.sets import ModelComponentSet


class PrescribedForce(ForceProducer):
    """A force and a torque on a frame as functions of time: none, or three functions each for force, point, torque."""

    facts = Facts(outputs="force_applied:Vec3 point_of_application:Vec3 torque_applied:Vec3")

    socket_frame: PhysicalFrameSocket = ""
    """The frame that is pushed."""
    pointIsGlobal: Flag = False
    """Whether the point is in ground rather than in the frame."""
    forceIsGlobal: Flag = True
    """Whether force and torque are along the axes of ground rather than of the frame."""
    forceFunctions: Single[FunctionSet] = make_default(FunctionSet, name="forceFunctions")
    """x, y and z of the force over time; empty for none."""
    pointFunctions: Single[FunctionSet] = make_default(FunctionSet, name="pointFunctions")
    """x, y and z of the point of application over time; empty for the origin of the frame."""
    torqueFunctions: Single[FunctionSet] = make_default(FunctionSet, name="torqueFunctions")
    """x, y and z of the torque over time; empty for none."""


class ExternalForce(ForceProducer):
    """A measured force, such as that of a force plate."""

    # OpenSim 4.6 finds bodies here by name or path, but no offset frames.
    applied_to_body: FrameName = ""
    """The frame that is pushed."""
    # OpenSim assumes ground for an unknown name, with a warning.
    force_expressed_in_body: ExpressedInFrame = "ground"
    """The frame along whose axes force and torque are measured."""
    point_expressed_in_body: ExpressedInFrame = "ground"
    """The frame in which the point is measured."""
    # OpenSim takes the three columns whose labels begin so in the order of the file, whatever
    # letter follows; another number of columns is an error.
    force_identifier: MaybeColumnName = None
    """Beginning of the labels of the three force columns; left out, there is no force."""
    # Without it OpenSim applies the force at the origin of the body, silently. Moments are then
    # wrong by the force times the distance to the point.
    point_identifier: MaybeColumnName = None
    """Beginning of the labels of the three point columns; left out, the origin of the frame."""
    torque_identifier: MaybeColumnName = None
    """Beginning of the labels of the three torque columns; left out, there is no torque."""
    # OpenSim replaces it by the `datafile` of the loads, so that the name in the file has no effect
    # there.
    data_source_name: MaybeColumnName = None
    """Name that the table must have; a table of another name is refused."""


class ExternalLoads(ModelComponentSet):
    """Measured forces that share a data file."""

    objects: LegacyMany[ExternalForce] = make_empty_list()
    """The forces, each with its columns of the file."""
    # OpenSim looks for it from its current folder, then from the folder of this file. It puts a
    # cubic spline through all samples, and continues it straight beyond the last one.
    datafile: Annotated[str, make_input_file("table", legacy=True, required=True)] = ""
    """File of the columns (.sto, .mot); it replaces the data source of each force."""
