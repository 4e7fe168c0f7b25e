"""Measurements of loads: which foot a load acts on, and which weight the plates carry."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.errors import OsimliteError
from osimlite.io.tables.storage import StoTable
from osimlite.lint.config import Config
from osimlite.lint.engine import load_subject
from osimlite.lint.setup import Setup, select_members
from osimlite.lint.trial import Measurement
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.prescribed import ExternalForce
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.tools.evidence import STANCE_FORCE_N, split_side
from osimlite.tools.trials.fit import Numbers
from osimlite.tools.trials.folder import LOADS, MissingInput, TrialTool

TIME_COUNT = 24
"""Number of times at which the distance of a large load from the feet is measured."""
LARGE_FRACTION = 0.2
"""Fraction of its largest value above which a load is large."""
MIN_DURATION_S = 0.3
"""Shortest time over which the weight is averaged, s."""
MIN_WEIGHT_FRACTION = 0.05
"""Fraction of the weight above which a foot stands on a plate."""


class TrialLoad(NamedTuple):
    """Force that was measured."""

    item: ExternalForce  # force of the document
    force: Array  # force in its frame (t, 3), N
    point: Array | None  # point in its frame (t, 3), m; None if not measured


class LoadScale(NamedTuple):
    """Scales of residuals.

    The force is the largest external force (N); the moment is its product with the height of the
    mass centre (N m).
    """

    force: float = float("nan")
    moment: float = float("nan")


def read_loads(tool: TrialTool) -> tuple[Path, StoTable, list[TrialLoad]]:
    """Read the loads of a tool that are on.

    Returns:
        File of the loads; table of their data; and the loads.

    Raises:
        MissingInput: the setup names no loads, or their file does not exist.
    """
    file = tool.require_input(LOADS)
    document, table = tool.folder.read_loads(file)
    return file, table, list(_select_loads(select_members(document, "ExternalForce"), table))


def _select_loads(forces: Sequence[ExternalForce], table: StoTable) -> Iterator[TrialLoad]:
    """Yield the loads that are on and have data."""
    for external_force in forces:
        force = _read_vectors(table, external_force.force_identifier)
        if external_force.appliesForce and force is not None:
            yield TrialLoad(
                external_force, force, _read_vectors(table, external_force.point_identifier)
            )


def _read_vectors(table: StoTable, identifier: str | None) -> Array | None:
    """Return the three columns (t, 3) whose labels begin with an identifier; None without them."""
    start = (identifier or "").strip()
    indices = [
        index for index, label in enumerate(table.columns) if start and label.startswith(start)
    ]
    # OpenSim requires exactly three columns, too.
    return table.rows[:, indices] if len(indices) == 3 else None


def compute_scale(tool: TrialTool) -> LoadScale:
    """Return the scales of residuals from the loads of a tool; NaN without loads."""
    try:
        _, table, loads = read_loads(tool)
    # Without loads, residuals are still compared with the absolute limits.
    except OsimliteError:
        return LoadScale()
    in_span = (table.times >= tool.span[0]) & (table.times <= tool.span[1])
    if not loads or not in_span.any():
        return LoadScale()
    force = float(np.nanmax(np.linalg.norm(sum(load.force[in_span] for load in loads), axis=1)))
    try:
        motion = tool.motion
        up = _find_up(tool)
    except OsimliteError:
        return LoadScale(force)
    # A few poses suffice for a mean height.
    selected = np.unique(np.linspace(0, len(motion.times) - 1, TIME_COUNT).astype(int))
    height = np.mean([motion.mechanism.center_of_mass(motion.values[row]) @ up for row in selected])
    # The lowest point of application is the height of the floor.
    floor = [float(np.median(load.point[in_span] @ up)) for load in loads if load.point is not None]
    return LoadScale(force, force * float(height - (min(floor) if floor else 0.0)))


def _find_up(tool: TrialTool) -> Array:
    """Return the unit vector against gravity; +Y without gravity."""
    gravity = np.asarray(tool.mechanism.gravity)
    size = float(np.linalg.norm(gravity))
    return -gravity / size if size else np.array([0.0, 1.0, 0.0])


def measure_feet(tool: TrialTool) -> Numbers:
    """Yield the share of the time in which each load is nearer to another foot than to its own."""
    file, table, loads = read_loads(tool)
    motion = tool.motion
    setup = load_subject(str(file), Config())
    bodies = [str(load.item.applied_to_body).rpartition("/")[2] for load in loads]
    body_names = {body.name.rpartition("/")[2] for body in motion.mechanism.bodies}
    for load, body_name in zip(loads, bodies, strict=True):
        # Candidates are the bodies of other loads and the same body on the other side.
        other_bodies = {body for body in bodies if body != body_name} | {_mirror_name(body_name)}
        other_bodies = {body for body in other_bodies if body in body_names}
        if load.point is None or body_name not in body_names or not other_bodies:
            continue
        distances = _measure_distances(motion, table, load, [body_name, *sorted(other_bodies)])
        # A load that is never large has no reliable point of application.
        if distances is None:
            continue
        is_nearer_to_other = distances[:, 1:].min(axis=1) < distances[:, 0]
        other_body = sorted(other_bodies)[int(np.argmin(distances[:, 1:].mean(axis=0)))]
        subject = f"share of the time that the force '{load.item.name}' acts nearer to {other_body} than to {body_name}"
        distance_note = (
            f"it acts {distances[:, 0].mean():.2g} m from {body_name} and "
            f"{distances[:, 1:].min(axis=1).mean():.2g} m from {other_body}"
        )
        position = None
        if isinstance(setup, Setup):
            external_force = next(
                (
                    external_force
                    for external_force in setup.find_by_class("ExternalForce")
                    if external_force.name == load.item.name
                ),
                None,
            )
            position = (
                setup.position(external_force, tag="applied_to_body")
                if external_force is not None
                else None
            )
        percentage = 100.0 * float(is_nearer_to_other.mean())
        yield (
            file,
            Measurement(
                "swapped-feet",
                "share",
                subject,
                percentage,
                "%",
                at=position,
                side=distance_note if percentage else "",
            ),
        )


def _mirror_name(name: str) -> str:
    """Return the name of the same part on the other side; "" without a side."""
    stem, side = split_side(name)
    other_side = {"r": "l", "l": "r"}.get(side, "")
    return (
        (f"{stem}_{other_side}" if name.endswith(f"_{side}") else f"{other_side}_{stem}")
        if other_side
        else ""
    )


def _measure_distances(
    motion: RecordedMotion, table: StoTable, load: TrialLoad, bodies: Sequence[str]
) -> Array | None:
    """Return the distances of a load from the mass centres of bodies at times at which it is large.

    Args:
        motion: motion of the trial.
        table: data of the loads.
        load: load of the trial, with its forces and points.
        bodies: names of b bodies.

    Returns:
        Distances (t, b), m; None if the load is never large.
    """
    assert load.point is not None
    sizes = np.linalg.norm(load.force, axis=1)
    is_within = (table.times >= motion.times[0]) & (table.times <= motion.times[-1])
    rows = np.flatnonzero(
        is_within & (sizes > max(STANCE_FORCE_N, LARGE_FRACTION * np.nanmax(sizes, initial=0.0)))
    )
    if not len(rows):
        return None
    mechanism = motion.mechanism
    result = []
    bodies_by_name = {body.name.rpartition("/")[2]: body for body in mechanism.bodies}
    for row in np.unique(rows[np.linspace(0, len(rows) - 1, TIME_COUNT).astype(int)]):
        # Loads are sampled faster than motions; the nearest pose is near enough for a distance of
        # feet.
        q = motion.values[int(np.argmin(np.abs(motion.times - table.times[row])))]
        point = load.point[row]
        frame = str(load.item.point_expressed_in_body).rpartition("/")[2]
        if frame != "ground":
            # Points may be expressed in a moving body, such as a treadmill.
            point = mechanism.station_position(frame, point, q)
        centres = [
            mechanism.station_position(name, bodies_by_name[name].mass_properties.center, q)
            for name in bodies
        ]
        result.append([float(np.linalg.norm(point - centre)) for centre in centres])
    return np.array(result)


def measure_weight(tool: TrialTool) -> Numbers:
    """Yield the difference of the model's mass from the mass that the plates carry.

    Raises:
        MissingInput: there are no loads or no mass, a load is not expressed in ground, or no foot
            stands on a plate for long enough.
    """
    _, table, loads = read_loads(tool)
    motion = tool.motion
    up = _find_up(tool)
    gravity = float(np.linalg.norm(tool.mechanism.gravity))
    mass = tool.mechanism.total_mass
    if not loads or not mass or not gravity:
        raise MissingInput(f"{tool} has no loads on a model with a mass")
    # Forces in different frames cannot be added.
    if any(str(load.item.force_expressed_in_body).rpartition("/")[2] != "ground" for load in loads):
        raise MissingInput(f"the loads of {tool} are not expressed in ground")
    lift: Any = sum(load.force for load in loads) @ up
    times = table.times
    start = max(times[0], motion.times[0], tool.span[0])
    end = min(times[-1], motion.times[-1], tool.span[1])
    loaded_rows = np.flatnonzero(
        (times >= start) & (times <= end) & (lift > MIN_WEIGHT_FRACTION * mass * gravity)
    )
    if len(loaded_rows) < 2 or times[loaded_rows[-1]] - times[loaded_rows[0]] < MIN_DURATION_S:
        raise MissingInput(f"no foot stands on a plate for {MIN_DURATION_S:g} s in {tool}")
    in_span = slice(int(loaded_rows[0]), int(loaded_rows[-1]) + 1)
    start = float(times[in_span][0])
    end = float(times[in_span][-1])
    mean = float(np.trapezoid(lift[in_span], times[in_span])) / (end - start)
    # Speeds of an unfiltered motion are mostly noise.
    smooth = motion.apply_lowpass(tool.cutoff) if tool.cutoff > 0.0 else motion
    speeds = [_compute_rising_speed(smooth, time, up) for time in (start, end)]
    # Newton's second law over the interval: mean lift = m (g + change of speed / duration).
    carried_mass = mean / (gravity + (speeds[1] - speeds[0]) / (end - start))
    subject = f"the difference between the model's mass, {mass:.4g} kg, and {carried_mass:.4g} kg on the plates"
    interval_note = f"mean from {start:.4g} to {end:.4g} s"
    value = 100.0 * abs(mass / carried_mass - 1.0) if carried_mass > 0.0 else float("inf")
    yield (
        tool.model_file,
        Measurement("measured-weight", "difference", subject, value, "%", where=interval_note),
    )


def _compute_rising_speed(motion: RecordedMotion, time: float, up: Array) -> float:
    """Return the upward speed of the mass centre at a time, m/s.

    Args:
        motion: motion of the trial.
        time: time, s.
        up: unit vector upwards.
    """
    row = int(np.argmin(np.abs(motion.times - time)))
    rates = motion.rates[0][row]
    speeds = motion.mechanism.speeds_from_rates(motion.values[row], rates)
    return float(motion.mechanism.center_of_mass_velocity(motion.values[row], speeds) @ up)
