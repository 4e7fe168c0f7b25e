"""OpenSim's InverseDynamicsTool: generalized forces of a measured motion, and loads at joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.base.progress import watch_items
from osimlite.base.records import replace
from osimlite.base.text import append_clause, join_words, suggest_name
from osimlite.errors import SettingError
from osimlite.io.tables.storage import StoTable, expect_time_range
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.kinematics import MechanismKinematics
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.joint_types import ScapulothoracicJoint
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.tools.dynamics import InverseDynamicsTool
from osimlite.simulation.elements import force_elements
from osimlite.simulation.recorded_motion import RecordedMotion, exclude_forces
from osimlite.tools.evidence import Evidence, find_root_coordinates
from osimlite.tools.job import Job
from osimlite.tools.outcome import Outcome


def run_inverse_dynamics_tool(job: Job, outcome: Outcome) -> None:
    """Compute generalized forces and, if requested, loads at joints.

    Args:
        job: setup, an InverseDynamicsTool.
        outcome: outcome to which the results are added.
    """
    setup: InverseDynamicsTool = job.setup
    model = job.read_model()
    joints = _find_reported_joints(job, model, outcome)
    recorded = RecordedMotion.read(
        build_mechanism(model, opensim_derivatives=True), job.require_path("coordinates_file")
    )
    by_path = [
        info.name for info in recorded.mechanism.coordinates if info.name in recorded.named_by_path
    ]
    if by_path:
        outcome.add_warning(
            "columns",
            f"'{setup.coordinates_file}' names {join_words(by_path)} by paths. osimlite reads "
            "these columns. OpenSim's inverse dynamics uses the default values of these "
            "coordinates instead, so its moments differ",
        )
    cutoff = setup.lowpass_cutoff_frequency_for_coordinates
    if cutoff >= 0.0:
        # OpenSim's filter extends the motion; OpenSim treats the extension as measured.
        recorded = recorded.apply_lowpass(cutoff, continued=True)
    # After filtering, so that the filter sees the complete motion.
    recorded = recorded.select_times(*expect_time_range(setup.time_range))
    for name in map(str, setup.forces_to_exclude):
        try:
            exclude_forces(model, [name])
        except SettingError as error:
            # As in OpenSim, an unknown name excludes nothing.
            outcome.add_message(
                "forces to exclude",
                append_clause(error.message, "the name is ignored, as in OpenSim"),
            )
    loads = job.find_path("external_loads_file")
    forces = force_elements(model, recorded.mechanism, external_loads=loads, folder=None)
    table = recorded.inverse_dynamics(forces)
    outcome.add_table(job.get_results_path(setup.output_gen_force_file), table)
    if joints:
        # The table has the order of the tree, joint loads need that of the mechanism.
        forces_of_mechanism = np.empty_like(table.rows)
        forces_of_mechanism[
            :, [index for body in recorded.mechanism.bodies for index in body.mobilizer.coordinates]
        ] = table.rows
        at_joints = compute_joint_loads(model, joints, recorded, forces_of_mechanism)
        outcome.add_table(job.get_results_path(setup.output_body_forces_file), at_joints)
    outcome.evidence = Evidence.from_values(
        model,
        job.require_path("model_file"),
        recorded.mechanism,
        recorded.times,
        recorded.values,
        loads=loads,
    )
    row, column = np.unravel_index(int(np.abs(table.rows).argmax()), table.rows.shape)
    label = table.columns[column]
    unit = "N" if label.endswith("_force") else "N m"
    largest = f"{label}, {table.rows[row, column]:.6g} {unit} at {table.times[row]:g} s"
    outcome.add_message("largest value", largest)
    _report_residuals(outcome, recorded.mechanism, table)


def _report_residuals(outcome: Outcome, mechanism: Mechanism, table: StoTable) -> None:
    """Add messages about the residual forces and moments at the joint to ground.

    J. Hicks et al., J Biomech Eng 137, 2015, advise at most 5 % of the measured force, and moments
    of at most 1 % of that force times the height of the mass centre.

    Args:
        outcome: outcome to which messages are added.
        mechanism: mechanism of the model.
        table: generalized forces.
    """
    names = [mechanism.coordinates[index].name for index in find_root_coordinates(mechanism)]
    weight = mechanism.total_mass * float(np.linalg.norm(mechanism.gravity))
    for quantity, unit in (("force", "N"), ("moment", "N m")):
        columns = [
            table[label]
            for label in (f"{name}_{quantity}" for name in names)
            if label in table.columns
        ]
        if columns:
            sizes = np.linalg.norm(columns, axis=0)
            rms = float(np.sqrt(np.mean(sizes**2)))
            largest = float(sizes.max())
            outcome.summary |= {
                f"rms_residual_{quantity}": rms,
                f"largest_residual_{quantity}": largest,
            }
            comparison = (
                f", {100.0 * largest / weight:.3g} % of the weight"
                if quantity == "force" and weight
                else ""
            )
            outcome.add_message(
                f"residual {quantity}s",
                f"{rms:.4g} {unit} (root mean square), at most {largest:.4g} {unit}{comparison}",
            )


def _find_reported_joints(job: Job, model: Model, outcome: Outcome) -> list[Joint]:
    """Return the requested joints, and report unknown names, for which OpenSim warns."""
    joints_by_name = {joint.name: joint for joint in model.joint_set.objects}
    result: list[Joint] = []
    for name in map(str, job.setup.joints_to_report_body_forces):
        if name.upper() == "ALL":
            result += joints_by_name.values()
            break
        if name in joints_by_name:
            result.append(joints_by_name[name])
        else:
            message = append_clause(
                f"unknown joint '{name}'{suggest_name(name, joints_by_name)}",
                "its loads are left out, as in OpenSim",
                separator=":",
            )
            outcome.add_message("joints_to_report_body_forces", message)
    return result


SIGNIFICANT_REAL = 2.0**-45.5
"""Simbody's SignificantReal: smaller forces count as zero."""


