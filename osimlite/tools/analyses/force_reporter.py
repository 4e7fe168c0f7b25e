"""OpenSim's ForceReporter: what all forces report of themselves."""

from __future__ import annotations

import numpy as np

from osimlite.schema.forces import CoordinateLimitForce
from osimlite.schema.tools.analyses import ForceReporter
from osimlite.simulation.files.old_storage import UNITS
from osimlite.tools.constraint_forces import recorded
from osimlite.tools.motion import Motion, Tables

ENERGY = "PotentialEnergy"
DESCRIPTION = (
    "\nThis file contains the forces exerted on a model during a simulation.\n"
    "\nA force is a generalized force, meaning that it can be either a force (N) or a torque (Nm).\n"
    f"\n{UNITS}"
)
"""What the header of forces says besides."""


def compute(analysis: ForceReporter, motion: Motion, tables: Tables) -> None:
    """Write the columns of every force, and of every constraint if they are asked for."""
    engine = motion.simulation.engine
    rows = np.array([engine.force_records(t, y) for t, y in motion.moments]).reshape(len(motion.times), -1)
    # These energies have one label, however many there are.
    stored = {f"{force.name}.{ENERGY}" for force in motion.model.components(CoordinateLimitForce)}
    labels = [ENERGY if label in stored else label for label in engine.columns]
    if analysis.include_constraint_forces and motion.simulation.constraints:
        more, result = recorded(motion)
        labels, rows = labels + more, np.hstack([rows, result])
    tables.add("forces", "ModelForces", labels, rows, description=DESCRIPTION)
