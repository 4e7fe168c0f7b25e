"""OpenSim's InverseKinematicsTool: the motion that fits measured markers and coordinates."""

from __future__ import annotations

import numpy as np

from osimlite.base.text import listed
from osimlite.fitting.ik_tool import motion_table, run_inverse_kinematics, told
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.unknown_classes import IGNORED, describe_unknown
from osimlite.io.tables.old_storage import UNITS
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.schema.tools.inverse_kinematics import IKMarkerTask, InverseKinematicsTool
from osimlite.tools.evidence import Evidence
from osimlite.tools.job import NONE, Job
from osimlite.tools.outcome import Outcome


def run(job: Job, outcome: Outcome) -> None:
    """Fit every frame to its minimum; write coordinates, and errors and places of the markers where asked for."""
    setup: InverseKinematicsTool = job.setup
    coordinates = job.path("coordinate_file")
    table = None if coordinates is None else read_sto(coordinates)
    data = MarkerData.of(job.needed("marker_file"))
    model = job.model()
    motion = run_inverse_kinematics(setup, model, data, table)
    times = motion.times
    if setup.output_motion_file.strip() not in NONE:
        outcome.table(job.result(setup.output_motion_file), motion_table(motion), f"\n{UNITS}")
    if setup.report_errors:
        # Of the markers that are seen; like OpenSim, the mean is over all markers, seen or not.
        squares = np.nan_to_num(motion.marker_errors**2)
        totals = squares.sum(axis=1)
        rows = np.column_stack(
            [totals, np.sqrt(totals / squares.shape[1]), np.sqrt(squares.max(axis=1))]
        )
        labels = ("total_squared_error", "marker_error_RMS", "marker_error_max")
        path = job.in_results(f"{setup.name}_ik_marker_errors.sto")
        outcome.table(path, StoTable("Model Marker Errors from IK", times, labels, rows))
    if setup.report_marker_locations:
        columns = tuple(f"{name}_t{axis}" for name in motion.markers for axis in "xyz")
        path = job.in_results(f"{setup.name}_ik_model_marker_locations.sto")
        places = motion.places.reshape(len(times), -1)
        outcome.table(path, StoTable("Model Marker Locations from IK", times, columns, places))
    outcome.evidence = Evidence.of(
        model,
        job.needed("model_file"),
        motion.mechanism,
        times,
        motion.values,
        markers=motion.markers,
        measured=motion.measured,
        places=motion.places,
    )
    if words := describe_unknown(model, IGNORED):
        outcome.warn("unknown classes", words)
    outcome.summary |= motion.summary
    for words in told(motion):
        outcome.tell("markers", words)
    asked = [
        task.name
        for task in setup.ik_task_set.objects
        if task.apply and isinstance(task, IKMarkerTask)
    ]
    for what, names in (
        ("not fitted", [name for name in data.names if name not in motion.markers]),
        ("not in the data", [name for name in asked if name not in data.names]),
    ):
        if names:
            outcome.summary[what.replace(" ", "_")] = names
            outcome.tell(what, listed(names))
