"""Measurements of actuators in a trial: residuals, reserves and activations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.io.tables.storage import StoTable
from osimlite.lint.trial import Measurement
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.actuators import (
    BodyActuator,
    CoordinateActuator,
    PointActuator,
    TorqueActuator,
)
from osimlite.schema.muscles import Muscle
from osimlite.simulation.inverse_dynamics import inverse_dynamics
from osimlite.simulation.paths import Paths
from osimlite.tools.evidence import find_root_coordinates
from osimlite.tools.trials.fit import Numbers
from osimlite.tools.trials.folder import LOADS, MOTIONS, MissingInput, TrialFolder, TrialTool
from osimlite.tools.trials.loads import LoadScale, compute_scale

RESIDUALS = {"FX": "N", "FY": "N", "FZ": "N", "MX": "N m", "MY": "N m", "MZ": "N m"}
"""Names and units of residual actuators, for results without a setup."""
MIN_RESERVE_NM = 1.0
"""Smallest moment of a reserve actuator that counts, N m."""
MIN_MOMENT_ARM_M = 1e-3
"""Smallest moment arm, anywhere in the motion, of a muscle that crosses a coordinate, m."""
FULL_ACTIVATION = 0.99
"""Activation that counts as full."""
POSE_COUNT = 5
"""Number of poses in which moment arms are computed."""
TIME_SLACK_S = 0.1
"""Time by which the motion may exceed the table of its moments at either end, s."""


class ActuatorRoles(NamedTuple):
    """Roles of the actuators of a tool."""

    residuals: Mapping[str, str]  # units of actuators at the root, by name
    reserves: Mapping[str, str]  # coordinates of other actuators, by name
    muscles: Sequence[str]  # names of the muscles


def find_actuators(tool: TrialTool | None) -> ActuatorRoles:
    """Return the roles of a tool's actuators; without a tool, those that their names imply."""
    if tool is None:
        return ActuatorRoles(RESIDUALS, {}, ())
    mechanism = tool.mechanism
    residuals = dict[str, str]()
    reserves = dict[str, str]()
    muscles = []
    infos = {info.name: info for info in mechanism.coordinates}
    root = {mechanism.coordinates[index].name for index in find_root_coordinates(mechanism)}
    joints = {infos[name].joint for name in root}
    bodies = {
        body.name.rpartition("/")[2]
        for body in mechanism.bodies
        if any(mechanism.coordinates[index].joint in joints for index in body.mobilizer.coordinates)
    }
    for force in tool.forces:
        if isinstance(force, CoordinateActuator):
            name = str(force.coordinate or "").strip().rpartition("/")[2]
            if name in root:
                residuals[force.name] = "N m" if infos[name].motion_type == "rotational" else "N"
            elif name in infos:
                reserves[force.name] = name
        # OpenSim's setups also apply residuals by a PointActuator at the pelvis for each force, and
        # a TorqueActuator for each moment.
        elif isinstance(force, PointActuator) and str(force.body).rpartition("/")[2] in bodies:
            residuals[force.name] = "N"
        elif isinstance(force, TorqueActuator) and str(force.bodyA).rpartition("/")[2] in bodies | {
            "ground"
        }:
            if str(force.bodyB or "ground").rpartition("/")[2] in bodies | {"ground"}:
                residuals[force.name] = "N m"
        elif (
            isinstance(force, Muscle) and force.appliesForce and not isinstance(force, BodyActuator)
        ):
            muscles.append(force.name)
    return ActuatorRoles(residuals, reserves, muscles)


