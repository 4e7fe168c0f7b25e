"""OpenSim's IMUPlacer: sensors put onto a model as they were worn."""

from __future__ import annotations

import math

from osimlite.base.text import listed
from osimlite.fitting.orientation_data import OrientationData
from osimlite.fitting.sensors import place_sensors
from osimlite.io.document.printer import to_text
from osimlite.schema.tools.sensors import IMUPlacer
from osimlite.tools.job import NONE, Job
from osimlite.tools.outcome import Outcome


def run(job: Job, outcome: Outcome) -> None:
    """Place the sensors, and write the model with them."""
    setup: IMUPlacer = job.setup
    model = job.model()
    data = OrientationData.of(job.needed("orientation_file_for_calibration"))
    data = data.turned(setup.sensor_to_opensim_rotations)
    placed = place_sensors(model, data, setup.base_imu_label, setup.base_heading_axis)
    if setup.output_model_file.strip() not in NONE:
        outcome.text(job.result(setup.output_model_file), to_text(model, numbers="opensim"))
    outcome.summary |= placed._asdict()
    outcome.tell("placed", listed(placed.names, most=100))
    if placed.left_out:
        outcome.tell(
            "left out", f"{listed(placed.left_out)}: the model has no frame of these names"
        )
    if placed.heading is not None:
        outcome.tell(
            "heading", f"turned by {math.degrees(placed.heading):.6g} degrees about the vertical"
        )
