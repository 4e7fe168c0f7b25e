"""OpenSim's tools of fitting: scaling, inverse kinematics, and sensors."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.records import replace
from osimlite.base.text import join_words
from osimlite.fitting.fit_messages import NO_EFFECT, describe_fit, describe_unknown
from osimlite.fitting.ik_tool import create_motion_table, run_inverse_kinematics
from osimlite.fitting.inverse_kinematics import inverse_kinematics
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.orientation_data import OrientationData
from osimlite.fitting.scale_tool import compute_scaled_model
from osimlite.fitting.sensors import place_sensors
from osimlite.io.document.printer import to_text
from osimlite.io.tables.old_storage import UNITS
from osimlite.io.tables.storage import StoTable, expect_time_range, read_sto
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.resolution import is_a
from osimlite.tools.evidence import Evidence
from osimlite.tools.job import NO_FILE, Job
from osimlite.tools.outcome import Outcome

if TYPE_CHECKING:
    from osimlite.schema.tools.inverse_kinematics import (
        IMUInverseKinematicsTool,
        InverseKinematicsTool,
    )
    from osimlite.schema.tools.sensors import IMUPlacer


def run_inverse_kinematics_tool(job: Job, outcome: Outcome) -> None:
    """Fit every frame; write coordinates and, if requested, errors and positions of the markers.

    Args:
        job: setup, an InverseKinematicsTool.
        outcome: outcome to which the results are added.
    """
    setup: InverseKinematicsTool = job.setup
    coordinates = job.find_path("coordinate_file")
    table = None if coordinates is None else read_sto(coordinates)
    data = MarkerData.from_source(job.require_path("marker_file"))
    model = job.read_model()
    motion = run_inverse_kinematics(setup, model, data, table)
    times = motion.times
    if setup.output_motion_file.strip() not in NO_FILE:
        outcome.add_table(
            job.get_output_path(setup.output_motion_file), create_motion_table(motion), f"\n{UNITS}"
        )
    if setup.report_errors:
        # Only seen markers have errors, but as in OpenSim the mean is over all markers.
        squares = np.nan_to_num(motion.marker_errors**2)
        totals = squares.sum(axis=1)
        rows = np.column_stack(
            [totals, np.sqrt(totals / squares.shape[1]), np.sqrt(squares.max(axis=1))]
        )
        labels = ("total_squared_error", "marker_error_RMS", "marker_error_max")
        path = job.get_results_path(f"{setup.name}_ik_marker_errors.sto")
        outcome.add_table(path, StoTable("Model Marker Errors from IK", times, labels, rows))
    if setup.report_marker_locations:
        columns = tuple(f"{name}_t{axis}" for name in motion.markers for axis in "xyz")
        path = job.get_results_path(f"{setup.name}_ik_model_marker_locations.sto")
        positions = motion.places.reshape(len(times), -1)
        outcome.add_table(
            path, StoTable("Model Marker Locations from IK", times, columns, positions)
        )
    outcome.evidence = Evidence.from_values(
        model,
        job.require_path("model_file"),
        motion.mechanism,
        times,
        motion.values,
        markers=motion.markers,
        measured=motion.measured,
        positions=motion.places,
    )
    if message := describe_unknown(model, NO_EFFECT):
        outcome.add_warning("unknown classes", message)
    outcome.summary |= motion.summary
    for subject, message in describe_fit(motion):
        outcome.add_message(subject, message)
    requested = [
        task.name for task in setup.ik_task_set.objects if task.apply and is_a(task, "IKMarkerTask")
    ]
    for key, category, names in (
        (
            "not_fitted",
            "markers not used",
            [name for name in data.names if name not in motion.markers],
        ),
        (
            "not_in_the_data",
            "markers not in the data",
            [name for name in requested if name not in data.names],
        ),
    ):
        if names:
            outcome.summary[key] = names
            outcome.add_message(category, join_words(names))


def run_scale_tool(job: Job, outcome: Outcome) -> None:
    """Scale the model and place its markers; write the files that the setup names.

    Args:
        job: setup, a ScaleTool.
        outcome: outcome to which the results are added.
    """
    result = compute_scaled_model(job.setup, job.file.parent)
    for name, text in result.texts.items():
        outcome.add_text(job.get_output_path(name), text)
    if result.unknown:
        outcome.add_warning("unknown classes", result.unknown)
    if result.measured is not None:
        outcome.summary["ratios"] = dict(result.measured.ratios)
        for name, ratio in result.measured.ratios.items():
            outcome.add_message(name, f"scaled by {ratio:.6g}")
        for note in result.measured.notes:
            outcome.add_message("left out", note)
        outcome.add_message("mass", result.describe_mass())
    if result.placed is not None:
        outcome.summary |= result.placed.pose.summary
        for subject, message in result.placed.describe_pose():
            outcome.add_message(subject, message)


def run_imu_placer(job: Job, outcome: Outcome) -> None:
    """Place the sensors on the model, and write it.

    Args:
        job: setup, an IMUPlacer.
        outcome: outcome to which the results are added.
    """
    setup: IMUPlacer = job.setup
    model = job.read_model()
    data = OrientationData.from_source(job.require_path("orientation_file_for_calibration"))
    data = data.rotate_ground(setup.sensor_to_opensim_rotations)
    placement = place_sensors(model, data, setup.base_imu_label, setup.base_heading_axis)
    if setup.output_model_file.strip() not in NO_FILE:
        outcome.add_text(
            job.get_output_path(setup.output_model_file), to_text(model, numbers="opensim")
        )
    outcome.summary |= placement._asdict()
    outcome.add_message("placed", join_words(placement.names, max_count=100))
    if placement.left_out:
        outcome.add_message(
            "left out",
            f"{join_words(placement.left_out)}: the model has no frames with these names",
        )
    if placement.heading is not None:
        outcome.add_message(
            "heading",
            f"rotated by {math.degrees(placement.heading):.6g} degrees about the vertical",
        )


ORIENTATION_ERRORS = "OrientationErrors"
"""OpenSim's name of the table of orientation errors."""
DEGREES_HEADER = {"inDegrees": "yes"}
"""Header of a table in degrees."""


