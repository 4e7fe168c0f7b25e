"""OpenSim's IMUInverseKinematicsTool: the motion that fits measured orientations of sensors."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from osimlite.base.records import replace
from osimlite.base.text import listed
from osimlite.fitting.ik_tool import motion_table, told
from osimlite.fitting.inverse_kinematics import inverse_kinematics
from osimlite.fitting.orientation_data import OrientationData
from osimlite.io.tables.storage import StoTable
from osimlite.io.tables.times import both_of
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.tools.inverse_kinematics import IMUInverseKinematicsTool
from osimlite.tools.evidence import Evidence
from osimlite.tools.job import NONE, Job
from osimlite.tools.outcome import Outcome

ERRORS, DEGREES = "OrientationErrors", {"inDegrees": "yes"}
"""What OpenSim calls the table of errors, and the header of one in degrees."""


def run(job: Job, outcome: Outcome) -> None:
    """Fit every frame to its minimum; write coordinates, and angles of the sensors from their data where asked for."""
    setup: IMUInverseKinematicsTool = job.setup
    model, file = job.model(), job.needed("orientations_file")
    data = (
        OrientationData.of(file)
        .between(*both_of(setup.time_range))
        .turned(setup.sensor_to_opensim_rotations)
    )
    frames = {frame.name for frame in model.components(PhysicalFrame)} & {*data.names}
    weights = {
        item.name: item.weight
        for item in reversed(setup.orientation_weights.objects)
        if item.name in frames
    }
    motion = inverse_kinematics(model, orientations=data, weights=weights)
    asked, folder = (
        "" if name.strip() in NONE else name.strip()
        for name in (setup.output_motion_file, setup.results_directory)
    )
    beside, _, name = asked.replace("\\", "/").rpartition("/")
    name = name or f"ik_{file.stem}"
    tables = {
        name if "." in name else f"{name}.mot": replace(
            motion_table(motion), header=DEGREES | {"name": name}
        )
    }
    if setup.report_errors:
        # A sensor that was not measured has no error, which OpenSim writes as 0.
        errors = np.nan_to_num(motion.orientation_errors)
        table = StoTable(ERRORS, motion.times, motion.sensors, errors, header={"name": ERRORS})
        tables[f"{name}_orientationErrors.sto"] = table
    for place, table in tables.items():
        if folder or job.output is not None:
            outcome.new_table(job.in_results(place), table)
        elif asked:
            outcome.new_table(job.result(str(Path(beside) / place)), table)
    if not outcome.tables:
        outcome.tell(
            "nothing written",
            "the setup names neither a results_directory nor an output_motion_file",
        )
    outcome.evidence = Evidence.of(
        model,
        job.needed("model_file"),
        motion.mechanism,
        motion.times,
        motion.values,
        sensors=motion.sensors,
        angles=motion.orientation_errors,
    )
    outcome.summary |= motion.summary
    for words in told(motion):
        outcome.tell("sensors", words)
    if silent := [name for name in data.names if name not in frames]:
        outcome.tell("left out", f"{listed(silent)}: the model has no frame of these names")
