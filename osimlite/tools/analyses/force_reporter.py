"""OpenSim's ForceReporter: what all forces report of themselves."""

from __future__ import annotations

import numpy as np

from osimlite.io.tables.old_storage import UNITS
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.tools.analyses import ForceReporter
from osimlite.simulation.system import System
from osimlite.simulation.trajectory import label_as_opensim
from osimlite.tools.constraint_forces import recorded
from osimlite.tools.motion import Motion, Tables

DESCRIPTION = (
    "\nThis file contains the forces exerted on a model during a simulation.\n"
    "\nA force is a generalized force, meaning that it can be either a force (N) or a torque (Nm).\n"
    f"\n{UNITS}"
)
"""What the header of forces says besides."""


def compute(analysis: ForceReporter, motion: Motion, tables: Tables) -> None:
    """Write the columns of every force, and of every constraint if they are asked for."""
    rows = motion.compute_by_parts(lambda part: force_records(part, motion.system))
    labels = label_as_opensim(motion.system.columns)
    if analysis.include_constraint_forces and motion.simulation.constraints:
        more, result = recorded(motion)
        labels, rows = labels + more, np.hstack([rows, result])
    tables.add("forces", "ModelForces", labels, rows, description=DESCRIPTION)


def force_records(motion: Motion, system: System) -> Array:
    """Return the force records (t, m) of a motion in the columns of a system; NaN of muscles that are left out.

    Args:
        motion: at whose states they are.
        system: with all forces, among them those that the motion leaves out.
    """
    result = np.full((len(motion.times), len(system.columns)), np.nan)
    owners = [element.path for element in system.forces.elements for _ in element.columns]
    there = [k for k, path in enumerate(owners) if path not in motion.left_out]
    result[:, there] = motion.system.force_table(motion.times, motion.states)
    return result
