"""Inverse kinematics: the pose that fits measured markers or orientations best, frame by frame."""

from typing import Annotated

from osimlite.schema.base import Object, make_default, make_empty_list
from osimlite.schema.fields import (
    Flag,
    LegacyMany,
    Number,
    Reals,
    Single,
    Unnamed,
    Vec3,
    real,
    reals,
    vec3,
)
from osimlite.schema.references import (
    InputModel,
    InputTable,
    OutputTable,
    make_input_file,
    make_output_file,
)
from osimlite.schema.sets import Set
from osimlite.schema.tools.base import Tool
from osimlite.schema.tools.ik_tasks import IKTaskSet


class InverseKinematicsToolBase(Tool, abstract=True):
    """Base class of both tools for inverse kinematics, with their common settings."""

    model_file: InputModel = ""
    """File of the model, relative to the working folder of OpenSim."""
    # OpenSim 4.6 never uses it: a constructor that delegates loses the number, and constraints are
    # always kept exactly (identical results for 0.001, 20 and infinity).
    constraint_weight: Annotated[float, real(domain=">= 0")] = float("inf")
    """Weight of errors of the model's constraints; infinite, they are satisfied exactly."""
    # At this default OpenSim stops up to 0.14 degrees away from the best pose of a gait model; at
    # 1e-9 it is within about 1e-5 degrees.
    accuracy: Annotated[float, real(domain="> 0")] = 1e-5
    """Accuracy of the best pose."""
    # The end of 2 s is OpenSim's default: without a range, longer trials are cut silently.
    time_range: Annotated[Reals, reals("s", least=2, most=2)] = (float("-inf"), 2.0)
    """First and last time; they are limited to the range of the data."""
    output_motion_file: OutputTable = ""
    """File for the coordinates; `results_directory` has no effect on it."""
    report_errors: Flag = True
    """Whether deviations are written for every frame."""


class InverseKinematicsTool(InverseKinematicsToolBase):
    """Fits the pose of a model to measured markers and coordinates."""

    ik_task_set: Unnamed[IKTaskSet] = make_default(IKTaskSet)
    """Tasks with weights of markers and coordinates; if none applies, all markers weigh the same."""
    # OpenSim takes 0 0 0 as a measured position, and never returns from a .trc file without rows.
    marker_file: Annotated[str, make_input_file("marker data", required=True)] = ""
    """Measured markers (.trc, .sto)."""
    # OpenSim ignores `inDegrees` in the header of this file only.
    coordinate_file: InputTable = ""
    """Values of coordinates for tasks whose `value_type` is from_file; always read in degrees."""
    output_motion_file: Annotated[str, make_output_file("table", required=True)] = ""
    report_marker_locations: Flag = False
    """Whether the markers of the model are written for every frame."""


class OrientationWeight(Object):
    """Weight of the deviation of the sensor with the same name."""

    weight: Number = 1.0
    """Value of the weight, relative to the others."""


class OrientationWeightSet(Set):
    """Weights of orientation sensors."""

    objects: LegacyMany[OrientationWeight] = make_empty_list()
    """Weights; a sensor without one has weight 1."""


class IMUInverseKinematicsTool(InverseKinematicsToolBase):
    """Fits the pose of a model to measured orientations."""

    sensor_to_opensim_rotations: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    """Space-fixed angles about x, y and z from the axes of the data to OpenSim's ground."""
    orientations_file: Annotated[str, make_input_file("table", required=True)] = ""
    """Measured orientations, a column of quaternions for each sensor (.sto)."""
    orientation_weights: Single[OrientationWeightSet] = make_default(
        OrientationWeightSet, name="orientation_weights"
    )
    """Weights of the sensors."""


class MarkerWeight(Object):
    """Weight of the deviation of the marker with the same name."""

    weight: Number = 1.0
    """Value of the weight, relative to the others."""


class MarkerWeightSet(Set, tag="Set_MarkerWeight_"):
    """Weights of markers."""

    objects: LegacyMany[MarkerWeight] = make_empty_list()
    """Weights of markers; those without one have the default weight of the reference."""


class MarkersReference(Object):
    """Measured markers and their weights."""

    marker_file: Annotated[str, make_input_file("marker data")] = ""
    """The measured markers (.trc, .sto)."""
    marker_weights: Single[MarkerWeightSet] = make_default(MarkerWeightSet, name="marker_weights")
    """Weights by names of markers."""
    default_weight: Number = 1.0
    """Weight of markers without one."""
