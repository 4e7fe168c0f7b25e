"""OpenSim's Actuation: forces, speeds and powers of actuators."""

from __future__ import annotations

import numpy as np

from osimlite.io.tables.old_storage import UNITS
from osimlite.schema.actuators import Actuator
from osimlite.schema.path_actuators import PathActuator
from osimlite.schema.tools.analyses import Actuation
from osimlite.tools.motion import Motion, Tables

_DESCRIPTION = (
    "\nThis file contains either the forces, speeds, or powers developed\n"
    "by the actuators of a model during a simulation.\n"
    "\nAn actuator force is a generalized force, meaning that it can be either a force (N) or a torque (Nm).\n"
    "\nAn actuator speed is the rate at which an actuator shortens. Depending on the actuator,\n"
    "a speed can be either a translational speed (m/s) or an angular speed (deg/s or rad/s).\n"
    "\nAn actuator power (Watts) is the rate at which an actuator does work.  Positive power means\n"
    "that the actuator is delivering energy to the model; negative power means that the actuator\n"
    "is absorbing energy from the model.\n"
    f"\n{UNITS}"
)


def compute(analysis: Actuation, motion: Motion, tables: Tables) -> None:
    """Write three tables of the actuators that are on."""
    actuators = [
        item
        for item in motion.model.force_set.objects
        if isinstance(item, Actuator) and item.appliesForce
    ]
    for item in actuators:
        if item.control_count != 1:
            raise tables.job.unable(
                f"'{analysis.name}' asks for one force of '{item.name}', a {type(item).__name__}, which has several; "
                "OpenSim crashes there"
            )
    tree = motion.model.tree()
    known = motion.known([tree.path_of(item) or "" for item in actuators], "actuation", "speed")
    force, speed = known["actuation"], known["speed"]
    # A tension pulls against the lengthening speed.
    sense = np.array([-1.0 if isinstance(item, PathActuator) else 1.0 for item in actuators])
    names = [item.name for item in actuators]
    for suffix, title, rows in (
        ("force", "ActuatorForces", force),
        ("speed", "ActuatorSpeeds", speed),
        ("power", "ActuatorPowers", sense * force * speed),
    ):
        tables.add(suffix, title, names, rows, description=_DESCRIPTION)
