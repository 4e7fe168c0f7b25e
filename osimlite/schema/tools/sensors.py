"""Inertial sensors: their placement on a model, and settings for reading their files."""

from typing import Annotated

from osimlite.schema.base import Object, make_empty_list
from osimlite.schema.fields import Many, Reference, Text, Vec3, real, vec3, word
from osimlite.schema.references import InputModel, make_input_file, make_output_file


class IMUPlacer(Object):
    """Rotates the sensors of a model as they were worn, from data in a known pose."""

    model_file: InputModel = ""
    """The model, in the pose in which the subject stood."""
    base_imu_label: Annotated[str, Reference("column", "column", required=False)] = ""
    """Label of the sensor that shows the heading; left out, the data are not rotated."""
    base_heading_axis: Annotated[str, word("", "x", "y", "z", "-x", "-y", "-z")] = ""
    """Axis of that sensor that points forwards."""
    sensor_to_opensim_rotations: Annotated[Vec3, vec3("rad")] = (0.0, 0.0, 0.0)
    """Space-fixed angles about x, y and z from the axes of the data to OpenSim's ground."""
    orientation_file_for_calibration: Annotated[str, make_input_file("table", required=True)] = ""
    """File of measured orientations, of which the first row is used (.sto)."""
    output_model_file: Annotated[str, make_output_file("Model")] = ""
    """File for the model with its sensors."""


class ExperimentalSensor(Object):
    """Sensor of the data with the same name."""

    name_in_model: Annotated[str, Reference("column", "column")] = ""
    """Label of its column, which is the name of a frame of the model with the suffix _imu."""


class APDMDataReaderSettings(Object):
    """Settings for reading files of APDM sensors."""

    ExperimentalSensors: Many[ExperimentalSensor] = make_empty_list()
    """Sensors whose files are read."""


class XsensDataReaderSettings(Object):
    """Settings for reading files of Xsens sensors."""

    data_folder: Annotated[str, Reference("input-folder", "folder", required=False)] = ""
    """Folder of the files."""
    trial_prefix: Text = ""
    """Beginning of the names of the files."""
    trial_extension: Text = ".txt"
    """End of the names of the files."""
    sampling_rate: Annotated[float, real("Hz")] = 40.0
    """Sampling rate of the sensors, if the files do not state it."""
    ExperimentalSensors: Many[ExperimentalSensor] = make_empty_list()
    """Sensors whose files are read."""