def compute_joint_loads(
    model: Model, joints: Sequence[Joint], recorded: RecordedMotion, forces: Array
) -> StoTable:
    """Return forces and torques on the children of joints that equal the generalized forces.

    Where both a force and a torque can do part of the work, the one that does more with less
    counts, and the other does the rest. Each is the shortest vector that does its part.

    Args:
        model: model that has the joints.
        joints: requested joints.
        recorded: motion of the model, with t rows.
        forces: generalized forces (t, n) in the order of the mechanism.

    Returns:
        Force (N) and torque (N m) at the child frame of each joint, in ground.
    """
    mechanism = recorded.mechanism
    placements = Placements(model.tree())
    body_indices = {body.path: index for index, body in enumerate(mechanism.bodies)}
    by_joint = {body.mobilizer.joint: index for index, body in enumerate(mechanism.bodies)}
    requested, labels = [], []
    for joint in joints:
        frame = placements.follow_socket(joint, "socket_child_frame")
        base, _ = placements.resolve_frame(frame)
        # OpenSim adds the mobilizer of the child's body and the one that has the joint's
        # coordinates; they differ if the joint closes a loop.
        requested.append((joint, {body_indices[base], by_joint[placements.path(joint)]}))
        root = f"{joint.name}_{placements.path(frame).rpartition('/')[2]}"
        labels += [f"{root}_{letter}{axis}" for letter in "FM" for axis in "XYZ"]
    # OpenSim has two mobilizers for a scapula: along the ellipsoid, and about the winging axis.
    hinges = [
        [
            _split_mobilizer(mechanism, body, is_split=isinstance(joint, ScapulothoracicJoint))
            for body in bodies
        ]
        for joint, bodies in requested
    ]
    rows = np.zeros((len(recorded.times), len(joints), 2, 3))
    moments = [*zip(rows, recorded.values, forces, strict=True)]
    for row, q, row_forces in watch_items("computing loads at joints", moments):
        state = mechanism.at(q)
        for number, joint_hinges in enumerate(hinges):
            row[number] = sum(
                _compute_joint_load(state, *hinge, row_forces) for hinge in joint_hinges
            )
    title = "Inverse Dynamics Body Forces at Specified Joints"
    return StoTable(title, recorded.times, tuple(labels), rows.reshape(len(rows), -1))


