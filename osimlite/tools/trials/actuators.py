"""What actuators give in a trial: residuals, reserves, activations of muscles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from osimlite.io.tables.storage import StoTable
from osimlite.lint.trial import Number
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
from osimlite.tools.evidence import root_of
from osimlite.tools.trials.fit import Numbers
from osimlite.tools.trials.folder import LOADS, MOTIONS, Folder, Missing, Tool
from osimlite.tools.trials.loads import Scale, scale_of

RESIDUALS = {"FX": "N", "FY": "N", "FZ": "N", "MX": "N m", "MY": "N m", "MZ": "N m"}
"""Names of residual actuators, where no setup says what they push."""
LEAST = 1.0
"""A reserve of less (N m) is none."""
ARM = 1e-3
"""A muscle whose moment arm is never longer (m) does not cross a coordinate."""
FULL = 0.99
"""So active is fully active."""
POSES = 5
SLACK = 0.1
"""So much longer (s) a motion may be than what is known of its moments."""


class Actuators(NamedTuple):
    """What the actuators of a tool are."""

    residuals: Mapping[str, str]  # units of those that push the body at the root, by their names
    reserves: Mapping[str, str]  # coordinates of those that push others, by their names
    muscles: Sequence[str]  # names


def actuators_of(tool: Tool | None) -> Actuators:
    """What the actuators of a tool are; without one, what their names tell."""
    if tool is None:
        return Actuators(RESIDUALS, {}, ())
    mechanism, residuals, reserves, muscles = tool.mechanism, dict[str, str](), dict[str, str](), []
    infos = {info.name: info for info in mechanism.coordinates}
    root = {mechanism.coordinates[place].name for place in root_of(mechanism)}
    joints = {infos[name].joint for name in root}
    bodies = {
        body.name.rpartition("/")[2]
        for body in mechanism.bodies
        if any(mechanism.coordinates[place].joint in joints for place in body.mobilizer.coordinates)
    }
    for force in tool.forces:
        if isinstance(force, CoordinateActuator):
            name = str(force.coordinate or "").strip().rpartition("/")[2]
            if name in root:
                residuals[force.name] = "N m" if infos[name].motion_type == "rotational" else "N"
            elif name in infos:
                reserves[force.name] = name
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
    return Actuators(residuals, reserves, muscles)


def residual_numbers(
    folder: Folder,
    file: Path,
    units: Mapping[str, str],
    scale: Scale,
    what: str,
    *,
    is_final: bool = True,
) -> Numbers:
    """Peaks and root mean squares of the columns with residuals."""
    table = folder.table(file)
    for column, unit in units.items():
        if column in table.columns:
            values = np.abs(table[column])
            row = int(np.argmax(values))
            rule, size = (
                ("residual-force", scale.force)
                if unit == "N"
                else ("residual-moment", scale.moment)
            )
            of, where, at = (
                f"{column} of {what}",
                f"at {table.times[row]:g} s",
                folder.place(file, row),
            )
            yield (
                file,
                Number(rule, "peak", of, float(values[row]), unit, size, where, at, is_final),
            )
            rms = float(np.sqrt(np.mean(values**2)))
            yield (
                file,
                Number(rule, "rms", of, rms, unit, at=folder.place(file, 0), is_final=is_final),
            )


def dynamics_numbers(tool: Tool, *, is_final: bool) -> Numbers:
    """Residuals of inverse dynamics."""
    file = tool.result(tool.setup.output_gen_force_file)
    if file is None:
        raise Missing(
            f"the forces of {tool} are missing ('{tool.setup.output_gen_force_file}'); run it"
        )
    units = {}
    for place in root_of(tool.mechanism):
        info = tool.mechanism.coordinates[place]
        turning = info.motion_type == "rotational"
        units[f"{info.name}_{'moment' if turning else 'force'}"] = "N m" if turning else "N"
    yield from residual_numbers(
        tool.folder, file, units, scale_of(tool), "inverse dynamics", is_final=is_final
    )


def reserve_numbers(
    tool: Tool, file: Path, actuators: Actuators, others: Sequence[Tool]
) -> Numbers:
    """Reserve actuators beside the moments that the motion takes at the joints that muscles cross."""
    table = tool.folder.table(file)
    own = {name: column for column, name in actuators.reserves.items() if column in table.columns}
    crossed = tool.folder.once(("crossed", tool.model_file), lambda: _crossed(tool))
    wanted = [name for name in own if name in crossed]
    if not actuators.muscles or not wanted:
        raise Missing(f"{tool} has no reserve actuators beside muscles")
    moments = _moments(tool, table, others)
    judged = 0
    for name in wanted:
        reserve, moment = np.abs(table[own[name]]), moments.get(name)
        row = int(np.argmax(reserve))
        if moment is None or reserve[row] < LEAST:
            continue
        judged += 1
        of = f"the reserve of '{name}', of its joint moment"
        where = f"{reserve[row]:.3g} N m at {table.times[row]:g} s, the motion takes {np.abs(moment).max():.3g} N m"
        peak = 100.0 * float(reserve[row] / np.abs(moment).max())
        at = tool.folder.place(file, row)
        yield file, Number("reserve-moment", "peak", of, peak, "%", where=where, at=at)
        rms = 100.0 * float(np.sqrt(np.mean(reserve**2) / np.mean(moment**2)))
        yield file, Number("reserve-moment", "rms", of, rms, "%", at=tool.folder.place(file, 0))
    if not judged:
        yield (
            file,
            Number(
                "reserve-moment",
                "peak",
                "reserves of less than 1 N m, of their joint moments",
                0.0,
                "%",
            ),
        )


def _crossed(tool: Tool) -> set[str]:
    """The coordinates that a muscle crosses."""
    model, mechanism = tool.model, tool.mechanism
    paths = Paths(model)
    tree, names = model.tree(), paths.names
    rows = [
        names.index(path) for path in map(tree.path_of, model.components(Muscle)) if path in names
    ]
    try:
        motion = tool.motion.values
        poses = motion[np.unique(np.linspace(0, len(motion) - 1, POSES).astype(int))]
    except Missing:
        poses = mechanism.values({})[None]
    arms = np.abs(paths.all_moment_arms(poses)[:, rows]).max(axis=(0, 1)) if rows else np.zeros(0)
    return {
        info.name for info, arm in zip(mechanism.coordinates, arms, strict=bool(rows)) if arm > ARM
    }


def _moments(tool: Tool, table: StoTable, others: Sequence[Tool]) -> dict[str, Array]:
    """The moments that the whole motion around a table takes, by coordinates: of inverse dynamics, or of RRA.

    Raises:
        Missing: they are not there, and cannot be computed.
    """
    names = [info.name for info in tool.mechanism.coordinates]
    for tag in ("InverseDynamicsTool", "RRATool"):
        for other in (other for other in others if other.tag == tag):
            if tag == "RRATool":
                name, columns = (
                    f"{other.setup.name}_Actuation_force.sto",
                    actuators_of(other).reserves,
                )
            else:
                name, columns = (
                    other.setup.output_gen_force_file,
                    {f"{name}_moment": name for name in names},
                )
            file = other.result(name)
            known = None if file is None else tool.folder.table(file)
            if (
                known is not None
                and known.times[0] <= table.times[0] + SLACK
                and known.times[-1] >= table.times[-1] - SLACK
            ):
                return {columns[label]: known[label] for label in known.columns if label in columns}
    if tool.input(*MOTIONS) is None:
        raise Missing(
            f"there are no joint moments beside the reserves of {tool}; run inverse dynamics"
        )
    known = inverse_dynamics(
        tool.model,
        tool.motion,
        tool.input(LOADS),
        lowpass=tool.cutoff if tool.cutoff > 0.0 else None,
    )
    return {name: known[f"{name}_moment"] for name in names if f"{name}_moment" in known.columns}


def activation_numbers(folder: Folder, file: Path, muscles: Sequence[str]) -> Numbers:
    """In how much of the time muscles are fully active."""
    table, most = folder.table(file), 0
    for place, label in enumerate(table.columns):
        name = label.removesuffix("/activation").removesuffix(".activation").rpartition("/")[2]
        if name not in muscles or (
            label != name and not label.endswith(("/activation", ".activation"))
        ):
            continue
        full = np.flatnonzero(table.rows[:, place] >= FULL)
        if len(full):
            most += 1
            share, time = 100.0 * len(full) / len(table.times), table.times[full[0]]
            of, at = (
                f"share of the time that '{name}' is fully active",
                folder.place(file, int(full[0])),
            )
            yield (
                file,
                Number(
                    "full-activation", "share", of, share, "%", where=f"first at {time:g} s", at=at
                ),
            )
    if not most:
        yield (
            file,
            Number(
                "full-activation",
                "share",
                "share of the time that any muscle is fully active",
                0.0,
                "%",
            ),
        )
