"""OpenSim's InverseDynamicsTool: the generalized forces that a measured motion takes."""

from __future__ import annotations

import numpy as np

from osimlite.multibody import build_mechanism
from osimlite.schema.tools.dynamics import InverseDynamicsTool
from osimlite.simulation.elements import force_elements
from osimlite.simulation.files.recorded import RecordedMotion, exclude_forces
from osimlite.tools.job import Job
from osimlite.tools.not_runnable import NotRunnable
from osimlite.tools.outcome import Outcome


def run(job: Job, outcome: Outcome) -> None:
    """Compute the generalized forces."""
    setup: InverseDynamicsTool = job.setup
    if setup.joints_to_report_body_forces:
        told = "joints_to_report_body_forces asks for loads on bodies at joints, which are not computed yet"
        raise NotRunnable(told, file=str(job.file))
    model = job.model()
    recorded = RecordedMotion.read(build_mechanism(model), job.needed("coordinates_file"))
    cutoff = setup.lowpass_cutoff_frequency_for_coordinates
    if cutoff >= 0.0:
        # OpenSim takes what its filter adds for part of the motion.
        recorded = recorded.lowpassed(cutoff, continued=True)
    recorded = recorded.between(*setup.time_range)
    exclude_forces(model, map(str, setup.forces_to_exclude))
    forces = force_elements(model, recorded.mechanism, external_loads=job.path("external_loads_file"), folder=None)
    table = recorded.inverse_dynamics(forces)
    outcome.table(job.in_results(setup.output_gen_force_file), table)
    outcome.tell("largest", f"{np.abs(table.rows).max():.6g}")