_Hinge = tuple[list[int], Mechanism]
"""Indices of coordinates, and a mechanism with one body that they move in ground."""


def _split_mobilizer(
    mechanism: Mechanism, body: int, *, is_split: bool
) -> tuple[int, Array, list[_Hinge]]:
    """Split the mobilizer of a body into hinges, one after another.

    Args:
        mechanism: mechanism of the model.
        body: index of the body.
        is_split: whether each motion of the mobilizer is a hinge of its own.

    Returns:
        Index of the parent body; orientation of the mobilizer in that body (3, 3); and the hinges.
    """
    mobilizer = mechanism.bodies[body].mobilizer
    groups = [[motion] for motion in mobilizer.motions] if is_split else [[*mobilizer.motions]]
    hinges: list[_Hinge] = []
    # A reversed mobilizer runs from the child to the parent.
    for motions in groups[::-1] if mobilizer.reversed else groups:
        used_coordinates = sorted({index for motion in motions for index in motion.coordinates})
        renumbered: Any = [
            replace(m, coordinates=tuple(map(used_coordinates.index, m.coordinates)))
            for m in motions
        ]
        indices = [mobilizer.coordinates[index] for index in used_coordinates]
        identity = np.eye(4)
        count = tuple(range(len(used_coordinates)))
        # A mechanism with this hinge alone in ground has its Jacobian as that of its body.
        grounded_mobilizer = replace(
            mobilizer,
            motions=renumbered,
            coordinates=count,
            parent_frame=identity,
            child_frame=identity,
        )
        grounded_body = replace(mechanism.bodies[body], parent=GROUND, mobilizer=grounded_mobilizer)
        infos = tuple(
            replace(mechanism.coordinates[index], locked=False, prescribed=None)
            for index in indices
        )
        hinges.append((indices, Mechanism(mobilizer.joint, (grounded_body,), infos)))
    first_frame = mobilizer.child_frame if mobilizer.reversed else mobilizer.parent_frame
    return mechanism.bodies[body].parent, first_frame[:3, :3], hinges


def _compute_joint_load(
    state: MechanismKinematics,
    parent: int,
    first_rotation: Array,
    hinges: Sequence[_Hinge],
    forces: Array,
) -> Array:
    """Return force and torque (2, 3) in ground for the generalized forces (n,) of some hinges.

    Args:
        state: kinematics of the mechanism.
        parent: index of the parent body.
        first_rotation: orientation of the first hinge in the parent body (3, 3).
        hinges: hinges from the parent to the child.
        forces: generalized forces (n,).
    """
    rotation = state.rotations[parent] @ first_rotation
    load = np.zeros((2, 3))
    for indices, hinge in hinges:
        hinge_state = hinge.at(state.q[indices])
        load += _compute_hinge_load(hinge_state.jacobians[0].T, forces[indices]) @ rotation.T
        rotation = rotation @ hinge_state.rotations[0]
    return load


def _compute_hinge_load(hinge: Array, target_forces: Array) -> Array:
    """Return force and torque (2, 3) for the generalized forces of one hinge.

    Args:
        hinge: Jacobian of the hinge's motion (k, 6), rotations first.
        target_forces: generalized forces (k,).
    """
    rotation = hinge[:, :3]
    translation = hinge[:, 3:]
    force = _solve_shortest(translation, target_forces)
    torque = _solve_shortest(rotation, target_forces)
    by_force, by_torque = translation @ force, rotation @ torque
    size_by_force = np.linalg.norm(by_force)
    size_by_torque = np.linalg.norm(by_torque)
    # Both can do some of the work: the one that does more per size comes first.
    if size_by_force > SIGNIFICANT_REAL and size_by_torque > SIGNIFICANT_REAL:
        if size_by_torque * np.linalg.norm(force) > size_by_force * np.linalg.norm(torque):
            force = _solve_shortest(translation, target_forces - by_torque)
        else:
            torque = _solve_shortest(rotation, target_forces - by_force)
    return np.array((force, torque))


def _solve_shortest(rows: Array, values: Array) -> Array:
    """Return the shortest least-squares solution."""
    return np.asarray(np.linalg.lstsq(rows, values, rcond=1e-13)[0], dtype=np.float64)