def measure_residuals(
    folder: TrialFolder,
    file: Path,
    units: Mapping[str, str],
    scale: LoadScale,
    tool_name: str,
    *,
    is_final: bool = True,
) -> Numbers:
    """Yield peaks and root mean squares of residual columns.

    Args:
        folder: files of the trial.
        file: table with the residuals.
        units: unit of each residual column.
        scale: force and moment with which residuals are compared.
        tool_name: name of the tool, for messages.
        is_final: whether no later tool reduces these residuals.
    """
    table = folder.read_table(file)
    for column, unit in units.items():
        if column in table.columns:
            values = np.abs(table[column])
            row = int(np.argmax(values))
            # Forces are compared with the measured load, moments with it times a height.
            rule, size = (
                ("residual-force", scale.force)
                if unit == "N"
                else ("residual-moment", scale.moment)
            )
            subject = f"{column} of {tool_name}"
            time_note = f"at {table.times[row]:g} s"
            position = folder.locate_row(file, row)
            yield (
                file,
                Measurement(
                    rule,
                    "peak",
                    subject,
                    float(values[row]),
                    unit,
                    size,
                    time_note,
                    position,
                    is_final,
                ),
            )
            rms = float(np.sqrt(np.mean(values**2)))
            yield (
                file,
                Measurement(
                    rule,
                    "rms",
                    subject,
                    rms,
                    unit,
                    at=folder.locate_row(file, 0),
                    is_final=is_final,
                ),
            )


def measure_inverse_dynamics(tool: TrialTool, *, is_final: bool) -> Numbers:
    """Yield the residuals of inverse dynamics.

    Args:
        tool: setup of the class InverseDynamicsTool.
        is_final: whether no later tool reduces these residuals.

    Raises:
        MissingInput: the table of forces does not exist.
    """
    file = tool.find_result(tool.setup.output_gen_force_file)
    if file is None:
        raise MissingInput(
            f"the forces of {tool} are missing ('{tool.setup.output_gen_force_file}'); run this setup"
        )
    units = {}
    for index in find_root_coordinates(tool.mechanism):
        info = tool.mechanism.coordinates[index]
        turning = info.motion_type == "rotational"
        units[f"{info.name}_{'moment' if turning else 'force'}"] = "N m" if turning else "N"
    yield from measure_residuals(
        tool.folder, file, units, compute_scale(tool), "inverse dynamics", is_final=is_final
    )


def measure_reserves(
    tool: TrialTool, file: Path, actuators: ActuatorRoles, tools: Sequence[TrialTool]
) -> Numbers:
    """Yield the moments of reserve actuators relative to the joint moments of the motion.

    Only coordinates that a muscle crosses count.

    Args:
        tool: tool with the reserve actuators.
        file: table of actuator forces.
        actuators: roles of the actuators.
        tools: setups of all tools of the trial.

    Raises:
        MissingInput: the tool has no muscles, or no reserve actuators of coordinates that a muscle
            crosses.
    """
    table = tool.folder.read_table(file)
    columns = {
        name: column for column, name in actuators.reserves.items() if column in table.columns
    }
    crossed = tool.folder.compute_once(
        ("crossed", tool.model_file), lambda: _find_crossed_coordinates(tool)
    )
    crossed_names = [name for name in columns if name in crossed]
    if not actuators.muscles or not crossed_names:
        raise MissingInput(f"{tool} has no reserve actuators besides muscles")
    moments = _find_joint_moments(tool, table, tools)
    judged_count = 0
    for name in crossed_names:
        reserve = np.abs(table[columns[name]])
        moment = moments.get(name)
        row = int(np.argmax(reserve))
        # A ratio to a small moment would be large, although the reserve hardly matters.
        if moment is None or reserve[row] < MIN_RESERVE_NM:
            continue
        judged_count += 1
        subject = f"the reserve of '{name}' relative to its joint moment"
        comparison = f"{reserve[row]:.3g} N m at {table.times[row]:g} s; the peak joint moment is {np.abs(moment).max():.3g} N m"
        peak = 100.0 * float(reserve[row] / np.abs(moment).max())
        position = tool.folder.locate_row(file, row)
        yield (
            file,
            Measurement(
                "reserve-moment", "peak", subject, peak, "%", where=comparison, at=position
            ),
        )
        rms = 100.0 * float(np.sqrt(np.mean(reserve**2) / np.mean(moment**2)))
        yield (
            file,
            Measurement(
                "reserve-moment", "rms", subject, rms, "%", at=tool.folder.locate_row(file, 0)
            ),
        )
    if not judged_count:
        yield (
            file,
            Measurement(
                "reserve-moment",
                "peak",
                "the reserves relative to their joint moments; all are below 1 N m",
                0.0,
                "%",
            ),
        )


