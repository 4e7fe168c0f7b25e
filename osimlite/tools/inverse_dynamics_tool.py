"""OpenSim's InverseDynamicsTool: the generalized forces that a measured motion takes."""

from __future__ import annotations

import numpy as np

from osimlite.base.text import did_you_mean, listed
from osimlite.io.tables.storage import StoTable
from osimlite.io.tables.times import both_of
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.tools.dynamics import InverseDynamicsTool
from osimlite.simulation.elements import force_elements
from osimlite.simulation.recorded_motion import RecordedMotion, exclude_forces
from osimlite.tools.evidence import Evidence, root_of
from osimlite.tools.job import Job
from osimlite.tools.joint_loads import loads_at_joints
from osimlite.tools.outcome import Outcome


def run(job: Job, outcome: Outcome) -> None:
    """Compute the generalized forces."""
    setup: InverseDynamicsTool = job.setup
    model = job.model()
    joints = _joints(job, model, outcome)
    recorded = RecordedMotion.read(
        build_mechanism(model, opensim_derivatives=True), job.needed("coordinates_file")
    )
    by_path = [
        info.name for info in recorded.mechanism.coordinates if info.name in recorded.named_by_path
    ]
    if by_path:
        outcome.warn(
            "columns",
            f"'{setup.coordinates_file}' names {listed(by_path)} by paths, which are understood here; OpenSim's "
            "inverse dynamics takes the default values of these coordinates instead: its moments are other ones",
        )
    cutoff = setup.lowpass_cutoff_frequency_for_coordinates
    if cutoff >= 0.0:
        # OpenSim takes what its filter adds for part of the motion.
        recorded = recorded.lowpassed(cutoff, continued=True)
    recorded = recorded.between(*both_of(setup.time_range))
    exclude_forces(model, map(str, setup.forces_to_exclude))
    loads = job.path("external_loads_file")
    forces = force_elements(model, recorded.mechanism, external_loads=loads, folder=None)
    table = recorded.inverse_dynamics(forces)
    outcome.table(job.in_results(setup.output_gen_force_file), table)
    if joints:
        result = np.empty_like(table.rows)
        result[
            :, [place for body in recorded.mechanism.bodies for place in body.mobilizer.coordinates]
        ] = table.rows
        at_joints = loads_at_joints(model, joints, recorded, result)
        outcome.table(job.in_results(setup.output_body_forces_file), at_joints)
    outcome.evidence = Evidence.of(
        model,
        job.needed("model_file"),
        recorded.mechanism,
        recorded.times,
        recorded.values,
        loads=loads,
    )
    row, column = np.unravel_index(int(np.abs(table.rows).argmax()), table.rows.shape)
    most = f"{table.columns[column]}, {table.rows[row, column]:.6g} at {table.times[row]:g} s"
    outcome.tell("largest", most)
    _tell_residuals(outcome, recorded.mechanism, table)


def _tell_residuals(outcome: Outcome, mechanism: Mechanism, table: StoTable) -> None:
    """Say what the joint to ground has to push, which nothing does in life: J. Hicks et al., J Biomech Eng 137, 2015.

    Their advice is 5 % of the measured force at most, and moments of 1 % of that times the height
    of the mass centre.
    """
    names = [mechanism.coordinates[place].name for place in root_of(mechanism)]
    weight = mechanism.total_mass * float(np.linalg.norm(mechanism.gravity))
    for what, unit in (("force", "N"), ("moment", "N m")):
        own = [
            table[label] for label in (f"{name}_{what}" for name in names) if label in table.columns
        ]
        if own:
            sizes = np.linalg.norm(own, axis=0)
            rms, most = float(np.sqrt(np.mean(sizes**2))), float(sizes.max())
            outcome.summary |= {f"rms_residual_{what}": rms, f"largest_residual_{what}": most}
            part = (
                f", {100.0 * most / weight:.3g} % of the weight"
                if what == "force" and weight
                else ""
            )
            outcome.tell(
                f"residual {what}s",
                f"{rms:.4g} {unit} (root mean square), at most {most:.4g} {unit}{part}",
            )


def _joints(job: Job, model: Model, outcome: Outcome) -> list[Joint]:
    """The joints whose loads are asked for; OpenSim warns of those that are not there."""
    known = {joint.name: joint for joint in model.joint_set.objects}
    result: list[Joint] = []
    for name in map(str, job.setup.joints_to_report_body_forces):
        if name.upper() == "ALL":
            result += known.values()
            break
        if name in known:
            result.append(known[name])
        else:
            message = f"there is no joint '{name}'{did_you_mean(name, known)}: its loads are left out, as in OpenSim"
            outcome.tell("joints_to_report_body_forces", message)
    return result
