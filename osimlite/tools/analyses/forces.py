"""OpenSim's analyses of forces: Actuation and JointReaction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.base.text import add_article, format_count, join_words, suggest_name
from osimlite.io.tables.old_storage import UNITS
from osimlite.io.tables.storage import read_sto
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.forces import Actuator, ScalarActuator
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.muscles import PathActuator
from osimlite.schema.tools.analyses import Actuation, JointReaction
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.ideal_actuators import make_ideal_actuator
from osimlite.simulation.run_controls import add_controls
from osimlite.tools.dynamics_setup import build_simulation
from osimlite.tools.motion import AnalysisTables, Motion
from osimlite.tools.reaction_forces import JointWrenches

REACTION_TITLE = "Joint Reaction Loads"
"""OpenSim's title of the table."""
REACTION_DESCRIPTION = (
    "\nThis file contains the reaction forces and moments\n"
    "applied to the specified body of a joint pair and expressed  in the specified reference frame.\n"
    "\nUnits are S.I. units (seconds, meters, Newtons, ...)"
)
"""OpenSim's text in the header of the table."""
REACTION_ENDINGS = ("fx", "fy", "fz", "mx", "my", "mz", "px", "py", "pz")
"""Suffixes of the columns of one joint: force, moment and point."""


def write_joint_reactions(analysis: JointReaction, motion: Motion, tables: AnalysisTables) -> None:
    """Write force (N), moment (N m) and point of application (m) of the requested joints.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the table.
    """
    mechanism, model = motion.mechanism, motion.model
    joints = _find_joints(analysis, model, tables)
    body_words = _expand_words(
        "apply_on_bodies", analysis.apply_on_bodies or ("child",), joints, tables
    )
    frames = _expand_words(
        "express_in_frame", analysis.express_in_frame or ("ground",), joints, tables
    )
    loads = JointWrenches.compute_along(*_override_forces(analysis, motion, tables))
    columns: list[str] = []
    rows: list[Array] = []
    for joint, body_word, requested in zip(joints, body_words, frames, strict=True):
        side = body_word.lower()
        if side not in ("child", "parent"):
            raise tables.job.create_error(f"apply_on_bodies has '{side}'; expected child or parent")
        bases = {end: _find_base_path(model, joint, end) for end in ("child", "parent")}
        frame = _find_frame_path(motion, requested, bases, tables)
        force, moment, point = loads.get_reaction(joint, side)
        rotation, origin = loads.link_motion.locate_frame(*mechanism.placement(frame))
        # From ground to the frame in which the results are expressed.
        ground_to_frame = rotation.transpose(0, 2, 1)
        rows += [
            (ground_to_frame @ vectors[..., None])[..., 0]
            for vectors in (force, moment, point - origin)
        ]
        root = f"{joint.name}_on_{_get_last_name(bases[side])}_in_{_get_last_name(frame)}"
        columns += [f"{root}_{ending}" for ending in REACTION_ENDINGS]
    tables.add_table(
        "ReactionLoads",
        REACTION_TITLE,
        columns,
        np.concatenate(rows, axis=1),
        description=REACTION_DESCRIPTION,
    )


def _find_joints(analysis: JointReaction, model: Model, tables: AnalysisTables) -> list[Joint]:
    """Return the joints that an analysis names, in the order of its names; all if the first word is ALL.

    Args:
        analysis: settings of the analysis.
        model: model with the joints.
        tables: writer of the tables, for errors.

    Raises:
        OsimliteError: the model has no joint of a name; the message has the nearest one.
    """
    all_joints = model.joint_set.objects
    names = list(map(str, analysis.joint_names)) or ["ALL"]
    # OpenSim looks at the first word only.
    if names[0].upper() == "ALL":
        return list(all_joints)
    joints_by_name = {joint.name: joint for joint in all_joints}
    for name in names:
        if name not in joints_by_name:
            raise tables.job.create_error(
                f"unknown joint '{name}' for '{analysis.name}'{suggest_name(name, joints_by_name)}"
            )
    return [joints_by_name[name] for name in names]


def _expand_words(
    property_name: str, values: Sequence[object], joints: Sequence[Joint], tables: AnalysisTables
) -> list[str]:
    """Return a word for each joint; a single word holds for all."""
    words = list(map(str, values))
    if len(words) == 1:
        return words * len(joints)
    if len(words) != len(joints):
        count = format_count(len(joints), "joint")
        raise tables.job.create_error(
            f"{property_name} has {format_count(len(words), 'word')} for {count}; write one word, or one for each joint"
        )
    return words


def _find_base_path(model: Model, joint: Joint, end: str) -> str:
    """Return the path of the body, or of ground, to which one end of a joint is fixed."""
    placements = Placements(model.tree())
    return placements.resolve_frame(placements.follow_socket(joint, f"socket_{end}_frame"))[0]


