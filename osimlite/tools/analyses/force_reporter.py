"""OpenSim's ForceReporter: what all forces report of themselves."""

from __future__ import annotations

import numpy as np

from osimlite.schema.forces import CoordinateLimitForce
from osimlite.schema.tools.analyses import ForceReporter
from osimlite.simulation.files.old_storage import UNITS
from osimlite.tools.motion import Motion, Tables
from osimlite.tools.not_runnable import NotRunnable

ENERGY = "PotentialEnergy"
_DESCRIPTION = (
    "\nThis file contains the forces exerted on a model during a simulation.\n"
    "\nA force is a generalized force, meaning that it can be either a force (N) or a torque (Nm).\n"
    f"\n{UNITS}"
)


def compute(analysis: ForceReporter, motion: Motion, tables: Tables) -> None:
    """Write the columns of every force."""
    if analysis.include_constraint_forces and motion.simulation.constraints:
        raise NotRunnable(
            f"'{analysis.name}' asks for the forces of constraints, which is not done yet", file=str(tables.job.file)
        )
    engine = motion.simulation.engine
    rows = [engine.force_records(t, y) for t, y in motion.moments]
    # These energies have one label, however many there are.
    stored = {f"{force.name}.{ENERGY}" for force in motion.model.components(CoordinateLimitForce)}
    labels = [ENERGY if label in stored else label for label in engine.columns]
    tables.add("forces", "ModelForces", labels, np.array(rows).reshape(len(rows), -1), description=_DESCRIPTION)