def _find_crossed_coordinates(tool: TrialTool) -> set[str]:
    """Return the names of the coordinates that a muscle crosses."""
    model, mechanism = tool.model, tool.mechanism
    paths = Paths(model)
    tree = model.tree()
    names = paths.names
    rows = [
        names.index(path) for path in map(tree.path_of, model.components(Muscle)) if path in names
    ]
    try:
        motion = tool.motion.values
        # A moment arm may vanish in one pose, so that several are examined.
        poses = motion[np.unique(np.linspace(0, len(motion) - 1, POSE_COUNT).astype(int))]
    except MissingInput:
        # Without a motion, the default pose has to do.
        poses = mechanism.values({})[None]
    arms = (
        np.abs(paths.compute_moment_arms(poses)[:, rows]).max(axis=(0, 1)) if rows else np.zeros(0)
    )
    return {
        info.name
        # Without muscles there are no arms, and no coordinate is crossed.
        for info, arm in zip(mechanism.coordinates, arms, strict=bool(rows))
        if arm > MIN_MOMENT_ARM_M
    }


def _find_joint_moments(
    tool: TrialTool, table: StoTable, tools: Sequence[TrialTool]
) -> dict[str, Array]:
    """Return the moments of the complete motion around a table, by coordinate.

    They are results of inverse dynamics or of RRA, or are computed.

    Args:
        tool: tool whose motion it is.
        table: table whose times the moments must cover.
        tools: setups of all tools of the trial.

    Returns:
        Moments (t,) by coordinate, N m.

    Raises:
        MissingInput: the moments are missing and cannot be computed.
    """
    names = [info.name for info in tool.mechanism.coordinates]
    # Results of the user's own tools come first: they have the user's filter.
    for tool_class in ("InverseDynamicsTool", "RRATool"):
        for source in (source for source in tools if source.tag == tool_class):
            if tool_class == "RRATool":
                name = f"{source.setup.name}_Actuation_force.sto"
                # RRA has no muscles, so that its reserves carry the whole joint moments.
                columns = find_actuators(source).reserves
            else:
                name, columns = (
                    source.setup.output_gen_force_file,
                    {f"{name}_moment": name for name in names},
                )
            file = source.find_result(name)
            moments = None if file is None else tool.folder.read_table(file)
            if (
                moments is not None
                and moments.times[0] <= table.times[0] + TIME_SLACK_S
                and moments.times[-1] >= table.times[-1] - TIME_SLACK_S
            ):
                return {
                    columns[label]: moments[label] for label in moments.columns if label in columns
                }
    if tool.find_input(*MOTIONS) is None:
        raise MissingInput(
            f"no joint moments to compare with the reserves of {tool}; run inverse dynamics"
        )
    moments = inverse_dynamics(
        tool.model,
        tool.motion,
        tool.find_input(LOADS),
        lowpass=tool.cutoff if tool.cutoff > 0.0 else None,
    )
    return {
        name: moments[f"{name}_moment"] for name in names if f"{name}_moment" in moments.columns
    }


def measure_activations(folder: TrialFolder, file: Path, muscles: Sequence[str]) -> Numbers:
    """Yield the share of the time in which each muscle is fully active.

    Args:
        folder: files of the trial.
        file: table of activations.
        muscles: names of the muscles.
    """
    table = folder.read_table(file)
    saturated_count = 0
    for index, label in enumerate(table.columns):
        # Labels of OpenSim 4, of OpenSim 3, and of static optimization.
        name = label.removesuffix("/activation").removesuffix(".activation").rpartition("/")[2]
        if name not in muscles or (
            label != name and not label.endswith(("/activation", ".activation"))
        ):
            continue
        saturated_rows = np.flatnonzero(table.rows[:, index] >= FULL_ACTIVATION)
        if len(saturated_rows):
            saturated_count += 1
            percentage = 100.0 * len(saturated_rows) / len(table.times)
            time = table.times[saturated_rows[0]]
            subject = f"share of the time that '{name}' is fully active"
            position = folder.locate_row(file, int(saturated_rows[0]))
            yield (
                file,
                Measurement(
                    "full-activation",
                    "share",
                    subject,
                    percentage,
                    "%",
                    where=f"first at {time:g} s",
                    at=position,
                ),
            )
    if not saturated_count:
        yield (
            file,
            Measurement(
                "full-activation",
                "share",
                "share of the time that a muscle is fully active",
                0.0,
                "%",
            ),
        )
