"""The JointReaction analysis: what each joint carries."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.base.text import counted, did_you_mean, listed
from osimlite.io.tables.storage import read_sto
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.actuators import ScalarActuator
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.tools.analyses import JointReaction
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.run_controls import driven
from osimlite.simulation.static_optimization import ideal
from osimlite.tools.joint_wrenches import JointWrenches
from osimlite.tools.motion import Motion, Tables
from osimlite.tools.through_time import simulation_of

_TITLE = "Joint Reaction Loads"
_DESCRIPTION = (
    "\nThis file contains the reaction forces and moments\n"
    "applied to the specified body of a joint pair and expressed  in the specified reference frame.\n"
    "\nUnits are S.I. units (seconds, meters, Newtons, ...)"
)
_ENDINGS = ("fx", "fy", "fz", "mx", "my", "mz", "px", "py", "pz")


def compute(analysis: JointReaction, motion: Motion, tables: Tables) -> None:
    """Write the force (N), the moment (N m) and the point (m) at which they act of every joint that is asked for."""
    mechanism, model = motion.mechanism, motion.model
    joints = _joints(analysis, model, tables)
    sides = _of_each("apply_on_bodies", analysis.apply_on_bodies or ("child",), joints, tables)
    frames = _of_each("express_in_frame", analysis.express_in_frame or ("ground",), joints, tables)
    loads = JointWrenches.along(*_overridden(analysis, motion, tables))
    columns: list[str] = []
    rows: list[Array] = []
    for joint, word, asked in zip(joints, sides, frames, strict=True):
        side = word.lower()
        if side not in ("child", "parent"):
            raise tables.job.error(f"apply_on_bodies has '{side}'; it says child or parent")
        bases = {end: _base(model, joint, end) for end in ("child", "parent")}
        frame = _frame(motion, asked, bases, tables)
        force, moment, place = loads.of(joint, side)
        rotation, origin = loads.moved.placed(*mechanism.placement(frame))
        back = rotation.transpose(0, 2, 1)
        rows += [(back @ item[..., None])[..., 0] for item in (force, moment, place - origin)]
        root = f"{joint.name}_on_{_last(bases[side])}_in_{_last(frame)}"
        columns += [f"{root}_{ending}" for ending in _ENDINGS]
    tables.add(
        "ReactionLoads", _TITLE, columns, np.concatenate(rows, axis=1), description=_DESCRIPTION
    )


def _joints(analysis: JointReaction, model: Model, tables: Tables) -> list[Joint]:
    """The joints that are asked for; OpenSim finds each after the one before only, and leaves the others out."""
    every = model.joint_set.objects
    names = list(map(str, analysis.joint_names)) or ["ALL"]
    if names[0].upper() == "ALL":
        return list(every)
    known = {joint.name: joint for joint in every}
    for name in names:
        if name not in known:
            raise tables.job.error(
                f"there is no joint '{name}' for '{analysis.name}'{did_you_mean(name, known)}"
            )
    return [known[name] for name in names]


def _of_each(
    what: str, given: Sequence[object], joints: Sequence[Joint], tables: Tables
) -> list[str]:
    """The word for each joint; one may be for all."""
    words = list(map(str, given))
    if len(words) == 1:
        return words * len(joints)
    if len(words) != len(joints):
        count = counted(len(joints), "joint")
        raise tables.job.error(f"{what} has {len(words)} words for {count}; give one, or as many")
    return words


def _base(model: Model, joint: Joint, end: str) -> str:
    """The path of the body (or ground) that an end of a joint is fixed to."""
    placements = Placements(model.tree())
    return placements.frame(placements.named(joint, f"socket_{end}_frame"))[0]


def _frame(motion: Motion, asked: str, bases: dict[str, str], tables: Tables) -> str:
    """The path of a frame that is asked for by a word or as OpenSim finds it: in the model, its bodies, its joints."""
    result = motion.frame(asked, "Frame", "/bodyset", "/jointset") or bases.get(asked.lower())
    if result is None:
        message = f"express_in_frame has '{asked}', which is no frame of the model; say child, parent or a frame"
        raise tables.job.error(message)
    return result


def _last(path: str) -> str:
    return path.rpartition("/")[2]


def _overridden(
    analysis: JointReaction, motion: Motion, tables: Tables
) -> tuple[Motion, Controls | None]:
    """The motion of a model whose actuators push as a file says, and what drives them.

    OpenSim does so if every actuator has a column; else it takes the forces of the states.
    """
    path = tables.job.place(analysis.forces_file)
    if path is None:
        return motion, None
    table = read_sto(path)
    model = motion.model.copy_deep()
    actuators = [item for item in model.components(ScalarActuator)]
    lacking = [item.name for item in actuators if item.name not in table.columns]
    if lacking:
        tables.outcome.tell(
            analysis.name,
            f"'{path}' has no column for {listed(lacking)}: the forces are those of the states, as in OpenSim",
        )
        return motion, None
    model.controller_set.objects.clear()
    # Probes are not needed here, and those of muscles would miss the forces that are replaced
    # below.
    model.probe_set.objects.clear()
    places = {id(force): number for number, force in enumerate(model.force_set.objects)}
    for item in actuators:
        other = ideal(item, 1.0)
        if other is None or id(item) not in places:
            raise tables.job.unable(
                f"the {type(item).__name__} '{item.name}' cannot push as '{path}' says, which is not done yet"
            )
        model.force_set.objects[places[id(item)]] = other
    simulation = simulation_of(tables.job, model)
    forces = {item.name: (table.times, table[item.name]) for item in actuators}
    first, last = (float(time) for time in motion.times[[0, -1]])
    controls = driven(
        simulation.forces.controls, forces, last, start=first, what=f"forces of '{path.name}'"
    )
    simulation.engine.drive(controls)
    pairs = zip(motion.values.tolist(), motion.speeds.tolist(), strict=True)
    return Motion(
        model, simulation, motion.times, np.array([simulation.state.pack(q, u) for q, u in pairs])
    ), controls