def _find_frame_path(
    motion: Motion, requested: str, bases: dict[str, str], tables: AnalysisTables
) -> str:
    """Return the path of a frame that a setup names, by a word or as OpenSim searches for it.

    Args:
        motion: motion along which the analysis is computed.
        requested: ``"child"``, ``"parent"``, or name of a frame.
        bases: paths of the joint's bodies by these words.
        tables: writer of the tables.
    """
    result = motion.find_frame_path(requested, "Frame", "/bodyset", "/jointset") or bases.get(
        requested.lower()
    )
    if result is None:
        message = (
            f"express_in_frame has '{requested}', which is not a frame of the model; "
            "write child, parent or the name of a frame"
        )
        raise tables.job.create_error(message)
    return result


def _get_last_name(path: str) -> str:
    """Return the last part of a path."""
    return path.rpartition("/")[2]


def _override_forces(
    analysis: JointReaction, motion: Motion, tables: AnalysisTables
) -> tuple[Motion, Controls | None]:
    """Return a motion whose actuators have the forces of a file, and the controls that drive them.

    OpenSim does so if every actuator has a column; otherwise it uses the forces of the states.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the tables.

    Returns:
        The motion, and its controls; the motion itself and None if no forces are replaced.
    """
    path = tables.job.resolve_name(analysis.forces_file)
    if path is None:
        return motion, None
    table = read_sto(path)
    model = motion.model.copy_deep()
    actuators = [actuator for actuator in model.components(ScalarActuator)]
    missing_names = [actuator.name for actuator in actuators if actuator.name not in table.columns]
    if missing_names:
        tables.outcome.add_message(
            analysis.name,
            f"'{path}' has no column for {join_words(missing_names)}; as in OpenSim, the states determine "
            "these forces",
        )
        return motion, None
    # The forces of the file replace what controllers would command.
    model.controller_set.objects.clear()
    # Probes are not needed here, and those of muscles would not find the muscles, which are
    # replaced below.
    model.probe_set.objects.clear()
    indices = {id(force): number for number, force in enumerate(model.force_set.objects)}
    for actuator in actuators:
        # An ideal actuator with optimal force 1 has its control as its force.
        ideal_actuator = make_ideal_actuator(actuator, 1.0)
        if ideal_actuator is None or id(actuator) not in indices:
            raise tables.job.create_unsupported_error(
                f"the {type(actuator).__name__} '{actuator.name}' cannot take its force from '{path}'; "
                "osimlite does not support that yet"
            )
        model.force_set.objects[indices[id(actuator)]] = ideal_actuator
    simulation = build_simulation(tables.job, model)
    forces = {actuator.name: (table.times, table[actuator.name]) for actuator in actuators}
    start, end = (float(time) for time in motion.times[[0, -1]])
    controls = add_controls(
        simulation.forces.controls, forces, end, start=start, description=f"forces of '{path.name}'"
    )
    simulation.engine.set_controls(controls)
    poses = zip(motion.values.tolist(), motion.speeds.tolist(), strict=True)
    return Motion(
        model, simulation, motion.times, np.array([simulation.state.pack(q, u) for q, u in poses])
    ), controls


ACTUATION_DESCRIPTION = (
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
"""OpenSim's text in the header of the tables."""


def write_actuation(analysis: Actuation, motion: Motion, tables: AnalysisTables) -> None:
    """Write forces, speeds and powers of the actuators that are on.

    Args:
        analysis: settings of the analysis.
        motion: motion along which the analysis is computed.
        tables: writer of the tables.
    """
    actuators = [
        actuator
        for actuator in motion.model.force_set.objects
        if isinstance(actuator, Actuator) and actuator.appliesForce
    ]
    for actuator in actuators:
        # The table has one column per actuator.
        if actuator.control_count != 1:
            raise tables.job.create_unsupported_error(
                f"'{analysis.name}' needs actuators with one force each, but "
                f"'{actuator.name}', {add_article(type(actuator).__name__)}, "
                "has several; OpenSim crashes on such a model"
            )
    tree = motion.model.tree()
    records = motion.read_records(
        [tree.path_of(actuator) or "" for actuator in actuators], "actuation", "speed"
    )
    force, speed = records["actuation"], records["speed"]
    # A tension does work against the lengthening speed.
    sense = np.array(
        [-1.0 if isinstance(actuator, PathActuator) else 1.0 for actuator in actuators]
    )
    names = [actuator.name for actuator in actuators]
    for suffix, title, rows in (
        ("force", "ActuatorForces", force),
        ("speed", "ActuatorSpeeds", speed),
        ("power", "ActuatorPowers", sense * force * speed),
    ):
        tables.add_table(suffix, title, names, rows, description=ACTUATION_DESCRIPTION)