def run_imu_inverse_kinematics_tool(job: Job, outcome: Outcome) -> None:
    """Fit every frame to orientations; write coordinates and, if requested, orientation errors.

    Args:
        job: setup, an IMUInverseKinematicsTool.
        outcome: outcome to which the results are added.
    """
    setup: IMUInverseKinematicsTool = job.setup
    model = job.read_model()
    file = job.require_path("orientations_file")
    start, end = expect_time_range(setup.time_range)
    data = (
        OrientationData.from_source(file)
        # OpenSim begins with the first frame if the first time is not a number.
        .select_times(-math.inf if math.isnan(start) else start, end)
        .rotate_ground(setup.sensor_to_opensim_rotations)
    )
    frames = {frame.name for frame in model.components(PhysicalFrame)} & {*data.names}
    weights = {
        sensor_weight.name: sensor_weight.weight
        # Of several weights of one sensor the first counts.
        for sensor_weight in reversed(setup.orientation_weights.objects)
        if sensor_weight.name in frames
    }
    motion = inverse_kinematics(model, orientations=data, weights=weights)
    requested, folder = (
        "" if name.strip() in NO_FILE else name.strip()
        for name in (setup.output_motion_file, setup.results_directory)
    )
    # The setup may be from Windows.
    output_folder, _, name = requested.replace("\\", "/").rpartition("/")
    name = name or f"ik_{file.stem}"
    tables = {
        name if "." in name else f"{name}.mot": replace(
            create_motion_table(motion), header=DEGREES_HEADER | {"name": name}
        )
    }
    if setup.report_errors:
        # OpenSim writes 0 for a sensor that was not measured.
        errors = np.nan_to_num(motion.orientation_errors)
        table = StoTable(
            ORIENTATION_ERRORS,
            motion.times,
            motion.sensors,
            errors,
            header={"name": ORIENTATION_ERRORS},
        )
        tables[f"{name}_orientationErrors.sto"] = table
    for file_name, table in tables.items():
        if folder or job.output is not None:
            outcome.add_typed_table(job.get_results_path(file_name), table)
        elif requested:
            outcome.add_typed_table(
                job.get_output_path(str(Path(output_folder) / file_name)), table
            )
    if not outcome.tables:
        outcome.add_message(
            "nothing written",
            "the setup names neither a results_directory nor an output_motion_file",
        )
    outcome.evidence = Evidence.from_values(
        model,
        job.require_path("model_file"),
        motion.mechanism,
        motion.times,
        motion.values,
        sensors=motion.sensors,
        angles=motion.orientation_errors,
    )
    outcome.summary |= motion.summary
    for subject, message in describe_fit(motion):
        outcome.add_message(subject, message)
    if ignored_names := [name for name in data.names if name not in frames]:
        outcome.add_message(
            "left out", f"{join_words(ignored_names)}: the model has no frames with these names"
        )
